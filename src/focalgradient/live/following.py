"""How focus follows the gaze: to which plane it goes, and how fast."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

__all__ = ["TIME_CONSTANT", "Focusing", "Transition"]

Transition = Literal["eye", "immediate"]
"""How focus gets to a new distance: as an eye's, or within a frame."""

TIME_CONSTANT = 0.3
"""Seconds of a first-order response: about that of human accommodation (Campbell & Westheimer, J Physiol 151, 1960)."""


class Focusing:
    """Where the focus is, and where it goes.

    Parameters
    ----------
    vergences
        Of the foci that there are, in dioptres.
    transition
        ``"eye"``: the way that is left shrinks to 1/e in `time_constant` seconds. ``"immediate"``: none is left.
    time_constant
        In seconds.

    Examples
    --------
    >>> focusing = Focusing([0.5, 2.0], "eye")
    >>> focusing.look(1)
    True
    >>> round(focusing.step(0.3), 3)  # 1 - 1/e of 1.5 dioptres
    1.448
    """

    def __init__(
        self, vergences: Sequence[float], transition: Transition, time_constant: float = TIME_CONSTANT
    ) -> None:
        self._vergences, self._transition, self._constant = vergences, transition, time_constant
        self.target = 0
        self.vergence = vergences[0]

    def look(self, focus: int) -> bool:
        """Go to the focus of that number: whether that is another than before."""
        changed, self.target = focus != self.target, focus
        return changed

    def step(self, seconds: float) -> float:
        """Let time pass: the vergence in focus then."""
        goal = self._vergences[self.target]
        left = 0.0 if self._transition == "immediate" else math.exp(-seconds / self._constant)
        self.vergence = goal + left * (self.vergence - goal)
        return self.vergence
