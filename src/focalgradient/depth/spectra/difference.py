"""Comparison of local spectra across apertures, as in the paper (Pentland 1987, Eqs. 7-10).

The amplitude spectra of corresponding patches, summed over orientation, differ by the blurs alone: ln F1 - ln F2 =
2 pi^2 f^2 (sigma2^2 - sigma1^2), a straight line in the squared frequency. Through windows that trail off smoothly the
difference comes out too small, by up to a quarter of a large blur (see `focalgradient.depth.spectra.bands`). The method
``"spectra"`` of `focalgradient.recover_depth` equalises first, and has no such bias.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from focalgradient.arrays import FloatArray
from focalgradient.depth.filters import FINEST, Image
from focalgradient.depth.settings import WINDOW
from focalgradient.depth.spectra.bands import spacing
from focalgradient.errors import InputError, check_finite, check_number

__all__ = ["spectral_difference"]

CHUNK = 1_000_000
"""Number of pixels of patches transformed at a time; limits memory. Chosen by hand."""


def spectral_difference(
    first: NDArray[np.floating], second: NDArray[np.floating], *, window: float = 8.0, noise: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Estimate sigma2^2 - sigma1^2 of two Gaussian-blurred images of one scene, in pixels^2, and its sd.

    Both are one scene, convolved with either Gaussian (Eq. 7), so that either spectrum is the scene's times the
    Gaussian's (Eq. 8), and the logarithm of their ratio is a straight line in squared frequency (Eq. 9), whose slope is
    2 pi^2 times the difference. If the first is a pinhole's (sigma1 = 0), the square root is sigma2.

    Parameters
    ----------
    first, second
        Images of one scene, H x W, in linear radiance and at one exposure.
    window
        Standard deviation in pixels of the Gaussian in which power is gathered; the patches' own is sqrt(2) wider.
    noise
        Standard deviation of the pixels' noise, alike in both.

    The log ratio of the amplitude spectra is fitted over the rings that stand out of the noise. Large differences come
    out too small.

    Returns
    -------
    difference, sd
        One for each patch, h x w: patches lie in the middles of blocks of `spacing(window)` pixels. The sd is
        ``inf`` where fewer than three rings stand out of the noise.

    Raises
    ------
    InputError
        If the images differ in shape, are smaller than 32 pixels or not finite, or a setting is out of range.

    Examples
    --------
    A pinhole's view, and one blurred by sigma = 3 pixels: the paper's patches give a fifth too little.

    >>> from focalgradient.psf import gaussian_transfer
    >>> random, frequency = np.random.default_rng(0), np.hypot(np.fft.fftfreq(256)[:, None], np.fft.rfftfreq(256))
    >>> scene = np.fft.rfft2(random.standard_normal((256, 256))) / np.maximum(frequency, 1 / 256)
    >>> sharp, blurred = (np.fft.irfft2(scene * gaussian_transfer(frequency, s, k=1)) for s in (0, 3.0))
    >>> difference, _ = spectral_difference(sharp, blurred, noise=1e-3 * sharp.std())
    >>> round(float(np.sqrt(np.median(difference[8:-8, 8:-8]))), 1)
    2.4
    """
    first, second = (np.asarray(image, np.float32) for image in (first, second))
    if first.shape != second.shape or first.ndim != 2 or min(first.shape) < 32:
        raise InputError(
            f"the images have shapes {first.shape} and {second.shape}, but must be of one shape, H x W, of 32 pixels "
            "at least: crop them alike."
        )
    for name, image in (("first", first), ("second", second)):
        check_finite(name, image, "linear radiance")
    WINDOW.check("window", window)
    check_number("noise", noise, "the images' unit, as a standard deviation", least=0)
    side = 8 * int(np.ceil(window))
    squares, rings = _rings(side)
    count, mean = rings.sum(axis=0, dtype=float), first.mean()
    one, other = (_amplitudes(image - mean, window, side, rings) for image in (first, second))
    floor = np.sqrt(np.pi / 4) * noise * count  # of white noise, whose |F| is Rayleigh distributed
    clear = np.minimum(one, other) > 2 * floor
    tiny = np.finfo(np.float32).tiny
    ratio = np.log((one + tiny) / (other + tiny))
    used = clear.sum(axis=-1)
    some = np.maximum(used, 1)
    squared = np.where(clear, np.sqrt(squares @ rings / count) ** 2, 0)
    lever = np.where(clear, squared - squared.sum(axis=-1, keepdims=True) / some[..., None], 0)
    spread = np.maximum((lever**2).sum(axis=-1), 1e-12)
    slope = (lever * ratio).sum(axis=-1) / spread
    height = np.where(clear, ratio, 0).sum(axis=-1) / some
    left = np.where(clear, ratio - height[..., None] - slope[..., None] * lever, 0)
    variance = (left**2).sum(axis=-1) / np.maximum(some - 2, 1) / spread
    # Two points lie on a line whatever they are.
    return slope / (2 * np.pi**2), np.where(used < 3, np.inf, np.sqrt(variance) / (2 * np.pi**2))


def _rings(side: int) -> tuple[FloatArray, Image]:
    """Return the squared frequency of each element of a patch's half spectrum, and the sum over each ring (N x R)."""
    squared = (fft.fftfreq(side)[:, None] ** 2 + fft.rfftfreq(side) ** 2).reshape(-1, 1)
    twice = np.full((side, side // 2 + 1), 2.0)
    twice[:, [0, -1]] = 1.0  # a real image's spectrum is stored by half
    ring = np.rint(side * np.sqrt(squared)) == np.arange(1, int(FINEST * side) + 1)
    return squared.ravel(), np.asarray(ring * twice.reshape(-1, 1), np.float32)


def _amplitudes(image: Image, window: float, side: int, rings: Image) -> FloatArray:
    """Return the sums of |F| over `rings` for every patch of `image` (H x W): h x w x R. Beyond the frame is dark.

    Patches have `side` pixels and a Gaussian of sd `window`, one in the middle of each block about as wide as that.
    """
    step = spacing(window)
    rows, columns = (-(-n // step) for n in image.shape)
    # Of patches at the blocks' middles, as many pixels lie before the first block as behind it.
    margin = (side - step) // 2
    around = [(margin, margin + m * step - n) for m, n in zip((rows, columns), image.shape, strict=True)]
    every = np.lib.stride_tricks.sliding_window_view(np.pad(image, around), (side, side))[::step, ::step]
    edge = np.exp(-((np.arange(side) + 0.5 - side / 2) ** 2) / (4 * window**2))
    edge /= np.linalg.norm(edge)  # whose squares sum to 1
    taper = np.outer(edge, edge).astype(np.float32)
    sums = np.empty((rows, columns, rings.shape[1]))
    band = max(1, CHUNK // (columns * side**2))
    for row in range(0, rows, band):
        spectrum = fft.rfft2(every[row : row + band] * taper, workers=-1)
        sums[row : row + band] = np.abs(spectrum).reshape(*spectrum.shape[:2], -1) @ rings
    return sums
