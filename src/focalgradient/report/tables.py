"""Tables of result records for reading: effects with intervals and tests; reasons for missing results in notes."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any

import pandas as pd

from focalgradient.report.document import Table
from focalgradient.statistics import (
    Components,
    DepthRatingResult,
    DurationFit,
    DurationsOfPeople,
    Effect,
    Equivalence,
    NeckerResult,
    NotComputed,
    OrdinalResult,
    Quality,
    as_table,
)
from focalgradient.statistics.crossed import random_scenes
from focalgradient.statistics.questions import Answer
from focalgradient.statistics.wording import NONE, SPACE, decimals, freedom, interval, number, probability

__all__ = [
    "CHECKS",
    "EFFECTS",
    "MEANS",
    "Sheet",
    "answer_tables",
    "necker_sheets",
    "quality_sheets",
    "rating_sheets",
    "sheet",
]


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Table for display, and the same with full precision for a file; `table` is None for file-only tables."""

    file: str
    table: Table | None
    digits: pd.DataFrame


class _Cells:
    """Cells of the rows of one table; missing results are dashes, and their reasons are collected for the notes."""

    def __init__(self) -> None:
        self._reasons: dict[str, None] = {}
        self._tests = 0
        self._remarked: dict[str, list[str]] = {}  # tests by what is remarked on them

    @property
    def notes(self) -> tuple[str, ...]:
        """Reasons of missing results, and remarks with the tests that they are about where these are not all."""
        remarks = (
            f"{'; '.join(names)}: {remark}" if len(names) < self._tests else remark
            for remark, names in self._remarked.items()
        )
        return (*self._reasons, *remarks)

    def missing(self, result: NotComputed, cells: int) -> list[str]:
        self._reasons[f"{NONE}: {result.reason}"] = None
        return [NONE] * cells

    def answer(self, answer: Answer) -> list[str]:
        """Return unit, generality, estimate, interval, test, p, Holm's p and effect size of an answer, as displayed."""
        outcome, ratio = answer.outcome, answer.question.ratio
        unit = answer.question.unit.removeprefix("log ") if ratio else answer.question.unit
        if isinstance(outcome, NotComputed):
            return [unit, *self.missing(outcome, 8)]
        places, shown = (2, decimals) if ratio else (None, number)
        low, high = (None if end is None else answer.displayed(end) for end in (outcome.low, outcome.high))
        estimate = None if outcome.estimate is None else answer.displayed(outcome.estimate)
        row = [shown(estimate), interval(low, high, places)]
        if isinstance(outcome, Equivalence):
            unit += f", bound {shown(answer.displayed(outcome.bound))}, 90 % interval"
        if not isinstance(outcome, Effect):
            return [unit, NONE, *row, NONE, probability(getattr(outcome, "p", None)), *[NONE] * 3]
        self._tests += 1
        for remark in outcome.remarks:
            self._remarked.setdefault(remark, []).append(", ".join(filter(None, (answer.name, answer.level))))
        test = f"t({freedom(outcome.df)}){SPACE}={SPACE}{decimals(outcome.statistic)}"
        size = outcome.d or outcome.dz_interval
        ends = [NONE, NONE] if size is None else [decimals(size.estimate), interval(size.low, size.high, 2)]
        over = "subjects and scenes" if random_scenes(outcome) else "subjects"
        return [unit, over, *row, test, probability(outcome.p), probability(outcome.p_holm), *ends]


EFFECTS, CHECKS, MEANS = ("primary", "main", "secondary"), ("check",), ("description",)
"""Roles of the answers in one table."""


def answer_tables(answers: Iterable[Answer], caption: str, roles: Collection[str] = EFFECTS) -> list[Table]:
    """Return the answers with one of some roles as a table; none if there are none. All are in results.csv."""
    cells = _Cells()
    shown = [answer for answer in answers if answer.role in roles]
    if roles == MEANS:
        shown = [answer for answer in shown if not isinstance(answer.outcome, NotComputed)]
    rows = [[answer.name, answer.level, *cells.answer(answer)] for answer in shown]
    head = [
        "result",
        "of",
        "unit",
        "holds for other",
        "estimate",
        "95 %",
        "test",
        "p",
        "p (Holm)",
        "d (over subjects: d_z)",
        "95 %",
    ]
    empty = {place for place in range(1, len(head)) if all(row[place] in ("", NONE) for row in rows)}
    kept = [[cell for place, cell in enumerate(row) if place not in empty] for row in [head, *rows]]
    return [Table(caption, kept[0], kept[1:], cells.notes, "results.csv")] if rows else []


def quality_sheets(found: Quality, name: str) -> list[Sheet]:
    """Return tables of data quality and exclusions."""
    left = {one.participant_id for one in found.exclusions if one.whole_subject}
    rows = [
        [
            one.participant_id,
            str(one.trials),
            NONE if one.catch_passed is None else f"{one.catch_passed:.0%} of {one.catch_trials}",
            number(one.repeat_factor),
            NONE if one.lapses is None else f"{one.lapses:.1%}",
            f"{one.too_fast} / {one.too_slow}",
            NONE if one.dropped is None else str(one.dropped),
            "no" if one.participant_id in left else "yes",
        ]
        for one in found.subjects
    ]
    header = ["subject", "trials", "catch trials passed", "spread of repeats (factor)", "lapses", "too fast / slow"]
    sheets = [
        sheet(
            f"{name}_quality.csv",
            "Quality of each subject’s data, before exclusions",
            [*header, "trials with dropped frames", "in the analysis"],
            rows,
            found.subjects,
        )
    ]
    if found.exclusions:
        rows = [
            [one.participant_id, one.rule, "all" if one.whole_subject else str(one.trials)] for one in found.exclusions
        ]
        header = ["subject", "rule", "trials left out"]
        sheets.append(sheet(f"{name}_exclusions.csv", "Exclusions", header, rows, found.exclusions))
    return sheets


def rating_sheets(result: DepthRatingResult) -> list[Sheet]:
    """Return the tables of experiment 1 beside those of the effects."""
    sheets = [Sheet("depth_rating_subjects.csv", None, as_table(result.subject_means))]
    if isinstance(result.ordinal, OrdinalResult):
        return [*sheets, *_ordinal(result.ordinal)]
    if result.scene_means:
        sheets.append(Sheet("depth_rating_scenes.csv", None, as_table(result.scene_means)))
    return [*sheets, _components(result)]


def _components(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    rows, digits = [], []
    for each in result.fixations:
        found = each.components
        digits.append({"fixation": each.fixation} | as_table([found]).iloc[0].to_dict())
        if isinstance(found, Components):
            parts = [decimals(sd, 3) for sd in (found.subjects, found.scenes, found.residual)]
            check = [decimals(found.shapiro_w, 3), probability(found.shapiro_p), decimals(found.largest)]
            check += [decimals(found.skewness), decimals(found.subjects_w, 3), probability(found.subjects_p)]
            rows.append([each.fixation, found.formula, *parts, *check])
        else:
            rows.append([each.fixation, *cells.missing(found, 10)])
    header = ["in focus", "model", "SD of subjects", "SD of scenes", "SD of residuals"]
    header += ["Shapiro-Wilk W", "p", "largest residual (SD)"]
    header += ["skewness of subjects’ depth effects", "their Shapiro-Wilk W", "p"]
    caption = "Model of the depth effect (log ratio of each subject and scene), its variance components and residuals"
    return sheet("depth_rating_components.csv", caption, header, rows, digits, cells)


def _ordinal(result: OrdinalResult) -> list[Sheet]:
    """Return thresholds and proportions of the cumulative-link mixed model."""
    shares = Sheet("depth_rating_shares.csv", None, as_table(result.shares))
    if not result.thresholds:
        return [shares]
    rows = [
        [f"{each.below} | {each.above}", decimals(each.place.estimate), interval(each.place.low, each.place.high, 2)]
        for each in result.thresholds
    ]
    caption = "Thresholds between the steps, in log odds; the pinhole with the first scene is 0"
    file, header = "depth_rating_thresholds.csv", ["between", "threshold", "95 %"]
    return [sheet(file, caption, header, rows, result.thresholds), shares]


def necker_sheets(result: NeckerResult) -> list[Sheet]:
    """Return the tables of experiment 2."""
    sheets = [Sheet("necker_subjects.csv", None, as_table(result.subject_shares))]
    cells = _Cells()
    rows = []
    for each in result.dominance:
        first = [each.gradient, number(each.strength), each.percept, f"{each.reports} ({each.censored})"]
        fits = []
        for fit in (each.gamma, each.lognormal):
            if isinstance(fit, DurationFit):
                fits += [number(fit.mean), number(fit.cv), number(fit.log_likelihood, 5)]
            else:
                fits += cells.missing(fit, 3)
        rows.append([*first, *fits, {"lognormal": "log-normal"}.get(str(each.better), each.better or NONE)])
    header = ["blur agrees with", "mm", "percept", "reports (cut off)"]
    header += [f"{family}: {what}" for family in ("gamma", "log-normal") for what in ("mean (s)", "CV", "log L")]
    caption = "Percept durations (right-censored at trial end)"
    sheets.append(sheet("necker_durations.csv", caption, [*header, "better"], rows, result.dominance, cells))
    sheets.append(_durations_of_people(result))
    return sheets


OF_PEOPLE = ("geometric_mean", "geometric_mean_log_se", "shape", "shape_se", "log_sd", "log_sd_se")
"""Estimates of the durations over subjects, each with its standard error."""


def _durations_of_people(result: NeckerResult) -> Sheet:
    """Return the distribution over subjects of each reading's durations without a gradient."""
    cells = _Cells()
    rows, digits = [], []
    for each in result.people:
        names = {"gradient": each.gradient, "strength": each.strength, "percept": each.percept}
        first = [each.gradient, number(each.strength), each.percept]
        fit = each.fit
        if not isinstance(fit, DurationsOfPeople):
            rows.append([*first, *cells.missing(fit, 7)])
            digits.append(names | {"not_computed": fit.reason})
            continue
        found = {name: getattr(fit, name) for name in OF_PEOPLE}
        rows.append([*first, str(len(fit.people)), *map(number, found.values())])
        digits.append(names | {"subjects": len(fit.people)} | found)
    header = ["blur agrees with", "mm", "percept", "subjects"]
    header += ["geometric mean (s)", "SE of its log", "gamma shape", "SE"]
    header += ["SD of log mean", "SE"]
    caption = (
        "Durations over subjects: gamma distributions of one shape and each subject’s own mean, the cut-off censored"
    )
    return sheet("necker_durations_of_people.csv", caption, header, rows, digits, cells)


def sheet(
    file: str,
    caption: str,
    header: list[str],
    rows: list[list[str]],
    records: Iterable[Any],
    cells: _Cells | None = None,
) -> Sheet:
    """Return a table of `rows` for display, and for the file its `records` (dictionaries, or results of one kind)."""
    records = list(records)
    digits = pd.DataFrame(records) if isinstance(records[0], dict) else as_table(records)
    notes = () if cells is None else cells.notes
    return Sheet(file, Table(caption, header, rows, notes, file), digits)
