"""``focalgradient stream``: depth video from a video whose frames alternate between two apertures."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.generate import Given, command, options_named
from focalgradient.cli.groups import GIVEN
from focalgradient.cli.program import (
    announce,
    nothing_valid,
    placing,
    resumable,
    show,
    summary_json,
    warnings_given,
    writable,
)
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.optics import Lens
from focalgradient.plausibility import given_as
from focalgradient.quantities import APERTURE_RATIO, FOCUS, MICROMETRES, MILLIMETRES

__all__ = ["stream"]

MOST_NAMED = 20
"""Maximum number of skipped frames named on standard error; the JSON file beside the video lists all."""

NO_DEPTH = (
    "the scene has too little texture, or its blur is impossible with the stated optics and limits: check "
    "--f-number, --focus-distance, --near and --far"
)
"""Most likely cause if no frame has depth."""

SECONDS = 0.034 / (1920 * 1080)
"""Processing time in s per frame and pixel on two cores, including decoding and encoding."""

WORDS = {"f_number": "--f-number", "near": "--near", "far": "--far", "lenses too": "the options marked * too"}
"""Words of the library's messages, with options instead of parameters."""

Settings = Given("focalgradient.video:DepthStream", only=("near", "far", "psf", "encoding", "window"))


@command("Estimate depth in a video that alternates two apertures.")
def stream(
    video: Path,
    /,
    *,
    out: Annotated[Path, "DEPTH_VIDEO"],
    values: Annotated[Path | None, "FILE.npy"] = None,
    focal_length: Annotated[float | None, MILLIMETRES] = None,
    f_number: Annotated[tuple[float, ...], APERTURE_RATIO, "N"] = (),
    focus_distance: Annotated[float | None, FOCUS] = None,
    pixel_pitch: Annotated[float | None, MICROMETRES] = None,
    settings: Annotated[dict[str, Any], Settings],
) -> None:
    """Recover depth, frame by frame, from a video that alternates between two apertures at one focus.

    Even frames (0, 2, ...) show one aperture, odd frames the other; every two successive frames give one frame of
    depth. With the options marked * the output is distance in metres; without them it is focal disparity, 1 in
    focus and falling to 0 with blur. Frames that cannot be decoded or paired are reported and skipped.

    Writes DEPTH_VIDEO, black without an estimate, with its scale at the side; beside it a .json file of the same name
    with the settings and the skipped frames; and FILE.npy. If interrupted, it writes nothing. Exit code 1: no frame has
    depth.

    Method: the ratio of detail ('ratio' of the command depth), with errors of a few per cent. A second of video with
    1920 x 1080 pixels at 30 frames takes about 2 s on two cores.

    \b
    Example:
      focalgradient stream demo/video.mkv --out depth.mp4 --focal-length 25 --f-number 16 --f-number 5.6 \\
        --focus-distance 0.85 --pixel-pitch 8 --near 0.85

    Parameters
    ----------
    out
        Depth video to write: .mp4, .mov, .mkv, .avi or .webm.
    values
        Also write the values: float32, frames x height/4 x width/4, NaN without an estimate.
    focal_length
        * Focal length, in millimetres.
    f_number
        * f-number: give it twice, for frames 0, 2, 4, ... and for frames 1, 3, 5, ...
    focus_distance
        * Distance of the plane in focus, in metres.
    pixel_pitch
        * Pixel pitch of the video on the sensor, in micrometres.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    start = time.perf_counter()
    optics: dict[str, Any] = {
        "focal_length_mm": focal_length,
        "f_numbers": f_number,
        "focus_distance_m": focus_distance,
        "pixel_pitch_um": pixel_pitch,
    }
    _check(optics)
    settings["psf"] = settings["psf"].shape()

    places = _places(video, out, values)
    note = places[1]
    grey = fg.video.luminance(fg.video.radiance_levels(settings["encoding"]))
    with warnings_given() as given:
        with fg.video.Source(video, grey) as source, given_as(GIVEN), options_named(WORDS):
            lenses = [Lens(optics["focal_length_mm"] * 1e-3, number, optics["focus_distance_m"]) for number in f_number]
            pixel_angle = optics["pixel_pitch_um"] * 1e-6 / lenses[0].sensor_distance if lenses else None
            found = fg.video.DepthStream(source.frames(), lenses or None, pixel_angle, **settings)
        announce(SECONDS * source.declared * math.prod(found.shape), f"{source.declared} frames")
        with placing(places, note) as staged, fg.video.Source(video, grey) as source, resumable("") as say:
            numbers = None if values is None else staged[values]
            counts = fg.video.write_depth(
                *(found, source.frames(), staged[out], numbers), fps=source.fps, count=source.declared, progress=say
            )
            if not counts.depth_frames:
                causes = "; ".join(map(str, counts.skipped[:3])) or "it has fewer than two frames"
                raise InputError(f"{printable(video)} has no pair of successive frames that can be used: {causes}.")
            seconds = time.perf_counter() - start
            rate = counts.depth_frames / seconds
            sharper = "even" if found.even_is_sharper else "odd"
            summary = {
                "video": printable(video.name),
                "settings": {
                    **({"optics": optics, "side": found.search.side_text} if found.search else {}),
                    **({} if found.search else {"optics": None, "sharper": sharper}),
                    "near_m": settings["near"],
                    "far_m": settings["far"],
                    "psf": found.psf.name,
                    "psf_parameters": found.psf.stated(),
                    "encoding": settings["encoding"],
                    "window_px": settings["window"],
                },
                **found.summary(),
                **asdict(counts),
                "fps_of_video": source.fps,
                "fps_of_processing": rate,
                "seconds": seconds,
                "warnings": list(given),
            }
            staged[note].write_bytes(summary_json(summary))
    for item in counts.skipped[:MOST_NAMED]:
        click.echo(f"Skipped: {item}.", err=True)
    if len(counts.skipped) > MOST_NAMED:
        click.echo(f"Skipped: {len(counts.skipped) - MOST_NAMED} more, listed in {note}.", err=True)
    disparity = "No optics given: the output is focal disparity (1 in focus, less with blur), not distance."
    show(
        summary | {"written": [printable(place) for place in places]},
        *([] if found.search else [disparity]),
        f"Depth frames: {counts.depth_frames} from {counts.frames_read} frames, {rate:.1f} per second",
        f"Written: {', '.join(printable(place) for place in places)}",
    )
    nothing_valid(None if counts.frames_with_depth else NO_DEPTH, "No depth in any frame")


def _places(video: Path, out: Path, values: Path | None) -> list[Path]:
    """Return the files to write: depth video, its JSON file, and values if requested; none may be an input."""
    fg.video.check_ending(out)
    note = out.with_suffix(".json")
    places = [out, note] + ([values] if values else [])
    if len({os.path.realpath(place) for place in places}) < len(places):
        raise InputError(
            f"--values and --out name the same file (--out also writes {note.name}): give them different names."
        )
    if values is not None and values.suffix.lower() != ".npy":
        raise InputError(
            f"--values is {printable(values)}, but values are written as .npy: give a name that ends in .npy."
        )
    for folder in {place.parent for place in places}:
        writable(folder, [place.name for place in places if place.parent == folder], [video])
    return places


def _check(optics: Mapping[str, Any]) -> None:
    """Raise `InputError` for incomplete optics."""
    options = dict(zip(optics, ("--focal-length", "--f-number", "--focus-distance", "--pixel-pitch"), strict=True))
    given = [option for name, option in options.items() if optics[name]]
    if given and len(given) < len(options):
        missing = [option for option in options.values() if option not in given]
        verbs = ["is" if len(some) == 1 else "are" for some in (missing, given)]
        raise InputError(
            f"{' and '.join(missing)} {verbs[0]} missing, but {' and '.join(given)} {verbs[1]} given: give all optics, "
            "or none."
        )
    if given and len(optics["f_numbers"]) != 2:
        count = len(optics["f_numbers"])
        times = "once" if count == 1 else f"{count} times"
        raise InputError(f"--f-number is given {times}: give it twice, for even and for odd frames.")
