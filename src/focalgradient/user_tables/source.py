"""Reading of a table by the schema of its kind: columns, rows of trials, and the values of their cells."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number, is_date, is_in_words, name_and_unit
from focalgradient.user_tables.cleaning import (
    EXCLUDED,
    PRACTICE,
    TRUTH,
    in_steps,
    note_shared_names,
    practice_in,
    without_codes,
    without_copied_files,
    without_headers,
    without_pasted,
    without_summaries,
)
from focalgradient.user_tables.files import (
    SUBJECT,
    Paths,
    Where,
    chosen_rows,
    file_labels,
    person_of,
    read_table,
    states_simulated,
    with_points,
)
from focalgradient.user_tables.names import (
    clean,
    few,
    heading,
    in_several,
    invalid,
    missing_as,
    place,
    united,
    with_article,
)
from focalgradient.user_tables.numbers import check_magnitudes, factor_of, others
from focalgradient.user_tables.schema import ABSENT, GIVEN_AS, RATINGS, TIMES, Schema, found_columns

__all__ = [
    "Source",
    "Where",
    "columns_like",
    "completed",
    "conditions_like",
    "folded",
    "holds",
    "where_like",
]

KINDS: Mapping[bool | None, str] = {True: "simulated", False: "human"}
"""Kinds of participants, by whether a column says that they are simulated."""

ANSWERS = ("rating", "correct", "response")
"""Roles of answers, by which rows must not be chosen."""

NAMED = {"participant_id": "participant", "session": "session", "scene": "scene"}
"""Roles whose spellings are merged, with the noun used in messages."""

PICTURED = ("aperture", "aperture_mm", "fixation")
"""Roles of the conditions that differ between pictures."""

DEFAULTS = {"session": "", "condition": "", "kind": "human"}
"""Values of optional columns of a table without them."""

SIMULATED = "simulated (sidecar)"
"""Column of whether a file's sidecar says that its observers were simulated."""

LISTED = 24
"""Maximum number of columns listed in an error message."""


def columns_like(*roles: str) -> str:
    """Return the remedy that names the column of each role, in terms of `read_ratings` and `read_reports`."""
    entries = ", ".join(f'"{role}": "NAME"' for role in roles)
    return f"name {'it' if len(roles) == 1 else 'them'} with columns={{{entries}}}"


def where_like(column: str, value: str) -> str:
    """Return the remedy that chooses the rows of a value."""
    return f'where={{"{printable(column)}": "{printable(value)}"}}'


def choice_like(cells: pd.DataFrame, column: str, value: str) -> str:
    """Return the remedy that chooses the rows of a value; in a table that was wide, the columns."""
    of_value, is_wide = cells[column] == value, cells.index.nlevels > 2
    headings, others = ([*cells.index[rows].get_level_values(-1)] for rows in (of_value, ~of_value))
    if not is_wide or {*headings} == {*others}:  # the same columns hold all values
        return where_like(column, value)
    return f'columns={{"rating": "{printable(os.path.commonprefix(headings))}*"}}'  # noqa: RUF071  by character


def conditions_like(meaning: str) -> str:
    """Return the remedy that gives the meaning of a word."""
    return f'give its meaning with conditions={{"NAME": "{meaning}"}}'


def folded(conditions: Mapping[str, str] | None) -> dict[str, str]:
    """Return the meanings of the caller's words, all in lower case."""
    return {clean(word).casefold(): clean(meaning).casefold() for word, meaning in (conditions or {}).items()}


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """Table of the user, with the column of each role and notes on it.

    Parameters
    ----------
    name
        Name of the file or files, for messages.
    cells
        All cells as text; the index is (file, row).
    schema
        Definition of its kind.
    columns
        Name in the file of each role's column.
    given
        Roles whose column the caller named.
    meanings
        Meanings of the caller's words: see `folded`.
    notes, notices, problems
        Sentences on how the table was read: see `focalgradient.statistics.OwnRatings`.
    """

    name: str
    cells: pd.DataFrame
    schema: Schema
    columns: dict[str, str]
    given: frozenset[str] = frozenset()
    meanings: Mapping[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    @classmethod
    def read(
        cls,
        paths: Paths,
        schema: Schema,
        columns: Mapping[str, str] | None,
        where: Where | None = None,
        conditions: Mapping[str, str] | None = None,
    ) -> Source:
        """Read a table, or the tables of one data set, and find the column of each role."""
        table = read_table(paths)
        if table.cells.empty:
            raise InputError(f"{table.name} has no rows below its header: give a row for each trial.")
        columns = columns or {}
        table = chosen_rows(table, where, columns.values())
        cells, notes = table.cells, [*table.notes]
        given = frozenset({*columns, *(GIVEN_AS.get(name, name) for name in columns)})
        found, notices = found_columns(table.name, cells, schema, columns), list[str]()
        cells = without_copied_files(cells, notices, named="participant_id" in found)
        source = cls(table.name, cells, schema, found, given, folded(conditions), notes, notices)
        for role, column in source.columns.items():
            if role in ANSWERS and column in table.chosen:
                source.notices.append(
                    f"Rows were chosen by {printable(column)}, the answers themselves: this alone can make conditions "
                    "differ, or hide that they do."
                )
            lacks = f"{table.lacking.get(column, '')} has no column {printable(column)}, which other files have"
            if column in table.lacking and role not in ("response_time", "dropped_frames"):
                raise InputError(f"{lacks}: give all files the same columns, in the same units.")
            if column in table.lacking:
                source.notices.append(f"{lacks}.")
        if "participant_id" not in source.columns and (len(table.paths) > 1 or SUBJECT.match(table.paths[0].name)):
            files = cells.index.get_level_values(0)
            people = [person_of(str(file)) for file in files]
            source = replace(source, cells=cells.assign(**{"participant (file)": people}))
            source.columns["participant_id"] = "participant (file)"
            is_shared = len({*people}) < files.nunique()
            named = f"the files are of the participants {few(people)}, by their names"
            source.notices.append(
                f"No participant column: {named if is_shared else 'each file is treated as one participant'}."
            )
        made = [
            label for label, path in zip(file_labels(table.paths), table.paths, strict=True) if states_simulated(path)
        ]
        if made and "kind" not in source.columns:
            of_models = source.cells.index.get_level_values(0).isin(made)
            source = replace(source, cells=source.cells.assign(**{SIMULATED: of_models.astype(int).astype(str)}))
            source.columns["kind"] = SIMULATED
        return source._without_practice()

    def _without_practice(self) -> Source:
        """Leave out the rows of PsychoPy's loops of practice; note columns that name rows of practice."""
        practice = pd.Series(False, index=self.cells.index)
        for name in map(str, self.cells):
            cells, is_used = self.cells[name], name in self.columns.values()
            named = practice_in(name, cells)
            if name.casefold().endswith(".thisn") and PRACTICE.match(name):
                practice |= ~cells.str.strip().str.casefold().isin(ABSENT)
            elif named and not is_used:
                rest = [cell for cell in cells.unique() if cell.strip() and cell not in named]
                remedy = f": leave them out with {where_like(name, rest[0])}" if rest else ""
                count = int(cells.isin(named).sum())
                self.notices.append(f"{printable(name)} says that {count:,} rows are practice{remedy}.")
            elif EXCLUDED.fullmatch(name.strip()) and not is_used and cells.nunique() > 1:
                remedy = f"choose rows with {where_like(name, str(cells.mode()[0]))}"
                self.notices.append(f"{printable(name)} ({few([*cells])}) was not used: {remedy} where it marks rows.")
        if not practice.any() or practice.all():
            return self
        self.notices.append(f"{_rows_were(practice)} left out, of a loop of practice.")
        return replace(self, cells=self.cells[~practice].copy())

    def without_pictures(self, conditions: Sequence[str] = ()) -> Source:
        """Leave out a column taken for the scene that names one picture a condition, as jsPsych's column `stimulus`.

        `conditions` are the columns of the conditions, by default those of apertures and fixation; a condition that
        varies for one picture, as that of groups, is none of the picture's. A column that the caller named, or that is
        named "scene", stays.
        """
        name = self.columns.get("scene", "scene")
        conditions = conditions or [self.columns[role] for role in PICTURED if role in self.columns]
        if "scene" in self.given or heading(name) == "scene" or not conditions:
            return self
        cells = self.cells[[name, *conditions]]
        cells = cells[~cells.apply(lambda column: _is_empty(column, ABSENT)).any(axis=1)]
        of_pictures = [column for column in conditions if (cells.groupby(name)[column].nunique() == 1).all()]
        pictures = cells[name].nunique()
        if pictures < 2 or not of_pictures or pictures != len(cells[of_pictures].drop_duplicates()):
            return self
        self.notices.append(
            f"{printable(name)} names one picture for each condition, and was not used as the scene: name it with "
            f'columns={{"scene": "{printable(name)}"}} where scenes differ.'
        )
        return replace(self, columns={role: column for role, column in self.columns.items() if role != "scene"})

    @property
    def unused(self) -> list[str]:
        """Columns without a role."""
        return [str(name) for name in self.cells if name not in self.columns.values()]

    @property
    def spoken(self) -> str:
        """Names of all columns, and cells of answers and catch trials, which may hold words of the caller."""
        shown = [self.columns[role] for role in ("rating", "catch") if role in self.columns]
        return " ".join([*map(str, self.cells), *(str(cell) for name in shown for cell in self.cells[name].unique())])

    def note_unused(self, names: Sequence[str]) -> None:
        """Note columns that are not used."""
        if named := [printable(name) for name in names if name]:
            self.notes.append(f"Columns that were not used: {few(named)}.")

    def missing(self, *roles: str, also: Sequence[str] = ()) -> list[str]:
        """Return the required roles without a column, as the caller names them; parameters as of `require`."""
        here = {*self.columns, *also}
        lacking = [role for role in roles or self.schema.required if role not in here]
        instead = {role: self.schema.instead[role][0] for role in lacking if role in self.schema.instead}
        return [
            "participant" if role == "participant_id" else role
            for role in lacking
            if role not in instead or not instead[role] <= here
        ]

    def require(self, *roles: str, also: Sequence[str] = (), otherwise: str = "") -> None:
        """Raise `InputError` that names the required roles (`roles`; by default those of the schema) without a column.

        Roles in `also` need no column; `otherwise` adds a remedy to that of the schema.
        """
        here, missing = {*self.columns, *also}, self.missing(*roles, also=also)
        for role in missing:
            roles_instead, remedy = self.schema.instead.get(role, (frozenset(), ""))
            theirs = [name for name in self.schema.columns if name in roles_instead and name not in here]
            otherwise = remedy.format(columns_like(*theirs)) or otherwise
        if missing:
            names = [str(name)[:40] for name in self.cells if name]
            more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
            there = ", ".join(names[:LISTED]) + more
            noun = "column" if len(missing) == 1 else "columns"
            raise InputError(
                f"{self.name} has no {noun} for {', '.join(missing)} (its columns are {there}): "
                f"{columns_like(*missing)}{otherwise}."
            )

    def renamed(self) -> pd.DataFrame:
        """Return the columns in use, named by role."""
        table = pd.DataFrame({role: self.cells[name] for role, name in self.columns.items()}, index=self.cells.index)
        if "kind" in table:
            table["kind"] = table["kind"].map(lambda cell: KINDS.get(TRUTH.get(cell.strip().casefold()), cell))
        return table

    def rows(self) -> pd.DataFrame:
        """Return the columns in use, named by role and cleaned, without rows that show nothing."""
        self.note_unused(self.unused)
        return self.cleaned(self.renamed(), [role for role, column in self.schema.columns.items() if column.shown])

    def without_pasted(self, table: pd.DataFrame, shown: Sequence[str], answers: Sequence[str]) -> pd.DataFrame:
        """Return the rows of trials without blocks that repeat one of the same subject in all cells of the file."""
        cells, of_times = self.cells.loc[table.index], {"response_time", *RATINGS.columns["response_time"].names}
        times = [name for name in self.unused if heading(name_and_unit(name)[0]) in of_times]
        conditions, given = ([role for role in roles if role in table] for roles in (shown, answers))
        kept = without_pasted(table.join(cells[times]), cells, conditions, [*given, *times], self.notices)
        return table.loc[kept.index]

    def cleaned(self, table: pd.DataFrame, shown: Sequence[str] = ()) -> pd.DataFrame:
        """Return the rows of trials with decimal points, clean cells and merged spellings.

        Rows without a cell in any column `shown`, such as surveys and fixation crosses, are left out.
        """
        for role, column in self.schema.columns.items():
            absent = {word for word, meaning in self.meanings.items() if meaning in column.absent}
            if role in table and column.answer and absent:
                table[role] = table[role].mask(table[role].map(lambda cell: clean(cell).casefold()).isin(absent), "")
        numeric = [role for role, column in self.schema.columns.items() if column.number and role in table]
        table = with_points(table, numeric, self.cells.attrs["delimiter"])
        shown = [role for role in shown if role in table]
        if shown and not table.empty:
            nothing = pd.concat([_is_empty(table[role], ABSENT - {"none"}) for role in shown], axis=1).all(axis=1)
            if nothing.all():
                expected = f"no row with {' or '.join(shown)}: give the columns' names (columns), or other rows"
                raise InputError(f"{self.name} has {expected}.")
            if nothing.any():
                self.notes.append(
                    f"{_rows_were(nothing)} left out, which show nothing ({', '.join(shown)} empty)"
                    f"{self.apart(table.index, nothing, '; the others can be chosen with {}')}."
                )
                people, table = {*table["participant_id"]}, table[~nothing]
                if gone := sorted(people - {*table["participant_id"]} - ABSENT):
                    self.notices.append(f"Participants without any {' or '.join(shown)} were left out: {few(gone)}.")
        return self._with_participants(
            without_summaries(without_headers(table, self.columns, self.notices), self.notices)
        )

    def _with_participants(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return the rows with cleaned cells and merged spellings; a missing name is an error."""
        if any(table["participant_id"] != table["participant_id"].str.strip()):
            self.notes.append("Spaces at the ends of participants’ names were removed.")
        for role in table:
            if role in NAMED:
                table = united(table, str(role), NAMED[str(role)], self.notices)
            else:
                table[role] = table[role].map({cell: clean(cell) for cell in table[role].unique()})
        names = table["participant_id"]
        if (unnamed := names.str.lower().isin(ABSENT)).any():
            raise InputError(f"{place(table, unnamed)}: the participant is missing: name it.")
        if (wrong := names.str.fullmatch(r"\d(?:[.,]\d+)?[eE]\+?\d+")).any():
            raise InputError(
                f"{place(table, wrong)}: the participant is {names[wrong].iloc[0]}, to which a spreadsheet program may "
                "have shortened different names: enter them again as text."
            )
        self._note_files(names)
        compared = [name for role, name in self.columns.items() if self.schema.columns[role].compared]
        if table.index.nlevels == self.cells.index.nlevels:
            note_shared_names(self.cells.loc[table.index], names, compared, self.notices)
        return table

    def _note_files(self, names: pd.Series[str]) -> None:
        """Note that several files were read as one table, at the top if a file has several participants."""
        people = [{*own} for _, own in names.groupby(level=0)]
        again, several = in_several(people), any(len(own) > 1 for own in people)
        if len(people) > 1 and (again or several):
            shared = f", of whom {few(again)} {'occurs' if len(again) == 1 else 'occur'} in several" if again else ""
            (self.notices if several else self.notes).append(
                f"The {len(people)} files were read as one table of {names.nunique()} participants{shared}: for "
                "separate experiments use 'focalgradient report --separate'."
            )

    def apart(self, index: pd.Index[int], wrong: pd.Series[bool], text: str) -> str:
        """Return `text` with the columns and values that tell wrong rows from the others; "" if none do."""
        if index.nlevels != 2 or wrong.all():
            return ""
        cells, wrong_rows = self.cells.loc[index], wrong.to_numpy(bool)
        for name in self.unused:
            values = {*cells[name][~wrong_rows]}
            if len(values) == 1 and values.isdisjoint(cells[name][wrong_rows]) and (value := values.pop()).strip():
                return text.format(where_like(name, value))
        return ""

    def answers(self, table: pd.DataFrame, role: str, order: Sequence[str] = ()) -> pd.DataFrame:
        """Return the rows with a value in a column, with its numbers parsed; a notice counts the others.

        Words are replaced by the numbers of their steps in `order`, and codes of missing values by empty cells.
        """
        column = self.schema.columns[role]
        table = self._without_codes(in_steps(table, role, order, self.notes), role)
        missing = _is_empty(table[role], column.absent)
        if missing.all():
            raise InputError(f"{self.name} holds no {column.answer}: the column given for {role}s is empty.")
        if missing.any():
            who = few(sorted(set(table["participant_id"][missing])))
            noun = with_article("answer" if column.answer == "answer" else role)
            self.notices.append(f"{_rows_were(missing)} left out, without {noun} (participants {who}).")
            table = table[~missing].copy()
        return table.assign(**{role: self.numbers(table, role)}) if column.number and not column.words else table

    def _without_codes(self, table: pd.DataFrame, role: str) -> pd.DataFrame:
        codes = self.schema.columns[role].codes
        return without_codes(table, role, self.notices, signed=codes == "signed") if codes else table

    def numbers(self, table: pd.DataFrame, role: str, *, empty: bool = False) -> pd.Series[float]:
        """Parse finite numbers with a decimal point, in the unit of the heading; empty cells are NaN, or an error."""
        texts = table[role]
        values = texts.map({cell: as_number(cell) for cell in texts.unique()}).astype(float)
        absent = _is_empty(texts, ABSENT)
        wrong = values.isna() & ~(absent & empty)
        if wrong.any():
            text = texts[wrong].iloc[0]
            damaged = (
                ": it is a date, which a spreadsheet program may have made of a number: enter the number again as text"
                if is_date(text)
                else ", as the file holds a formula without its value: open and save it with a spreadsheet program"
                if text.startswith("=")
                else others(texts[wrong])
            )
            if role == "rating" and text.endswith("%"):
                damaged += f": write the numbers alone, below the heading '{role} (%)'"
            words = {*texts[~absent]}
            alike = [name for name in self.unused if {cell.strip() for cell in self.cells[name]} - {""} == words]
            if role == "rating" and len(words) == 2 and len(alike) == 1:
                where = f'columns={{"interval": "{printable(alike[0])}"}}'
                damaged += f": where {printable(alike[0])} says which of two was the picture, state it with {where}"
            elif role in ("rating", "confidence") and all(map(is_in_words, words)):
                damaged += ': state the order of answers in words, from the least, with order=["WORD,WORD,..."]'
            elif self.schema.columns[role].answer and not re.search(r"\d", text):
                damaged += f": {missing_as(text)}"
            damaged += self.apart(table.index, wrong, ": choose the other rows with {}")
            raise invalid(table, role, wrong, f"but must be a number, like 1.4{damaged}")
        header = self.columns.get(role, "")
        program = "jsPsych" if header == "rt" and {"trial_type", "time_elapsed"} <= {*self.cells} else ""
        program = "E-Prime" if header.endswith(".RT") else program
        factor = TIMES["ms"] if program else factor_of(role, self.schema.columns[role].units, header)
        if factor != 1:
            states = f"{program} writes" if program else "it states"
            self.notices.append(f"The column {header} was multiplied by {factor:g}, for the unit that {states}.")
            values = values * factor
        check_magnitudes(table.assign(**{role: values}), role)
        return values

    def optional(
        self, table: pd.DataFrame, role: str, check: Callable[[pd.DataFrame], None] | None = None
    ) -> pd.DataFrame:
        """Parse the numbers of a role; leave the column out, with a notice, if they are none and nobody named it.

        `check` raises `InputError` for numbers that cannot be right.
        """
        if role not in table:
            return table
        table = self._without_codes(table, role)
        try:
            parsed = table.assign(**{role: self.numbers(table, role, empty=True)})
            if check is not None:
                check(parsed)
        except InputError as error:
            if role in self.given:
                raise
            self.notices.append(f"The column {self.columns.get(role, role)} was not used: {error}")
            return table.drop(columns=role)
        return parsed

    def truths(self, table: pd.DataFrame, role: str) -> pd.Series[bool]:
        """Convert cells that say yes or no to booleans."""
        column = self.schema.columns[role]
        known = {**TRUTH, **column.words}
        meant = {word: meaning for word, meaning in self.meanings.items() if meaning in known}
        cells = table[role].str.strip().str.casefold().map(lambda cell: meant.get(cell, cell))
        if (wrong := ~cells.isin(list(known))).any():
            raise invalid(table, role, wrong, f"but must be {column.expected}")
        return cells.map(known).astype(bool)

    def with_catch(self, table: pd.DataFrame, *, note: bool = True) -> pd.DataFrame:
        """Return the table with the boolean column `catch`; without such a column no trial is one, which is noted."""
        if "catch" in table:
            return table.assign(catch=self.truths(table, "catch"))
        self.notes.extend(["No catch-trial column: no trial is treated as one."] * note)
        return table.assign(catch=False)


def completed(table: pd.DataFrame, *roles: str) -> pd.DataFrame:
    """Return the table with columns session, condition and kind where they are among `roles`; people by default."""
    return table.assign(**{role: table[role].str.strip() if role in table else DEFAULTS[role] for role in roles})


def holds(schema: Schema, paths: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table has the columns of a kind, and none by which tables of other kinds are recognised."""
    columns = columns or {}
    if (schema.others | {"aperture", "fixation"}) & set(columns):
        return False
    table = read_table(paths)
    if schema.others & ({clean(str(name)).casefold() for name in table.cells} - set(columns.values())):
        return False
    known = (*schema.columns, "participant")
    theirs = {role: name for role, name in columns.items() if role in known and not name.endswith("*")}
    found = found_columns(table.name, table.cells, schema, theirs)
    return any(roles <= set(found) for roles in schema.signs)


def _is_empty(cells: pd.Series[str], absent: Collection[str]) -> pd.Series[bool]:
    return cells.str.strip().str.casefold().isin(absent)


def _rows_were(left_out: pd.Series[bool]) -> str:
    """Format a number of rows, or of cells of a wide table, for a note: "1 row was", "3 cells were"."""
    count, noun = int(left_out.sum()), "row" if left_out.index.nlevels < 3 else "cell"
    return f"1 {noun} was" if count == 1 else f"{count:,} {noun}s were"
