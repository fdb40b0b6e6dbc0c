"""Reading of data sets: long tables, each cell checked against the permitted values of its column."""

from __future__ import annotations

import io
import json
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.dataset.bids import Files, journals, read_description
from focalgradient.dataset.columns import columns_stated
from focalgradient.dataset.conduct import removals
from focalgradient.design import Design, check_design
from focalgradient.errors import InputError
from focalgradient.files import read_json, read_tsv
from focalgradient.files.columns import Column, converted
from focalgradient.tasks import is_task, task_named

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "DataSet",
    "SessionTable",
    "checked_design",
    "named_files",
    "participants_of",
    "read_dataset",
    "read_session",
    "sessions_of",
    "wrong_kinds",
]

TABLES = ("depthrating", "necker", "pinhole", "blurthreshold")
"""Tasks whose tables are properties of `DataSet`, empty without sessions."""

NAME = re.compile(r"sub-([A-Za-z0-9]+)(?:_ses-([A-Za-z0-9]+))?_task-([A-Za-z0-9]+)_beh\.tsv")


@dataclass(frozen=True, slots=True, eq=False)
class DataSet:
    """Data set in memory.

    Parameters
    ----------
    root
        Folder of the data set.
    participants
        One row per participant: participant_id, kind ("human" or "simulated"), and other known data.
    tables
        Long table of each task with sessions, and of `TABLES`; the index gives the file and row from which
        each row was read.
    sidecars
        Sidecar of each session.
    problems
        Reasons why sessions were left out, one sentence each, with file and row.
    withdrawn
        Participants with sessions of these tasks who asked for removal of their answers: their sessions are left out.
    """

    root: Path
    participants: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    sidecars: Mapping[Files, Mapping[str, Any]]
    problems: tuple[str, ...] = ()
    withdrawn: tuple[str, ...] = ()

    @property
    def depth_rating(self) -> pd.DataFrame:
        """One row per trial of experiment 1; empty without sessions."""
        return self.tables["depthrating"]

    @property
    def necker(self) -> pd.DataFrame:
        """One row per percept of experiment 2; empty without sessions."""
        return self.tables["necker"]

    @property
    def pinhole(self) -> pd.DataFrame:
        """One row per look of the demonstration; empty without sessions."""
        return self.tables["pinhole"]

    @property
    def blur_threshold(self) -> pd.DataFrame:
        """One row per trial of the adaptive experiment; empty without sessions."""
        return self.tables["blurthreshold"]

    @property
    def simulated(self) -> bool:
        """Whether any observer was simulated."""
        return bool((self.participants["kind"] == "simulated").any())


@dataclass(slots=True)
class SessionTable:
    """Table and sidecar of one session.

    Parameters
    ----------
    files
        Paths of the files.
    columns
        Values of each valid column, by name.
    rows
        Number of rows.
    sidecar
        Content of the sidecar; empty if it cannot be read.
    problems
        Problems of either, one sentence each.
    text
        Text of the table.
    """

    files: Files
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    rows: int = 0
    sidecar: dict[str, Any] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    text: str = ""

    @property
    def expected(self) -> tuple[Column, ...]:
        """Columns that the table must have, by the design in the sidecar."""
        return columns_stated(self.files.task, self.sidecar)


def sessions_of(root: Path, tasks: Collection[str] | None = None) -> list[Files]:
    """Return the sessions that have a table, in order of name."""
    found = (named_files(root, path.name) for path in sorted(root.glob("sub-*/**/*_beh.tsv")))
    return [files for files in found if files and (is_task(files.task) if tasks is None else files.task in tasks)]


def named_files(root: Path, table: str) -> Files | None:
    """Return the session to which a table's name belongs; None for an invalid name."""
    match = NAME.fullmatch(table)
    return Files(root, match[3], match[1], match[2]) if match else None


def read_session(files: Files) -> SessionTable:
    """Read table and sidecar of a session, and list all their problems."""
    found = SessionTable(files)
    missing: list[str] = []
    try:
        found.sidecar = _sidecar(files)
    except InputError as error:
        missing.append(str(error))
    try:
        found.text = read_tsv(files.table)
        _read_table(found)
    except InputError as error:
        found.problems.append(str(error))
    found.problems += missing
    return found


def _read_table(found: SessionTable) -> None:
    path, columns = found.files.table, found.expected
    header, *lines = found.text.splitlines() or [""]
    there = header.split("\t")
    rows = []
    for number, line in enumerate(lines, start=2):
        cells = line.split("\t")
        if len(cells) != len(there):
            raise InputError(
                f"{path}, row {number}: there are {len(cells)} cells, but must be {len(there)}, as in the header."
            )
        rows.append(cells)
    found.rows = len(rows)
    cells_of = dict(zip(there, zip(*rows, strict=True) if rows else [()] * len(there), strict=False))
    for column in columns:
        if column.name not in cells_of:
            found.problems.append(
                f"{path}: the column {column.name} is missing: restore the table, or write it again from its journal."
            )
            continue
        texts = cells_of[column.name]
        values, wrong = converted(column, texts)
        if wrong is None:
            found.columns[column.name] = values
        else:
            found.problems.append(
                f"{path}, row {wrong + 2}: {column.name} is {texts[wrong][:80]!r}, but must be {column.expected}."
            )
    keys = ["trial", "onset"] if task_named(found.files.task).percepts else ["trial"]
    if all(key in found.columns for key in keys):
        met: set[tuple[Any, ...]] = set()
        for row, key in enumerate(zip(*(found.columns[key].tolist() for key in keys), strict=True), start=2):
            if key in met:
                found.problems.append(f"{path}, row {row}: its trial is also in a row above: remove one of them.")
                break
            met.add(key)


def read_dataset(
    root: str | os.PathLike[str],
    tasks: Collection[str] | None = None,
    *,
    damaged: Literal["refuse", "leave out"] = "refuse",
) -> DataSet:
    """Read a data set, or the tables of some of its tasks; files are not changed.

    Sessions of participants who asked for removal of their answers are left out.

    Every table has the columns participant_id ("sub-01"), session (its label, or ""), simulated, those of its design
    (`Task.columns`; SI units unless stated otherwise), and those of additional values.
    Other columns are ignored.

    Parameters
    ----------
    root
        Folder of the data set.
    tasks
        Tasks whose tables are read; None: all.
    damaged
        Treatment of sessions with an invalid table or sidecar: "refuse" raises; "leave out" reads all other sessions,
        and names the invalid ones in `DataSet.problems`.

    Raises
    ------
    InputError
        If the folder is not a data set, or a table is invalid: file and row are named.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from focalgradient.design import BlurThresholdDesign
    >>> from focalgradient.observers import simulate
    >>> with TemporaryDirectory() as folder:
    ...     root = Path(folder, "data")
    ...     _ = simulate(BlurThresholdDesign(), root, observers=2, seed=1)
    ...     found = read_dataset(root)
    >>> len(found.blur_threshold), found.blur_threshold["level"].max() > 0
    (132, np.True_)
    """
    root = Path(root)
    read_description(root)
    participants = participants_of(root / "participants.tsv")
    kinds = dict(zip(participants["participant_id"], participants["kind"], strict=True))
    wrong = wrong_kinds(participants, root / "participants.tsv")
    problems: list[str] = []
    whole: dict[str, list[SessionTable]] = {task: [] for task in TABLES}
    withdrawn = removals(journals(root))
    gone = set[str]()
    for files in sessions_of(root, tasks):
        if f"sub-{files.participant}" in withdrawn:
            gone.add(f"sub-{files.participant}")
            continue
        found = read_session(files)
        found.text = ""
        if f"sub-{files.participant}" not in kinds:
            found.problems.append(
                f"{root / 'participants.tsv'}: sub-{files.participant} is missing: add a row, with its kind."
            )
        elif f"sub-{files.participant}" in wrong:
            found.problems.append(wrong[f"sub-{files.participant}"])
        if found.problems and damaged == "refuse":
            raise InputError(found.problems[0])
        problems += found.problems
        if not found.problems:
            whole.setdefault(files.task, []).append(found)
    tables = {task: _table(task, sessions, kinds) for task, sessions in whole.items()}
    sidecars = {found.files: found.sidecar for sessions in whole.values() for found in sessions}
    return DataSet(root, participants, tables, sidecars, tuple(problems), tuple(sorted(gone)))


def _table(task: str, sessions: Sequence[SessionTable], kinds: Mapping[str, str]) -> pd.DataFrame:
    """Concatenate the tables of all sessions."""
    import pandas as pd

    counts = [found.rows for found in sessions]
    names = [f"sub-{found.files.participant}" for found in sessions]

    def repeated(values: Sequence[Any], kind: Any) -> NDArray[Any]:
        return np.repeat(np.array(values, kind), counts)

    columns: dict[str, Any] = {
        "participant_id": pd.Series(repeated(names, object), dtype="str"),
        "session": pd.Series(repeated([found.files.session or "" for found in sessions], object), dtype="str"),
        "simulated": repeated([kinds[name] == "simulated" for name in names], bool),
    }
    kinds_of = {"bool": np.dtype(bool), "integer": np.dtype(np.int64), "number": np.dtype(float)}
    every: dict[str, Column] = {}
    for found in sessions:
        every |= {column.name: column for column in found.expected}
    for name, column in ({column.name: column for column in task_named(task).columns()} | every).items():
        kind = kinds_of.get(column.form, np.dtype(object))
        if isinstance(column.absent, float):
            kind = np.dtype(float)
        parts = [
            found.columns.pop(name) if name in found.columns else np.full(found.rows, column.absent, kind)
            for found in sessions
        ]
        joined = np.concatenate([np.empty(0, kind), *parts])
        columns[name] = pd.Series(joined, dtype="str") if column.form == "text" else joined
    table = pd.DataFrame(columns)
    if len(table):
        levels: list[Any] = [[str(found.files.table) for found in sessions], np.arange(2, max(counts) + 2)]
        places = [np.repeat(np.arange(len(sessions)), counts), np.concatenate([np.arange(count) for count in counts])]
        table.index = pd.MultiIndex(levels=levels, codes=places, names=["file", "row"], verify_integrity=False)
    return table


def participants_of(path: Path) -> pd.DataFrame:
    """Read ``participants.tsv``: one row per participant, with "n/a" as missing.

    Raises
    ------
    InputError
        If it cannot be read, or lacks the column participant_id or kind.
    """
    import pandas as pd

    try:
        text = read_tsv(path, "a table of participants")
        table = pd.read_csv(
            io.StringIO(text), sep="\t", na_values=["n/a"], keep_default_na=False, dtype={"participant_id": "str"}
        )
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{path} cannot be read ({error}): restore it from a copy.") from error
    for name in ("participant_id", "kind"):
        if name not in table:
            raise InputError(f"{path}: the column {name} is missing: add it.")
    return table


def wrong_kinds(participants: pd.DataFrame, path: Path) -> dict[str, str]:
    """Return a sentence for each participant of unknown kind."""
    return {
        str(name): f"{path}, row {row}: kind is {kind!r}, but must be one of human, simulated."
        for row, (name, kind) in enumerate(zip(participants["participant_id"], participants["kind"], strict=True), 2)
        if kind not in ("human", "simulated")
    }


def _sidecar(files: Files) -> dict[str, Any]:
    path, remedy = files.sidecar, "write it again from its journal with 'focalgradient validate --export'"
    try:
        found = read_json(path, "a sidecar")
    except InputError as error:
        raise InputError(f"{str(error).rstrip('.')}; or {remedy}.") from error
    if not (isinstance(found, dict) and isinstance(found.get("Design"), dict)):
        raise InputError(f"{path} does not contain the design: {remedy}.")
    sittings = found.get("Sittings", [])
    if not (isinstance(sittings, list) and all(isinstance(one, dict) for one in sittings)):
        raise InputError(f"{path}: Sittings must be a list of tables: {remedy}.")
    try:
        design = checked_design(str(path), found["Design"])
        if design.task != files.task:
            raise InputError(f"{path}: the design is of {design.task}.")
    except InputError as error:
        raise InputError(f"{str(error).rstrip('.')}; or {remedy}.") from error
    return found


@lru_cache(maxsize=64)
def _design(recorded: str) -> Design:
    return check_design("the design", json.loads(recorded))


def checked_design(name: str, recorded: Mapping[str, Any]) -> Design:
    """Create a design from its recorded settings, once for all sessions with equal settings.

    Raises
    ------
    InputError
        If the settings are invalid.
    """
    try:
        return _design(json.dumps(recorded, sort_keys=True))
    except InputError as error:
        raise InputError(str(error).replace("the design", name, 1)) from error
