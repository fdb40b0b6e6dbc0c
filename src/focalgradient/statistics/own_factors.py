"""Effects of user-defined factors: on the answers, and on their change with blur."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.statistics.means import family, paired_effect, student_effect
from focalgradient.statistics.questions import Answer, Answers, less, stated
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["factor_effects", "welch"]


def factor_effects(table: pd.DataFrame, factors: Mapping[str, Any], *, ratios: bool, unit: str = "") -> Answers:
    """Compare the levels of each factor of a design.

    Parameters
    ----------
    table
        Ratings with one column per factor; catch trials are excluded.
    factors
        Factors as in the design: by name, with ``levels`` and ``vary`` ("within" or "between").
    ratios
        True to analyse the logarithm of the answers.
    unit
        Unit of the effects; empty: "log ratio" or "units of the scale".

    Returns
    -------
    Answers
        Each level less the first of the mean answer, and of its change from the smallest to the largest aperture; the
        tests of one measure of one factor are corrected by Holm's method as a family.

    Raises
    ------
    InputError
        If a factor has no column.

    Examples
    --------
    >>> rows = [
    ...     {"participant_id": who, "aperture_mm": mm, "light": light, "catch": False,
    ...      "rating": 1 + mm * (0.1 + 0.02 * who * (light == "bright"))}
    ...     for who in range(5) for mm in (0.0, 5.0) for light in ("dim", "bright")
    ... ]
    >>> found = factor_effects(pd.DataFrame(rows), {"light": {"levels": ["dim", "bright"]}}, ratios=False)
    >>> [(answer.name, answer.level, round(answer.outcome.estimate, 2)) for answer in found]
    [('answer by light', 'bright less dim', 0.1), ('change with blur by light', 'bright less dim', 0.2)]
    """
    table = table[~table["catch"]]
    answer = np.log(table["rating"]) if ratios else table["rating"]
    table = table.assign(answer=answer.astype(float))
    unit = unit or ("log ratio" if ratios else "units of the scale")
    found: list[Answer] = []
    for name, factor in factors.items():
        if name not in table:
            raise InputError(f"the table has no column {name}, a factor of the design: write the tables again.")
        first, *others = factor["levels"]
        paired = factor.get("vary", "within") == "within"
        for measure, own in (("answer", _means(table, name)), ("change with blur", _changes(table, name))):
            tests = family(_between(own, level, first, paired=paired) for level in others)
            found += [
                stated(f"{measure} by {name}", less(level, first), test, "secondary", unit)
                for level, test in zip(others, tests, strict=True)
            ]
    return Answers(tuple(found))


def _means(table: pd.DataFrame, name: str) -> pd.Series[float]:
    """Return the mean answer of each subject at each level, over all apertures."""
    cells = table.groupby(["participant_id", name, "aperture_mm"])["answer"].mean()
    return cells.groupby(["participant_id", name]).mean()


def _changes(table: pd.DataFrame, name: str) -> pd.Series[float]:
    """Return each subject's mean answer at the largest aperture minus that at the smallest, by level."""
    ends = [table["aperture_mm"].max(), table["aperture_mm"].min()]
    keys = ["participant_id", name]
    large, small = (table[table["aperture_mm"] == end].groupby(keys)["answer"].mean() for end in ends)
    return (large - small).dropna()


def _between(own: pd.Series[float], level: str, first: str, *, paired: bool) -> Effect | NotComputed:
    each: Sequence[pd.Series[float]] = [
        own[own.index.get_level_values(1) == one].droplevel(1) for one in (level, first)
    ]
    if paired:
        both = (each[0] - each[1]).dropna()
        return paired_effect(both.to_numpy(), "paired t over subjects")
    return welch(*(one.to_numpy(float) for one in each))


def welch(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> Effect | NotComputed:
    """Compare the means of two groups of subjects with unequal variances (Welch 1947)."""
    if min(len(one), len(other)) < 2:
        return NotComputed(
            f"A test between groups needs two subjects in each, and there are {len(one)} and {len(other)}."
        )
    parts = [float(values.var(ddof=1)) / len(values) for values in (one, other)]
    error = math.sqrt(sum(parts))
    if error == 0:
        return NotComputed("All subjects of a group have the same value: there is no variation to test against.")
    df = sum(parts) ** 2 / sum(part**2 / (len(values) - 1) for part, values in zip(parts, (one, other), strict=True))
    estimate, subjects = float(one.mean() - other.mean()), len(one) + len(other)
    return student_effect(estimate, error, subjects, "Welch's t between groups of subjects", df=df)
