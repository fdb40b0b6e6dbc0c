"""Estimates of the noise in views: from one image's finest detail, and from what equalising leaves of several.

White noise alone reaches the finest detail of a blurred image, so that this detail bounds it from above. Which bound
is the tightest depends on what is in the frame: texture all over, a few edges, or empty parts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.depth.equalise.likelihood import equalise, view_spectra
from focalgradient.depth.equalise.residual_power import band_power
from focalgradient.depth.equalise.residuals import QUARTER, lower_quartile
from focalgradient.depth.filters import RADIAL, FloatArray, Spectra
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Blurs

__all__ = [
    "LENIENCE",
    "NOISE_SIDE",
    "NoiseLaw",
    "noise_floor",
    "noise_from_differences",
    "noise_from_residuals",
    "noise_from_spectrum",
    "noise_law",
    "storage",
]

Image = NDArray[np.floating]

STORAGE = 2e-4
"""Minimum noise due to storage and rounding, relative to an image's standard deviation (our choice)."""

QUANTUM = 5e-4
"""Minimum noise relative to an image's range, for isolated edges on a uniform ground: an eighth of an 8-bit step."""

NOISE_SIDE = 192
"""Side in pixels of the part of the views in which noise is estimated; limits the time. Chosen by hand."""

LENIENCE = 2.0
"""Maximum ratio of estimated noise to the largest possible white noise of a view; allows small model errors to count as
noise. Chosen by hand."""

RIM = 12
"""Width in pixels of the rim that is excluded from the noise estimate, and over which weights then increase. Chosen by
hand."""

NOISE_ROUNDS, NOISE_SETTLED = 6, 0.05
"""Maximum number of alternations between equalisation and noise estimation; and change of the logarithm of standard
deviations below which they end. Chosen by hand."""

LEAST_PLACES = 128
"""Minimum number of places from which the noise law is fitted; with fewer, chance could produce one. Chosen by hand."""

MOST_PLACES = 4096
"""Maximum number of places used; windows overlap, so that more add little information. Chosen by hand."""

RISES = 1.25
"""Ratio of noise variance at the 95th to that at the 5th percentile of brightness above which noise increases with
brightness. Chosen by hand."""

RISES_BY_CONTRAST, LOSS_RATIO = 2.0, 0.9
"""`RISES` for contrast; and maximum ratio of the regression's loss with contrast to that without: on uncompressed
walls, slants and steps noise does not increase with contrast."""

CONTRASTS = (0.03, 3000.0)
"""Range of the variance added by the median contrast, relative to that without contrast: from negligible to dominant.
"""

LAW_STRIDE, CONTRAST_STEPS = 16, 281
"""Stride in steps, a power of 4, at which the law's search begins, which ends at the law that a search of all steps
gives (600 of 600 drawn cases); and number of steps of contrast, 4 % apart."""

LAW_ROUNDS = 3
"""Maximum number of alternating fits of brightness and contrast. Chosen by hand."""

MOST_PHOTONS = 0.99
"""Maximum proportion of the variance that is proportional to brightness: black has some noise."""


@dataclass(frozen=True, slots=True)
class NoiseLaw:
    """Noise whose variance is in part in proportion to brightness, and to the square of the local contrast.

    Photons make the first; compression the second, which keeps coefficients to within a step, and so does a model of
    the blur that errs by a share of what it blurs.

    Parameters
    ----------
    share
        The part in proportion to brightness, between 0 and 1, at `brightness` and without contrast.
    brightness
        In the registered images' unit.
    by_contrast
        Variance, in units of that at `brightness` without contrast, where the local variance of the images is 1.

    Examples
    --------
    >>> NoiseLaw(0.5, 2.0).variance(np.array([0.0, 2.0, 6.0])).tolist()
    [0.5, 1.0, 2.0]
    >>> NoiseLaw(0.0, 2.0, 100.0).variance(np.array([2.0, 2.0]), np.array([0.0, 0.01])).tolist()
    [1.0, 2.0]
    """

    share: float
    brightness: float
    by_contrast: float = 0.0

    def variance(self, image: Image, contrast: Image | float = 0.0) -> Image:
        """Return the noise variance at a brightness and local variation, relative to that at `brightness`."""
        even = 1 - self.share + self.share / self.brightness * np.maximum(image, 0)
        return even + self.by_contrast * contrast


def storage(image: Image) -> float:
    """Return the minimum standard deviation of noise in `image` due to storage and rounding."""
    return STORAGE * float(image.std())


def noise_from_differences(image: Image, mask: NDArray[np.bool_] | None = None) -> float:
    """Standard deviation of the image's white noise, from the median size of its finest detail.

    Second differences along rows and columns in turn, which leave nothing of a plane or of an edge along either; where
    there is a `mask` (H x W), those of usable pixels only.

    >>> noise = 0.01 * np.random.default_rng(0).standard_normal((100, 100))
    >>> round(noise_from_differences(noise + (np.arange(100) > 50)), 3)
    0.01
    """
    fine = np.abs(np.diff(np.diff(image, 2, axis=0), 2, axis=1))
    if mask is not None:
        whole, image = ndimage.minimum_filter(mask, 3)[1:-1, 1:-1], image[mask]
        fine = fine[whole] if whole.any() else fine
    # (1, -2, 1) by (1, -2, 1) has the standard deviation 6; a normal value's median size is 0.6745 of its sd.
    return float(max(np.median(fine) / (6 * 0.6745), QUANTUM * np.ptp(image)))


def noise_from_spectrum(image: Image) -> float:
    """Standard deviation of noise that would explain the finest detail (beyond 0.45 cycles per pixel) of `image`."""
    share, power = Spectra.of([np.asarray(image, np.float32)], 0).measure_and_power()
    fine = np.flatnonzero(share)  # a small image has no frequency at some samples
    return float(np.sqrt(np.median(power[0, fine[fine >= int(0.45 * np.sqrt(2) * RADIAL)]])))


def noise_floor(image: Image, side: int = 32, usable: NDArray[np.bool_] | None = None) -> float:
    """Upper bound of a pixel's noise (standard deviation): the finest detail of the emptiest squares of an image.

    The difference of differences along and across sees least of any texture and all of the noise; blur and plain
    surfaces leave it nothing else. The fifth percentile over squares of `side` pixels is taken, without the few per
    cent by which it lies below the mean. Squares are left out where less than half is `usable` (H x W): what is
    saturated shows no noise.

    >>> noise = np.random.default_rng(0).standard_normal((256, 256))
    >>> round(noise_floor(100 + 0.5 * noise), 2)
    0.5
    """
    values = np.asarray(image, np.float32)
    fine = values[:-2] - 2 * values[1:-1] + values[2:]
    fine = fine[:, :-2] - 2 * fine[:, 1:-1] + fine[:, 2:]
    side = min(side, *fine.shape)
    kept = np.ones(fine.shape, np.float32)
    if usable is not None:
        kept = ndimage.minimum_filter(usable, 3)[1:-1, 1:-1].astype(np.float32)
    total, share = (
        ndimage.uniform_filter(values, side)[side // 2 :: side, side // 2 :: side] for values in (fine**2 * kept, kept)
    )
    some = share >= min(0.5, share.max())
    squares = total[some] / np.maximum(share[some], 1e-6)
    # (1, -2, 1) by (1, -2, 1) has 36 times the variance of white noise; the sum over a square has the relative variance
    # 2 x (35/18)^4 / side^2 / 1, as the squared covariance (1, -4, 6, -4, 1)^2 / 36 sums to 35/18 in each direction.
    below = 1 - 1.645 * math.sqrt(2) * (35 / 18) / side if squares.size > 20 else 1.0
    return float(np.sqrt(np.percentile(squares, 5) / 36 / below))


def noise_law(
    variance: FloatArray, brightness: FloatArray, contrast: FloatArray, at: float, *, level_known: bool = False
) -> NoiseLaw | None:
    """Fit the law by which noise rises with brightness and contrast to its variance at places; None: it is uniform.

    What the views show beside noise can only add to the variance: of the places as bright, the quarter with least
    counts, by regression of that quantile.

    Parameters
    ----------
    variance, brightness
        Of N places each, in any unit.
    contrast
        Local variance of the images at each.
    at
        Brightness at which the law's variance is to be 1.
    level_known
        Whether the variance is in units of the noise, which is alike in bright and in dark places.

    Examples
    --------
    >>> brightness, contrast = np.meshgrid(np.linspace(0.1, 2.0, 40), np.geomspace(1e-6, 1, 40))
    >>> brightness, contrast = brightness.ravel(), contrast.ravel()
    >>> noise_law(0.25 + 0.75 * brightness, brightness, contrast, at=1.0)
    NoiseLaw(share=0.75, brightness=1.0, by_contrast=0.0)
    >>> 95 < noise_law(3 * (1 + 100 * contrast), brightness, contrast, at=1.0).by_contrast < 105
    True
    >>> noise_law(np.ones(1600), brightness, contrast, at=1.0) is None
    True
    """
    if len(variance) < LEAST_PLACES or not at > 0:
        return None
    every = -(-len(variance) // MOST_PLACES)
    seen, bright, varied = np.log(np.maximum(variance[::every], 1e-12)), brightness[::every], contrast[::every]

    def loss(law: NoiseLaw) -> float:
        left = seen - np.log(law.variance(bright, varied))
        left -= 0.0 if level_known else lower_quartile(left)
        return float(np.mean(left * (QUARTER - (left < 0))))

    def rise(law: NoiseLaw) -> float:
        dark, light = law.variance(np.quantile(bright, [0.05, 0.95]))
        return float(light / dark)

    usual = max(float(np.median(varied)), 1e-12)
    by_contrast, share = 0.0, 0.0
    shares = np.linspace(0, 0.0 if level_known else MOST_PHOTONS, 1 if level_known else 100).round(4).tolist()
    for _ in range(LAW_ROUNDS):
        share = _best([NoiseLaw(one, at, by_contrast) for one in shares], loss).share
        if not rise(NoiseLaw(share, at)) > RISES:
            share = 0.0
        before, least = by_contrast, loss(NoiseLaw(share, at))
        steps = np.geomspace(*CONTRASTS, CONTRAST_STEPS) / usual
        by_contrast = _best([NoiseLaw(share, at, one) for one in steps.tolist()], loss).by_contrast
        low, high = NoiseLaw(share, at, by_contrast).variance(np.full(2, at), np.quantile(varied, [0.05, 0.95]))
        clearly = loss(NoiseLaw(share, at, by_contrast)) < LOSS_RATIO * least
        if not (clearly and high > RISES_BY_CONTRAST * low):
            by_contrast = 0.0
        if abs(by_contrast - before) <= 0.01 * by_contrast:
            break
    return NoiseLaw(share, at, by_contrast) if share or by_contrast else None


def _best(laws: Sequence[NoiseLaw], loss: Callable[[NoiseLaw], float]) -> NoiseLaw:
    """Return the law of least loss: the best of a few far apart, then of those beside it, ever closer."""
    low, high, stride = 0, len(laws) - 1, LAW_STRIDE
    while True:
        at = min([*range(low, high, stride), high], key=lambda number: loss(laws[number]))
        if stride == 1:
            return laws[at]
        low, high, stride = max(0, at - stride), min(len(laws) - 1, at + stride), stride // 4


def noise_from_residuals(
    registered: RegisteredViews, blurs: Blurs, window: float, given: FloatArray | None
) -> tuple[list[float], float | None]:
    """Standard deviation of each registered view's noise: `given`, or from what equalising leaves of a textured crop.

    White noise reaches a view's finest detail, which bounds it. Below that the power of the residual by frequency and
    depth shows each view's noise (`BandPower`).

    Also returns by how much its variance may still be raised, as the whole frame may ask for; None where it is given.
    """
    if given is not None:
        return [float(sd / gain) for sd, gain in zip(given, registered.gains, strict=True)], None
    part = registered.most_textured_crop(NOISE_SIDE)
    finest = np.array([noise_from_spectrum(image) for image in part.images])
    emptiest = [noise_floor(image, usable=part.usable) for image in part.images]
    floor = STORAGE * float(np.mean([image.std() for image in part.images]))
    white, most = finest + floor, LENIENCE * finest + floor
    noise_sd = np.maximum(floor, np.minimum(finest, emptiest))
    usable = part.usable.astype(np.float32)
    taper = usable * np.outer(*(_ramp(n) for n in part.shape)).astype(np.float32)
    gains, spectra = np.array(registered.gains), view_spectra(part.images, blurs)
    for _ in range(NOISE_ROUNDS):
        equalised = equalise(spectra, blurs, noise_sd.tolist(), window=window, shares=part.shares, interpolate=False)
        nodes = equalised.read(usable)
        images = [image for image, _ in equalised.evaluate_images(nodes)[1]]
        # Noise of one camera comes after exposure, alike in all views, or before, in proportion to it.
        alike = [(shape / noise_sd) ** 2 for shape in (1 / gains, np.ones_like(gains))]
        ratio = np.sqrt(band_power(equalised, nodes, images, taper).variances(alike, (white / noise_sd) ** 2))
        settled = np.ptp(np.log(ratio)) < NOISE_SETTLED
        if settled:
            ratio *= math.sqrt(equalised.noise_found(nodes) / float(np.mean(ratio**2)))
        before, found = noise_sd, noise_sd * ratio
        noise_sd = np.maximum(floor, found * min(1.0, float(np.min(most / found))))
        if settled and np.abs(np.log(noise_sd / before)).max() < NOISE_SETTLED:
            break
    return [float(sd) for sd in noise_sd], float(np.min((most / noise_sd) ** 2))


def _ramp(count: int) -> FloatArray:
    """Weights that rise from 0 at the border of the frame, beyond which blur and filters reach, to 1."""
    place = np.minimum(np.arange(count), np.arange(count)[::-1])
    return np.sin(np.pi / 2 * np.clip((place - RIM) / RIM, 0, 1)) ** 2
