"""Ranges of an eye's parameters: pupils from 0.1 to 9 mm, light from 380 to 780 nm, ages to 120 years."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_finite, described, is_number, warn
from focalgradient.optics import Optics, check_optics
from focalgradient.plausibility import likely, stated, unit_of
from focalgradient.quantities import Check, Range, Values

__all__ = [
    "AGE",
    "AGES",
    "VISIBLE",
    "Age",
    "AnyOptics",
    "PixelAngle",
    "Pupil",
    "Vergence",
    "Wavelength",
    "check_kind",
    "check_pupil",
    "ordered_times",
    "warn_if_artificial",
    "wavelengths",
]

SMALLEST_PUPIL, LARGEST_PUPIL = 1e-4, 9e-3
"""Range of the pupil's diameter in metres. Dilated pupils reach 9 mm. Through less than 0.1 mm an eye resolves 3 cycles
per degree in yellow light, and no experiment uses such a pinhole: a choice, which rejects other units."""

USUAL_PUPIL = 1e-3
"""Smallest natural pupil in metres: natural pupils are 2 to 8 mm wide (Watson & Yellott 2012), smaller ones are
artificial."""


OLDEST = 120.0
"""Maximum age in years: a bound that rejects other units."""


AGE, AGES = Range("years", 0, OLDEST), Values("years", 0, OLDEST)
VISIBLE, WAVELENGTHS = Range("nanometres", 380, 780), Values("nanometres", 380, 780)

Age = Annotated[float, AGE]
"""Age in years."""

Wavelength = Annotated[float, VISIBLE]
"""A visible wavelength in nanometres."""

Vergence = Annotated[float, Range("dioptres")]
PixelAngle = Annotated[float, Range("radians", positive=True)]

AnyOptics = Annotated[Optics, Check(check_optics)]
"""A lens, an eye, or other optics."""


def check_kind(name: str, value: object, kind: type, remedy: str) -> None:
    """Raise `InputError` unless `given` is of this `kind`; the `remedy` ends the message.

    >>> check_kind("eye", 3, dict, "give Eye(pupil_diameter, accommodation)")
    Traceback (most recent call last):
    focalgradient.errors.InputError: eye is 3, but must be of dict: give Eye(pupil_diameter, accommodation).
    """
    if not isinstance(value, kind):
        raise InputError(f"{name} is {described(value)}, but must be of {kind.__name__}: {remedy}.")


def check_pupil(pupil_diameter: Any) -> None:
    """Raise `InputError` if the pupil's diameter (m) is out of range."""
    # A rounding's worth of slack, for millimetres that became metres.
    within = is_number(pupil_diameter) and SMALLEST_PUPIL * (1 - 1e-9) <= pupil_diameter <= LARGEST_PUPIL * (1 + 1e-9)
    if not within:
        value, bounds = f"pupil_diameter is {described(pupil_diameter)}", f"{SMALLEST_PUPIL} (0.1 mm)"
        remedy, bounds = "give it in metres", f"{bounds} to {LARGEST_PUPIL} (9 mm)"
        if is_number(pupil_diameter):
            remedy = likely("pupil_diameter", pupil_diameter, lambda metres: USUAL_PUPIL <= metres <= LARGEST_PUPIL)
            if unit_of("pupil_diameter") == "mm":
                value, bounds = stated("pupil_diameter", pupil_diameter), "0.1 to 9 mm"
        raise InputError(f"{value}, but must be from {bounds}: {remedy}.")


def warn_if_artificial(pupil_diameter: float) -> None:
    """Warn about a pupil (m) smaller than any natural one."""
    if pupil_diameter < USUAL_PUPIL:
        text = (
            f"a pupil of {1e3 * pupil_diameter:g} mm is smaller than any natural pupil, and is assumed to be artificial"
        )
        warn(text)


def wavelengths(wavelength_nm: ArrayLike, name: str = "wavelength_nm") -> FloatArray:
    """Return wavelengths as an array; raise `InputError` unless all are visible (380 to 780 nm)."""
    return WAVELENGTHS.of(name, wavelength_nm)


def ordered_times(times: ArrayLike) -> FloatArray:
    """Return times in seconds as an array; raise `InputError` unless they increase."""
    array = check_finite("times", times, "seconds")
    if array.ndim > 1 or not np.all(np.diff(np.atleast_1d(array)) > 0):
        raise InputError(f"times is {described(times)}, but each moment must be later than the one before: sort them.")
    return array


Pupil = Annotated[float, Check(check_pupil)]
"""Diameter of a pupil in metres."""
