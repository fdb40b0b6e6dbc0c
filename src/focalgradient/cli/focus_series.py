"""``focalgradient focus-series``: a picture at every focus, to be re-focused live."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from focalgradient.cli.options import GIVEN, depth_file_options, picture_encoding_option, positive
from focalgradient.cli.program import force_option, json_option, resumable, show, warnings_given, writable
from focalgradient.cli.through_optics import (
    lens_or_eye_options,
    optics_of,
    pixel_options,
    read_picture_and_depth,
)
from focalgradient.errors import InputError
from focalgradient.files import printable, refuse_overwriting, write_whole
from focalgradient.plausibility import given_as

__all__ = ["focus_series"]


@click.command("focus-series", short_help="Make a picture that can be focused anew at every frame.")
@click.argument("picture", type=click.Path(path_type=Path), metavar="PICTURE")
@click.argument("depth", type=click.Path(path_type=Path), metavar="DEPTH")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the series.")
@lens_or_eye_options
@click.option(
    "--nearest", type=float, metavar="M", callback=positive(" of metres"), help="Nearest focus.  [default: of DEPTH]"
)
@click.option(
    "--farthest",
    type=float,
    metavar="M",
    callback=positive(" of metres, or inf", infinite=True),
    help="Farthest focus, in metres, or inf.  [default: of DEPTH]",
)
@pixel_options
@depth_file_options
@picture_encoding_option
@click.option(
    "--wavelengths",
    type=click.IntRange(3, 81),
    metavar="N",
    help="With an eye: parts of a display's light, each in its own focus.  [default: all alike]",
)
@click.option(
    "--error",
    type=float,
    default=3.0,
    show_default=True,
    metavar="STEPS",
    callback=positive(" of steps"),
    help="Largest error of mixing, in steps of 8 bits.",
)
@click.option("--white", type=float, default=1.0, show_default=True, callback=positive(), help="Light shown as white.")
@click.option("--web", is_flag=True, help="Write DIR/focus.json, too: the series for a page, as of jsPsych.")
@force_option
@json_option
def focus_series(picture: Path, depth: Path, out: Path, **options: Any) -> None:
    """Make the planes of focus of PICTURE, of which a program mixes two for any focus between, frame by frame.

    PICTURE, DEPTH, the optics and the size of a pixel are as for 'focalgradient blur'. Planes are chosen so that the
    mixture is within --error steps of 8 bits of the picture blurred at that focus, in the worst pixel (a third of that
    in the median one). 'focalgradient run gaze-focus' shows the series; Python reads it with fg.FocusSeries.read.

    It writes DIR/series.json, with the error and the memory that the planes take as textures, DIR/focus-VD.npy (linear
    light in 16 bits, V in dioptres) and DIR/distance.npy. The same command goes on where it was cut off.

    Takes about twice 'focalgradient blur' for each plane, of which there are some four to a pixel of blur radius.

    \b
    Example:
      focalgradient focus-series demo/picture.png demo/distance.npy --out series --pupil 4 --field 6
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.live import FocusSeries, packed
    from focalgradient.live.kept import MARK

    names = ["series.json", "distance.npy", "inputs.json", *(["focus.json"] if options["web"] else [])]
    writable(out, names, [picture, depth])
    refuse_overwriting([picture, depth], [out / "distance.npy"])
    click.get_current_context().with_resource(given_as({**GIVEN, "field": ("--field", "")}))
    if options["wavelengths"] is not None and options["pupil"] is None and options["eye_file"] is None:
        raise InputError("--wavelengths is for an eye: give --pupil or --eye, or leave it out.")
    light, metres, angle = read_picture_and_depth(picture, depth, options, [])
    low = 1 / (options["farthest"] or float(metres.max()))
    high = 1 / (options["nearest"] or float(metres.min()))
    if not low <= high:
        raise InputError(
            f"--farthest is {1 / low:g} m but --nearest {1 / high:g} m, and must not be the nearer: change them."
        )
    optics = optics_of(options, (low + high) / 2)
    with warnings_given() as said, resumable("what was finished is there; the same command goes on.") as say:
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
        f"Error of mixing: {median:.2g} steps of 8 bits in the median pixel, {largest:.2g} in the worst",
        f"Written: {printable(out)}",
    )
