"""The retinal image of a picture in colour: each wavelength of a display's light in its own focus."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, described
from focalgradient.eye.chromatic import chromatic_difference, chromatic_wavelength
from focalgradient.eye.colours import PRIMARIES, display_primaries
from focalgradient.eye.light import cone_fundamentals
from focalgradient.eye.model_eye import Eye
from focalgradient.eye.parts import fewest, parts_of_focus
from focalgradient.eye.transfer import blur_transfer
from focalgradient.progress import Progress
from focalgradient.render import blur_picture

__all__ = ["caught_by_cones", "parts_needed", "parts_of_light", "retinal_image"]

ENDS_NM = (420.0, 680.0)
"""Wavelengths between which parts of the spectrum are equally wide in focus; the first and the last take what lies
beyond: of a display's light less than 1 % of what the L and M cones catch, and 3 % of what the S cones do."""


def retinal_image(
    picture: ArrayLike,
    distance: ArrayLike,
    eye: Eye,
    *,
    pixel_angle: float,
    wavelengths: int | None = None,
    primaries: str = PRIMARIES,
    progress: Progress | None = None,
) -> NDArray[np.float32]:
    """What a display shows, as it lies on the retina of an eye: light that gives each cone what the blurred light does.

    The spectrum of each of the display's primaries is cut into parts of equal width in focus; each part is blurred in
    the mean focus of its light, by waves, and caught by the L, M and S cones (Stockman and Sharpe 2000). The
    result is the light of the same display that these cones catch alike: negative, or above the display's white, where
    it has no such colour.

    Parameters
    ----------
    picture
        Linear red, green and blue of the display, H x W x 3.
    distance
        Distance in metres of what each pixel shows, H x W.
    eye
        The eye; its wavelength is of no matter.
    pixel_angle
        Angle in radians that one pixel subtends.
    wavelengths
        Parts of the spectrum; None is as many as the pupil and the distances need (see `parts_needed`).
    primaries
        The display's name in colour-science.
    progress
        Called with the share done, 0 to 1, and a few words.

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
    cones, caught = caught_by_cones(
        picture,
        distance,
        eye,
        pixel_angle=pixel_angle,
        wavelengths=wavelengths,
        primaries=primaries,
        progress=progress,
    )
    back: NDArray[np.float32] = (cones @ np.linalg.inv(caught)).astype(np.float32)
    return back


def caught_by_cones(
    picture: ArrayLike,
    distance: ArrayLike,
    eye: Eye,
    *,
    pixel_angle: float,
    wavelengths: int | None,
    primaries: str,
    progress: Progress | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What L, M and S cones catch of the `retinal_image` (H x W x 3), and of each primary (primaries x cones)."""
    image = np.asarray(picture, dtype=float)
    if image.ndim != 3 or image.shape[2] != 3:
        raise InputError(f"picture has shape {image.shape}, but must be H x W x 3: linear red, green and blue.")
    if not isinstance(eye, Eye):
        raise InputError(f"eye is {described(eye)}, but must be an Eye: give Eye(pupil_diameter, accommodation).")
    if wavelengths is None:
        wavelengths = parts_needed(distance, eye, pixel_angle=pixel_angle, primaries=primaries)
    if not (isinstance(wavelengths, int) and 1 <= wavelengths <= 81):
        raise InputError(f"wavelengths is {wavelengths!r}, but must be a whole number from 1 to 81.")
    middles, caught = parts_of_light(wavelengths, primaries)
    cones = np.zeros(image.shape)
    for number, (nm, by_primary) in enumerate(zip(middles, caught, strict=True)):
        if progress is not None:
            progress(number / wavelengths, f"blurring light of {nm:.0f} nm")
        cones += blur_picture(image, distance, eye.in_light(nm), pixel_angle=pixel_angle) @ by_primary
    return cones, np.asarray(caught.sum(axis=0))


def parts_needed(distance: ArrayLike, eye: Eye, *, pixel_angle: float, primaries: str = PRIMARIES) -> int:
    """Return the number of parts of the spectrum that leave a step from black to white right to 0.01 of white.

    A step at the nearest and at the farthest distance, and in focus where that lies between, is blurred with ever more
    parts, until it agrees with 41.

    >>> near_and_far = [0.5, 1.0]
    >>> [parts_needed(near_and_far, Eye(mm / 1000, 1.0), pixel_angle=np.radians(1 / 60)) for mm in (2, 6)]
    [7, 11]
    """
    vergence = 1 / np.asarray(distance, dtype=float)
    low, high = float(vergence.min()), float(vergence.max())
    levels = sorted({low, high, min(max(eye.focus_vergence, low), high)})
    return fewest(lambda count: _steps(count, eye, levels, pixel_angle, primaries))


def _steps(count: int, eye: Eye, levels: list[float], pixel_angle: float, primaries: str) -> NDArray[np.float64]:
    """A step from black to white at each vergence: red, green and blue of its retinal image (levels x 3 x pixels)."""
    middles, caught = parts_of_light(count, primaries)
    white = caught.sum(axis=1) @ np.linalg.inv(caught.sum(axis=0))  # part x channel
    # Two dioptres more than the widest are what light of other wavelengths is out of focus by.
    widest = max(abs(level - eye.focus_vergence) for level in levels) + 2
    side = 2 ** math.ceil(math.log2(64 + 4 * widest * eye.pupil_diameter / pixel_angle))
    frequency = np.fft.rfftfreq(side) / pixel_angle
    steps = np.zeros((len(levels), 3, side))
    for nm, share in zip(middles, white, strict=True):
        for seen, level in zip(steps, levels, strict=True):
            line = np.fft.irfft(blur_transfer(0.0, frequency, eye.in_light(nm), level), side)
            seen += share[:, None] * np.cumsum(np.fft.fftshift(line))
    return steps


def parts_of_light(count: int, primaries: str) -> tuple[list[float], NDArray[np.float64]]:
    """Wavelengths (nm) in whose focus parts of the spectrum are, and cones' catch of each primary (parts x 3 x 3)."""
    nm, spectra = display_primaries(primaries)
    focus = chromatic_difference(nm)
    first, last = chromatic_difference(ENDS_NM).tolist()
    part = parts_of_focus(focus, (first, last), count)
    catches = spectra[:, :, None] * cone_fundamentals(nm)[:, None, :]  # wavelength x primary x cone class
    caught = np.stack([catches[part == number].sum(axis=0) for number in range(count)])
    # Each part is in the mean focus of its light, each primary and cone class counting alike.
    weight = (catches / catches.sum(axis=0)).sum(axis=(1, 2))
    total = np.bincount(part, weight, count)
    edges = np.linspace(first, last, count + 1)
    middle = np.where(total > 0, np.bincount(part, weight * focus, count), (edges[1:] + edges[:-1]) / 2)
    return np.asarray(chromatic_wavelength(middle / np.where(total > 0, total, 1))).tolist(), caught
