"""What an analysis says: an effect with its interval and test, or why there is none."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import pandas as pd

__all__ = ["ALPHA", "CONFIDENCE", "Effect", "Interval", "NotComputed", "as_table"]

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
        Student's t of the estimate against none, its degrees of freedom and probability.
    dz
        Cohen's d_z: the mean over the standard deviation of the subjects' own effects; None where there are no such.
    subjects
        How many the estimate rests on.
    method
        How it was computed, in words for a report.
    remarks
        What did not go as planned, a sentence each.
    p_holm
        Probability after Holm's correction over its family of tests; None outside a family.
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


def as_table(records: Iterable[Any]) -> pd.DataFrame:
    """Records of one kind as a table, one a row: for CSV and for reports. A record inside gives a column a field.

    Examples
    --------
    >>> as_table([NotComputed("There is one subject only.")])["reason"][0]
    'There is one subject only.'
    """
    return pd.json_normalize([dataclasses.asdict(record) for record in records])
