"""Task of Experiment 2: perceived rigidity of a rotating Necker cube by focal gradient."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, cast

from focalgradient.dataset import Watched
from focalgradient.design.necker import Gradient, NeckerDesign, NeckerTrial
from focalgradient.design.sequence import Page, Pages
from focalgradient.design.words import Words
from focalgradient.display import Display
from focalgradient.files.columns import Column
from focalgradient.scales import Held
from focalgradient.tasks.base import Task
from focalgradient.tasks.columns import DROPPED, REPETITION, SITTING, TRIAL
from focalgradient.tasks.steps import LEAST_RIGHT, Step

if TYPE_CHECKING:
    import pandas as pd

    from focalgradient.statistics.criteria import AnalysisOptions
    from focalgradient.statistics.questions import Analysis

__all__ = ["NeckerRotation"]

COLUMNS: tuple[Column, ...] = (
    TRIAL,
    Column(
        "gradient",
        "Percept with which the blur is consistent.",
        "text",
        levels={
            "none": "all lines are sharp",
            "rigid": "what is far in the rigid cube is blurred",
            "nonrigid": "what is near in the rigid cube, and far in its reversal, is blurred",
        },
    ),
    Column("strength", "Aperture diameter equivalent to the blur; 0 without gradient.", "number", "mm", least=0),
    Column(
        "direction",
        "Direction in which the near side of the rigid cube moves.",
        "text",
        levels={"right": "to the right", "left": "to the left"},
    ),
    Column(
        "shape",
        "Rotating shape.",
        "text",
        levels={
            "ambiguous": "the wireframe cube",
            "rigid": "an unambiguously rigid shape",
            "nonrigid": "an unambiguously nonrigid shape",
        },
    ),
    REPETITION,
    Column("catch", "Whether the trial shows an unambiguously nonrigid shape.", "bool"),
    Column("onset", "When the percept began, from the start of the trial.", "number", "s", least=0),
    Column("duration", "Duration of the percept.", "number", "s", least=0),
    Column(
        "percept",
        "Percept reported by the keys held.",
        "text",
        levels={
            "rigid": "the key for rigid was held",
            "nonrigid": "the key for nonrigid was held",
            "none": "neither key was held",
            "both": "both keys were held",
        },
    ),
    Column("censored", "Whether the end of the trial cut the percept off.", "bool"),
    Column("trial_onset", "When the trial began, on the clock of the sitting.", "number", "s", least=0),
    Column("trial_duration", "Duration of the trial.", "number", "s", above=0),
    DROPPED,
    SITTING,
)


class CubePages(Pages):
    """Pages for one participant, in the laboratory or in a browser.

    >>> from focalgradient.design.words import load_words
    >>> pages = CubePages(NeckerDesign(gradients=["none"]), load_words("en"), "01")
    >>> "blurred" in pages.closing()[0].text
    False
    """

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        keys = {f"{name}_key": self.words.key(key) for name, key in self.design.keys_of(self.participant).items()}
        return self.instructions(*self.words.pages("necker.instructions", escape=self.escape, **keys))

    def lead(self, trial: NeckerTrial, previous: NeckerTrial | None) -> tuple[Page, ...]:
        """Return the page that waits until the participant is ready."""
        return (Page("ready", "\n".join(self.ready(trial))),)

    def ready(self, trial: NeckerTrial) -> tuple[str, str, str]:
        """Return the texts of that page: its title, the task, and how to start."""
        title = self.words("necker.practice" if trial.phase == "practice" else "necker.ready")
        return title, self.words("necker.hold"), self.words("necker.start")

    def after(self, trial: NeckerTrial) -> tuple[Page, ...]:
        """Return the feedback on practice; ``{share}`` is the percentage of time for which the correct key was held."""
        if trial.phase != "practice" or trial.is_ambiguous:
            return ()
        key = self.words.key(self.design.keys_of(self.participant)[cast("Gradient", trial.shape)])
        shape = self.words(f"necker.{trial.shape}")
        return (Page("feedback", self.words("necker.feedback", shape=shape, key=key, share="{share}")),)

    def again(self) -> Page:
        """Return the page before repeated practice."""
        return Page("feedback", self.words("necker.practice_again"))

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing, which mentions blur only if the design has blur."""
        blurred = self.design.gradients != ("none",)
        question = self.words("necker.about_blur" if blurred else "necker.about_shape")
        return self.debriefing("necker.debriefing", question=question)


class NeckerRotation(Task[NeckerDesign, NeckerTrial, Watched]):
    """Experiment 2: a rotating Necker cube; one key is held while it looks rigid, another while it looks nonrigid.

    Each press and release is recorded with its time on the display's clock. The table has separate entries for times in
    which neither key, or both keys, were held.
    """

    name: ClassVar[str] = "necker"
    title: ClassVar[str] = "Rigidity of a rotating Necker cube by focal gradient"
    onset: ClassVar[str] = "trial_onset"
    background: ClassVar[float] = -1.0
    percepts: ClassVar[bool] = True
    modelled: ClassVar[bool] = True
    observer_s: ClassVar[float] = 0.05
    no_pictures: ClassVar[str] = "whose cube is drawn as its design says"
    settings_file: ClassVar[str] = "necker"
    table: ClassVar[tuple[Column, ...]] = COLUMNS
    pages = CubePages
    design, trial, answer = NeckerDesign, NeckerTrial, Watched

    def shown(
        self,
        design: NeckerDesign,
        trial: NeckerTrial,
        pixels_per_degree: float,
        *,
        display: Display | None = None,
        refresh_hz: float = 60.0,
    ) -> Step:
        from focalgradient.stimuli.cube_frames import frame_count, frames_of, shown  # compiles code with Numba

        if display is None:
            display = Display()
            display = replace(display, pixel_pitch=math.radians(display.distance / pixels_per_degree))
        pixel_angle = display.pixel_pitch / display.distance
        frames = frames_of(trial, design, frame_count(design, refresh_hz), pixel_angle)
        return Step((shown(light, display) for light in frames), trial.trial_s, "cube")

    def control(self, words: Words, trial: NeckerTrial, *, design: NeckerDesign, participant: str) -> Held:
        percepts = {key: percept for percept, key in design.keys_of(participant).items()}
        return Held(design.keys, tuple(words(f"necker.{percepts[key]}") for key in design.keys))

    def answered(self, design: NeckerDesign, trial: NeckerTrial, value: Any, **times: Any) -> Watched:
        return Watched(presses=value, trial_duration=times.pop("response_time"), **times)

    def analysis(
        self, design: NeckerDesign, options: AnalysisOptions | None = None, table: pd.DataFrame | None = None
    ) -> Analysis:
        from focalgradient.statistics.cube_questions import cube_questions, cube_questions_of  # with pandas and SciPy

        rules = None if options is None else options.rules
        if table is not None:
            return cube_questions_of(table, rules)
        return cube_questions([], design.gradients, max(design.strengths_mm), rules)

    def right_key(self, design: NeckerDesign, trial: NeckerTrial, participant: str) -> dict[str, Any] | None:
        if trial.is_ambiguous:
            return None
        return {"key": design.keys_of(participant)[trial.shape], "share": LEAST_RIGHT}

    def right(self, design: NeckerDesign, trial: NeckerTrial, answer: Watched, *, participant: str) -> float | None:
        return None if trial.is_ambiguous else answer.share_held(design.keys_of(participant), trial.shape)
