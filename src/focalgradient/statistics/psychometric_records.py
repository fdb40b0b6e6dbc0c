"""Result records of hierarchical psychometric functions: by person, by condition, and differences of thresholds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.statistics.psychometric_shapes import SHAPES
from focalgradient.statistics.records import Effect, Interval, line

__all__ = ["GroupFunction", "PersonFunction", "PsychometricGroups", "ThresholdDifference"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PersonFunction:
    """Psychometric function of one person in one condition.

    Parameters
    ----------
    participant_id, condition
        Participant and condition; "" without conditions.
    threshold
        Level halfway between the guess rate and 1 - lapse, with a 95 % interval, in the unit of the levels.
    slope
        Exponent of the Weibull function, or 1 / scale of the other sigmoids (1 / unit, or 1 / log unit).
    lapse, guess
        Lapse and guess rate.
    levels, right, shown
        Levels, with the number of correct answers and of trials at each.
    shape
        Name of the sigmoid.
    """

    participant_id: str
    condition: str
    threshold: Interval
    slope: Interval
    lapse: float
    guess: float
    levels: tuple[float, ...]
    right: tuple[int, ...]
    shown: tuple[int, ...]
    shape: str

    def correct(self, level: ArrayLike) -> FloatArray:
        """Return the probability of a correct answer at levels of any shape.

        >>> at = Interval(0.2, 0.1, 0.3)
        >>> one = PersonFunction("01", "", at, Interval(3.5, 3.0, 4.0), 0.0, 0.5, (0.2,), (8,), (10,), "weibull")
        >>> one.correct([0.01, 0.2, 2.0]).round(3).tolist()
        [0.5, 0.75, 1.0]
        """
        return _correct(level, self.threshold.estimate, self.slope.estimate, self.lapse, self.guess, self.shape)


@dataclass(frozen=True, slots=True)
class GroupFunction:
    """Mean psychometric function of one condition.

    Parameters
    ----------
    condition
        Condition; "" without conditions.
    subjects
        Number of people.
    threshold, slope
        Means over people (geometric for slopes, and for thresholds of logarithmic levels), with 95 % intervals.
    lapse, guess
        Rates of the average person.
    shape
        Name of the sigmoid.
    """

    condition: str
    subjects: int
    threshold: Interval
    slope: Interval
    lapse: float
    guess: float
    shape: str

    def correct(self, level: ArrayLike) -> FloatArray:
        """Return the probability of a correct answer of the average person at levels of any shape.

        >>> at, slope = Interval(0.0, None, None), Interval(1.0, None, None)
        >>> GroupFunction("", 6, at, slope, 0.0, 0.0, "logistic").correct(0.0).item()
        0.5
        """
        return _correct(level, self.threshold.estimate, self.slope.estimate, self.lapse, self.guess, self.shape)


@dataclass(frozen=True, slots=True)
class ThresholdDifference:
    """Difference between the thresholds of two conditions; of log thresholds if levels are logarithmic."""

    condition: str
    other: str
    effect: Effect


@dataclass(frozen=True, slots=True, repr=False)
class PsychometricGroups:
    """Results of the hierarchical psychometric functions.

    Parameters
    ----------
    shape
        Name of the sigmoid.
    unit
        Unit of the levels; "" if not given.
    groups
        One function per condition.
    people
        One function per person and condition.
    differences
        Differences of the thresholds of each pair of conditions, corrected by Holm as one family.
    lapse, guess
        Rates of the average person with 95 % intervals; without interval if fixed.
    sd
        Standard deviations over people, by name: of thresholds (log thresholds if levels are logarithmic), log slopes,
        and the log odds of lapse and guess rate.
    overdispersion
        Correlation between a person's answers at one level (and in one block) beyond the function: 0 for independent
        answers; None if not estimated.
    trials
        Number of answers.
    log_likelihood
        Maximum of the restricted log likelihood; None for a posterior sample.
    method
        Description of the fit for the report.
    remarks
        Deviations from the planned analysis, one sentence each.
    diagnostics
        Diagnostics of a sampler: `r_hat` (largest), `effective` (smallest effective sample size), `diverging`.
    """

    shape: str
    unit: str
    groups: tuple[GroupFunction, ...]
    people: tuple[PersonFunction, ...]
    differences: tuple[ThresholdDifference, ...]
    lapse: Interval
    guess: Interval
    sd: Mapping[str, Interval]
    overdispersion: Interval | None
    trials: int
    log_likelihood: float | None
    method: str
    remarks: tuple[str, ...] = ()
    diagnostics: Mapping[str, float] = field(default_factory=dict)

    @property
    def participants(self) -> tuple[str, ...]:
        """Names of the people, in order."""
        return tuple(dict.fromkeys(one.participant_id for one in self.people))

    @property
    def logarithmic(self) -> bool:
        """True if the function is one of the logarithm of the level."""
        return SHAPES[self.shape].logarithmic

    def __repr__(self) -> str:
        """Return a one-line description; `summary` gives the results."""
        return f"<PsychometricGroups: {len(self.participants)} people, {len(self.groups)} conditions, {self.shape}>"

    def summary(self) -> str:
        """Return mean threshold and slope of each condition, differences, and rates as text, one per line."""
        unit = f" {self.unit}" if self.unit else ""
        lines = [
            f"{one.condition or 'threshold'}: {_ends(one.threshold)}{unit}; slope {_ends(one.slope)}"
            for one in self.groups
        ]
        what = "log threshold" if self.logarithmic else "threshold"
        lines += [line(f"{what}, {one.condition} less {one.other}", one.effect) for one in self.differences]
        lines += [f"lapse rate: {_ends(self.lapse)}", f"guess rate: {_ends(self.guess)}"]
        lines += [f"standard deviation over people, {name}: {_ends(one)}" for name, one in self.sd.items()]
        if self.overdispersion is not None:
            lines.append(f"overdispersion: {_ends(self.overdispersion)}")
        return "\n".join(lines)


def _ends(found: Interval) -> str:
    if found.low is None or found.high is None:
        return f"{found.estimate:.3g}"
    return f"{found.estimate:.3g}, 95 % interval {found.low:.3g} to {found.high:.3g}"


def _correct(level: ArrayLike, threshold: float, slope: float, lapse: float, guess: float, shape: str) -> FloatArray:
    kind, at = SHAPES[shape], np.asarray(level, float)
    with np.errstate(divide="ignore"):
        z = slope * (np.log(at / threshold) if kind.logarithmic else at - threshold)
    return np.asarray(guess + (1 - guess - lapse) * kind.values(np.clip(z, -700, 700))[0])
