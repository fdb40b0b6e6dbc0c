"""QUEST+ procedure (Watson 2017, J. Vis. 17(3):10), by the library questplus.

The procedure is a function of the design and of the answers so far: a resumed session replays the answers, and
continues unchanged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Protocol

from focalgradient.errors import InputError, check_installed

__all__ = ["LAPSES", "NEEDED", "SLOPES", "Procedure"]

SLOPES = (1.5, 2.1, 2.9, 4.1, 5.7, 8.0)
"""Weibull slopes with equal prior probability, in equal logarithmic steps around 3.5, the slope of QUEST (Watson &
Pelli 1983).
"""

LAPSES = (0.02,)
"""Lapse rate: within the 0 to 5 % of trained observers (Wichmann & Hill 2001)."""

NEEDED = ("the adaptive procedure", "thresholds", "questplus")
"""Arguments of `check_installed`: purpose, extra and module."""

GUESS_RATE = 0.5
"""Guess rate with two intervals."""


class HasLevels(Protocol):
    """Protocol of a design with levels, positive and increasing."""

    @property
    def levels(self) -> tuple[float, ...]:
        """Levels of the design."""
        ...


class Procedure:
    """QUEST+ procedure over the levels of a design: each next level maximises the expected information.

    Unknown parameters are the threshold, among the levels, and the slope (`SLOPES`).

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
        Answers used so far: level, and whether the answer was correct.

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
                "lower_asymptote": [GUESS_RATE],
                "lapse_rate": list(LAPSES),
            },
            outcome_domain={"response": ["right", "wrong"]},
            func="weibull",
            stim_scale="log10",
        )
        self.learnt: list[tuple[float, bool]] = []

    def learn(self, answered: Iterable[tuple[float, bool]]) -> None:
        """Update with all answers so far (level, and whether correct), from the first; those already used are skipped.

        Raises
        ------
        InputError
            If a level is not one of the design's.
        """
        for level, right in list(answered)[len(self.learnt) :]:
            near = min(self._places, key=lambda one: abs(math.log(one / level)))
            if not math.isclose(near, level, rel_tol=1e-6):
                raise InputError(f"level is {level:g}, but must be one of the design's, such as {near:g}.")
            outcome = {"response": "right" if right else "wrong"}
            self._quest.update(stim={"intensity": self._places[near]}, outcome=outcome)
            self.learnt.append((level, right))

    def level(self) -> float:
        """Return the level of the next trial."""
        place = float(self._quest.next_stim["intensity"])
        return min(self._places, key=lambda one: abs(self._places[one] - place))
