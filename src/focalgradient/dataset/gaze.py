"""Gaze: fixation detection, distance from the fixated object, and BIDS files of both.

A session's samples are in its journal, in a note of kind "gaze" after each trial. The files ``_recording-eye1_physio``
(samples), ``_recording-eye1_physioevents`` (fixations) and ``_events`` (display times of the pictures, and the screen)
are derived from it; their columns are those of BIDS 1.11 (BEP020).
"""

from __future__ import annotations

import gzip
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from statistics import median
from typing import Any, NamedTuple

from focalgradient.dataset.events import Event
from focalgradient.dataset.marked import marked_files
from focalgradient.dataset.times import timed
from focalgradient.tasks.columns import SITTING as SITTING_COLUMN

__all__ = [
    "DISPERSION_DEG",
    "FOUND",
    "Fixation",
    "Recording",
    "Sample",
    "Shown",
    "away",
    "fixations",
    "gaze_files",
    "recording_files",
]

DISPERSION_DEG = 1.0
"""Maximum dispersion of a fixation, width + height in degrees (I-DT, Salvucci & Goldberg 2000: 0.5 to 1 degree)."""

SHORTEST_S = 0.1
"""Minimum duration of a fixation in s (Salvucci & Goldberg 2000: 0.1 to 0.2 s)."""

FOUND = 0.5
"""Minimum fraction of samples with a gaze position while a picture is shown; below it the trial is uninformative."""

LEAST_RATE = 20.0
"""Sampling rate in Hz below which a recording counts as interrupted."""

RECORDING = "recording-eye1"


class Sample(NamedTuple):
    """Gaze sample.

    `time` in s; `x`, `y` in pixels from the screen's upper left corner, None if no eye was found; `pupil` in the
    tracker's units, None if not measured.
    """

    time: float
    x: float | None
    y: float | None
    pupil: float | None = None


class Fixation(NamedTuple):
    """Fixation: onset and duration in s, and mean position in pixels, as in `Sample`."""

    onset: float
    duration: float
    x: float
    y: float


def fixations(samples: Iterable[Sample], pixels_per_degree: float) -> list[Fixation]:
    """Detect fixations by dispersion (I-DT, Salvucci & Goldberg 2000).

    A fixation is a run of samples of at least 0.1 s whose width and height add up to at most 1 degree. A sample without
    a gaze position, or a gap in the recording, ends it.

    Parameters
    ----------
    samples
        Samples in order of time.
    pixels_per_degree
        Resolution of the screen, in pixels per degree.

    Examples
    --------
    >>> still = [Sample(number / 100, 400.0, 300.0) for number in range(30)]
    >>> moved = [Sample(0.3 + number / 100, 500.0, 300.0) for number in range(30)]
    >>> [(found.onset, round(found.duration, 2), found.x) for found in fixations([*still, *moved], 40)]
    [(0.0, 0.29, 400.0), (0.3, 0.29, 500.0)]
    """
    found: list[Fixation] = []
    run: list[tuple[float, float, float]] = []
    most = DISPERSION_DEG * pixels_per_degree
    low_x = high_x = low_y = high_y = 0.0

    def end() -> None:
        if run and run[-1][0] - run[0][0] >= SHORTEST_S - 1e-9:
            times, xs, ys = zip(*run, strict=True)
            found.append(Fixation(times[0], times[-1] - times[0], sum(xs) / len(xs), sum(ys) / len(ys)))
            run.clear()

    for time, x, y, _ in samples:
        if x is None or y is None or (run and time - run[-1][0] > 1 / LEAST_RATE):
            end()
            run.clear()
        if x is None or y is None:
            continue
        while run:
            low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
            if high_x - low_x + high_y - low_y <= most:
                break
            end()
            run = run[1:]
            if run:
                _, xs, ys = zip(*run, strict=True)
                low_x, high_x, low_y, high_y = min(xs), max(xs), min(ys), max(ys)
        if not run:
            low_x = high_x = x
            low_y = high_y = y
        run.append((time, x, y))
    end()
    return found


class Shown(NamedTuple):
    """Display of a picture: start and end in s, and position of its object to be fixated in pixels, as in `Sample`."""

    start: float
    end: float
    x: float
    y: float


def away(samples: Sequence[Sample], shown: Iterable[Shown], pixels_per_degree: float) -> float | None:
    """Return the largest distance in degrees of a fixation from the object to be fixated, while pictures were shown.

    Returns None if fewer than half of the samples have a gaze position, or there was no fixation.

    Examples
    --------
    >>> samples = [Sample(number / 100, 480.0, 300.0) for number in range(100)]
    >>> away(samples, [Shown(0.0, 1.0, 400.0, 300.0)], 40)
    2.0
    """
    farthest: float | None = None
    for start, end, x, y in shown:
        own = [sample for sample in samples if start <= sample.time <= end]
        if sum(sample.x is not None for sample in own) < FOUND * max(len(own), 1):
            return None
        for one in fixations(own, pixels_per_degree):
            farthest = max(farthest or 0.0, math.hypot(one.x - x, one.y - y) / pixels_per_degree)
    return farthest


class Recording(NamedTuple):
    """Samples of a trial; `offset` (s) converts their times to the clock of the session's first sitting."""

    sitting: int
    trial: int
    offset: float
    pixels_per_degree: float
    samples: Sequence[Sample]


def _recordings(events: Sequence[Event]) -> Iterator[Recording]:
    """Yield the recordings in a journal, in order."""
    device = math.nan
    for sitting, offset, event in timed(events):
        if event["event"] == "note" and event.get("kind") == "eye tracker":
            device = event["pixels_per_degree"]
        elif event["event"] == "note" and event.get("kind") == "gaze":
            number = event["trial"] if event["phase"] == "main" else 0
            samples = [Sample(*one) for one in event["samples"]]
            yield Recording(sitting, number, offset, device, samples)


def gaze_files(events: Sequence[Event], screen: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the gaze and event files derived from a session's events, by the end of their names.

    Samples and fixations are included if gaze was recorded, the table of all events if gaze or triggers were recorded;
    journals without a note of every event give a table of pictures. `screen` is the sidecar's entry
    ``StimulusPresentation``.
    """
    marked = marked_files(events, screen)
    found = {"events.tsv": marked["events.tsv"].encode(), "events.json": _json(marked["events.json"])} if marked else {}
    device = next((event for event in events if event.get("kind") == "eye tracker"), None)
    if device is None:
        return found
    return recording_files(list(_recordings(events)), device) | (found or _shown_files(events, screen))


def _shown_files(events: Sequence[Event], screen: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the table of pictures shown, on the timeline of the samples, and its sidecar."""
    seconds = float(events[0]["design"].get("picture_s", 0.0))
    lines = ["onset\tduration\ttrial_type\tsitting\ttrial"]
    for sitting, offset, event in timed(events):
        if event["event"] == "trial":
            number = event["trial"] if event["phase"] == "main" else 0
            row = (event["onset"] + offset, seconds, "picture", sitting, number)
            lines.append("\t".join(map(_cell, row)))
    about = {
        "StimulusPresentation": dict(screen),
        "onset": {"Description": "When the (first) picture appeared.", "Units": "s"},
        "duration": {"Description": "How long the design shows a picture.", "Units": "s"},
        "trial_type": {"Description": "What it is.", "Levels": {"picture": "The picture of a trial."}},
        "sitting": SITTING,
        "trial": TRIAL,
    }
    return {"events.tsv": ("\n".join(lines) + "\n").encode(), "events.json": _json(about)}


def recording_files(recordings: Sequence[Recording], device: Mapping[str, Any]) -> dict[str, bytes]:
    """Return samples and fixations as compressed BIDS tables without headers, each with its sidecar."""
    rows = _sample_rows(recordings)
    found = [
        (each.onset + one.offset, each.duration, "fixation", each.x, each.y, one.sitting, one.trial)
        for one in recordings
        for each in fixations(one.samples, one.pixels_per_degree)
    ]
    return {
        f"{RECORDING}_physio.tsv.gz": _packed(rows),
        f"{RECORDING}_physio.json": _json(_about_samples([row[0] for row in rows], device)),
        f"{RECORDING}_physioevents.tsv.gz": _packed(found),
        f"{RECORDING}_physioevents.json": _json(_about_fixations()),
    }


def _sample_rows(
    recordings: Sequence[Recording],
) -> list[tuple[float, float | None, float | None, float | None, int, int]]:
    rows, last = [], -math.inf
    for one in recordings:
        for sample in one.samples:
            time = round(sample.time + one.offset, 6)
            if time > last:  # times must increase even if the clock was set back between two sittings
                rows.append((time, sample.x, sample.y, sample.pupil, one.sitting, one.trial))
                last = time
    return rows


def _about_samples(times: Sequence[float], device: Mapping[str, Any]) -> dict[str, Any]:
    steps = [later - sooner for sooner, later in pairwise(times)]
    return {
        "PhysioType": "eyetrack",
        "SamplingFrequency": round(1 / median(steps), 3) if steps else float(device.get("sampling_rate") or 0),
        "StartTime": times[0] if times else 0.0,
        "Columns": ["timestamp", "x_coordinate", "y_coordinate", "pupil_size", "sitting", "trial"],
        "RecordedEye": device.get("eye", "cyclopean"),
        "SampleCoordinateSystem": "gaze-on-screen",
        "SampleCoordinateUnits": "pixel",
        "RecordingType": "epoched",
        "ManufacturersModelName": device["name"],
        "SoftwareVersions": device.get("software", "unknown"),
        "CalibrationCount": int(device.get("calibrated", False)),
        "PixelsPerDegree": device["pixels_per_degree"],
        "timestamp": {
            "Description": "On the clock of the session's first sitting; later sittings follow by the wall clock.",
            "Units": "s",
        },
        **_about_coordinates(),
        "pupil_size": {
            "Description": "As the eye tracker gives it: area or diameter, in its own unit.",
            "Units": "arbitrary",
        },
        "sitting": SITTING,
        "trial": TRIAL,
    }


def _about_fixations() -> dict[str, Any]:
    return {
        "Description": "Fixations, found in the samples by their dispersion (I-DT, Salvucci & Goldberg 2000: "
        f"width + height up to {DISPERSION_DEG:g} degree, {SHORTEST_S:g} s or longer).",
        "OnsetSource": "timestamp",
        "Columns": ["onset", "duration", "trial_type", "x_coordinate", "y_coordinate", "sitting", "trial"],
        "onset": {"Description": "When it began.", "Units": "s"},
        "duration": {"Description": "How long it lasted.", "Units": "s"},
        "trial_type": {"Description": "What it is.", "Levels": {"fixation": "The gaze stayed at one place."}},
        **_about_coordinates(),
        "sitting": SITTING,
        "trial": TRIAL,
    }


def _about_coordinates() -> dict[str, dict[str, str]]:
    return {
        name: {"LongName": f"Gaze position ({axis})", "Description": about, "Units": "pixel"}
        for name, axis, about in (
            ("x_coordinate", "x", "From the screen's left edge to the right."),
            ("y_coordinate", "y", "From the screen's upper edge down."),
        )
    }


SITTING = {"Description": SITTING_COLUMN.about}
TRIAL = {"Description": "Number of the trial, as in the table of the answers; 0 in practice."}


def _packed(rows: Iterable[Sequence[Any]]) -> bytes:
    lines = "".join("\t".join(map(_cell, row)) + "\n" for row in rows)
    return gzip.compress(lines.encode(), mtime=0)  # equal samples give equal bytes


def _cell(value: Any) -> str:
    if value is None:
        return "n/a"
    return f"{value:.6f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def _json(content: Mapping[str, Any]) -> bytes:
    return (json.dumps(content, indent=2) + "\n").encode()
