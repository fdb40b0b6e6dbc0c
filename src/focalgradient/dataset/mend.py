"""Repair of damaged data sets: damaged sessions become readable."""

from __future__ import annotations

import hashlib
import os
import sys
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from focalgradient.dataset.alike import is_same
from focalgradient.dataset.bids import (
    derived_files,
    export,
    files_of,
    journals,
    read_description,
)
from focalgradient.dataset.events import Event
from focalgradient.dataset.focus import export_focus, focus_files, focus_journals
from focalgradient.dataset.journal import Journal, Log, create_whole, read_journal, scan_journal, whole_lines, writing
from focalgradient.dataset.read import checked_design
from focalgradient.dataset.replay import replay
from focalgradient.errors import InputError
from focalgradient.files import sweep

__all__ = ["Repair", "repair", "sweep_all"]


@dataclass(frozen=True, slots=True)
class Repair:
    """Result of repairing one session.

    Parameters
    ----------
    journal
        Path of the session's journal.
    done
        Changes and omissions, one sentence each; empty if the session could not be repaired.
    originals
        Copies of the original files, beside the journal.
    problem
        Why the session could not be repaired.
    """

    journal: Path
    done: tuple[str, ...] = ()
    originals: tuple[Path, ...] = ()
    problem: str = ""


def repair(root: Path) -> list[Repair]:
    """Make every damaged session of a data set readable; original files are kept beside its journal as ``.original``.

    A journal keeps its whole lines. Omitted are lines that are unreadable, invalid, or changed after they were written,
    second records of a trial, and trials that the design does not have; a last line lists the omissions. Tables and
    sidecars that differ from their journal are written again.

    Raises
    ------
    InputError
        If the folder is not a data set, or something cannot be written.
    """
    read_description(root)
    sweep_all(root)
    made = []
    for path in (*journals(root), *focus_journals(root)):
        try:
            found = _repaired(path)
        except InputError as error:
            found = Repair(path, problem=str(error))
        if found.done or found.problem:
            made.append(found)
    return made


def _repaired(path: Path) -> Repair:
    done: list[str] = []
    originals: list[Path] = []
    with Journal.take(path) as journal, writing(path):
        log = scan_journal(path)
        if not log.events:
            return Repair(path, problem=log.damaged[0])
        _rewrite(log, journal, *_kept(log, path.read_bytes()), done, originals)
    log = read_journal(path)
    of_focus = "design" not in log.head
    for place, content in (focus_files(log) if of_focus else derived_files(log, files_of(log))).items():
        there = place.read_bytes() if place.exists() else None
        if there is None:
            done += [f"{place.name} was missing, and was written from the journal."] if of_focus else []
        elif there != content and place.name.endswith("_beh.tsv") and content.startswith(there):
            done.append(f"{place.name} was not complete, and was written again.")
        elif there != content and not is_same(place, content):
            _replace(path, place, content, done, originals)
    if done:
        export_focus(path) if of_focus else export(path)
    return Repair(path, tuple(done), tuple(originals))


def _rewrite(
    log: Log, journal: Journal, kept: list[Event], left_out: list[str], done: list[str], originals: list[Path]
) -> None:
    """Write a journal again with the events that it keeps, if it had faults."""
    path = log.path
    if not (log.damaged or log.changed or left_out):
        return
    originals.append(_kept_beside(path, path.parent))
    event: Event = {
        "event": "repaired",
        "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "left_out": left_out,
        "found": [  # without the file's path and the remedy
            sentence.removeprefix(f"{path}: ").partition(": restore")[0] for sentence in (*log.damaged, *log.changed)
        ],
        "original": originals[-1].name,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }
    if sys.platform == "win32":  # where open files cannot be replaced
        journal.close()
    create_whole(path, whole_lines([*kept, event]), replace=True)
    done += left_out or ["Every line was kept, and the chain was computed again."]


def _replace(path: Path, place: Path, content: bytes, done: list[str], originals: list[Path]) -> None:
    """Write a file again, and keep the original beside the journal."""
    with writing(path):
        originals.append(_kept_beside(place, path.parent))
        create_whole(place, content, replace=True)
    done.append(f"{place.name} differed from the journal, and was written again.")


def _kept(log: Log, content: bytes) -> tuple[list[Event], list[str]]:
    """Return the events that a repaired journal keeps, and descriptions of those that it omits."""
    filled = {number for number, line in enumerate(content.split(b"\n"), start=1) if line.strip()}
    explained = set(log.broken) if not log.damaged else set()
    left_out = [f"Line {number}, which cannot be used." for number in sorted(filled - {*log.lines} - explained)]
    whole = [one for one in zip(log.lines, log.events, strict=True) if one[0] not in log.altered or one[1] is log.head]
    lines, events = zip(*whole, strict=True)
    refused = dict[int, str]()
    if "design" in log.head:
        design = checked_design(str(log.path), log.head["design"])
        planned = design.trials(log.head["participant"], log.head["session"])
        found = replay(replace(log, lines=lines, events=events), design, planned)
        refused = {one.line: f"Line {one.line}, {one.trial}: {one.why}." for one in found if not one.placed}
    for line, event in zip(log.lines, log.events, strict=True):
        if line not in lines:
            what = f"{event['phase']} trial {event['trial']}" if event["event"] == "trial" else event["event"]
            left_out.append(f"Line {line}, {what}, which was changed after it was written.")
        elif line in refused:
            left_out.append(refused[line])
    return [event for line, event in whole if line not in refused], left_out


def _kept_beside(path: Path, folder: Path) -> Path:
    """Copy a file to an unused name in a folder, unless an interrupted repair already did so."""
    content = path.read_bytes()
    place, number = folder / f"{path.name}.original", 1
    while place.exists():
        if place.read_bytes() == content:
            return place
        number += 1
        place = folder / f"{path.name}.original-{number}"
    create_whole(place, content)
    return place


def sweep_all(root: Path) -> None:
    """Remove temporary folders that crashed runs left in a data set: they may contain participants' data."""
    for folder, _, _ in os.walk(root):
        sweep(folder)
