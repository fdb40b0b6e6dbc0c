"""Power of the residual by radial frequency: identifies which view the noise comes from.

It is a weighted sum of the views' noise variances, and the weights (the filters' power gains) differ between
frequencies and depths: a regression gives each variance (`docs/report/method.md`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import fft, optimize

from focalgradient.depth import numerics
from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.equalise.residuals import lower_quartile, quartile_by_chance
from focalgradient.depth.filters import RADII, FloatArray, Image

__all__ = ["BandPower", "band_power"]

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


@dataclass(frozen=True, slots=True, eq=False)
class BandPower:
    """The residual's power in N bands of groups of nodes, and what each view's noise of variance 1 puts into them."""

    power: FloatArray  # N: by the lower quartile over the group's nodes, corrected for chance
    gains: FloatArray  # N x n, for noise of the variance assumed

    def variances(self, alike: Sequence[FloatArray], most: FloatArray) -> FloatArray:
        """Estimate each view's noise variance, relative to that assumed, by least squares robust to excess power.

        The variances are in the proportions of one of `alike` (n each) where these explain the power about as well as
        the views' own do: the simpler model. Each is at most that of `most` (n): more is not
        white noise.

        >>> gains = np.array([[0.9, 0.1], [0.5, 0.5], [0.1, 0.9]] * 8)
        >>> BandPower(gains @ [1.0, 4.0], gains).variances([np.ones(2)], np.full(2, 9.0)).round(2).tolist()
        [1.0, 4.0]
        """
        count = self.gains.shape[1]
        if len(self.power) <= count:
            return alike[0] / alike[0].mean()
        fits = [self._fitted(shape[:, None], np.full(1, np.inf)) for shape in alike]
        simple, more = min(fits, key=lambda fit: fit[1])
        own, loss = self._fitted(np.diag(simple), most / simple)
        worse = (more - loss) / (count - 1) / (loss / (len(self.power) - count) + 1e-12)
        return own if worse > WORSE else simple

    def _fitted(self, basis: FloatArray, most: FloatArray) -> tuple[FloatArray, float]:
        """Fit variances as a non-negative combination of `basis` columns with similar factors; also return the loss.

        The factors are `most` at most.
        """
        gains, count = self.gains @ basis, basis.shape[1]
        prior = EQUAL_NOISE_PRIOR * (np.eye(count) - 1 / count)
        factor = np.full(count, float(np.median(self.power / gains.sum(axis=1))))
        for _ in range(ITERATIONS):
            expected = gains @ factor
            weight = 1 / (expected * (1 + np.maximum(self.power / expected - 1, 0) / EXCESS_SCALE))
            rows, power = gains * weight[:, None], self.power * weight
            rows = np.vstack([rows, prior / factor.mean()])
            found = optimize.lsq_linear(rows, np.concatenate([power, np.zeros(count)]), (0, most))
            factor = np.maximum(found.x, MIN_VARIANCE * found.x.max() + 1e-12)
        excess = self.power / (gains @ factor) - 1
        # The loss whose minimum this is: quadratic below, as the logarithm's above.
        loss = np.where(
            excess > 0,
            EXCESS_SCALE**2 * 2 * (excess / EXCESS_SCALE - np.log1p(np.maximum(excess, 0) / EXCESS_SCALE)),
            excess**2,
        )
        return basis @ factor, float(loss.sum())


def band_power(equalised: Equalised, nodes: Nodes, images: Sequence[Image], weight: Image) -> BandPower:
    """Power of the residual `images` (H x W) at the depth of `nodes`, by the pixels' `weight` (H x W, tapered)."""
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
            for number in range(count):
                at = group == number
                if not at.any():
                    continue
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
    return BandPower(power[kept] / total[kept], gain[kept] / total[kept, None])


def _by_band(image: Image, step: int, window: float) -> Iterator[tuple[NDArray[np.bool_], Image]]:
    """Yield the radial samples of each band, and an image's power in it, summed in windows about nodes (h x w)."""
    radius = np.hypot(fft.fftfreq(image.shape[0])[:, None], fft.rfftfreq(image.shape[1]))
    limits = list(pairwise(EDGES.tolist()))
    kept = np.stack([(radius >= low) & (radius < high) for low, high in limits])
    bands = fft.irfft2(fft.rfft2(image) * kept, image.shape, workers=-1)
    energy = numerics.gather(numerics.block_squares(bands, np.ones_like(image), step), window)
    yield from zip([(low <= RADII) & (high > RADII) for low, high in limits], energy, strict=True)
