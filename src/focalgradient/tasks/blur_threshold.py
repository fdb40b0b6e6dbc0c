"""Task: threshold of blur or of depth from blur, with two intervals and an adaptive procedure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.files.columns import Column
from focalgradient.scales import Control, Ways
from focalgradient.tasks.base import Task, paper_settings
from focalgradient.tasks.columns import DROPPED, REPETITION, SCENE, SITTING, STIMULUS, TRIAL
from focalgradient.tasks.steps import Step

__all__ = ["BlurThreshold"]

COLUMNS: tuple[Column, ...] = (
    TRIAL,
    SCENE,
    Column("interval", "Number of the interval to which the level was added.", "integer", least=1),
    Column(
        "level",
        "Increment: dioptres of defocus, or millimetres of aperture if depth is judged.",
        "number",
        above=0,
    ),
    Column("answer", "Number of the chosen interval.", "integer", least=1),
    Column("correct", "Whether the chosen interval is the one to which the level was added.", "bool"),
    REPETITION,
    Column("catch", "Whether the trial shows the greatest level, and does not count for the threshold.", "bool"),
    Column("onset", "When the first picture appeared, on the clock of the sitting.", "number", "s", least=0),
    Column("response_time", "From the question to the answer.", "number", "s", least=0),
    DROPPED,
    STIMULUS,
    SITTING,
)


class BlurThreshold(Task):
    """Adaptive blur threshold: the blur that is just noticed, or that just makes a picture look deeper.

    Each trial shows one scene twice, with added blur in one of two intervals (2IFC), and asks in which. QUEST+ chooses
    the blur from all answers so far; the pictures are blurred during the grey pause before the trial. Requires the
    extra `thresholds`.
    """

    name: ClassVar[str] = "blurthreshold"
    title: ClassVar[str] = "Threshold of blur, or of depth from blur, by an adaptive procedure"
    command: ClassVar[str] = "blur-threshold"
    modelled: ClassVar[bool] = True
    observer_s: ClassVar[float] = 1.5

    @property
    def design(self) -> type[Any]:
        from focalgradient.design.blur_threshold import BlurThresholdDesign

        return BlurThresholdDesign

    @property
    def answer(self) -> type[Any]:
        from focalgradient.dataset.answers import Chosen

        return Chosen

    def pictures(
        self, design: Any, trial: Any, stimuli: Any, pixels_per_degree: float | None, seed: int = 0
    ) -> dict[str, str | NDArray[np.uint8]]:
        return {} if stimuli is None else {"picture": stimuli.picture(trial.scene, "pinhole", design.fixation).png}

    def columns(self, settings: Mapping[str, Any] | None = None) -> tuple[Column, ...]:
        return COLUMNS

    def settings(self) -> str:
        return paper_settings("blur_threshold")

    def pages(self, design: Any, words: Any, participant: str, browser: bool) -> Any:
        from focalgradient.design.threshold_pages import ThresholdPages

        return ThresholdPages(design, words, participant, browser)

    def needed(self, design: Any) -> Sequence[tuple[str, str, str, Mapping[str, str]]]:
        return [(scene, "pinhole", design.fixation, {}) for scene in design.scenes]

    def adapted(self, design: Any, trial: Any, recorded: Sequence[Mapping[str, Any]]) -> Any:
        return design.adapted(trial, recorded)

    def shown(
        self, design: Any, trial: Any, pixels_per_degree: float, *, seed: int = 0, stimuli: Any = None
    ) -> list[Step]:
        place = stimuli.scene(trial.scene).target(design.fixation).position_px
        steps = []
        for number, mark_s in ((1, design.mark_s), (2, 0.0)):
            event, added = ("picture", trial.level) if number == trial.interval else ("reference", 0.0)
            picture = stimuli.blurred(design, trial.scene, design.pedestal + added)
            steps.append(Step(picture, design.picture_s, event, place if mark_s else None, mark_s))
        return steps

    def control(self, words: Any, trial: Any, *, design: Any = None) -> Control:
        return Ways(words(f"blur.question_{design.judged}"), (words("depth.first"), words("depth.second")))

    def answered(self, design: Any, trial: Any, value: float, **times: Any) -> Any:
        chosen = int(value)
        return self.answer(level=trial.level, answer=chosen, correct=chosen == trial.interval, **times)

    def right(self, design: Any, trial: Any, answer: Any) -> bool | None:
        return bool(answer.correct)

    def check_answer(self, design: Any, trial: Any, answer: Any) -> None:
        if not design.is_level(answer.level):
            raise InputError(f"level is {answer.level:g}, but must be one of the design's levels.")
        if trial.catch and answer.level != design.levels[-1]:
            greatest = f"catch trials have the greatest, {design.levels[-1]:g}"
            raise InputError(f"level is {answer.level:g}, but {greatest}: give that.")
        if answer.correct is not (answer.answer == trial.interval):
            raise InputError(f"correct is {answer.correct}, which contradicts the answer: compare it with interval.")

    def picture_file(
        self, design: Any, shown: Mapping[str, Any], pictures: Mapping[tuple[str, ...], str]
    ) -> str | None:
        return pictures.get((shown["scene"], "pinhole", design.fixation))
