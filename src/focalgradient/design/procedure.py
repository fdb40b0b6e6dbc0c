"""Which level comes next: QUEST+ (Watson 2017, J. Vis. 17(3):10), by the library questplus.

The procedure is a function of the design and of the answers so far: a session that was cut off gives it the answers
again, and it goes on as it would have.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Protocol

from focalgradient.errors import InputError, check_installed

__all__ = ["LAPSES", "NEEDED", "SLOPES", "Procedure"]

SLOPES = (1.5, 2.1, 2.9, 4.1, 5.7, 8.0)
"""Weibull slopes that the procedure thinks possible, in equal steps of their logarithm about 3.5, that of QUEST
(Watson & Pelli 1983)."""

LAPSES = (0.02,)
"""Share of trials answered without looking: within the 0 to 5 % of trained people (Wichmann & Hill 2001)."""

NEEDED = ("the adaptive procedure", "thresholds", "questplus")
"""What needs which extra for which module: see `check_installed`."""

GUESS = 0.5
"""Of two intervals."""


class HasLevels(Protocol):
    """A design with levels to choose from, positive and rising."""

    @property
    def levels(self) -> tuple[float, ...]:
        """The levels."""
        ...


class Procedure:
    """QUEST+ over the levels of a design: each next level is the one whose answer should be the most informative.

    What is not known is the threshold, anywhere among the levels, and the slope (`SLOPES`).

    Examples
    --------
    >>> from focalgradient.design import BlurThresholdDesign
    >>> procedure = Procedure(BlurThresholdDesign())
    >>> first = procedure.level()
    >>> procedure.learn([(first, True)] * 3)
    >>> procedure.level() < first  # right answers: less blur
    True

    Attributes
    ----------
    learnt
        The answers taken in so far: level, and whether it was right.

    Raises
    ------
    InputError
        If questplus is not installed.
    """

    def __init__(self, design: HasLevels):
        check_installed(*NEEDED)
        from questplus import QuestPlus

        self._places = {level: math.log10(level) for level in design.levels}
        places = list(self._places.values())
        self._quest: Any = QuestPlus(
            stim_domain={"intensity": places},
            param_domain={
                "threshold": places,
                "slope": list(SLOPES),
                "lower_asymptote": [GUESS],
                "lapse_rate": list(LAPSES),
            },
            outcome_domain={"response": ["right", "wrong"]},
            func="weibull",
            stim_scale="log10",
        )
        self.learnt: list[tuple[float, bool]] = []

    def learn(self, answered: Iterable[tuple[float, bool]]) -> None:
        """Take in all answers so far, the level and whether it was right, from the first; those known are passed over.

        Raises
        ------
        InputError
            If a level is none of the design's.
        """
        for level, right in list(answered)[len(self.learnt) :]:
            near = min(self._places, key=lambda one: abs(math.log(one / level)))
            if not math.isclose(near, level, rel_tol=1e-6):
                raise InputError(f"level is {level:g}, but must be one of the design's, as {near:g}.")
            outcome = {"response": "right" if right else "wrong"}
            self._quest.update(stim={"intensity": self._places[near]}, outcome=outcome)
            self.learnt.append((level, right))

    def level(self) -> float:
        """The level to show next."""
        place = float(self._quest.next_stim["intensity"])
        return min(self._places, key=lambda one: abs(self._places[one] - place))
