"""Wave optics of a clear, round, defocused pupil: its transfer function (Hopkins 1955).

The pupil's wavefront departs from the sphere by the defocus x r^2 / 2. The transfer is the autocorrelation of the
pupil: over the overlap of the pupil with its shifted copy, all but one integral are solved analytically. Frequencies
are in cycles per degree of visual angle, where a degree is pi/180 rad.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import check_finite, checked, warn
from focalgradient.eye.quadrature import RADIANS, panels
from focalgradient.eye.ranges import Pupil, Wavelength
from focalgradient.quantities import Range

__all__ = ["clear_transfer", "cutoff_cpd", "mean_eye_mtf", "optical_transfer"]

_CHUNK = 1 << 20  # values at a time, to bound memory


@checked
def cutoff_cpd(pupil_diameter: Pupil, wavelength_nm: Wavelength) -> float:
    """Return the cut-off frequency of a pupil (m) in cycles per degree: diameter / wavelength, per radian.

    >>> round(cutoff_cpd(0.003, 555), 1)
    94.3
    """
    return float(np.pi / 180 * pupil_diameter / (1e-9 * wavelength_nm))


@checked
def optical_transfer(
    frequency_cpd: ArrayLike,
    *,
    pupil_diameter: Pupil,
    wavelength_nm: Wavelength,
    defocus: Annotated[float, Range("dioptres")],
) -> FloatArray:
    """Return the OTF of a clear round pupil with diffraction and defocus: real, negative where contrast reverses.

    With s the frequency over the cut-off and a = pi D d^2 s / wavelength,

        H = (4 / pi) integral from 0 to arccos(s) of sin(t)^2 cos(a (cos(t) - s)) dt

    (Hopkins 1955), by quadrature in as many panels as the phase requires, accurate to about 1e-14.

    Parameters
    ----------
    frequency_cpd
        Cycles per degree, any shape; the sign is ignored.
    pupil_diameter
        Metres.
    wavelength_nm
        Nanometres.
    defocus
        Dioptres; the sign is ignored.

    Returns
    -------
    ndarray
        Of the shape of `frequency_cpd`: 1 at frequency 0, and 0 beyond the cut-off.

    Raises
    ------
    InputError
        If the pupil or the wavelength is not an eye's, or a number is not finite.

    Examples
    --------
    >>> optical_transfer([0, 10, 20], pupil_diameter=0.003, wavelength_nm=555, defocus=1.0).round(4).tolist()
    [1.0, -0.1012, 0.0471]
    """
    frequency = check_finite("frequency_cpd", frequency_cpd, "cycles per degree")
    return clear_transfer(np.degrees(frequency), pupil_diameter, wavelength_nm, defocus)


def clear_transfer(frequency: FloatArray, diameter: float, wavelength_nm: float, defocus: float) -> FloatArray:
    """Return `optical_transfer` of an aperture of any diameter (m), at `frequency` (cycles per radian, any shape)."""
    distinct, where = np.unique(np.abs(frequency), return_inverse=True)  # grids hold each radius up to eight times
    s = distinct * (1e-9 * wavelength_nm / diameter)
    transfer = np.zeros_like(s)
    passed = s < 1
    s = s[passed]
    rate = np.pi * abs(defocus) * diameter**2 / (1e-9 * wavelength_nm) * s
    angle = np.arccos(s)
    # Frequencies whose phase runs about as far share a rule; its length goes in steps of two.
    steps = np.ceil(np.log2(np.maximum(rate * angle / RADIANS, 1))).astype(int)
    values = np.empty_like(s)
    for step in np.unique(steps):
        nodes, weights = panels(RADIANS * (2.0**step - 0.5))
        places = np.flatnonzero(steps == step)
        for some in np.array_split(places, 1 + places.size * nodes.size // _CHUNK):
            t = angle[some, None] * nodes
            waves = np.sin(t) ** 2 * np.cos(rate[some, None] * (np.cos(t) - s[some, None]))
            values[some] = 4 / np.pi * angle[some] * (waves @ weights)
    transfer[passed] = values
    return transfer[where].reshape(frequency.shape)


@checked
def mean_eye_mtf(frequency_cpd: ArrayLike, *, pupil_diameter: Pupil) -> FloatArray:
    """Return the mean radial MTF of best-corrected eyes in white light (Watson 2013).

    (1 + (u / u1)^2)^-0.62 sqrt(D(u)), with u1 = 21.95 - 5.512 d + 0.3922 d^2 (d in mm) and D the transfer of
    diffraction alone at 555 nm: fitted to the wavefronts of 200 eyes with pupils of 2 to 6 mm.

    Parameters
    ----------
    frequency_cpd
        Cycles per degree, any shape.
    pupil_diameter
        Metres.

    Raises
    ------
    InputError
        If the pupil is not an eye's, or a frequency is not finite.

    Warns
    -----
    FocalGradientWarning
        If the pupil is not within the 2 to 6 mm that the formula was fitted to.

    Examples
    --------
    >>> mean_eye_mtf([0, 10, 30], pupil_diameter=0.003).round(3).tolist()
    [1.0, 0.563, 0.164]
    """
    mm = 1e3 * pupil_diameter
    if not 2 - 1e-9 <= mm <= 6 + 1e-9:
        warn(f"the mean eye's transfer was fitted to pupils of 2 to 6 mm, and is extrapolated to one of {mm:.3g} mm.")
    frequency = check_finite("frequency_cpd", frequency_cpd, "cycles per degree")
    corner = 21.95 - 5.512 * mm + 0.3922 * mm**2
    diffraction = optical_transfer(frequency, pupil_diameter=pupil_diameter, wavelength_nm=555, defocus=0)
    return (1 + (frequency / corner) ** 2) ** -0.62 * np.sqrt(np.maximum(diffraction, 0))
