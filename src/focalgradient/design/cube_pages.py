"""Pages of the Necker cube experiment, for window and browser."""

from __future__ import annotations

from typing import cast

from focalgradient.design.necker import Gradient, NeckerTrial
from focalgradient.design.sequence import Page, Pages

__all__ = ["CubePages"]


class CubePages(Pages):
    """Pages for one participant, in the laboratory or in a browser.

    >>> from focalgradient.design import NeckerDesign
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
