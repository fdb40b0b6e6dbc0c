"""Pictures of known spectra: the light of each pixel is a mix of a few spectra, such as a display's primaries.

One rendering for all that an eye sees of a colour picture: every part of the mix, as the cones of a class catch it, is
blurred by the transfer of these cones in the light of its own spectrum. A reflectance in sRGB becomes a spectrum by the
basis of Mallett and Yuksel (2019), whose three functions add up to 1: white is the illuminant itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_finite, described
from focalgradient.eye.age import lens_passes
from focalgradient.eye.colours import PRIMARIES, display_primaries
from focalgradient.eye.cones import Cones, Resolved
from focalgradient.eye.light import Band, Light, band_sensitivity, illuminant, spectra
from focalgradient.eye.protocol import EyeModel
from focalgradient.eye.ranges import wavelengths as visible
from focalgradient.render import blur_picture

__all__ = ["SpectralBasis", "SpectralPicture", "band_picture"]

CLASSES: tuple[Band, ...] = ("L", "M", "S")
"""The cone classes, in the order of catches."""

STEP_NM = 5.0
"""Distance between the wavelengths of reflectances and illuminants (nm), from 390 to 780 nm."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpectralBasis:
    """The spectra of which the light of every pixel is a mix.

    Parameters
    ----------
    wavelength_nm
        N wavelengths in nm, increasing and evenly spaced.
    radiance
        Spectral radiance of each component of amount 1, N x K, in any unit.
    white
        Spectral radiance (N) of which every band of cones sees 1.

    Raises
    ------
    InputError
        If the shapes do not agree, a wavelength is out of range, or white is dark.

    Examples
    --------
    >>> basis = SpectralBasis.of_srgb("D65")
    >>> basis.radiance.shape, bool(np.allclose(basis.radiance.sum(axis=1), basis.white, rtol=1e-4))
    ((79, 3), True)
    """

    wavelength_nm: FloatArray
    radiance: FloatArray
    white: FloatArray

    def __post_init__(self) -> None:
        visible(self.wavelength_nm)
        shape = np.shape(self.wavelength_nm)
        if len(shape) != 1 or np.ndim(self.radiance) != 2 or (len(self.radiance), *shape) != (*shape, len(self.white)):
            raise InputError(
                f"wavelength_nm, radiance and white have shapes {shape}, {np.shape(self.radiance)} and "
                f"{np.shape(self.white)}, but must be N, N x K and N: give each spectrum as a column."
            )
        steps = np.diff(self.wavelength_nm)
        if shape[0] < 2 or np.any(steps <= 0) or np.ptp(steps) > 1e-6 * steps.max():
            raise InputError("wavelength_nm must increase by even steps: interpolate the spectra to such wavelengths.")
        if np.any(np.asarray(self.radiance) < 0) or not np.sum(self.white) > 0:
            raise InputError("radiance holds negative values, or white is dark, but spectra of light are 0 or more.")

    @classmethod
    @lru_cache(maxsize=16)
    def grey(cls, light: str = "D65") -> SpectralBasis:
        """Return surfaces that reflect all wavelengths alike, in the `light` of an illuminant: one component."""
        nm = np.asarray(np.arange(390.0, 780.0 + 1e-6, 1.0), np.float64)  # as `band_light` has it
        return cls.of_reflectances(nm, np.ones((len(nm), 1)), light)

    @classmethod
    @lru_cache(maxsize=16)
    def of_srgb(cls, light: str = "D65") -> SpectralBasis:
        """Return reflectances from linear sRGB by Mallett and Yuksel (2019), in the `light` of an illuminant."""
        basis = spectra().recovery.MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019
        nm = np.asarray(np.arange(390.0, 780.0 + 1e-6, STEP_NM), np.float64)
        own = np.stack([np.interp(nm, basis.wavelengths, column) for column in basis.values.T], axis=1)
        return cls.of_reflectances(nm, own, light)

    @classmethod
    @lru_cache(maxsize=8)
    def of_display(cls, primaries: str = PRIMARIES) -> SpectralBasis:
        """Return the measured red, green and blue light of a display."""
        nm, light = display_primaries(primaries)
        return cls(nm, light, light.sum(axis=1))

    @classmethod
    def of_reflectances(cls, wavelength_nm: ArrayLike, reflectances: ArrayLike, light: str = "D65") -> SpectralBasis:
        """Return measured reflectances (N x K, 0 to 1) in the `light` of an illuminant.

        >>> flat = SpectralBasis.of_reflectances([400, 550, 700], [[0.5], [0.5], [0.5]], "E")
        >>> flat.catch("S").round(3).tolist()  # of the S cones' catch of white
        [0.5]
        """
        nm = np.asarray(wavelength_nm, dtype=float)
        values = check_finite("reflectances", reflectances, "shares of the light")
        white = illuminant(nm, light)
        if values.ndim != 2 or len(values) != len(nm):
            raise InputError(f"reflectances has shape {values.shape}, but must be {len(nm)} x K: one row a wavelength.")
        return cls(nm, values * white[:, None], white)

    def through_lens(self, age: float) -> SpectralBasis:
        """Return the same spectra as a lens of this `age` (years) passes them, from what one of 32 passes.

        The cone fundamentals are of 32 years. White is seen through the same lens, and stays 1.

        >>> young, old = (SpectralBasis.of_srgb("D65").through_lens(age) for age in (20, 80))
        >>> [round(one.mixed("S", [1, 1, 1]).effective_wavelength_nm) for one in (young, old)]
        [448, 459]
        """
        nm = np.asarray(self.wavelength_nm)
        passed = lens_passes(nm, age)
        return SpectralBasis(nm, np.asarray(self.radiance) * passed[:, None], np.asarray(self.white) * passed)

    @property
    def components(self) -> int:
        """Number of spectra."""
        return int(np.shape(self.radiance)[1])

    def catch(self, band: str) -> FloatArray:
        """Return what a band's cones catch of each component (K), over what they catch of white."""
        seen = band_sensitivity(band, self.wavelength_nm)
        return np.asarray(seen @ self.radiance / (seen @ self.white))

    @property
    def class_catches(self) -> FloatArray:
        """Catch of each component by L, M and S cones (3 x K), over what they catch of white."""
        return np.stack([self.catch(band) for band in CLASSES])

    def cones(self, eye: EyeModel, band: str, **resolved: Unpack[Resolved]) -> list[Cones]:
        """Return a band's cones in the light of each component (K); further parameters as for `Cones.in_light`."""
        return [Cones.in_light(eye, band, self.light(band, one), **resolved) for one in range(self.components)]

    def light(self, band: str, component: int) -> Light:
        """Return the light that a band's cones catch of one component."""
        return _caught(self, band, component)

    def mixed(self, band: str, amounts: ArrayLike) -> Light:
        """Return the light that a band's cones catch of a mix of the components (K amounts).

        Red surfaces move the focus of the L and M cones farther, blue ones nearer, than white ones.

        >>> basis = SpectralBasis.of_srgb("D65")
        >>> [round(basis.mixed("L+M", colour).difference(), 2) for colour in ([1, 1, 1], [1, 0, 0], [0, 0, 1])]
        [-0.18, 0.12, -0.65]
        """
        amount = np.asarray(amounts, dtype=float)
        seen = band_sensitivity(band, self.wavelength_nm)
        return Light(np.asarray(self.wavelength_nm), np.clip(seen * (self.radiance @ amount), 0, None))


@lru_cache(maxsize=256)
def _caught(basis: SpectralBasis, band: str, component: int) -> Light:
    return basis.mixed(band, np.eye(basis.components)[component])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpectralPicture:
    """A sharp picture of which every pixel's spectrum is known.

    Parameters
    ----------
    amounts
        Amount of each component of the basis in each pixel, H x W x K, linear.
    basis
        The components' spectra.

    Raises
    ------
    InputError
        If there is not one amount for each component, or one is not finite.

    Examples
    --------
    A red and a blue surface in daylight, as the S cones catch them, of white 1.

    >>> picture = SpectralPicture.of_srgb([[[0.8, 0.1, 0.1], [0.1, 0.1, 0.8]]], "D65")
    >>> picture.catch("S").round(2).tolist()
    [[0.11, 0.72]]
    """

    amounts: FloatArray
    basis: SpectralBasis

    def __post_init__(self) -> None:
        shape = np.shape(check_finite("amounts", self.amounts, "amounts of light"))
        if len(shape) != 3 or shape[2] != self.basis.components:
            raise InputError(
                f"amounts has shape {shape}, but must be H x W x {self.basis.components}: one for each component."
            )

    @classmethod
    def of(cls, picture: ArrayLike | SpectralPicture, light: str = "D65") -> SpectralPicture:
        """Return a picture itself; grey (H x W) in the `light` of an illuminant; or on a display (H x W x 3)."""
        if isinstance(picture, SpectralPicture):
            return picture
        image = np.asarray(picture, dtype=float)
        if image.ndim == 2:
            return cls(image[..., None], SpectralBasis.grey(light))
        return cls(image, SpectralBasis.of_display())

    @classmethod
    def of_srgb(cls, reflectance: ArrayLike, light: str = "D65") -> SpectralPicture:
        """Return surfaces whose reflectance is given in *linear* sRGB (H x W x 3), in the `light` of an illuminant."""
        return cls(np.asarray(reflectance, dtype=float), SpectralBasis.of_srgb(light))

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = np.shape(self.amounts)[:2]
        return height, width

    def __repr__(self) -> str:
        """Size and number of components."""
        height, width = self.shape
        return f"SpectralPicture({height} x {width} pixels of {self.basis.components} spectra)"

    def catch(self, band: str) -> FloatArray:
        """Return what a band's cones catch of the sharp picture (H x W), of white 1."""
        return np.asarray(self.amounts @ self.basis.catch(band))


def band_picture(
    picture: SpectralPicture,
    distance: ArrayLike,
    eye: EyeModel,
    band: str,
    *,
    pixel_angle: float,
    **resolved: Unpack[Resolved],
) -> FloatArray:
    """Return what the cones of a band catch of a picture through an eye, of white 1 (H x W).

    Each component of the picture is blurred in its own light: every wavelength in its own focus.

    Parameters
    ----------
    picture, distance
        The sharp picture, and the distance in metres of what each pixel shows (H x W).
    eye, band
        The eye, and the class of cones: "L+M", "S", "L", "M" or "luminance".
    pixel_angle
        Angle in radians that one pixel subtends.
    wavelengths, finest_cpd, model
        As for `Cones.of`; None is as many wavelengths as the pupil needs.

    Examples
    --------
    >>> grey = SpectralPicture.of(np.full((16, 16), 0.5))
    >>> from focalgradient import Eye
    >>> seen = band_picture(grey, np.ones((16, 16)), Eye(0.003, 1.0), "S", pixel_angle=3e-4)
    >>> bool(np.allclose(seen, 0.5, atol=1e-5))
    True
    """
    if not isinstance(picture, SpectralPicture):
        raise InputError(f"picture is {described(picture)}, but must be a SpectralPicture: make it with one's `of`.")
    seen = np.zeros(picture.shape)
    for number, share in enumerate(picture.basis.catch(band)):
        own = np.ascontiguousarray(picture.amounts[..., number])
        if share > 0 and own.any():
            cones = Cones.in_light(eye, band, picture.basis.light(band, number), **resolved)
            seen += share * blur_picture(own, distance, cones, pixel_angle=pixel_angle)
    return seen
