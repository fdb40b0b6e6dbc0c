"""Comparison of local spectra across apertures (Pentland 1987, Eqs. 7-11), as in the paper and without its bias.

The amplitude spectra of corresponding patches, summed over orientation, differ by the blurs alone: ln F1 - ln F2 =
2 pi^2 f^2 (sigma2^2 - sigma1^2), a straight line in the squared frequency. Through windows that trail off smoothly the
difference comes out too small, by up to a quarter of a large blur (see `focalgradient.depth.spectra.bands`). Equalised
first, the images give it without bias.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.filters import RADIAL, RADII, FloatArray
from focalgradient.depth.spectra.bands import Bands, Hypothesis, Patches, compare, scene_level
from focalgradient.errors import InputError, check_finite
from focalgradient.psf import gaussian_transfer

__all__ = ["spectral_difference"]

LARGEST_SIGMA = 8.0
"""Largest candidate sigma in pixels. Chosen by hand."""

SIGMA_STEP = 0.2
"""Spacing of candidate sigmas, in pixels or relative to sigma. Chosen by hand."""

ROUNDING = 1e-5
"""Minimum noise relative to the image's standard deviation: rounding in 32-bit storage."""


def spectral_difference(
    first: NDArray[np.floating],
    second: NDArray[np.floating],
    *,
    window: float = 8.0,
    noise: float = 0.0,
    fit: Literal["equalised", "paper"] = "equalised",
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
    fit
        ``"paper"``: the paper's regression (Eq. 9) of the log ratio of the amplitude spectra, as it is, on squared
        frequency, over the rings that stand out of the noise. Large differences come out too small.
        ``"equalised"``: power spectra of the images equalised, each ring weighted by its information; without bias.

    Returns
    -------
    difference, sd
        One for each patch, h x w: patches lie in the middles of blocks of `Patches.of(window).step` pixels. The sd is
        ``inf`` where nothing is known: by the paper's fit where fewer than three rings stand out of the noise, by the
        other where one image is blurred more than the other by a sigma of over 8 pixels.

    Raises
    ------
    InputError
        If the images differ in shape, are smaller than 32 pixels or not finite, or a setting is out of range.

    Examples
    --------
    A pinhole's view, and one blurred by sigma = 3 pixels: the paper's patches give a fifth too little.

    >>> random, frequency = np.random.default_rng(0), np.hypot(np.fft.fftfreq(256)[:, None], np.fft.rfftfreq(256))
    >>> scene = np.fft.rfft2(random.standard_normal((256, 256))) / np.maximum(frequency, 1 / 256)
    >>> sharp, blurred = (np.fft.irfft2(scene * gaussian_transfer(frequency, s, k=1)) for s in (0, 3.0))
    >>> for fit in ("equalised", "paper"):
    ...     difference, _ = spectral_difference(sharp, blurred, noise=1e-3 * sharp.std(), fit=fit)
    ...     print(round(float(np.sqrt(np.median(difference[8:-8, 8:-8]))), 1))
    3.0
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
    if not (np.ndim(window) == 0 and 2 <= window <= 64):
        raise InputError(f"window is {window!r}, but must be between 2 and 64 pixels.")
    if not (np.ndim(noise) == 0 and 0 <= noise < np.inf):
        raise InputError(f"noise is {noise!r}, but must be a standard deviation of 0 or more.")
    patches = Patches.of(window)
    if fit == "paper":
        return _paper(patches, first, second, noise)
    if fit == "equalised":
        return _equalised(first, second, window, noise)
    raise InputError(f"fit is {fit!r}, but must be 'equalised' or 'paper'.")


def _paper(
    patches: Patches, first: NDArray[np.float32], second: NDArray[np.float32], noise: float
) -> tuple[FloatArray, FloatArray]:
    """Return the regression A f^2 + B = ln F1 - ln F2 over the rings that stand out of the noise."""
    mean = first.mean()
    one, other = (patches.amplitudes(image - mean) for image in (first, second))
    floor = np.sqrt(np.pi / 4) * noise * patches.frequencies  # of white noise, whose |F| is Rayleigh distributed
    clear = np.minimum(one, other) > 2 * floor
    tiny = np.finfo(np.float32).tiny
    ratio = np.log((one + tiny) / (other + tiny))
    rings = clear.sum(axis=-1)
    count = np.maximum(rings, 1)
    squared = np.where(clear, patches.frequency**2, 0)
    lever = np.where(clear, squared - squared.sum(axis=-1, keepdims=True) / count[..., None], 0)
    spread = np.maximum((lever**2).sum(axis=-1), 1e-12)
    slope = (lever * ratio).sum(axis=-1) / spread
    height = np.where(clear, ratio, 0).sum(axis=-1) / count
    left = np.where(clear, ratio - height[..., None] - slope[..., None] * lever, 0)
    variance = (left**2).sum(axis=-1) / np.maximum(count - 2, 1) / spread
    # Two points lie on a line whatever they are.
    return slope / (2 * np.pi**2), np.where(rings < 3, np.inf, np.sqrt(variance) / (2 * np.pi**2))


def _equalised(
    first: NDArray[np.float32], second: NDArray[np.float32], window: float, noise: float
) -> tuple[FloatArray, FloatArray]:
    """Find the hypothesis of the difference at which the equalised spectra are equal."""
    noise = max(noise, ROUNDING * float(np.std(first)))
    images, blurs = [first, second], [0.0]
    while blurs[-1] < LARGEST_SIGMA:
        blurs.append(blurs[-1] + SIGMA_STEP * max(1.0, blurs[-1]))
    blurs = [*(-blur for blur in blurs[:0:-1]), *blurs]
    scene, every = scene_level(images), np.ones(RADIAL)
    hypotheses = [
        Hypothesis.of(
            (0, 1),
            gaussian_transfer(RADII, np.array([[max(-blur, 0)], [max(blur, 0)]]), k=1),
            every,
            (noise, noise),
            scene,
            min(2 + int(1.5 * abs(blur)), min(first.shape) // 6),
        )
        for blur in blurs
    ]
    compared = compare(Bands.of(window), images, np.ones(first.shape, np.bool_), hypotheses, 32)
    off, variance, misfit = (
        np.stack([getattr(one, name) for one in compared]) for name in ("slope", "variance", "misfit")
    )
    # Between two hypotheses, next to the one that fits best, nothing is left: there lies the estimate.
    crosses = (off[:-1] >= 0) & (off[1:] < 0)
    best = misfit.argmin(axis=0)
    far = np.abs(np.arange(len(crosses))[:, None, None] + 0.5 - best)
    low = np.where(crosses, far, far + len(far)).argmin(axis=0)[None]
    before, after = (np.take_along_axis(off, low + n, axis=0)[0] for n in (0, 1))
    share = np.clip(before / np.where(before == after, 1, before - after), 0, 1)
    place = low[0] + share
    values = np.interp(place, np.arange(len(blurs)), np.array(blurs) * np.abs(blurs))
    sd = np.sqrt(np.take_along_axis(variance, np.rint(place).astype(int)[None], axis=0)[0]) / (4 * np.pi**2)
    # The difference lies beyond the hypotheses where the last one fits best, or something is left under all of them.
    within = (best > 0) & (best < len(blurs) - 1) & crosses.any(axis=0)
    return values, np.where(within, sd, np.inf)
