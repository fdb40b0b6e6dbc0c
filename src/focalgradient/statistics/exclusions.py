"""Application of predefined exclusion criteria; exclusions are counted, and the data are not modified.

No criterion depends on the effect under study: excluding people whose answers did not follow the blur would create an
effect. A criterion that cannot be judged independently of it is not applied, and the reason is given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.analyses import Analysis, analysis_named
from focalgradient.errors import InputError
from focalgradient.statistics.criteria import OF_CUBE, OF_RATINGS, WORDING, Rules
from focalgradient.statistics.judging import (
    SubjectQuality,
    judged_observers,
    judged_raters,
)
from focalgradient.user_tables.tidy import rating_table, report_table

__all__ = ["Exclusion", "Quality", "Rules", "SubjectQuality", "Unjudged", "kept_rows", "quality"]


@dataclass(frozen=True, slots=True)
class Exclusion:
    """Trials that one rule excluded from one subject, possibly all of them."""

    participant_id: str
    rule: str
    whole_subject: bool
    trials: int


@dataclass(frozen=True, slots=True)
class Unjudged:
    """Rule that could not be applied: its field in `Rules`, and the reason in words."""

    rule: str
    reason: str


@dataclass(frozen=True, slots=True)
class Quality:
    """Data quality and exclusions.

    Parameters
    ----------
    rules
        Rules applied.
    subjects_before, subjects_after, trials_before, trials_after
        Counts without catch trials.
    subjects
        Quality measures of each subject.
    exclusions
        Exclusions by each rule; a trial excluded by several rules counts for each.
    unjudged
        Active rules that could not be applied to these data.
    """

    rules: Rules
    subjects_before: int
    subjects_after: int
    trials_before: int
    trials_after: int
    subjects: tuple[SubjectQuality, ...]
    exclusions: tuple[Exclusion, ...]
    unjudged: tuple[Unjudged, ...] = ()


def quality(
    table: pd.DataFrame, rules: Rules | None = None, scale: Analysis | str = "ratio", middle: float | None = None
) -> tuple[pd.DataFrame, Quality]:
    """Assess the quality of a table and apply the exclusion rules.

    Parameters
    ----------
    table
        Depth ratings, or reports on the cube (distinguished by the columns).
    rules
        Rules; None: the defaults.
    scale
        Analysis of the ratings (`focalgradient.scales.Analysis`), or its name: "ratio", "ordinal", "bipolar" or
        "choice". Spread and lapses are assessed for ratios only.
    middle
        Middle of the scale: clearly flatter pictures should be answered below it, clearly deeper ones above. None: that
        of the scale; for an ordinal scale it is then unknown, and such pictures are not assessed.

    Returns
    -------
    tuple
        A new table of the rows kept, including catch trials, and the quality. The input is not changed.

    Notes
    -----
    Lapses are judged relative to the subject's median at the aperture and fixation, after correction for the picture
    (over all subjects) or the scene (for this subject).

    Raises
    ------
    InputError
        If the table is of neither kind, or is invalid.

    Examples
    --------
    >>> table = pd.DataFrame({
    ...     "participant_id": "01", "trial": range(20), "scene": "room", "fixation": "nearest", "catch": False,
    ...     "aperture": ["pinhole", "f/11"] * 10, "aperture_mm": [0.0, 4.5] * 10, "rating": [1.0, 1.4, 1.1, 1.5] * 5,
    ...     "response_time": [0.1, *[1.2] * 19],
    ... })
    >>> kept, found = quality(table)
    >>> len(kept), found.exclusions[0].rule
    (19, 'answered in less than 0.3 s')
    """
    rules = rules or Rules()
    if "rating" in table:
        analysis = analysis_named(scale)
        table = rating_table(table, analysis)
        analysis = analysis if middle is None else replace(analysis, middle=middle)
        subjects = judged_raters(table, rules, analysis)
        reasons = _unjudged_ratings(table, subjects, analysis)
        concern: tuple[str, ...] = OF_RATINGS
    elif "percept" in table:
        table = report_table(table)
        subjects = judged_observers(table, rules)
        reasons = _unjudged_reports(table, subjects)
        concern = OF_CUBE
    else:
        raise InputError(
            "The table has neither a column rating nor a column percept: it must hold depth ratings or reports on the "
            "cube."
        )
    exclusions = [
        Exclusion(str(name), rule, False, _count(rows))
        for rule, wrong in _bad_trials(table, rules)
        for name, rows in table[wrong].groupby("participant_id")
    ]
    exclusions += [
        Exclusion(subject.participant_id, rule, True, subject.trials)
        for subject in subjects
        for rule in _bad_subject(subject, rules)
    ]
    kept = table[kept_rows(table, subjects, rules)]
    before, after = table[~table["catch"]], kept[~kept["catch"]]
    return kept, Quality(
        rules,
        before["participant_id"].nunique(),
        after["participant_id"].nunique(),
        _count(before),
        _count(after),
        tuple(subjects),
        tuple(exclusions),
        tuple(
            Unjudged(name, reasons[name]) for name in concern if name in reasons and getattr(rules, name) is not None
        ),
    )


def _unjudged_ratings(table: pd.DataFrame, subjects: list[SubjectQuality], analysis: Analysis) -> dict[str, str]:
    """Return the reasons why rules cannot be applied to these ratings, by field."""
    reasons = _unjudged_reports(table, subjects)
    if reasons.get("catch_passed") and table["catch"].any():
        reasons["catch_passed"] = "no answer to the catch trials is right or wrong whatever blur does"
    if "response_time" not in table or table["response_time"].isna().all():
        reasons["response_time"] = reasons["fast"] = "response times were not recorded"
    for name, few in (
        ("repeat_factor", "no picture was rated twice by a subject"),
        ("lapses", "no condition was rated three times by a subject"),
    ):
        if all(getattr(one, name) is None for one in subjects):
            reasons[name] = few if analysis.ratios else analysis.no_ratios
    if all(one.same_answer is None for one in subjects):
        reasons["same_answer"] = (
            "there are no pictures whose answers must differ whatever blur does: neither five catch trials with "
            "different right answers, nor scenes that most subjects tell apart at the pinhole"
        )
    if all(one.first_press is None for one in subjects):
        recorded = "start" in table and table["start"].notna().any()
        reasons["first_press"] = (
            "where the marker first stood was recorded in too few trials of a subject to exclude chance"
            if recorded
            else "where the marker first stood was not recorded"
        )
    return reasons


def _unjudged_reports(table: pd.DataFrame, subjects: list[SubjectQuality]) -> dict[str, str]:
    """Return the reasons why rules of both experiments cannot be applied, by field."""
    reasons = {}
    if not any(one.catch_trials for one in subjects):
        reasons["catch_passed"] = "there are no catch trials"
    if "dropped_frames" not in table or table["dropped_frames"].isna().all():
        reasons["dropped_frames"] = "dropped frames were not counted"
    if all(one.lapses is None for one in subjects):
        reasons["lapses"] = "there are no trials without a gradient"
    return reasons


def kept_rows(table: pd.DataFrame, subjects: Sequence[SubjectQuality], rules: Rules) -> NDArray[np.bool_]:
    """Return a mask of the rows that the rules keep, given the subjects' quality.

    Parameters
    ----------
    table
        Table as checked by `quality`.
    subjects
        Quality of the subjects: `Quality.subjects`.
    rules
        Rules to apply: those used for the quality, or a subset.

    Examples
    --------
    >>> table = pd.DataFrame({"participant_id": ["01", "02"], "rating": 1.0, "response_time": [0.1, 1.2]})
    >>> kept_rows(table, [], Rules()).tolist(), kept_rows(table, [], Rules(response_time=None)).tolist()
    ([False, True], [True, True])
    """
    keep = np.ones(len(table), bool)
    for _, wrong in _bad_trials(table, rules):
        keep &= ~wrong
    out = [subject.participant_id for subject in subjects if _bad_subject(subject, rules)]
    return keep & ~table["participant_id"].astype(str).isin(out).to_numpy()


def _count(rows: pd.DataFrame) -> int:
    """Count trials; reports on the cube have several rows per trial."""
    keys = [name for name in ("participant_id", "session", "trial") if name in rows]
    return len(rows[~rows["catch"]].drop_duplicates(keys))


def _bad_trials(table: pd.DataFrame, rules: Rules) -> list[tuple[str, np.ndarray]]:
    bad = []
    if rules.response_time is not None and "response_time" in table and "rating" in table:
        shortest, longest = rules.response_time
        times = table["response_time"].to_numpy(dtype=float)
        bad += [
            (f"answered in less than {shortest:g} s", times < shortest),
            (f"answered in more than {longest:g} s", times > longest),
        ]
    if rules.dropped_frames is not None and "dropped_frames" in table:
        dropped = table["dropped_frames"].to_numpy(dtype=float)
        bad.append((f"more than {rules.dropped_frames} dropped frames", dropped > rules.dropped_frames))
    return bad


def _bad_subject(subject: SubjectQuality, rules: Rules) -> list[str]:
    bad = []
    for name, rule in WORDING.items():
        value, limit = getattr(subject, name, None), getattr(rules, name)
        if not rule.reason or value is None or limit is None:
            continue
        if value < limit if name == "catch_passed" else value > limit:
            bad.append(rule.reason.format(limit))
    return bad
