"""Prediction of regularly moving targets: the estimate expected a moment ahead.

People follow a sine with a phase lag far smaller than their reaction time implies, but not an irregular target
(Campbell & Westheimer 1960; Phillips et al. 1972; Heron & Charman 2004 for the lag). The rule here uses the estimates
alone: sines of many frequencies are fitted to the last seconds by least squares with exponential forgetting; the one
with the smallest forecast errors so far gives the forecast, weighted by its skill, the share of the squared change that
it has predicted beyond its prediction of irregular targets.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import check_number

__all__ = ["Predictor"]


HERTZ: FloatArray = np.asarray(np.arange(0.075, 1.26, 0.025), dtype=np.float64)
"""Frequencies of the fitted sines in hertz, within the range that accommodation follows."""

MEMORY = 4.0
"""Time constant in seconds of forgetting, in the fits and in the skill; our choice."""

LONGEST = 3 * MEMORY
"""Duration of the past that is kept, in seconds."""

RIDGE = 0.01
"""Expected variance of an estimate's noise over that of a sine's amplitude: 0.035^2 over 0.35^2 square dioptres."""

NOTHING = 0.05
"""RMS change over the horizon in dioptres below which nothing is predicted: about the scatter of estimates of a still
target; a choice."""

IRREGULAR, REGULAR = 0.65, 0.85
"""Shares of the squared change predicted at which a forecast begins to count, and counts in full. The share is 0.86 to
0.97 for sines of 0.15 to 1 Hz, below 0.1 on average for random steps, walks and sums of six sines, 0.3 for noise
between 0.05 and 1 Hz, and 0.55 for noise between 0.3 and 1 Hz (`tests/eye/test_plant.py`)."""


@lru_cache(maxsize=8)
def _sines(horizon: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Return the weighted basis of each frequency (K x n x 3, newest first), and the forecast of its fit (n x K x 3).

    With only the m newest estimates, their products with the basis times line m - 1 of the latter is the forecast.
    """
    past = -step * np.arange(max(round(LONGEST / step), 1))
    turn = 2 * np.pi * HERTZ[:, None] * past
    basis = np.stack([np.ones_like(turn), np.cos(turn), np.sin(turn)], axis=-1)
    weighted = basis * np.exp(past / MEMORY)[:, None]
    squares = np.cumsum(np.einsum("kni,knj->nkij", weighted, basis), axis=0)
    squares += np.diag([0.0, RIDGE, RIDGE])
    ahead = 2 * np.pi * HERTZ * horizon
    there = np.stack([np.ones_like(ahead), np.cos(ahead), np.sin(ahead)], axis=-1)
    return weighted, np.linalg.solve(squares, there[None, :, :, None])[..., 0]


@dataclass(slots=True)
class Predictor:
    """Forecasts a series of estimates by a `horizon` (s); one estimate arrives each `step` (s).

    Examples
    --------
    A sine of 0.5 Hz is predicted after some periods; a step never is.

    >>> one = Predictor(horizon=0.4, step=0.1)
    >>> expected = [one.update(math.sin(math.pi * 0.1 * number)) for number in range(120)]
    >>> round(float(expected[110]), 2), round(math.sin(math.pi * (11.0 + 0.4)), 2)
    (-0.95, -0.95)
    """

    horizon: float
    step: float
    skill: float = field(init=False, default=0.0)
    _past: deque[float] = field(init=False)  # newest first
    _expected: deque[tuple[FloatArray, float]] = field(init=False)  # by each sine, and by the best: newest last
    _missed: FloatArray = field(init=False)  # squared errors of each sine
    _best_missed: float = field(init=False, default=0.0)
    _changed: float = field(init=False, default=0.0)
    _count: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        check_number("horizon", self.horizon, "seconds", least=0)
        check_number("step", self.step, "seconds", positive=True)
        self._past = deque(maxlen=max(round(LONGEST / self.step), self._ahead + 1))
        self._expected = deque(maxlen=max(self._ahead, 1))
        self._missed = np.zeros(HERTZ.size)

    @property
    def _ahead(self) -> int:
        return round(self.horizon / self.step)

    def update(self, estimate: float) -> float:
        """Add an `estimate` (D), and return the one expected a horizon later (D)."""
        self._past.appendleft(estimate)
        if not self._ahead:
            return estimate
        if len(self._expected) == self._ahead:
            self._score(estimate)
        weighted, foretelling = _sines(self._ahead * self.step, self.step)
        count = min(len(self._past), weighted.shape[1])
        recent = np.array(self._past)[:count]
        by_each = np.einsum("kni,n,ki->k", weighted[:, :count], recent, foretelling[count - 1], optimize=True)
        best = self._of_best(by_each)
        self._expected.append((by_each, best))
        return estimate + self.skill * (best - estimate)

    def _of_best(self, by_each: FloatArray) -> float:
        """Return the forecast at the frequency of the smallest error, by a parabola between frequencies."""
        at = int(np.clip(np.argmin(self._missed), 1, HERTZ.size - 2))
        below, least, above = self._missed[at - 1 : at + 2]
        curved = below - 2 * least + above
        off = float(np.clip((below - above) / (2 * curved), -1, 1)) if curved > 0 else 0.0
        lower, middle, upper = by_each[at - 1 : at + 2].tolist()
        return float(middle + off * (upper - lower) / 2 + off**2 * (upper - 2 * middle + lower) / 2)

    def _score(self, estimate: float) -> None:
        """Update the forecast errors and the skill with the forecast made a horizon ago."""
        by_each, best = self._expected[0]
        kept = math.exp(-self.step / MEMORY)
        self._missed = kept * self._missed + (estimate - by_each) ** 2
        self._best_missed = kept * self._best_missed + (estimate - best) ** 2
        self._changed = kept * self._changed + (estimate - self._past[self._ahead]) ** 2
        self._count = kept * self._count + 1
        foretold = 1 - (self._best_missed + NOTHING**2 * self._count) / (self._changed + 1e-12)
        self.skill = float(np.clip((foretold - IRREGULAR) / (REGULAR - IRREGULAR), 0.0, 1.0))
