"""Results of an analysis: an effect with its interval and test, or why there is none."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Any

import pandas as pd

__all__ = ["ALPHA", "CONFIDENCE", "Effect", "Interval", "NotComputed", "Robust", "as_table", "line"]

ALPHA = 0.05
"""Error rate that tests are held against."""

CONFIDENCE = 0.95
"""Of every interval, unless its field says otherwise."""


@dataclasses.dataclass(frozen=True, slots=True)
class NotComputed:
    """Stands where a result would stand: what kept it from being computed, in one sentence."""

    reason: str


@dataclasses.dataclass(frozen=True, slots=True)
class Interval:
    """An estimate and the ends of its 95 % interval: None where too few subjects give it one."""

    estimate: float
    low: float | None
    high: float | None

    @property
    def ratio(self) -> Interval:
        """The exponential of estimate and ends: for an interval of a logarithm.

        >>> Interval(0.0, None, None).ratio
        Interval(estimate=1.0, low=None, high=None)
        """
        low, high = (None if end is None else math.exp(end) for end in (self.low, self.high))
        return Interval(math.exp(self.estimate), low, high)


@dataclasses.dataclass(frozen=True, slots=True)
class Robust:
    """The interval and the two-sided test of an effect that stay valid where the people's own effects are skewed.

    Parameters
    ----------
    skewness
        Of the estimate's error: see `focalgradient.statistics.skewness.error_skewness`.
    noise
        Share of the variance of the subjects' own effects that the noise of their answers explains, 0 to 1.
    low, high
        The 95 % interval.
    p, p_holm
        Probability, and after Holm's correction over its family of tests.
    decides
        Whether this test decides; else Student's t does, and this one stands beside it.
    """

    skewness: float
    noise: float
    low: float
    high: float
    p: float
    p_holm: float | None = None
    decides: bool = True

    @property
    def corrected_p(self) -> float:
        """The probability, by Holm where the test is one of a family."""
        return self.p if self.p_holm is None else self.p_holm


@dataclasses.dataclass(frozen=True, slots=True)
class Effect:
    """An estimate over subjects, with its interval and two-sided test.

    Parameters
    ----------
    estimate, low, high
        The estimate and its 95 % interval, in the unit that the field holding it states.
    standard_error
        Of the estimate.
    statistic, df, p
        Student's t of the estimate against zero, its degrees of freedom and probability.
    dz
        Cohen's d_z: the mean over the standard deviation of the subjects' own effects; None where the test is another
        than a paired t-test of these.
    subjects
        How many the estimate rests on.
    method
        How it was computed, in words for a report.
    remarks
        What did not go as planned, a sentence each.
    p_holm
        Probability after Holm's correction over its family of tests; None outside a family.
    d
        Of a test over subjects and scenes, Westfall, Kenny and Judd's (2014) d with its interval: the mean over the
        root of the sum of the variances of subjects, scenes and residuals.
    robust
        The interval and test robust to skewed people, which say whether they decide; without them Student's t decides.
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
    robust: Robust | None = None

    @property
    def deciding(self) -> Effect | Robust:
        """The test that decides: the robust one where there is one that decides, else Student's t."""
        return self.robust if self.robust is not None and self.robust.decides else self

    @property
    def corrected_p(self) -> float:
        """The probability by Student's t, by Holm where the test is one of a family."""
        return self.p if self.p_holm is None else self.p_holm

    @property
    def deciding_p(self) -> float:
        """The probability of the test that decides, by Holm where it is one of a family."""
        return self.deciding.corrected_p

    @property
    def significant(self) -> bool:
        """Whether the test that decides rejects at .05: the rule everywhere."""
        return self.deciding_p < ALPHA

    @property
    def interval(self) -> Interval:
        """The estimate with the 95 % interval of the test that decides."""
        return Interval(self.estimate, self.deciding.low, self.deciding.high)

    @property
    def ratio(self) -> Interval:
        """The exponential of `interval`: for an effect on a logarithm."""
        return self.interval.ratio

    @property
    def dz_interval(self) -> Interval | None:
        """d_z with its 95 % interval: those d_z whose noncentral t has the one found at its 2.5 and 97.5 %.

        Examples
        --------
        >>> effect = Effect(0.2, 0.1, 0.3, 0.04, 2.53, 9, 0.032, 0.8, 10, "an example")
        >>> round(effect.dz_interval.low, 3), round(effect.dz_interval.high, 3)
        (0.065, 1.503)
        """
        if self.dz is None:
            return None
        from scipy import optimize, stats

        df, root = self.subjects - 1, math.sqrt(self.subjects)
        t = self.dz * root
        reach = 12 * math.sqrt(1 + t**2 / (2 * df))  # standard errors of t: far beyond both ends

        def beyond(center: float, share: float) -> float:
            found = float(stats.nct.cdf(t, df, center))
            return (found if math.isfinite(found) else float(center < t)) - share  # NaN far off in the tails

        shares = ((1 + CONFIDENCE) / 2, (1 - CONFIDENCE) / 2)
        low, high = (optimize.brentq(beyond, t - reach, t + reach, args=(share,)) / root for share in shares)
        return Interval(self.dz, low, high)

    def summary(self) -> str:
        """The effect in a line, as a paper gives it.

        Examples
        --------
        >>> Effect(0.2, 0.1, 0.3, 0.04, 5.0, 7, 0.0016, 1.77, 8, "an example").summary()
        '0.200, 95 % interval 0.100 to 0.300, t(7) = 5.00, p = .002'
        """
        name = "p" if self.p_holm is None else "p (Holm)"
        df = f"{self.df:g}" if float(self.df).is_integer() else f"{self.df:.2f}"
        ends = self.interval
        text = f"{self.estimate:.3f}, 95 % interval {ends.low:.3f} to {ends.high:.3f}, t({df}) = {self.statistic:.2f}"
        text += f", {name} {_stated(self.corrected_p)}"
        return text if self.robust is None else f"{text}, robust {name} {_stated(self.robust.corrected_p)}"


def _stated(p: float) -> str:
    return "< .001" if p < 0.001 else f"= {p:.3f}".replace("0.", ".", 1)


def line(name: str, found: Effect | NotComputed) -> str:
    """A line of a summary: what was tested, and the effect or why there is none.

    >>> line("log rise", NotComputed("one subject only"))
    'log rise: one subject only'
    """
    return f"{name}: {found.reason if isinstance(found, NotComputed) else found.summary()}"


def as_table(records: Iterable[Any]) -> pd.DataFrame:
    """Records of one kind as a table, one a row: for CSV and for reports. A record inside gives a column a field.

    Examples
    --------
    >>> as_table([NotComputed("There is one subject only.")])["reason"][0]
    'There is one subject only.'
    """
    return pd.json_normalize([_fields(record) for record in records])


def _fields(record: Any) -> dict[str, Any]:
    """Fields by name, records within as dicts; an effect has the ends of d_z's interval, too."""
    found: dict[str, Any] = {}
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        found[field.name] = _fields(value) if dataclasses.is_dataclass(value) else value
    if isinstance(record, Effect):
        dz = record.dz_interval
        found |= {"dz_low": dz and dz.low, "dz_high": dz and dz.high}
    return found
