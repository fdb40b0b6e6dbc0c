"""A data set read back: long tables, each cell checked against what its column may hold."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focalgradient.dataset.bids import Files, read_description
from focalgradient.dataset.columns import APERTURE, COLUMNS, Column
from focalgradient.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["DataSet", "read_dataset"]

NAME = re.compile(r"sub-([A-Za-z0-9]+)(?:_ses-([A-Za-z0-9]+))?_task-([A-Za-z0-9]+)_beh\.tsv")

Rows = list[list[str]]


@dataclass(frozen=True, slots=True, eq=False)
class DataSet:
    """A data set in memory.

    Parameters
    ----------
    root
        Its folder.
    participants
        One row each: participant_id, kind ("human" or "simulated"), and whatever else is known of them.
    tables
        The long table of each task; its index gives the file, and the row in it, that each row comes from.
    sidecars
        What each session's sidecar says.
    """

    root: Path
    participants: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    sidecars: Mapping[Files, Mapping[str, Any]]

    @property
    def depth_rating(self) -> pd.DataFrame:
        """One row a trial of experiment 1; empty where nobody took part."""
        return self.tables["depthrating"]

    @property
    def necker(self) -> pd.DataFrame:
        """One row a percept of experiment 2; empty where nobody took part."""
        return self.tables["necker"]

    @property
    def pinhole(self) -> pd.DataFrame:
        """One row a look of the demonstration; empty where nobody took part."""
        return self.tables["pinhole"]

    @property
    def simulated(self) -> bool:
        """Whether simulated observers took part."""
        return bool((self.participants["kind"] == "simulated").any())


def read_dataset(root: str | os.PathLike[str], tasks: Collection[str] | None = None) -> DataSet:
    """Read a data set, or of it the tables of some tasks; nothing in it is changed.

    Every table has the columns participant_id ("sub-01"), session (its label, "" without one), simulated, and those of
    `focalgradient.dataset.columns.COLUMNS`, in SI units but for what says otherwise; any others are left aside.

    Raises
    ------
    InputError
        If the folder holds no data set, or a table is not what it should be: file and row are named.
    """
    import pandas as pd

    root = Path(root)
    read_description(root)
    participants = _participants(root / "participants.tsv")
    kinds = dict(zip(participants["participant_id"], participants["kind"], strict=True))
    found: dict[str, list[Files]] = {task: [] for task in COLUMNS}
    for path in sorted(root.glob("sub-*/**/*_beh.tsv")):
        match = NAME.fullmatch(path.name)
        if match and match[3] in (COLUMNS if tasks is None else tasks):
            if f"sub-{match[1]}" not in kinds:
                raise InputError(f"{root / 'participants.tsv'}: sub-{match[1]} is missing: add a row, with its kind.")
            found[match[3]].append(Files(root, match[3], match[1], match[2]))
    tables = {}
    for task, sessions in found.items():
        names = [column.name for column in COLUMNS[task]]
        rows: Rows = []
        places: list[tuple[str, int]] = []
        who: list[tuple[str, str]] = []
        for files in sessions:
            own = _rows(files.table, names)
            rows += own
            places += zip(repeat(str(files.table)), range(2, len(own) + 2), strict=False)
            who += [(f"sub-{files.participant}", files.session or "")] * len(own)
        cells = list(zip(*rows, strict=True)) or [()] * len(names)
        table = pd.DataFrame(
            {
                "participant_id": pd.Series([participant for participant, _ in who], dtype="str"),
                "session": pd.Series([session for _, session in who], dtype="str"),
                "simulated": pd.Series([kinds[participant] == "simulated" for participant, _ in who], dtype=bool),
            }
            | {
                column.name: _converted(column, pd.Series(texts, dtype="str"), places)
                for column, texts in zip(COLUMNS[task], cells, strict=True)
            }
        )
        again = table.duplicated(["participant_id", "session", "trial", *(["onset"] if task == "necker" else [])])
        if again.any():
            file, row = places[int(again.to_numpy().argmax())]
            raise InputError(f"{file}, row {row}: its trial stands in a row above: leave one of them out.")
        table.index = pd.MultiIndex.from_tuples(places, names=["file", "row"]) if places else table.index
        tables[task] = table
    sidecars = {files: _sidecar(files.sidecar) for sessions in found.values() for files in sessions}
    return DataSet(root, participants, tables, sidecars)


def _rows(path: Path, names: list[str]) -> Rows:
    """Cells of the columns of those names, as text."""
    try:
        header, *lines = path.read_text(encoding="utf-8-sig").splitlines() or [""]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read ({error}): restore it from a copy.") from error
    there = header.split("\t")
    missing = [name for name in names if name not in there]
    if missing:
        raise InputError(f"{path}: there is no column {missing[0]}: restore the table, or make it anew of its journal.")
    order = [there.index(name) for name in names]
    rows = []
    for number, line in enumerate(lines, start=2):
        cells = line.split("\t")
        if len(cells) != len(there):
            raise InputError(f"{path}, row {number}: there are {len(cells)} cells, but must be {len(there)}, as above.")
        rows.append([cells[place] for place in order])
    return rows


def _converted(column: Column, texts: pd.Series[str], places: list[tuple[str, int]]) -> pd.Series[Any]:
    """A column's texts as what they stand for, if they may stand there."""
    import pandas as pd

    absent = texts == "n/a"
    values: pd.Series[Any] = texts
    if column.form == "bool":
        wrong, expected = ~texts.isin(["true", "false"]), "true or false"
        values = texts == "true"
    elif column.form == "text":
        wrong, expected = texts == "", "a text"
        if column.name == "aperture":
            wrong, expected = ~texts.str.fullmatch(APERTURE.pattern), "'pinhole' or an f-number like 'f/5.6'"
        elif column.levels:
            wrong, expected = ~texts.isin(list(column.levels)), f"one of {', '.join(column.levels)}"
        values = texts.where(~absent) if column.optional else texts
    else:
        values = pd.to_numeric(texts.where(~absent), errors="coerce").astype(float)
        wrong, expected = ~values.abs().lt(float("inf")), "a number"
        if column.form == "integer":
            wrong, expected = wrong | (values % 1 != 0), "a whole number"
        if column.least is not None:
            wrong, expected = wrong | (values < column.least), f"{expected} of {column.least:g} or more"
        if column.above is not None:
            wrong, expected = wrong | (values <= column.above), f"{expected} above {column.above:g}"
    wrong = wrong & ~absent if column.optional else wrong | absent
    if wrong.any():
        at = int(wrong.to_numpy().argmax())
        file, row = places[at]
        raise InputError(f"{file}, row {row}: {column.name} is {texts.iloc[at]!r}, but must be {expected}.")
    return values.astype("int64") if column.form == "integer" else values


def _participants(path: Path) -> pd.DataFrame:
    import pandas as pd

    try:
        table = pd.read_csv(path, sep="\t", na_values=["n/a"], keep_default_na=False, dtype={"participant_id": "str"})
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read ({error}): restore it from a copy.") from error
    for name in ("participant_id", "kind"):
        if name not in table:
            raise InputError(f"{path}: there is no column {name}: add it.")
    wrong = ~table["kind"].isin(["human", "simulated"])
    if wrong.any():
        at = int(wrong.to_numpy().argmax())
        raise InputError(
            f"{path}, row {at + 2}: kind is {table['kind'].iloc[at]!r}, but must be one of human, simulated."
        )
    return table


def _sidecar(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): make it anew of its journal.") from error
    except ValueError as error:
        raise InputError(f"{path} is not valid JSON ({error}): make it anew of its journal.") from error
    if not (isinstance(found, dict) and isinstance(found.get("Design"), dict)):
        raise InputError(f"{path} does not tell the design: make it anew of its journal.")
    return found
