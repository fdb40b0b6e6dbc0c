"""Observer models of the rotating cube that differ in what prolongs a reading: a preference, blur, or neither.

Durations are log-normal. The median of a reading is the person's own level, shifted by the preference for the rigid
reading, by a blur gradient that favours a reading, by being first in the trial, and by the preceding percept.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.observers.likelihood import AnswerModel, Answers, Conditions, Durations, Values
from focalgradient.statistics.durations import gamma_log_density

__all__ = ["PERCEPT_OBSERVERS", "GammaDurations", "percept_observer"]


START = {"level": 4.0, "people": 0.5, "spread": 0.8, "first": 0.0, "serial": 0.1}
POSITIVE = frozenset({"level", "people", "spread"})


def _median(conditions: Conditions, values: Values, before: str = "") -> FloatArray:
    """Return the log median of a percept, or of the preceding one, without the person's random effect."""
    log_median = values["preference"] * conditions[f"{before}reading"] if "preference" in values else 0.0
    log_median = log_median + values.get("gradient", 0.0) * conditions[f"{before}favoured"]
    return np.asarray(math.log(values["level"]) + log_median + values.get("first", 0.0) * conditions[f"{before}first"])


def _law(conditions: Conditions, values: Values, own: FloatArray) -> tuple[FloatArray, FloatArray]:
    log_median = _median(conditions, values) + values["people"] * own
    if "serial" in values:
        left = conditions["before_log"] - _median(conditions, values, "before_") - values["people"] * own
        log_median = log_median + values["serial"] * np.where(conditions["first"] > 0.5, 0.0, left)
    return log_median, values["spread"] + 0 * log_median


def percept_observer(*terms: str) -> Durations:
    """Return an observer with the given terms out of "preference", "gradient" and "memory".

    The conditions are `reading` (+0.5 rigid, -0.5 nonrigid), `favoured` (strength of a gradient relative to the
    largest, times +0.5 for the favoured reading and -0.5 for the other), `first` (1 for the first percept of a trial),
    the same of the preceding percept (`before_reading` etc.), its log duration `before_log`, and `censored`. The
    parameters are `level` (s; geometric mean of the people's medians), `people` (SD of its logarithm over people),
    `spread` (SD of log duration), `preference` and `gradient` (log ratios of the readings' medians); with memory,
    `first` (log ratio of a first percept to a later one) and `serial` (correlation with the preceding percept).
    """
    start = {name: value for name, value in START.items() if name not in ("first", "serial") or "memory" in terms}
    return Durations(_law, start | {name: 0.1 for name in ("preference", "gradient") if name in terms}, POSITIVE)


class GammaDurations:
    """Gamma-distributed durations whose mean depends on preference and gradient; all people have the same `shape`."""

    start: Mapping[str, float] = {"level": 4.0, "people": 0.5, "shape": 1.5, "preference": 0.1, "gradient": 0.1}
    positive = frozenset({"level", "people", "shape"})

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Return the log likelihood of each duration for each random effect."""
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        shape = values["shape"]
        log_scale = _median(columns, values) + values["people"] * own - math.log(shape)
        return gamma_log_density(answers.answer[:, None], shape, log_scale, columns["censored"] > 0.5)


PERCEPT_OBSERVERS: Mapping[str, AnswerModel] = {
    "no preference": percept_observer("memory"),
    "a preferred reading": percept_observer("preference", "memory"),
    "blur decides": percept_observer("gradient", "memory"),
    "preference and blur": percept_observer("preference", "gradient", "memory"),
    "preference and blur, without memory": percept_observer("preference", "gradient"),
    "preference and blur, without memory, gamma": GammaDurations(),
}
"""Observers that are compared."""
