"""Signal detection in the user's own table: d', criterion and confidence."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.plotting.detection import detection_figure
from focalgradient.report.export import r_script, table_files
from focalgradient.report.parts import Drawing, Part, Plan, is_simulated
from focalgradient.report.tables import EFFECTS, Sheet, listed
from focalgradient.statistics import NotComputed
from focalgradient.statistics.detection import (
    DetectionGroup,
    RatingRoc,
    detection_by_person,
    detection_outcomes,
    detection_questions,
    rating_roc,
    roc_area,
    type2_area,
)
from focalgradient.statistics.wording import many
from focalgradient.user_tables.detection import OwnDetection

__all__ = ["detection_part"]

CAPTION = (
    "Left: each person’s rates (discs) and, where confidence was asked, ROC (thin); bold: the curve of equal variances "
    "with the mean d′. Right: each person’s d′ and the mean of all (disc), with 95 % intervals."
)

Curves = Mapping[tuple[str, str], RatingRoc | NotComputed]
"""ROC of each person and condition, or the reason why there is none; empty without confidence ratings."""

Areas = Mapping[tuple[str, str], tuple[float, float]]
"""Areas under the points of the ROC and under the type-2 ROC of each person and condition."""

MANY_EXTREME = 0.1
"""Share of rates of 0 or 1 in a condition from which the report warns: with a third of them, conditions of the same d'
but other criteria or numbers of trials differ significantly in up to .4 of experiments (12 people, 20 trials of each).
"""

EXTREME = (
    "Of the rates of hits and false alarms {} are 0 or 1: the correction for these draws d′ and c towards 0, so that "
    "other criteria or numbers of trials alone can make conditions differ in d′. A probit model of all trials has "
    "less bias: in R with lme4, glmer(answer ~ signal * condition + (signal + condition | participant_id), d, "
    'binomial("probit")).'
)


def detection_part(own: OwnDetection) -> Part:
    """Compute d' for each person and condition, and the ROC curves of confidence.

    Raises
    ------
    InputError
        If nobody was shown both signal and noise in a condition.
    """
    table = own.table[~own.table["catch"]]
    shown = table.groupby(["participant_id", "condition"])["signal"].transform("mean")
    without = table[(shown == 0) | (shown == 1)][["participant_id", "condition"]].drop_duplicates().astype(str)
    kept = table[(shown > 0) & (shown < 1)]
    if kept.empty:
        raise InputError(
            "Nobody was shown both signal and noise in one condition: give each person trials with signal and trials "
            "without."
        )
    curves, areas = {}, {}
    for (person, condition), rows in kept.groupby(["participant_id", "condition"]) if own.steps else ():
        who = str(person), str(condition)
        counts = [_counts(rows[rows["signal"] == there], own.steps) for there in (True, False)]
        curves[who], areas[who] = rating_roc(*counts), (roc_area(*counts), type2_area(*counts))
    group = detection_by_person(kept)
    questions = detection_questions([*group.d_prime], confidence=bool(own.steps))
    answers = questions.answers(detection_outcomes(group, curves, areas))
    people = len({name for name, _ in group.people})
    several = f" in {len(group.d_prime)} conditions" if len(group.d_prime) > 1 else ""
    asked = f", with confidence in {own.steps} steps" if own.steps else ""
    rates = kept.groupby(["participant_id", "condition", "signal"])["answer"].mean()
    extreme = rates.isin([0, 1]).groupby(level="condition", sort=False).mean()
    missing = {(place, one.reason) for (_, place), one in curves.items() if isinstance(one, NotComputed)}
    known = {who: one for who, one in curves.items() if isinstance(one, RatingRoc)}
    return Part(
        title="Signal detection",
        name="detection",
        plan=Plan(questions),
        answers=answers,
        simulated=is_simulated(own.table),
        sample=[f"Answers of yes and no by {many(people, 'person')}{several}: {many(len(own.table), 'trial')}{asked}."],
        notices=[
            *(
                f"{person} was left out{f' in {place}' * bool(place)}: there must be trials with signal and trials "
                "without."
                for person, place in without.to_numpy()
            ),
            *(
                f"{place}: of some people there is no estimate: {reason}".removeprefix(": ")
                for place, reason in sorted(missing)
            ),
            *[EXTREME.format(", ".join(f"{share:.0%}{f' in {name}' * bool(name)}" for name, share in extreme.items()))]
            * bool(extreme.max() >= MANY_EXTREME),
        ],
        figures=[Drawing("detection", CAPTION, partial(detection_figure, group, known))],
        captions={EFFECTS: "Means over people, and differences of d′ between conditions"},
        sheets=[_sheet(group, curves, areas)],
        files=table_files("detection_trials", own.exported) | {"detection.R": r_script("detection", answers)},
    )


def _sheet(group: DetectionGroup, curves: Curves, areas: Areas) -> Sheet:
    rows: list[list[Any]] = []
    for who, one in group.people.items():
        ends = [end for found in (one.d_prime, one.criterion) for end in (found.estimate, found.low, found.high)]
        rows.append([*who, one.hit_rate, one.false_alarm_rate, *ends])
        if areas:
            (area, type2), curve = areas[who], curves[who]
            fitted = [curve.d_a.estimate, curve.sd_ratio.estimate] if isinstance(curve, RatingRoc) else [None] * 2
            rows[-1] += [area, *fitted, type2]
    head = ["participant", "condition", "hit rate", "false-alarm rate", "d′", "low", "high", "c", "low c", "high c"]
    head += ["area", "d_a", "SD ratio", "type-2 area"] if areas else []
    return listed("detection.csv", "Each person’s d′ and criterion with 95 % intervals", head, rows)


def _counts(rows: pd.DataFrame, steps: int) -> list[int]:
    """Return answer counts from the most confident "no" to the most confident "yes"."""
    sure = rows["confidence"].to_numpy(int)
    place = np.where(rows["answer"].to_numpy(bool), steps - 1 + sure, steps - sure)
    return [int(each) for each in np.bincount(place, minlength=2 * steps)]
