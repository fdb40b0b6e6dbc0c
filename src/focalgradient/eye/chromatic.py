"""Longitudinal chromatic aberration: the eye's refraction as a function of wavelength.

Sign: the eye refracts blue more strongly than red. A positive chromatic difference is a *refraction*, the lens that the
eye would need at this wavelength; it is negative for blue, where the eye is too strong. The vergence in focus is
higher by as much as the refraction is lower, so that **a nearer object is sharper in blue**.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, described
from focalgradient.eye.ranges import wavelengths

__all__ = ["PRIMARIES_NM", "REFERENCE_NM", "chromatic_difference", "chromatic_wavelength"]

REFERENCE_NM = 580.0
"""Wavelength in nm at which accommodation is stated: our choice (the formula of Thibos et al. is 0 at 590 nm)."""

PRIMARIES_NM = (611.0, 549.0, 464.0)
"""Dominant wavelengths of the sRGB primaries in nm."""

_LEVEL, _STRENGTH, _POLE = 1.68524, 633.46, 214.102  # Thibos et al. 1992: D, D nm, nm


def chromatic_difference(wavelength_nm: ArrayLike, reference_nm: ArrayLike = REFERENCE_NM) -> FloatArray:
    """Return the chromatic difference of refraction R(wavelength) - R(reference) in dioptres; broadcasts.

    R(l) = 1.68524 - 633.46 / (l - 214.102) of the reduced chromatic eye (Thibos et al. 1992): negative for light
    bluer than the reference, positive for redder. Multiply by an individual's `chromatic_scale` (`Eye`).

    Raises
    ------
    InputError
        If a wavelength is not between 380 and 780 nm.

    Examples
    --------
    >>> chromatic_difference([450, 580, 650]).round(3).tolist()
    [-0.954, 0.0, 0.278]
    """
    light, reference = wavelengths(wavelength_nm), wavelengths(reference_nm, "reference_nm")
    return _STRENGTH / (reference - _POLE) - _STRENGTH / (light - _POLE)


def chromatic_wavelength(difference: ArrayLike, reference_nm: ArrayLike = REFERENCE_NM) -> FloatArray:
    """Return the wavelength in nm whose chromatic difference is `difference` (D): inverts `chromatic_difference`.

    It gives the single wavelength with the mean focus of a band.

    Raises
    ------
    InputError
        If no wavelength between 380 and 780 nm has this difference.

    Examples
    --------
    >>> round(float(chromatic_wavelength(-0.9537)), 1)
    450.0
    """
    below = _STRENGTH / (wavelengths(reference_nm, "reference_nm") - _POLE) - np.asarray(difference, dtype=float)
    with np.errstate(divide="ignore"):
        light = _POLE + _STRENGTH / below
    if not np.all((below > 0) & (light > 380 - 1e-9) & (light < 780 + 1e-9)):
        widest = np.stack([chromatic_difference(nm, reference_nm) for nm in (380, 780)])
        raise InputError(
            f"difference is {described(difference)}, but visible light (380 to 780 nm) differs from the reference, "
            f"{described(reference_nm)} nm, by {widest.min():.2f} to {widest.max():.2f} D only."
        )
    return light.clip(380, 780)
