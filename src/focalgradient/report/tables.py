"""Tables of results: cells formatted for reading, full precision for files, reasons for missing results in notes."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd

from focalgradient.report.document import Table
from focalgradient.statistics import Effect, Equivalence, NotComputed, Quality, as_table
from focalgradient.statistics.crossed import random_scenes
from focalgradient.statistics.questions import Answer
from focalgradient.statistics.wording import NONE, SPACE, decimals, freedom, interval, number, probability

__all__ = ["CHECKS", "EFFECTS", "MEANS", "Sheet", "answer_tables", "listed", "quality_sheets", "sheet"]


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Table for display, and the same with full precision for a file; `table` is None for file-only tables."""

    file: str
    table: Table | None
    digits: pd.DataFrame

    def of_file(self, file: str) -> Sheet:
        """Return the table under another name."""
        return replace(self, file=file, table=self.table and replace(self.table, csv=file))


EFFECTS, CHECKS, MEANS = ("primary", "main", "secondary"), ("check",), ("description",)
"""Roles of the answers in one table."""

HEAD = (
    *("result", "of", "unit", "holds for other", "estimate", "95 %", "test", "p", "p_Holm"),
    *("d (within subjects: d_z)", "95 %"),
)


def answer_tables(answers: Iterable[Answer], caption: str, roles: Collection[str] = EFFECTS) -> list[Table]:
    """Return the answers with one of some roles as a table; none if there are none. All are in results.csv."""
    shown = [answer for answer in answers if answer.role in roles]
    if roles == MEANS:
        shown = [answer for answer in shown if not isinstance(answer.outcome, NotComputed)]
    rows = [[answer.displayed_name, answer.level, *_answer(answer)] for answer in shown]
    empty = {place for place in range(1, len(HEAD)) if all(row[place] in ("", NONE) for row in rows)}
    kept = [[cell for place, cell in enumerate(row) if place not in empty] for row in [HEAD, *rows]]
    return [Table(caption, kept[0], kept[1:], _notes(shown), "results.csv")] if rows else []


def _answer(answer: Answer) -> list[str]:
    """Return unit, generality, estimate, interval, test, p, Holm's p and effect size of an answer, as displayed."""
    outcome, ratio = answer.outcome, answer.question.ratio
    unit = answer.question.unit.removeprefix("log ") if ratio else answer.question.unit
    if isinstance(outcome, NotComputed):
        return [unit, *[NONE] * 8]
    places, shown = (2, decimals) if ratio else (None, number)
    low, high = (None if end is None else answer.displayed(end) for end in (outcome.low, outcome.high))
    estimate = None if outcome.estimate is None else answer.displayed(outcome.estimate)
    row = [shown(estimate), interval(low, high, places)]
    if isinstance(outcome, Equivalence):
        unit += f", bound {shown(answer.displayed(outcome.bound))}, 90 % interval"
    if not isinstance(outcome, Effect):
        return [unit, NONE, *row, NONE, probability(getattr(outcome, "p", None)), *[NONE] * 3]
    test = f"t({freedom(outcome.df)}){SPACE}={SPACE}{decimals(outcome.statistic)}"
    size = outcome.d or outcome.dz_interval
    ends = [NONE, NONE] if size is None else [decimals(size.estimate), interval(size.low, size.high, 2)]
    over = "subjects and scenes" if random_scenes(outcome) else "subjects"
    return [unit, over, *row, test, probability(outcome.p), probability(outcome.p_holm), *ends]


def _notes(answers: Sequence[Answer]) -> tuple[str, ...]:
    """Return the reasons of missing results, and remarks with the tests that they are about where these are not all."""
    reasons = [f"{NONE}: {one.outcome.reason}" for one in answers if isinstance(one.outcome, NotComputed)]
    tests = [one for one in answers if isinstance(one.outcome, Effect)]
    remarked: dict[str, list[str]] = {}
    for answer in tests:
        for remark in answer.outcome.remarks:  # type: ignore[union-attr]
            remarked.setdefault(remark, []).append(", ".join(filter(None, (answer.name, answer.level))))
    remarks = (f"{'; '.join(of)}: {text}" if len(of) < len(tests) else text for text, of in remarked.items())
    return (*dict.fromkeys(reasons), *remarks)


def sheet(
    file: str,
    caption: str,
    records: Sequence[Any],
    shown: Mapping[str, str],
    *,
    digits: pd.DataFrame | None = None,
    notes: Sequence[str] = (),
    folded: bool = False,
) -> Sheet:
    """Return a table of records.

    Parameters
    ----------
    file, caption
        Name of the file, and caption.
    records
        A row each: dictionaries, or results of one kind.
    shown
        Template of the cells of each column by heading: fields of a record in braces, as ``{fit.mean}``, with a format
        as in ``{p:p}`` (a p value), ``{mean:2}`` (decimals), ``{mean:i2}`` (its interval, with decimals), or one of
        `format`. A cell with a missing value is a dash; the reasons of missing results are notes.
    digits
        Content of the file.  [default: all fields of the records]
    notes, folded
        Further notes, and whether the table is collapsed.

    Examples
    --------
    >>> made = sheet("a.csv", "A", [{"fit": NotComputed("too few")}, {"fit": 0.2345}], {"fit": "{fit}"})
    >>> made.table.rows, made.table.notes
    ([['–'], ['0.234']], ('–: too few',))
    """
    reasons: dict[str, None] = {}
    rows = [[_filled(template, record, reasons) for template in shown.values()] for record in records]
    if digits is None:
        digits = pd.DataFrame(records) if isinstance(records[0], dict) else as_table(records)
    return Sheet(file, Table(caption, [*shown], rows, (*reasons, *notes), file, folded), digits)


def listed(
    file: str, caption: str, header: Sequence[str], rows: Sequence[Sequence[Any]], *, folded: bool = False
) -> Sheet:
    """Return a table of texts and numbers: the numbers rounded for display, and as they are in the file."""
    shown = [["" if value is None or value != value else _text(value) for value in row] for row in rows]
    stored = pd.DataFrame(rows, columns=pd.Index(header))
    return Sheet(file, Table(caption, header, shown, csv=file, folded=folded), stored)


def _text(value: Any, form: str = "") -> str:
    if form == "p":
        return probability(value)
    if form.startswith("i"):
        return interval(value.low, value.high, int(form[1:]) if form[1:] else None)
    if form.isdigit():
        return decimals(value, int(form))
    return number(value) if isinstance(value, float) and not form else format(value, form)


def _filled(template: str, record: Any, reasons: dict[str, None]) -> str:
    """Fill in a template of `sheet`; reasons of missing results are added to `reasons`."""
    is_missing = False

    def value(match: re.Match[str]) -> str:
        nonlocal is_missing
        found = record
        for name in filter(None, match[1].split(".")):
            found = found.get(name) if isinstance(found, dict) else getattr(found, name, None)
            if isinstance(found, NotComputed):
                reasons[f"{NONE}: {found.reason}"] = None
        if found is None or isinstance(found, NotComputed) or found != found:
            is_missing = True
            return ""
        return _text(found, match[2] or "")

    text = re.sub(r"\{([\w. ]*)(?::([^}]*))?\}", value, template)
    return NONE if is_missing else text


def quality_sheets(found: Quality, name: str) -> list[Sheet]:
    """Return tables of data quality and exclusions."""
    left = {one.participant_id for one in found.exclusions if one.whole_subject}
    columns = {
        "subject": "{quality.participant_id}",
        "trials": "{quality.trials}",
        "catch trials passed": "{quality.catch_passed:.0%} of {quality.catch_trials}",
        "spread of repeats (factor)": "{quality.repeat_factor}",
        "lapses": "{quality.lapses:.1%}",
        "too fast / slow": "{quality.too_fast} / {quality.too_slow}",
        "trials with dropped frames": "{quality.dropped}",
        "in the analysis": "{analysed}",
    }
    people = [{"quality": one, "analysed": "no" if one.participant_id in left else "yes"} for one in found.subjects]
    caption, stored = "Quality of each subject’s data, before exclusions", as_table(found.subjects)
    sheets = [sheet(f"{name}_quality.csv", caption, people, columns, digits=stored)]
    if found.exclusions:
        columns = {"subject": "{of.participant_id}", "rule": "{of.rule}", "trials left out": "{trials}"}
        rows = [{"of": one, "trials": "all" if one.whole_subject else str(one.trials)} for one in found.exclusions]
        file = f"{name}_exclusions.csv"
        sheets.append(sheet(file, "Exclusions", rows, columns, digits=as_table(found.exclusions)))
    return sheets
