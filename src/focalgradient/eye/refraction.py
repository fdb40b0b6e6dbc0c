"""Ophthalmic prescriptions, and the focus of an eye behind a correcting lens.

A refraction is a sphere, a cylinder and its axis. As a symmetric 2 x 2 matrix R its power in the meridian u is u' R u
(Long 1976; Thibos, Wheeler & Horner 1997, Optom. Vis. Sci. 74, 367, for the power vector M, J0, J45). Vergence passes
lenses and spaces by the scalar formulas: a lens adds its power, and after a distance d vergence is V / (1 - d V).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_one_of, checked, described
from focalgradient.eye.age import accommodation_amplitude
from focalgradient.eye.ranges import Age, Vergence, check_kind
from focalgradient.quantities import Check, Range

__all__ = ["CORRECTIONS", "Correction", "Refraction", "focus_of", "worn_of"]


VERTEX = 0.012
"""Vertex distance of spectacles in metres: 12 mm, at which prescriptions are usually stated (ISO 13666)."""

UNLIMITED = 40.0
"""Amplitude of accommodation in dioptres without an age: more than any distance needs, a choice."""

LARGEST = 30.0
"""Maximum power of a prescription in dioptres: a choice, which rejects other units."""

PARSE = 'give Refraction.parse("-2.00 -0.75 x 180")'
"""Remedy in messages about prescriptions."""

_WRITTEN = re.compile(
    r"\s*(?P<sphere>[+-]?\d+(?:\.\d+)?|plano|pl)\s*(?:DS|D)?\s*"
    r"(?:/?\s*(?P<cylinder>[+-]\d+(?:\.\d+)?)\s*(?:DC)?(?:\s*(?:x|×|@|ax)\s*|\s+)(?P<axis>\d+(?:\.\d+)?)\s*°?)?\s*",
    re.IGNORECASE,
)
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")


@dataclass(frozen=True, slots=True)
class Refraction:
    """Lens that corrects an eye for far vision: negative for a myopic eye.

    Parameters
    ----------
    sphere, cylinder
        Dioptres.
    axis
        Degrees, 0 to 180, counter-clockwise from the horizontal as the examiner sees the eye (TABO): the meridian in
        which the cylinder has no power.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> one = Refraction.parse("-2.00 -0.75 x 180")
    >>> one, [round(part, 3) for part in one.power_vector]
    (Refraction(sphere=-2.0, cylinder=-0.75, axis=180.0), [-2.375, 0.375, 0.0])
    >>> print(one)
    -2.00 -0.75 x 180
    """

    sphere: Annotated[float, Range("dioptres", -LARGEST, LARGEST)] = 0.0
    cylinder: Annotated[float, Range("dioptres", -LARGEST, LARGEST)] = 0.0
    axis: Annotated[float, Range("degrees", 0, 180)] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    @classmethod
    def parse(cls, text: str) -> Refraction:
        """Parse a refraction written as "-2.00", "plano" or "-2.00 -0.75 x 180"; decimal commas are accepted.

        >>> Refraction.parse("-2,25 -0,75 x 80")
        Refraction(sphere=-2.25, cylinder=-0.75, axis=80.0)
        """
        found = _WRITTEN.fullmatch(_DECIMAL_COMMA.sub(".", text.replace("−", "-"))) if isinstance(text, str) else None
        if found is None:
            raise InputError(
                f"refraction is {described(text)}, but must be a sphere, or sphere, cylinder and axis: give it as "
                "-2.00 or -2.00 -0.75 x 180."
            )
        sphere = found["sphere"].lower()
        numbers = (0.0 if sphere in ("plano", "pl") else float(sphere), found["cylinder"], found["axis"])
        return cls(*(float(one or 0) for one in numbers))

    @property
    def power_vector(self) -> tuple[float, float, float]:
        """Mean sphere M and the Jackson cylinders J0 (axes 0 and 90) and J45, in dioptres."""
        turn, half = math.radians(2 * self.axis), -self.cylinder / 2
        j45 = half * math.sin(turn)
        return self.sphere - half, half * math.cos(turn), 0.0 if abs(j45) < 1e-12 else j45

    @property
    def matrix(self) -> FloatArray:
        """Power in every meridian as a symmetric 2 x 2 matrix (D), x to the examiner's right and y up."""
        m, j0, j45 = self.power_vector
        return np.array([[m + j0, j45], [j45, m - j0]])

    def __str__(self) -> str:
        """Return the refraction in written form."""
        sphere = f"{self.sphere:+.2f}" if self.sphere else "plano"
        return f"{sphere} {self.cylinder:+.2f} x {self.axis:.0f}" if self.cylinder else sphere


def _check_refraction(refraction: object) -> None:
    check_kind("refraction", refraction, Refraction, PARSE)


Prescription = Annotated[Refraction, Check(_check_refraction)]


@dataclass(frozen=True, slots=True)
class Correction:
    """Lens worn in front of an eye.

    Parameters
    ----------
    power
        Power of the lens; None corrects the eye's refraction fully.
    vertex
        Metres from the cornea: 0 for a contact lens.

    Raises
    ------
    InputError
        If the distance is negative or above 3 cm.
    """

    power: Refraction | None = None
    vertex: Annotated[float, Range("metres", 0, 0.03)] = VERTEX

    def __post_init__(self) -> None:
        check_fields(self)

    @checked
    def response(self, refraction: Prescription, looking_at: Vergence, age: Age | None = None) -> float:
        """Return the accommodation (D) with which an eye behind this lens focuses `looking_at` (D).

        In the mean of all meridians, not below 0, and no more than the amplitude of its `age` (years; None: no limit).

        >>> [round(CORRECTIONS[name].response(Refraction(-6.0), 2.5), 2) for name in CORRECTIONS]
        [0.0, 2.18, 2.5]
        """
        from scipy.optimize import brentq  # deferred: slow to import

        def miss(response: float) -> float:
            return float(np.trace(focus_of(refraction, response, self))) / 2 - looking_at

        # Focus rises with the response; the amplitude bounds it.
        low, high = 0.0, UNLIMITED if age is None else float(accommodation_amplitude(age))
        return low if miss(low) >= 0 else high if miss(high) <= 0 else float(brentq(miss, low, high, xtol=1e-9))


CORRECTIONS = {
    "none": Correction(Refraction(), 0.0),
    "spectacles": Correction(),
    "contact-lens": Correction(vertex=0.0),
}
"""Corrections by name: none, and those that correct fully."""


def worn_of(correction: Correction | str | None) -> Correction:
    """Return the correction worn, of `CORRECTIONS` if given by its name; None becomes no lens."""
    if correction is None:
        return CORRECTIONS["none"]
    if isinstance(correction, str):
        check_one_of("correction", correction, CORRECTIONS)
        return CORRECTIONS[correction]
    check_kind("correction", correction, Correction, 'give "spectacles", "contact-lens", "none" or Correction(...)')
    return correction


@checked
def focus_of(
    refraction: Prescription, accommodation: Vergence, correction: Correction, *, vertex: float = VERTEX
) -> FloatArray:
    """Return the vergence (D) in front of the eye that is in focus, by meridian: a symmetric 2 x 2 matrix.

    Parameters
    ----------
    refraction
        Refraction of the eye, as prescribed.
    accommodation
        Dioptres by which the lens in the eye is stronger than relaxed.
    correction
        Correction worn.
    vertex
        Vertex distance in metres at which the refraction was prescribed.

    Returns
    -------
    ndarray
        2 x 2, as `Refraction.matrix`; vergences from the cornea.

    Examples
    --------
    A myope of 6 D who accommodates by 2.5 D sees sharply at 0.40 m with contact lenses, and nearer with spectacles.

    >>> myope = Refraction(-6.0)
    >>> [round(float(focus_of(myope, 2.5, CORRECTIONS[name])[0, 0]), 2) for name in CORRECTIONS]
    [8.1, 2.87, 2.5]
    """
    worn_of(correction)
    needed = _moved(refraction.matrix, vertex)
    worn = _moved(needed, -correction.vertex) if correction.power is None else correction.power.matrix
    before = _moved(needed - accommodation * np.eye(2), -correction.vertex) - worn
    return -_moved(before, correction.vertex)


def _moved(vergence: FloatArray, distance: float) -> FloatArray:
    """Return the vergence of light after a `distance` (m) along its path: V / (1 - d V)."""
    return np.asarray(vergence @ np.linalg.inv(np.eye(2) - distance * vergence))
