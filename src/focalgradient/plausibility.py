"""Physical plausibility of optics and scenes: checks that detect mixed-up units before they lead to wrong depth.

Each bound follows from physics or from existing devices, as stated beside it. Bounds are relative wherever possible
(pixels of blur, focal lengths, the angle of the frame), so that a rendered scene may use any unit of length. Messages
name each quantity as the user gave it: by parameter and in SI units, or as set by `given_as`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Final

from focalgradient.errors import InputError, warn

__all__ = [
    "PIXEL_ANGLE",
    "RESOLVED",
    "check_display",
    "check_f_number",
    "check_field",
    "check_focal_length",
    "check_focus",
    "check_frame",
    "check_hyperfocal",
    "check_offset",
    "check_pixel_pitch",
    "check_range",
    "check_screen_width",
    "check_target",
    "given_as",
    "likely",
    "named",
    "picture_slip",
    "stated",
    "too_near",
    "unit_of",
]

RESOLVED = 0.1
"""Smallest resolvable blur radius in pixels: a tenth of a pixel, and about the standard error of the blur radius in a
window of 8 pixels at 1 % noise."""

MIN_FOCAL_LENGTH, SUSPECT_FOCAL_LENGTH, MAX_FOCAL_LENGTH = 1e-4, 2.0, 10.0
"""Focal lengths in metres: the minimum (the shortest lenses made, wafer-level lenses of endoscopes, have 0.2 mm); that
above which millimetres are suspected; and the maximum (the longest lens made for a camera has 5.2 m)."""

MIN_F_NUMBER, IMPOSSIBLE_F_NUMBER = 0.5, 0.02
"""Minimum f-number of a lens in air (Abbe's sine condition: rays converge at no more than a right angle), and that
below which even the synthetic apertures of rendered scenes lie (0.28 is the lowest published)."""

MIN_SENSOR_PITCH, MIN_IMAGE_PITCH = 0.48e-6, 0.05e-6
"""Minimum pixel pitches in metres. The smallest pixels sold (phones) have 0.5 um; below 0.05 um the image would have
been enlarged tenfold, and light of 0.55 um through f/0.5 spreads over five pixels."""

MAX_HALF_FRAME = math.tan(math.radians(80))
"""Tangent of the maximum half-angle of a frame: at 80 degrees, cos^4 falloff leaves 0.1 % of the light."""

MIN_DISPLAY_PITCH = 2e-6
"""Minimum pixel pitch of a display in metres: the finest microdisplays have about 3 um."""

MAX_HALF_SCREEN = math.tan(math.radians(70))
"""Tangent of the maximum half-angle of a flat screen; wider screens are curved. Common monitor widths in millimetres,
taken for centimetres, fill 143 degrees and more at 0.57 m."""

MIN_VISIBLE_ANGLE = math.radians(0.03 / 60)
"""Minimum resolvable pixel angle in radians: the best vernier acuity is about 2 seconds of arc (Westheimer 1975,
Investigative Ophthalmology 14, 570)."""

PIXEL_ANGLE = "give the angle in radians, pixel pitch / sensor distance"
"""Remedy in messages about the pixel angle."""

MAX_FOCUS_FOCAL_LENGTHS = 1000.0
"""Maximum plausible finite focus distance, in focal lengths: the last mark before infinity on a lens lies at 100 to 200
focal lengths."""

HYPERFOCAL_BLUR_PX = 0.5
"""Blur radius of infinity, in pixels, for focus at the hyperfocal distance: a circle of confusion of one pixel."""

MACRO_FOCAL_LENGTHS = 10.0
"""Maximum distance of macrophotography, in focal lengths: magnification above 1/9."""

MIN_FOCUS_FOCAL_LENGTHS = 5.0
"""Minimum plausible focus distance, in focal lengths: few lenses exceed a magnification of 1/4."""

UNITS: Final = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "um": 1e-6, "nm": 1e-9, "km": 1e3}
"""Units of length in metres, in the order in which they are tried as the intended unit."""

_UNIT_NAMES = {"mm": "millimetres", "cm": "centimetres", "m": "metres", "um": "micrometres"}

_GIVEN: ContextVar[Mapping[str, tuple[str, str]]] = ContextVar("given", default={})  # noqa: B039  never mutated


@contextmanager
def given_as(names: Mapping[str, tuple[str, str]]) -> Iterator[None]:
    """Set the name and unit under which messages report each parameter.

    >>> with given_as({"focal_length": ("focal_length_mm", "mm")}):
    ...     stated("focal_length", 0.025)
    'focal_length_mm is 25 mm'
    """
    token = _GIVEN.set({**_GIVEN.get(), **names})
    try:
        yield
    finally:
        _GIVEN.reset(token)


def named(name: str) -> str:
    """Return the name under which the user gave a parameter.

    >>> with given_as({"field": ("--field", "")}):
    ...     named("field")
    '--field'
    """
    return _GIVEN.get().get(name, (name, ""))[0]


def stated(name: str, metres: float, verb: str = " is") -> str:
    """Return a length with its name and unit, as the user gave them.

    >>> stated("focal_length", 0.025)
    'focal_length is 0.025 m'
    """
    name, unit = _GIVEN.get().get(name, (name, "m"))
    return f"{name}{verb} {metres / UNITS[unit]:.6g} {unit}"


def unit_of(name: str) -> str:
    """Return the unit in which the user gave a length."""
    return _GIVEN.get().get(name, (name, "m"))[1]


def likely(name: str, metres: float, fits: Callable[[float], bool]) -> str:
    """Return the remedy for an implausible length: its unit, and the number to give if another unit `fits`.

    >>> likely("focal_length", 25.0, lambda metres: 1e-3 < metres < 2)
    'give it in metres, 0.025 for 25 mm'
    """
    _, unit = _GIVEN.get().get(name, (name, "m"))
    number, remedy = metres / UNITS[unit], f"give it in {_UNIT_NAMES[unit]}"
    for other, size in UNITS.items():
        if other != unit and fits(number * size):
            return f"{remedy}, {number * size / UNITS[unit]:.6g} for {number:.6g} {other}"
    return remedy


def check_focal_length(metres: float) -> None:
    """Validate a focal length (m); warn of one that is implausibly long."""

    def usual(other: float) -> bool:
        return 1e-3 <= other <= SUSPECT_FOCAL_LENGTH

    if metres > MAX_FOCAL_LENGTH or metres < MIN_FOCAL_LENGTH:
        which = "longer than any camera's" if metres > MAX_FOCAL_LENGTH else "shorter than any lens's"
        raise InputError(f"{stated('focal_length', metres)}, {which}: {likely('focal_length', metres, usual)}.")
    if metres > SUSPECT_FOCAL_LENGTH:
        _, unit = _GIVEN.get().get("focal_length", ("", "m"))
        smaller = {"m": "mm", "mm": "um"}[unit]
        meant = f"if {_UNIT_NAMES[smaller]} are meant, give {1e-3 * metres / UNITS[unit]:g}"
        warn(f"{stated('focal_length', metres)}: {meant}.")


def check_f_number(f_number: float, focal_length: float) -> None:
    """Validate an f-number; warn below the minimum in air, reject one that is probably the aperture's diameter."""
    if f_number >= MIN_F_NUMBER:
        return
    text = f"{named('f_number')} is {f_number:g}, below the {MIN_F_NUMBER:g} that a lens in air can have"
    remedy = "if it is the aperture's diameter, give focal length / diameter"
    if f_number < IMPOSSIBLE_F_NUMBER:
        raise InputError(f"{text}: {remedy}, {focal_length / f_number:.3g} for {f_number:g} m.")
    warn(f"{text}: {remedy}.")


def check_focus(focus_distance: float, focal_length: float) -> None:
    """Raise `InputError` if the focus distance (m) does not exceed the focal length (m)."""
    if focus_distance <= focal_length:
        remedy = likely("focus_distance", focus_distance, partial(_near_focus, focal_length=focal_length))
        raise InputError(
            f"{stated('focus_distance', focus_distance, '')} lies within the focal length {focal_length:g} m, where a "
            f"lens forms no real image: focus farther than the focal length, or {remedy}."
        )


def check_pixel_pitch(metres: float, angle: float) -> None:
    """Validate a pixel pitch (m) on the sensor and its pixel angle (rad); warn of one finer than any sensor's."""
    if metres >= MIN_SENSOR_PITCH:
        return
    remedy = likely("pixel_pitch", metres, lambda other: MIN_SENSOR_PITCH <= other <= 1e-4)
    text = f"{stated('pixel_pitch', metres)}, finer than any pixel made (0.5 um)"
    if "pixel_pitch" not in _GIVEN.get():
        text = f"pixel_angle is {angle:g} rad, which is {metres * 1e6:.2g} um on the sensor, finer than any pixel made"
        remedy = PIXEL_ANGLE
    if metres < MIN_IMAGE_PITCH:
        raise InputError(f"{text}: {remedy}.")
    warn(f"{text}: {remedy}.")


def check_frame(pixel_angle: float, shape: Sequence[int]) -> None:
    """Raise `InputError` if an image of this `shape` exceeds the widest possible frame."""
    half = pixel_angle * max(shape[:2]) / 2
    if half > MAX_HALF_FRAME:
        raise InputError(
            f"{max(shape[:2])} pixels of {pixel_angle:.3g} rad make a frame of {2 * math.degrees(math.atan(half)):.0f} "
            "degrees, wider than a lens forms: check the units of the pixel pitch and the focal length (a pixel's "
            "angle is pitch / sensor distance, in radians)."
        )


def check_field(angle: float, pixels: int, focal_length: float | None) -> None:
    """Validate the field of view (rad) of a picture: its pixels must not be finer than any sensor's or eye's."""
    half = math.tan(angle / 2)
    pixel = 2 * half / pixels
    degrees = math.degrees(angle)
    text = f"{named('field')} is {degrees:g} degrees, so that a pixel is "
    text += f"{60 * math.degrees(pixel):.2g} arcmin wide"
    slip = math.degrees(degrees)  # the degrees of a number given in radians
    remedy = f"give it in degrees{f', {slip:.4g} for {degrees:g} radians,' if slip < 170 else ''} or reduce the picture"
    if focal_length is not None and pixel * focal_length < MIN_SENSOR_PITCH:
        text += f", or {1e6 * pixel * focal_length:.2g} um on the sensor, finer than any pixel made (0.5 um): {remedy}."
        if pixel * focal_length < MIN_IMAGE_PITCH:
            raise InputError(text)
        warn(text)
    elif focal_length is None and pixel < MIN_VISIBLE_ANGLE:
        raise InputError(f"{text}, finer than any eye sees: {remedy}.")


def check_display(pixel_pitch: float, distance: float, width: int) -> None:
    """Validate the pixel pitch (m), viewing distance (m) and width (px) of a display."""
    pixel = pixel_pitch / distance
    size = f"pixels of {1e6 * pixel_pitch:.4g} um"
    if pixel_pitch < MIN_DISPLAY_PITCH:
        remedy = likely("pixel_pitch", pixel_pitch, lambda other: 2e-5 < other < 5e-3)
        raise InputError(f"{size} are finer than any display's (3 um): {remedy}.")
    if pixel < MIN_VISIBLE_ANGLE:
        remedy = likely("distance", distance, lambda other: 0.2 <= other <= 5)
        raise InputError(
            f"{size} at {distance:g} m are {60 * math.degrees(pixel):.2g} arcmin wide, finer than any eye resolves: "
            f"check the units of the display's width or pixels, and of its distance ({remedy})."
        )
    if pixel * width / 2 > MAX_HALF_FRAME:
        remedy = likely("distance", distance, lambda other: 0.2 <= other <= 5)
        raise InputError(
            f"{width} {size} at {distance:g} m fill {2 * math.degrees(math.atan(pixel * width / 2)):.0f} degrees: "
            f"check the units of the display's width or pixels, and of its distance ({remedy})."
        )


def check_screen_width(width: float, distance: float) -> None:
    """Raise `InputError` if a screen (m) subtends a wider angle than flat screens do."""
    if width / 2 / distance > MAX_HALF_SCREEN:
        remedy = likely("width", width, lambda other: 0.05 <= other <= 4 and other / 2 / distance <= MAX_HALF_SCREEN)
        angle = 2 * math.degrees(math.atan(width / 2 / distance))
        raise InputError(
            f"{stated('width', width)}, which at {distance:g} m fills {angle:.0f} degrees, more than a flat "
            f"screen does: {remedy}."
        )


def check_range(
    foci: Sequence[tuple[float, float | None, float | None]],
    slope: float,
    searched: tuple[float, float],
    near: float | None,
    far: float | None,
) -> None:
    """Raise `InputError` if blur resolves no depth in any view over the search range.

    Parameters
    ----------
    foci
        Focus vergence (D) of each view, and its focal length (m) and f-number, or None.
    slope
        Blur radius in pixels per dioptre of defocus, in the view with the largest aperture.
    searched
        Lowest and highest vergence searched (D).
    near, far
        Limits (m) given by the user, or None.

    Raises
    ------
    InputError
        If blur changes by less than `RESOLVED` over the search range, or a finite focus lies so far beyond the
        hyperfocal distance that it is indistinguishable from infinity.

    Warns
    -----
    FocalGradientWarning
        If a finite focus lies beyond the hyperfocal distance and `MAX_FOCUS_FOCAL_LENGTHS` focal lengths.
    """
    shortest = min((length for _, length, _ in foci if length is not None), default=0.0)
    for vergence, length, f_number in foci:
        if length is not None and vergence > 0:
            check_hyperfocal(1 / vergence, length, slope, f_number or 0.0)
    change = slope * (searched[1] - searched[0])
    if change < RESOLVED:
        which = [(name, limit) for name, limit in (("near", near), ("far", far)) if limit is not None]
        limits = " and ".join(stated(name, limit) for name, limit in which) or "the search has its usual limits"
        remedies = [
            likely(name, limit, lambda other: slope / other > RESOLVED and other > MIN_FOCUS_FOCAL_LENGTHS * shortest)
            for name, limit in which
        ]
        raise InputError(
            f"{limits}, over which blur changes by {change:.2g} px, too little to estimate depth: "
            f"{remedies[0] if remedies else 'check the units of focal length, f-number, focus and pixel pitch'}."
        )


def check_target(distance: float, focal_length: float, slope: float) -> None:
    """Validate a target distance (m): imaged by the lens, and distinguishable from infinity at `slope` (px/D)."""
    remedy = likely("distance", distance, partial(_near_focus, focal_length=focal_length))
    if distance <= focal_length:
        raise InputError(
            f"{stated('distance', distance)}, within the focal length {focal_length:g} m, where nothing is imaged: "
            f"{remedy}."
        )
    if slope / distance < RESOLVED:
        raise InputError(
            f"{stated('distance', distance)}, where the target's blur differs from that of infinity by "
            f"{slope / distance:.2g} px only: "
            f"{remedy}, or check the units of focal length ({focal_length:g} m), f-number and pixel."
        )


def check_offset(name: str, metres: float, nearest: float) -> None:
    """Raise `InputError` if an offset of distances, or its standard deviation, reaches the `nearest` distance (m)."""
    if abs(metres) >= nearest:
        remedy = likely(name, metres, lambda other: abs(other) < nearest)
        raise InputError(f"{stated(name, metres)}, as much as the nearest distance, {nearest:g} m: {remedy}.")


def too_near(distance: float, foci: Sequence[tuple[float, float | None]]) -> str | None:
    """Return why an estimated median distance (m) is implausible (macro range, foci far beyond it), or None.

    >>> too_near(0.017, [(1.18, 0.0025), (0.5, 0.0025)])[:44]
    'the median distance is 0.017 m, 6.8 focal le'
    """
    length = min((one for _, one in foci if one is not None), default=0.0)
    nearest = max(vergence for vergence, _ in foci)
    if not (0 < distance < MACRO_FOCAL_LENGTHS * length and 0 < nearest < 0.1 / distance):
        return None
    return (
        f"the median distance is {distance:.2g} m, {distance / length:.2g} focal lengths, with the nearest focus at "
        f"{1 / nearest:.3g} m: check the units of focal length, pixel pitch, f-number and focus."
    )


def picture_slip(
    distances: tuple[float, float], aperture: float, focus_vergence: float, pixel_angle: float, size: int
) -> str | None:
    """Return why the units of a picture's distances or optics are implausible; None if they are plausible.

    Parameters
    ----------
    distances
        Nearest and farthest distance (m).
    aperture, focus_vergence
        Diameter of the aperture (m), and focus vergence (D).
    pixel_angle, size
        Pixel angle (rad), and length of the longer side in pixels.

    Examples
    --------
    >>> picture_slip((0.8, 2.2), 0.0045, 1.25, 3.3e-4, 320)
    >>> text = picture_slip((800.0, 2200.0), 0.0045, 1.25, 3.3e-4, 320)
    >>> text[:58], text[-43:]
    ('distances from 800 to 2200 m do not reach the focus at 0.8', 'these are 0.8 to 2.2 m in mm: give unit mm.')
    """
    near, far = distances
    slope = aperture / 2 / pixel_angle
    if slope == 0 or not math.isfinite(near):
        return None
    ends = [slope * abs(focus_vergence - 1 / distance) for distance in distances]
    inside = 1 / far <= focus_vergence <= 1 / near
    if not inside and min(ends) > size:
        return (
            f"everything is blurred by {min(ends):.3g} px or more, wider than the picture: check the units of focal "
            "length, f-number, focus and pixel."
        )
    if inside or focus_vergence <= 0:
        return None
    focus = 1 / focus_vergence
    off = max(focus / far, near / focus)
    if off <= 10:
        return None
    text = f"distances from {near:.4g} to {far:.4g} m do not reach the focus at {focus:.4g} m"
    number_unit = _GIVEN.get().get("focus_distance", ("focus_distance", "m"))
    for unit, size_m in UNITS.items():
        if size_m < 1 and near <= focus * size_m * (1 + 1e-9) and focus * size_m <= far * (1 + 1e-9):
            return f"{text}: most likely, {number_unit[0]} {focus:g} is {focus * size_m:.4g} m in {unit}."
    alike = slope * (1 / near - 1 / far) < RESOLVED
    for unit, size_m in UNITS.items():
        if size_m < 1 and near * size_m <= 2 * focus and focus / 2 <= far * size_m:
            how = f", and are blurred alike to {RESOLVED:g} px" if alike else ""
            remedy = f": give {named('unit')} mm" if unit == "mm" else ""
            return f"{text}{how}: most likely, these are {near * size_m:.4g} to {far * size_m:.4g} m in {unit}{remedy}."
    return None


def check_hyperfocal(distance: float, focal_length: float, slope: float, f_number: float) -> None:
    """Raise `InputError` if a finite focus (m) is indistinguishable from infinity; warn if it nearly is."""
    remedy = likely("focus_distance", distance, partial(_near_focus, focal_length=focal_length))
    text = f"{stated('focus_distance', distance)}, beyond the hyperfocal distance, where infinity is blurred by "
    text += f"{slope / distance:.2g} px only: {remedy}, or inf for infinity"
    ratio = f_number / (1e3 * focal_length)  # exchanging the two multiplies the slope by its cube
    if ratio > 1 and math.isfinite(ratio) and ratio**3 * slope / distance >= HYPERFOCAL_BLUR_PX:
        text += f"; or {named('focal_length')} and {named('f_number')} are exchanged"
    if slope / distance < RESOLVED:
        raise InputError(f"{text}; or check the units of focal length ({focal_length:g} m), f-number and pixel.")
    if slope / distance < HYPERFOCAL_BLUR_PX and distance > MAX_FOCUS_FOCAL_LENGTHS * focal_length:
        warn(f"{text}.")


def _near_focus(metres: float, focal_length: float) -> bool:
    """Return whether lenses of this focal length (m) are commonly focused at a distance (m)."""
    return MIN_FOCUS_FOCAL_LENGTHS * focal_length < metres < MAX_FOCUS_FOCAL_LENGTHS * focal_length
