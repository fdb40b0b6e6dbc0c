"""The protocol that eyes implement: an `Eye`, or an eye model of one's own."""

from __future__ import annotations

from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, described
from focalgradient.eye.chromatic import chromatic_difference
from focalgradient.optics import Optics
from focalgradient.optics.protocol import Transfer
from focalgradient.quantities import Check

__all__ = ["EyeModel", "check_eye", "chromatic_scale", "is_eye"]

METHODS = ("focus_in", "in_light", "through_focus", "refocused")

ENDS_NM = (450.0, 650.0)
"""Wavelengths between which the difference in focus is measured."""


class EyeModel(Optics, Protocol):
    """Optics of an eye in light of one wavelength at one moment: `Optics` whose focus depends on the wavelength.

    Optional, as of an `Eye`: ``isotropic``, ``optical_transfer`` where whole grids have a quicker way than
    ``through_focus``, ``pupil(vergence)`` for `point_spread`, ``mirrored()`` for `TwoEyes.of`, ``aberrated(terms)`` for
    `off_axis`, ``aberrations``, ``stiles_crawford`` and ``lens``.
    """

    def focus_in(self, wavelength_nm: ArrayLike) -> FloatArray:
        """Return the vergence (D) of the plane in focus in light of each wavelength (nm, any shape)."""

    def in_light(self, wavelength_nm: float) -> EyeModel:
        """Return the same eye at the same moment in light of another wavelength (nm)."""

    def through_focus(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike) -> Transfer:
        """Return the OTF in the eye's light at each of the L vergences (D): L x the frequencies' shape."""

    def refocused(self, vergence: float) -> EyeModel:
        """Return the same eye with its plane of focus, in its own light, at another vergence (D)."""


def is_eye(optics: object) -> bool:
    """Return whether `optics` implement `EyeModel`."""
    return hasattr(optics, "aperture_diameter") and all(callable(getattr(optics, name, None)) for name in METHODS)


def check_eye(name: str, eye: object, *methods: str) -> None:
    """Raise `InputError` unless `eye` implements `EyeModel` and these further `methods`.

    >>> check_eye("eye", 3)
    Traceback (most recent call last):
    focalgradient.errors.InputError: eye is 3, but must be an Eye: give Eye(pupil_diameter, accommodation), or a class \
with focus_in, in_light, through_focus, refocused.
    """
    if not (is_eye(eye) and all(callable(getattr(eye, method, None)) for method in methods)):
        raise InputError(
            f"{name} is {described(eye)}, but must be an Eye: give Eye(pupil_diameter, accommodation), or a class with "
            f"{', '.join((*METHODS, *methods))}."
        )


AnyEye = Annotated[EyeModel, Check(check_eye, named=True)]
"""An `Eye`, or an eye model of one's own."""


def chromatic_scale(eye: Any) -> float:
    """Return the chromatic aberration of an eye as a multiple of the mean eye's.

    >>> from focalgradient import Eye
    >>> chromatic_scale(Eye(0.004, 1.0, chromatic_scale=0.8))
    0.8
    """
    foci, mean = eye.focus_in(np.array(ENDS_NM)), chromatic_difference(np.array(ENDS_NM))
    return round(float((foci[0] - foci[1]) / (mean[1] - mean[0])), 7)
