"""Sessions of focus by gaze: what is kept of the changes of focus, and whether journal, table and sidecar agree."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from focalgradient.dataset.alike import differences
from focalgradient.dataset.journal import Log, scan_journal
from focalgradient.errors import InputError
from focalgradient.files import read_json, read_tsv

__all__ = ["ABOUT", "Change", "about_changes", "focus_journals", "wrong_focus"]

ENDS = "_task-gazefocus_events"

ABOUT: dict[str, dict[str, Any]] = {
    "onset": {
        "Description": "When the first frame in the new focus was on the screen, since the window opened.",
        "Units": "s",
    },
    "duration": {"Description": "Until the focus changed again; n/a for the last.", "Units": "s"},
    "focus_dioptre": {
        "Description": "Vergence in focus in the picture that was gone to: 1 / metres.",
        "Units": "dioptre",
    },
    "gaze_x": {"Description": "Gaze, from the picture's left edge to the right.", "Units": "pixel"},
    "gaze_y": {"Description": "Gaze, from the picture's upper edge down.", "Units": "pixel"},
    "gaze_dioptre": {"Description": "Vergence of what is shown at the gaze: 1 / metres.", "Units": "dioptre"},
    "latency_ms": {
        "Description": "From the gaze sample that changed the focus to that frame, by the graphics driver. The "
        "screen's own delay comes on top: the photodiode's square measures it.",
        "Units": "ms",
    },
    "latency_frames": {"Description": "The same in frames of the screen."},
}


class Change(NamedTuple):
    """A change of focus; the fields are described in the table's sidecar."""

    onset: float
    focus_dioptre: float
    gaze_x: float
    gaze_y: float
    gaze_dioptre: float
    latency_ms: float
    latency_frames: float


def about_changes(
    settings: Mapping[str, Any], changes: Sequence[Change], refresh_hz: float | None, frame_s: float
) -> dict[str, Any]:
    """What the sidecar of the table of changes holds."""
    # The first choice of a focus waits for nothing that was shown before.
    milliseconds = np.array([change.latency_ms for change in changes[1:]])
    content: dict[str, Any] = {"TaskName": "gazefocus", **ABOUT, "Settings": settings}
    content["RefreshRate"] = refresh_hz
    content["FramePacing"] = "by the screen" if refresh_hz else f"by the clock, {1 / frame_s:g} Hz: not for timing"
    if len(milliseconds):
        content["Latency"] = {
            name: {"ms": round(float(value), 3), "frames": round(float(value) / 1e3 / frame_s, 3)}
            for name, value in (
                ("median", np.median(milliseconds)),
                ("percentile95", np.percentile(milliseconds, 95)),
                ("largest", milliseconds.max()),
            )
        }
    return content


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
        header, *rows = [line.split("\t") for line in read_tsv(table).splitlines()] or [[]]
    except InputError as error:
        yield str(error)
        return
    if not set(Change._fields) <= set(header):
        missing = next(name for name in Change._fields if name not in header)
        yield f"{table}: there is no column {missing}: restore the table."
        return
    changes = _changes(log)
    yield from _wrong_rows(table, header, rows, changes)
    yield from _wrong_sidecar(table.with_suffix(".json"), log, changes)


def _wrong_rows(
    table: Path, header: Sequence[str], rows: Sequence[Sequence[str]], changes: Sequence[Change]
) -> Iterator[str]:
    if len(rows) != len(changes):
        yield f"{table} has {len(rows)} changes of focus, but its journal {len(changes)}: restore the table."
        return
    for number, (row, change) in enumerate(zip(rows, changes, strict=True), start=2):
        for name, value in change._asdict().items():
            if len(row) != len(header) or row[header.index(name)] != f"{value:.6g}":
                yield f"{table}, row {number}: {name} does not say what its journal says: restore the table."
                return


def _wrong_sidecar(path: Path, log: Log, changes: Sequence[Change]) -> Iterator[str]:
    """Compare the sidecar with the journal, which says how long frames were where there are changes of focus."""
    try:
        found = read_json(path, "a sidecar")
    except InputError as error:
        yield str(error)
        return
    if not isinstance(found, dict):
        yield f"{path} is no JSON object: restore it."
        return
    settings = {key: value for key, value in log.head.items() if key not in ("event", "chain")}
    frames = [change.latency_ms / 1e3 / change.latency_frames for change in changes if change.latency_frames]
    frame_s = frames[0] if frames else math.nan
    rate = found.get("RefreshRate")  # the journal has it as the length of frames only
    agrees = isinstance(rate, (int, float)) and math.isclose(rate * frame_s, 1, rel_tol=1e-6)
    made = about_changes(settings, changes, rate if agrees or not frames else None, frame_s)
    if not frames:
        made["FramePacing"] = found.get("FramePacing")
    yield from (f"{path}: {each}" for each in differences(found, json.loads(json.dumps(made)), "restore it."))


def _changes(log: Log) -> list[Change]:
    notes = [note for note in log.of("note") if note.get("kind") == "focus" and "latency_ms" in note]
    return [Change(*(note[name] for name in Change._fields)) for note in notes]
