"""Every pair of views measures depth by its difference of blur (Pentland 1987, Eqs. 7-11), and all of them jointly.

A pair gives the difference of its two blurs' variances, u = sigma_j^2 - sigma_i^2, and so the vergence V at which the
optics make this difference. Of n views n - 1 differences are independent, and one V explains them: the other n - 2
degrees of freedom are noise, of known size, or a contradiction. Pairs that share a view share its noise, which the
test takes into account.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth import numerics
from focalgradient.depth.filters import RADIAL, RADII, Floats, disc_pass
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.depth.spectra.bands import NOTHING, Bands, Compared, Hypothesis, compare, scene_level
from focalgradient.depth.validity import LEAST_BLUR, LEAST_NODES, SECONDARY_MINIMUM, random_effects
from focalgradient.psf import DISC_K, Psf

__all__ = ["Differences", "JointEstimate", "Pair"]

DISC_LIMIT = 3.0
"""Maximum 2 pi radius x frequency at which a disc is compared: its first zero is at 3.8, near which the ratio is
unreliable. Another shape with a rim has the radius of the disc with equal second moment."""

MARGIN = 3.0
"""Distance, in pixels per pixel of blur radius, within which pixels outside the frame or mask invalidate those inside.
"""

PATCH_SUPPORT = 0.9
"""Minimum proportion of a patch's window unaffected by the frame's border and masked pixels. Chosen by hand."""

SPLITS = (1 / 3, 2 / 3)
"""Proportions of the depth information counted as coarse; a single one may miss an error."""

LEAST_HYPOTHESIS_STEP, HYPOTHESIS_STEP = 0.25, 0.1
"""Spacing of candidate depths, in pixels of blur and relative to it: the larger of the two. Chosen by hand."""

SUBDIVISION = 4
"""Number of subdivisions of the interval between two candidates in the search for the best fit. Chosen by hand."""

ROUNDS = 4
"""Steps of Gauss and Newton to a minimum, each half the interval between candidates at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Depth as two of the views give it."""

    views: tuple[int, int]
    """Their numbers, from 1."""

    vergence: NDArray[np.floating]
    """Vergence in dioptres: of two depths that fit the pair alike, the one nearer to the joint estimate."""

    vergence_sd: NDArray[np.floating]
    """Its standard deviation in dioptres, by noise alone."""


@dataclass(frozen=True)
class JointEstimate:
    """Every pair's and the joint estimate at the patches' nodes (h x w), in dioptres."""

    pairs: tuple[Pair, ...]
    vergence: FloatArray
    vergence_sd: FloatArray
    noise_sd: FloatArray  # the part of it that comes from noise
    statistic: FloatArray  # chi-square of the pairs' disagreement
    misfit: FloatArray  # chi-square of the best depth in the range searched, if that is at its end
    unambiguous: Mask  # no secondary minimum fits about as well
    support: FloatArray  # share of the window that could be used
    tau: float  # the model error, as a share of the blur radius
    step: int  # pixels from node to node

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the disagreement: n - 1 independent differences, less one vergence."""
        return max(pair.views[1] for pair in self.pairs) - 2

    def agrees(self, false_alarm: float) -> Mask:
        """Return where the pairs agree, with the false-alarm rate `false_alarm`."""
        limit = stats.chi2.isf(false_alarm, self.freedom) if self.freedom else np.inf
        return self.whole & (self.statistic <= limit)

    @property
    def whole(self) -> Mask:
        """Test whether a patch is free of pixels that the frame's rim or masked pixels invalidate."""
        return self.support >= PATCH_SUPPORT

    def to_pixels(self, values: NDArray[np.floating], unit: float, shape: tuple[int, int]) -> NDArray[np.float32]:
        """Interpolate values at nodes, in dioptres, to the pixels between them; `unit` is the scale of similarity."""
        carried = numerics.interpolate_nodes(
            np.asarray(values, float) / unit, self.vergence_sd / unit, self.step, shape
        )
        return (carried * unit).astype(np.float32)

    def to_blocks(self, values: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
        """Repeat values at nodes over all pixels of their blocks."""
        return numerics.repeat_blocks(values, self.step, shape)


@dataclass(frozen=True)
class Differences:
    """Every pair's difference of blur, measured under each of several hypotheses of the vergence."""

    search: Search
    vergences: FloatArray  # L
    variance_per_square: FloatArray  # n: sigma^2, in pixels^2, for one squared dioptre of defocus
    pairs: tuple[tuple[int, int], ...]
    compared: list[list[Compared]]  # P x L
    step: int  # pixels from node to node

    @classmethod
    def of(
        cls, registered: RegisteredViews, search: Search, noise_sd: Sequence[float], psf: Psf, window: float
    ) -> Differences:
        """Compare every pair of registered views under every hypothesis."""
        vergences = _hypotheses(search)
        radius = search.pixels[:, None] * np.abs(search.focus[:, None] - vergences)
        pairs = tuple(combinations(range(len(registered.images)), 2))
        scene, bands = scene_level(registered.images), Bands.of(window)
        hypotheses = []
        limit = DISC_LIMIT * DISC_K / psf.sd_per_radius
        for blur in radius.T:
            weight = disc_pass(blur.max(), limit=limit, power=6) if psf.ends_sharply else np.ones(RADIAL)
            transfers = psf.transfer(RADII, blur[:, None])
            # What blur carried in from beyond the frame, or from masked pixels, is left out.
            margin = min(2 + int(MARGIN * blur.max()), min(registered.shape) // 6)
            for i, j in pairs:
                sd = (noise_sd[i], noise_sd[j])
                hypotheses.append(Hypothesis.of((i, j), transfers[[i, j]], weight, sd, scene, margin))
        reach = int(np.clip(2 * radius.max(), 16, 64))
        compared = compare(bands, registered.images, registered.usable, hypotheses, reach)
        sigma = psf.sd_per_radius * search.pixels
        return cls(
            search, vergences, sigma**2, pairs, [compared[p :: len(pairs)] for p in range(len(pairs))], bands.step
        )

    def estimate(self) -> JointEstimate:
        """Estimate vergence from each pair and from all of them, and test whether they agree."""
        offs = np.stack([[one.slope for one in row] for row in self.compared]) / (4 * np.pi**2)
        variance = np.stack([[one.variance for one in row] for row in self.compared]) / (4 * np.pi**2) ** 2
        fine = np.linspace(0, len(self.vergences) - 1, SUBDIVISION * (len(self.vergences) - 1) + 1)
        between = np.maximum(1 - np.abs(fine[:, None] - np.arange(len(self.vergences))), 0)
        cost = self._cost(offs, variance, fine, between)
        place = fine[cost.argmin(axis=0)]
        inverse = self._information(np.rint(place).astype(np.intp))
        place, vergence, steep = self._root(offs, inverse, place)
        here = _offs_at(offs, place)
        bend = np.array([self.variance_per_square[j] - self.variance_per_square[i] for i, j in self.pairs])
        bends = np.broadcast_to(bend[:, None, None], here.shape)
        first, second = _quadratic(steep, inverse, steep), _quadratic(bends, inverse, bends)
        level = np.rint(place).astype(np.intp)[None]
        support = np.tensordot(between, np.stack([one.support for one in self.compared[0]]), 1)
        support = np.take_along_axis(support, np.rint(SUBDIVISION * place).astype(np.intp)[None], axis=0)[0]
        noise_sd = _reach(np.sqrt(first), np.sqrt(second))
        tau, model_sd = self._model_error(place, vergence, steep, support)
        explained = _quadratic(steep, inverse, here) ** 2 / np.maximum(first, 1e-30)
        whole = _quadratic(here, inverse, here)
        pairs = []
        for p, (i, j) in enumerate(self.pairs):
            known = 1 / np.take_along_axis(variance[p], level, axis=0)[0]
            _, own, slope = self._root(offs[p : p + 1], known[..., None, None], place)
            sd = _reach(np.abs(slope[0]) * np.sqrt(known), abs(bend[p]) * np.sqrt(known))
            pairs.append(Pair((i + 1, j + 1), own, sd))
        return JointEstimate(
            tuple(pairs),
            vergence,
            np.hypot(noise_sd, model_sd),
            noise_sd,
            statistic=whole - explained,
            misfit=whole,
            unambiguous=self._unambiguous(cost, fine, place, vergence, noise_sd),
            support=support,
            tau=tau,
            step=self.step,
        )

    def _cost(self, offs: Floats, variance: Floats, fine: FloatArray, between: FloatArray) -> Floats:
        """Evidence against the depth at each of `fine` levels: the differences it leaves, and what none explains.

        `offs` and their `variance` (P x L x h x w) are given at each hypothesis; `between` interpolates linearly.
        """
        levels = len(self.vergences)
        misfit = np.sum([[one.misfit for one in row] for row in self.compared], axis=0)
        every = _at(np.broadcast_to(np.eye(levels)[:, None], (levels, len(fine), levels)), np.tile(fine, (levels, 1)).T)
        left = np.tensordot(every, offs, (1, 1)) ** 2 / np.tensordot(between, variance, (1, 1))
        return left.sum(axis=1) + np.tensordot(between, misfit, 1)

    def _unambiguous(
        self, cost: Floats, fine: FloatArray, place: FloatArray, vergence: FloatArray, sd: FloatArray
    ) -> Mask:
        """Return where no secondary minimum of `cost` fits about as well as that at `place`."""
        around = np.pad(cost, ((1, 1), (0, 0), (0, 0)), constant_values=np.inf)
        minimum = (cost < around[:-2]) & (cost <= around[2:])
        vergences = np.interp(fine, np.arange(len(self.vergences)), self.vergences)
        minimum &= np.abs(vergences[:, None, None] - vergence) > 3 * sd
        minimum &= np.abs(fine[:, None, None] - place) > 1 / SUBDIVISION
        # Where no depth fits, as the model itself errs, a second minimum may fit as much worse again.
        return ~(minimum & (cost < SECONDARY_MINIMUM + 2 * np.maximum(cost.min(axis=0), 0))).any(axis=0)

    def _root(self, offs: Floats, inverse: FloatArray, place: FloatArray) -> tuple[FloatArray, FloatArray, Floats]:
        """Find the level near `place` at which the differences `offs` of pairs are least, by Gauss and Newton.

        Also returns the vergence there, and the slopes of the differences by vergence.
        """
        levels = len(self.vergences)
        for _ in range(ROUNDS):
            here = _offs_at(offs, place)
            before, after = (np.clip(place + step / SUBDIVISION / 2, 0, levels - 1) for step in (-1, 1))
            slope = (_offs_at(offs, after) - _offs_at(offs, before)) / (after - before)
            move = -_quadratic(slope, inverse, here) / np.maximum(_quadratic(slope, inverse, slope), 1e-30)
            place = np.clip(place + np.clip(move, -0.5, 0.5), 0, levels - 1)
        vergence = _at(np.broadcast_to(self.vergences[:, None, None], (levels, *place.shape)), place)
        return place, vergence, slope / np.interp(place, np.arange(levels), np.gradient(self.vergences))

    def _model_error(
        self, place: FloatArray, vergence: FloatArray, steep: Floats, support: FloatArray
    ) -> tuple[float, FloatArray]:
        """Return the error of the blur model as a share of the blur, and the standard deviation that it gives vergence.

        Depth from coarse detail and depth from fine detail must agree where the model is right.
        """
        unit = np.maximum(LEAST_BLUR, self.search.radius(vergence)) / self.search.slope
        whole, tau = support >= PATCH_SUPPORT, 0.0
        for share in SPLITS:
            found = []
            for p, row in enumerate(self.compared):
                # Between two hypotheses of the depth: a disc's effect is not a straight line in squared frequency.
                totals = np.zeros((2, *place.shape))
                for level, one in enumerate(row):
                    nearness = np.where(whole, np.maximum(1 - np.abs(place - level), 0), 0)
                    if nearness.any():
                        totals += nearness * np.stack(one.coarse_less_fine(share))
                (difference, variance), slope = totals, 4 * np.pi**2 * steep[p]
                use = whole & (variance < NOTHING) & (variance > 0) & (np.abs(slope) > 1e-9)
                found.append(np.stack([difference[use] / slope[use], variance[use] / slope[use] ** 2, unit[use]]))
            if sum(values.shape[1] for values in found) >= LEAST_NODES:
                tau = max(tau, random_effects(*np.concatenate(found, axis=1))[0])
        return tau, tau * unit

    def _information(self, level: NDArray[np.intp]) -> FloatArray:
        """Return the inverse covariance (h x w x P x P) of the pairs' differences, including noise that pairs share."""
        count = len(self.pairs)
        covariance = np.zeros((*level.shape, count, count))
        for here in np.unique(level):
            where = level == here
            for p, first in enumerate(self.pairs):
                for q, second in enumerate(self.pairs[: p + 1]):
                    one, other = self.compared[p][here], self.compared[q][here]
                    if p == q:
                        covariance[where, p, p] = one.variance[where]
                        continue
                    for view in set(first) & set(second):
                        shared = one.covariance(other, first.index(view), second.index(view), where)
                        covariance[where, p, q] += shared
                        covariance[where, q, p] += shared
        covariance /= (4 * np.pi**2) ** 2
        # Of n views n - 1 differences are independent: the other pairs repeat them.
        scale = 1 / np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
        values, vectors = np.linalg.eigh(covariance * scale[..., None] * scale[..., None, :])
        vectors = (vectors * scale[..., None])[..., -(len(self.variance_per_square) - 1) :]
        return np.einsum("yxpe,yxqe,yxe->yxpq", vectors, vectors, 1 / values[..., -vectors.shape[-1] :])


def _hypotheses(search: Search) -> FloatArray:
    """Return vergences spaced by a quarter of a pixel of blur, or by a tenth of the blur if that is larger."""
    vergences = [search.lowest]
    while vergences[-1] < search.highest:
        radius = float(search.radius(np.array(vergences[-1])))
        step = max(LEAST_HYPOTHESIS_STEP, HYPOTHESIS_STEP * radius) / search.slope
        vergences.append(vergences[-1] + min(step, (search.highest - search.lowest) / 4))
    # Stretched a little for the last to be the highest.
    found = np.array(vergences)
    return search.lowest + (found - search.lowest) * (search.highest - search.lowest) / (found[-1] - search.lowest)


def _at(rows: Floats, place: FloatArray) -> FloatArray:
    """`rows` (L x h x w) between levels, at the fractional level `place` (h x w): the cubic through the next four."""
    low = np.clip(place.astype(np.intp), 1, len(rows) - 3)
    t = place - low
    shares = (
        -t * (t - 1) * (t - 2) / 6,
        (t + 1) * (t - 1) * (t - 2) / 2,
        -(t + 1) * t * (t - 2) / 2,
        (t + 1) * t * (t - 1) / 6,
    )
    total = np.zeros(place.shape)
    for number, share in enumerate(shares, -1):
        total += share * np.take_along_axis(rows, (low + number)[None], axis=0)[0]
    return total


def _offs_at(offs: Floats, place: FloatArray) -> Floats:
    """Return each pair's difference (P x h x w) at the fractional level `place`."""
    return np.stack([_at(rows, place) for rows in offs])


def _quadratic(left: Floats, matrix: FloatArray, right: Floats) -> FloatArray:
    return np.einsum("pyx,yxpq,qyx->yx", left, matrix, right)


def _reach(steep: FloatArray, bend: FloatArray | float) -> FloatArray:
    """Return the distance over which a function of this slope and curvature changes by 1."""
    return 2 / (steep + np.sqrt(steep**2 + 4 * bend) + 1e-12)
