"""Pupil, focus and astigmatism of the eye of a refraction and an age."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from focalgradient.errors import InputError, check_number
from focalgradient.eye.age import REFERENCE_AGE, accommodation_amplitude, natural_pupil
from focalgradient.eye.ranges import AGE, check_pupil
from focalgradient.eye.refraction import Correction, Refraction, focus_of, worn_of
from focalgradient.eye.wavefront import Aberrations, check_aberrations

__all__ = ["Prescribed", "prescribed"]

LUMINANCE, FIELD_DEG = 100.0, 20.0
"""Adapting field of the natural pupil, unless given: cd/m^2, an indoor scene or a display, and degrees; choices."""

SMALLEST_UM = 1e-12
"""Magnitude in micrometres below which an astigmatic term is a rounding error."""


class Prescribed(NamedTuple):
    """Optics of a prescribed eye: pupil (m), mean vergence in focus at 580 nm (D), and Zernike terms."""

    pupil_diameter: float
    accommodation: float
    aberrations: Aberrations


def prescribed(
    *,
    refraction: Refraction | str | None,
    age: float | None,
    looking_at: float | None,
    response: float | None,
    correction: Correction | str | None,
    pupil_diameter: float | None,
    luminance: float | None,
    field_deg: float | None,
    aberrations: Aberrations,
) -> Prescribed:
    """Return the optics of the eye of a refraction and an age: the arguments are those of `Eye`.

    Raises
    ------
    InputError
        If the refraction cannot be read, a number is out of its range, or two arguments contradict each other.

    Examples
    --------
    >>> none = dict.fromkeys(("age", "looking_at", "response", "correction", "luminance", "field_deg"))
    >>> found = prescribed(refraction="-2.00", pupil_diameter=0.004, aberrations=(), **none)
    >>> round(found.accommodation, 2)  # the far point of 1 / 2 m before the spectacles, from the cornea
    1.95
    """
    if looking_at is not None and response is not None:
        raise InputError("looking_at and response both give the accommodation: give one of them.")
    for name, value in (("luminance", luminance), ("field_deg", field_deg)):
        if pupil_diameter is not None and value is not None:
            raise InputError(f"pupil_diameter and {name} both give the pupil: give one of them.")
    check_aberrations(aberrations)
    if age is not None:
        AGE.check("age", age)
    written = _refraction(refraction)
    worn = worn_of(correction)
    focus = focus_of(written, _response(written, worn, age, looking_at, response), worn)
    pupil = pupil_diameter
    if pupil is None:
        pupil = float(
            natural_pupil(
                LUMINANCE if luminance is None else luminance,
                age=REFERENCE_AGE if age is None else age,
                field_deg=FIELD_DEG if field_deg is None else field_deg,
            )
        )
    check_pupil(pupil)
    # As the defocus term is V r^2 / (4 sqrt 3), those of astigmatism are J r^2 / (2 sqrt 6); r in mm.
    um = (1e3 * pupil / 2) ** 2 / (2 * math.sqrt(6))
    own = {(2, 2): um * float(focus[0, 0] - focus[1, 1]) / 2, (2, -2): um * float(focus[0, 1])}
    for n, m, c in aberrations:
        own[n, m] = own.get((n, m), 0.0) + c
    terms = tuple((n, m, c) for (n, m), c in sorted(own.items()) if abs(c) > SMALLEST_UM)
    return Prescribed(pupil, float(np.trace(focus)) / 2, terms)


def _refraction(given: Refraction | str | None) -> Refraction:
    if given is None:
        return Refraction()
    return given if isinstance(given, Refraction) else Refraction.parse(given)


def _response(
    refraction: Refraction, worn: Correction, age: float | None, looking_at: float | None, response: float | None
) -> float:
    """Return the dioptres by which the eye accommodates."""
    if response is None:
        return worn.response(refraction, 0.0 if looking_at is None else looking_at, age)
    check_number("response", response, "dioptres", least=0)
    if age is not None and response > (most := float(accommodation_amplitude(age))) * (1 + 1e-9):
        raise InputError(
            f"response is {response:g}, but at an age of {age:g} eyes accommodate by {most:.2g} dioptres at most: give "
            "no more, or leave out the age."
        )
    return response
