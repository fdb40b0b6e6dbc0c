"""``focalgradient calibrate``: a camera's true blur, measured from photographs of a target at known distances."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
import numpy as np

from focalgradient.cli.calibrate_scenes import calibrate_scenes
from focalgradient.cli.program import (
    announce,
    force_option,
    json_option,
    placing,
    progress,
    show,
    warnings_given,
    writable,
)
from focalgradient.cli.shapes import ShapeAsked, ShapedCommand, shape_options
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import printable, read_toml, refuse_overwriting
from focalgradient.psf import Disc

if TYPE_CHECKING:
    from focalgradient.calibration import Calibration, FieldFit, Prediction, Priors, Reading
    from focalgradient.photographs.targets import Targets, TargetShot

__all__ = ["calibrate"]

BLUR_DEVIATION = 0.05
"""Deviation of one photograph's blur from that of its repetitions above which it is reported, as a fraction."""

BLUR_TOLERANCE = 0.1
"""Tolerance between the blur derived from a depth map and that of the pair, as a fraction; beyond it the pair's is
kept: twice `BLUR_DEVIATION`.
"""

MOST_SLIPS = 3
"""Maximum number of possible input errors listed if the photographs cannot distinguish them."""

CONTRADICTION_SD = 3.0
"""Number of stated standard deviations at which predictions from a single distance contradict the one left out."""

LEAST_INFORMED = 0.5
"""Proportion of a prior's variance that the views must remove; below it a parameter is dominated by its prior."""


def _readable(_: click.Context, __: click.Parameter, given: Path | None) -> Path | None:
    """Raise `InputError` for files other than settings, such as pictures: an argument's callback."""
    if given is not None:
        read_toml(given, "a settings file that names photographs of a target")
    return given


@click.command(cls=ShapedCommand, short_help="Measure a camera's blur from a target at known distances.")
@click.argument("targets", type=click.Path(path_type=Path), metavar="TARGETS.toml", required=False, callback=_readable)
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="CAMERA.toml", help="File to write.")
@click.option(
    "--sheet",
    type=click.Choice(["A4", "A3", "letter"], case_sensitive=False),
    help="Only write a sheet to print and photograph: --out is then a PDF.",
)
@click.option(
    "--method",
    type=click.Choice(["edges", "equalise"]),
    default="edges",
    show_default=True,
    help="Method of measuring the target's blur: along its edges, or by equalising pairs of different f-number over "
    "the "
    "whole frame, as in the default method of depth, for which any texture is suitable.",
)
@shape_options("With --method equalise, shape of the blur; auto: the most likely of disc, blend and gaussian.")
@force_option
@json_option
def calibrate(
    targets: Path | None, out: Path, method: Literal["edges", "equalise"], sheet: str | None, psf: ShapeAsked
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
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    if sheet is not None:
        _write_sheet(sheet, targets, out)
        return
    if targets is None:
        raise InputError(
            "TARGETS.toml is missing: give the file that names the photographs of the target, or --sheet A4 for a "
            "sheet to print."
        )
    stated = psf.shape_or_none()
    from focalgradient.photographs import names_depth

    if names_depth(targets):
        _refuse_other_names(out)
        calibrate_scenes(targets, out, stated or Disc())
        return
    if stated is not None and method != "equalise":
        raise InputError(
            "--psf requires --method equalise, because edges are fitted with a Gaussian: add it, or leave --psf out."
        )
    from focalgradient import calibration as room
    from focalgradient.photographs import Calibrated, camera_toml, load_targets

    settings = load_targets(targets)
    read = [path for shot in settings.shots for path in (shot.image, shot.flat) if path]
    refuse_overwriting([targets, *read], [out])
    _refuse_other_names(out)
    writable(out.parent, (out.name,))
    readings: list[Reading] = []
    shots, fit, shape = settings.shots, room.calibrate, ""
    pairs = settings.pairs if method == "equalise" else []
    found: FieldFit | None = None
    with progress((2 if pairs else 1) * len(pairs or shots) + 2 + bool(pairs)) as say, warnings_given():
        if pairs:
            say("comparing shapes of blur")
            blur = stated or settings.shape(pairs)
            k = room.shape_k(blur)
            shape = f"Shape of the blur: {blur} (--psf {blur.name})"
            shots = [wide for wide, _ in pairs]
            fit = partial(_fit_pairs, f_numbers=[shot.f_number for pair in pairs for shot in pair], k=k)
        start = time.perf_counter()
        for number, shot in enumerate(shots):
            say(printable(shot.image.name))
            readings.append(settings.read_pair(pairs[number], blur) if pairs else settings.read(shot))
            if number == 0:
                announce((time.perf_counter() - start) * (len(shots) - 1), f"{len(shots) - 1} more photographs")
        sensor = settings.camera
        known = (readings, sensor.focal_length_mm * 1e-3, sensor.pixel_pitch_um * 1e-6, settings.priors)
        say("checking stated values")
        _refuse_slips(*known[:3], room.pair_priors(settings.priors, k) if pairs else settings.priors)
        camera = fit(*known)
        if pairs:
            camera = replace(camera, psf=blur)
            found = _field(settings, pairs, camera, readings, say)
            camera = replace(fit(*known), psf=blur, field=found.field)  # with the readings of the maps, where available
        say("fitting the camera")
        by_distance = room.cross_validate(*known, fit=fit)
        by_view = room.cross_validate(*known, leave="view", fit=fit)
        _warn_of_the_odd(shots, readings)
        _check_prediction(readings, by_distance, by_view, camera)
    text = camera_toml(Calibrated(sensor=sensor.only, calibration=camera))
    with placing([out], out) as hidden:
        hidden[out].write_bytes(text.encode())
    show(
        _found(camera) | {"written": printable(out)},
        *_camera_lines(camera, len({reading.distance for reading in readings})),
        "",
        *_predicted(shots, readings, camera, by_view, by_distance),
        *([shape] if shape else []),
        *([] if found is None else _field_lines(found)),
        f"Written: {printable(out)}",
    )


def _refuse_other_names(out: Path) -> None:
    """Raise `InputError` for a name without .toml: most likely a photograph, with --out forgotten."""
    if out.suffix.lower() != ".toml":
        raise InputError(
            f"--out is {printable(out)}, but a calibration's file name must end in .toml: give --out CAMERA.toml."
        )


def _write_sheet(paper: str, targets: Path | None, out: Path) -> None:
    """Write a calibration sheet as PDF."""
    if targets is not None or out.suffix.lower() != ".pdf":
        raise InputError("--sheet only writes a PDF to print: give only --sheet A4 --out sheet.pdf.")
    writable(out.parent, (out.name,), [])
    from focalgradient.plotting import calibration_sheet
    from focalgradient.plotting.figures import as_file

    content = as_file(calibration_sheet(paper), "pdf")
    with placing([out], out) as hidden:
        hidden[out].write_bytes(content)
    show({"written": printable(out)}, f"Written: {printable(out)}")


def _field(
    settings: Targets,
    pairs: Sequence[tuple[TargetShot, TargetShot]],
    camera: Calibration,
    readings: list[Reading],
    say: Callable[[str], object],
) -> FieldFit:
    """Fit focus and blur over the field to depth maps of the target; replace `readings` by similar ones of the maps."""
    from focalgradient.calibration import Field, FieldFit, disc_radius, fit_field

    places, maps, views = [], [], []
    for place, pair in enumerate(pairs):
        say(f"depth of {printable(pair[0].image.name)}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FocalGradientWarning)
            mapped = settings.map_pair(pair, camera)
        if mapped is not None:
            places.append(place)
            views.append(mapped[0])
            maps.append(mapped[1])
    if not maps:
        return FieldFit(Field(), np.zeros(0), np.zeros(0), math.nan, math.nan, math.nan)
    found = fit_field(maps, views)
    for place, centre, sd in zip(places, found.centres, found.centre_sd, strict=True):
        if math.isfinite(centre):
            wide = pairs[place][0]
            lens = camera.lens(wide.f_number, wide.focus_distance_m)
            radius = [
                float(disc_radius(camera.focal_length, lens.f_number, lens.focus_vergence, at, camera.telecentric))
                for at in (centre, lens.focus_vergence + 1)
            ]
            width = camera.k * radius[0]
            if abs(width / readings[place].width - 1) < BLUR_TOLERANCE:
                readings[place] = replace(readings[place], width=width, width_sd=camera.k * radius[1] * sd)
    return found


def _field_lines(found: FieldFit) -> list[str]:
    """Return sentences on the field, as estimated from depth maps of the target."""
    if not math.isfinite(found.left):
        return ["Field: the maps of the target are too sparse to show how focus varies over the frame."]
    uneven = any((*found.field.focus, *found.field.blur))
    order = "varies over the frame, as stated in [field]" if uneven else "is even over the frame"
    return [
        f"Field: blur {order}: left-out parts of the frame scatter by {found.left:.3f} D around it, "
        f"{found.left_without:.3f} D around a constant.",
        f"Cross-validated: {found.coverage:.1%} of the left-out pixels within two standard deviations "
        f"(model error {found.field.split_band_scale:.2f} times the split-band test's).",
    ]


def _fit_pairs(
    readings: Sequence[Reading],
    focal_length: float,
    pixel_pitch: float,
    priors: Priors,
    *,
    f_numbers: Sequence[float],
    k: float,
) -> Calibration:
    """Fit a camera to pairs, with the signature of `focalgradient.calibration.calibrate`."""
    from focalgradient.calibration import calibrate_pairs

    return calibrate_pairs(readings, f_numbers, focal_length, pixel_pitch, priors, k)


def _refuse_slips(readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors) -> None:
    """Raise `InputError` if a likely error in the stated values explains the readings much better; name the error."""
    from focalgradient.calibration import likeliest_slips

    slips = likeliest_slips(readings, focal_length, pixel_pitch, priors)
    if slips:
        likely = "; or with ".join(slip.text for slip in slips[:MOST_SLIPS])
        raise InputError(f"the photographs contradict the stated values: their blur fits better with {likely}.")


def _check_prediction(
    readings: Sequence[Reading],
    by_distance: Sequence[Prediction | None],
    by_view: Sequence[Prediction | None],
    camera: Calibration,
) -> None:
    """Raise `InputError` if left-out photographs are predicted worse than without calibration; warn if untested."""
    from focalgradient.calibration import prediction_errors

    distances = len({reading.distance for reading in readings})
    unknown = True
    for predictions in (by_distance, by_view):
        predicted, stated, by_mean = prediction_errors(readings, predictions, camera.offset)
        unknown = unknown and math.isnan(predicted)
        # A single distance determines others poorly, which the stated SD includes.
        if predicted > by_mean and (distances > 2 or predicted > CONTRADICTION_SD * stated):
            raise InputError(
                f"left-out photographs are predicted worse than without a calibration (error {predicted:.2g} D; with "
                f"the mean vergence of the others {by_mean:.2g} D), and no single input error explains it: check "
                "distance_m, f_number and focus_distance_m of each photograph, focal_length_mm and pixel_pitch_um, and "
                "that the focus was not touched."
            )
    if unknown:
        cause = (
            f"all of them ({len(readings)}) show the target at one distance: add photographs at another"
            if distances == 1
            else "without any one of them its f-number or the side of focus is unknown: add photographs at another "
            "distance, at each f-number, or give focus_distance_m"
        )
        warnings.warn(
            f"the photographs cannot show whether their distances, f-numbers and pixel pitch are right, as {cause}.",
            FocalGradientWarning,
            stacklevel=1,
        )


def _warn_of_the_odd(shots: Sequence[TargetShot], readings: Sequence[Reading]) -> None:
    """Warn of photographs whose blur differs from that of their repetitions: camera shake, or changed focus."""
    for shot, reading in zip(shots, readings, strict=True):
        kind = (reading.distance, reading.f_number, reading.focus_distance)
        alike = sorted(r.width for r in readings if (r.distance, r.f_number, r.focus_distance) == kind)
        odd = reading.width / alike[len(alike) // 2] - 1
        if len(alike) > 2 and abs(odd) > BLUR_DEVIATION:
            warnings.warn(
                f"{shot.image} is {abs(odd):.0%} {'more' if odd > 0 else 'less'} blurred than the others of its kind: "
                "check for camera shake, and leave it out.",
                FocalGradientWarning,
                stacklevel=1,
            )


def _found(camera: Calibration) -> dict[str, Any]:
    """Return the parameters for programs; units are in the names, ``sd`` is in the order of ``parameters``."""
    return {
        "k": camera.k,
        "own_blur_um2": camera.own * 1e12,
        "offset_m": camera.offset,
        "f_numbers": [{"marked": mark, "effective": value} for mark, value in camera.f_numbers.items()],
        "focus": [{"marked_m": mark, "vergence_dioptres": value} for mark, value in camera.focus.items()],
        "sd": list(camera.sd),
        "share_known_from_the_views": list(camera.informed),
        "model_error_of_blur": camera.model_error,
    }


def _camera_lines(camera: Calibration, distances: int) -> list[str]:
    """Return lines with the parameters, each with its SD and whether views or prior determine it."""
    sd, informed = camera.sd, camera.informed
    rows = [("k, sigma / disc radius", f"{camera.k:.3f}", f"{camera.k * sd[0]:.3f}", informed[0])]
    pitch = camera.pixel_pitch * 1e6
    rows.append(("own blur, px^2", f"{camera.own * 1e12 / pitch**2:.2f}", f"{sd[1] / pitch**2:.2f}", informed[1]))
    rows.append(("offset, m", f"{camera.offset:.3f}", f"{sd[2]:.3f}", informed[2]))
    for n, (mark, effective) in enumerate(camera.f_numbers.items(), 3):
        rows.append((f"f-number marked {mark:g}", f"{effective:.2f}", f"{effective * sd[n]:.2f}", informed[n]))
    for n, (focus, vergence) in enumerate(camera.focus.items(), 3 + len(camera.f_numbers)):
        name = "true focus, m as measured" + ("" if focus is None else f" (marked {focus:g})")
        error = math.sqrt(sd[2] ** 2 + sd[n] ** 2 / vergence**4 + 2 * camera.covariance[2, n] / vergence**2)
        rows.append((name, f"{1 / vergence - camera.offset:.3f}", f"{error:.3f}", informed[n]))
    lines = [f"{'':34}{'value':>9}{'sd':>8}  known from"]
    for name, value, error_text, share in rows:
        whose = "the views" if share >= LEAST_INFORMED else "dominated by the prior"
        lines.append(f"{name:34}{value:>9}{error_text:>8}  {whose} ({share:.0%})")
    if distances < 3:
        lines.append(
            f"{distances} distance{'s do' if distances > 1 else ' does'} not determine the offset: it depends on "
            "its prior and those of k and of the f-numbers. Three or more distances would determine it."
        )
    lines.append(f"Model error of the blur's width: {camera.model_error:.1%}")
    return lines


def _predicted(
    shots: Sequence[TargetShot],
    readings: Sequence[Reading],
    camera: Calibration,
    by_view: Sequence[Prediction | None],
    by_distance: Sequence[Prediction | None],
) -> list[str]:
    """Return a table of each view's distance as predicted from the others, and the RMS errors."""
    lines = [
        f"{'Predicted from the others':34}{'blur px':>8}{'true m':>8}{'without it':>20}{'without its distance':>24}"
    ]
    squares: dict[str, list[float]] = {"without it": [], "without its distance": []}
    for shot, reading, *predictions in zip(shots, readings, by_view, by_distance, strict=True):
        cells = []
        for name, prediction in zip(squares, predictions, strict=True):
            cells.append("-" if prediction is None else f"{prediction.distance:.3f} +- {prediction.distance_sd:.3f}")
            if prediction is not None:
                squares[name].append(prediction.vergence - 1 / (reading.distance + camera.offset))
        name = f"{shot.image.name} f/{reading.f_number:g}"
        width = reading.width / camera.pixel_pitch
        lines.append(f"{name:34.34}{width:>8.2f}{reading.distance:>8.3f}{cells[0]:>20}{cells[1]:>24}")
    for name, errors in squares.items():
        if errors:
            rms = math.sqrt(sum(error**2 for error in errors) / len(errors))
            lines.append(f"Root mean square error, each view predicted {name}: {rms:.3f} D")
        else:
            lines.append(f"Views predicted {name}: none, because the others do not determine it.")
    return lines
