"""Effects of user-defined factors: on the answers, and on their change with blur."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.statistics.means import between_levels
from focalgradient.statistics.questions import Analysis, Answers, Question, less, quoted
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["factor_effects", "factor_questions"]


def factor_questions(factors: Mapping[str, Any], *, ratios: bool, unit: str = "", answer: str = "rating") -> Analysis:
    """Return the questions about the levels of each factor of a design, asked of a table of ratings.

    Parameters
    ----------
    factors
        Factors as in the design: by name, with ``levels`` and ``vary`` ("within" or "between").
    ratios
        True to analyse the logarithm of the answers.
    unit
        Unit of the effects; empty: "log ratio" or "units of the scale".
    answer
        Name of the answers in R code.
    """
    unit = unit or ("log ratio" if ratios else "units of the scale")

    def prepare(table: pd.DataFrame) -> pd.DataFrame:
        if missing := [name for name in factors if name not in table]:
            raise InputError(f"the table has no column {missing[0]}, a factor of the design: write the tables again.")
        table = table[~table["catch"]]
        answers = np.log(table["rating"]) if ratios else table["rating"]
        return table.assign(answer=answers.astype(float))

    def is_paired(name: str) -> bool:
        return bool(factors[name].get("vary", "within") == "within")

    def compared(table: pd.DataFrame, name: str, of: Measure) -> dict[str, Effect | NotComputed]:
        first, *others = factors[name]["levels"]
        levels = {str(level): rows.droplevel(1) for level, rows in of(table, name).groupby(level=1)}
        none = pd.Series(dtype=float)
        return {
            less(level, first): between_levels(levels.get(level, none), levels.get(first, none), paired=is_paired(name))
            for level in others
        }

    def stated(name: str) -> str:
        levels = ", ".join(map(str, factors[name]["levels"]))
        test = "within subjects: paired t-test" if is_paired(name) else "between subjects: Welch’s t-test"
        return f"Factor {name} ({levels}; {test})"

    def in_r(what: str, name: str, function: str) -> str:
        first, *others = factors[name]["levels"]
        test = "paired" if is_paired(name) else "welch"
        of = function, "log_rating" if ratios else answer, name
        return "".join(
            f"show({quoted(what)}, {quoted(less(level, first))}, {test}({_at(*of, level)}, {_at(*of, first)}))\n"
            for level in others
        )

    measures = {"answer": (_means, "mean_at"), "change with blur": (_changes, "change_at")}
    questions = [
        Question(
            *(what, partial(compared, name=name, of=of), "secondary", unit, what),
            hypothesis=(f"The {measure} differs between the levels of {name}.",),
            r_code=in_r(what, name, function),
        )
        for name in factors
        for measure, (of, function) in measures.items()
        for what in [f"{measure} by {name}"]
    ]
    return Analysis(questions, prepare=prepare, after=f"{'; '.join(map(stated, factors))}: {FACTORS_METHOD}")


FACTORS_METHOD = (
    "of each level less the first, the mean answer and its change from the smallest to the largest aperture were "
    "tested over subjects, with Holm’s correction over the levels of each measure."
)


def _at(function: str, answer: str, name: str, level: object) -> str:
    """Return R code for the values of subjects at a level."""
    return f"{function}({quoted(answer)}, {quoted(name)}, {quoted(str(level))})"


Measure = Callable[[pd.DataFrame, str], "pd.Series[float]"]
"""Value of each subject at each level of a factor."""


def factor_effects(
    table: pd.DataFrame, factors: Mapping[str, Any], *, ratios: bool, unit: str = "", answer: str = "rating"
) -> Answers:
    """Compare the levels of each factor of a design.

    Parameters
    ----------
    table
        Ratings with one column per factor; catch trials are excluded.
    factors, ratios, unit, answer
        As in `factor_questions`.

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
    return factor_questions(factors, ratios=ratios, unit=unit, answer=answer).asked(table)


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
