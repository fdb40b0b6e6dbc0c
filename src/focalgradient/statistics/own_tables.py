"""Parsing of the user's own tables: column lookup, conversion of cells, and location of invalid cells for messages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import name_and_unit
from focalgradient.files.tables import TextTable
from focalgradient.statistics.own_files import SUBJECT, Paths, file_labels, person_of, read_table
from focalgradient.statistics.own_names import ABSENT, clean, few, place, united
from focalgradient.statistics.own_numbers import numbers
from focalgradient.statistics.own_rows import without_headers, without_summaries

__all__ = [
    "NO",
    "PARTICIPANT",
    "Source",
    "Where",
    "answered",
    "catch_trials",
    "columns_like",
    "completed",
    "conditions_like",
    "folded",
    "found_columns",
    "of_one_data_set",
    "renamed",
    "rows_of",
    "truths",
    "unused",
    "where_like",
]

TRUTH = {
    **dict.fromkeys(["1", "1.0", "true", "t", "yes", "y", "ja", "oui", "wahr", "vrai"], True),
    **dict.fromkeys(["0", "0.0", "false", "f", "no", "n", "nein", "non", "falsch", "faux"], False),
}
"""Recognised words for yes and no."""

NO = {"": False, "n/a": False}
"""Cells of optional columns that say no."""

PARTICIPANT = (
    *("participant", "subject", "subj", "id", "observer", "subject_id", "subject id", "participant id"),
    *("participant private id", "participant public id", "prolific_pid", "workerid", "run_id"),
    *("responseid", "response id", "result", "participant_code", "participant_number", "subject_number", "ppt"),
    *("versuchsperson", "vp", "vpn", "proband", "sujet"),
)
"""Recognised names of the participant column."""


PRACTICE = re.compile(
    r"(?:practi[cs]e|training(?=_?trial)|warm-?up|demo|[üu]bung)(?:\b|_|trial)[\w.\- ]*", re.IGNORECASE
)
"""Names of loops and of blocks of practice."""

EXCLUDED = re.compile(
    r"(?:is_?)?(?:exclu\w*|outliers?|reject\w*|(?:in)?valid|bad|keep|includ\w*)(?:_\w+)?", re.IGNORECASE
)
"""Names of columns that mark rows to be left out or kept."""


LISTED = 12
"""Maximum number of columns listed in an error message."""


Where = Mapping[str, str | Sequence[str]]
"""Value or values by column: the rows that are analysed."""


def columns_like(*roles: str) -> str:
    """Return the remedy that names the column of each role, in terms of `read_ratings` and `read_reports`."""
    entries = ", ".join(f'"{role}": "NAME"' for role in roles)
    return f"name {'it' if len(roles) == 1 else 'them'} with columns={{{entries}}}"


def where_like(column: str, value: str) -> str:
    """Return the remedy that chooses the rows of a value."""
    return f'where={{"{printable(column)}": "{printable(value)}"}}'


def conditions_like(meaning: str) -> str:
    """Return the remedy that gives the meaning of a word."""
    return f'give its meaning with conditions={{"NAME": "{meaning}"}}'


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Table of the user, with the column of each role and what was said about it.

    Parameters
    ----------
    name
        Name of the file or files, for messages.
    cells
        All cells as text; the index is (file, row).
    columns
        Name in the file of each role's column.
    given
        Roles whose column the caller named.
    notes, notices, problems
        Sentences on how the table was read: see `focalgradient.statistics.OwnRatings`.
    """

    name: str
    cells: pd.DataFrame
    columns: dict[str, str]
    given: frozenset[str] = frozenset()
    notes: list[str] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    @classmethod
    def read(
        cls,
        paths: Paths,
        roles: Mapping[str, tuple[str, ...]],
        columns: Mapping[str, str] | None,
        where: Where | None = None,
    ) -> Source:
        """Read a table, or the tables of one data set, and find the column of each role."""
        table = read_table(paths)
        notes = [*table.notes]
        cells = chosen_rows(table.name, table.cells, where or {}, notes)
        columns = columns or {}
        given = frozenset("participant_id" if role == "participant" else role for role in columns)
        own = cls(table.name, cells, found_columns(table.name, cells, roles, columns), given, notes)
        for role, column in own.columns.items():
            lacks = f"{table.lacking.get(column, '')} has no column {printable(column)}, which other files have"
            if column in table.lacking and role not in ("response_time", "dropped_frames"):
                raise InputError(f"{lacks}: give all files the same columns, in the same units.")
            if column in table.lacking:
                own.notices.append(f"{lacks}.")
        if "participant_id" not in own.columns and (len(table.paths) > 1 or SUBJECT.match(table.paths[0].name)):
            people = [person_of(str(file)) for file in cells.index.get_level_values(0)]
            own = replace(own, cells=cells.assign(**{"participant (file)": people}))
            own.columns["participant_id"] = "participant (file)"
            own.notices.append("No participant column: each file is treated as one participant.")
        return own.without_practice()

    def without_practice(self) -> Source:
        """Leave out the rows of PsychoPy's loops of practice; note columns that name rows of practice."""
        practice = pd.Series(False, index=self.cells.index)
        for name in map(str, self.cells):
            cells = self.cells[name]
            named = {cell for cell in cells.unique() if PRACTICE.fullmatch(cell.strip())}
            if name.casefold().endswith(".thisn") and PRACTICE.match(name):
                practice |= ~cells.str.strip().str.casefold().isin(ABSENT)
            elif named and name not in self.columns.values():
                others = [cell for cell in cells.unique() if cell.strip() and cell not in named]
                remedy = f": leave them out with {where_like(name, others[0])}" if others else ""
                count = int(cells.isin(named).sum())
                self.notices.append(f"{printable(name)} says that {count:,} rows are practice{remedy}.")
            elif EXCLUDED.fullmatch(name.strip()) and name not in self.columns.values() and cells.nunique() > 1:
                remedy = f"choose rows with {where_like(name, str(cells.mode()[0]))}"
                self.notices.append(f"{printable(name)} ({few([*cells])}) was not used: {remedy} where it marks rows.")
        if not practice.any() or practice.all():
            return self
        self.notices.append(f"{rows_of(practice)} left out, of a loop of practice.")
        return replace(self, cells=self.cells[~practice].copy())

    def require(self, *roles: str, otherwise: str = "") -> None:
        """Raise `InputError` that names all of `roles` without a column; `otherwise` adds another remedy."""
        missing = ["participant" if role == "participant_id" else role for role in roles if role not in self.columns]
        if missing:
            there = ", ".join([str(name)[:40] for name in self.cells if name][:LISTED])
            noun = "column" if len(missing) == 1 else "columns"
            raise InputError(
                f"{self.name} has no {noun} for {', '.join(missing)} (its columns are {there}): "
                f"{columns_like(*missing)}{otherwise}."
            )

    def rows(self, numeric: Sequence[str], shown: Sequence[str]) -> pd.DataFrame:
        """Return the columns in use, named by role and cleaned.

        Parameters
        ----------
        numeric
            Roles of numbers, whose decimal mark is decided together.
        shown
            Roles that say what was shown; rows without any of them are not trials, and are skipped.
        """
        self.notes.extend(unused([str(name) for name in self.cells if name not in self.columns.values()]))
        return self.cleaned(renamed(self.cells, self.columns), numeric, shown)

    def cleaned(self, table: pd.DataFrame, numeric: Sequence[str], shown: Sequence[str]) -> pd.DataFrame:
        """Return the rows of trials with decimal points, clean cells and merged spellings."""
        table = with_points(table, [role for role in numeric if role in table], self.cells.attrs["delimiter"])
        table = self._shown(table, [role for role in shown if role in table])
        return with_participants(table, self.columns, self.notes, self.notices)

    def _shown(self, table: pd.DataFrame, shown: Sequence[str]) -> pd.DataFrame:
        """Leave out rows in which nothing was shown, such as surveys and fixation crosses."""
        if not shown or table.empty:
            return table
        empty = pd.concat([table[role].str.strip().str.casefold().isin(ABSENT - {"none"}) for role in shown], axis=1)
        nothing = empty.all(axis=1)
        if nothing.all():
            raise InputError(
                f"{self.name} has no row with {' or '.join(shown)}: give the columns' names (columns), or other rows."
            )
        if nothing.any():
            self.notes.append(
                f"{rows_of(nothing)} left out, which show nothing ({', '.join(shown)} empty)"
                f"{self.apart(table.index, nothing, '; the others can be chosen with {}')}."
            )
        return table[~nothing]

    def apart(self, index: pd.Index[int], wrong: pd.Series[bool], text: str) -> str:
        """Return `text` with the columns and values that tell wrong rows from the others; "" if none do."""
        if index.nlevels != 2 or wrong.all():
            return ""
        cells = self.cells.loc[index]
        wrong_rows = wrong.to_numpy(bool)
        for name in cells:
            values = cells[name]
            others = set(values[~wrong_rows])
            if name not in self.columns.values() and len(others) == 1 and others.isdisjoint(values[wrong_rows]):
                (value,) = others
                if value.strip():
                    return text.format(where_like(str(name), value))
        return ""

    def numbers(self, table: pd.DataFrame, role: str, *, empty: bool = False) -> pd.Series[float]:
        """Parse the numbers of a role, in the unit of its heading; see `numbers`."""
        return numbers(table, role, table[role], empty=empty, own=self)

    def optional(self, table: pd.DataFrame, role: str) -> pd.DataFrame:
        """Parse the numbers of a role that nobody named; leave the column out, with a notice, if they are none."""
        if role not in table:
            return table
        try:
            return table.assign(**{role: self.numbers(table, role, empty=True)})
        except InputError as error:
            if role in self.given:
                raise
            self.notices.append(f"The column {self.columns.get(role, role)} was not used: {error}")
            return table.drop(columns=role)


def of_one_data_set(paths: Sequence[Paths], participant: str | None = None) -> bool:
    """Return whether tables are the parts of one data set: files of one participant each.

    Parameters
    ----------
    paths
        The files, or what was read of each.
    participant
        Column of the participants, if it was named.

    Raises
    ------
    InputError
        If several files hold one participant each, all of the same name.
    """
    people: list[set[str]] = []
    tables = [read_table(path) for path in paths]
    for label, table in zip(file_labels([part.paths[0] for part in tables]), tables, strict=True):
        columns = {} if participant is None else {"participant": participant}
        theirs = found_columns(table.name, table.cells, {"participant_id": PARTICIPANT}, columns).get("participant_id")
        people.append({clean(cell) for cell in table.cells[theirs]} - {""} if theirs else {person_of(label)})
    if len(people) > 1 and all(len(names) == 1 for names in people) and len(set.union(*people)) == 1:
        raise InputError(
            f"all {len(people)} files are of the participant {people[0].pop()}: give people names of their own, or "
            "sessions of one person in one table with a column session."
        )
    return any(len(names) <= 1 for names in people)


def chosen_rows(name: str, cells: pd.DataFrame, where: Where, notes: list[str]) -> pd.DataFrame:
    """Return the rows whose columns have one of the values of `where`."""
    by_name = {clean(str(column)).casefold(): column for column in cells}
    for column, given in where.items():
        values = [given] if isinstance(given, str) else [*given]
        theirs = by_name.get(clean(column).casefold())
        if theirs is None:
            raise InputError(f"where: {name} has no column {column}: it has {few([*map(str, cells)])}.")
        wanted = {clean(value).casefold() for value in values}
        kept = cells[theirs].map(lambda cell, wanted=wanted: clean(cell).casefold() in wanted).astype(bool)
        if not kept.any():
            raise InputError(
                f"where: {name} has no row whose {column} is {' or '.join(values)}: it has {few([*cells[theirs]])}."
            )
        notes.append(f"Of {len(cells):,} rows {kept.sum():,} were chosen, whose {theirs} is {' or '.join(values)}.")
        cells = cells[kept].copy()
    return cells


def with_points(table: pd.DataFrame, roles: Sequence[str], delimiters: Mapping[str, str]) -> pd.DataFrame:
    """Return the table with decimal points in the columns of numbers; the mark is decided for all of a file."""
    if not roles or table.empty:
        return table
    files, places = (table.index.get_level_values(level) for level in (0, 1))
    texts = table[[*roles]].to_numpy(object, copy=True)
    changed = False
    for file, rows in table.groupby(files, sort=False).indices.items():
        cells = tuple(tuple(map(clean, row)) for row in texts[rows])
        whole = TextTable(str(file), tuple(roles), cells, tuple(places[rows]), delimiters[str(file)])
        if (pointed := whole.with_points()) is not whole:
            texts[rows], changed = pointed.rows, True
    return table.assign(**dict(zip(roles, texts.T, strict=True))) if changed else table


def found_columns(
    name: str, table: pd.DataFrame, roles: Mapping[str, tuple[str, ...]], columns: Mapping[str, str]
) -> dict[str, str]:
    """Return the file's column for each role: the one given in `columns`, else one with a recognised name."""
    header = [str(column) for column in table.columns]
    by_name = {clean(column).casefold(): column for column in reversed(header)} | {column: column for column in header}
    found: dict[str, str] = {}
    wrong = []
    for given, column in columns.items():
        role = "participant_id" if given == "participant" else given
        theirs = by_name.get(column, by_name.get(clean(column).casefold()))
        if role not in roles:
            wrong.append(f"{given} is not known: use {', '.join(['participant', *list(roles)[1:]])} = the file's name")
        elif theirs is None:
            wrong.append(f"{name} has no column {column} for {given}: it has {few(header)}")
        elif theirs in found.values():
            wrong.append(f"{column} is given for {given}, but for another column, too: give each a column of its own")
        else:
            found[role] = theirs
    if wrong:
        raise InputError(f"columns: {'; '.join(wrong)}.")
    free = [column for column in reversed(header) if column not in found.values()]
    lower = {name_and_unit(clean(column))[0]: column for column in free}
    lower |= {clean(column).casefold(): column for column in free}
    for role, others in roles.items():
        if role not in found:
            near = next((lower[one] for one in (role, *others) if one in lower), None)
            if near is not None and near not in found.values():
                found[role] = near
    for column in found.values():
        again = [one for one in header if re.fullmatch(re.escape(column) + r" \(column \d+\)", one)]
        if column not in columns.values():
            again += [one for one in header if one != column and clean(one).casefold() == clean(column).casefold()]
        if any((table[one] != table[column]).any() for one in again):
            raise InputError(f"{name} has the column {column} twice, with different cells: remove or rename one.")
    return found


NAMED = {"participant_id": "participant", "session": "session", "scene": "scene"}
"""Roles whose spellings are merged, with the noun used in messages."""


def with_participants(
    table: pd.DataFrame, theirs: Mapping[str, str], notes: list[str], notices: list[str]
) -> pd.DataFrame:
    """Return the rows with cleaned cells and merged spellings; a missing name is an error."""
    table = without_summaries(without_headers(table, theirs, notices), notices)
    if any(table["participant_id"] != table["participant_id"].str.strip()):
        notes.append("Spaces at the ends of participants’ names were removed.")
    for role in table:
        if role in NAMED:
            table = united(table, str(role), NAMED[str(role)], notices)
        else:
            table[role] = table[role].map({cell: clean(cell) for cell in table[role].unique()})
    unnamed = table["participant_id"].str.lower().isin(ABSENT)
    if unnamed.any():
        raise InputError(f"{place(table, unnamed)}: the participant is missing: name it.")
    if (wrong := table["participant_id"].str.fullmatch(r"\d(?:[.,]\d+)?[eE]\+?\d+")).any():
        name = table["participant_id"][wrong].iloc[0]
        raise InputError(
            f"{place(table, wrong)}: the participant is {name}, to which a spreadsheet program may have shortened "
            "different names: enter them again as text."
        )
    return table


def renamed(table: pd.DataFrame, theirs: Mapping[str, str]) -> pd.DataFrame:
    """Return the columns in use, named by role."""
    return pd.DataFrame({role: table[name] for role, name in theirs.items()}, index=table.index)


def answered(own: Source, table: pd.DataFrame, role: str, record: str, absent: frozenset[str] = ABSENT) -> pd.DataFrame:
    """Return the rows with a value in the column `role`; a notice counts the others."""
    missing = table[role].str.strip().str.lower().isin(absent)
    if missing.all():
        raise InputError(f"{own.name} holds no {record}: the column given for {role}s is empty.")
    if not missing.any():
        return table
    who = few(sorted(set(table["participant_id"][missing])))
    own.notices.append(f"{rows_of(missing)} left out, without a {role} (participants {who}).")
    return table[~missing].copy()


def catch_trials(table: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Add the boolean column `catch`; without such a column no trial is a catch trial, which is noted."""
    if "catch" in table:
        return table.assign(catch=truths(table, "catch", NO))
    notes.append("No catch-trial column: no trial is treated as one.")
    return table.assign(catch=False)


def rows_of(left_out: pd.Series[bool]) -> str:
    """Format a number of rows for a note: "1 row was", "3 rows were"."""
    count = int(left_out.sum())
    return "1 row was" if count == 1 else f"{count:,} rows were"


def unused(names: list[str]) -> list[str]:
    """Return a note that lists unused columns, if any."""
    named = [printable(name) for name in names if name]
    return [f"Columns that were not used: {few(named)}."] if named else []


def truths(
    table: pd.DataFrame,
    role: str,
    words: Mapping[str, bool],
    meanings: Mapping[str, str] | None = None,
    expected: str = "0 or 1",
) -> pd.Series[bool]:
    """Convert cells that say yes or no to booleans.

    Parameters
    ----------
    table, role
        Table, and the column.
    words
        Recognised words besides those of `TRUTH`.
    meanings
        Meanings of the caller's words: see `folded`.
    expected
        What cells must be, for the message.
    """
    known = {**TRUTH, **words}
    cells = table[role].str.strip().str.casefold().map(lambda cell: (meanings or {}).get(cell, cell))
    wrong = ~cells.isin(list(known))
    if wrong.any():
        raise InputError(
            f"{place(table, wrong)}: {role} is {printable(table[role][wrong].iloc[0])!r}, but must be {expected}."
        )
    return cells.map(known).astype(bool)


def folded(conditions: Mapping[str, str] | None) -> dict[str, str]:
    """Return the meanings of the caller's words, all in lower case."""
    return {clean(word).casefold(): clean(meaning).casefold() for word, meaning in (conditions or {}).items()}


def completed(table: pd.DataFrame, *roles: str) -> pd.DataFrame:
    """Return the table with columns session, condition and kind where they are among `roles`; people by default."""
    plain = {"session": "", "condition": "", "kind": "human"}
    return table.assign(**{role: table[role].str.strip() if role in table else plain[role] for role in roles})
