"""Thresholds of trials whose level an adaptive procedure sets.

The procedure holds the proportion of correct answers constant, so that conditions differ in the level alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from itertools import combinations, product

import pandas as pd

from focalgradient.statistics.condition_test import level_text
from focalgradient.statistics.questions import Analysis
from focalgradient.statistics.records import NotComputed
from focalgradient.statistics.threshold_questions import MEAN, threshold_questions
from focalgradient.statistics.thresholds import (
    SubjectThreshold,
    ThresholdResult,
    blur_thresholds,
    late_levels,
)

__all__ = ["WITHOUT_FIT", "adapted_questions"]

WITHOUT_FIT = (
    "psignifit (extra thresholds) is not installed: each threshold is the geometric mean of the levels in the second "
    "half of the trials, to which the procedure converges, without an interval of its own."
)


def adapted_questions(
    level: str,
    right: str,
    factors: Mapping[str, Sequence[object]],
    unit: str = "",
    guess: float = 0.5,
    *,
    adaptive: bool = True,
) -> Analysis:
    """Return the questions about thresholds in each condition, asked of a table of trials in the order shown.

    Parameters
    ----------
    level, right
        Columns of the level that the procedure sets, and of whether the answer was correct.
    factors
        Columns of the conditions, with their levels. Conditions that differ in one factor are compared.
    unit
        Unit of the levels.
    guess
        Guess rate.
    adaptive
        False for constant stimuli.

    Examples
    --------
    >>> adapted_questions("blur", "correct", {"eye": ["left", "right"]}).hypotheses
    ['H1 (primary). The thresholds of eye left and of eye right differ.']
    """
    cells = {
        ", ".join(map(" ".join, zip(factors, texts, strict=True))): texts
        for texts in product(*(map(level_text, levels) for levels in factors.values()))
    }
    compared = [
        (one, other)
        for one, other in combinations(cells, 2)
        if sum(left != right for left, right in zip(cells[one], cells[other], strict=True)) == 1
    ]
    fits = find_spec("psignifit") is not None

    def prepare(table: pd.DataFrame) -> dict[str, ThresholdResult]:
        rows = table.assign(level=table[level].astype(float), correct=table[right].astype(bool), catch=False)
        rows = rows if "session" in rows else rows.assign(session="")
        shown = rows[[*factors]].map(level_text)
        return {
            name: _thresholds(rows[shown.eq([*texts]).all(axis=1)], rows["level"], unit, guess, fits=fits)
            for name, texts in cells.items()
        }

    asked = threshold_questions(unit, cells, guess, compared=compared)
    questions = asked.questions
    if not fits:
        questions = [replace(one, method=WITHOUT_FIT) if one.name == MEAN else one for one in questions]
    each = " in each condition" if len(cells) > 1 else ""
    outcome = f"The primary outcome is the geometric mean over participants of the threshold{each}"
    return replace(
        asked,
        questions=questions,
        outcome=f"{outcome}, and its ratio between conditions." if compared else f"{outcome}.",
        after=asked.after if fits and adaptive else "Catch trials do not count.",
        prepare=prepare,
        exclusions=None,
        kind="conditions",
    )


def _thresholds(
    rows: pd.DataFrame, levels: pd.Series[float], unit: str, guess: float, *, fits: bool
) -> ThresholdResult:
    """Return the threshold of each participant; `levels` are those of all conditions."""
    least, most = float(levels.min()), float(levels.max())
    if 0 < least < most and fits:
        return blur_thresholds(rows, least=least, most=most, unit=unit, guess=guess)
    why = f"All levels are {least:g}: a threshold needs several." if fits else ""
    if least <= 0:
        why = f"A threshold needs levels above 0, as it is found on their logarithm, and one is {least:g}."
    sessions = [
        SubjectThreshold(str(who), str(session), 0, 0, True, NotComputed(why) if why else late_levels(own))
        for (who, session), own in rows.groupby(["participant_id", "session"], sort=True)["level"]
    ]
    return ThresholdResult(unit, tuple(sessions))
