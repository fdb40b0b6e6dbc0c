"""Estimates of the noise in views: from one image's finest detail, and from what equalising leaves of several.

White noise alone reaches the finest detail of a blurred image, so that this detail bounds it from above. Which bound
is the tightest depends on the frame: texture all over, a few edges, or empty parts. What equalising leaves
is a weighted sum of the views' noise variances, by radial frequency; the weights (the filters' power gains) differ
between frequencies and depths: a regression gives each variance (`docs/report/method.md`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import fft, ndimage, optimize

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth import numerics
from focalgradient.depth.equalise.likelihood import Equalised, Nodes, equalise
from focalgradient.depth.equalise.residuals import QUARTER, lower_quartile, quartile_by_chance
from focalgradient.depth.filters import RADIAL, RADII, Floats, Image, Spectra, smoothed
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Blurs

__all__ = [
    "LENIENCE",
    "LOG_SETTLED",
    "NOISE_SIDE",
    "NoiseLaw",
    "band_power",
    "noise_floor",
    "noise_from_differences",
    "noise_from_residuals",
    "noise_from_spectrum",
    "noise_law",
    "storage",
]

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

NOISE_ROUNDS, LOG_SETTLED = 6, 0.05
"""Maximum number of alternations between equalisation and noise estimation; and change of the logarithm of a standard
deviation, or of a waveband's gain, below which its estimate has converged. Chosen by hand."""

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

MOST_UNCOMPRESSED = 5.0
"""Maximum variance added by the median contrast, relative to that without contrast, in views that show no compression:
1.2 to 2.4 on a photographed sheet (errors of the model); 10 to 3000 where dark bars contradict every depth."""

LAW_STRIDE, CONTRAST_STEPS = 16, 281
"""Stride in steps, a power of 4, at which the law's search begins, which ends at the law that a search of all steps
gives (600 of 600 drawn cases); and number of steps of contrast, 4 % apart."""

LAW_ROUNDS = 3
"""Maximum number of alternating fits of brightness and contrast. Chosen by hand."""

MOST_PHOTONS = 0.99
"""Maximum proportion of the variance that is proportional to brightness: black has some noise."""


BRIGHTNESS_SD = 2.0
"""Standard deviation in pixels of the Gaussian that smooths brightness; it reduces noise to 1/7. Chosen by hand."""

CONTRAST_SD = 3.0
"""Standard deviation in pixels of the Gaussian window in which contrast is measured: JPEG blocks are 8 wide, and their
errors do not extend beyond them."""


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

    def variance(self, image: Floats, contrast: Floats | float = 0.0) -> Floats:
        """Return the noise variance at a brightness and local variation, relative to that at `brightness`."""
        even = 1 - self.share + self.share / self.brightness * np.maximum(image, 0)
        return even + self.by_contrast * contrast


def storage(image: Floats) -> float:
    """Return the minimum standard deviation of noise in `image` due to storage and rounding."""
    return STORAGE * float(image.std())


def noise_from_differences(image: Floats, mask: Mask | None = None) -> float:
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


def noise_from_spectrum(image: Floats) -> float:
    """Standard deviation of noise that would explain the finest detail (beyond 0.45 cycles per pixel) of `image`."""
    share, power = Spectra.of([np.asarray(image, np.float32)], 0).measure_and_power()
    fine = np.flatnonzero(share)  # a small image has no frequency at some samples
    return float(np.sqrt(np.median(power[0, fine[fine >= int(0.45 * np.sqrt(2) * RADIAL)]])))


def noise_floor(image: Floats, side: int = 32, usable: Mask | None = None) -> float:
    """Upper bound of a pixel's noise (standard deviation): the finest detail of the emptiest squares of an image.

    The difference of differences along and across sees least of any texture and all of the noise; blur and plain
    surfaces leave it nothing else. The fifth percentile over squares of `side` pixels is taken, without the few per
    cent by which it lies below the mean. Squares are left out where less than half is `usable` (H x W):
    saturated pixels show no noise.

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


def brightness_of(views: RegisteredViews) -> Image:
    """Return the brightness of registered views, smoothed to remove noise (H x W)."""
    mean: Image = np.mean(views.images, axis=0, dtype=np.float32)
    return np.asarray(smoothed(mean, BRIGHTNESS_SD), np.float32)


def local_contrast(views: RegisteredViews) -> Image:
    """Return the local variance of registered views, averaged over views (H x W)."""
    total = np.zeros(views.shape, np.float32)
    for image in views.images:
        mean = smoothed(image, CONTRAST_SD)
        total += smoothed((image - mean) ** 2, CONTRAST_SD)
    return np.asarray(total / len(views.images), np.float32)


def uneven_noise(law: NoiseLaw, views: RegisteredViews) -> Image:
    """Return the noise of each pixel (H x W), relative to that estimated for the views."""
    return np.sqrt(law.variance(brightness_of(views), local_contrast(views))).astype(np.float32)


def noise_law(
    variance: FloatArray,
    brightness: FloatArray,
    contrast: FloatArray,
    at: float,
    *,
    level_known: bool = False,
    compressed: bool = True,
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
    compressed
        Whether the views show compression. Otherwise variance that rises more with contrast than `MOST_UNCOMPRESSED` is
        not noise.

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
        plausible = compressed or by_contrast * usual < MOST_UNCOMPRESSED
        if not (clearly and plausible and high > RISES_BY_CONTRAST * low):
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
    gains, spectra = np.array(registered.gains), part.spectra(blurs.reach)
    for _ in range(NOISE_ROUNDS):
        equalised = equalise(spectra, blurs, noise_sd.tolist(), window=window, shares=part.shares, interpolate=False)
        nodes = equalised.read(usable)
        images = [image for image, _ in equalised.evaluate_images(nodes)[1]]
        # Noise of one camera comes after exposure, alike in all views, or before, in proportion to it.
        alike = [(shape / noise_sd) ** 2 for shape in (1 / gains, np.ones_like(gains))]
        powers = band_power(equalised, nodes, images, taper)
        ratio = np.sqrt(_variances(*powers, alike, (white / noise_sd) ** 2))
        settled = np.ptp(np.log(ratio)) < LOG_SETTLED
        if settled:
            ratio *= math.sqrt(equalised.noise_found(nodes) / float(np.mean(ratio**2)))
        before, found = noise_sd, noise_sd * ratio
        noise_sd = np.maximum(floor, found * min(1.0, float(np.min(most / found))))
        if settled and np.abs(np.log(noise_sd / before)).max() < LOG_SETTLED:
            break
    return [float(sd) for sd in noise_sd], float(np.min((most / noise_sd) ** 2))


def _ramp(count: int) -> FloatArray:
    """Weights that rise from 0 at the border of the frame, beyond which blur and filters reach, to 1."""
    place = np.minimum(np.arange(count), np.arange(count)[::-1])
    return np.sin(np.pi / 2 * np.clip((place - RIM) / RIM, 0, 1)) ** 2


EDGES: FloatArray = np.array([0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45])
"""Limits of the bands in cycles per pixel: windows contain too few periods of lower frequencies, and higher ones are
not compared."""

MAX_GROUPS = 6
"""Maximum number of groups of grid points with similar depth. Chosen by hand."""

GROUP_NODES = 16
"""Minimum number of grid points per group: its quartile depends on four of them. Chosen by hand."""

LEAST_FREEDOM = 1.0
"""Minimum number of degrees of freedom of a window's power in a band; with fewer the band is omitted, because the
expected lower quartile, which corrects the power, approaches 0."""

MIN_GAIN = 0.02
"""Minimum power gain of a compared band, relative to the largest; below it, rounding and leakage dominate. Chosen by
hand."""

EXCESS_SCALE = 0.1
"""Relative excess of power above which a band's weight decreases: model error only increases power. Chosen by hand."""

WORSE = 30.0
"""Ratio of mean squares (an F statistic) above which the views' noises differ: -6 to 21 for equal noise on walls,
slants, steps and spheres, 15 to 240 for a ratio of 1.5 between standard deviations, 70 and more for a ratio of 3."""

EQUAL_NOISE_PRIOR = 0.05
"""Weight of the prior that all views have equal noise, in bands; it matters only if the bands do not determine a view's
noise. Chosen by hand."""

ITERATIONS, MIN_VARIANCE = 8, 1e-3
"""Number of reweighting iterations; and minimum estimated variance relative to the largest. Chosen by hand."""


def _variances(power: FloatArray, gains: FloatArray, alike: Sequence[FloatArray], most: FloatArray) -> FloatArray:
    """Estimate each view's noise variance, relative to that assumed, by least squares robust to excess power.

    `power` (N) and `gains` (N x n) are those of `band_power`. The variances are in the proportions of one of `alike`
    (n each) where these explain the power about as well as the views' own do: the simpler model. Each is at most that
    of `most` (n): more is not white noise.

    >>> gains = np.array([[0.9, 0.1], [0.5, 0.5], [0.1, 0.9]] * 8)
    >>> _variances(gains @ [1.0, 4.0], gains, [np.ones(2)], np.full(2, 9.0)).round(2).tolist()
    [1.0, 4.0]
    """
    count = gains.shape[1]
    if len(power) <= count:
        return alike[0] / alike[0].mean()
    fits = [_fitted(power, gains, shape[:, None], np.full(1, np.inf)) for shape in alike]
    simple, more = min(fits, key=lambda fit: fit[1])
    own, loss = _fitted(power, gains, np.diag(simple), most / simple)
    worse = (more - loss) / (count - 1) / (loss / (len(power) - count) + 1e-12)
    return own if worse > WORSE else simple


def _fitted(power: FloatArray, gains: FloatArray, basis: FloatArray, most: FloatArray) -> tuple[FloatArray, float]:
    """Fit variances as a non-negative combination of `basis` columns with similar factors; also return the loss.

    The factors are at most `most`.
    """
    gains, count = gains @ basis, basis.shape[1]
    prior = EQUAL_NOISE_PRIOR * (np.eye(count) - 1 / count)
    factor = np.full(count, float(np.median(power / gains.sum(axis=1))))
    for _ in range(ITERATIONS):
        expected = gains @ factor
        weight = 1 / (expected * (1 + np.maximum(power / expected - 1, 0) / EXCESS_SCALE))
        rows = np.vstack([gains * weight[:, None], prior / factor.mean()])
        found = optimize.lsq_linear(rows, np.concatenate([power * weight, np.zeros(count)]), (0, most), "bvls")
        factor = np.maximum(found.x, MIN_VARIANCE * found.x.max() + 1e-12)
    excess = power / (gains @ factor) - 1
    # The loss whose minimum this is: quadratic below, as the logarithm's above.
    loss = np.where(
        excess > 0,
        EXCESS_SCALE**2 * 2 * (excess / EXCESS_SCALE - np.log1p(np.maximum(excess, 0) / EXCESS_SCALE)),
        excess**2,
    )
    return basis @ factor, float(loss.sum())


def band_power(
    equalised: Equalised, nodes: Nodes, images: Sequence[Image], weight: Image
) -> tuple[FloatArray, FloatArray]:
    """Power of the residual `images` (H x W) at the depth of `nodes`, by the pixels' `weight` (H x W, tapered).

    Returns it in N bands of groups of nodes (by the lower quartile over the group's nodes, corrected for chance), and
    what each view's noise of the variance assumed puts into them: N x n.
    """
    window = equalised.window / equalised.step
    blocks = numerics.block_sum(weight**2, equalised.step).astype(np.float32)
    usable = numerics.gather(blocks[None], window)[0]
    some = nodes.with_texture(nodes.is_supported & (usable > 0.5 * usable.max()))
    level = nodes.level[some]
    count = int(np.clip(some.sum() // GROUP_NODES, 1, MAX_GROUPS))
    limits = np.quantile(level, np.linspace(0, 1, count + 1)[1:-1]) if level.size else np.zeros(0)
    group = np.searchsorted(limits, level)
    size = equalised.window_size() * nodes.support[some]
    powers, gains = [], []
    for residual, image in zip(equalised.residuals, images, strict=True):
        for band, energy in _by_band(weight * image, equalised.step, window):
            inside = band & (residual.measure > 0)
            passed = residual.gains[:, :, inside] * residual.measure[inside]
            by_level = passed.sum(axis=2)
            spread = passed.sum(axis=0) ** 2 / residual.measure[inside]
            share = by_level.sum(axis=0) ** 2 / np.maximum(spread.sum(axis=1), 1e-30)
            if not share.all():  # a small image has no frequency there
                continue
            mean = energy[some] / usable[some]
            for number in np.unique(group):
                at = group == number
                place = np.rint(level[at]).astype(int)
                freedom = share[place] * size[at]
                if freedom.min() < LEAST_FREEDOM:
                    continue
                by_chance = quartile_by_chance(freedom)
                gain = by_level[:, place].sum(axis=0)
                ratio = lower_quartile(mean[at] / np.maximum(gain, 1e-30) / by_chance)
                each = (by_level[:, place] / np.maximum(gain, 1e-30)).mean(axis=1) * gain.mean()
                powers.append(ratio * gain.mean())
                gains.append(each)
    power, gain = np.array(powers), np.array(gains).reshape(len(powers), -1)
    total = gain.sum(axis=1) if len(power) else power
    kept = total > MIN_GAIN * total.max(initial=0.0)
    # Every band counts alike, whatever the filters let through of it.
    return power[kept] / total[kept], gain[kept] / total[kept, None]


def _by_band(image: Image, step: int, window: float) -> Iterator[tuple[Mask, Image]]:
    """Yield the radial samples of each band, and an image's power in it, summed in windows about nodes (h x w)."""
    radius = np.hypot(fft.fftfreq(image.shape[0])[:, None], fft.rfftfreq(image.shape[1]))
    limits = list(pairwise(EDGES.tolist()))
    kept = np.stack([(radius >= low) & (radius < high) for low, high in limits])
    bands = fft.irfft2(fft.rfft2(image) * kept, image.shape, workers=-1)
    energy = numerics.gather(numerics.block_squares(bands, np.ones_like(image), step), window)
    yield from zip([(low <= RADII) & (high > RADII) for low, high in limits], energy, strict=True)
