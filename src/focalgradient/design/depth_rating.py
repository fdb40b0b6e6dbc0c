"""Experiment 1: rated depth of pictures, by aperture and fixated object."""

from __future__ import annotations

import re
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from focalgradient.design.draws import Draws
from focalgradient.design.factors import Factor, between, check_factors, crossed
from focalgradient.design.plan import (
    Breaks,
    Count,
    Names,
    OrNone,
    Plan,
    Repetitions,
    Rounds,
    Scenes,
    Seconds,
    Share,
    Trial,
    UpTo100,
    no_repeats,
)
from focalgradient.errors import InputError
from focalgradient.scales import ResponseScale, scale_class, scale_of

__all__ = ["EXAMPLES", "CatchPicture", "DepthRatingDesign", "DepthTrial", "Fixation", "aperture_mm"]

CatchPicture = Literal["standard", "flatter", "deeper"]
"""Stimulus of a catch trial: the standard, or a drawing that looks clearly flatter or clearly deeper."""

EXAMPLES: dict[str, str] = {"flatter": "example-flat", "deeper": "example-deep"}
"""Scenes of the drawings: a frontal tiled wall, and a tiled corridor. They are drawn by the program."""

Fixation = str
"""Object that is fixated and in focus: "nearest", "farthest", or a user-defined name."""

FIXATION = re.compile(r"[A-Za-z][A-Za-z0-9_]*")

F_NUMBER = re.compile(r"f/(\d+(?:\.\d+)?)")


def aperture_mm(aperture: str, focal_length_mm: float) -> float:
    """Return the diameter of an aperture in mm: 0 for a pinhole, focal length / N for f/N.

    Raises
    ------
    InputError
        If `aperture` is neither "pinhole" nor an f-number.

    Examples
    --------
    >>> aperture_mm("f/5.6", 28), aperture_mm("pinhole", 28)
    (5.0, 0.0)
    """
    if aperture == "pinhole":
        return 0.0
    found = F_NUMBER.fullmatch(aperture)
    if not (found and float(found[1]) > 0):
        raise InputError(f"aperture is {aperture!r}, but must be 'pinhole' or an f-number like 'f/5.6'.")
    return focal_length_mm / float(found[1])


@lru_cache(maxsize=64)
def _scale(settings: tuple[tuple[str, Any], ...]) -> ResponseScale:
    return scale_of(dict(settings))


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthTrial(Trial):
    """Rating trial with one picture.

    Parameters
    ----------
    scene, aperture, fixation
        Picture, and object that is fixated and in focus.
    aperture_mm
        Diameter of the aperture in mm; 0 for a pinhole.
    standard_before
        Whether the standard, a pinhole picture with the value 1, is shown before the trial.
    interval
        Interval of the picture in a choice between two, 1 or 2; 0 on other scales.
    factors
        Level of each user-defined factor.
    """

    scene: str
    aperture: str
    aperture_mm: float
    fixation: Fixation
    standard_before: bool = False
    interval: int = 0
    factors: Mapping[str, str] = field(default_factory=dict, hash=False)

    @property
    def condition(self) -> tuple[Hashable, ...]:
        """Picture, fixated object and levels of factors."""
        return (self.scene, self.aperture, self.fixation, *self.factors.values())


class DepthRatingDesign(Plan):
    """Design of experiment 1: apertures x fixations x scenes x repetitions.

    Examples
    --------
    >>> design = DepthRatingDesign()
    >>> trials = design.trials("01")
    >>> len(trials), [trial.phase for trial in trials].count("practice")
    (204, 6)
    """

    task: Literal["depthrating"] = "depthrating"
    apertures: Annotated[Names, Field(description="a list of 'pinhole' and f-numbers, like ['pinhole', 'f/22']")] = (
        "pinhole",
        "f/22",
        "f/11",
        "f/5.6",
    )
    focal_length_mm: Annotated[float, Field(gt=0, le=1000, description="a positive number of millimetres")] = 50.0
    fixations: Annotated[Names, Field(description="a list of 'nearest', 'farthest' and names of one's own")] = (
        "nearest",
        "farthest",
    )
    fixation_order: Literal["mixed", "blocked"] = "mixed"
    scenes: Scenes = tuple(f"spheres-{number:02}" for number in range(1, 13))
    standard_scene: Annotated[str, Field(min_length=1, description="the name of a scene")] = "spheres-00"
    standard_every: Annotated[int, Field(ge=0, description="a whole number of trials, or 0 for once only")] = 16
    repetitions: Repetitions = 2
    factors: Annotated[dict[str, Factor], Field(description="tables of factors, like [factors.light]")] = Field(
        default_factory=dict
    )
    catch_trials: Count = 6
    catch_pictures: Annotated[tuple[CatchPicture, ...], Field(min_length=1)] = ("standard", "flatter", "deeper")
    practice_trials: UpTo100 = 6
    break_every: Breaks = 49

    least_break_s: OrNone = 10.0
    practice_right: Share = 1.0
    practice_rounds: Rounds = 3
    practice_required: bool = False

    scale: Annotated[str, Field(description="the name of a response scale, like 'ratio'")] = "ratio"
    steps: Annotated[int, Field(ge=2, le=21)] = 7
    labels: Annotated[tuple[str, ...], Field(description="a list of texts, one a step or one an end")] = ()
    reference: Literal["standard", "same-scene"] = "standard"
    reference_s: Seconds = 2.0
    mark_s: Seconds = 1.0
    mark: Literal["removed", "kept"] = "removed"
    picture_s: Seconds = 3.0
    standard_s: Seconds = 5.0
    blank_s: OrNone = 0.5
    mask: Literal["none", "noise"] = "none"
    mask_s: OrNone = 0.2
    pause_s: OrNone = 0.5
    answer: Literal["slider", "typed"] = "slider"
    least_rating: Annotated[float, Field(gt=0, lt=1, description="a number between 0 and 1, like 0.25")] = 0.25
    most_rating: Annotated[float, Field(gt=1, le=1000, description="a number above 1, like 4.0")] = 4.0
    confidence: bool = False
    gaze: Literal["none", "mouse", "tracker"] = "none"
    gaze_within_deg: Annotated[float, Field(gt=0, le=90, description="a number of degrees above 0, like 2.0")] = 2.0

    shortened: ClassVar = {
        "repetitions": 1,
        "scenes": 1,
        "catch_trials": 1,
        "practice_trials": 1,
        "picture_s": 1.0,
        "least_break_s": 1.0,
        "practice_rounds": 1,
    }
    closed: ClassVar[tuple[str, ...]] = ("scene", "aperture", "fixation")

    @model_validator(mode="after")
    def _check(self) -> DepthRatingDesign:
        for key in ("apertures", "fixations", "scenes"):
            no_repeats(key, getattr(self, key))
        for fixation in self.fixations:
            if not FIXATION.fullmatch(fixation):
                raise ValueError(
                    f"fixations names {fixation!r}, but a name must begin with a letter and contain only letters, "
                    "digits and _: give another, in the table of the pictures too."
                )
        for aperture in self.apertures:
            aperture_mm(aperture, self.focal_length_mm)
        no_repeats("catch_pictures", self.catch_pictures)
        check_factors(self.factors)
        self._check_scale()
        self.check_counts(len(self._seen({})))
        self.trials("01")  # some orders are impossible: raise before the participant arrives
        return self

    @property
    def response_scale(self) -> ResponseScale:
        """Response scale defined by the settings that its class has, made once for equal settings."""
        names = ("scale", *scale_class(self.scale).settings())
        return _scale(tuple((name, getattr(self, name)) for name in names if hasattr(self, name)))

    def _check_scale(self) -> None:
        scale = self.response_scale
        if self.labels and not hasattr(scale, "labels"):
            raise ValueError(
                f"labels has {len(self.labels)} texts, but scale {self.scale!r} takes none: leave labels out."
            )
        if scale.standard is None and self.catch_pictures == ("standard",) and self.catch_trials:
            raise ValueError(
                f"catch_pictures has only the standard, for which the scale {self.scale!r} has no correct answer: add "
                "'flatter' and 'deeper'."
            )
        if scale.intervals > 1 and self.confidence:
            raise ValueError("confidence is true, but a choice between two has no confidence rating: leave it out.")
        if scale.intervals > 1 and self.reference == "same-scene" and set(self.apertures) == {"pinhole"}:
            raise ValueError("apertures has only the pinhole, which is the reference itself: add another.")

    def right(self, trial: DepthTrial, rating: float) -> bool | None:
        """Return whether the answer to a drawing is correct; None for any other picture.

        >>> design = DepthRatingDesign()
        >>> flat = DepthTrial(scene="example-flat", aperture="pinhole", aperture_mm=0.0, fixation="nearest")
        >>> design.right(flat, 0.5), design.right(flat, 2.0)
        (True, False)
        """
        side = self.right_side(trial)
        if side is None:
            return None
        return rating < side["below"] if "below" in side else rating > side["above"]

    def right_side(self, trial: DepthTrial) -> dict[str, float] | None:
        """Return the bound that a correct answer must be "below" or "above"; None if any answer is acceptable.

        >>> design = DepthRatingDesign()
        >>> design.right_side(DepthTrial(scene="example-flat", aperture="pinhole", aperture_mm=0.0, fixation="nearest"))
        {'below': 1.0}
        """
        if trial.scene not in EXAMPLES.values():
            return None
        return {"below" if trial.scene == EXAMPLES["flatter"] else "above": self.response_scale.middle}

    @property
    def has_standard(self) -> bool:
        """Whether the standard serves as reference with the value 1 (or "equal"), and is shown repeatedly."""
        return self.response_scale.standard is not None and self.reference == "standard"

    @property
    def shows_drawings(self) -> bool:
        """Whether practice or catch trials show the drawings.

        >>> DepthRatingDesign().shows_drawings, DepthRatingDesign(catch_trials=0, practice_trials=0).shows_drawings
        (True, False)
        """
        return any(trial.scene in EXAMPLES.values() for trial in self.trials("01"))

    def reference_of(self, trial: DepthTrial) -> tuple[str, str, Fixation]:
        """Return scene, aperture and fixation of the picture with which a trial's picture is compared."""
        own = self.reference == "same-scene" and trial.scene not in EXAMPLES.values()
        return (trial.scene if own else self.standard_scene, "pinhole", trial.fixation)

    @property
    def picture_factors(self) -> tuple[str, ...]:
        """Factors whose levels are different pictures."""
        return tuple(name for name, factor in self.factors.items() if factor.pictures)

    def pictures(self) -> list[tuple[str, str, str, dict[str, str]]]:
        """List the required pictures: scene, aperture, fixation, and levels of the picture factors."""
        scenes = (*self.scenes, self.standard_scene)
        standard = [(self.standard_scene, "pinhole", fixation) for fixation in self.fixations]
        own = product(scenes, ["pinhole"], self.fixations) if self.reference == "same-scene" else ()
        shown = [*product(scenes, self.apertures, self.fixations), *standard, *own]
        return [(*one, levels) for one, levels in product(shown, crossed(self.factors, self.picture_factors))]

    @property
    def shown_s(self) -> float:
        """Time in s from the onset of a trial's (first) picture to the question."""
        mask = self.mask_s if self.mask != "none" else 0.0
        once = self.picture_s + mask + self.blank_s
        return once + (self.response_scale.intervals - 1) * (self.mark_s + once)

    def least_s(self, trial: DepthTrial) -> float:
        """Return the minimum time in s from one answer to the next question, including the standard.

        >>> design = DepthRatingDesign()
        >>> design.least_s(design.trials("01")[-1])
        5.0
        """
        mask = self.mask_s if self.mask != "none" else 0.0
        each = self.mark_s + mask + self.blank_s
        before = self.standard_s if trial.standard_before else 0.0
        if self.response_scale.intervals > 1:
            before += each + self.picture_s
        elif self.reference == "same-scene":
            before += each + self.reference_s
        return self.pause_s + before + each + self.picture_s

    def trials(self, participant: str, session: str | None = None) -> tuple[DepthTrial, ...]:
        """Return the trial list of one participant, practice first.

        Raises
        ------
        InputError
            If a label is not alphanumeric.
        """
        levels = between(self.factors, self.place(participant).pair)
        seen = self._seen(levels)
        blocks = [seen] * self.repetitions
        if self.fixation_order == "blocked":
            first = self.draws(participant, session, "first fixation").shuffled(self.fixations)
            blocks = [[trial for trial in seen if trial.fixation == fixation] for fixation in first] * self.repetitions
        for name, factor in self.factors.items():
            if factor.order == "blocked":
                ordered = self.draws(participant, session, f"first {name}").shuffled(factor.levels)
                blocks = [[one for one in block if one.factors[name] == level] for level in ordered for block in blocks]
        listed = self.listed(
            participant,
            session,
            blocks=blocks,
            factors=self._in_runs,
            catches=lambda draws: self._with_levels(self._catches(draws), levels, draws),
            practice=lambda draws: self._with_levels(self._practice(draws), levels, draws),
        )
        if self.has_standard:
            due = range(1, len(listed) + 1)[:: self.standard_every or len(listed)]
            listed = tuple(
                replace(trial, standard_before=trial.phase == "main" and trial.trial in due) for trial in listed
            )
        if self.response_scale.intervals == 1:
            return listed
        mirrored = self.place(participant).mirrored
        halves = self._first_halves(seen, self.draws(participant, session, "intervals"))
        own = self.draws(participant, session, "own intervals, mirrored" if mirrored else "own intervals")
        others = {
            group: iter(own.rounds((0, 1), len(listed))) for group in (("practice", False), ("main", True))
        }  # of practice and catch trials
        return tuple(
            replace(
                trial,
                interval=1 + (halves[trial.condition] + trial.repetition + mirrored) % 2
                if (trial.phase, trial.catch) not in others
                else 1 + next(others[trial.phase, trial.catch]),
            )
            for trial in listed
        )

    @staticmethod
    def _first_halves(seen: Sequence[DepthTrial], draws: Draws) -> dict[Hashable, int]:
        """Return 0 or 1 for each condition: the interval of its first presentation, balanced over the scenes."""
        groups: dict[Hashable, list[Hashable]] = {}
        for trial in seen:
            groups.setdefault(trial.condition[1:], []).append(trial.condition)
        return {
            condition: half
            for number, group in enumerate(groups.values())
            for condition, half in zip(
                group, draws.shuffled((number + place) % 2 for place in range(len(group))), strict=True
            )
        }

    def _seen(self, levels: Mapping[str, str]) -> list[DepthTrial]:
        """Return each condition of a participant once."""
        twice = "pinhole" if self.response_scale.intervals > 1 and self.reference == "same-scene" else None
        apertures = [one for one in self.apertures if one != twice]  # a picture is not compared with itself
        within = crossed(self.factors, [name for name, factor in self.factors.items() if factor.vary == "within"])
        return [
            replace(self._trial(scene, aperture, fixation), factors=self._ordered({**levels, **own}))
            for scene, aperture, fixation, own in product(self.scenes, apertures, self.fixations, within)
        ]

    def _ordered(self, levels: Mapping[str, str]) -> dict[str, str]:
        return {name: levels[name] for name in self.factors if name in levels}

    def _in_runs(self, trial: DepthTrial) -> tuple[Hashable, ...]:
        """Return the levels whose runs are limited, which excludes those that are constant within a block."""
        mixed = [name for name, factor in self.factors.items() if factor.order == "mixed"]
        fixation = (trial.fixation,) if self.fixation_order == "mixed" else ()
        return (trial.scene, trial.aperture, *fixation, *(trial.factors[name] for name in mixed))

    def _with_levels(self, trials: Sequence[DepthTrial], levels: Mapping[str, str], draws: Draws) -> list[DepthTrial]:
        """Assign factor levels to practice and catch trials: the participant's, and within factors in random order."""
        if not self.factors:
            return list(trials)
        within = {
            name: draws.shuffled([factor.levels[number % len(factor.levels)] for number in range(len(trials))])
            for name, factor in self.factors.items()
            if factor.vary == "within"
        }
        return [
            replace(one, factors=self._ordered({**levels, **{name: of[number] for name, of in within.items()}}))
            for number, one in enumerate(trials)
        ]

    def _trial(self, scene: str, aperture: str, fixation: Fixation) -> DepthTrial:
        diameter = aperture_mm(aperture, self.focal_length_mm)
        return DepthTrial(scene=scene, aperture=aperture, aperture_mm=diameter, fixation=fixation)

    def _examples(self) -> list[CatchPicture]:
        """Return the kinds of catch pictures that have a correct answer on the scale."""
        wrong = ("standard",) if self.response_scale.standard is None else ()
        return [kind for kind in self.catch_pictures if kind not in wrong]

    def _catches(self, draws: Draws) -> list[DepthTrial]:
        """Return catch trials: the standard, whose correct answer is 1, and drawings clearly flatter or deeper."""
        kinds = self._examples()
        numbers = range(self.catch_trials)
        ways = [
            (kinds[number % len(kinds)], self.fixations[number // len(kinds) % len(self.fixations)])
            for number in numbers
        ]
        return [
            replace(self._trial(EXAMPLES.get(kind, self.standard_scene), "pinhole", fixation), catch=True)
            for kind, fixation in draws.shuffled(ways)
        ]

    def _practice(self, draws: Draws) -> list[DepthTrial]:
        """Return practice trials: balanced apertures and fixations in the standard's scene, and drawings."""
        examples = [EXAMPLES[kind] for kind in self.catch_pictures if kind in EXAMPLES]
        if self.practice_trials <= len(examples):
            examples = []
        two = self.response_scale.intervals > 1
        apertures = [one for one in self.apertures if not (two and one == "pinhole")] or self.apertures
        pairs = draws.rounds(product(apertures, self.fixations), self.practice_trials - len(examples))
        listed = [self._trial(self.standard_scene, *pair) for pair in pairs]
        if not examples:
            return listed
        return draws.shuffled([*listed, *(self._trial(scene, "pinhole", self.fixations[0]) for scene in examples)])
