"""Retinal image of a colour picture: each wavelength of a display's light in its own focus."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, checked
from focalgradient.eye.chromatic import REFERENCE_NM
from focalgradient.eye.colours import PRIMARIES
from focalgradient.eye.model_eye import Eye
from focalgradient.eye.parts import fewest
from focalgradient.eye.protocol import AnyEye, EyeModel, chromatic_scale
from focalgradient.eye.spectral import CLASSES, SpectralBasis, SpectralPicture, band_picture
from focalgradient.progress import Progress, silent
from focalgradient.quantities import Whole

__all__ = ["caught_by_cones", "parts_needed", "retinal_image"]


def retinal_image(
    picture: ArrayLike,
    distance: ArrayLike,
    eye: EyeModel,
    *,
    pixel_angle: float,
    wavelengths: int | None = None,
    primaries: str = PRIMARIES,
    basis: SpectralBasis | None = None,
    progress: Progress | None = None,
) -> NDArray[np.float32]:
    """Return the retinal image of a picture on a display, as display light that gives each cone the same catch.

    The catch of each cone class (Stockman & Sharpe 2000) of each of the display's primaries is divided into parts of
    equal width in focus, each blurred in the mean focus of its light, by waves (`band_picture`, as in `band_views`).
    The result is the light of the same display with the same catches: negative, or above the display's white, where
    it has no such colour.

    Parameters
    ----------
    picture
        Linear red, green and blue of the display, H x W x 3.
    distance
        Distance in metres of what each pixel shows, H x W.
    eye
        The eye; its wavelength is ignored.
    pixel_angle
        Angle in radians that one pixel subtends.
    wavelengths
        Number of parts of a cone class's catch of a primary; None: enough for the pupil (see `Cones.of`).
    primaries
        The display's name in colour-science.
    basis
        Spectra of red, green and blue, instead of a display's: ``SpectralBasis.of_srgb("A")`` interprets the
        picture as reflectances in linear sRGB in the light of an illuminant, and returns such reflectances.
    progress
        Called with the share done, 0 to 1, and a short description.

    Returns
    -------
    ndarray
        Linear red, green and blue, H x W x 3.

    Raises
    ------
    InputError
        If the picture is not in colour, an argument is out of range, the display is unknown, or colour-science is not
        installed.

    Examples
    --------
    A white point in focus in yellow-green light: blue light is spread beyond it.

    >>> point = np.zeros((31, 31, 3))
    >>> point[15, 15] = 1.0
    >>> seen = retinal_image(point, np.ones((31, 31)), Eye(0.004, 1.0), pixel_angle=np.radians(1 / 60))
    >>> red, green, blue = seen[15, 15].tolist()
    >>> green > 3 * blue, seen.sum(axis=(0, 1)).round(2).tolist()  # light is kept
    (True, [1.0, 1.0, 1.0])
    """
    lights = basis or SpectralBasis.of_display(primaries)
    cones, caught = caught_by_cones(picture, distance, eye, lights, pixel_angle, wavelengths, progress)
    return np.asarray(cones @ np.linalg.inv(caught), np.float32)


@checked
def caught_by_cones(
    picture: ArrayLike,
    distance: ArrayLike,
    eye: AnyEye,
    lights: SpectralBasis,
    pixel_angle: float,
    wavelengths: Annotated[int | None, Whole(1, 81)],
    progress: Progress | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return L, M and S catches of the `retinal_image` (H x W x 3) and of each primary (primaries x cones)."""
    image = np.asarray(picture, dtype=float)
    if image.ndim != 3 or image.shape[2] != 3:
        raise InputError(f"picture has shape {image.shape}, but must be H x W x 3: linear red, green and blue.")
    shown = SpectralPicture(image, lights)
    cones = np.zeros(image.shape)
    for number, band in enumerate(CLASSES):
        (progress or silent)(number / len(CLASSES), f"blurring what {band} cones catch")
        cones[..., number] = band_picture(shown, distance, eye, band, pixel_angle=pixel_angle, wavelengths=wavelengths)
    return cones, shown.basis.class_catches.T


def parts_needed(
    distance: ArrayLike,
    eye: EyeModel,
    *,
    pixel_angle: float,
    primaries: str = PRIMARIES,
    basis: SpectralBasis | None = None,
) -> int:
    """Return the number of parts of each light with which a step from black to white is right to 0.01 of white.

    A step at the nearest and at the farthest distance, and in focus where that lies between, is blurred with ever more
    parts, until it agrees with 41: by the clear pupil of the eye, whose blur changes fastest with the wavelength.

    >>> near_and_far = [0.5, 1.0]
    >>> [parts_needed(near_and_far, Eye(mm / 1000, 1.0), pixel_angle=np.radians(1 / 60)) for mm in (2, 6)]
    [3, 7]
    """
    vergence = 1 / np.asarray(distance, dtype=float)
    low, high = float(vergence.min()), float(vergence.max())
    levels = sorted({low, high, min(max(eye.focus_vergence, low), high)})
    seen = basis or SpectralBasis.of_display(primaries)
    clear = Eye(eye.aperture_diameter, float(eye.focus_in(REFERENCE_NM)), chromatic_scale=chromatic_scale(eye))
    return fewest(lambda count: _steps(count, clear, levels, pixel_angle, seen))


def _steps(count: int, eye: Eye, levels: list[float], pixel_angle: float, basis: SpectralBasis) -> FloatArray:
    """Return the retinal image of a step from black to white at each vergence: levels x 3 x pixels."""
    caught = basis.class_catches
    # Two dioptres more than the widest are what light of other wavelengths is out of focus by.
    widest = max(abs(level - eye.focus_vergence) for level in levels) + 2
    side = 2 ** math.ceil(math.log2(64 + 4 * widest * eye.pupil_diameter / pixel_angle))
    frequency = np.fft.rfftfreq(side) / pixel_angle
    steps = np.zeros((len(CLASSES), len(levels), side))
    for band, shares, seen in zip(CLASSES, caught, steps, strict=True):
        for share, cones in zip(shares, basis.cones(eye, band, wavelengths=count), strict=True):
            for one, level in zip(seen, levels, strict=True):
                line = np.fft.irfft(cones.optical_transfer(0.0, frequency, level), side)
                one += share * np.cumsum(np.fft.fftshift(line))
    return np.einsum("clx,cp->lpx", steps, np.linalg.inv(caught.T))
