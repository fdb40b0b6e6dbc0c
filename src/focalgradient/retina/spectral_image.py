"""Radiance of a picture, and irradiance of its retinal image, at each wavelength, to be saved for ISETBio."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.errors import check_number
from focalgradient.eye.age import FUNDAMENTALS_AGE, lens_density
from focalgradient.eye.cones import Cones
from focalgradient.eye.light import luminosity
from focalgradient.eye.photons import LUMENS_PER_WATT
from focalgradient.eye.protocol import EyeModel, check_eye
from focalgradient.eye.ranges import check_kind
from focalgradient.eye.ranges import wavelengths as visible
from focalgradient.eye.spectral import SpectralPicture
from focalgradient.progress import Progress, silent
from focalgradient.render import blur_picture
from focalgradient.retina.isetbio import FOCAL_LENGTH, SpectralImage

__all__ = ["retinal_spectra", "scene_spectra"]


WAVELENGTHS: tuple[float, ...] = tuple(range(400, 701, 10))
"""Wavelengths in nm unless given: those of ISETBio's scenes."""

LUMINANCE = 100.0
"""Luminance of white in cd/m^2 unless given: an indoor scene or a display, a choice."""

REMEDY = "make it with SpectralPicture.of or SpectralPicture.of_srgb"


def scene_spectra(
    picture: SpectralPicture,
    *,
    pixel_angle: float,
    distance: float = 1.0,
    luminance: float = LUMINANCE,
    wavelength_nm: ArrayLike = WAVELENGTHS,
) -> SpectralImage:
    """Return the radiance of a picture in W/sr/m^2/nm, a ``scene`` for `save_isetbio`.

    Parameters
    ----------
    picture
        Picture of known spectra: `SpectralPicture.of` for grey pictures and displays, `of_srgb` for surfaces.
    pixel_angle
        Angle of a pixel in radians.
    distance
        Distance of the scene in metres; ISETBio has one for the whole scene.
    luminance
        Luminance of white in cd/m^2.
    wavelength_nm
        N wavelengths in nm; light outside the range of the picture's spectra is 0.

    Raises
    ------
    InputError
        If a number is out of range, or an amount of the picture is negative.

    Examples
    --------
    >>> white = SpectralPicture.of_srgb(np.ones((2, 3, 3)), "D65")
    >>> scene = scene_spectra(white, pixel_angle=np.radians(0.5), luminance=100.0)
    >>> scene.energy.shape, round(scene.field_deg, 2)
    ((2, 3, 31), 1.5)
    >>> round(float(683 * 10 * luminosity(scene.wavelength_nm) @ scene.energy[0, 0]))  # cd/m^2, by sums of 10 nm
    100
    """
    check_kind("picture", picture, SpectralPicture, REMEDY)
    check_number("pixel_angle", pixel_angle, "radians", positive=True)
    check_number("luminance", luminance, "cd/m^2", positive=True)
    nm = np.atleast_1d(visible(wavelength_nm))
    basis = picture.basis
    basis_nm = np.asarray(basis.wavelength_nm, dtype=float)
    step = basis_nm[1] - basis_nm[0]
    of_white = LUMENS_PER_WATT * step * float(luminosity(basis_nm) @ np.asarray(basis.white))
    spectra = np.stack(
        [np.interp(nm, basis_nm, spectrum, left=0.0, right=0.0) for spectrum in np.asarray(basis.radiance).T]
    )
    energy = np.asarray(picture.amounts) @ spectra * (luminance / of_white)
    field_deg = math.degrees(2 * math.atan(picture.shape[1] * pixel_angle / 2))
    return SpectralImage(energy, nm, field_deg, distance)


def retinal_spectra(
    picture: SpectralPicture,
    distance: ArrayLike,
    eye: EyeModel,
    *,
    pixel_angle: float,
    age: float = FUNDAMENTALS_AGE,
    luminance: float = LUMINANCE,
    wavelength_nm: ArrayLike = WAVELENGTHS,
    progress: Progress | None = None,
) -> SpectralImage:
    """Return the irradiance of the retina by a picture in W/m^2/nm, an ``oi`` for `save_isetbio`.

    Each wavelength is blurred by waves in its own focus. The irradiance is the radiance times the solid angle of the
    pupil from the retina, pi (d / 2)^2 / f^2 with the focal length f of 17.19 mm of ISETBio's human optics, and the
    transmittance of the ocular media (`lens_density`).

    Parameters
    ----------
    picture
        As for `scene_spectra`.
    distance
        Distance in metres of what each pixel shows, H x W.
    eye
        The eye; its wavelength is ignored.
    pixel_angle
        Angle of a pixel in radians.
    age
        Age in years of the eye's lens: by default that of the cone fundamentals.
    luminance, wavelength_nm
        As for `scene_spectra`.
    progress
        Called with the share done, 0 to 1, and a short description.

    Raises
    ------
    InputError
        If a number is out of range, or shapes do not agree.

    Examples
    --------
    A white surface of 100 cd/m^2 through 4 mm gives 1257 trolands: 4.25 photopic lux before the absorption by the lens.

    >>> white = SpectralPicture.of_srgb(np.ones((8, 8, 3)), "D65")
    >>> from focalgradient import Eye
    >>> seen = retinal_spectra(white, np.ones((8, 8)), Eye(0.004, 1.0), pixel_angle=3e-4)
    >>> passed = 10 ** -lens_density(seen.wavelength_nm, 32)
    >>> round(float(683 * 10 * luminosity(seen.wavelength_nm) @ (seen.energy[4, 4] / passed)), 2)
    4.25
    """
    check_eye("eye", eye)
    scene = scene_spectra(picture, pixel_angle=pixel_angle, luminance=luminance, wavelength_nm=wavelength_nm)
    nm = np.asarray(scene.wavelength_nm)
    passed = math.pi * (eye.aperture_diameter / 2) ** 2 / FOCAL_LENGTH**2 * 10 ** -lens_density(nm, age)
    seen = np.empty_like(scene.energy)
    for number, wavelength in enumerate(nm.tolist()):
        (progress or silent)(number / nm.size, f"blurring light of {wavelength:g} nm")
        cones = Cones(eye, f"{wavelength:g} nm", (wavelength,))
        light = blur_picture(scene.energy[..., number], distance, cones, pixel_angle=pixel_angle)
        seen[..., number] = np.clip(light, 0, None) * passed[number]  # rounding leaves values just below 0
    return SpectralImage(seen, nm, scene.field_deg, is_retinal=True)
