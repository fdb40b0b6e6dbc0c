"""Prediction of targets that move predictably: what the accommodating eye expects of its own estimates a moment ahead.

People follow a sine with a phase lag that is far less than their reaction time implies, and an irregular target without
(Campbell & Westheimer 1960; Phillips et al. 1972; Heron & Charman 2004 for the lag). The rule here is learnt from the
estimates alone: the change over the horizon is a weighted sum of the changes before, the weights by recursive least
squares that forgets; and it counts by its skill so far, by how much more of the squared change it foretold than is
foretold of an irregular target.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import check_number

__all__ = ["Predictor"]

TAPS = 10
"""Estimates before, of which changes are counted: a second at 10 Hz, our choice."""

MEMORY = 4.0
"""Seconds in which the past counts 1/e: some periods of the slowest sines that people predict, our choice."""

NOTHING = 0.05
"""Dioptres, root mean square, of change over the horizon below which nothing is predicted: about what estimates of a
still target differ by; a choice."""

SMOOTH = 0.65
"""Share of the squared change that is foretold of an irregular target, by its smoothness alone, and does not count: of
noise between 0.05 and 1 Hz it is 0.55 to 0.65 (`tests/eye/test_prediction.py`)."""

RIDGE = 0.1
"""Squared dioptres by which weights are held to 0 at first: a choice."""


@dataclass(slots=True)
class Predictor:
    """Predicts a series of estimates a `horizon` (s) ahead; one estimate comes each `step` (s).

    Examples
    --------
    A sine of 0.5 Hz is foretold after some periods; a step never is.

    >>> one = Predictor(horizon=0.4, step=0.1)
    >>> expected = [one.update(math.sin(math.pi * 0.1 * number)) for number in range(80)]
    >>> round(float(expected[70]), 2), round(math.sin(math.pi * (7.0 + 0.4)), 2)
    (-0.9, -0.95)
    """

    horizon: float
    step: float
    skill: float = field(init=False, default=0.0)
    _past: deque[float] = field(init=False)
    _weights: NDArray[np.float64] = field(init=False)
    _inverse: NDArray[np.float64] = field(init=False)  # of the inputs' covariance
    _missed: float = field(init=False, default=0.0)
    _changed: float = field(init=False, default=0.0)
    _count: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        check_number("horizon", self.horizon, "seconds", least=0)
        check_number("step", self.step, "seconds", positive=True)
        self._past = deque(maxlen=1 + TAPS + self._ahead)
        self._weights, self._inverse = np.zeros(TAPS), np.eye(TAPS) / RIDGE

    @property
    def _ahead(self) -> int:
        return round(self.horizon / self.step)

    def update(self, estimate: float) -> float:
        """Take in an `estimate` (D); the one expected a horizon later (D)."""
        self._past.append(estimate)
        if not self._ahead or len(self._past) < TAPS + 1 + self._ahead:
            return estimate
        past = np.array(self._past)
        before, change = past[TAPS] - past[TAPS - 1 :: -1], past[-1] - past[TAPS]
        kept = math.exp(-self.step / MEMORY)
        error = change - self._weights @ before
        self._missed = kept * self._missed + error**2
        self._changed = kept * self._changed + change**2
        self._count = kept * self._count + 1
        gain = self._inverse @ before / (kept + before @ self._inverse @ before)
        self._weights = self._weights + gain * error
        self._inverse = (self._inverse - np.outer(gain, before @ self._inverse)) / kept
        floor = NOTHING**2 * self._count
        foretold = 1 - (self._missed + floor) / (self._changed + 1e-12)
        self.skill = max(0.0, (foretold - SMOOTH) / (1 - SMOOTH))
        recent = past[-1] - past[-2 : -2 - TAPS : -1]
        return estimate + self.skill * float(self._weights @ recent)
