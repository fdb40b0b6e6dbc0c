"""Removal of a participant who withdraws, from the data set and its links."""

from __future__ import annotations

import hashlib
import re
import shutil
import sys
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from focalgradient.dataset.append import UNDONE, writing
from focalgradient.dataset.bids import Files, journals, json_text, read_description
from focalgradient.dataset.events import Event
from focalgradient.dataset.journal import Journal, create_whole, rewrite, scan_journal
from focalgradient.dataset.links import forget_links, links_beside
from focalgradient.dataset.mend import sweep_all
from focalgradient.errors import InputError

__all__ = [
    "digest_of_record",
    "files_naming",
    "has_withdrawn",
    "record_of",
    "remove_participant",
    "withdraw",
    "withdrawals",
]

KEY = "Withdrawn"
"""Key of ``dataset_description.json`` with one entry per removed record: its digest, or null without a record.

While a participant is being removed, the entry contains the label, so that an interrupted removal can be completed. A
browser session has a random number, its record: if it is imported again, from a platform's file or another folder, its
record identifies it and it is rejected; the digest reveals nothing to anyone else.
"""


def withdraw(root: Path, participant: str, links: Path | None = None, *, elsewhere: bool = False) -> list[Path]:
    """Remove a participant from a data set and from its server's links.

    This removes tables, journals, copies made by repairs, rows of tables, links and platform identifiers.
    ``dataset_description.json`` keeps the number of withdrawals, without label or date. After an interruption the same
    call completes the removal. Copies elsewhere, and reports, are not affected.

    Parameters
    ----------
    root
        Folder of the data set.
    participant
        Label, such as ``sub-07`` or ``07``.
    links
        File of links of 'focalgradient serve'; default: the one beside the data set, if it exists.
    elsewhere
        Whether the participant was already removed from a store: then data and folder need not exist.

    Returns
    -------
    list of Path
        Files and folders that were removed, and files that lost rows or lines.

    Raises
    ------
    InputError
        If there is no such participant, a session of theirs is being recorded, or something cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from focalgradient.design import BlurThresholdDesign
    >>> from focalgradient.observers import simulate
    >>> with TemporaryDirectory() as folder:
    ...     root = Path(folder, "data")
    ...     _ = simulate(BlurThresholdDesign(), root, observers=2, seed=1)
    ...     gone = withdraw(root, "01")
    >>> [path.name for path in gone]
    ['sub-01', 'sub-01', 'participants.tsv']
    """
    label = participant.removeprefix("sub-")
    gone = [] if elsewhere and not root.exists() else remove_participant(root, participant)
    place = links_beside(root) if links is None else links
    if (links is not None or place.exists()) and forget_links(place, label):
        gone.append(place)
    if not (gone or elsewhere):
        raise InputError(f"{root} has no participant sub-{label}: give a label of participants.tsv.")
    return gone


def remove_participant(root: Path, participant: str) -> list[Path]:
    """Remove a participant from a data set only, as `withdraw` does; return an empty list if there is none."""
    label = participant.removeprefix("sub-")
    Files(root, "necker", label)  # raises for an invalid label
    description = read_description(root)
    sweep_all(root)
    name = f"sub-{label}"
    inside = [path for path in sorted(root.rglob(f"{name}*")) if re.fullmatch(rf"{name}([_.].*)?", path.name)]
    outer = [path for path in inside if not any(other in path.parents for other in inside)]
    tables = [path for path in sorted(root.rglob("*.tsv")) if path not in inside and _rows_of(path, name)]
    with ExitStack() as owned:
        own = [path for path in journals(root) if path.name.startswith(f"{name}_")]
        for path in own:
            owned.enter_context(Journal.take(path))  # locked against recording
        records = [digest_of_record(record) for path in own if (record := record_of(scan_journal(path).events))]
        with writing(root, UNDONE):
            entries = withdrawals(root)
            begun = next((one for one in entries if isinstance(one, dict) and one.get("participant") == name), None)
            if begun is None or "records" not in begun:
                if not (outer or tables):
                    return []
                begun = {"participant": name, "records": records}
                _note(root, description, [*entries, begun])
                entries.append(begun)
            if sys.platform == "win32":
                owned.close()
            for path in outer:
                shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
            for path in tables:
                _without(path, name)
            others = [entry for entry in entries if entry is not begun]
            _note(root, description, [*others, *(begun["records"] or [None])])
    return [*outer, *tables] or [root / "dataset_description.json"]


def _note(root: Path, description: dict[str, Any], entries: list[Any]) -> None:
    content = description | {KEY: entries}
    create_whole(root / "dataset_description.json", json_text(content).encode(), replace=True)


def files_naming(root: Path, participant: str) -> list[Path]:
    """Return files of a data set whose name or content still names a participant, such as reports and copies."""
    word = re.compile(rb"(?<![A-Za-z0-9])sub-%s(?![A-Za-z0-9])" % participant.removeprefix("sub-").encode())
    files = [path for path in sorted(root.rglob("*")) if path.is_file()]
    return [path for path in files if word.search(path.name.encode()) or word.search(path.read_bytes())]


def withdrawals(root: Path) -> list[Any]:
    """Return one entry for each participant or record removed from a data set."""
    entries = read_description(root).get(KEY, [])
    return entries if isinstance(entries, list) else []


def record_of(events: Iterable[Event]) -> str | None:
    """Return the record of a browser session; None for any other session."""
    found = [event["record"] for event in events if event.get("kind") == "sitting" and "record" in event]
    return found[0] if found and isinstance(found[0], str) else None


def digest_of_record(record: str) -> str:
    """Return the digest that is stored of a removed record."""
    return hashlib.sha256(f"withdrawn {record}".encode()).hexdigest()


def has_withdrawn(root: Path, record: str | None) -> bool:
    """Return whether a record was removed from a data set."""
    return record is not None and digest_of_record(record) in withdrawals(root)


def _rows_of(path: Path, name: str) -> list[bytes]:
    lines = path.read_bytes().splitlines(keepends=True)
    return [line for line in lines if name.encode() in line.rstrip(b"\r\n").split(b"\t")]


def _without(path: Path, name: str) -> None:
    """Remove a participant's rows from a table."""

    def others() -> bytes:
        gone = _rows_of(path, name)
        return b"".join(line for line in path.read_bytes().splitlines(keepends=True) if line not in gone)

    rewrite(path, others)
