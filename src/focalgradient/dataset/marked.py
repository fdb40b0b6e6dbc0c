"""Table of all marked events in BIDS format (``_events.tsv``), with HED tags in its sidecar.

It is derived from the journal if triggers were sent, gaze was recorded, or a browser showed the trials. Onsets are on
the clock of the session's first sitting, as are those of gaze.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from focalgradient.dataset.events import Event
from focalgradient.dataset.markers import HED_VERSION, Codes
from focalgradient.dataset.times import timed, times_of_events
from focalgradient.files.columns import cell
from focalgradient.tasks.columns import SITTING

__all__ = ["marked_files"]

COLUMNS = ("onset", "duration", "trial_type", "value", "sitting", "phase", "trial")
"""Columns before those of the condition."""


def marked_files(events: Sequence[Event], screen: Mapping[str, Any]) -> dict[str, Any]:
    """Return the event table and its sidecar, by the end of their names; empty if there is none.

    Parameters
    ----------
    events
        Events of a journal.
    screen
        The sidecar's entry ``StimulusPresentation``.

    Returns
    -------
    dict
        "events.tsv": its text; "events.json": its content.
    """
    noted = [event for event in events if event["event"] == "note" and event.get("kind") == "triggers"]
    rows = list(_rows(events, float(events[0]["design"].get("picture_s", 0.0))))
    if not (noted or rows):
        return {}
    levels = dict.fromkeys(key for row in rows for key in row if key not in COLUMNS)
    lines = ["\t".join((*COLUMNS, *levels))]
    lines += ["\t".join(cell(row.get(name)) for name in (*COLUMNS, *levels)) for row in rows]
    codes = Codes.recorded(noted[-1]) if noted else Codes()
    names = dict.fromkeys(row["trial_type"] for row in rows)
    known = {name: codes.markers[name] for name in names if name in codes.markers}
    about = {
        "StimulusPresentation": dict(screen),
        "onset": {"Description": "When it was on the screen; later sittings follow by the wall clock.", "Units": "s"},
        "duration": {"Description": "How long the design shows a picture, or a browser showed it.", "Units": "s"},
        "trial_type": {
            "Description": "Name of the event.",
            "Levels": {name: known[name].about if name in known else "An event without a code." for name in names},
            "HED": {name: marker.hed for name, marker in known.items()},
        },
        "value": {"Description": f"Code that was sent; HED tags follow schema {HED_VERSION}.", "Format": "integer"},
        "sitting": {"Description": SITTING.about},
        "phase": {
            "Description": "Of the trial; n/a outside trials.",
            "Levels": {"practice": "practice", "main": "a trial that counts"},
        },
        "trial": {"Description": "Number of the trial, as in the table of the answers; n/a outside trials."},
        **{name: {"Description": "Condition of the trial, as in the table of the answers."} for name in levels},
    }
    return {"events.tsv": "\n".join(lines) + "\n", "events.json": about}


def _rows(events: Sequence[Event], picture_s: float) -> Iterator[dict[str, Any]]:
    codes: Codes | None = None
    frames: Mapping[str, Any] = {}
    for sitting, offset, event in timed(events):
        if event["event"] == "trial" and "condition" in frames:
            yield from _shown_rows(sitting, offset + event["onset"], frames)
        if event["event"] != "note":
            continue
        frames = event if event.get("kind") == "frames" else {}
        if event.get("kind") == "triggers":
            codes = Codes.recorded(event)
        if codes is None or event.get("kind") not in ("events", "void") or "first" not in event:
            continue
        for number, (name, seconds, _) in enumerate(event["events"]):
            shown = event["condition"] if number >= event["first"] and event["trial"] is not None else {}
            yield {
                "onset": float(seconds + offset),
                "duration": picture_s if name == "picture" and picture_s else None,
                "trial_type": name,
                "value": codes.of(name, shown or None) if name in codes.markers else None,
                "sitting": sitting,
                **{key: _plain(level) for key, level in shown.items()},
            }


def _shown_rows(sitting: int, onset: float, frames: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the rows of what a browser showed in a trial, from the time stamps of its frames."""
    condition = {key: _plain(level) for key, level in frames["condition"].items()}
    for shown, (name, seconds) in zip(frames["shown"], times_of_events(onset, frames), strict=True):
        lasted = (shown["stamps"][-1] - shown["stamps"][0]) / 1e3
        yield {"onset": seconds, "duration": lasted, "trial_type": name, "sitting": sitting, **condition}


def _plain(level: Any) -> Any:
    return level if isinstance(level, str | int | float | bool) or level is None else str(level)
