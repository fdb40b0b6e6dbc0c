"""``focalgradient focus-series``: a picture at a series of foci, for refocusing in real time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from focalgradient.cli.options import depth_file_options, picture_encoding_option, positive
from focalgradient.cli.program import force_option, json_option, resumable, show, warnings_given, writable
from focalgradient.cli.through_optics import (
    NAMED,
    lens_or_eye_options,
    optics_of,
    pixel_options,
    read_picture_and_depth,
)
from focalgradient.errors import InputError
from focalgradient.files import printable, refuse_overwriting, write_whole
from focalgradient.plausibility import given_as

__all__ = ["focus_series"]


@click.command("focus-series", short_help="Make a picture that can be refocused at every frame.")
@click.argument("picture", type=click.Path(path_type=Path), metavar="PICTURE")
@click.argument("depth", type=click.Path(path_type=Path), metavar="DEPTH")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the series.")
@lens_or_eye_options
@click.option(
    "--nearest",
    type=float,
    metavar="M",
    callback=positive(" of metres"),
    help="Near focus, in metres.  [default: nearest distance in DEPTH]",
)
@click.option(
    "--farthest",
    type=float,
    metavar="M",
    callback=positive(" of metres, or inf", infinite=True),
    help="Far focus, in metres, or inf.  [default: farthest distance in DEPTH]",
)
@pixel_options
@depth_file_options
@picture_encoding_option
@click.option(
    "--wavelengths",
    type=click.IntRange(3, 81),
    metavar="N",
    help="With an eye: number of wavelength samples, each at its own focus.  [default: one focus for all]",
)
@click.option(
    "--error",
    type=float,
    default=3.0,
    show_default=True,
    metavar="STEPS",
    callback=positive(" of steps"),
    help="Maximum interpolation error, in 8-bit steps.",
)
@click.option(
    "--white", type=float, default=1.0, show_default=True, callback=positive(), help="Linear value shown as white."
)
@click.option(
    "--web", is_flag=True, help="Also write DIR/focus.json: the series for a web page, such as one of jsPsych."
)
@force_option
@json_option
def focus_series(picture: Path, depth: Path, out: Path, **options: Any) -> None:
    """Make a focus series of PICTURE: a program interpolates between two planes for any focus, at every frame.

    PICTURE, DEPTH, the optics and the size of a pixel are as for 'focalgradient blur'. The planes are spaced so that
    the interpolated picture is within --error 8-bit steps of the picture blurred at that focus, in the worst pixel (a
    third of that in the median pixel). 'focalgradient run gaze-focus' shows the series; Python reads it with
    fg.FocusSeries.read.

    Writes DIR/series.json, with the error and the texture memory of the planes, DIR/focus-VD.npy (linear
    light in 16 bits, V in dioptres) and DIR/distance.npy. After an interruption the same command continues.

    Takes about twice as long as 'focalgradient blur' per plane; there are about four planes per pixel of blur radius.

    \b
    Example:
      focalgradient focus-series demo/picture.png demo/distance.npy --out series --pupil 4 --field 6
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.live import FocusSeries, packed
    from focalgradient.live.kept import MARK

    names = ["series.json", "distance.npy", "inputs.json", *(["focus.json"] if options["web"] else [])]
    writable(out, names, [picture, depth])
    refuse_overwriting([picture, depth], [out / "distance.npy"])
    click.get_current_context().with_resource(given_as(NAMED))
    if options["wavelengths"] is not None and options["pupil"] is None and options["eye_file"] is None:
        raise InputError("--wavelengths requires an eye: give --pupil or --eye, or leave it out.")
    shown = read_picture_and_depth(picture, depth, options, [])
    light, metres, angle = shown.light, shown.metres, shown.pixel_angle
    low = 1 / (options["farthest"] or float(metres.max()))
    high = 1 / (options["nearest"] or float(metres.min()))
    if not low <= high:
        raise InputError(
            f"--farthest is {1 / low:g} m, but must not be nearer than --nearest, {1 / high:g} m: change them."
        )
    optics = optics_of(options, (low + high) / 2)
    with warnings_given() as said, resumable("finished planes are kept; the same command continues.") as say:
        made = FocusSeries.of(
            light / options["white"],
            metres,
            optics,
            pixel_angle=angle,
            focus=(low, high),
            median_error=options["error"] / 3,
            largest_error=options["error"],
            wavelengths=options["wavelengths"],
            folder=out,
            progress=say,
        )
    if options["web"]:
        write_whole(out / "focus.json", json.dumps({"written_by": MARK, **packed(made)}).encode())
    median, largest = made.error
    result = {
        "planes": len(made.planes),
        "focus_dioptre": list(made.vergences),
        "median_error_steps": median,
        "largest_error_steps": largest,
        "texture_bytes": made.texture_bytes,
        "warnings": said,
        "written": [printable(out / name) for name in ("series.json", "focus.json") if name in names],
    }
    show(
        result,
        f"Planes: {len(made.planes)}, from {made.vergences[0]:.3g} to {made.vergences[-1]:.3g} D; "
        f"{made.texture_bytes / 2**20:.0f} MB as textures",
        f"Interpolation error: {median:.2g} 8-bit steps in the median pixel, {largest:.2g} in the worst",
        f"Written: {printable(out)}",
    )
