"""A data set set right: damaged sessions made readable."""

from __future__ import annotations

import hashlib
import os
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from focalgradient.dataset.alike import same_content
from focalgradient.dataset.bids import (
    export,
    files_of,
    gaze_of,
    journals,
    json_text,
    read_description,
    sidecar_of,
    table_text,
)
from focalgradient.dataset.events import Event
from focalgradient.dataset.focus import export_focus, focus_files, focus_journals
from focalgradient.dataset.journal import Journal, Log, create_whole, read_journal, scan_journal, whole_lines, writing
from focalgradient.dataset.read import checked_design
from focalgradient.errors import InputError
from focalgradient.files import sweep

__all__ = ["Repair", "repair", "sweep_all"]


@dataclass(frozen=True, slots=True)
class Repair:
    """What became of one damaged session.

    Parameters
    ----------
    journal
        Of the session.
    done
        What was done and what was left out, a sentence each; none where it could not be repaired.
    originals
        Files as they were, kept beside the journal.
    problem
        Why it could not be repaired.
    """

    journal: Path
    done: tuple[str, ...] = ()
    originals: tuple[Path, ...] = ()
    problem: str = ""


def repair(root: Path) -> list[Repair]:
    """Make every damaged session of a data set readable; what was there is kept beside its journal as ``.original``.

    A journal keeps its whole lines. Left out are lines that cannot be read or used, lines that were changed after they
    were written, a trial's second record, and trials that the design does not have; a last line says so. A table or
    sidecar that differs from its journal is made anew.

    Raises
    ------
    InputError
        If the folder holds no data set, or something cannot be written.
    """
    read_description(root)
    sweep_all(root)
    made = []
    ways = [
        *((path, _repaired) for path in journals(root)),
        *((path, _repaired_focus) for path in focus_journals(root)),
    ]
    for path, mended in ways:
        try:
            found = mended(path)
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
    files = files_of(log)
    made = {files.table: table_text(log).encode(), files.sidecar: json_text(sidecar_of(log)).encode()}
    for place, content in (made | gaze_of(log, files)).items():
        alike = same_content if "_beh" not in place.name else _begins
        if place.exists() and not alike(place, content):
            _replace(path, place, content, done, originals)
    if done:
        export(path)
    return Repair(path, tuple(done), tuple(originals))


def _repaired_focus(path: Path) -> Repair:
    """Repair a session of focus by gaze: a journal, and all files that it makes."""
    done: list[str] = []
    originals: list[Path] = []
    with Journal.take(path) as journal, writing(path):
        log = scan_journal(path)
        if not log.events:
            return Repair(path, problem=log.damaged[0])
        lines = list(zip(log.lines, log.events, strict=True))
        kept = [event for number, event in lines if number not in log.altered or event is log.head]
        left_out = [
            f"Line {number}, which was changed after it was written."
            for number in log.altered
            if number != log.lines[0]
        ]
        left_out += [f"Line {number}, which cannot be used." for number in log.broken if log.damaged]
        _rewrite(log, journal, kept, left_out, done, originals)
        log = read_journal(path)
    root = next(folder.parent for folder in path.absolute().parents if folder.name == "sourcedata")
    for place, content in focus_files(log, root).items():
        if not place.exists():
            done.append(f"{place.name} was missing, and was made of the journal.")
        elif not same_content(place, content) and place.read_bytes() != content:
            _replace(path, place, content, done, originals)
    if done:
        export_focus(path)
    return Repair(path, tuple(done), tuple(originals))


def _rewrite(
    log: Log, journal: Journal, kept: list[Event], left_out: list[str], done: list[str], originals: list[Path]
) -> None:
    """Write a journal anew of the events that it keeps, where something was wrong with it."""
    path = log.path
    if not (log.damaged or log.changed or left_out):
        return
    originals.append(_kept_beside(path, path.parent))
    event: Event = {
        "event": "repaired",
        "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "left_out": left_out,
        "found": [_what(sentence, path) for sentence in (*log.damaged, *log.changed)],
        "original": originals[-1].name,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }
    if sys.platform == "win32":  # where an open file cannot be replaced
        journal.close()
    create_whole(path, whole_lines([*kept, event]), replace=True)
    done += left_out or ["Every line was kept, and chained anew."]


def _replace(path: Path, place: Path, content: bytes, done: list[str], originals: list[Path]) -> None:
    """Make a file anew, and keep what was there beside the journal."""
    with writing(path):
        originals.append(_kept_beside(place, path.parent))
        create_whole(place, content, replace=True)
    done.append(f"{place.name} differed from the journal, and was made anew.")


def _begins(place: Path, content: bytes) -> bool:
    return content.startswith(place.read_bytes())


def _kept(log: Log, content: bytes) -> tuple[list[Event], list[str]]:
    """Events that a repaired journal keeps, and what it leaves out."""
    design = checked_design(str(log.path), log.head["design"])
    planned = {(trial.phase, trial.trial) for trial in design.trials(log.head["participant"], log.head["session"])}
    filled = {number for number, line in enumerate(content.split(b"\n"), start=1) if line.strip()}
    explained = set(log.broken) if not log.damaged else set()
    left_out = [f"Line {number}, which cannot be used." for number in sorted(filled - {*log.lines} - explained)]
    kept: list[Event] = []
    met: set[tuple[str, int]] = set()
    for number, event in zip(log.lines, log.events, strict=True):
        key = (event.get("phase", ""), event.get("trial", 0))
        trial = event["event"] == "trial"
        what = f"Line {number}, {key[0]} trial {key[1]}" if trial else f"Line {number}, {event['event']}"
        if number in log.altered and kept:
            left_out.append(f"{what}, which was changed after it was written.")
        elif trial and key not in planned:
            left_out.append(f"{what}, which the design does not have.")
        elif trial and key in met:
            left_out.append(f"{what}, which stands above already.")
        else:
            kept.append(event)
            if trial:  # notes name their trial, too
                met.add(key)
    return kept, left_out


def _what(sentence: str, path: Path) -> str:
    """A problem without the file's place and the remedy."""
    return sentence.removeprefix(f"{path}: ").partition(": restore")[0]


def _kept_beside(path: Path, folder: Path) -> Path:
    """Copy a file into a folder under a name that is free, unless a repair that was cut off did so before."""
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
    """Remove what dead runs left half done in a data set: it may be somebody's data."""
    for folder, _, _ in os.walk(root):
        sweep(folder)
