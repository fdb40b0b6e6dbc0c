"""Task of Experiment 1: three-dimensionality of pictures by aperture and fixation."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from focalgradient.files.columns import Column
from focalgradient.scales import AnswerColumn, Control, Scale, scale_of
from focalgradient.tasks.base import Task, paper_settings
from focalgradient.tasks.columns import REPETITION, SCENE, TRIAL, judged
from focalgradient.tasks.noted import START_ABOUT, Noted
from focalgradient.tasks.response import check_rating
from focalgradient.tasks.steps import Step

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
        "Largest distance of a gaze fixation from the object to be fixated, while pictures were shown; n/a if the eyes "
        "were lost for half of the time, or made no fixation.",
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
    own = [
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
        *own,
    ]
    return tuple(columns)


class DepthRating(Task):
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

    @property
    def design(self) -> type[Any]:
        from focalgradient.design.depth_rating import DepthRatingDesign

        return DepthRatingDesign

    @property
    def answer(self) -> type[Any]:
        from focalgradient.dataset.answers import Rated

        return Rated

    def pictures(
        self, design: Any, trial: Any, stimuli: Any, pixels_per_degree: float | None, seed: int = 0
    ) -> dict[str, str | NDArray[np.uint8]]:
        if stimuli is None:
            return {}
        shown = {"picture": (trial.scene, trial.aperture, trial.fixation)}
        if design.response_scale.intervals > 1 or design.reference == "same-scene":
            shown["reference"] = design.reference_of(trial)
        found: dict[str, str | NDArray[np.uint8]] = {}
        for column, (scene, aperture, fixation) in shown.items():
            drawing = stimuli.drawing(scene)
            found[column] = (
                stimuli.picture(scene, aperture, fixation, trial.factors).png if drawing is None else drawing
            )
        return found

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

    def further(self, design: Any, words: Any, trial: Any) -> Mapping[str, tuple[Control, Noted]]:
        """Return the question of confidence, if the design asks it, and those of the design's `also`."""
        asked = super().further(design, words, trial)
        if not design.confidence:
            return asked
        ends = (words("scale.not_sure"), words("scale.quite_sure"))
        sure = Scale(words("scale.sure"), "", 0.0, 1.0, ratios=False, ends=ends)
        return {"confidence": (sure, Noted(None)), **asked}

    def right(self, design: Any, trial: Any, answer: Any) -> bool | None:
        found: bool | None = design.right(trial, answer.rating)
        return found

    def settings(self) -> str:
        return paper_settings("depth_rating")

    def pages(self, design: Any, words: Any, participant: str, browser: bool) -> Any:
        from focalgradient.design.rating_pages import RatingPages

        return RatingPages(design, words, participant, browser)

    def needed(self, design: Any) -> Sequence[tuple[str, str, str, Mapping[str, str]]]:
        found: list[tuple[str, str, str, dict[str, str]]] = design.pictures()
        return found

    def shown(
        self, design: Any, trial: Any, pixels_per_degree: float, *, seed: int = 0, stimuli: Any = None
    ) -> list[Step]:
        order = [("picture", (trial.scene, trial.aperture, trial.fixation), design.picture_s, True)]
        if design.response_scale.intervals > 1:
            order.insert(2 - trial.interval, ("reference", design.reference_of(trial), design.picture_s, True))
        elif design.reference == "same-scene":
            order.insert(0, ("reference", design.reference_of(trial), design.reference_s, False))
        steps = []
        for number, (event, (scene, aperture, fixation), seconds, is_judged) in enumerate(order):
            picture = stimuli.drawing(scene)
            if picture is None:
                picture = stimuli.picture(scene, aperture, fixation, trial.factors)
            else:
                scene = design.standard_scene  # whose mark a drawing has
            mark = stimuli.scene(scene).target(fixation).position_px, design.mark_s, design.mark == "kept"
            mask = stimuli.mask((seed, number)) if design.mask == "noise" and design.mask_s else None
            steps.append(Step(picture, seconds, event, *mark, mask, design.mask_s, is_judged))
        return steps

    def standard(self, design: Any, form: str, pixels_per_degree: float, stimuli: Any, words: Any) -> Step:
        picture = stimuli.picture(design.standard_scene, "pinhole", design.fixations[0])
        return Step(picture, design.standard_s, "standard")

    def control(self, words: Any, trial: Any, *, design: Any = None) -> Control:
        control: Control = design.response_scale.control(words)
        return control

    def answered(self, design: Any, trial: Any, value: float, **times: Any) -> Any:
        return self.answer(rating=design.response_scale.answer_in(value, trial.interval), **times)

    def check_answer(self, design: Any, trial: Any, answer: Any) -> None:
        check_rating(design, answer)

    def picture_file(
        self, design: Any, shown: Mapping[str, Any], pictures: Mapping[tuple[str, ...], str]
    ) -> str | None:
        levels = sorted(name for name, factor in design.factors.items() if factor.pictures)
        key = (shown["scene"], shown["aperture"], shown["fixation"])
        return pictures.get((*key, *(f"{name}={shown['factors'][name]}" for name in levels)))
