"""Whether a data set is what its design, its journals and its stimuli say."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focalgradient.dataset.bids import Files, files_of, journals, read_description, table_text
from focalgradient.dataset.columns import COLUMNS, cell
from focalgradient.dataset.journal import Log, read_journal
from focalgradient.dataset.read import DataSet, read_dataset
from focalgradient.dataset.stimuli import check_stimuli, read_manifest
from focalgradient.design import check_design
from focalgradient.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["VALIDATOR", "Findings", "bids_problems", "validate"]

VALIDATOR = "bids-validator-deno"
"""The program that knows the standard."""

CLOCK = 1e-6
"""Seconds that times may differ by for having been written down."""


@dataclass(frozen=True, slots=True)
class Findings:
    """What was found in a data set.

    Parameters
    ----------
    sessions, trials
        How many.
    problems
        What is wrong, a sentence each; none in a valid data set.
    notes
        What is right, but good to know.
    """

    sessions: int
    trials: int
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def validate(root: Path, stimuli: Path | None = None) -> Findings:
    """Check a data set by its own lights: that every trial of its design is there once, as the journal has it.

    Parameters
    ----------
    root
        Its folder.
    stimuli
        Folder of the pictures that were shown, to check them too.

    Raises
    ------
    InputError
        If the folder holds no data set, or one that cannot be read.
    """
    data = read_dataset(root)
    problems: list[str] = []
    notes: list[str] = []
    logs: dict[Files, Log] = {}
    for path in journals(root):
        try:
            log = read_journal(path)
            files = files_of(log)
        except (InputError, KeyError, TypeError) as error:
            problems.append(str(error) if isinstance(error, InputError) else f"{path} does not tell its session.")
            continue
        logs[Files(root, files.task, files.participant, files.session)] = log
        if log.broken:
            notes.append(f"{path}: the session was cut off {len(log.broken)} times; no finished trial was lost.")
    for files, log in logs.items():
        if files not in data.sidecars:
            problems.append(f"{log.path} has no table: resume the session, or make the table with --export.")
        elif files.table.read_text(encoding="utf-8") != table_text(log):
            problems.append(f"{files.table} does not say what its journal says: move it away, and use --export.")
    simulated = bool(read_description(root).get("Simulated"))
    for name, kind in zip(data.participants["participant_id"], data.participants["kind"], strict=True):
        if (kind == "simulated") != simulated:
            problems.append(f"participants.tsv: {name} is {kind}, but dataset_description.json says otherwise.")
    of_session = {
        task: dict(iter(table.groupby(["participant_id", "session"], sort=False)))
        for task, table in data.tables.items()
    }
    manifests: set[str] = set()
    for files, sidecar in data.sidecars.items():
        rows = of_session[files.task].get((f"sub-{files.participant}", files.session or ""))
        rows = data.tables[files.task].iloc[:0] if rows is None else rows
        found = [*_wrong_trials(files, sidecar, rows), *_wrong_times(files.task, rows)]
        found += _wrong_stimuli(files, sidecar, rows, manifests)
        if sidecar.get("Simulated") is not simulated:
            found.append("its sidecar and dataset_description.json differ in whether observers were simulated.")
        problems += [f"{files.table}: {sentence}" for sentence in found]
        if files not in logs:
            notes.append(f"{files.table} has no journal to compare it with.")
    if stimuli is not None:
        problems += _other_stimuli(stimuli, manifests)
    return Findings(len(data.sidecars), _count(data), tuple(problems), (*notes, *_dropped(data)))


def _trials(task: str, rows: pd.DataFrame) -> pd.DataFrame:
    """One row a trial."""
    return rows.drop_duplicates("trial") if task == "necker" else rows


def _count(data: DataSet) -> int:
    tables = data.tables.items()
    return sum(len(table.drop_duplicates(["participant_id", "session", "trial"])) for _, table in tables)


def _dropped(data: DataSet) -> Iterator[str]:
    for task, table in data.tables.items():
        late = table[table["dropped_frames"] > 0].drop_duplicates(["participant_id", "session", "trial"])
        if len(late):
            yield f"{len(late)} trials of {task} dropped frames (column dropped_frames); none is left out."


def _wrong_trials(files: Files, sidecar: Any, rows: pd.DataFrame) -> Iterator[str]:
    try:
        design = check_design(str(files.sidecar), sidecar["Design"])
        if design.task != files.task:
            raise InputError(f"{files.sidecar}: the design is of {design.task}.")
    except InputError as error:
        yield str(error)
        return
    listed = [trial for trial in design.trials(files.participant, files.session) if trial.phase == "main"]
    expected = {trial.trial: trial for trial in listed}
    shown = _trials(files.task, rows)
    numbers = shown["trial"].tolist()
    there = set(numbers)
    missing = [number for number in expected if number not in there]
    if missing:
        first = f"the first is {missing[0]}"
        yield f"{len(missing)} of {len(expected)} trials of the design are missing ({first}): resume the session."
    strange = [number for number in numbers if number not in expected]
    if strange:
        yield f"trial {strange[0]} is not in the design, which has {len(expected)}."
    if numbers != sorted(numbers):
        yield "the trials are not in the order in which they were shown."
    names = [column.name for column in COLUMNS[files.task] if hasattr(listed[0], column.name)]
    columns = {name: shown[name].tolist() for name in names}
    for place, number in enumerate(numbers):
        if number not in expected:
            continue
        for name in names:
            told, planned = cell(columns[name][place]), cell(getattr(expected[number], name))
            if told != planned:
                yield f"trial {number}: {name} is {told}, but {planned} in the design."
                return


def _wrong_times(task: str, rows: pd.DataFrame) -> Iterator[str]:
    shown = _trials(task, rows)
    if (shown["sitting"].diff() < 0).any():
        yield "the sittings are not in order."
    onset = "trial_onset" if task == "necker" else "onset"
    back = shown[shown.groupby("sitting")[onset].diff() <= 0]
    if len(back):
        yield f"trial {back['trial'].iloc[0]}: {onset} is not later than in the trial before it."
    if task != "necker" or rows.empty:
        return
    trial, ends = rows["trial"], rows["onset"] + rows["duration"]
    last = trial != trial.shift(-1)
    first = trial != trial.shift()
    start = ends.shift().where(~first, 0.0)
    gap = ((rows["onset"] - start).abs() > CLOCK) | (last & ((ends - rows["trial_duration"]).abs() > CLOCK))
    if gap.any():
        yield f"trial {trial[gap].iloc[0]}: its percepts do not fill the trial from its start to its end."
    if (rows["censored"] != last).any():
        yield f"trial {trial[rows['censored'] != last].iloc[0]}: its last percept, and no other, must be censored."


def _wrong_stimuli(files: Files, sidecar: Any, rows: pd.DataFrame, manifests: set[str]) -> Iterator[str]:
    sha256 = sidecar.get("StimuliSHA256")
    named = set(rows["stimulus"].dropna()) if "stimulus" in rows else set()
    if sha256 is None:
        if named:
            yield "it names pictures, but no manifest of them."
        return
    path = files.manifest(sha256)
    try:
        manifest = read_manifest(path)
    except InputError as error:
        yield str(error)
        return
    if manifest.sha256 != sha256:
        yield f"{path} has changed since the session: restore it from a copy."
    manifests.add(sha256)
    strange = sorted(named - set(manifest.files))
    if strange:
        yield f"its picture {strange[0]} is not in {path}."


def _other_stimuli(stimuli: Path, manifests: set[str]) -> Iterator[str]:
    try:
        sha256 = check_stimuli(stimuli).sha256
    except InputError as error:
        yield str(error)
        return
    if sha256 not in manifests:
        yield f"{stimuli} is not the set of pictures that was shown: no session names its manifest ({sha256[:12]})."


def bids_problems(root: Path) -> list[str] | None:
    """Ask the validator of the standard for errors, a line each; None where it is not installed.

    Raises
    ------
    InputError
        If it does not run to its end.
    """
    program = shutil.which(VALIDATOR, path=str(Path(sys.executable).parent)) or shutil.which(VALIDATOR)
    if program is None:
        return None
    command = [program, str(root), "--ignoreWarnings", "--max-rows", "-1", "--format", "json"]
    run = subprocess.run(command, capture_output=True, text=True, encoding="utf-8")
    try:
        found = json.loads(run.stdout)["issues"]
    except (ValueError, KeyError) as error:
        said = (run.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise InputError(f"{program} did not finish ({said}): install {VALIDATOR} anew.") from error
    return [
        ", ".join(str(issue[key]) for key in ("location", "code", "subCode", "issueMessage") if issue.get(key))
        for issue in found["issues"]
        if issue["severity"] == "error"
    ]
