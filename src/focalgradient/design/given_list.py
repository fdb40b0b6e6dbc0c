"""Trial lists as tables: export of a design's list, and import of a table that replaces it."""

from __future__ import annotations

import dataclasses
import typing
from collections import Counter
from collections.abc import Hashable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict, TypeAdapter, ValidationError

from focalgradient.errors import InputError
from focalgradient.files.tables import read_cells

__all__ = ["LEFT_ASIDE", "PARTICIPANT", "listed_rows", "numbered", "read_trials", "trial_row", "trials_of"]

PARTICIPANT = "participant"
"""Column with the participant's label; a table without it applies to all participants."""

LEFT_ASIDE = frozenset({"trial", "repetition", "picture", "reference", "seconds"})
"""Columns for other programs, which follow from the others and are ignored on import."""

LARGEST = 16 * 2**20
"""Maximum size of a table in bytes: a hundred participants with 2000 trials each."""

NONE = ("", "n/a")

GERMAN = {"wahr": "true", "falsch": "false"}
"""Boolean values as German Excel writes them."""

Row = Mapping[str, Any]


def read_trials(path: Path) -> list[dict[str, str]]:
    """Read a trial table (CSV, TSV, XLSX or JSON) as cells by column, with decimal points.

    Raises
    ------
    InputError
        If it cannot be read, has no header, a duplicate column, or no rows.
    """
    return read_cells(path, "a table of trials", largest=LARGEST).records()


def trial_row(trial: Any) -> dict[str, Any]:
    """Return a trial as a table row: its fields, and the levels of its factors by name.

    >>> from focalgradient.design import PinholeTrial
    >>> trial_row(PinholeTrial(trial=1, repetition=1, form="real", viewing="tube", scene="room"))["viewing"]
    'tube'
    """
    row: dict[str, Any] = {}
    for one in dataclasses.fields(trial):
        value = getattr(trial, one.name)
        row |= value if isinstance(value, dict) else {one.name: value}
    return row


def listed_rows(rows: Iterable[Row], participant: str) -> tuple[dict[str, Any], ...]:
    """Return the rows of a participant, without the participant column.

    Raises
    ------
    InputError
        If there are none.
    """
    own = tuple(
        {name: value for name, value in row.items() if name != PARTICIPANT}
        for row in rows
        if PARTICIPANT not in row or _same(str(row[PARTICIPANT]), participant)
    )
    if not own:
        raise InputError(f"the list of trials has no rows for participant {participant}: add them.")
    return own


def _same(one: str, other: str) -> bool:
    one, other = one.removeprefix("sub-"), other.removeprefix("sub-")
    return one == other or (one.isdigit() and other.isdigit() and int(one) == int(other))


def trials_of(
    name: str, rows: Sequence[Mapping[str, str]], kind: type[Any], factors: Sequence[str]
) -> list[dict[str, Any]]:
    """Check the rows of a table, and convert their cells to the field types of a class of trials.

    Parameters
    ----------
    name
        Name of the table, for messages.
    rows
        Rows with text cells.
    kind
        Class of the trials.
    factors
        Names of the columns of factor levels.

    Raises
    ------
    InputError
        If a column is missing or unknown, or a cell is invalid: row and column are named.
    """
    hints = typing.get_type_hints(kind)
    fields = {one.name: one for one in dataclasses.fields(kind) if one.name != "factors"}
    known = {*fields, *factors, PARTICIPANT, *LEFT_ASIDE}
    for column in rows[0]:
        if column not in known:
            raise InputError(
                f"{name}: {column} is not a field of a trial: leave the column out, or use {', '.join(fields)}."
            )
    needed = {one.name for one in fields.values() if _needed(one)} | set(factors)
    if missing := sorted(needed - {*rows[0]}):
        raise InputError(f"{name}: the column {missing[0]} is missing: add it.")
    checked = []
    for number, row in enumerate(rows, start=2):
        made: dict[str, Any] = {}
        for column, cell in row.items():
            if column in LEFT_ASIDE:
                continue
            text = column in factors or column == PARTICIPANT
            if not text and cell in NONE and not _needed(fields[column]):
                continue
            try:
                made[column] = cell if text else _value(hints[column], cell)
            except ValidationError as error:
                wanted = error.errors()[0]["msg"].removeprefix("Input should be ")
                raise InputError(f"{name}, row {number}: {column} is {cell[:60]!r}, but must be {wanted}.") from error
        checked.append(made)
    return checked


def _needed(one: Any) -> bool:
    return one.default is dataclasses.MISSING and one.default_factory is dataclasses.MISSING


def _value(hint: Any, cell: str) -> Any:
    if type(None) in typing.get_args(hint) and cell in NONE:
        return None
    if typing.get_origin(hint) is Literal:
        cell = next((part for part in typing.get_args(hint) if str(part) == cell), cell)
    read = TypeAdapter(hint, config=ConfigDict(allow_inf_nan=False)).validate_python
    try:
        return read(cell)
    except ValidationError:
        local = GERMAN.get(cell.lower(), cell)
        if local == cell:
            raise
        return read(local)


def numbered(rows: Sequence[Row], kind: type[Any], factors: Sequence[str]) -> tuple[Any, ...]:
    """Create trials from checked rows, with trial numbers per phase and repetition numbers per condition.

    Raises
    ------
    InputError
        If practice follows a main trial, or there are no main trials.
    """
    phases = [row.get("phase", "main") for row in rows]
    if "main" not in phases or "practice" in phases[phases.index("main") :]:
        raise InputError("a list of trials must have practice trials first, then main trials: put it in that order.")
    count: Counter[str] = Counter()
    met: Counter[Hashable] = Counter()
    trials = []
    for row, phase in zip(rows, phases, strict=True):
        count[phase] += 1
        own = {name: value for name, value in row.items() if name not in factors}
        levels = {"factors": {name: row[name] for name in factors}} if factors else {}
        trial = kind(**own, **levels, trial=count[phase])
        if phase == "main":
            met[trial.catch, trial.condition] += 1
            trial = dataclasses.replace(trial, repetition=met[trial.catch, trial.condition])
        trials.append(trial)
    return tuple(trials)
