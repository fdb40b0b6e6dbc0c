"""Light of many wavelengths with weights, and its catch by the cones of an eye.

Sensitivities and daylight spectra come from the library colour-science, which is an extra.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_installed, check_one_of, checked
from focalgradient.eye.chromatic import REFERENCE_NM, chromatic_difference, chromatic_wavelength
from focalgradient.eye.ranges import wavelengths
from focalgradient.quantities import Range

__all__ = [
    "Band",
    "Light",
    "band_difference",
    "band_light",
    "band_sensitivity",
    "cone_fundamentals",
    "illuminant",
    "luminosity",
]

Band = Literal["L+M", "S", "L", "M", "luminance"]
"""Waveband of a view: the cones of one or two classes, or luminance."""


KELVIN = re.compile(r"(\d+(?:\.\d+)?) ?K")
"""Pattern of a light's name that is a black body's temperature."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Light:
    """Light of many wavelengths: wavelengths in nm, and weights in any unit.

    Raises
    ------
    InputError
        If wavelengths and weights do not pair, one is out of range, or all weights are 0.

    Examples
    --------
    >>> light = Light(np.array([450.0, 650.0]), np.array([1.0, 3.0]))
    >>> round(light.difference(), 3), round(light.effective_wavelength_nm, 1)
    (-0.03, 573.8)
    """

    wavelength_nm: NDArray[np.floating]
    weight: NDArray[np.floating]

    def __post_init__(self) -> None:
        wavelengths(self.wavelength_nm)
        if np.ndim(self.wavelength_nm) != 1 or np.shape(self.wavelength_nm) != np.shape(self.weight):
            raise InputError(
                f"wavelength_nm has shape {np.shape(self.wavelength_nm)} and weight {np.shape(self.weight)}, but each "
                "wavelength of a list needs one weight: give two lists of one length."
            )
        if not (np.all(np.asarray(self.weight) >= 0) and 0 < np.sum(self.weight) < np.inf):
            raise InputError(
                "weight holds negative or undefined values, or zeros only, but light is 0 or more: mend it."
            )

    def __repr__(self) -> str:
        """Return number, range and effective wavelength."""
        nm = np.asarray(self.wavelength_nm)
        return (
            f"Light({nm.size} wavelengths, {nm.min():.0f} to {nm.max():.0f} nm, focused as "
            f"{self.effective_wavelength_nm:.0f} nm)"
        )

    @property
    def share(self) -> FloatArray:
        """Weights, normalised to a sum of 1."""
        weight = np.asarray(self.weight, dtype=float)
        return weight / weight.sum()

    def difference(self, reference_nm: float = REFERENCE_NM) -> float:
        """Mean chromatic difference of refraction in dioptres, weighted by the shares."""
        return float(self.share @ chromatic_difference(self.wavelength_nm, reference_nm))

    @property
    def effective_wavelength_nm(self) -> float:
        """Wavelength in nm with the same focus as the mean focus of this light."""
        return float(chromatic_wavelength(self.difference()))


def cone_fundamentals(wavelength_nm: ArrayLike) -> FloatArray:
    """Return energy sensitivities of the L, M and S cones, each with a peak of 1 (Stockman & Sharpe 2000, 2 degrees).

    Parameters
    ----------
    wavelength_nm
        Nanometres, any shape; below 390 nm, where there are no data, sensitivity is taken to be 0.

    Returns
    -------
    ndarray
        Of the shape of `wavelength_nm`, and 3 at the end.

    Raises
    ------
    InputError
        If a wavelength is not between 380 and 780 nm, or colour-science is not installed.

    Examples
    --------
    >>> cone_fundamentals(550).round(3).tolist()
    [0.94, 0.977, 0.002]
    """
    return _read(spectra().MSDS_CMFS["Stockman & Sharpe 2 Degree Cone Fundamentals"], wavelength_nm)


def luminosity(wavelength_nm: ArrayLike) -> FloatArray:
    """Return photopic luminosity V(lambda) of the CIE 2008 (2 degrees), with a peak of 1; as for `cone_fundamentals`.

    >>> round(float(luminosity(550)), 3)
    0.989
    """
    return _read(spectra().SDS_LEFS["CIE 2008 2 Degree Physiologically Relevant LEF"], wavelength_nm)


def illuminant(wavelength_nm: ArrayLike, name: str = "D65") -> FloatArray:
    """Return a light's energy spectrum: "D65", "E" (equal energy), "A", "LED-B1" or another of the CIE; or "3000 K".

    The last is a black body of 1000 to 25,000 K, by Planck's law. All but a few of the CIE's lights are 100 at 560 nm.

    Raises
    ------
    InputError
        If a wavelength is not between 380 and 780 nm, the name is unknown, or colour-science is not installed.

    Examples
    --------
    >>> round(float(illuminant(450, "D65")), 2)
    117.01
    """
    known, kelvin = spectra().SDS_ILLUMINANTS, KELVIN.fullmatch(str(name))
    if kelvin is not None and 1000 <= float(kelvin[1]) <= 25_000:
        planck = spectra().colorimetry.planck_law
        at = wavelengths(wavelength_nm)
        return np.asarray(100 * planck(1e-9 * at, float(kelvin[1])) / planck(560e-9, float(kelvin[1])))
    if name not in known:
        raise InputError(
            f"illuminant is {name!r}, but must be a standard one, such as E, A, D50, D65, LED-B1 or another of the "
            "CIE's; or a black body of 1000 to 25000 K, such as '3000 K'."
        )
    return _read(known[name], wavelength_nm)


@lru_cache(maxsize=32)
@checked
def band_light(
    band: Band, light: str = "E", step_nm: Annotated[float, Range("nanometres", most=50, positive=True)] = 1.0
) -> Light:
    """Return the catch of an illuminant by the cones of a `band`, by wavelength.

    Parameters
    ----------
    band
        "L+M" (the sum of the two sensitivities, each 1 at its peak), "S", "L", "M" or "luminance".
    light
        The illuminant, as for `illuminant`; "E" is equal energy.
    step_nm
        Distance between the wavelengths, from 390 nm to 780 nm.

    Raises
    ------
    InputError
        If the band or the illuminant is unknown, or colour-science is not installed.

    Examples
    --------
    >>> [round(band_light(band, "D65").effective_wavelength_nm) for band in ("L+M", "S")]
    [546, 450]
    """
    nm = np.arange(390, 780 + 1e-6, step_nm)
    return Light(nm, band_sensitivity(band, nm) * illuminant(nm, light))


def band_sensitivity(band: str, wavelength_nm: ArrayLike) -> FloatArray:
    """Return the sensitivity of a `band` at each wavelength (nm, any shape); of L+M the sum, each with a peak of 1.

    >>> band_sensitivity("L+M", [450, 550]).round(3).tolist()
    [0.137, 1.917]
    """
    check_one_of("band", band, get_args(Band))
    if band == "luminance":
        return luminosity(wavelength_nm)
    return cone_fundamentals(wavelength_nm)[..., ["LMS".index(cone) for cone in band.split("+")]].sum(axis=-1)


def band_difference(light: str = "E", chromatic_scale: float = 1.0) -> float:
    """Return the distance in dioptres by which L and M cones together are focused farther than S cones.

    The mean chromatic difference weighted by the bands' catches of an illuminant: the paper's "one dioptre".

    >>> round(band_difference("E"), 3), round(band_difference("D65"), 3)
    (0.823, 0.783)
    """
    return chromatic_scale * (band_light("L+M", light).difference() - band_light("S", light).difference())


def spectra() -> Any:
    """Return the library colour-science, which holds the spectra."""
    check_installed("the light that cones catch", "eye", "colour")
    with np.printoptions():  # colour-science changes how all arrays are printed: not here
        import colour
    return colour


def _read(spectrum: Any, wavelength_nm: ArrayLike) -> FloatArray:
    """Interpolate a spectrum of the library linearly at these wavelengths; 0 outside its range."""
    nm, values = wavelengths(wavelength_nm), np.nan_to_num(spectrum.values).reshape(len(spectrum.wavelengths), -1)
    read = np.stack([np.interp(nm, spectrum.wavelengths, column, left=0, right=0) for column in values.T], axis=-1)
    return read if read.shape[-1] > 1 else read[..., 0]
