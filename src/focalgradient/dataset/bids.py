"""Files of a data set as BIDS has them: where they are, what they hold, written from the journals.

The journals lie in ``sourcedata`` and are what was recorded; tables and sidecars are made of them, may be made again,
and grow when a session is resumed, but never change what they said.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from focalgradient.dataset.columns import COLUMNS, TITLES, cell
from focalgradient.dataset.journal import Event, Log, create_whole, read_journal, writing
from focalgradient.dataset.percepts import Press, percepts
from focalgradient.design import check_label
from focalgradient.errors import InputError

__all__ = [
    "Files",
    "Kind",
    "add_participant",
    "begin_dataset",
    "check_folder",
    "export",
    "journals",
    "read_description",
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
"""Columns of ``participants.tsv`` after the label."""

README = """\
Behavioural data in BIDS, written by focalgradient {version}. Each participant's tables are in sub-*/.../beh; the JSON
file beside a table tells what its columns mean and how it came about: design, seed, screen, clock, versions.

Tables hold the trials that count, catch trials among them (column catch); practice is in the journals alone. Trials
with dropped frames are told, never left out.

sourcedata/ holds the journals, one line an event, written as the session went: they are what was recorded, and the
tables are made of them. stimuli/ holds the manifests of the pictures shown, with their SHA-256. participants.tsv may
be given more columns. 'focalgradient validate' checks all of it.
"""


@dataclass(frozen=True, slots=True)
class Files:
    """Where one session's files are.

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
        """What the files' names begin with."""
        session = "" if self.session is None else f"_ses-{self.session}"
        return f"sub-{self.participant}{session}_task-{self.task}_beh"

    @property
    def journal(self) -> Path:
        """What was recorded."""
        return self.root / "sourcedata" / self._folder / f"{self.name}.jsonl"

    @property
    def table(self) -> Path:
        """The long table."""
        return self.root / self._folder / f"{self.name}.tsv"

    @property
    def sidecar(self) -> Path:
        """What the table's columns mean, and how it came about."""
        return self.table.with_suffix(".json")

    def manifest(self, sha256: str) -> Path:
        """A copy of the manifest of the stimuli."""
        return self.root / "stimuli" / f"manifest-{sha256[:12]}.json"


def journals(root: Path) -> Iterator[Path]:
    """All journals of a data set, in order of name."""
    yield from sorted(Path(root, "sourcedata").rglob("sub-*_beh.jsonl"))


def read_description(root: Path) -> dict[str, Any]:
    """Read ``dataset_description.json``.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    path = Path(root, "dataset_description.json")
    try:
        found = json.loads(path.read_bytes())
        if not isinstance(found, dict):
            raise ValueError("a table was expected")
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): give the folder of a data set.") from error
    except ValueError as error:
        raise InputError(f"{path} is not valid JSON ({error}): mend it, or restore it from a copy.") from error
    return found


def begin_dataset(root: Path, kind: Kind, name: str = "Focal gradients") -> None:
    """Make the files that describe a data set, where they are missing.

    Parameters
    ----------
    root
        The folder: new, empty, or a data set of the same kind.
    kind
        Who takes part: data sets of people and of simulated observers are kept apart.
    name
        Of a new data set.

    Raises
    ------
    InputError
        If the folder holds something else, or a data set of the other kind.
    """
    check_folder(root, kind)
    description = root / "dataset_description.json"
    root.mkdir(parents=True, exist_ok=True)
    ours = version("focalgradient")
    note = "SIMULATED OBSERVERS, not people: every answer was computed by a model.\n\n" if kind == "simulated" else ""
    told = {
        "Name": f"{name} (simulated observers)" if note else name,
        "BIDSVersion": "1.10.0",
        "DatasetType": "raw",
        "Simulated": kind == "simulated",
        "GeneratedBy": [{"Name": "focalgradient", "Version": ours}],
    }
    title = str(told["Name"])
    readme = f"{title}\n{'=' * len(title)}\n\n{note}{README.format(version=ours)}"
    for path, content in (
        (description, _json(told)),  # first: what is cut off here is known for a data set
        (root / "README", readme),
        (root / "participants.json", _json(ABOUT)),
        (root / "participants.tsv", "\t".join(("participant_id", *ABOUT)) + "\n"),
    ):
        if not path.exists():
            create_whole(path, content.encode())


def check_folder(root: Path, kind: Kind) -> None:
    """Refuse a folder that can be no data set of that kind.

    Raises
    ------
    InputError
        If it holds something else, or a data set of the other kind.
    """
    description = root / "dataset_description.json"
    if description.exists():
        simulated = read_description(root).get("Simulated", False)
        if simulated != (kind == "simulated"):
            there, here = ("simulated observers", "a person") if simulated else ("people", "a simulated observer")
            raise InputError(f"{root} is a data set of {there}, which {here} cannot join: give another folder.")
    elif root.exists() and not root.is_dir():
        raise InputError(f"{root} is a file, where the folder of a data set is to be: give another path.")
    elif root.exists() and any(not entry.name.startswith(".") for entry in root.iterdir()):
        raise InputError(f"{root} holds files but is no data set: give a new or an empty folder.")


def add_participant(root: Path, participant: str, about: Mapping[str, Any]) -> None:
    """Add a participant's row to ``participants.tsv``, if there is none; columns that others have added stay.

    Raises
    ------
    InputError
        If a row of that name says something else of `about`.
    """
    path = root / "participants.tsv"
    text = path.read_text(encoding="utf-8-sig")
    header, *rows = text.splitlines()
    names = header.split("\t")
    for row in rows:
        known = dict(zip(names, row.split("\t"), strict=False))
        if known.get("participant_id") == f"sub-{participant}":
            if known.get("kind") != about["kind"]:
                raise InputError(
                    f"{path}: sub-{participant} is {known.get('kind')}, not {about['kind']}: mend the row."
                )
            return
    told = {"participant_id": f"sub-{participant}", **about}
    line = "\t".join(cell(told.get(name)).replace("\t", " ") for name in names)
    # A single write to the end: sessions that run at once do not disturb each other.
    file = os.open(path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0))
    try:
        os.write(file, (("" if text.endswith("\n") else "\n") + line + "\n").encode())
        os.fsync(file)
    finally:
        os.close(file)


def table_rows(log: Log) -> list[dict[str, Any]]:
    """Rows of the long table that a journal makes."""
    rows: list[dict[str, Any]] = []
    sitting = 1
    for event in log.events:
        if event["event"] == "resumed":
            sitting += 1
        if event["event"] == "trial" and event["phase"] == "main":
            rows += _rows(event | {"sitting": sitting}, log.head)
    return rows


def _rows(event: Event, head: Event) -> list[Event]:
    if "presses" not in event:
        return [event]
    presses = [Press(*press) for press in event["presses"]]
    return [
        event
        | {
            "trial_onset": event["onset"],
            "onset": seen.onset,
            "duration": seen.end - seen.onset,
            "percept": seen.percept,
            "censored": seen.censored,
        }
        for seen in percepts(presses, head["keys"], event["trial_duration"])
    ]


def export(journal: Path) -> Files:
    """Make table and sidecar of a journal, also of one that was cut off.

    Raises
    ------
    InputError
        If the journal is damaged, or the table that is there says something that the journal does not.
    """
    log = read_journal(journal)
    files = files_of(log)
    text = table_text(log)
    if files.table.exists() and not text.startswith(files.table.read_text(encoding="utf-8")):
        raise InputError(
            f"{files.table} does not say what its journal {journal} says: move it away, and it is made anew."
        )
    with writing(files.table):
        files.table.parent.mkdir(parents=True, exist_ok=True)
        create_whole(files.sidecar, _json(_sidecar(log)).encode(), replace=True)
        create_whole(files.table, text.encode(), replace=True)
    return files


def files_of(log: Log) -> Files:
    """Files of the session that a journal in a data set tells."""
    head = log.head
    root = next(folder.parent for folder in log.path.absolute().parents if folder.name == "sourcedata")
    return Files(root, head["design"]["task"], head["participant"], head["session"])


def table_text(log: Log) -> str:
    """The long table that a journal makes, as its file holds it."""
    names = [column.name for column in COLUMNS[log.head["design"]["task"]]]
    lines = ["\t".join(names)]
    lines += ["\t".join(cell(row.get(name)) for name in names) for row in table_rows(log)]
    return "\n".join(lines) + "\n"


def _sidecar(log: Log) -> dict[str, Any]:
    head = log.head
    task = head["design"]["task"]
    sittings = [head, *log.of("resumed")]
    told = {
        "TaskName": task,
        "TaskDescription": TITLES[task],
        "Simulated": head["kind"] == "simulated",
        "Seed": head["design"]["seed"],
        "Design": head["design"],
        "Keys": head["keys"],
        "StimuliSHA256": head["stimuli"],
        "Sittings": [{"Apparatus": sitting["apparatus"], "Versions": sitting["versions"]} for sitting in sittings],
    }
    return told | {column.name: column.described() for column in COLUMNS[task]}


def _json(value: Mapping[str, Any]) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
