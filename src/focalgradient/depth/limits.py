"""Information limits of depth from blur: Cramér-Rao bounds for a step edge and for two or more views of a texture.

No unbiased estimate has a smaller standard deviation than these. The derivations are in ``docs/report/limits.md``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.depth.filters import SCENE_SLOPE
from focalgradient.depth.search import view_blur
from focalgradient.depth.settings import blur_source, noise_of_each
from focalgradient.errors import InputError, check_finite
from focalgradient.optics import Optics
from focalgradient.psf import Psf

__all__ = ["Power", "comparison_bound", "edge_bound", "natural_power", "texture_bound", "window_area"]


Power = Callable[[FloatArray], FloatArray]
"""Power spectral density of a texture at frequencies in cycles per pixel: its integral over the plane is variance."""

QUADRATURE_NODES = 160
"""Number of Gauss-Legendre nodes from frequency 0 to 1/2 cycle per pixel, in each direction. Chosen by hand."""


def edge_bound(sigma: ArrayLike, *, noise: float, contrast: float, length: float) -> FloatArray:
    """Return the least standard deviation of sigma, *relative to sigma*, from a step edge of Gaussian blur.

    (4 sqrt(pi))^(1/2) (noise / contrast) / sqrt(length sigma): position and both levels, though unknown, cost nothing
    where the edge is visible well beyond its blur.

    Parameters
    ----------
    sigma
        Standard deviation of the blur in pixels; any shape.
    noise
        Standard deviation of a pixel's noise, in the unit of `contrast`.
    contrast
        Height of the step.
    length
        Pixels along the edge that are used.

    Returns
    -------
    ndarray
        Of the shape of `sigma`.

    Examples
    --------
    >>> round(100 * float(edge_bound(2.0, noise=0.01, contrast=0.5, length=16)), 2)  # per cent
    0.94
    """
    _positive(noise=noise, contrast=contrast, length=length)
    widths = check_finite("sigma", sigma, "pixels")
    if (widths < 0).any():
        raise InputError("sigma contains negative values, but a standard deviation is 0 or more: give it in pixels.")
    with np.errstate(divide="ignore"):
        return math.sqrt(4 * math.sqrt(math.pi)) * noise / contrast / np.sqrt(length * widths)


def comparison_bound(
    optics: Sequence[Optics],
    vergence: ArrayLike,
    pixel_angle: float,
    *,
    power: Power,
    noise: float | Sequence[float],
    area: float,
    psf: Psf | str = "auto",
    k: float | None = None,
) -> FloatArray:
    """Return the least standard deviation of vergence, in dioptres, from views of one unknown texture at one depth.

    The Fisher information about V, the texture being unknown, is

        area x integral of P (sum H_i'^2 - (sum H_i H_i')^2 / sum H_i^2) df,

    with P the power of the texture, H_i view i's transfer over the sd of its noise, and ' the derivative by V. For two
    views the bracket is (H_1 H_2' - H_2 H_1')^2 / (H_1^2 + H_2^2).

    Parameters
    ----------
    optics
        What formed each of the n views.
    vergence
        True vergence in dioptres; any shape.
    pixel_angle
        Angle of a pixel in radians, the same in all views.
    power
        Power of the texture as a sharp view records it (the pixels' own averaging included): see `natural_power`.
    noise
        Standard deviation of a pixel's noise, one for all or one for each view, in the unit of the texture.
    area
        Pixels that an estimate rests on: n^2 for a patch of side n, `window_area` for a Gaussian window.
    psf, k
        Where the blur comes from: as for `focalgradient.recover_depth`. Optics' own blur must be round.

    Returns
    -------
    ndarray
        Of the shape of `vergence`; ``inf`` where blur does not change with vergence.

    Raises
    ------
    InputError
        If a number is not positive, or there are fewer than two views or another number of noises.

    Examples
    --------
    A pinhole view and one with a disc of 2 pixels radius (at 2 D, 1 D from focus), 1 % noise, texture of contrast 0.2:

    >>> from focalgradient import Lens
    >>> views = [Lens(focal_length=0.025, f_number=n, focus_distance=1.0) for n in (math.inf, 4)]
    >>> sd = comparison_bound(views, 2.0, 0.003125 / 2, power=natural_power(0.2, 32), noise=0.01, area=32**2)
    >>> round(float(sd), 4)
    0.0034
    """
    _positive(area=area)
    node, weight = np.polynomial.legendre.leggauss(QUADRATURE_NODES)
    place, weight = (node + 1) / 4, weight / 4  # 0 to 1/2; the plane's other quadrants are alike
    frequency = np.hypot(place[:, None], place).ravel()
    share = 4 * np.outer(weight, weight).ravel() * power(frequency)
    information = _information(optics, vergence, pixel_angle, frequency, noise, psf, k)
    with np.errstate(divide="ignore"):
        return np.asarray(1 / np.sqrt(area * (information @ share)))


def texture_bound(
    sharp: NDArray[np.floating],
    optics: Sequence[Optics],
    vergence: float,
    pixel_angle: float,
    *,
    noise: float | Sequence[float],
    window: float,
    psf: Psf | str = "auto",
    k: float | None = None,
) -> FloatArray:
    """Return the lower bound of the sd of vergence (D) at every pixel of a texture, within a Gaussian window.

    As `comparison_bound`, for a texture that is known and not alike everywhere: where it is blank, depth is unknown.

    Parameters
    ----------
    sharp
        H x W: the texture as a pinhole view records it without noise. It is mirrored at its border.
    optics, vergence, pixel_angle, noise, psf, k
        As in `comparison_bound`; one vergence, in dioptres.
    window
        Standard deviation of the window in pixels.

    Returns
    -------
    ndarray
        H x W.

    Examples
    --------
    The bound of a whole texture lies within what its places scatter to:

    >>> from focalgradient import Lens
    >>> views = [Lens(focal_length=0.025, f_number=n, focus_distance=1.0) for n in (math.inf, 4)]
    >>> white = np.random.default_rng(0).standard_normal((96, 96))
    >>> everywhere = texture_bound(white, views, 0.5, 1e-3, noise=0.01, window=8.0)
    >>> mean = comparison_bound(views, 0.5, 1e-3, power=np.ones_like, noise=0.01, area=window_area(8.0))
    >>> bool(abs(np.sqrt(np.mean(everywhere**-2.0)) * mean - 1) < 0.1)
    True
    """
    # Imported here: a heavy library that the other bounds do without.
    from scipy.ndimage import gaussian_filter

    _positive(window=window)
    sharp = check_finite("sharp", sharp, "linear radiance")
    if sharp.ndim != 2:
        raise InputError(f"sharp has shape {sharp.shape}, but must be H x W: turn colour into luminance first.")
    height, width = sharp.shape
    wide = np.pad(sharp, ((0, height), (0, width)), mode="symmetric")
    frequency = np.hypot(np.fft.fftfreq(2 * height)[:, None], np.fft.rfftfreq(2 * width))
    information = _information(optics, vergence, pixel_angle, frequency.ravel(), noise, psf, k).reshape(frequency.shape)
    informative = np.fft.irfft2(np.fft.rfft2(wide) * np.sqrt(information), wide.shape)[:height, :width]
    with np.errstate(divide="ignore"):
        return np.asarray(1 / np.sqrt(window_area(window) * gaussian_filter(informative**2, window, mode="reflect")))


def _information(
    optics: Sequence[Optics],
    vergence: ArrayLike,
    pixel_angle: float,
    frequency: FloatArray,
    noise: float | Sequence[float],
    psf: Psf | str,
    k: float | None,
) -> FloatArray:
    """Return the bracket of `comparison_bound`: ... x F, by vergence and frequency."""
    if len(optics) < 2:
        raise InputError(f"{len(optics)} optics given, but views are compared from two on: give one for each view.")
    noises = noise_of_each(noise, len(optics), "optics")
    _positive(pixel_angle=pixel_angle)
    source = blur_source(psf, k)
    level = check_finite("vergence", vergence, "dioptres")[..., None]
    transfers, slope = [], []
    for one, sd in zip(optics, noises, strict=True):
        step = 1e-4 / max(one.aperture_diameter / 2 / pixel_angle, 1e-12)  # pixels of blur radius: a central difference
        blur, pixel = view_blur(one, source, pixel_angle)
        at = partial(blur.transfer, frequency / pixel)
        transfers.append(at(level) / sd)
        slope.append((at(level + step) - at(level - step)) / (2 * step * sd))
    total = sum(h**2 for h in transfers)
    along = sum(h * s for h, s in zip(transfers, slope, strict=True))
    change = sum(s**2 for s in slope)
    left = change - along**2 / np.maximum(total, np.finfo(float).tiny)
    return np.where(left > 1e-9 * change, left, 0)  # views that change in proportion leave rounding only


def window_area(window: float) -> float:
    """Effective number of pixels of a Gaussian window of standard deviation `window`: 1 / sum of its squared weights.

    >>> round(window_area(8.0))
    804
    """
    return 4 * math.pi * window**2


def natural_power(contrast: float, side: int) -> Power:
    """Power of a texture whose amplitude falls as 1/frequency, with standard deviation `contrast` in `side` x `side`.

    >>> power = natural_power(0.2, 32)
    >>> float(round(power(np.array([0.1]))[0] / power(np.array([0.2]))[0], 6))
    4.0
    """
    _positive(contrast=contrast, side=side)
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.fftfreq(side)).ravel()[1:]
    scale = contrast**2 * side**2 / np.sum(1 / frequency**SCENE_SLOPE)

    def power(frequency: FloatArray) -> FloatArray:
        return np.asarray(scale / np.maximum(frequency, 1e-9) ** SCENE_SLOPE)

    return power


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (value > 0 and math.isfinite(value)):
            raise InputError(f"{name} is {value!r}, but must be a positive number.")
