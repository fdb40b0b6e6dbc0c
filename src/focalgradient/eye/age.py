"""Age-dependent properties of the eye: pupil diameter, amplitude of accommodation, and lens density."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import checked
from focalgradient.eye.light import Light
from focalgradient.eye.ranges import AGE, AGES, wavelengths
from focalgradient.quantities import Range, Values

__all__ = ["accommodation_amplitude", "aged_light", "lens_density", "natural_pupil", "push_up_amplitude"]

YOUNGEST, OLDEST = 20.0, 83.0
"""Age range in years of the people to whom Watson & Yellott fitted their formula."""

REFERENCE_AGE = 28.58
"""Mean age in years in the data of Stanley & Davies (1995), the reference of the age term (Watson & Yellott 2012)."""

ONE_EYE = 0.1
"""Effective flux with one eye open, relative to two eyes (Watson & Yellott 2012)."""

FUNDAMENTALS_AGE = 32.0
"""Age in years of the lens in the cone fundamentals (CIE 170-1:2006)."""


MeasuredAge = Annotated[float, Range("years", YOUNGEST, OLDEST, remedy="give the pupil's diameter for other ages")]


@checked
def natural_pupil(
    luminance: Annotated[ArrayLike, Values("cd/m^2", 0)],
    *,
    age: MeasuredAge = REFERENCE_AGE,
    field_deg: Annotated[float, Range("degrees", positive=True)] = 20.0,
    eyes: Literal[1, 2] = 2,
) -> FloatArray:
    """Return the diameter in metres of the light-adapted pupil, by Watson & Yellott's unified formula.

    D = S + (age - 28.58) (0.02132 - 0.009562 S), S the formula of Stanley & Davies (1995), of the product of luminance,
    field area, and 1 or (with one eye) 0.1 (Watson & Yellott 2012, "A unified formula for light-adapted pupil size",
    J. Vis. 12(10):12, equation 21).

    Parameters
    ----------
    luminance
        Luminance of the field in cd/m^2; any shape.
    age
        Years, 20 to 83.
    field_deg
        Diameter of the round field that has this luminance, in degrees.
    eyes
        Number of eyes that see it, 1 or 2.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    At 100 cd/m^2 the pupil of 80 years is a millimetre smaller than that of 20.

    >>> (1e3 * natural_pupil(100.0, age=20)).round(2).item(), (1e3 * natural_pupil(100.0, age=80)).round(2).item()
    (3.92, 3.03)
    """
    flux = np.asarray(luminance, float) * np.pi * (field_deg / 2) ** 2 * (ONE_EYE if eyes == 1 else 1.0)
    power = (flux / 846) ** 0.41
    mm = 7.75 - 5.75 * power / (power + 2)
    return np.asarray(1e-3 * (mm + (age - REFERENCE_AGE) * (0.02132 - 0.009562 * mm)))


def accommodation_amplitude(age: ArrayLike) -> FloatArray:
    """Return the objective amplitude of accommodation in dioptres: 7.083 / (1 + exp(0.2031 (age - 36.2) - 0.6109)).

    Fitted to people of 3 to 70 years (Anderson, Hentz, Glasser, Stuebing & Manny 2008, Invest. Ophthalmol. Vis. Sci.
    49, 2919).

    >>> accommodation_amplitude([10, 30, 45, 60]).round(2).tolist()
    [7.06, 6.14, 1.67, 0.1]
    """
    return np.asarray(7.083 / (1 + np.exp(0.2031 * (AGES.of("age", age) - 36.2) - 0.6109)))


def push_up_amplitude(age: ArrayLike) -> FloatArray:
    """Return the mean push-up amplitude of accommodation in dioptres: 18.5 - 0.30 age (Hofstetter 1950).

    Not below 0. It includes the depth of focus: compare `accommodation_amplitude`.

    >>> push_up_amplitude([20, 40, 70]).round(1).tolist()
    [12.5, 6.5, 0.0]
    """
    return np.maximum(18.5 - 0.30 * AGES.of("age", age), 0.0)


def lens_density(wavelength_nm: ArrayLike, age: float) -> FloatArray:
    """Return the optical density (log10) of the ocular media at each wavelength (nm, any shape), for one `age` (years).

    van de Kraats & van Norren (2007, J. Opt. Soc. Am. A 24, 1842), in the form of CIE 203:2012 with its erratum:
    Rayleigh scatter, tryptophan, the young lens, two parts of the old lens, and a neutral part.

    >>> lens_density([420, 450, 560], 32).round(3).tolist(), lens_density([420, 450, 560], 70).round(3).tolist()
    ([0.643, 0.266, 0.114], [1.25, 0.616, 0.166])
    """
    AGE.check("age", age)
    nm, square = wavelengths(wavelength_nm), age**2
    return np.asarray(
        (0.15 + 0.000031 * square) * (400 / nm) ** 4
        + 14.19 * 10.68 * np.exp(-((0.057 * (nm - 273)) ** 2))
        + (1.05 - 0.000063 * square) * 2.13 * np.exp(-((0.029 * (nm - 370)) ** 2))
        + (0.059 + 0.000186 * square) * 11.95 * np.exp(-((0.021 * (nm - 325)) ** 2))
        + (0.016 + 0.000132 * square) * 1.43 * np.exp(-((0.008 * (nm - 325)) ** 2))
        + 0.06
    )


def aged_light(light: Light, age: float) -> Light:
    """Convert what cones catch of a light through a lens of 32 years to a lens of this `age` (years).

    The cone fundamentals, and so `band_light`, are of 32 years. Give it to `Cones.in_light`.

    >>> from focalgradient.eye.light import band_light
    >>> [round(aged_light(band_light("S", "D65"), age).effective_wavelength_nm) for age in (20, 32, 70)]
    [448, 450, 457]
    """
    nm = np.asarray(light.wavelength_nm, dtype=float)
    return Light(nm, np.asarray(light.weight) * lens_passes(nm, age))


def lens_passes(wavelength_nm: ArrayLike, age: float) -> FloatArray:
    """Return the transmittance of a lens of this `age` (years) over that at 32 years, by wavelength (nm, any shape).

    >>> lens_passes([420, 560], 70).round(2).tolist()
    [0.25, 0.89]
    """
    return np.asarray(10 ** (lens_density(wavelength_nm, FUNDAMENTALS_AGE) - lens_density(wavelength_nm, age)))
