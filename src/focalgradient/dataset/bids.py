"""BIDS files of a data set: their paths and contents, derived from the journals.

The journals in ``sourcedata`` are the primary record. Tables and sidecars are derived from them and can be written
again; they grow when a session is resumed, but rows once written never change.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from focalgradient.dataset.append import append
from focalgradient.dataset.columns import NOTED
from focalgradient.dataset.conduct import failed_practice
from focalgradient.dataset.events import Event
from focalgradient.dataset.gaze import gaze_files
from focalgradient.dataset.journal import Journal, Log, create_whole, read_journal, rewrite, writing
from focalgradient.dataset.lock import locked
from focalgradient.dataset.markers import HED_VERSION
from focalgradient.dataset.percepts import Press, percepts
from focalgradient.dataset.times import trials_with_times
from focalgradient.design import check_label
from focalgradient.errors import InputError
from focalgradient.files import read_bytes, read_json, read_tsv
from focalgradient.files.columns import Column, cell
from focalgradient.tasks import task_named
from focalgradient.tasks.columns import TIMES
from focalgradient.tasks.noted import EXTRA, noted_columns

__all__ = [
    "Files",
    "Kind",
    "add_participant",
    "begin_dataset",
    "check_folder",
    "check_participant",
    "export",
    "journals",
    "read_description",
    "source_files",
    "table_rows",
]

Kind = Literal["human", "simulated"]

ABOUT: dict[str, dict[str, Any]] = {
    "kind": {
        "Description": "Who answered.",
        "Levels": {"human": "a person", "simulated": "an observer simulated by a computer"},
    },
    "age": {"Description": "Age of the participant.", "Units": "year"},
    "sex": {"Description": "Sex of the participant, as stated."},
    "handedness": {"Description": "Hand preferred, as stated."},
}
"""Columns of ``participants.tsv`` after the label, with their descriptions."""

FAILED = "practice_failed"
FAILED_ABOUT = {FAILED: {"Description": "Tasks whose practice was not passed in its last round, separated by spaces."}}
"""Column of ``participants.tsv`` where a participant did not pass a practice."""

README = """\
Behavioural data in BIDS, written by focalgradient {version}. Each participant's tables are in sub-*/.../beh; the JSON
file beside a table says what its columns mean and how it came about: design, seed, screen, clock, versions.

Tables hold the trials that count, catch trials among them (column catch); practice is in the journals alone. Trials
with dropped frames are marked (column dropped_frames), never left out.

Where the gaze was recorded, *_physio.tsv.gz holds its samples and *_physioevents.tsv.gz the fixations.

sourcedata/ holds the journals, one line an event, written as the session went: they are what was recorded, and the
tables are made of them. FILE.original is a file as it was before a repair.

stimuli/ holds the manifests of the pictures shown, with their SHA-256. participants.tsv may
be given more columns. 'focalgradient validate' checks all of it.
"""


@dataclass(frozen=True, slots=True)
class Files:
    """Paths of one session's files.

    >>> files = Files(Path("data"), "necker", "01")
    >>> files.table.as_posix()
    'data/sub-01/beh/sub-01_task-necker_beh.tsv'
    """

    root: Path
    task: str
    participant: str
    session: str | None = None

    def __post_init__(self) -> None:
        check_label("the participant", self.participant)
        if self.session is not None:
            check_label("the session", self.session)

    @property
    def _folder(self) -> Path:
        session = [] if self.session is None else [f"ses-{self.session}"]
        return Path(f"sub-{self.participant}", *session, "beh")

    @property
    def name(self) -> str:
        """Stem of the files' names."""
        session = "" if self.session is None else f"_ses-{self.session}"
        return f"sub-{self.participant}{session}_task-{self.task}_beh"

    @property
    def journal(self) -> Path:
        """Path of the journal."""
        return self.root / "sourcedata" / self._folder / f"{self.name}.jsonl"

    @property
    def table(self) -> Path:
        """Path of the long table."""
        return self.root / self._folder / f"{self.name}.tsv"

    @property
    def sidecar(self) -> Path:
        """Path of the table's sidecar, with design, apparatus and descriptions of the columns."""
        return self.table.with_suffix(".json")

    def beside(self, end: str) -> Path:
        """Return the path of another file of the session: `end` replaces ``beh.tsv`` in the table's name."""
        return self.table.with_name(self.name.removesuffix("beh") + end)

    def manifest(self, sha256: str) -> Path:
        """Return the path of the copy of the stimuli's manifest."""
        return self.root / "stimuli" / f"manifest-{sha256[:12]}.json"

    def keep_manifest(self, sha256: str, content: bytes) -> None:
        """Write the manifest of a session's pictures, unless another session has."""
        _create_missing(self.manifest(sha256), content)


def _create_missing(path: Path, content: bytes) -> None:
    with suppress(FileExistsError):  # another session may begin at the same time
        create_whole(path, content)


def journals(root: Path) -> Iterator[Path]:
    """Yield all journals of a data set, in order of name.

    >>> from tempfile import TemporaryDirectory
    >>> from focalgradient.design import BlurThresholdDesign
    >>> from focalgradient.observers import simulate
    >>> with TemporaryDirectory() as folder:
    ...     root = Path(folder, "data")
    ...     _ = simulate(BlurThresholdDesign(), root, observers=2, seed=1)
    ...     [path.name for path in journals(root)][0]
    'sub-01_task-blurthreshold_beh.jsonl'
    """
    yield from source_files(root, "sub-*_beh.jsonl")


def source_files(root: Path, pattern: str) -> list[Path]:
    """Return files below ``sourcedata`` in order of name, without those in hidden folders, which a crash leaves."""
    base = Path(root, "sourcedata")
    return sorted(
        path for path in base.rglob(pattern) if not any(part[0] == "." for part in path.relative_to(base).parts)
    )


def read_description(root: Path) -> dict[str, Any]:
    """Read ``dataset_description.json``.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    path = Path(root, "dataset_description.json")
    if not path.exists():
        found = "does not exist"
        outer = [folder for folder in Path(root).absolute().parents if (folder / path.name).exists()]
        if Path(root).exists() and outer:
            raise InputError(f"{root} is a part of the data set {outer[0]}: give that folder.")
        if Path(root).is_dir():
            full = any(Path(root).iterdir())
            found = "is not a data set, as it has no dataset_description.json" if full else "is an empty folder"
        elif Path(root).exists():
            found = "is a file, not the folder of a data set"
        raise InputError(f"{root} {found}: give the folder that 'run', 'serve' or 'simulate' wrote.")
    found = read_json(path, "the description of a data set")
    if not isinstance(found, dict):
        raise InputError(f"{path} is not a JSON object: restore it from a copy.")
    return found


DEFAULT_NAME = "Focal gradients"
"""Name of a data set that is not given one."""


def begin_dataset(root: Path, kind: Kind, name: str = DEFAULT_NAME) -> None:
    """Create the files that describe a data set, unless they exist.

    Parameters
    ----------
    root
        Folder: new, empty, or a data set of the same kind.
    kind
        Kind of participants: people and simulated observers are stored in separate data sets.
    name
        Name of a new data set.

    Raises
    ------
    InputError
        If the folder contains other files, or a data set of the other kind.
    """
    check_folder(root, kind)
    description = root / "dataset_description.json"
    ours = version("focalgradient")
    note = "SIMULATED OBSERVERS, not people: every answer was computed by a model.\n\n" if kind == "simulated" else ""
    about = {
        "Name": f"{name} (simulated observers)" if note else name,
        "BIDSVersion": "1.11.1",
        "HEDVersion": HED_VERSION,
        "DatasetType": "raw",
        "Simulated": kind == "simulated",
        "GeneratedBy": [{"Name": "focalgradient", "Version": ours}],
    }
    title = str(about["Name"])
    readme = f"{title}\n{'=' * len(title)}\n\n{note}{README.format(version=ours)}"
    for path, content in (
        (description, json_text(about)),  # first, so that an interrupted data set is recognised
        (root / "README", readme),
        (root / "participants.json", json_text(ABOUT)),
        (root / "participants.tsv", "\t".join(("participant_id", *ABOUT)) + "\n"),
    ):
        _create_missing(path, content.encode())


def check_folder(root: Path, kind: Kind) -> None:
    """Raise `InputError` for a folder that cannot be a data set of that kind.

    Raises
    ------
    InputError
        If it contains other files, or a data set of the other kind.
    """
    description = root / "dataset_description.json"
    # Checked first: a session that begins concurrently creates the description before any other file.
    taken = root.is_dir() and any(not entry.name.startswith(".") for entry in root.iterdir())
    if description.exists():
        simulated = read_description(root).get("Simulated", False)
        if simulated != (kind == "simulated"):
            there, here = ("simulated observers", "a person") if simulated else ("people", "a simulated observer")
            raise InputError(f"{root} is a data set of {there}, which {here} cannot join: give another folder.")
    elif os.path.lexists(root) and not root.is_dir():
        raise InputError(f"{root} is a file, but must be the folder of a data set: give another path.")
    elif taken:
        raise InputError(f"{root} contains files but is not a data set: give a new or an empty folder.")


def check_participant(root: Path, participant: str, kind: Kind) -> None:
    """Raise `InputError` for a participant of the other kind, or whose label is the same number as another's (1, 01).

    Raises
    ------
    InputError
        If ``participants.tsv`` has such a row, which is named.
    """
    path = root / "participants.tsv"
    if not path.exists():
        return
    for row in _participants(path)[1]:
        label = str(row.get("participant_id")).removeprefix("sub-")
        if label == participant and row.get("kind") != kind:
            raise InputError(f"{path}: sub-{participant} is {row.get('kind')}, not {kind}: correct the row.")
        if label != participant and same_number(label, participant):
            raise InputError(
                f"{path} has sub-{label}, which is the same number as sub-{participant}: give {label}, or another."
            )


def same_number(one: str, other: str) -> bool:
    """Return whether two labels are the same number, and thus the same position in the order of participants.

    >>> same_number("1", "01"), same_number("1", "a1")
    (True, False)
    """
    return all(label.isascii() and label.isdigit() for label in (one, other)) and one.lstrip("0") == other.lstrip("0")


def _participants(path: Path) -> tuple[list[str], list[dict[str, str]]]:
    """Return the columns and the rows of ``participants.tsv``."""
    names, *rows = [line.split("\t") for line in read_tsv(path, "a table of participants").splitlines()] or [[]]
    if "participant_id" not in names:
        raise InputError(f"{path}: the column participant_id is missing: add it.")
    return names, [dict(zip(names, row, strict=False)) for row in rows]


def add_participant(root: Path, participant: str, about: Mapping[str, Any]) -> None:
    """Add a participant's row to ``participants.tsv`` if there is none; columns added by others are kept."""
    path = root / "participants.tsv"
    with locked(path) as file:
        names, rows = _participants(path)
        row = {"participant_id": f"sub-{participant}", **about}
        if all(other["participant_id"] != row["participant_id"] for other in rows):
            append(file, path, ("\t".join(cell(row.get(name)) for name in names) + "\n").encode())


def _state_practice(root: Path, participant: str, task: str) -> None:
    """Name a task whose practice a participant did not pass in ``participants.tsv``, in a column added if necessary."""
    path, about = root / "participants.tsv", root / "participants.json"

    def stated() -> bytes | None:
        names, rows = _participants(path)
        row = next((row for row in rows if row["participant_id"] == f"sub-{participant}"), None)
        failed = (row or {}).get(FAILED, "n/a")
        if row is None or task in failed.split():
            return None
        row[FAILED] = task if failed == "n/a" else f"{failed} {task}"
        names = [*dict.fromkeys([*names, FAILED])]
        lines = ["\t".join(names), *("\t".join(row.get(name, "n/a") for name in names) for row in rows)]
        return "".join(f"{line}\n" for line in lines).encode()

    if not rewrite(path, stated):
        return
    with suppress(InputError):
        create_whole(
            about, json_text(read_json(about, "the columns' descriptions") | FAILED_ABOUT).encode(), replace=True
        )


def table_rows(log: Log) -> list[dict[str, Any]]:
    """Return the rows of the long table derived from a journal."""
    rows: list[dict[str, Any]] = []
    for sitting, event, times in trials_with_times(log):
        noted = {name: one["value"] for name, one in event.get(EXTRA, {}).items()}
        rows += [row | times | noted for row in _rows(event, sitting, log.head)]
    return rows


def _columns(log: Log) -> tuple[Column, ...]:
    """Return the columns of the table derived from a journal: of the design, of times, and of additional values."""
    timed = {name for _, _, times in trials_with_times(log) for name in times}
    of_times = (column for column in TIMES if column.name in timed)
    return (*task_named(log.head["design"]["task"]).columns(log.head["design"]), *of_times, *_noted(log))


def _noted(log: Log) -> tuple[Column, ...]:
    return noted_columns(event for event in log.of("trial") if event["phase"] == "main")


def _rows(event: Event, sitting: int, head: Event) -> list[Event]:
    if "presses" not in event:
        return [{**event.get("factors", {}), **event, "sitting": sitting}]
    presses = [Press(*press) for press in event["presses"]]
    return [
        event
        | {
            "sitting": sitting,
            "trial_onset": event["onset"],
            "onset": each.onset,
            "duration": each.end - each.onset,
            "percept": each.percept,
            "censored": each.censored,
        }
        for each in percepts(presses, head["keys"], event["trial_duration"])
    ]


def export(journal: Path) -> Files:
    """Write table and sidecar of a journal, also of an interrupted session.

    Raises
    ------
    InputError
        If the journal is damaged or being recorded, or an existing table differs from it.
    """
    with Journal.take(journal):
        return make_table(journal)


def make_table(journal: Path) -> Files:
    """Write table and sidecar of a journal that the caller owns: see `export`."""
    log = read_journal(journal)
    files = files_of(log)
    made = derived_files(log, files)
    if files.table.exists() and not _begins(made[files.table].decode(), read_bytes(files.table, "a table")):
        raise InputError(f"{files.table} differs from its journal {journal}: move it away, and it is written again.")
    with writing(files.table):
        for path, content in made.items():
            create_whole(path, content, replace=True)
        if failed_practice(log) and (files.root / "participants.tsv").exists():
            _state_practice(files.root, files.participant, files.task)
    return files


def _begins(text: str, there: bytes) -> bool:
    """Return whether a table extends an existing one, in the columns of the latter; later notes may add columns."""
    if text.encode().startswith(there):
        return True
    old = there.split(b"\n", 1)[0].decode(errors="replace").split("\t")
    rows = [line.split("\t") for line in text.splitlines()]
    if len(old) >= len(rows[0]) or rows[0][: len(old)] != old:
        return False
    return "".join("\t".join(row[: len(old)]) + "\n" for row in rows).encode().startswith(there)


def derived_files(log: Log, files: Files) -> dict[Path, bytes]:
    """Return the files derived from a journal, by path.

    They are the sidecar, the table, and if recorded samples, fixations and markers with their sidecars.
    """
    made = {files.sidecar: json_text(sidecar_of(log)).encode(), files.table: table_text(log).encode()}
    gaze = gaze_files(log.events, screen_of(log.head["apparatus"]))
    return made | {files.beside(end): content for end, content in gaze.items()}


def is_of_this_version(log: Log) -> bool:
    """Return whether this version of the program wrote a journal, so that its derived files have the same wording."""
    ours = version("focalgradient")
    return all(event["versions"].get("focalgradient") == ours for event in (log.head, *log.of("resumed")))


def screen_of(apparatus: Mapping[str, Any]) -> dict[str, Any]:
    """Return the BIDS description of a stimulus screen, without unknown entries."""
    known = {
        "ScreenDistance": apparatus.get("viewing_distance_m"),
        "ScreenOrigin": ["top", "left"],
        "ScreenRefreshRate": apparatus.get("refresh_hz"),
        "ScreenResolution": apparatus.get("screen_px"),
        "ScreenSize": apparatus.get("screen_m"),
    }
    return {key: value for key, value in known.items() if value is not None}


def files_of(log: Log) -> Files:
    """Return the paths of the session that a journal in a data set belongs to."""
    head = log.head
    root = next((folder.parent for folder in log.path.absolute().parents if folder.name == "sourcedata"), None)
    if root is None:
        raise InputError(f"{log.path} is not in the folder sourcedata of a data set: move it back there.")
    return Files(root, head["design"]["task"], head["participant"], head["session"])


def table_text(log: Log) -> str:
    """Return the content of the long table derived from a journal."""
    names = [column.name for column in _columns(log)]
    lines = ["\t".join(names)]
    lines += ["\t".join([cell(value) for value in map(row.get, names)]) for row in table_rows(log)]
    return "\n".join(lines) + "\n"


def sidecar_of(log: Log) -> dict[str, Any]:
    """Return a session's sidecar: design, apparatus of each sitting, and descriptions of the table's columns."""
    head = log.head
    task = head["design"]["task"]
    sittings = [head, *log.of("resumed")]
    content = {
        "TaskName": task,
        "TaskDescription": task_named(task).title,
        "Simulated": head["kind"] == "simulated",
        "Seed": head["design"]["seed"],
        "Design": head["design"],
        "Keys": head["keys"],
        "StimuliSHA256": head["stimuli"],
        "Sittings": [{"Apparatus": sitting["apparatus"], "Versions": sitting["versions"]} for sitting in sittings],
        "Journal": {"Events": len(log.events), "Chain": log.last},
    }
    about = head.get("about")
    if isinstance(about, dict) and (seen := {key: value for key, value in about.items() if key not in ABOUT}):
        content["Participant"] = seen
    repaired = [{key: value for key, value in event.items() if key != "event"} for event in log.of("repaired")]
    if repaired:
        content["Repaired"] = repaired
    if noted := _noted(log):
        content[NOTED] = [column.name for column in noted]
    return content | {column.name: column.described() for column in _columns(log)}


def json_text(value: Mapping[str, Any]) -> str:
    """Return the text of a JSON file of the data set: indented, with a final line feed."""
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
