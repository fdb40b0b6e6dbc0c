"""Observers of the turning cube, who differ in what makes a reading last: a preference, blur, or neither.

Durations are log-normal. The median of a reading is the person's own level, moved by the preference for the rigid
reading, by a gradient of blur that favours one of them, by being the first of its trial, and by the percept before.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import special

from focalgradient.observers.likelihood import AnswerModel, Answers, Conditions, Durations, Values

__all__ = ["PERCEPT_OBSERVERS", "GammaDurations", "percept_observer"]

FloatArray = NDArray[np.float64]

START = {"level": 4.0, "people": 0.5, "spread": 0.8, "first": 0.0, "serial": 0.1}
POSITIVE = frozenset({"level", "people", "spread"})


def _median(conditions: Conditions, values: Values, before: str = "") -> FloatArray:
    """Log median of a percept, or of the one before it, without the person's own effect."""
    found = values["preference"] * conditions[f"{before}reading"] if "preference" in values else 0.0
    found = found + values.get("gradient", 0.0) * conditions[f"{before}favoured"]
    return np.asarray(math.log(values["level"]) + found + values.get("first", 0.0) * conditions[f"{before}first"])


def _law(conditions: Conditions, values: Values, own: FloatArray) -> tuple[FloatArray, FloatArray]:
    log_median = _median(conditions, values) + values["people"] * own
    if "serial" in values:
        left = conditions["before_log"] - _median(conditions, values, "before_") - values["people"] * own
        log_median = log_median + values["serial"] * np.where(conditions["first"] > 0.5, 0.0, left)
    return log_median, values["spread"] + 0 * log_median


def percept_observer(*terms: str) -> Durations:
    """Observer whose readings last longer by the named of ``preference`` and ``gradient``; ``memory``: see below.

    The conditions of its answers are `reading` (+0.5 rigid, -0.5 nonrigid), `favoured` (strength of a gradient over the
    largest, times +0.5 for the reading that it favours and -0.5 for the other), `first` (1 for the first percept of a
    trial), the same of the percept before, `before_reading` and so on, its log duration `before_log`, and `censored`.
    The parameters are `level` (s; geometric mean of people's medians), `people` (SD over people of its logarithm),
    `spread` (SD of log duration), `preference` and `gradient` (log ratios of the two readings' medians); with memory,
    `first` (log ratio of a first percept to a later one) and `serial` (correlation with the percept before).
    """
    start = {name: value for name, value in START.items() if name not in ("first", "serial") or "memory" in terms}
    return Durations(_law, start | {name: 0.1 for name in ("preference", "gradient") if name in terms}, POSITIVE)


class GammaDurations:
    """Observer of preference and gradient with gamma durations, whose mean they move; all people share one `shape`."""

    start: Mapping[str, float] = {"level": 4.0, "people": 0.5, "shape": 1.5, "preference": 0.1, "gradient": 0.1}
    positive = frozenset({"level", "people", "shape"})

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Log likelihood of each duration for each own effect."""
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        shape = values["shape"]
        log_scale = _median(columns, values) + values["people"] * own - math.log(shape)
        logs = np.log(answers.answer)[:, None]
        scaled = np.exp(logs - log_scale)
        density = np.asarray((shape - 1) * (logs - log_scale) - scaled - special.gammaln(shape) - log_scale)
        cut = answers.conditions["censored"] > 0.5
        density[cut] = np.log(np.maximum(special.gammaincc(shape, scaled[cut]), 1e-300))
        return density


PERCEPT_OBSERVERS: Mapping[str, AnswerModel] = {
    "no preference": percept_observer("memory"),
    "a preferred reading": percept_observer("preference", "memory"),
    "blur decides": percept_observer("gradient", "memory"),
    "preference and blur": percept_observer("preference", "gradient", "memory"),
    "preference and blur, without memory": percept_observer("preference", "gradient"),
    "preference and blur, without memory, gamma": GammaDurations(),
}
"""The observers that are compared."""
