"""Camera settings from EXIF metadata, completed by given values."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypedDict

from PIL import ExifTags, Image

from focalgradient.errors import InputError, check_tolerance, warn
from focalgradient.photographs.cameras import Calibrated
from focalgradient.photographs.encodings import Encoding, of_header
from focalgradient.photographs.images import read_image_bytes
from focalgradient.photographs.planes import Plane
from focalgradient.photographs.raw import is_raw
from focalgradient.photographs.settings import Settings
from focalgradient.photographs.tables import Sensor
from focalgradient.plausibility import named
from focalgradient.quantities import APERTURE_RATIO, BODY, FOCUS, MICROMETRES, MILLIMETRES
from focalgradient.tables import check_table

__all__ = ["GivenOptics", "from_exif"]

_MILLIMETRES = {2: 25.4, 3: 10.0, 4: 1.0, 5: 1e-3}
"""FocalPlaneResolutionUnit in mm: inch, centimetre, and, in common use, millimetre and micrometre."""


class GivenOptics(TypedDict, total=False):
    """Optics of photographs as a user gives them: parameters of `from_exif`, which take precedence over EXIF."""

    focal_length_mm: float | None
    f_numbers: Sequence[float]
    focus_distances_m: Sequence[float]
    pixel_pitch_um: float | None
    encoding: Encoding | None
    telecentric: bool
    distances_from: Plane | None
    focus_from: Plane | None
    focus_tolerance: float | None
    f_number_tolerance: float | None
    field_tolerance: float | None
    sensor_to_pupil_mm: float | None
    sensor_to_front_mm: float | None


@dataclass(frozen=True, slots=True)
class _Recorded:
    """EXIF metadata of one file; None for missing values."""

    focal_length_mm: float | None
    f_number: float | None
    focus_distance_m: float | None
    pixel_pitch_um: float | None
    by_equivalent: bool = False  # whether the pitch is derived from the 35-mm equivalent


def from_exif(
    paths: Sequence[str | os.PathLike[str]],
    *,
    focal_length_mm: Annotated[float | None, MILLIMETRES] = None,
    f_numbers: Annotated[Sequence[float], APERTURE_RATIO, "N"] = (),
    focus_distances_m: Annotated[Sequence[float], FOCUS] = (),
    pixel_pitch_um: Annotated[float | None, MICROMETRES] = None,
    encoding: Encoding | None = None,
    telecentric: bool = False,
    distances_from: Plane | None = None,
    focus_from: Plane | None = None,
    focus_tolerance: Annotated[float | None, check_tolerance, "SHARE"] = None,
    f_number_tolerance: Annotated[float | None, check_tolerance, "SHARE"] = None,
    field_tolerance: Annotated[float | None, check_tolerance, "SHARE"] = None,
    sensor_to_pupil_mm: Annotated[float | None, BODY] = None,
    sensor_to_front_mm: Annotated[float | None, BODY] = None,
    calibrated: Calibrated | None = None,
    least: int = 2,
    order_only: bool = False,
) -> Settings:
    """Return settings for photographs of one scene from their EXIF metadata; given values take precedence.

    Parameters
    ----------
    paths
        Image files.
    least
        Minimum number of files.
    order_only
        Whether, if no focus distance is known, the photographs are taken as a focus stack, in order and evenly spaced
        in vergence from 1 to 2 (`Settings.relative`): depth is then a position in the stack, and missing optics do not
        matter.
    focal_length_mm
        Focal length, in millimetres.
    f_numbers
        f-number: once for all photographs, or once for each, in order.
    focus_distances_m
        Distance of the plane in focus, in metres: once for all photographs, or once for each, in order.
    pixel_pitch_um
        Pixel pitch, in micrometres.
    encoding
        Encoding of light by pixel values.  [default: as stated in the files; else srgb for 8 bits, linear for more]
    telecentric
        Magnification does not change with focus (image side).
    distances_from
        Plane from which distances are measured.  [default: entrance_pupil, or as calibrated]
    focus_from
        Plane from which focus distances are measured: the sensor for a lens's scale.  [default: as distances_from]
    sensor_to_pupil_mm
        Distance from the sensor to the entrance pupil, in millimetres.  [default: that of a thin lens]
    sensor_to_front_mm
        Distance from the sensor to the front of the lens, in millimetres.
    focus_tolerance
        Relative standard deviation of the focus distances; it increases the error common to the whole frame.
        [default: 0.1]
    f_number_tolerance
        Relative standard deviation of a common factor of all f-numbers.  [default: 0.05]
    field_tolerance
        Standard deviation of curvature and tilt of the surface in focus at the corner of the frame, on the sensor's
        side, as a fraction of the focal length; 0 for a flat field.  [default: 0.003]
    calibrated
        Calibration of the camera: it provides the sensor, and the focus if there is only one; f-numbers are then marks
        on the lens.

    By default, focal length and pixel pitch come from EXIF: the pitch from FocalPlaneXResolution, scaled if the image
    was resized; otherwise, with a warning, from the 35-mm equivalent of the focal length, which is rounded to a
    millimetre.

    Raises
    ------
    If a value is missing from both EXIF and arguments (the message names the parameters), the files disagree on focal
    length or pixel pitch, fewer than `least` files are given, or the calibration does not apply to them.
    """
    given = dict(locals())
    files = [Path(path) for path in paths]
    if len(files) < least:
        raise InputError(
            f"the number of photographs is {len(files)}, but depth needs {least} or more of one scene: add more."
        )
    once = 1 in (len(f_numbers), len(focus_distances_m))
    f_numbers = _one_per_file(files, "f_numbers", f_numbers)
    focus_distances_m = _one_per_file(files, "focus_distances_m", focus_distances_m)
    camera: dict[str, Any] = {name: given[name] for name in Sensor.model_fields}
    tolerances = {name: given[name] for name in ("focus_tolerance", "f_number_tolerance", "field_tolerance")}
    recorded = [_recorded(file) for file in files]
    if calibrated is not None:
        camera = _completed_by_calibration(camera, calibrated, files[0], recorded[0])
        if not focus_distances_m and calibrated.focus is not None:
            focus_distances_m = [calibrated.focus] * len(files)
    placeholders: list[str] = []
    if order_only and not focus_distances_m and all(one.focus_distance_m is None for one in recorded):
        # Values that do not affect sharpness. The effect of focus on magnification is unknown.
        placeholders = ["focus_distances_m", *([] if telecentric else ["telecentric"])]
        focus_distances_m = [1 / (1 + n / max(1, len(files) - 1)) for n in range(len(files))]
        first = recorded[0]
        camera["telecentric"] = True
        for name, value in (("focal_length_mm", 50.0), ("pixel_pitch_um", 5.0)):
            camera[name] = camera[name] or getattr(first, name)
            if camera[name] is None:
                camera[name] = value
                placeholders.append(name)
        if not f_numbers:
            f_numbers = [one.f_number or first.f_number or 4.0 for one in recorded]
            placeholders += ["f_numbers"] * any(one.f_number is None for one in recorded)
    if pixel_pitch_um is None and camera["pixel_pitch_um"] is None and any(one.by_equivalent for one in recorded):
        warn(
            f"EXIF gives no pixel size: {recorded[0].pixel_pitch_um:.3g} um is derived from the 35-mm equivalent of "
            "the focal length, accurate to a few per cent if the picture was not cropped; give "
            f"{named('pixel_pitch_um')} if it is known."
        )
    camera, views = _completed_by_exif(files, recorded, camera, f_numbers, focus_distances_m)
    if once and least > 1 and len({(view["f_number"], view["focus_distance_m"]) for view in views}) == 1:
        one, count = views[0], "both" if len(views) == 2 else f"all {len(views)}"
        raise InputError(
            f"{count} photographs have an f-number of {one['f_number']:g} and are focused at "
            f"{one['focus_distance_m']:g} m, so that their blur is the same and gives no depth: give f_numbers or "
            "focus_distances_m once for each photograph."
        )
    settings = check_table(
        "the optics given",
        {
            "camera": camera | {name: value for name, value in tolerances.items() if value is not None},
            "view": views,
            "placeholders": tuple(placeholders),
            "calibration": calibrated and calibrated.calibration,
            "calibrated_plane": calibrated and calibrated.sensor.distances_from,
        },
        Settings,
    )
    settings.lenses()  # rejects implausible lenses
    return settings


def _one_per_file(files: Sequence[Path], name: str, given: Sequence[float]) -> Sequence[float]:
    """Return a list with one value per file from values given per file or once; or an empty list.

    Raises
    ------
    InputError
        If the number of values is another.
    """
    if len(given) not in (0, 1, len(files)):
        raise InputError(
            f"{name} was given {len(given)} times: give it once for all photographs, or once for each of the "
            f"{len(files)}, in order."
        )
    return list(given) * (len(files) if len(given) == 1 else 1)


def _completed_by_calibration(
    camera: Mapping[str, Any], calibrated: Calibrated, file: Path, recorded: _Recorded
) -> dict[str, Any]:
    """Return the given camera values, completed by its calibration.

    Raises
    ------
    InputError
        If the focal length, as given or as recorded in the first file, is another than the calibration's.
    """
    sensor, stated = calibrated.sensor, camera["focal_length_mm"]
    taken = stated or recorded.focal_length_mm
    if taken and abs(taken / sensor.focal_length_mm - 1) > 0.01:
        given = "the focal length is given as" if stated else f"{file.name} was taken at"
        remedy = ", or leave out focal_length_mm" if stated else ""
        raise InputError(
            f"{given} {taken:g} mm, but the camera was calibrated at {sensor.focal_length_mm:g} mm: calibrate it at "
            f"this zoom{remedy}."
        )
    known = {name: given or getattr(sensor, name) for name, given in camera.items() if name != "pixel_pitch_um"}
    pitch, exif_pitch = camera["pixel_pitch_um"], recorded.pixel_pitch_um or sensor.pixel_pitch_um
    if pitch is None and abs(exif_pitch / sensor.pixel_pitch_um - 1) < 0.05:  # otherwise the image was resized
        pitch = sensor.pixel_pitch_um
    return known | {"pixel_pitch_um": pitch}


def _completed_by_exif(
    files: Sequence[Path],
    recorded: Sequence[_Recorded],
    camera: Mapping[str, Any],
    f_numbers: Sequence[float],
    focus_distances_m: Sequence[float],
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the tables of the camera and its views, completed by EXIF.

    Raises
    ------
    InputError
        If values are missing (all are named), or the files disagree on common values.
    """
    lacking: list[tuple[str, str]] = []  # description, and name of the parameter

    def each(values: Sequence[float | None], what: str, parameter: str) -> list[float]:
        names = [file.name for file, value in zip(files, values, strict=True) if value is None]
        if names:
            lacking.append((what + (f" (of {', '.join(names)})" if len(names) < len(files) else ""), parameter))
        return [math.nan if value is None else value for value in values]

    def shared(name: str, what: str) -> float:
        given = camera[name]
        found = each([getattr(one, name) for one in recorded] if given is None else [given] * len(files), what, name)
        for file, value in zip(files, found, strict=True):
            if abs(value - found[0]) > 1e-3 * found[0]:
                raise InputError(
                    f"EXIF gives a {what} of {found[0]:g} for {files[0].name} but {value:g} for {file.name}: "
                    f"views must be taken with one camera at one zoom, or give {name}."
                )
        return found[0]

    once_each = "(once for all photographs, or for each, in order)"
    focal_length = shared("focal_length_mm", "focal length in mm")
    numbers: Sequence[float | None] = f_numbers or [one.f_number for one in recorded]
    f_number = each(numbers, "f-number", f"f_numbers {once_each}")
    distances: Sequence[float | None] = focus_distances_m or [one.focus_distance_m for one in recorded]
    focus = each(distances, "distance of focus in m", f"focus_distances_m {once_each}")
    pitch = shared("pixel_pitch_um", "pixel pitch in um")
    if lacking:
        whats, parameters = zip(*lacking, strict=True)
        raise InputError(f"EXIF does not give the {_listed(whats)}: give {_listed(parameters)}.")
    views = zip(files, f_number, focus, strict=True)
    return {**camera, "focal_length_mm": focal_length, "pixel_pitch_um": pitch}, [
        {"image": file, "f_number": number, "focus_distance_m": distance} for file, number, distance in views
    ]


def _recorded(path: Path) -> _Recorded:
    """Return the EXIF metadata of a file; empty if it has none."""
    data = read_image_bytes(path)
    nothing: tuple[Mapping[int, Any], tuple[int, int]] = {}, (0, 0)
    tags, size = of_header(data, lambda image: (image.getexif().get_ifd(ExifTags.IFD.Exif), image.size), nothing)
    if is_raw(path):
        # Most raw files are TIFF variants that Pillow does not open, with standard EXIF metadata.
        with contextlib.suppress(Exception):
            exif = Image.Exif()
            exif.load(b"Exif\0\0" + data)
            tags, size = exif.get_ifd(ExifTags.IFD.Exif), (0, 0)
    pitch = _pixel_pitch(tags, size)
    sized = _number(tags, ExifTags.Base.FocalPlaneXResolution) is not None  # unusable if the image was cropped
    equivalent = None if sized else _pitch_by_equivalent(tags, size)
    return _Recorded(
        focal_length_mm=_number(tags, ExifTags.Base.FocalLength),
        f_number=_number(tags, ExifTags.Base.FNumber),
        focus_distance_m=_distance(tags),
        pixel_pitch_um=equivalent if pitch is None else pitch,
        by_equivalent=equivalent is not None,
    )


FULL_FRAME_MM = math.hypot(36, 24)
"""Diagonal in mm of the frame to which 35-mm equivalents refer (CIPA DCG-001)."""


def _pitch_by_equivalent(tags: Mapping[int, Any], size: tuple[int, int]) -> float | None:
    """Return the pixel pitch in um from the 35-mm equivalent of the focal length; None if EXIF lacks it.

    The diagonal of the sensor is that of the full frame times focal length / equivalent; the uncropped picture, resized
    or not, spans it.
    """
    focal = _number(tags, ExifTags.Base.FocalLength)
    full = _number(tags, ExifTags.Base.FocalLengthIn35mmFilm)
    if focal is None or full is None or min(size) == 0 or full < focal:
        return None
    return 1e3 * FULL_FRAME_MM * focal / full / math.hypot(*size)


def _pixel_pitch(tags: Mapping[int, Any], size: tuple[int, int]) -> float | None:
    """Return the pixel pitch in um of the image at its current size, or None if EXIF does not give it."""
    per_unit = _number(tags, ExifTags.Base.FocalPlaneXResolution)
    unit = _MILLIMETRES.get(tags.get(ExifTags.Base.FocalPlaneResolutionUnit, 2))
    if per_unit is None or unit is None:
        return None
    if size == (0, 0):  # pixels of the sensor
        return 1e3 * unit / per_unit
    taken = [
        _number(tags, tag) or now
        for tag, now in zip((ExifTags.Base.ExifImageWidth, ExifTags.Base.ExifImageHeight), size, strict=True)
    ]
    scale = [was / now for was, now in zip(taken, size, strict=True)]
    # Unequal scales mean that the image was cropped, so that the pitch is unknown; one pixel may be lost to rounding.
    if abs(scale[0] - scale[1]) > 1.5 * max(s / now for s, now in zip(scale, size, strict=True)):
        return None
    return 1e3 * unit / per_unit * scale[0]


def _distance(tags: Mapping[int, Any]) -> float | None:
    """Return the focus distance in metres.

    EXIF 2.3, 4.6.5: a numerator of 0xFFFFFFFF means infinity, 0 unknown; some cameras write infinity as n/0.
    """
    tag = tags.get(ExifTags.Base.SubjectDistance)
    numerator, denominator = getattr(tag, "numerator", tag), getattr(tag, "denominator", 1)
    if numerator == 0xFFFFFFFF or (numerator and not denominator):
        return math.inf
    return _number(tags, ExifTags.Base.SubjectDistance)


def _number(tags: Mapping[int, Any], tag: int) -> float | None:
    """Return a positive number, or None if the tag is absent, zero or invalid."""
    try:
        value = float(tags[tag])
    except (KeyError, TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return value if value > 0 and math.isfinite(value) else None


def _listed(parts: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))
