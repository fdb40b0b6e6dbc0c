"""Rows of a table of one's own that are no answers: headers, summaries, missing values by code, copies.

What is certain is left out, and each is noted with its rows for the top of the report; what is not certain stays.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.statistics.own_names import clean, is_summary, maybe_summary, rows_named

__all__ = ["in_seconds", "without_codes", "without_copies", "without_headers", "without_summaries"]

CODE = re.compile(r"-?9{2,}|-9|-?8{3,}")
"""Values that stand for a missing answer: 99, 999, -9, -99, -999, 888, ..."""

BEYOND = 10.0
"""Factor by which a positive code must exceed all other answers to be one: 99 among answers up to 98 is an answer."""

ALIKE = 0.7
"""Share of answers that two different subjects may have in common for the answers of a third to be known as a copy."""

FEW = 4
"""Minimum number of rows of a copied block."""

CHANCE = 1e-6
"""Probability of the same answers by chance, by how steady a subject is, below which they are a copy: our choice."""


def without_headers(table: pd.DataFrame, theirs: Mapping[str, str], notices: list[str]) -> pd.DataFrame:
    """The table, its columns by role, without rows that repeat the header."""
    if table.empty:
        return table
    again = pd.Series(True, index=table.index)
    for role in table:
        again &= table[role].str.strip().str.casefold() == clean(theirs.get(str(role), "")).casefold()
    if again.any():
        notices.append(f"The header stands again in {rows_named(table, again)}: left out.")
    return table[~again]


def without_summaries(table: pd.DataFrame, notices: list[str]) -> pd.DataFrame:
    """The table without rows whose participant or scene is called Mean, Total, ... in one of several languages."""
    for role, noun in (("participant_id", "participant"), ("scene", "scene")):
        if role not in table:
            continue
        names = [str(one) for one in table[role].unique()]
        others = [one for one in names if not is_summary(one)]
        found = {one for one in names if is_summary(one, others)}
        doubtful = {one for one in names if maybe_summary(one)}
        if role == "scene" and len(found) == len(names):
            continue
        if found:
            found |= doubtful
        elif doubtful:
            notices.append(f"{', '.join(sorted(doubtful))} is taken for the name of a {noun}, not for a summary.")
        summaries = table[role].isin(found)
        if summaries.any():
            notices.append(
                f"Rows of summaries were left out, where the {noun} is {', '.join(sorted(found))}: "
                f"{rows_named(table, summaries)}."
            )
            table = table[~summaries]
    return table


def without_codes(table: pd.DataFrame, role: str, notices: list[str], *, signed: bool = False) -> pd.DataFrame:
    """The table with an empty cell wherever the column of a role holds a code for a missing value.

    A code is negative where no value can be (`signed` is false), or far beyond all others.
    """
    if role not in table:
        return table
    texts = table[role].str.strip().str.replace(r"[.,]0+$", "", regex=True)
    codes = texts.map({one: bool(CODE.fullmatch(one)) for one in texts.unique()}).astype(bool)
    if not codes.any():
        return table
    values = pd.to_numeric(texts.str.replace(",", ".", regex=False), errors="coerce").abs()
    others = values[~codes & np.isfinite(values)]
    negative = texts.str.startswith("-") & (not signed)
    missing = codes & (negative | (values > BEYOND * others.max()))
    if not missing.any():
        return table
    listed = ", ".join(sorted(texts[missing].unique()))
    notices.append(f"{listed} in the column of {role}s was taken for a missing value: {rows_named(table, missing)}.")
    return table.assign(**{role: table[role].mask(missing, "")})


def in_seconds(table: pd.DataFrame, role: str, header: str, longest: float, notices: list[str]) -> pd.DataFrame:
    """The table with times in seconds: in milliseconds only where the header states them.

    Raises
    ------
    InputError
        If the median is above the `longest` that can be meant, in seconds.
    """
    if role not in table:
        return table
    if re.search(r"(^|[_\s(\[.\-])(ms|msec|millis|milliseconds)($|[_\s)\].\-])", clean(header).casefold()):
        notices.append(f"Times in the column {header} are in milliseconds: divided by 1000.")
        return table.assign(**{role: table[role] / 1000})
    middle = float(table[role].median())
    if middle > longest:
        raise InputError(
            f"the median of {role} is {middle:g}, but must be a time in seconds: give seconds, or call the column "
            f"{role}_ms where these are milliseconds."
        )
    return table


def without_copies(table: pd.DataFrame, notices: list[str], notes: list[str]) -> pd.DataFrame:
    """The table without blocks of rows that repeat another block of the same subject, or all answers of another one."""
    of = [name for name in ("participant_id", "session") if name in table]
    conditions = [name for name in ("session", "scene", "aperture", "fixation", "catch") if name in table]
    about = [name for name in (*conditions, "rating", "response_time") if name in table]
    groups = table.groupby(of, sort=False).indices
    cells = pd.DataFrame({name: pd.factorize(table[name])[0] for name in about}).to_numpy()
    left_out = np.zeros(len(table), bool)
    sizes = [len(rows) for rows in groups.values()]
    for key, rows in groups.items():
        half = len(rows) // 2
        if len(rows) % 2 or half < FEW or not (cells[rows[:half]] == cells[rows[half:]]).all():
            continue
        if sizes.count(half) * 2 > len(sizes) or _by_chance(table.iloc[rows[:half]]) < CHANCE:
            left_out[rows[half:]] = True
            who = " ".join(str(one) for one in np.atleast_1d(np.array(key, dtype=object))).strip()
            again = pd.Series(np.isin(np.arange(len(table)), rows[half:]))
            notices.append(f"{who} stands twice, with the same answers: {rows_named(table, again)} were left out.")
    table = table[~left_out]
    return _without_other_names(table, conditions, notices, notes)


def _by_chance(rows: pd.DataFrame) -> float:
    """Probability that another with the same impressions gives the same answers in all rows of a subject.

    Estimated by how often the subject's answers to one picture differ; without repetitions, those to one condition. A
    steady subject who rounds may well be like another.
    """
    for about in (["scene", "aperture", "fixation"], ["aperture", "fixation"]):
        same = pairs = 0.0
        for _, answers in rows.groupby(about)["rating"]:
            counts = answers.value_counts().to_numpy(float)
            same += float((counts * (counts - 1)).sum())
            pairs += float(counts.sum() * (counts.sum() - 1))
        if pairs >= 2 * FEW:
            return (same / pairs) ** len(rows)
    return 1.0


def _without_other_names(
    table: pd.DataFrame, conditions: list[str], notices: list[str], notes: list[str]
) -> pd.DataFrame:
    """The table without subjects whose every answer is that of another, where different subjects agree much less."""
    ordered = table.sort_values(conditions, kind="stable")
    codes = pd.DataFrame({name: pd.factorize(ordered[name])[0] for name in conditions}).to_numpy()
    given = ordered[[name for name in ("rating", "response_time") if name in ordered]].fillna(-1.0).to_numpy(float)
    shown: dict[bytes, dict[str, np.ndarray]] = {}
    for who, rows in ordered.groupby("participant_id", sort=False).indices.items():
        if len(rows) >= FEW:
            shown.setdefault(codes[rows].tobytes(), {})[str(who)] = given[rows].ravel()
    for answers in shown.values():
        names, values = list(answers), np.array(list(answers.values()))
        _, first, group = np.unique(values, axis=0, return_index=True, return_inverse=True)
        for number in range(len(first)):
            same = np.flatnonzero(group.ravel() == number)
            if len(same) < 2:
                continue
            others = np.delete(values, same, axis=0)
            agree = (others == values[same[0]]).mean(axis=1)
            whose = [names[one] for one in same]
            copied = table["participant_id"].isin(whose[1:])
            rows = table[table["participant_id"] == whose[0]]
            pairs = len(values) * (len(values) - 1) / 2
            if len(others) and agree.max() < ALIKE and pairs * _by_chance(rows) < CHANCE:
                notices.append(
                    f"{', '.join(whose)} have the same answer in every row: {rows_named(table, copied)} were left out "
                    f"as copies of {whose[0]}."
                )
                table = table[~copied]
            else:
                notes.append(
                    f"{', '.join(whose)} have the same answer in every row, as coarse answers may: check that nobody "
                    "stands twice."
                )
    return table
