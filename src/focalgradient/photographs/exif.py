"""Settings from what cameras write into their files (EXIF), and from options for what they do not."""

from __future__ import annotations

import contextlib
import io
import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import ExifTags, Image

from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.photographs.cameras import Calibrated
from focalgradient.photographs.encodings import FORMATS, Encoding
from focalgradient.photographs.images import read_image_bytes
from focalgradient.photographs.planes import Plane
from focalgradient.photographs.raw import is_raw
from focalgradient.photographs.settings import Settings
from focalgradient.tables import check_table

__all__ = ["from_exif"]

_MILLIMETRES = {2: 25.4, 3: 10.0, 4: 1.0, 5: 1e-3}
"""Length of FocalPlaneResolutionUnit in mm: inch, centimetre, and, in wide use, millimetre and micrometre."""


@dataclass(frozen=True, slots=True)
class _Recorded:
    """What the EXIF of one file gives; None for what it does not."""

    focal_length_mm: float | None
    f_number: float | None
    focus_distance_m: float | None
    pixel_pitch_um: float | None
    by_equivalent: bool = False  # the pitch follows from the 35-mm equivalent


def from_exif(
    paths: Sequence[str | os.PathLike[str]],
    *,
    focal_length_mm: float | None = None,
    f_numbers: Sequence[float] = (),
    focus_distances_m: Sequence[float] = (),
    pixel_pitch_um: float | None = None,
    encoding: Encoding | None = None,
    telecentric: bool = False,
    distances_from: Plane | None = None,
    focus_from: Plane | None = None,
    sensor_to_pupil_mm: float | None = None,
    sensor_to_front_mm: float | None = None,
    focus_tolerance: float | None = None,
    f_number_tolerance: float | None = None,
    calibrated: Calibrated | None = None,
    least: int = 2,
    order_only: bool = False,
) -> Settings:
    """Make settings for photographs of one scene from their EXIF; what is given here goes before what EXIF gives.

    Parameters
    ----------
    paths
        Image files.
    least
        How many there must be.
    order_only
        Where no focus distance is known, take the photographs for a stack in order of focus, evenly spaced in vergence
        from 1 to 2 (`Settings.relative`): depth is then a place in the stack. Optics that are missing do not matter.
    f_numbers, focus_distances_m
        One for all files, or one for each, in order; or none: taken from EXIF.
    focal_length_mm, pixel_pitch_um
        None: taken from EXIF. The pitch follows from FocalPlaneXResolution, scaled where the image has been resized; or
        else, with a warning, from the focal length's 35-mm equivalent, which is rounded to a millimetre.
    encoding, telecentric, distances_from, focus_from, sensor_to_pupil_mm, sensor_to_front_mm
        As in `focalgradient.photographs.Camera`.
    focus_tolerance, f_number_tolerance
        The same; None: the defaults there.
    calibrated
        The camera, where it was calibrated: it gives its sensor, and its focus if there was but one; f-numbers are
        then marks on the lens.

    Raises
    ------
    InputError
        If EXIF lacks what is not given (the message names the parameter for each), or the files disagree on
        focal length or pixel pitch, or fewer files than `least` are given, or the calibration does not hold for them.
    """
    files = [Path(path) for path in paths]
    if len(files) < least:
        raise InputError(
            f"only {len(files)} photograph is given, but depth needs {least} or more of one scene: add another."
        )
    once = 1 in (len(f_numbers), len(focus_distances_m))
    f_numbers = _for_each(files, "f_numbers", f_numbers)
    focus_distances_m = _for_each(files, "focus_distances_m", focus_distances_m)
    camera: dict[str, Any] = {
        "focal_length_mm": focal_length_mm,
        "pixel_pitch_um": pixel_pitch_um,
        "encoding": encoding,
        "telecentric": telecentric,
        "distances_from": distances_from,
        "focus_from": focus_from,
        "sensor_to_pupil_mm": sensor_to_pupil_mm,
        "sensor_to_front_mm": sensor_to_front_mm,
    }
    tolerances = {"focus_tolerance": focus_tolerance, "f_number_tolerance": f_number_tolerance}
    recorded = [_recorded(file) for file in files]
    if calibrated is not None:
        camera = _of_calibrated(camera, calibrated, files[0], recorded[0])
        if not focus_distances_m and calibrated.focus is not None:
            focus_distances_m = [calibrated.focus] * len(files)
    relative = order_only and not focus_distances_m and all(one.focus_distance_m is None for one in recorded)
    if relative:
        focus_distances_m = [1 / (1 + n / max(1, len(files) - 1)) for n in range(len(files))]
        # Stand-ins: sharpness does not depend on them. What focus does to magnification is not known.
        first = recorded[0]
        camera["telecentric"] = True
        camera["focal_length_mm"] = camera["focal_length_mm"] or first.focal_length_mm or 50.0
        camera["pixel_pitch_um"] = camera["pixel_pitch_um"] or first.pixel_pitch_um or 5.0
        f_numbers = f_numbers or [one.f_number or first.f_number or 4.0 for one in recorded]
    if pixel_pitch_um is None and camera["pixel_pitch_um"] is None and any(one.by_equivalent for one in recorded):
        warnings.warn(
            f"EXIF gives no size of pixels: {recorded[0].pixel_pitch_um:.3g} um follows from the 35-mm equivalent of "
            "the focal length, to a few per cent, if the picture was not cropped; give pixel_pitch_um if you know it.",
            FocalGradientWarning,
            stacklevel=2,
        )
    camera, views = _complete(files, recorded, camera, f_numbers, focus_distances_m)
    if once and least > 1 and len({(view["f_number"], view["focus_distance_m"]) for view in views}) == 1:
        one = views[0]
        raise InputError(
            f"all {len(views)} photographs have an f-number of {one['f_number']:g} and their focus at "
            f"{one['focus_distance_m']:g} m, so that all are blurred alike, and no depth follows: give f_numbers or "
            "focus_distances_m once for each photograph, as they differ."
        )
    settings = check_table(
        "the optics given",
        {
            "camera": camera | {name: value for name, value in tolerances.items() if value is not None},
            "view": views,
            "relative": relative,
            "calibration": calibrated and calibrated.calibration,
            "calibrated_plane": calibrated and calibrated.sensor.distances_from,
        },
        Settings,
    )
    settings.lenses()  # refuses those that are not plausible
    return settings


def _for_each(files: Sequence[Path], name: str, given: Sequence[float]) -> Sequence[float]:
    """What is given of each file, or once for all; or nothing.

    Raises
    ------
    InputError
        If it is given another number of times.
    """
    if len(given) not in (0, 1, len(files)):
        raise InputError(
            f"{name} was given {len(given)} times: give it once for all {len(files)} photographs, or once for each, "
            "in order."
        )
    return list(given) * (len(files) if len(given) == 1 else 1)


def _of_calibrated(
    camera: Mapping[str, Any], calibrated: Calibrated, file: Path, recorded: _Recorded
) -> dict[str, Any]:
    """What is given of a camera, and what its calibration gives beside that.

    Raises
    ------
    InputError
        If the first file was taken at another focal length than the camera was calibrated at.
    """
    sensor, taken = calibrated.sensor, recorded.focal_length_mm
    if camera["focal_length_mm"] is None and taken and abs(taken / sensor.focal_length_mm - 1) > 0.01:
        raise InputError(
            f"{file.name} was taken at {taken:g} mm, but the camera was calibrated at "
            f"{sensor.focal_length_mm:g} mm: calibrate it at this zoom."
        )
    known = {name: given or getattr(sensor, name) for name, given in camera.items() if name != "pixel_pitch_um"}
    pitch, exif_pitch = camera["pixel_pitch_um"], recorded.pixel_pitch_um or sensor.pixel_pitch_um
    if pitch is None and abs(exif_pitch / sensor.pixel_pitch_um - 1) < 0.05:  # if not, it was resized
        pitch = sensor.pixel_pitch_um
    return known | {"pixel_pitch_um": pitch}


def _complete(
    files: Sequence[Path],
    recorded: Sequence[_Recorded],
    camera: Mapping[str, Any],
    f_numbers: Sequence[float],
    focus_distances_m: Sequence[float],
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The tables of the camera and of its views, with what EXIF gives where nothing else does.

    Raises
    ------
    InputError
        If something is missing (all that is, is named), or the files disagree on what they share.
    """
    lacking: list[tuple[str, str]] = []  # what, and the parameter that gives it

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
    """Read what the file's EXIF gives: nothing where it has none."""
    tags: Mapping[int, Any] = {}
    size = (0, 0)
    data = read_image_bytes(path)
    # EXIF is foreign and optional: damaged is as good as absent, and Pillow's remarks on it help nobody.
    with contextlib.suppress(Exception), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with Image.open(io.BytesIO(data), formats=FORMATS) as image:
            size = image.size
            tags = image.getexif().get_ifd(ExifTags.IFD.Exif)
    if is_raw(path):
        # Most are TIFF files of a kind that Pillow does not open, with the same EXIF in them.
        with contextlib.suppress(Exception):
            exif = Image.Exif()
            exif.load(b"Exif\0\0" + data)
            tags, size = exif.get_ifd(ExifTags.IFD.Exif), (0, 0)
    distance = _number(tags, ExifTags.Base.SubjectDistance)
    pitch = _pixel_pitch(tags, size)
    sized = pitch is not None or _number(tags, ExifTags.Base.FocalPlaneXResolution) is not None  # of what was cropped
    equivalent = None if sized else _pitch_by_equivalent(tags, size)
    return _Recorded(
        focal_length_mm=_number(tags, ExifTags.Base.FocalLength),
        f_number=_number(tags, ExifTags.Base.FNumber),
        # EXIF 2.3, 4.6.5: a numerator of 0xFFFFFFFF means infinity, 0 unknown.
        focus_distance_m=math.inf if distance is not None and distance >= 0xFFFFFFFF else distance,
        pixel_pitch_um=equivalent if pitch is None else pitch,
        by_equivalent=equivalent is not None,
    )


FULL_FRAME_MM = math.hypot(36, 24)
"""Diagonal of the frame that 35-mm equivalents refer to (CIPA DCG-001)."""


def _pitch_by_equivalent(tags: Mapping[int, Any], size: tuple[int, int]) -> float | None:
    """Give the pixel pitch in um by the 35-mm equivalent of the focal length; None where EXIF lacks it.

    The diagonal of the sensor is that of the full frame times focal length / equivalent; the picture, resized or not,
    shows all of it.
    """
    focal = _number(tags, ExifTags.Base.FocalLength)
    full = _number(tags, ExifTags.Base.FocalLengthIn35mmFilm)
    if focal is None or full is None or min(size) == 0 or full < focal:
        return None
    return 1e3 * FULL_FRAME_MM * focal / full / math.hypot(*size)


def _pixel_pitch(tags: Mapping[int, Any], size: tuple[int, int]) -> float | None:
    """Give the pixel pitch in um of the image as it is now, or None where EXIF does not give it."""
    per_unit = _number(tags, ExifTags.Base.FocalPlaneXResolution)
    unit = _MILLIMETRES.get(tags.get(ExifTags.Base.FocalPlaneResolutionUnit, 2))
    if per_unit is None or unit is None:
        return None
    if size == (0, 0):  # the sensor's own pixels
        return 1e3 * unit / per_unit
    taken = [
        _number(tags, tag) or now
        for tag, now in zip((ExifTags.Base.ExifImageWidth, ExifTags.Base.ExifImageHeight), size, strict=True)
    ]
    scale = [was / now for was, now in zip(taken, size, strict=True)]
    # Unequal scales: cropped, not (only) resized, so that the pitch is unknown. One pixel may be lost to rounding.
    if abs(scale[0] - scale[1]) > 1.5 * max(s / now for s, now in zip(scale, size, strict=True)):
        return None
    return 1e3 * unit / per_unit * scale[0]


def _number(tags: Mapping[int, Any], tag: int) -> float | None:
    """Read a positive number, or None where the tag is absent, zero or senseless."""
    try:
        value = float(tags[tag])
    except (KeyError, TypeError, ValueError, ZeroDivisionError, OverflowError):
        return None
    return value if value > 0 and math.isfinite(value) else None


def _listed(parts: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))
