"""The internal check (Pentland 1987, Eq. 11): every pair of views measures depth, and all must agree.

A pair tells the difference of its two blurs' variances, u = sigma_j^2 - sigma_i^2, and so the vergence V at which the
optics make this difference. Of n views n - 1 differences are independent, and one V explains them: what n - 2 of them
say besides is noise, of known size, or a contradiction. Pairs that share a view share its noise; the test knows how
much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from focalgradient.depth import numerics
from focalgradient.depth.equalise.estimate import measured_noise
from focalgradient.depth.filters import RADIAL, FloatArray
from focalgradient.depth.recover import check_usable
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.depth.settings import RecoverySettings
from focalgradient.depth.spectra.bands import RADII, Bands, Compared, Supposed, compare, scene_power
from focalgradient.psf import DISC_K, PsfName, transfer
from focalgradient.view import View

DISC_HEARD = 3.0
"""2 pi radius x frequency up to which a disc is compared: its first zero is at 3.8, and next to it little is sure."""

SPOILT = 3.0
"""Pixels to a pixel of blur radius, within which what is not seen spoils what is."""

__all__ = ["Check", "Differences", "Pair", "Reading", "check_views"]

SUPPORT = 0.9
"""Share of a patch's window that must be free of what the frame's rim, or saturated pixels, spoil."""

LEAST_STEP, STEP = 0.25, 0.1
"""Pixels of blur, and share of it, from one supposed depth to the next: the greater of the two."""

FINE = 4
"""Parts of the interval between two suppositions in which the depth that fits best is looked for."""

RIVAL = 9.0
"""A second depth whose misfit comes within this (three sd) of the least leaves the depth undecided."""


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """What two of the views say of depth."""

    views: tuple[int, int]
    """Their numbers, from 1."""

    vergence: NDArray[np.floating]
    """Vergence in dioptres: of two depths that the pair cannot tell apart, the one nearer to the joint estimate."""

    vergence_sd: NDArray[np.floating]
    """Its standard deviation in dioptres."""


@dataclass(frozen=True)
class Reading:
    """Every pair's and the joint estimate at the patches' nodes (h x w), in dioptres."""

    pairs: tuple[Pair, ...]
    vergence: FloatArray
    vergence_sd: FloatArray
    statistic: FloatArray  # chi-square of the pairs' disagreement
    misfit: FloatArray  # chi-square of the best depth in the range searched, if that is at its end
    alone: NDArray[np.bool_]  # no rival fits about as well
    support: FloatArray  # share of the window that could be used
    step: int  # pixels from node to node

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the disagreement: n - 1 independent differences, less one vergence."""
        return max(pair.views[1] for pair in self.pairs) - 2

    def agrees(self, false_alarm: float) -> NDArray[np.bool_]:
        """Where the pairs agree; if they do, refused with the probability `false_alarm`."""
        limit = stats.chi2.isf(false_alarm, self.freedom) if self.freedom else np.inf
        return self.whole & (self.statistic <= limit)

    @property
    def whole(self) -> NDArray[np.bool_]:
        """Where nothing that the frame's rim or saturated pixels spoil lies in the patch."""
        return self.support >= SUPPORT

    def to_pixels(self, values: NDArray[np.floating], unit: float, shape: tuple[int, int]) -> NDArray[np.float32]:
        """Values at nodes, in dioptres, carried to the pixels between them; `unit` is what counts as close."""
        carried = numerics.spread(np.asarray(values, float) / unit, self.vergence_sd / unit, self.step, shape)
        return (carried * unit).astype(np.float32)

    def to_blocks(self, values: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
        """Values at nodes given to all pixels of their blocks."""
        return values.repeat(self.step, axis=0).repeat(self.step, axis=1)[: shape[0], : shape[1]]


@dataclass(frozen=True)
class Differences:
    """Every pair's difference of blur, measured from each of several suppositions of the vergence."""

    search: Search
    vergences: FloatArray  # L
    variance_per_square: FloatArray  # n: sigma^2, in pixels^2, for one squared dioptre of defocus
    pairs: tuple[tuple[int, int], ...]
    compared: list[list[Compared]]  # P x L
    step: int  # pixels from node to node

    @classmethod
    def of(
        cls,
        placed: RegisteredViews,
        search: Search,
        noise_sd: Sequence[float],
        psf: PsfName,
        k: float,
        window: float,
    ) -> Differences:
        """Compare every pair of the placed views at every supposition."""
        vergences = _suppositions(search)
        radius = search.pixels[:, None] * np.abs(search.focus[:, None] - vergences)
        pairs = tuple(combinations(range(len(placed.images)), 2))
        scene, bands = scene_power(placed.images), Bands.of(window)
        supposed = []
        for blur in radius.T:
            heard = np.ones(RADIAL)
            if psf == "disc":
                heard = np.exp(-((2 * np.pi * blur.max() * RADII / DISC_HEARD) ** 6) / 2)
            transfers = transfer(RADII, blur[:, None], psf, k)
            # What blur carried in from beyond the frame, or from pixels that tell nothing, is left out.
            spoilt = min(2 + int(SPOILT * blur.max()), min(placed.shape) // 6)
            for i, j in pairs:
                sd = (noise_sd[i], noise_sd[j])
                supposed.append(Supposed.of((i, j), transfers[[i, j]], heard, sd, scene, spoilt))
        reach = int(np.clip(2 * radius.max(), 16, 64))
        compared = compare(bands, placed.images, placed.usable, supposed, reach)
        sigma = (DISC_K if psf == "disc" else k) * search.pixels
        return cls(
            search, vergences, sigma**2, pairs, [compared[p :: len(pairs)] for p in range(len(pairs))], bands.step
        )

    def read(self) -> Reading:
        """Estimate vergence from each pair and from all of them, and test whether they agree."""
        levels = len(self.vergences)
        offs = np.stack([[one.slope for one in row] for row in self.compared]) / (4 * np.pi**2)
        variance = np.stack([[one.variance for one in row] for row in self.compared]) / (4 * np.pi**2) ** 2
        misfit = np.sum([[one.misfit for one in row] for row in self.compared], axis=0)
        fine = np.linspace(0, levels - 1, FINE * (levels - 1) + 1)
        every = _at(np.broadcast_to(np.eye(levels)[:, None], (levels, len(fine), levels)), np.tile(fine, (levels, 1)).T)
        fine_offs = np.tensordot(every, offs, (1, 1)).swapaxes(0, 1)
        between = np.maximum(1 - np.abs(fine[:, None] - np.arange(levels)), 0)
        doubt = np.tensordot(between, variance, (1, 1)).swapaxes(0, 1)
        # What speaks against a depth: the differences it leaves, and what no difference of blur explains.
        cost = (fine_offs**2 / doubt).sum(axis=0) + np.tensordot(between, misfit, 1)
        place = fine[cost.argmin(axis=0)]

        def off(place: FloatArray) -> FloatArray:
            return np.stack([_at(rows, place) for rows in offs])

        inverse = self._information(np.rint(place).astype(np.intp))
        for _ in range(4):
            here = off(place)
            before, after = (np.clip(place + step / FINE / 2, 0, levels - 1) for step in (-1, 1))
            slope = (off(after) - off(before)) / (after - before)
            move = -_quadratic(slope, inverse, here) / np.maximum(_quadratic(slope, inverse, slope), 1e-30)
            place = np.clip(place + np.clip(move, -0.5, 0.5), 0, levels - 1)
        here = off(place)
        vergence = _at(np.broadcast_to(self.vergences[:, None, None], (levels, *place.shape)), place)
        per_level = np.interp(place, np.arange(levels), np.gradient(self.vergences))
        steep = slope / per_level
        bend = np.array([self.variance_per_square[j] - self.variance_per_square[i] for i, j in self.pairs])
        bends = np.broadcast_to(bend[:, None, None], here.shape)
        first, second = _quadratic(steep, inverse, steep), _quadratic(bends, inverse, bends)
        sd = _reach(np.sqrt(first), np.sqrt(second))
        explained = _quadratic(steep, inverse, here) ** 2 / np.maximum(first, 1e-30)
        whole = _quadratic(here, inverse, here)
        pairs = tuple(
            Pair((i + 1, j + 1), *self._root(fine_offs[p], doubt[p], fine, vergence, abs(bend[p])))
            for p, (i, j) in enumerate(self.pairs)
        )
        valley = np.pad(cost, ((1, 1), (0, 0), (0, 0)), constant_values=np.inf)
        valley = (cost < valley[:-2]) & (cost <= valley[2:])
        valley &= np.abs(np.interp(fine, np.arange(levels), self.vergences)[:, None, None] - vergence) > 3 * sd
        valley &= np.abs(fine[:, None, None] - place) > 1 / FINE
        # Where no depth fits, as the model itself errs, a rival may fit as much worse again.
        alone = ~(valley & (cost < RIVAL + 2 * np.maximum(cost.min(axis=0), 0))).any(axis=0)
        support = np.tensordot(between, np.stack([one.support for one in self.compared[0]]), 1)
        return Reading(
            pairs,
            vergence,
            sd,
            whole - explained,
            whole,
            alone,
            np.take_along_axis(support, np.rint(FINE * place).astype(np.intp)[None], axis=0)[0],
            self.step,
        )

    def _information(self, level: NDArray[np.intp]) -> FloatArray:
        """Inverse covariance (h x w x P x P) of the pairs' differences, noise that pairs share taken into account."""
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
        # n views tell n - 1 differences: what the pairs tell beyond is the same again.
        scale = 1 / np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
        values, vectors = np.linalg.eigh(covariance * scale[..., None] * scale[..., None, :])
        vectors = (vectors * scale[..., None])[..., -(len(self.variance_per_square) - 1) :]
        return np.einsum("yxpe,yxqe,yxe->yxpq", vectors, vectors, 1 / values[..., -vectors.shape[-1] :])

    def _root(
        self, off: FloatArray, doubt: FloatArray, fine: FloatArray, joint: FloatArray, bend: float
    ) -> tuple[FloatArray, FloatArray]:
        """The vergence at which one pair is not `off`, nearest to the `joint` one, and its sd."""
        vergences = np.interp(fine, np.arange(len(self.vergences)), self.vergences)[:, None, None]
        crosses = off[:-1] * off[1:] <= 0
        share = off[:-1] / np.where(crosses & (off[:-1] != off[1:]), off[:-1] - off[1:], 1.0)
        roots = np.where(crosses, vergences[:-1] + share * (vergences[1:] - vergences[:-1]), np.inf)
        nearest = np.abs(roots - joint).argmin(axis=0)
        least = np.minimum((off**2 / doubt).argmin(axis=0), len(fine) - 2)
        index = np.where(crosses.any(axis=0), nearest, least)[None]
        root = np.take_along_axis(roots, index, axis=0)[0]
        pick = [np.take_along_axis(values, index, axis=0)[0] for values in (off[:-1], off[1:], doubt)]
        width = (vergences[1:] - vergences[:-1])[index[0], 0, 0]
        sd = np.sqrt(pick[2])
        reach = _reach(np.abs(pick[1] - pick[0]) / width / sd, bend / sd)
        return np.where(np.isfinite(root), root, vergences[index[0], 0, 0]), reach


@dataclass(frozen=True, slots=True, eq=False)
class Check:
    """Every pair's estimate, their joint estimate, and whether they agree; arrays are H x W."""

    pairs: tuple[Pair, ...]
    """What each two of the views say."""

    joint: NDArray[np.floating]
    """Vergence in dioptres that all views together tell."""

    joint_sd: NDArray[np.floating]
    """Its standard deviation in dioptres."""

    statistic: NDArray[np.floating]
    """Chi-square of the pairs' disagreement: 0 for two views, which cannot disagree."""

    freedom: int
    """Its degrees of freedom, n - 2."""

    agrees: NDArray[np.bool_]
    """False where views that do agree would disagree so much with the probability asked for only, and at the rim."""


def check_views(
    views: Sequence[View],
    *,
    near: float | None = None,
    far: float | None = None,
    psf: PsfName = "disc",
    k: float = DISC_K,
    window: float = 8.0,
    noise: float | Sequence[float] | None = None,
    align: bool = False,
    false_alarm: float = 1e-3,
) -> Check:
    """Depth from every pair of `views`, from all of them, and whether they agree (Eq. 11).

    Parameters
    ----------
    views
        Two or more views, as for `focalgradient.recover_depth`; from three on they can disagree.
    near, far, psf, k, window, noise, align, false_alarm
        As for `focalgradient.recover_depth`.

    Raises
    ------
    InputError
        If the views cannot be compared, or a setting is out of range.

    Examples
    --------
    A wall 1.25 m away through three apertures focused at 1 m: each pair tells its depth.

    >>> from focalgradient import Lens
    >>> from focalgradient.render import cast, noisy
    >>> from focalgradient.scenes import plane
    >>> lenses = [Lens(0.025, number, 1.0) for number in (16, 8, 5)]
    >>> cast_views = [cast(plane(1.25), lens, (96, 96), 3.2e-4).view for lens in lenses]
    >>> check = check_views([noisy(view, 0.003, seed) for seed, view in enumerate(cast_views)], near=1.0, noise=0.003)
    >>> [pair.views for pair in check.pairs], check.freedom
    ([(1, 2), (1, 3), (2, 3)], 1)
    >>> [round(float(np.median(pair.vergence)), 1) for pair in check.pairs]
    [0.8, 0.8, 0.8]
    """
    views = list(views)
    asked = RecoverySettings("spectra", near, far, psf, k, window, noise, align, false_alarm, lambda stage: None)
    asked.check(len(views))
    check_usable(views, "spectra")
    search = Search.over(views, near, far)
    placed = RegisteredViews.of(views, align)
    noise_sd = measured_noise(asked, placed, search.blurs(asked.psf, asked.k))[0]
    reading = Differences.of(placed, search, noise_sd, psf, k, window).read()
    freedom = len(views) - 2

    def pixels(values: NDArray[np.floating]) -> NDArray[np.float32]:
        return reading.to_pixels(values, search.spacing, placed.shape)

    return Check(
        tuple(Pair(pair.views, pixels(pair.vergence), pixels(pair.vergence_sd)) for pair in reading.pairs),
        pixels(reading.vergence),
        pixels(reading.vergence_sd),
        reading.to_blocks(reading.statistic, placed.shape),
        freedom,
        reading.to_blocks(reading.agrees(false_alarm), placed.shape),
    )


def _suppositions(search: Search) -> FloatArray:
    """Vergences a quarter of a pixel of blur apart, or a tenth of the blur where that is more."""
    vergences = [search.lowest]
    while vergences[-1] < search.highest:
        radius = float(search.radius(np.array(vergences[-1])))
        step = max(LEAST_STEP, STEP * radius) / search.slope
        vergences.append(vergences[-1] + min(step, (search.highest - search.lowest) / 4))
    # Stretched a little for the last to be the highest.
    found = np.array(vergences)
    return search.lowest + (found - search.lowest) * (search.highest - search.lowest) / (found[-1] - search.lowest)


def _at(rows: FloatArray, place: FloatArray) -> FloatArray:
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


def _quadratic(left: FloatArray, matrix: FloatArray, right: FloatArray) -> FloatArray:
    return np.einsum("pyx,yxpq,qyx->yx", left, matrix, right)


def _reach(steep: FloatArray, bend: FloatArray | float) -> FloatArray:
    """How far from a point something of that slope and bend changes by 1: where the slope vanishes, the bend counts."""
    return 2 / (steep + np.sqrt(steep**2 + 4 * bend) + 1e-12)
