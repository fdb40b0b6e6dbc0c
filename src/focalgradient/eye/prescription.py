"""Pupil, focus and astigmatism of the eye of a refraction and an age."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from focalgradient.errors import InputError, check_number
from focalgradient.eye.age import REFERENCE_AGE, accommodation_amplitude, natural_pupil
from focalgradient.eye.ranges import AGE, check_pupil
from focalgradient.eye.refraction import Correction, Refraction, focus_of, worn_of
from focalgradient.eye.wavefront import Aberrations, added_terms, check_aberrations

__all__ = ["PersonalOptics"]

LUMINANCE, FIELD_DEG = 100.0, 20.0
"""Adapting field of the natural pupil, unless given: cd/m^2, an indoor scene or a display, and degrees; choices."""

SMALLEST_UM = 1e-12
"""Magnitude in micrometres below which an astigmatic term is a rounding error."""


class PersonalOptics(NamedTuple):
    """What `Eye` is given of a person; None: unknown."""

    refraction: Refraction | str | None
    age: float | None
    looking_at: float | None
    response: float | None
    correction: Correction | str | None
    luminance: float | None
    field_deg: float | None

    @property
    def has_optics(self) -> bool:
        """Whether an eye's optics follow: from a refraction or an age."""
        return self.refraction is not None or self.age is not None

    def prescribed(self, pupil_diameter: float | None, aberrations: Aberrations) -> tuple[float, float, Aberrations]:
        """Return pupil (m), mean vergence in focus at 580 nm (D) and Zernike terms of the eye.

        Of a pupil (m; None: its natural one) and further `aberrations`.

        Raises
        ------
        InputError
            If the refraction cannot be read, a number is out of its range, or two arguments contradict each other.

        Examples
        --------
        >>> found = PersonalOptics("-2.00", *[None] * 6).prescribed(0.004, ())
        >>> round(found[1], 2)  # the far point of 1 / 2 m before the spectacles, from the cornea
        1.95
        """
        if self.looking_at is not None and self.response is not None:
            raise InputError("looking_at and response both give the accommodation: give one of them.")
        for name in ("luminance", "field_deg"):
            if pupil_diameter is not None and getattr(self, name) is not None:
                raise InputError(f"pupil_diameter and {name} both give the pupil: give one of them.")
        check_aberrations(aberrations)
        if self.age is not None:
            AGE.check("age", self.age)
        written = Refraction() if self.refraction is None else self.refraction
        written = Refraction.parse(written) if isinstance(written, str) else written
        worn = worn_of(self.correction)
        focus = focus_of(written, self._response(written, worn), worn)
        pupil = pupil_diameter
        if pupil is None:
            pupil = float(
                natural_pupil(
                    LUMINANCE if self.luminance is None else self.luminance,
                    age=REFERENCE_AGE if self.age is None else self.age,
                    field_deg=FIELD_DEG if self.field_deg is None else self.field_deg,
                )
            )
        check_pupil(pupil)
        # As the defocus term is V r^2 / (4 sqrt 3), those of astigmatism are J r^2 / (2 sqrt 6); r in mm.
        um = (1e3 * pupil / 2) ** 2 / (2 * math.sqrt(6))
        own = (2, 2, um * float(focus[0, 0] - focus[1, 1]) / 2), (2, -2, um * float(focus[0, 1]))
        return pupil, float(np.trace(focus)) / 2, added_terms(*own, *aberrations, least=SMALLEST_UM)

    def _response(self, refraction: Refraction, worn: Correction) -> float:
        """Return the dioptres by which the eye accommodates."""
        age, response = self.age, self.response
        if response is None:
            return worn.response(refraction, self.looking_at or 0.0, age)
        check_number("response", response, "dioptres", least=0)
        if age is not None and response > (most := float(accommodation_amplitude(age))) * (1 + 1e-9):
            raise InputError(
                f"response is {response:g}, but at an age of {age:g} eyes accommodate by {most:.2g} dioptres at most: "
                "give no more, or leave out the age."
            )
        return response
