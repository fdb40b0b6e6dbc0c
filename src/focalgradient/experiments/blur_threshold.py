"""Task: threshold of blur or of depth from blur, with two intervals and an adaptive procedure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from focalgradient.dataset import Chosen
from focalgradient.design.blur_threshold import BlurThresholdDesign, BlurTrial, LevelTrial
from focalgradient.design.sequence import Page, Pages
from focalgradient.design.words import Words
from focalgradient.errors import InputError
from focalgradient.files.columns import Column
from focalgradient.scales import Control, Ways
from focalgradient.tasks.base import Task
from focalgradient.tasks.columns import DROPPED, REPETITION, SCENE, SITTING, STIMULUS, TRIAL
from focalgradient.tasks.steps import Pictured, Step

if TYPE_CHECKING:
    import pandas as pd

    from focalgradient.statistics.criteria import AnalysisOptions
    from focalgradient.statistics.questions import Analysis
    from focalgradient.stimuli import StimulusSet

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


class ThresholdPages(Pages):
    """Pages for one participant, in the laboratory or in a browser."""

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        judged = self.words(f"blur.instructions_{self.design.judged}")
        return self.instructions(judged, self.words("blur.trial", escape=self.escape))

    def again(self) -> Page:
        """Return the page before repeated practice."""
        return Page("feedback", self.words("blur.practice_again"))

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing."""
        return self.debriefing("blur.debriefing")


class BlurThreshold(Task[BlurThresholdDesign, Any, Chosen]):
    """Adaptive blur threshold: the blur that is just noticed, or that just makes a picture look deeper.

    Each trial shows one scene twice, with added blur in one of two intervals (2IFC), and asks in which. QUEST+ chooses
    the blur from all answers so far; the pictures are blurred during the grey pause before the trial. Requires the
    extra `thresholds`.
    """

    name: ClassVar[str] = "blurthreshold"
    title: ClassVar[str] = "Threshold of blur, or of depth from blur, by an adaptive procedure"
    command: ClassVar[str] = "blur-threshold"
    modelled: ClassVar[bool] = True
    no_pictures: ClassVar[str] = ""
    observer_s: ClassVar[float] = 1.5
    settings_file: ClassVar[str] = "blur_threshold"
    table: ClassVar[tuple[Column, ...]] = COLUMNS
    pages = ThresholdPages
    design, trial, answer = BlurThresholdDesign, BlurTrial, Chosen

    def needed(self, design: BlurThresholdDesign) -> Sequence[Pictured]:
        return [(scene, "pinhole", design.fixation, {}) for scene in design.scenes]

    def pictured(self, design: BlurThresholdDesign, trial: BlurTrial) -> Mapping[str, Pictured]:
        return {"picture": (trial.scene, "pinhole", design.fixation, {})}

    def adapted(
        self, design: BlurThresholdDesign, trial: BlurTrial, recorded: Sequence[Mapping[str, Any]]
    ) -> LevelTrial:
        return design.adapted(trial, recorded)

    def shown(
        self,
        design: BlurThresholdDesign,
        trial: LevelTrial,
        pixels_per_degree: float,
        *,
        seed: int = 0,
        stimuli: StimulusSet,
    ) -> list[Step]:
        place = stimuli.scene(trial.scene).target(design.fixation).position_px
        steps = []
        for number, mark_s in ((1, design.mark_s), (2, 0.0)):
            event, added = ("picture", trial.level) if number == trial.interval else ("reference", 0.0)
            picture = stimuli.blurred(design, trial.scene, design.pedestal + added)
            steps.append(Step(picture, design.picture_s, event, place if mark_s else None, mark_s))
        return steps

    def control(self, words: Words, trial: BlurTrial, *, design: BlurThresholdDesign) -> Control:
        return Ways(words(f"blur.question_{design.judged}"), (words("depth.first"), words("depth.second")))

    def answered(self, design: BlurThresholdDesign, trial: LevelTrial, value: float, **times: Any) -> Chosen:
        chosen = int(value)
        return Chosen(level=trial.level, answer=chosen, correct=chosen == trial.interval, **times)

    def analysis(
        self, design: BlurThresholdDesign, options: AnalysisOptions | None = None, table: pd.DataFrame | None = None
    ) -> Analysis:
        from focalgradient.statistics.threshold_questions import threshold_questions  # with pandas and SciPy

        return threshold_questions(design.unit, of=f"of {design.thresholds_of}")

    def right(self, design: BlurThresholdDesign, trial: BlurTrial, answer: Chosen) -> bool:
        return answer.correct

    def check_answer(self, design: BlurThresholdDesign, trial: BlurTrial, answer: Chosen) -> None:
        if not design.is_level(answer.level):
            raise InputError(f"level is {answer.level:g}, but must be one of the design's levels.")
        if trial.catch and answer.level != design.levels[-1]:
            greatest = f"catch trials have the greatest, {design.levels[-1]:g}"
            raise InputError(f"level is {answer.level:g}, but {greatest}: give that.")
        if answer.correct is not (answer.answer == trial.interval):
            raise InputError(f"correct is {answer.correct}, which contradicts the answer: compare it with interval.")
