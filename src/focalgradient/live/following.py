"""Gaze-contingent focus: target plane and time course."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

__all__ = ["TIME_CONSTANT", "Focusing", "Transition"]

Transition = Literal["eye", "immediate"]
"""Time course of a change in focus: as of an eye, or within one frame."""

TIME_CONSTANT = 0.3
"""Time constant (s) of the first-order response, about that of human accommodation (Campbell & Westheimer, J Physiol
151, 1960)."""


class Focusing:
    """Current focus and target focus.

    Parameters
    ----------
    vergences
        Vergences of the available foci in dioptres.
    transition
        ``"eye"``: the remaining difference decays to 1/e in `TIME_CONSTANT` seconds. ``"immediate"``: it vanishes at
        once.

    Examples
    --------
    >>> focusing = Focusing([0.5, 2.0], "eye")
    >>> focusing.look(1)
    True
    >>> round(focusing.step(0.3), 3)  # 1 - 1/e of 1.5 dioptres
    1.448
    """

    def __init__(self, vergences: Sequence[float], transition: Transition) -> None:
        self._vergences, self._transition = vergences, transition
        self.target = 0
        self.vergence = vergences[0]

    def look(self, focus: int) -> bool:
        """Set the focus with this index as the target; return whether it has changed."""
        changed, self.target = focus != self.target, focus
        return changed

    def step(self, seconds: float) -> float:
        """Advance time by `seconds`, and return the vergence in focus."""
        goal = self._vergences[self.target]
        left = 0.0 if self._transition == "immediate" else math.exp(-seconds / TIME_CONSTANT)
        self.vergence = goal + left * (self.vergence - goal)
        return self.vergence
