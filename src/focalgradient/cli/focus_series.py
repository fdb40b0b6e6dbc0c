"""``focalgradient focus-series``: a picture at a series of foci, for refocusing in real time."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import click

import focalgradient as fg
from focalgradient.cli.blur import SECONDS_PER_MEGAPIXEL
from focalgradient.cli.generate import Folder, command
from focalgradient.cli.program import announce, resumable, show, warnings_given, writable
from focalgradient.cli.through_optics import DISTANCE, NAMED, LensOrEye, Read, read_picture_and_depth
from focalgradient.errors import InputError
from focalgradient.files import printable, write_whole
from focalgradient.optics import refocused
from focalgradient.plausibility import given_as
from focalgradient.quantities import METRES, POSITIVE

__all__ = ["focus_series"]

PLANES_PER_RADIUS = 4
"""Typical number of planes per pixel of blur radius: photographs have 3 to 4 with the default error."""


@command("Make a picture that can be refocused at every frame.")
def focus_series(
    picture: Path,
    depth: Path,
    /,
    *,
    out: Folder,
    optics: LensOrEye,
    nearest: Annotated[float | None, METRES] = None,
    farthest: Annotated[float | None, DISTANCE] = None,
    read: Read,
    wavelengths: Annotated[int | None, click.IntRange(3, 81), "N"] = None,
    error: Annotated[float, replace(POSITIVE, words="steps"), "STEPS"] = 3.0,
    white: Annotated[float, POSITIVE] = 1.0,
    web: bool = False,
) -> None:
    """Make a focus series of PICTURE: a program interpolates between two planes for any focus, at every frame.

    PICTURE, DEPTH, the optics and the size of a pixel are as for 'focalgradient blur'. The planes, 129 at most, are
    spaced so that the interpolated picture is within --error 8-bit steps of the picture blurred at that focus, in the
    worst pixel (a third of that in the median pixel). 'focalgradient run gaze-focus' shows the series; Python reads it
    with fg.FocusSeries.read.

    Writes DIR/series.json, with the error and the texture memory of the planes, DIR/focus-VD.npy (linear
    light in 16 bits, V in dioptres) and DIR/distance.npy. After an interruption the same command continues.

    Takes about twice as long as 'focalgradient blur' per plane; there are about four planes per pixel of blur
    radius, fewer where the picture has little detail, more where steps of depth follow each other closely.

    \b
    Example:
      focalgradient focus-series demo/picture.png demo/distance.npy --out series --pupil 4 --field 6

    Parameters
    ----------
    out
        Folder for the series.
    nearest
        Near focus, in metres.  [default: nearest distance in DEPTH]
    farthest
        Far focus, in metres, or inf.  [default: farthest distance in DEPTH]
    wavelengths
        With an eye: number of wavelength samples, each at its own focus.  [default: one focus for all]
    error
        Maximum interpolation error, in 8-bit steps.
    white
        Linear value shown at full display luminance.
    web
        Also write DIR/focus.json: the series for a web page, such as one of jsPsych.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.live.kept import MARK

    names = ["series.json", "distance.npy", "inputs.json", *(["focus.json"] if web else [])]
    writable(out, names, [picture, depth])
    click.get_current_context().with_resource(given_as(NAMED))
    if wavelengths is not None and optics.pupil is None and optics.eye_file is None:
        raise InputError("--wavelengths requires an eye: give --pupil or --eye, or leave it out.")
    with warnings_given() as early:
        shown = read_picture_and_depth(picture, depth, **read, focal_length=optics.focal_length)
    low = 1 / (farthest or float(shown.metres.max()))
    high = 1 / (nearest or float(shown.metres.min()))
    if not low <= high:
        raise InputError(
            f"--farthest is {1 / low:g} m, but must not be nearer than --nearest, {1 / high:g} m: change them."
        )
    with warnings_given() as said, resumable("finished planes are kept; the same command continues.") as say:
        # The planes lie where they are asked for; an eye that cannot focus at both ends is named.
        ends = [optics.focused(vergence) for vergence in (low, high)]
        states = optics.states(ends, [low, high])
        lens = refocused(ends[0], (low + high) / 2)
        radii = (high - low) * lens.aperture_diameter / 2 / shown.pixel_angle
        planes = min(round(PLANES_PER_RADIUS * radii), fg.live.series.MAX_INTERVALS) + 1
        seconds = 2 * planes * (wavelengths or 1) * SECONDS_PER_MEGAPIXEL * 1e-6 * shown.metres.size
        if not optics.is_lens:
            seconds *= 4
        size = planes * 4 * shown.metres.size / 2**20
        fewer = "fewer for little detail or by --nearest and --farthest, more for many steps of depth"
        announce(seconds, f"About {planes} planes, {size:.0f} MB as textures ({fewer})")
        made = fg.live.FocusSeries.of(
            shown.light / white,
            shown.metres,
            lens,
            pixel_angle=shown.pixel_angle,
            focus=(low, high),
            median_error=error / 3,
            largest_error=error,
            wavelengths=wavelengths,
            folder=out,
            progress=say,
        )
    if web:
        write_whole(out / "focus.json", json.dumps({"written_by": MARK, **fg.live.packed(made)}).encode())
    median, largest = made.error
    result = {
        "planes": len(made.planes),
        "focus_dioptre": list(made.vergences),
        "median_error_steps": median,
        "largest_error_steps": largest,
        "texture_bytes": made.texture_bytes,
        **states,
        "warnings": [*early, *said],
        "written": [printable(out / name) for name in ("series.json", "focus.json") if name in names],
    }
    show(
        result,
        *optics.notes(states),
        f"Planes: {len(made.planes)}, from {made.vergences[0]:.3g} to {made.vergences[-1]:.3g} D; "
        f"{made.texture_bytes / 2**20:.0f} MB as textures",
        f"Interpolation error: {median:.2g} 8-bit steps in the median pixel, {largest:.2g} in the worst",
        f"Written: {printable(out)}",
    )
