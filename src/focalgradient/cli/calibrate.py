"""``focalgradient calibrate``: a camera's true blur, measured from photographs of a target at known distances."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import click

import focalgradient as fg
from focalgradient.cli.generate import command, options_named
from focalgradient.cli.program import announce, placing, resumable, show, warnings_given, writable
from focalgradient.errors import InputError
from focalgradient.files import printable, read_toml, refuse_overwriting
from focalgradient.options.shapes import AUTO_SHAPE, ShapeAsked

__all__ = ["calibrate"]

OF_SHAPE = {"psf requires": "--psf requires", "leave psf out": "leave --psf out"}
"""Clauses of the library that name the shape, with its option."""


def _readable(_: str, given: Path) -> Path:
    """Raise `InputError` for files other than settings, such as pictures."""
    read_toml(given, "a settings file that names photographs of a target")
    return given


@command("Measure a camera's blur from a target at known distances.")
def calibrate(
    targets: Annotated[Path | None, _readable, "TARGETS.toml"] = None,
    /,
    *,
    out: Annotated[Path, "CAMERA.toml"],
    sheet: Annotated[str | None, click.Choice(["A4", "A3", "letter"], case_sensitive=False)] = None,
    method: Literal["edges", "equalise"] = "edges",
    psf: ShapeAsked = AUTO_SHAPE,
) -> None:
    """Measure a camera's blur from photographs of a target at known distances, or of scenes with depth maps.

    The target is a flat sheet that faces the camera: with sharp black and white edges (printed squares, a checkerboard,
    a slanted edge), or, with --method equalise, of any texture. Photograph it at two or more distances (three to
    determine the offset) at each f-number to be used, without touching the focus; repeated exposures show the
    repeatability.

    Writes CAMERA.toml: effective f-numbers, true focus, the offset of the plane that distances were measured from,
    the blur along edges and the camera's residual blur, with their uncertainties. The command depth reads it with
    --calibration, or through a line calibration = "CAMERA.toml" under [camera] in VIEWS.toml.

    Instead of a target, ordinary scenes can be used, each with a map of its distances from a depth camera, a phone or
    stereo, registered to the photograph: each [[view]] then names it, as depth = "depth_mm.png", instead of distance_m.
    Use two f-numbers per scene, at least ten scenes, and one focus for all. A robust fit over the scenes gives focus,
    f-numbers, offset and blur over the field; it is tested on the half of the scenes that was left out.

    Takes about 8 s per megapixel and photograph on two cores.

    \b
    Examples:
      focalgradient calibrate demo/targets.toml --out camera.toml
      focalgradient calibrate --sheet A4 --out sheet.pdf
      focalgradient calibrate TARGETS.toml --out CAMERA.toml --method equalise
      focalgradient calibrate TARGETS.toml --out CAMERA.toml --method equalise --psf polygon --blades 5
      focalgradient depth f16.jpg f10.jpg --f-number 16 --f-number 10 --calibration CAMERA.toml --out results

    \b
    TARGETS.toml:
      [camera]
      focal_length_mm = 18.0
      pixel_pitch_um = 4.7       # of the sensor, also for camera raw files
      encoding = "srgb"          # or "linear", as in VIEWS.toml
      distances_from = "sensor"  # or "lens_front" or "entrance_pupil"; omit if unknown
      focus_from = "sensor"      # the same for the focus marks, if it differs
      offset_m = 0.0             # prior: distance from the measuring plane to the entrance pupil
      offset_sd_m = 0.1          # ... and its standard deviation
      distance_sd_m = 0.005      # standard deviation of each measured distance
      f_number_tolerance = 0.07  # relative standard deviation of the marks on the lens
      [[view]]                   # one such table for each photograph
      image = "50cm_f10.jpg"     # relative to this file
      distance_m = 0.5           # of the target, as measured
      f_number = 10              # as marked
      focus_distance_m = 0.25    # as marked; may be omitted if all share one focus
      flat = "flat_f10.jpg"      # a blank, evenly lit surface, to correct vignetting; may be omitted
      # for a scene, instead of distance_m, with depth_unit = "mm" and depth_step = 1 under [camera]:
      depth = "depth_mm.png"     # distances registered to the photograph, 0 if unknown

    Parameters
    ----------
    out
        File to write.
    sheet
        Only write a sheet to print and photograph: --out is then a PDF.
    method
        Method of measuring the target's blur: along its edges, or by equalising pairs of different f-number over the
        whole frame, as in the default method of depth, for which any texture is suitable.
    psf
        With --method equalise, shape of the blur; auto: the most likely of disc, blend and gaussian.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    if sheet is not None:
        if targets is not None or out.suffix.lower() != ".pdf":
            raise InputError("--sheet only writes a PDF to print: give only --sheet A4 --out sheet.pdf.")
        writable(out.parent, (out.name,))
        from focalgradient.plotting.figures import as_file

        _write(out, as_file(fg.plotting.calibration_sheet(sheet), "pdf"), {})
        return
    if targets is None:
        raise InputError(
            "TARGETS.toml is missing: give the file that names the photographs of the target, or --sheet A4 for a "
            "sheet to print."
        )

    load = fg.photographs.load_known_scenes if fg.photographs.names_depth(targets) else fg.photographs.load_targets
    settings = load(targets)
    refuse_overwriting([targets, *settings.files], [out])
    if out.suffix.lower() != ".toml":  # most likely a photograph, with --out forgotten
        raise InputError(
            f"--out is {printable(out)}, but a calibration's file name must end in .toml: give --out CAMERA.toml."
        )
    writable(out.parent, (out.name,))
    shape, times = psf.shape_or_none(), []
    with resumable("") as say, warnings_given(), options_named(OF_SHAPE):

        def timed(share: float, words: str) -> None:
            say(share, words)
            times.append(time.perf_counter())
            first = 1 + (method == "equalise")  # the stage after which one photograph has been measured
            if isinstance(settings, fg.photographs.Targets) and len(times) == first + 1:
                others = len(settings.pairs if method == "equalise" else settings.shots) - 1
                announce((times[-1] - times[-2]) * others, f"{others} more photographs")

        found = fg.photographs.calibrate_camera(settings, method=method, psf=shape, progress=timed)
    text = fg.photographs.camera_toml(found.calibrated)
    _write(out, text.encode(), found.record(), found.summary().replace("(psf ", "(--psf "))


def _write(out: Path, content: bytes, record: Mapping[str, Any], *lines: str) -> None:
    """Write a file, and print the result."""
    with placing([out], out) as hidden:
        hidden[out].write_bytes(content)
    show({**record, "written": printable(out)}, *lines, f"Written: {printable(out)}")
