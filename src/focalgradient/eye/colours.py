"""Cone catches: responses of L, M and S cones to a picture on a display, or to a spectral scene."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_one_of
from focalgradient.eye.light import cone_fundamentals, illuminant, spectra
from focalgradient.eye.ranges import wavelengths

__all__ = ["PRIMARIES", "band_image", "cone_images"]

PRIMARIES = "Typical CRT Brainard 1997"
"""Default display, whose primaries red, green and blue refer to."""


def cone_images(image: ArrayLike, *, primaries: str = PRIMARIES, wavelength_nm: ArrayLike | None = None) -> FloatArray:
    """Return the catches of the L, M and S cones at every pixel, scaled to 1 where all channels are 1.

    A class that catches none of the wavelengths, as S cones of red light only, is 0 everywhere.

    Parameters
    ----------
    image
        Linear radiance, H x W x channels: red, green and blue of a display, or one channel per wavelength.
    primaries
        The display's name in colour-science, which knows the spectra of its red, green and blue light.
    wavelength_nm
        For a spectral scene, the wavelength of each channel in nm, increasing; a channel then holds the spectral
        radiance there.

    Returns
    -------
    ndarray
        H x W x 3.

    Raises
    ------
    InputError
        If channels and light do not pair, a wavelength is out of range or not above the one before, the display is
        unknown, or colour-science is not installed.

    Examples
    --------
    Red light reaches L cones above all, blue light S cones.

    >>> red, blue = cone_images([[[1, 0, 0], [0, 0, 1]]])[0].round(2).tolist()
    >>> red, blue
    ([0.27, 0.11, 0.02], [0.09, 0.14, 0.89])
    """
    image = np.asarray(image, dtype=float)
    caught = _of_display(primaries) if wavelength_nm is None else _of_wavelengths(np.asarray(wavelength_nm, float))
    if image.ndim != 3 or image.shape[-1] != len(caught):
        kinds = "red, green and blue" if wavelength_nm is None else "the wavelengths given"
        raise InputError(
            f"image has shape {image.shape}, but must be H x W x {len(caught)}: one channel for each of {kinds}."
        )
    whole = caught.sum(axis=0)
    return np.asarray(image @ (caught / np.where(whole > 0, whole, 1.0)))


def band_image(cones: NDArray[np.floating], band: str) -> FloatArray:
    """Return a band's image from `cone_images`: "S" alone, or "L+M" weighted by each class's catch of daylight.

    >>> band_image(np.array([[[1.0, 0.5, 0.2]]]), "S").tolist()
    [[0.2]]
    """
    check_one_of("band", band, ["L+M", "S"])
    if band == "S":
        return np.asarray(cones[..., 2], dtype=float)
    share = _white()[:2] / _white()[:2].sum()
    return np.asarray(cones[..., :2] @ share, dtype=float)


@lru_cache(maxsize=1)
def _white() -> FloatArray:
    nm = np.arange(390.0, 781.0, 5.0)
    return np.asarray(illuminant(nm, "D65") @ cone_fundamentals(nm))


@lru_cache(maxsize=8)
def _of_display(name: str) -> FloatArray:
    """Return the catch of each cone class of each primary: 3 x 3."""
    nm, light = display_primaries(name)
    return np.asarray(light.T @ cone_fundamentals(nm))


def display_primaries(name: str) -> tuple[FloatArray, FloatArray]:
    """Return the wavelengths (nm) and measured spectra (x 3) of a display's red, green and blue primaries."""
    known = spectra().MSDS_DISPLAY_PRIMARIES
    check_one_of("primaries", name, known)
    return np.asarray(known[name].wavelengths, float), np.asarray(known[name].values, float)


def _of_wavelengths(nm: FloatArray) -> FloatArray:
    """Return the catch of each cone class at each wavelength, weighted by the channel's width: channels x 3."""
    wavelengths(nm)
    if nm.ndim != 1 or nm.size < 2 or np.any(np.diff(nm) <= 0):
        raise InputError("wavelength_nm must be a list of two or more that increase: sort the channels by wavelength.")
    return cone_fundamentals(nm) * np.gradient(nm)[:, None]
