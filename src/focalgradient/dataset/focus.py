"""Sessions of gaze-contingent focus: files derived from their journal, and their validation.

Derived files are the table of focus changes, and the gaze samples and fixations in BIDS format.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from focalgradient.dataset.alike import differences
from focalgradient.dataset.bids import Files, add_participant, json_text, screen_of, source_files
from focalgradient.dataset.gaze import Recording, Sample, recording_files
from focalgradient.dataset.journal import Log, create_whole, read_journal, scan_journal, writing
from focalgradient.errors import InputError

__all__ = ["ABOUT", "Change", "about_changes", "export_focus", "focus_files", "focus_journals", "wrong_focus"]

ENDS = "_task-gazefocus_events"

REPAIR = "use 'focalgradient repair'."

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
    """Change of focus; its fields are described in the table's sidecar."""

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
    """Return the sidecar of the table of focus changes."""
    # The first focus replaces no earlier one, and so has no latency.
    milliseconds = np.array([change.latency_ms for change in changes[1:]])
    content: dict[str, Any] = {"TaskName": "gazefocus", **ABOUT, "Settings": settings}
    content["RefreshRate"] = refresh_hz
    content["FramePacing"] = "by the screen" if refresh_hz else _paced(frame_s)
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


def _paced(frame_s: float) -> str:
    return f"by the clock, {1 / frame_s:g} Hz: not for timing" if math.isfinite(frame_s) else "unknown"


def focus_journals(root: Path) -> list[Path]:
    """Return the journals of gaze-contingent focus sessions, in order of name."""
    return source_files(root, f"sub-*{ENDS}.jsonl")


def focus_files(log: Log) -> dict[Path, bytes]:
    """Return the files derived from a session's journal, by path: tables, samples, and their sidecars."""
    files = Files(_root_of(log.path), log.head["task"], log.head["participant"], log.head.get("session"))
    changes = _changes(log)
    settings = {key: value for key, value in log.head.items() if key not in ("event", "chain")}
    tracker = _tracker(log)
    frame_s = float(tracker.get("frame_s", math.nan))
    about = about_changes(settings, changes, tracker.get("refresh_hz"), frame_s) | _presented(tracker)
    made = {"events.tsv": _table(changes), "events.json": json.dumps(about, indent=2).encode()}
    return {files.beside(end): content for end, content in (made | _samples(log, tracker)).items()}


def export_focus(path: Path) -> list[Path]:
    """Write the files derived from a session's journal, and its row in the table of participants.

    Raises
    ------
    InputError
        If the journal is damaged, or a file cannot be written.
    """
    log, root = read_journal(path), _root_of(path)
    made = focus_files(log)
    with writing(root):
        add_participant(root, log.head["participant"], {"kind": "human"})
        for place, content in made.items():
            create_whole(place, content, replace=True)
    return list(made)


def _root_of(path: Path) -> Path:
    folders = (*path.parents, *path.absolute().parents)
    return next(folder.parent for folder in folders if folder.name == "sourcedata")


def _tracker(log: Log) -> dict[str, Any]:
    """Return the journal's metadata of gaze and screen; of a session that ended before them, what its head says."""
    noted = (note for note in log.of("note") if note.get("kind") == "eye tracker")
    return next(noted, {"name": log.head.get("gaze", "unknown"), "pixels_per_degree": None})


def _presented(tracker: Mapping[str, Any]) -> dict[str, Any]:
    """Return the screen on which the samples are defined, in BIDS format, if it was noted."""
    if "window_px" not in tracker:
        return {}
    return {"StimulusPresentation": screen_of({**tracker, "screen_px": tracker["window_px"]})}


def _table(changes: Sequence[Change]) -> bytes:
    lines = ["\t".join(ABOUT)]
    for number, change in enumerate(changes):
        after = changes[number + 1].onset - change.onset if number + 1 < len(changes) else None
        values = [change.onset, after, *change[1:]]
        lines.append("\t".join("n/a" if value is None else f"{value:.6g}" for value in values))
    return ("\n".join(lines) + "\n").encode()


def _corner(tracker: Mapping[str, Any]) -> tuple[float, float]:
    """Return the picture's upper left corner on the screen (px), with the half-pixel offset of odd differences."""
    window, picture = tracker.get("window_px"), tracker.get("picture_px")
    if window is None or picture is None:
        return 0.0, 0.0
    wide, high = (whole - side for whole, side in zip(window, picture, strict=True))
    return wide / 2 + wide % 2 / 2, high / 2 - high % 2 / 2


def _samples(log: Log, tracker: Mapping[str, Any]) -> dict[str, bytes]:
    """Return files of samples and fixations, in screen pixels."""
    left, top = _corner(tracker)
    found = [sample for note in log.of("note") if note.get("kind") == "gaze" for sample in note["samples"]]
    samples = [Sample(time, x + left, y + top) for time, x, y in found]
    degree = tracker["pixels_per_degree"]
    made = recording_files([Recording(1, 0, 0.0, math.nan if degree is None else degree, samples)], tracker)
    sidecar = next(name for name in made if name.endswith("_physio.json"))
    about = json.loads(made[sidecar]) | {"RecordingType": "continuous"}
    return made | {sidecar: json_text(about).encode()}


def wrong_focus(root: Path, path: Path) -> Iterator[str]:
    """Yield a sentence for each problem of a gaze-contingent focus session."""
    try:
        log = scan_journal(path)
    except InputError as error:
        yield str(error)
        return
    yield from (*log.damaged, *log.changed)
    table = root / path.relative_to(root / "sourcedata").with_suffix(".tsv")
    if not table.exists():
        yield f"{table} is missing, although its journal exists, because the session crashed: {REPAIR}"
        return
    for place, content in focus_files(log).items() if not log.damaged else ():
        if not place.exists():
            yield f"{place} is missing, but its journal contains the data: {REPAIR}"
            continue
        try:
            yield from (f"{place}: {each}" for each in differences(place, content, remedy=REPAIR))
        except InputError as error:
            yield str(error)


def _changes(log: Log) -> list[Change]:
    notes = [note for note in log.of("note") if note.get("kind") == "focus" and "latency_ms" in note]
    return [Change(*(note[name] for name in Change._fields)) for note in notes]
