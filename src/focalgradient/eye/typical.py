"""Typical aberrations: mean magnitudes published for healthy adults."""

from __future__ import annotations

from focalgradient.errors import InputError
from focalgradient.eye.measured import resized_zernike
from focalgradient.eye.ranges import check_pupil
from focalgradient.eye.wavefront import Aberrations

__all__ = ["typical_aberrations"]

MEASURED = 0.006
"""Diameter in metres of the pupil of `MAGNITUDES`."""

MAGNITUDES: Aberrations = ((3, -1, 0.14), (3, -3, 0.11), (4, 0, 0.13))
"""Mean absolute coefficients (um) of the three largest modes over 6 mm at 550 nm, coma, trefoil and spherical
aberration, of 2560 eyes (Salmon & van de Pol 2006, "Normal-eye Zernike coefficients and root-mean-square wavefront
errors", J. Cataract Refract. Surg. 32, 2064; taken from the abstract). Spherical aberration is positive on average, and
the others are of either sign (Thibos, Hong, Bradley & Cheng 2002, J. Opt. Soc. Am. A 19, 2329): vertical and positive
here, a choice."""


def typical_aberrations(pupil_diameter: float) -> Aberrations:
    """Return the largest Zernike terms (n, m, micrometres) of healthy eyes, with their mean magnitudes.

    Coma 0.14, trefoil 0.11 and spherical aberration 0.13 micrometres over 6 mm. Together they have 0.22 micrometres,
    root mean square; all aberrations of the third order and above have 0.33 in the same eyes on average.

    Parameters
    ----------
    pupil_diameter
        Metres, at most 0.006: over a smaller pupil the same wavefront is cut out, without its tilt and defocus, so that
        the eye stays in focus.

    Raises
    ------
    InputError
        If the pupil is larger than the measured one, or out of range.

    Examples
    --------
    >>> [(n, m, round(um, 3)) for n, m, um in typical_aberrations(0.004)]
    [(3, -3, 0.033), (3, -1, 0.041), (4, 0, 0.026)]
    """
    check_pupil(pupil_diameter)
    if pupil_diameter > MEASURED:
        raise InputError(
            f"typical aberrations are known for pupils up to {1e3 * MEASURED:g} mm, but this one has "
            f"{1e3 * pupil_diameter:.3g}: give a smaller pupil_diameter, or measured coefficients (Eye.from_zernike)."
        )
    return tuple(term for term in resized_zernike(MAGNITUDES, pupil_diameter / MEASURED) if term[0] > 2)
