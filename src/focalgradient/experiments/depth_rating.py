"""Task of Experiment 1: three-dimensionality of pictures by aperture and fixation."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from focalgradient.dataset import Rated
from focalgradient.design.depth_rating import DepthRatingDesign, DepthTrial
from focalgradient.design.sequence import Page, Pages, Standard
from focalgradient.design.words import Words
from focalgradient.files.columns import Column
from focalgradient.scales import AnswerColumn, Control, Scale, scale_of
from focalgradient.tasks.base import Task
from focalgradient.tasks.columns import AWAY_ABOUT, REPETITION, SCENE, TRIAL, judged
from focalgradient.tasks.noted import START_ABOUT, Noted
from focalgradient.tasks.response import check_rating
from focalgradient.tasks.steps import Pictured, Step

if TYPE_CHECKING:
    import pandas as pd

    from focalgradient.statistics.criteria import AnalysisOptions
    from focalgradient.statistics.questions import Analysis
    from focalgradient.stimuli import Picture, StimulusSet

__all__ = ["DepthRating"]

COLUMNS: tuple[Column, ...] = (
    TRIAL,
    SCENE,
    Column("aperture", "Aperture of the picture: pinhole, or f-number.", "text"),
    Column("aperture_mm", "Diameter of the aperture; 0 for the pinhole.", "number", "mm", least=0),
    Column(
        "fixation",
        "The object to be fixated, which is in focus.",
        "text",
        levels={"nearest": "the nearest object of the scene", "farthest": "the farthest object of the scene"},
    ),
    REPETITION,
    Column("catch", "Whether the trial shows the standard itself, whose rating should be 1.", "bool"),
    *judged("the standard, a pinhole picture"),
)

STANDARD_BEFORE = Column("standard_before", "Whether the standard was shown before the trial.", "bool")
START = Column("start", START_ABOUT, "number", optional=True)
INTERVAL = Column(
    "interval",
    "Number of the interval that showed the picture; the other one showed the reference.",
    "integer",
    least=1,
)
GAZE = (
    Column(
        "gaze_away",
        AWAY_ABOUT,
        "number",
        "deg",
        least=0,
        optional=True,
    ),
    Column(
        "gaze_left",
        "Whether gaze_away exceeds gaze_within_deg of the design, or is missing.",
        "bool",
    ),
)


@lru_cache(maxsize=64)
def _depth_columns(
    answer: AnswerColumn, intervals: int, factors: str, fixations: str, gaze: bool
) -> tuple[Column, ...]:
    columns = list(COLUMNS)
    place = {column.name: number for number, column in enumerate(columns)}
    columns[place["rating"]] = answer.rating()
    factor_columns = [
        Column(name, "A factor of the design.", "text", levels=dict.fromkeys(levels, "as the design names it"))
        for name, levels in json.loads(factors).items()
    ]
    known = columns[place["fixation"]].levels
    others = [name for name in json.loads(fixations) if name not in known]
    if others:  # defined by the laboratory
        meanings = dict.fromkeys(others, "as the table of the pictures names it")
        columns[place["fixation"]] = replace(columns[place["fixation"]], levels={**known, **meanings})
    if gaze:
        columns[place["dropped_frames"] + 1 : place["dropped_frames"] + 1] = GAZE
    columns[place["catch"]] = replace(
        columns[place["catch"]], about="Whether the right answer is known: the standard itself, or an example."
    )
    columns.insert(place["rating"] + 1, START)
    columns[place["catch"] + 1 : place["catch"] + 1] = [
        STANDARD_BEFORE,
        *([INTERVAL] if intervals > 1 else []),
        *factor_columns,
    ]
    return tuple(columns)


class RatingPages(Pages):
    """Pages for one participant, in the laboratory or in a browser.

    >>> from focalgradient.design.words import load_words
    >>> RatingPages(DepthRatingDesign(scale="steps", steps=2), load_words("en"), "01").opening()[-1].at
    2.0
    """

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions, and an example that explains the scale."""
        read = self.instructions(*instructions(self.design, self.words, self.escape))
        scale = self.design.response_scale
        if scale.example is None:
            return read
        return *read, Page("example", scale.example_text(self.words), at=scale.example)

    def reminder(self, first: DepthTrial) -> tuple[Standard, ...]:
        """Return the standard, unless the first trial of the sitting is preceded by it."""
        return self._standard(shown=self.design.has_standard and not first.standard_before)

    def lead(self, trial: DepthTrial, previous: DepthTrial | None) -> tuple[Standard, ...]:
        """Return the standard, if the design shows it before the trial."""
        return self._standard(shown=trial.standard_before)

    def _standard(self, *, shown: bool) -> tuple[Standard, ...]:
        return (Standard(standard_text(self.design, self.words)),) if shown else ()

    def again(self) -> Page:
        """Return the page before repeated practice."""
        return Page("feedback", self.words(self.design.response_scale.again))

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing, which mentions the fixated object and the drawings only if the design has them."""
        words, design = self.words, self.design
        drawings = words("depth.about_drawings") if design.shows_drawings else ""
        fixations = words("depth.about_fixation" if len(design.fixations) > 1 else "depth.about_depth")
        return self.debriefing("depth.debriefing", question=fixations, drawings=drawings)


def instructions(design: DepthRatingDesign, words: Words, escape: str) -> tuple[str, str]:
    """Return the two pages of instructions; `escape` states how to stop."""
    scale = design.response_scale
    mark = words("depth.mark_stays" if design.mark == "kept" else "depth.mark_goes")
    answer = words(f"depth.answer_{scale.control(words).how}")
    return scale.instructions(words), words("depth.trial", mark=mark, answer=answer, escape=escape)


def standard_text(design: DepthRatingDesign, words: Words) -> str:
    """Return the page before the standard, which states the standard's value."""
    return words("depth.standard", number=f"{design.response_scale.standard:g}")


class DepthRating(Task[DepthRatingDesign, DepthTrial, Rated]):
    """Experiment 1: rated depth of pictures, by aperture and fixated object.

    Each trial shows a mark on the object to be fixated, then the picture, then asks how three-dimensional it looked: as
    a ratio to the standard (a pinhole picture with the value 1, shown at intervals), or on another scale of the design.
    """

    name: ClassVar[str] = "depthrating"
    title: ClassVar[str] = "Three-dimensionality of pictures by aperture and fixation"
    command: ClassVar[str] = "depth-rating"
    modelled: ClassVar[bool] = True
    observer_s: ClassVar[float] = 0.5
    no_pictures: ClassVar[str] = ""
    settings_of_report: ClassVar[frozenset[str]] = frozenset({"bound", "ordinal", "far_effect"})
    settings_file: ClassVar[str] = "depth_rating"
    pages = RatingPages
    design, trial, answer = DepthRatingDesign, DepthTrial, Rated

    def columns(self, settings: Mapping[str, Any] | None = None) -> tuple[Column, ...]:
        if not isinstance(settings, Mapping) or "scale" not in settings:
            return COLUMNS
        factors = settings.get("factors")
        levels = {
            str(name): [str(level) for level in factor.get("levels", ())]
            for name, factor in (factors if isinstance(factors, Mapping) else {}).items()
            if isinstance(factor, Mapping) and isinstance(factor.get("levels"), Sequence)
        }
        fixations = settings.get("fixations")
        names = [str(name) for name in fixations] if isinstance(fixations, Sequence) else []
        scale = scale_of(settings)
        gaze = settings.get("gaze", "none") != "none"
        return _depth_columns(scale.column, scale.intervals, json.dumps(levels), json.dumps(names), gaze)

    def further(
        self, design: DepthRatingDesign, words: Words, trial: DepthTrial
    ) -> Mapping[str, tuple[Control, Noted]]:
        """Return the question of confidence, if the design asks it, and those of the design's `also`."""
        asked = super().further(design, words, trial)
        if not design.confidence:
            return asked
        ends = (words("scale.not_sure"), words("scale.quite_sure"))
        sure = Scale(words("scale.sure"), "", 0.0, 1.0, ratios=False, ends=ends)
        return {"confidence": (sure, Noted(None)), **asked}

    def needed(self, design: DepthRatingDesign) -> Sequence[Pictured]:
        return design.pictures()

    def pictured(self, design: DepthRatingDesign, trial: DepthTrial) -> Mapping[str, Pictured]:
        levels = {name: trial.factors[name] for name in design.picture_factors}
        shown: dict[str, Pictured] = {"picture": (trial.scene, trial.aperture, trial.fixation, levels)}
        if design.response_scale.intervals > 1 or design.reference == "same-scene":
            shown["reference"] = (*design.reference_of(trial), levels)
        return shown

    def shown(
        self,
        design: DepthRatingDesign,
        trial: DepthTrial,
        pixels_per_degree: float,
        *,
        seed: int = 0,
        stimuli: StimulusSet,
    ) -> list[Step]:
        pictured = self.pictured(design, trial)
        two = design.response_scale.intervals > 1
        order = ["picture", "reference"] if two and trial.interval == 1 else ["reference", "picture"]
        steps = []
        for number, event in enumerate(name for name in order if name in pictured):
            is_judged = two or event == "picture"
            scene, aperture, fixation, levels = pictured[event]
            picture: Picture | NDArray[np.uint8] | None = stimuli.drawing(scene)
            if picture is None:
                picture = stimuli.picture(scene, aperture, fixation, levels)
            else:
                scene = design.standard_scene  # whose mark a drawing has
            mark = stimuli.scene(scene).target(fixation).position_px, design.mark_s, design.mark == "kept"
            mask = stimuli.mask((seed, number)) if design.mask == "noise" and design.mask_s else None
            seconds = design.picture_s if is_judged else design.reference_s
            steps.append(Step(picture, seconds, event, *mark, mask, design.mask_s, is_judged))
        return steps

    def standard(
        self, design: DepthRatingDesign, form: str, pixels_per_degree: float, stimuli: StimulusSet, words: Words
    ) -> Step:
        picture = stimuli.picture(design.standard_scene, "pinhole", design.fixations[0])
        return Step(picture, design.standard_s, "standard")

    def control(self, words: Words, trial: DepthTrial, *, design: DepthRatingDesign) -> Control:
        return design.response_scale.control(words)

    def answered(self, design: DepthRatingDesign, trial: DepthTrial, value: float, **times: Any) -> Rated:
        return Rated(rating=design.response_scale.answer_in(value, trial.interval), **times)

    def analysis(
        self, design: DepthRatingDesign, options: AnalysisOptions | None = None, table: pd.DataFrame | None = None
    ) -> Analysis:
        from focalgradient.statistics.effects import has_confidence, questions_of  # with pandas and SciPy

        fixations = design.fixations if table is None else {*table["fixation"]}
        scenes = len(design.scenes) if table is None else table["scene"].nunique()
        scale = (options and options.scale) or design.response_scale.analysis
        given: dict[str, Any] = {} if options is None else {"bound": options.bound, "rules": options.rules}
        settings = design.model_dump() | {"confidence": design.confidence if table is None else has_confidence(table)}
        return questions_of(scale, fixations, scenes, settings, **given)

    def check_answer(self, design: DepthRatingDesign, trial: DepthTrial, answer: Rated) -> None:
        check_rating(design, answer)

    def right_key(self, design: DepthRatingDesign, trial: DepthTrial, participant: str) -> dict[str, float] | None:
        return design.right_side(trial)

    def right(self, design: DepthRatingDesign, trial: DepthTrial, answer: Rated) -> bool | None:
        return design.right(trial, answer.rating)
