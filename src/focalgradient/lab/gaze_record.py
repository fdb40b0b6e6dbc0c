"""What is kept of a session of focus by gaze: a table of the changes of focus with their latencies, in BIDS."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from focalgradient.dataset import Files
from focalgradient.dataset.journal import create_whole, make_folder

__all__ = ["Change", "write_tables"]

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


def write_tables(
    files: Files, settings: Mapping[str, Any], changes: Sequence[Change], refresh_hz: float | None, frame_s: float
) -> None:
    """Write the table of the changes and its sidecar, with the latencies' median, 95 % and maximum."""
    lines = ["\t".join(ABOUT)]
    for number, change in enumerate(changes):
        after = changes[number + 1].onset - change.onset if number + 1 < len(changes) else None
        values = [change.onset, after, *change[1:]]
        lines.append("\t".join("n/a" if value is None else f"{value:.6g}" for value in values))
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
    make_folder(files.table.parent)
    stem = files.table.name.replace("_beh.tsv", "_events")
    create_whole(files.table.with_name(f"{stem}.json"), json.dumps(content, indent=2).encode(), replace=True)
    create_whole(files.table.with_name(f"{stem}.tsv"), ("\n".join(lines) + "\n").encode(), replace=True)
