"""Result records: effects with intervals and tests, and reasons for results that were not computed."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

__all__ = ["ALPHA", "CONFIDENCE", "Effect", "Interval", "NotComputed", "as_table", "line", "size_interval", "summed"]

ALPHA = 0.05
"""Significance level of all tests."""

CONFIDENCE = 0.95
"""Coverage of intervals, unless their field states otherwise."""


@dataclasses.dataclass(frozen=True, slots=True)
class NotComputed:
    """Placeholder of a result that could not be computed, with the reason in one sentence."""

    reason: str


@dataclasses.dataclass(frozen=True, slots=True)
class Interval:
    """Estimate with its 95 % interval; the ends are None with too few subjects."""

    estimate: float
    low: float | None
    high: float | None

    @property
    def ratio(self) -> Interval:
        """Exponential of estimate and ends, for an interval of a logarithm.

        >>> Interval(0.0, None, None).ratio
        Interval(estimate=1.0, low=None, high=None)
        """
        low, high = (None if end is None else math.exp(end) for end in (self.low, self.high))
        return Interval(math.exp(self.estimate), low, high)

    def summary(self, unit: str = "") -> str:
        """Return the estimate with its interval as text, with a unit after the estimate.

        >>> Interval(0.2, 0.1, 0.3).summary(" D"), Interval(0.2, None, None).summary()
        ('0.2 D, 95 % interval 0.1 to 0.3', '0.2')
        """
        is_known = self.low is not None and self.high is not None
        return f"{self.estimate:.3g}{unit}" + (f", 95 % interval {self.low:.3g} to {self.high:.3g}" if is_known else "")


@dataclasses.dataclass(frozen=True, slots=True)
class Effect:
    """Estimate over subjects, with its interval and two-sided test.

    Parameters
    ----------
    estimate, low, high
        Estimate and 95 % interval, in the unit that the containing field states.
    standard_error
        Standard error of the estimate.
    statistic, df, p
        Student's t of the estimate against zero, its degrees of freedom and p value.
    dz
        Cohen's d_z: mean divided by standard deviation of the within-subject effects; None unless the test is a paired
        t-test of these.
    subjects
        Number of subjects.
    method
        Description of the method, for the report.
    remarks
        Deviations from the planned analysis, one sentence each.
    p_holm
        p value after Holm's correction over its family of tests; None outside a family.
    d
        For tests over subjects and scenes, d of Westfall, Kenny and Judd (2014) with its interval: the mean divided by
        the root of the summed variances of subjects, scenes and residuals. For two groups of subjects, Cohen's d: the
        difference of their means divided by the pooled standard deviation.
    """

    estimate: float
    low: float
    high: float
    standard_error: float
    statistic: float
    df: float
    p: float
    dz: float | None
    subjects: int
    method: str
    remarks: tuple[str, ...] = ()
    p_holm: float | None = None
    d: Interval | None = None

    @property
    def corrected_p(self) -> float:
        """P value, after Holm's correction if the test is in a family."""
        return self.p if self.p_holm is None else self.p_holm

    @property
    def significant(self) -> bool:
        """True if the p value, after Holm's correction in a family, is below .05."""
        return self.corrected_p < ALPHA

    @property
    def interval(self) -> Interval:
        """Estimate with its 95 % interval."""
        return Interval(self.estimate, self.low, self.high)

    @property
    def ratio(self) -> Interval:
        """Exponential of `interval`, for effects on a logarithm."""
        return self.interval.ratio

    @property
    def dz_interval(self) -> Interval | None:
        """d_z with its 95 % interval, which excludes 0 where the test is significant at .05 (`size_interval`).

        Examples
        --------
        >>> effect = Effect(0.2, 0.1, 0.3, 0.04, 2.53, 9, 0.032, 0.8, 10, "an example")
        >>> round(effect.dz_interval.low, 3), round(effect.dz_interval.high, 3)
        (0.065, 1.503)
        """
        return None if self.dz is None else size_interval(self.statistic, self.df, 1 / math.sqrt(self.subjects))

    def summary(self) -> str:
        """Return the effect as one line of text in the style of a paper.

        Examples
        --------
        >>> Effect(0.2, 0.1, 0.3, 0.04, 5.0, 7, 0.0016, 1.77, 8, "an example").summary()
        '0.200, 95 % interval 0.100 to 0.300, t(7) = 5.00, p = .002'
        """
        name = "p" if self.p_holm is None else "p_Holm"
        df = f"{self.df:g}" if float(self.df).is_integer() else f"{self.df:.2f}"
        text = f"{self.estimate:.3f}, 95 % interval {self.low:.3f} to {self.high:.3f}, t({df}) = {self.statistic:.2f}"
        return f"{text}, {name} {_stated(self.corrected_p)}"


def size_interval(t: float, df: float, error: float) -> Interval:
    """Return a standardised effect with its 95 % interval by the noncentral t of its test (Steiger & Fouladi 1997).

    The ends are the noncentralities of which the observed `t` is the 97.5 and 2.5 % quantile, in the unit of the
    standard `error`, which is in standard deviations: the interval excludes 0 where p < .05.

    >>> print(size_interval(2.53, 9, 10**-0.5).summary())
    0.8, 95 % interval 0.0651 to 1.5
    """
    from scipy import optimize, special

    reach = 12 * math.sqrt(1 + t**2 / (2 * df))  # 12 standard errors of t, beyond both ends

    def beyond(center: float, share: float) -> float:
        found = float(special.nctdtr(df, center, t))
        return (found if math.isfinite(found) else float(center < t)) - share  # NaN in the extreme tails

    shares = ((1 + CONFIDENCE) / 2, (1 - CONFIDENCE) / 2)
    low, high = (optimize.brentq(beyond, t - reach, t + reach, args=(share,)) for share in shares)
    return Interval(t * error, low * error, high * error)


def _stated(p: float) -> str:
    return "< .001" if p < 0.001 else f"= {p:.3f}".replace("0.", ".", 1)


def line(name: str, found: Effect | NotComputed) -> str:
    """Format a line of a summary: the name, and the effect or the reason why there is none.

    >>> line("log depth effect", NotComputed("one subject only"))
    'log depth effect: one subject only'
    """
    return f"{name}: {found.reason if isinstance(found, NotComputed) else found.summary()}"


def summed(
    tests: Iterable[tuple[str, Effect | NotComputed]],
    differences: Mapping[tuple[str, str], Effect | NotComputed],
    only: Effect | NotComputed,
) -> list[str]:
    """Return lines of a summary: named tests, then their differences by pair of levels, or the `only` one.

    >>> summed([], {}, NotComputed("one fixation only"))
    ['difference: one fixation only']
    """
    pairs = [(f"difference, {one} less {other}", test) for (one, other), test in differences.items()]
    return [line(*one) for one in [*tests, *(pairs or [("difference", only)])]]


def as_table(records: Iterable[Any]) -> pd.DataFrame:
    """Convert records of one kind to a table, one row each; fields of nested records become columns.

    Examples
    --------
    >>> as_table([NotComputed("There is one subject only.")])["reason"][0]
    'There is one subject only.'
    """
    return pd.json_normalize([_fields(record) for record in records])


def _fields(record: Any) -> dict[str, Any]:
    """Return the fields by name, nested records as dicts; effects include the ends of the d_z interval."""
    found: dict[str, Any] = {}
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        found[field.name] = _fields(value) if dataclasses.is_dataclass(value) else value
    if isinstance(record, Effect):
        dz = record.dz_interval
        found |= {"dz_low": dz and dz.low, "dz_high": dz and dz.high}
    return found
