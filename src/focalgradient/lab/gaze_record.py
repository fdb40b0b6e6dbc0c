"""What is kept of a session of focus by gaze: a table of the changes of focus with their latencies, in BIDS."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from focalgradient.dataset import Files
from focalgradient.dataset.focus import ABOUT, Change, about_changes
from focalgradient.dataset.journal import create_whole, make_folder

__all__ = ["Change", "write_tables"]


def write_tables(
    files: Files, settings: Mapping[str, Any], changes: Sequence[Change], refresh_hz: float | None, frame_s: float
) -> None:
    """Write the table of the changes and its sidecar, with the latencies' median, 95 % and maximum."""
    lines = ["\t".join(ABOUT)]
    for number, change in enumerate(changes):
        after = changes[number + 1].onset - change.onset if number + 1 < len(changes) else None
        values = [change.onset, after, *change[1:]]
        lines.append("\t".join("n/a" if value is None else f"{value:.6g}" for value in values))
    content = about_changes(settings, changes, refresh_hz, frame_s)
    make_folder(files.table.parent)
    stem = files.table.name.replace("_beh.tsv", "_events")
    create_whole(files.table.with_name(f"{stem}.json"), json.dumps(content, indent=2).encode(), replace=True)
    create_whole(files.table.with_name(f"{stem}.tsv"), ("\n".join(lines) + "\n").encode(), replace=True)
