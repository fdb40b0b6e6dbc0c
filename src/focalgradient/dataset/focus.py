"""Sessions of focus by gaze: whether journal and table of the changes of focus are whole, and agree."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from focalgradient.dataset.journal import Log, scan_journal
from focalgradient.errors import InputError
from focalgradient.files import read_text

__all__ = ["focus_journals", "wrong_focus"]

ENDS = "_task-gazefocus_events"

COLUMNS = ("onset", "focus_dioptre", "gaze_x", "gaze_y", "gaze_dioptre", "latency_ms", "latency_frames")
"""Of the table, those that a change of focus in the journal has."""


def focus_journals(root: Path) -> list[Path]:
    """Journals of sessions of focus by gaze, in order of name."""
    return sorted(Path(root, "sourcedata").rglob(f"sub-*{ENDS}.jsonl"))


def wrong_focus(root: Path, path: Path) -> Iterator[str]:
    """Say what is wrong with a session of focus by gaze, a sentence each."""
    try:
        log = scan_journal(path)
    except InputError as error:
        yield str(error)
        return
    yield from (*log.damaged, *log.changed)
    table = root / path.relative_to(root / "sourcedata").with_suffix(".tsv")
    if not table.exists():
        yield f"{table} is missing, but its journal is there: the session was killed; its changes stand in {path}."
        return
    try:
        header, *rows = [line.split("\t") for line in read_text(table, "a table").splitlines()] or [[]]
    except InputError as error:
        yield str(error)
        return
    if not set(COLUMNS) <= set(header):
        yield f"{table}: there is no column {next(name for name in COLUMNS if name not in header)}: restore the table."
        return
    changes = _changes(log)
    if len(rows) != len(changes):
        yield f"{table} has {len(rows)} changes of focus, but its journal {len(changes)}: restore the table."
        return
    for number, (row, change) in enumerate(zip(rows, changes, strict=True), start=2):
        for name in COLUMNS:
            place = header.index(name)
            if len(row) != len(header) or row[place] != f"{change[name]:.6g}":
                yield f"{table}, row {number}: {name} does not say what its journal says: restore the table."
                return


def _changes(log: Log) -> list[dict[str, float]]:
    return [note for note in log.of("note") if note.get("kind") == "focus" and "latency_ms" in note]
