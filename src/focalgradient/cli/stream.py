"""``focalgradient stream``: depth video from a video whose frames alternate between two apertures."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from focalgradient.cli.options import (
    DIAMETER,
    GIVEN,
    NEAREST,
    OPENEST,
    focal_length_option,
    limit_options,
    options_named,
    positive,
)
from focalgradient.cli.program import (
    announce,
    force_option,
    json_option,
    nothing_valid,
    placing,
    progress,
    show,
    summary_json,
    warnings_given,
    writable,
)
from focalgradient.cli.shapes import ShapeAsked, ShapedCommand, shape_options
from focalgradient.errors import InputError
from focalgradient.files import printable, refuse_overwriting
from focalgradient.plausibility import given_as
from focalgradient.psf import Disc

if TYPE_CHECKING:
    from focalgradient.optics import Lens
    from focalgradient.video import DepthStream

__all__ = ["stream"]

MOST_NAMED = 20
"""Maximum number of skipped frames named on standard error; the JSON file beside the video lists all."""

OPTICS = {
    "focal_length": "--focal-length",
    "f_numbers": "--f-number",
    "focus_distance": "--focus-distance",
    "pixel_pitch": "--pixel-pitch",
}

NO_DEPTH = (
    "the scene has too little texture, or its blur is impossible with the stated optics and limits: check "
    "--f-number, --focus-distance, --near and --far"
)
"""Most likely cause if no frame has depth."""

SECONDS = 0.034 / (1920 * 1080)
"""Processing time in s per frame and pixel on two cores, including decoding and encoding."""


@click.command(cls=ShapedCommand, short_help="Estimate depth in a video that alternates two apertures.")
@click.argument("video", type=click.Path(path_type=Path), metavar="VIDEO")
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    metavar="DEPTH_VIDEO",
    help="Depth video to write: .mp4, .mov, .mkv, .avi or .webm.",
)
@click.option(
    "--values",
    type=click.Path(path_type=Path),
    metavar="FILE.npy",
    help="Also write the values: float32, frames x height/4 x width/4, NaN without an estimate.",
)
@focal_length_option
@click.option(
    "--f-number",
    "f_numbers",
    type=float,
    multiple=True,
    metavar="N",
    callback=positive(infinite=True, least=OPENEST, hint=DIAMETER),
    help="* f-number: give it twice, for frames 0, 2, 4, ... and for frames 1, 3, 5, ...",
)
@click.option(
    "--focus-distance",
    type=float,
    metavar="M",
    callback=positive(" of metres", infinite=True, least=NEAREST),
    help="* Distance of the plane in focus, in metres.",
)
@click.option(
    "--pixel-pitch",
    type=float,
    metavar="UM",
    callback=positive(" of micrometres"),
    help="* Pixel pitch of the video on the sensor, in micrometres.",
)
@limit_options
@shape_options("Shape of the blur.", Disc.name)
@click.option(
    "--encoding",
    type=click.Choice(["srgb", "linear"]),
    default="srgb",
    show_default=True,
    help="Encoding of light by the video's values.",
)
@click.option(
    "--window",
    type=float,
    default=8.0,
    show_default=True,
    metavar="PX",
    callback=positive(" of pixels", least=2, most=64),
    help="Standard deviation, in pixels, of the window over which detail is averaged: 2 to 64.",
)
@force_option
@json_option
def stream(
    video: Path,
    out: Path,
    values: Path | None,
    near: float | None,
    far: float | None,
    psf: ShapeAsked,
    encoding: Literal["srgb", "linear"],
    window: float,
    **optics: Any,
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
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    start = time.perf_counter()
    _check(optics, near, far)
    blur = psf.shape()
    from focalgradient.video import DepthStream, Source, luminance, radiance_levels, write_depth

    places = _places(video, out, values)
    note = places[1]
    grey = luminance(radiance_levels(encoding))
    with warnings_given() as given:
        with Source(video, grey) as source, given_as(GIVEN), options_named({"f_number": "--f-number"}):
            lenses, pixel_angle = _lenses(optics)
            settings: dict[str, Any] = {"near": near, "far": far, "psf": blur, "encoding": encoding, "window": window}
            found = DepthStream(source.frames(), lenses, pixel_angle, **settings)
        announce(SECONDS * source.declared * math.prod(found.shape), f"{source.declared} frames")
        with placing(places, note) as staged, Source(video, grey) as source, progress(source.declared) as say:
            counts = write_depth(
                found,
                source.frames(),
                staged[out],
                None if values is None else staged[values],
                fps=source.fps,
                progress=lambda _, frame: say(frame),
            )
            if not counts.depth_frames:
                causes = "; ".join(map(str, counts.skipped[:3])) or "it has fewer than two frames"
                raise InputError(f"{printable(video)} has no pair of successive frames that can be used: {causes}.")
            seconds = time.perf_counter() - start
            rate = counts.depth_frames / seconds
            summary = {
                "video": printable(video.name),
                "settings": {
                    **_stated(optics, found),
                    "near_m": near,
                    "far_m": far,
                    "psf": blur.name,
                    "psf_parameters": blur.stated(),
                    "encoding": encoding,
                    "window_px": window,
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
        *([] if lenses else [disparity]),
        f"Depth frames: {counts.depth_frames} from {counts.frames_read} frames, {rate:.1f} per second",
        f"Written: {', '.join(printable(place) for place in places)}",
    )
    nothing_valid(None if counts.frames_with_depth else NO_DEPTH, "No depth in any frame")


def _lenses(optics: Mapping[str, Any]) -> tuple[list[Lens] | None, float | None]:
    """Return the lenses of even and of odd frames, and the angle of a pixel; None if no optics are given."""
    from focalgradient.optics import Lens

    if not optics["f_numbers"]:
        return None, None
    lenses = [Lens(optics["focal_length"] * 1e-3, number, optics["focus_distance"]) for number in optics["f_numbers"]]
    return lenses, optics["pixel_pitch"] * 1e-6 / lenses[0].sensor_distance


def _stated(optics: Mapping[str, Any], found: DepthStream) -> dict[str, Any]:
    """Return the optics as given, and how the side of focus was decided, or which aperture is the smaller."""
    if found.search is None:
        return {"optics": None, "sharper": "even" if found.even_is_sharper else "odd"}
    names = ("focal_length_mm", "f_numbers", "focus_distance_m", "pixel_pitch_um")
    return {"optics": dict(zip(names, map(optics.get, OPTICS), strict=True)), "side": found.search.side_text}


def _places(video: Path, out: Path, values: Path | None) -> list[Path]:
    """Return the files to write: depth video, its JSON file, and values if requested; none may be an input."""
    from focalgradient.video import check_ending

    check_ending(out)
    note = out.with_suffix(".json")
    places = [out, note] + ([values] if values else [])
    if len({os.path.realpath(place) for place in places}) < len(places):
        raise InputError(
            f"--values and --out name the same file (--out also writes {note.name}): give them different names."
        )
    refuse_overwriting([video], places)
    if values is not None and values.suffix.lower() != ".npy":
        raise InputError(
            f"--values is {printable(values)}, but values are written as .npy: give a name that ends in .npy."
        )
    for folder in {place.parent for place in places}:
        writable(folder, [place.name for place in places if place.parent == folder], [video])
    return places


def _check(optics: Mapping[str, Any], near: float | None, far: float | None) -> None:
    """Raise `InputError` for incomplete optics, and for limits that exclude each other."""
    given = [option for name, option in OPTICS.items() if optics[name]]
    if given and len(given) < len(OPTICS):
        missing = [option for option in OPTICS.values() if option not in given]
        verbs = ["is" if len(options) == 1 else "are" for options in (missing, given)]
        raise InputError(
            f"{' and '.join(missing)} {verbs[0]} missing, but {' and '.join(given)} {verbs[1]} given: give all optics, "
            "or none."
        )
    if given and len(optics["f_numbers"]) != 2:
        count = len(optics["f_numbers"])
        times = "once" if count == 1 else f"{count} times"
        raise InputError(f"--f-number is given {times}: give it twice, for even and for odd frames.")
    if not given and (near or far):
        raise InputError("--near and --far limit distance, which needs the optics: give the options marked * too.")
    if near is not None and far is not None and near >= far:
        raise InputError(f"--near {near:g} lies beyond or at --far {far:g}: give --near the smaller distance.")
