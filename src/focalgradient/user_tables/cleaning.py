"""Removal of rows that are not answers from the user's own table: headers, summaries, missing-value codes, copies.

Unambiguous cases are removed and noted with their rows at the top of the report; ambiguous ones are kept.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number, codes_of, is_date
from focalgradient.user_tables.names import (
    clean,
    few,
    heading,
    invalid,
    is_summary,
    maybe_summary,
    missing_as,
    rows_named,
)
from focalgradient.user_tables.schema import ABSENT

__all__ = [
    "EXCLUDED",
    "PRACTICE",
    "TRUTH",
    "check_seconds",
    "few_levels",
    "in_steps",
    "note_few_trials",
    "note_groups",
    "note_shared_names",
    "practice_in",
    "without_codes",
    "without_copied_files",
    "without_copies",
    "without_headers",
    "without_pasted",
    "without_summaries",
]

GROUPS = re.compile(r"(?:age_)?(?:groups?|cohort|sample|population|grupp[eo]|groupe|grupo)(?:_?id|_?name)?")
"""Names of columns that hold groups of people."""

MAYBE_GROUPS = re.compile(rf"(?:\w+_)?{GROUPS.pattern}|device|platform|site|lab|laboratory|expertise|training")
"""Names of columns that hold groups of people where each person has one level."""

TRUTH = {
    **dict.fromkeys(["1", "1.0", "true", "t", "yes", "y", "ja", "oui", "wahr", "vrai"], True),
    **dict.fromkeys(["0", "0.0", "false", "f", "no", "n", "nein", "non", "falsch", "faux"], False),
}
"""Recognised words for yes and no."""

PRACTICE = re.compile(
    r"(?:practi[cs]e|training(?=_?trial)|warm-?up|demo|[üu]bung)(?:\b|_|trial)[\w.\- ]*", re.IGNORECASE
)
"""Names of loops and of blocks of practice."""

EXCLUDED = re.compile(
    r"(?:is_?)?(?:exclu\w*|outliers?|reject\w*|(?:in)?valid|bad|keep|includ\w*)(?:_\w+)?", re.IGNORECASE
)
"""Names of columns that mark rows to be left out or kept."""

MAX_SHARED_ANSWERS = 0.7
"""Maximum fraction of answers that other pairs of subjects may share if an identical pair is to count as copies."""

MIN_BLOCK_ROWS = 4
"""Minimum number of rows of a copied block."""

MIN_FILE_ROWS = 20
"""Minimum number of rows of a copied file with a name of its own: right and wrong answers may coincide in fewer."""

MAX_CHANCE = 1e-6
"""Maximum probability of identical answers by chance, given a subject's variability, to count as a copy (our choice).
"""


def without_headers(table: pd.DataFrame, theirs: Mapping[str, str], notices: list[str]) -> pd.DataFrame:
    """Rename the columns by role and remove repeated header rows."""
    if table.empty:
        return table
    again = pd.Series(True, index=table.index)
    for role in table:
        again &= table[role].str.strip().str.casefold() == clean(theirs.get(str(role), "")).casefold()
    if again.any():
        notices.append(f"Repeated header skipped: {rows_named(table, again)}.")
    return table[~again]


def without_summaries(table: pd.DataFrame, notices: list[str]) -> pd.DataFrame:
    """Remove rows whose participant or scene is a summary label such as Mean or Total, in one of several languages."""
    for role, noun in (("participant_id", "participant"), ("scene", "scene")):
        if role not in table:
            continue
        names = [str(name) for name in table[role].unique()]
        others = [name for name in names if not is_summary(name)]
        summaries = {name for name in names if is_summary(name, others)}
        doubtful = {name for name in names if maybe_summary(name)}
        if role == "scene" and len(summaries) == len(names):
            continue
        if summaries:
            summaries |= doubtful
        elif doubtful:
            notices.append(f"{', '.join(sorted(doubtful))} is taken for the name of a {noun}, not for a summary.")
        is_left_out = table[role].isin(summaries)
        if is_left_out.any():
            notices.append(
                f"Rows of summaries were left out, where the {noun} is {', '.join(sorted(summaries))}: "
                f"{rows_named(table, is_left_out)}."
            )
            table = table[~is_left_out]
    return table


LABELLED = re.compile(r"\s*(\d+)\s*[(:=–—-]\s*[^\W\d_]\D*")
"""Number of a step with its label, as forms export the ends of a scale: "5 (very)"."""

MAX_LEVELS = 6
"""Maximum number of levels of a column that may be a condition (our choice)."""


def without_codes(table: pd.DataFrame, role: str, notices: list[str], *, signed: bool = False) -> pd.DataFrame:
    """Replace missing-value codes in the column of a role by empty cells: see `codes_of`.

    In a column of response times all negative numbers are codes.
    """
    cells = [str(cell) for cell in table[role].unique()]
    codes = codes_of(cells, signed=signed)
    if role == "response_time":
        codes |= {cell for cell in cells if (as_number(cell) or 0) < 0}
    missing = table[role].isin(codes)
    if not missing.any():
        return table
    listed = ", ".join(sorted(re.sub(r"[.]0+$", "", cell.strip()) for cell in codes))
    notices.append(f"{listed} in the column of {role}s was taken for a missing value: {rows_named(table, missing)}.")
    return table.assign(**{role: table[role].mask(missing, "")})


def note_shared_names(
    cells: pd.DataFrame, people: pd.Series[str], compared: Collection[str], notices: list[str]
) -> None:
    """Add a notice for each column of groups of people of which participants are in several, as if numbered anew.

    A column is one by its name if all participants are in several levels; or, also one of those `compared`, if each
    file of several people has one level.
    """
    files = cells.index.get_level_values(0)
    for name in map(str, cells):
        is_group, levels = GROUPS.fullmatch(heading(name)), cells[name].str.strip().replace("", None)
        if not (is_group or name in compared):
            continue
        counts = levels.groupby(people).nunique()
        again = [str(who) for who in counts.index[counts > 1]]
        of_files = levels.groupby(files).nunique().max() == 1 and people.groupby(files).nunique().max() > 1
        if again and ((is_group and counts.min() > 1) or of_files):
            who = "Every participant is" if counts.min() > 1 else f"{few(again)} {'is' if len(again) == 1 else 'are'}"
            notices.append(
                f"{who} in several levels of {printable(name)}, and each was taken for one person: give people of "
                "different groups different names."
            )


def note_groups(
    cells: pd.DataFrame, people: pd.Series[str], notices: list[str], by: Sequence[str], options: Sequence[str] = ()
) -> None:
    """Add a notice for each column whose groups of people are not analysed beside the columns `by`.

    These, its own name and further options compare them.
    """
    for name in filter(lambda name: MAYBE_GROUPS.fullmatch(heading(name)), map(str, cells)):
        levels = cells[name].str.strip()
        if levels.groupby(people).nunique().max() == 1 and 1 < levels.nunique() < people.nunique():
            shown = f"{printable(name)} ({few(sorted(levels.unique()))})"
            listed = ", ".join(f'"{printable(column)}"' for column in (*by, name))
            compared = " ".join([*options, f"by=[{listed}]"])
            notices.append(f"{shown} is not analysed: compare the groups with {compared}.")


def note_few_trials(table: pd.DataFrame, notices: list[str]) -> None:
    """Note the participants with at most half of the median number of trials.

    >>> notices = list[str]()
    >>> note_few_trials(pd.DataFrame({"participant_id": [*"AAAABBBBC"]}), notices)
    >>> notices
    ['C (1) has at most half of the median number of trials (4).']
    """
    counts = (table[~table["catch"]] if "catch" in table else table)["participant_id"].value_counts(sort=False)
    short = counts[counts <= counts.median() / 2]
    if len(short):
        listed = few(f"{who} ({count})" for who, count in short.items())
        notices.append(
            f"{listed} {'has' if len(short) == 1 else 'have'} at most half of the median number of trials "
            f"({counts.median():g})."
        )


def practice_in(name: str, cells: pd.Series[str]) -> set[str]:
    """Return the cells of a column that say that their rows are practice.

    >>> practice_in("block", pd.Series(["practice 1", "main"])), practice_in("practice", pd.Series(["no", "yes"]))
    ({'practice 1'}, {'yes'})
    """
    is_marked = PRACTICE.fullmatch(name.strip())
    return {
        cell
        for cell in cells.unique()
        if PRACTICE.fullmatch(cell.strip()) or (is_marked and TRUTH.get(cell.strip().casefold()))
    }


def few_levels(cells: pd.DataFrame, within: list[pd.Series[str]]) -> dict[str, str]:
    """Return the columns that may be conditions within people, each with its few levels in words.

    They have values in all rows, and several values `within` a person, or within the levels of further columns; they
    mark no rows of practice, nor rows to be left out.
    """
    return {
        name: few(sorted(cells[name].unique()))
        for name in map(str, cells)
        if name.strip()
        and cells[name].nunique() <= MAX_LEVELS
        and cells[name].groupby(within).nunique().max() > 1
        and not cells[name].str.strip().str.casefold().isin(ABSENT).any()
        and not (practice_in(name, cells[name]) or EXCLUDED.fullmatch(name.strip()))
    }


def in_steps(table: pd.DataFrame, role: str, order: Sequence[str], notes: list[str]) -> pd.DataFrame:
    """Replace the answers in words by the numbers of their steps, from 1 for the first word of `order`.

    Without an order, numbers among plain numbers lose their label: "5 (very)" is 5.

    Raises
    ------
    InputError
        If `order` has a word twice, or less than two, or an answer is not among them.
    """
    if not order:
        cells = list(map(str, table[role].unique()))
        labelled = {cell: found[1] for cell in cells if (found := LABELLED.fullmatch(cell)) and not is_date(cell)}
        if role not in ("rating", "confidence") or not labelled or all(as_number(cell) is None for cell in cells):
            return table
        notes.append(f"Numbers of {role}s were read without their labels: {few([*labelled])}.")
        return table.assign(**{role: table[role].replace(labelled)})
    steps = {clean(word).casefold(): str(step) for step, word in enumerate(order, start=1)}
    if len(steps) < max(2, len(order)) or "" in steps:
        raise InputError(f"order is {few([*order])}, but must name two steps or more, each once, from the least.")
    answers = table[role].map(lambda cell: clean(cell).casefold())
    wrong = ~answers.isin([*steps, *ABSENT])
    if wrong.any():
        missing = missing_as(str(table[role][wrong].iloc[0]))
        expected = f"which is not among the steps in order ({few([*order])}): name all steps, from the least; {missing}"
        raise invalid(table, role, wrong, expected)
    notes.append(f"Steps of {role}s: {few([f'{word} = {step}' for step, word in enumerate(order, start=1)])}.")
    return table.assign(**{role: answers.map(steps).fillna("")})


def check_seconds(table: pd.DataFrame, role: str, longest: float, shortest: float = 0.0) -> None:
    """Raise `InputError` if the median of times, in seconds, is above `longest` or below `shortest`: another unit."""
    middle = float(table[role].median()) if role in table else math.nan
    if 0 <= middle < shortest:
        raise InputError(
            f"the median of {role} is {middle:g} s, but nobody answers in less than {shortest:g} s: correct the unit "
            "in the heading, or thousands separators that were taken for decimal points."
        )
    if middle > longest:
        raise InputError(
            f"the median of {role} is {middle:g}, but must be a time in seconds: give seconds, or call the column "
            f"{role}_ms where these are milliseconds."
        )


def without_copies(table: pd.DataFrame, shown: Sequence[str], notices: list[str], notes: list[str]) -> pd.DataFrame:
    """Remove blocks of rows that repeat a block of the same subject, or all answers of another subject.

    The few people whose rows are in several places are noted, as they may be two of one name.

    `shown` are the columns of the conditions, such as scene, aperture and fixation.
    """
    conditions = [name for name in ("session", *shown, "catch") if name in table]
    about = [name for name in (*conditions, "rating", "response_time") if name in table]
    table = without_pasted(table, table[about], shown, ["rating"], notices)
    people, files = table["participant_id"], table.index.get_level_values(0).to_series(index=table.index)
    counts = ((people != people.shift()) | (files != files.shift())).groupby(people, sort=False).sum()
    several = [str(name) for name in counts.index[counts > 1]]
    if 0 < len(several) < len(counts) / 2 and "session" not in table:
        notices.append(f"Rows in several places of the table count as of one person: {few(several)}.")
    trials = people.value_counts()
    usual = int(trials.mode().iloc[0]) if len(trials) else 0
    more = trials[(trials > usual) & (trials % max(usual, 1) == 0)]
    if usual >= MIN_BLOCK_ROWS and len(more) == 1 and (trials == usual).sum() == len(trials) - 1 > 1:
        notices.append(
            f"{few([str(more.index[0])])} has {more.iloc[0]} trials, each other participant {usual}: give people of "
            "one name different names."
        )
    return _without_other_names(table, shown, conditions, notices, notes)


def without_copied_files(cells: pd.DataFrame, notices: list[str], *, named: bool) -> pd.DataFrame:
    """Remove the files whose rows equal those of another in all cells, as programs write copies of their own.

    Files that do not name participants (`named`), and small ones, are copies only by their names, like "p01 (1).csv".
    """
    if cells.index.get_level_values(0).nunique() < 2:
        return cells
    hashes, alike = pd.util.hash_pandas_object(cells, index=False).to_numpy(), dict[bytes, list[str]]()
    for file, rows in cells.groupby(level=0, sort=False).indices.items():
        if len(rows) >= MIN_BLOCK_ROWS:
            alike.setdefault(hashes[rows].tobytes(), []).append(str(file))
    copies = []
    for key, files in alike.items():
        first, *others = sorted(files, key=lambda file: (len(file), file))
        stem, is_long = first.rpartition(".")[0], len(key) >= MIN_FILE_ROWS * hashes.itemsize
        copies += [file for file in others if (named and is_long) or re.match(re.escape(stem) + r"[\W_]", file)]
    if not copies:
        return cells
    notices.append(f"Copies of files, whose rows all equal those of another, were dropped: {few(sorted(copies))}.")
    kept = cells[~cells.index.get_level_values(0).isin(copies)].copy()
    kept.attrs = cells.attrs
    return kept


def without_pasted(
    table: pd.DataFrame, same: pd.DataFrame, shown: Sequence[str], answers: Sequence[str], notices: list[str]
) -> pd.DataFrame:
    """Remove the second of two blocks of rows of one subject that have the `same` cells, if chance cannot explain it.

    `shown` are the columns of the conditions, `answers` those of the answers.
    """
    groups = table.groupby([name for name in ("participant_id", "session") if name in table], sort=False).indices
    cells = pd.DataFrame({name: pd.factorize(same[name])[0] for name in same}).to_numpy()
    left_out = np.zeros(len(table), bool)
    sizes = [len(rows) for rows in groups.values()]
    for key, rows in groups.items():
        half = len(rows) // 2
        if len(rows) % 2 or half < MIN_BLOCK_ROWS or not (cells[rows[:half]] == cells[rows[half:]]).all():
            continue
        if sizes.count(half) * 2 > len(sizes) or _by_chance(table.iloc[rows[:half]], shown, answers) < MAX_CHANCE:
            left_out[rows[half:]] = True
            who = ", session ".join(str(label) for label in np.atleast_1d(np.array(key, dtype=object)) if label)
            copy = rows_named(table, pd.Series(np.isin(np.arange(len(table)), rows[half:])))
            notices.append(f"Participant {who} appears twice with identical answers; {copy} were dropped.")
    return table[~left_out]


def _by_chance(rows: pd.DataFrame, shown: Sequence[str], given: Sequence[str]) -> float:
    """Return the probability that another subject with the same percepts has the `given` answers in all rows.

    It is estimated from the variability of the subject's answers to the same picture, or without repetitions to the
    same condition. Subjects with little variability who round their answers may well coincide.
    """
    for about in ([*shown], [name for name in shown if name != "scene"]):
        same = pairs = 0.0
        for _, answers in rows.groupby(about)[[*given]]:
            counts = answers.value_counts().to_numpy(float)
            same += float((counts * (counts - 1)).sum())
            pairs += float(counts.sum() * (counts.sum() - 1))
        if pairs >= 2 * MIN_BLOCK_ROWS:
            return (same / pairs) ** len(rows)
    return 1.0


def _without_other_names(
    table: pd.DataFrame, shown: Sequence[str], conditions: list[str], notices: list[str], notes: list[str]
) -> pd.DataFrame:
    """Remove subjects whose answers all equal those of another, if other pairs of subjects agree much less."""
    ordered = table.sort_values(conditions, kind="stable")
    codes = pd.DataFrame({name: pd.factorize(ordered[name])[0] for name in conditions}).to_numpy()
    given = ordered[[name for name in ("rating", "response_time") if name in ordered]].fillna(-1.0).to_numpy(float)
    alike: dict[bytes, dict[str, np.ndarray]] = {}
    for who, rows in ordered.groupby("participant_id", sort=False).indices.items():
        if len(rows) >= MIN_BLOCK_ROWS:
            alike.setdefault(codes[rows].tobytes(), {})[str(who)] = given[rows].ravel()
    for answers in alike.values():
        names, values = list(answers), np.array(list(answers.values()))
        _, first, group = np.unique(values, axis=0, return_index=True, return_inverse=True)
        for number in range(len(first)):
            same = np.flatnonzero(group.ravel() == number)
            if len(same) < 2:
                continue
            others = np.delete(values, same, axis=0)
            agree = (others == values[same[0]]).mean(axis=1)
            whose = [names[place] for place in same]
            copied = table["participant_id"].isin(whose[1:])
            rows = table[table["participant_id"] == whose[0]]
            pairs = len(values) * (len(values) - 1) / 2
            if (
                len(others)
                and agree.max() < MAX_SHARED_ANSWERS
                and pairs * _by_chance(rows, shown, ["rating"]) < MAX_CHANCE
            ):
                notices.append(
                    f"{', '.join(whose)} have the same answer in every row: {rows_named(table, copied)} were left out "
                    f"as copies of {whose[0]}."
                )
                table = table[~copied]
            else:
                notes.append(
                    f"{', '.join(whose)} have the same answer in every row, as coarse answers may: check that nobody "
                    "appears twice."
                )
    return table
