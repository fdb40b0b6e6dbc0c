"""Results of hierarchical psychometric functions: by person, by condition, and of the thresholds' differences."""

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
    """One person's psychometric function in one condition.

    Parameters
    ----------
    participant_id, condition
        Whose; "" where there are no conditions.
    threshold
        Level half-way between the guess rate and 1 - lapse, with its 95 % interval: in the unit of the levels.
    slope
        Exponent of Weibull's function, or 1 / scale of the others (1 / unit, or 1 / log unit).
    lapse, guess
        Rates.
    levels, right, shown
        The levels, how often each was answered rightly, and how often shown.
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
        """Probability of a right answer at levels (any shape).

        >>> at = Interval(0.2, 0.1, 0.3)
        >>> one = PersonFunction("01", "", at, Interval(3.5, 3.0, 4.0), 0.0, 0.5, (0.2,), (8,), (10,), "weibull")
        >>> one.correct([0.01, 0.2, 2.0]).round(3).tolist()
        [0.5, 0.75, 1.0]
        """
        return _correct(level, self.threshold.estimate, self.slope.estimate, self.lapse, self.guess, self.shape)


@dataclass(frozen=True, slots=True)
class GroupFunction:
    """The psychometric function of a condition: mean over people.

    Parameters
    ----------
    condition
        "" where there are none.
    subjects
        Number of people.
    threshold, slope
        Means over people (geometric ones of slopes, and of thresholds where levels are logarithmic), with 95 %
        intervals.
    lapse, guess
        Rates of the mean person.
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
        """Probability of a right answer at levels (any shape) of the mean person.

        >>> at, slope = Interval(0.0, None, None), Interval(1.0, None, None)
        >>> GroupFunction("", 6, at, slope, 0.0, 0.0, "logistic").correct(0.0).item()
        0.5
        """
        return _correct(level, self.threshold.estimate, self.slope.estimate, self.lapse, self.guess, self.shape)


@dataclass(frozen=True, slots=True)
class ThresholdDifference:
    """Threshold of one condition less that of another: of their logarithms where levels are logarithmic."""

    condition: str
    other: str
    effect: Effect


@dataclass(frozen=True, slots=True, repr=False)
class PsychometricGroups:
    """Hierarchical psychometric functions.

    Parameters
    ----------
    shape
        Name of the sigmoid.
    unit
        Of the levels; "" where not given.
    groups
        A function for each condition.
    people
        A function for each person and condition.
    differences
        Of the thresholds of each pair of conditions, corrected by Holm as one family.
    lapse, guess
        Rates of the mean person with 95 % intervals; without ends where they are known.
    sd
        Standard deviations over people, by name: of thresholds (of their logarithm where levels are logarithmic), of
        log slopes, of the log odds of lapse and guess.
    overdispersion
        Correlation of the answers of one person at one level (and block) beyond the function: 0 where answers are
        independent. None where it is not estimated.
    trials
        Number of answers.
    log_likelihood
        Restricted; None of a sample of a posterior.
    method
        How it was fitted, for a report.
    remarks
        What did not go as planned, a sentence each.
    diagnostics
        Of a sampler: `r_hat` (largest), `effective` (least number of draws), `diverging`.
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
        """Whether levels are taken on their logarithm."""
        return SHAPES[self.shape].logarithmic

    def __repr__(self) -> str:
        """In short; `summary` has the results."""
        return f"<PsychometricGroups: {len(self.participants)} people, {len(self.groups)} conditions, {self.shape}>"

    def summary(self) -> str:
        """Mean threshold and slope of each condition, differences, and rates, a line each."""
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
