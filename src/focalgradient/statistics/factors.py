"""Effects of user-defined factors: on the answers, and on their change with blur."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.statistics.means import between_levels, family
from focalgradient.statistics.questions import Answer, Answers, less, quoted, stated

__all__ = ["factor_effects"]


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
        measures = {
            "answer": (_means(table, name), "mean_at"),
            "change with blur": (_changes(table, name), "change_at"),
        }
        for measure, (own, in_r) in measures.items():
            of = f"{in_r}({quoted('log_rating' if ratios else 'rating')}, {quoted(name)}, %s)"
            levels = {str(level): rows.droplevel(1) for level, rows in own.groupby(level=1)}
            none = pd.Series(dtype=float)
            tests = family(
                between_levels(levels.get(level, none), levels.get(first, none), paired=paired) for level in others
            )
            for level, test in zip(others, tests, strict=True):
                asked, compared = f"{measure} by {name}", less(level, first)
                both = ", ".join(of % quoted(each) for each in (level, first))
                code = f"show({quoted(asked)}, {quoted(compared)}, {'paired' if paired else 'welch'}({both}))\n"
                found.append(stated(asked, compared, test, "secondary", unit, r_code=code))
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
