"""Sensitivity of the main effects to the exclusion rules: the analysis repeated with each rule left out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from focalgradient.analyses import Analysis
from focalgradient.statistics.criteria import OF_RATINGS, WORDING, Rules
from focalgradient.statistics.effects import questions_of
from focalgradient.statistics.exclusions import kept_rows
from focalgradient.statistics.questions import Analysis as Questions
from focalgradient.user_tables.tidy import fixations_of, rating_table

__all__ = ["ALL_RULES", "Variant", "robustness"]

ALL_RULES = "all"


@dataclass(frozen=True, slots=True)
class Variant:
    """Effect of the aperture at one fixation, with one exclusion rule left out.

    Parameters
    ----------
    fixation
        Object in focus.
    rules
        `ALL_RULES`, or the field of `Rules` that was switched off.
    subjects, trials
        Number of subjects and of trials that are analysed, without catch trials.
    estimate, low, high, p
        The analysis' effect with its 95 % interval and p value, not corrected for multiple tests; None if not computed.
    distinct
        False if all rules keep the same data.
    reason
        Reason why the effect was not computed.
    """

    fixation: str
    rules: str
    subjects: int
    trials: int
    estimate: float | None
    low: float | None
    high: float | None
    p: float | None
    distinct: bool
    reason: str = ""


def robustness(table: pd.DataFrame, rules: Rules | None = None, scale: Analysis | str = "ratio") -> tuple[Variant, ...]:
    """Repeat the analysis of ratings with each exclusion rule left out.

    Subjects are judged once, with all rules.

    Parameters
    ----------
    table
        One row per trial: see `focalgradient.user_tables.tidy.rating_table`.
    rules
        Exclusion rules; None: the defaults.
    scale
        Analysis of the ratings, or its name.

    Returns
    -------
    tuple
        For each fixation the effect with all rules, then with each rule left out.

    Raises
    ------
    InputError
        If the table is invalid.

    Examples
    --------
    >>> rows = [{"participant_id": f"{who:02}", "trial": trial, "scene": "room", "fixation": "nearest", "catch": False,
    ...          "aperture": name, "aperture_mm": mm, "rating": 1 + (0.05 + 0.01 * who) * mm}
    ...         for who in range(6) for trial, (name, mm) in enumerate([("pinhole", 0.0), ("f/11", 4.5)])]
    >>> main, *others = robustness(pd.DataFrame(rows))
    >>> round(main.estimate, 3), main.subjects, any(variant.distinct for variant in others)
    (0.289, 6, False)
    """
    table = rating_table(table, scale)
    asked = questions_of(scale, {*table["fixation"]}, table["scene"].nunique(), {}, rules=rules)
    kept, judged = asked.excluded(table)
    assert judged is not None
    unjudged, rules = {rule.rule for rule in judged.unjudged}, judged.rules
    stated = [
        name
        for name in OF_RATINGS
        if name not in unjudged and not WORDING[name].defines and getattr(rules, name) is not None
    ]
    whole = _variants(kept, asked, ALL_RULES)
    variants = [whole]
    for name in stated:
        off: dict[str, Any] = {name: None}
        rows = table[kept_rows(table, judged.subjects, replace(rules, **off))]
        if len(rows) == len(kept):
            variants.append([replace(variant, rules=name, distinct=False) for variant in whole])
        else:
            variants.append(_variants(rows, asked, name))
    fixations = fixations_of(table[~table["catch"]])
    return tuple(variant for name in fixations for found in variants for variant in found if variant.fixation == name)


def _variants(rows: pd.DataFrame, asked: Questions, rules: str) -> list[Variant]:
    """Return the effect at each fixation of the rows."""
    trials = rows[~rows["catch"]]
    shown = {name: own["participant_id"] for name, own in trials.groupby("fixation")}
    found = [] if trials.empty else [answer.row() for answer in asked.asked(rows, everyone=True).primary]
    return [
        Variant(
            row["level"],
            rules,
            subjects=shown[row["level"]].nunique(),
            trials=len(shown[row["level"]]),
            **{name: row.get(name) for name in ("estimate", "low", "high", "p")},
            distinct=True,
            reason=row.get("reason", ""),
        )
        for row in found
    ]
