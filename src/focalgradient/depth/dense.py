"""Complete a depth map at every pixel, with an uncertainty that grows with the distance to measured depth.

Within a surface, vergence is a Gaussian Markov random field on a grid of nodes: neighbours differ by little, by more
where the picture has an edge between them (a membrane; Rue & Held 2005, Gaussian Markov Random Fields). Given the map's
valid pixels, its mean is the solution of one sparse linear system, and its standard deviation is that of samples of it.
Values that contradict their surroundings count less (Student's t).

A surface without texture shows no depth, so that no measured pixel tells where another surface ends. The standard
deviation is therefore that of a mixture: with a probability that falls with the distance to measured depth, and across
edges of the picture, a pixel belongs to the surface that it is completed from; else to any other of the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import linalg

from focalgradient.depth.filters import FloatArray
from focalgradient.depth.numerics import block_sum

__all__ = ["Dense", "complete"]

MOST_NODES = 24_000
"""Maximum number of grid points: one solution takes about 0.3 s."""

LEAST_STEP = 3
"""Minimum spacing of the grid points in pixels."""

STEP_SD = 0.01
"""Standard deviation in dioptres of the difference in vergence between neighbouring pixels of one surface, chosen so
that the intervals cover held-out parts of the maps of rooms."""

ACROSS = 12.0
"""Factor by which `STEP_SD` increases across a clear edge of the picture."""

CLEAR = 3.0
"""Brightness difference between neighbouring grid points, relative to the median difference, at which an edge is half
clear."""

SPREAD = 0.55
"""Standard deviation of the vergence of surfaces about the mean measured vergence, relative to that mean. Chosen on
half of the rendered layers of `benchmarks/rooms.py` (odd seeds below 10), whose blank surface differs from the other by
0.1 to 1.2 of its vergence; 0.33 in rooms, far from measured pixels."""

SURFACE = 12.0
"""Distance in pixels, at the picture's median contrast, over which the probability of belonging to the measured surface
falls to 1/e: chosen between 6 and 32 on the same layers and half of the rooms."""

SAME = 0.7
"""Probability that a pixel at the border of the measured region belongs to the measured surface, as windows and blur
carry depth some pixels beyond the end of texture. Chosen on the same data."""

FREEDOM, ROUNDS = 4.0, 4
"""Degrees of freedom of Student's t distribution of the measured values about the field, and number of reweighting
rounds."""

SAMPLES = 48
"""Number of samples of the field: the standard deviation is accurate to 10 %, and smoothed."""

NEAR = SAME / 2
"""Probability of belonging to the measured surface above which a pixel counts as near evidence: half of that at the
border of the measured region (our choice)."""

MEASURED = 1e4
"""Conductance from a measured grid point to its own value, relative to that between neighbours; it fixes the value."""


@dataclass(frozen=True, slots=True, eq=False)
class Dense:
    """Vergence at every pixel (H x W), its standard deviation, and its evidence.

    Parameters
    ----------
    vergence, vergence_sd
        In dioptres.
    evidence
        2 where the views show depth, 1 near such pixels, 0 where depth is extrapolated.
    """

    vergence: NDArray[np.float32]
    vergence_sd: NDArray[np.float32]
    evidence: NDArray[np.uint8]


def complete(
    vergence: NDArray[np.floating],
    vergence_sd: NDArray[np.floating],
    valid: NDArray[np.bool_],
    picture: NDArray[np.floating],
    window: float,
    *,
    searched: tuple[float, float] | None = None,
    seed: int = 0,
) -> Dense:
    """Complete vergence where it is not `valid`.

    Parameters
    ----------
    vergence, vergence_sd, valid
        A depth map's, H x W; some pixel must be valid.
    picture
        H x W: the sharpest view, whose edges depth may jump at.
    window
        Standard deviation in pixels of the window in which the map's depth was estimated: within it its errors are
        alike.
    searched
        Lowest and highest vergence in dioptres that any surface may have, where that is known.
    seed
        Of the samples.

    Examples
    --------
    Two measured stripes of a slant: half-way between them depth lies half-way, and is known less well.

    >>> slant = np.tile(np.linspace(0.4, 0.6, 120), (60, 1))
    >>> valid = np.zeros(slant.shape, bool)
    >>> valid[:, 10:20] = valid[:, 100:110] = True
    >>> dense = complete(slant, np.full(slant.shape, 0.005), valid, np.ones(slant.shape), window=8.0)
    >>> bool(abs(dense.vergence[30, 60] - 0.5) < 0.02), bool(dense.vergence_sd[30, 60] > dense.vergence_sd[30, 25])
    (True, True)
    """
    shape = vergence.shape
    step = max(LEAST_STEP, int(np.ceil(np.sqrt(vergence.size / MOST_NODES))))
    counts = block_sum(np.ones(shape, np.float32), step)
    known = valid / np.maximum(vergence_sd, 1e-6).astype(float) ** 2
    weight = block_sum(known.astype(np.float32), step)
    mean = block_sum((known * vergence).astype(np.float32), step) / np.maximum(weight, 1e-12)
    # Errors are alike over a window: all its nodes together know as much as one.
    share = block_sum(valid.astype(np.float32), step) / counts
    alike = np.maximum(ndimage.gaussian_filter(share, window / step, mode="constant"), 0.02)
    weight = weight / counts / (alike * 4 * np.pi * (window / step) ** 2)
    weight = np.where(share > 0, weight, 0.0)
    middle = float(np.average(mean[share > 0], weights=weight[share > 0]))
    spread = max(SPREAD * abs(middle), float(np.median(vergence_sd[valid])))
    field = _Field.over(block_sum(np.asarray(picture, np.float32), step) / counts, step, spread)
    trust, level = np.ones(weight.shape), np.full(weight.shape, middle)
    for _ in range(ROUNDS):
        solve = field.given(weight * trust)
        level = middle + solve((weight * trust * (mean - middle)).ravel()).reshape(weight.shape)
        off = (mean - level) ** 2 * weight * alike * 4 * np.pi * (window / step) ** 2
        trust = (FREEDOM + 1) / (FREEDOM + off)
    random = np.random.default_rng(seed)
    squares = np.zeros(weight.shape)
    for _ in range(SAMPLES):
        drawn = field.drawn(random) + (np.sqrt(weight * trust) * random.standard_normal(weight.shape)).ravel()
        squares += solve(drawn).reshape(weight.shape) ** 2
    variance = ndimage.gaussian_filter(squares / SAMPLES, 1.0)
    same = SAME * field.reach(share, step)
    variance = same * variance + (1 - same) * _of_others(level, middle, spread, searched)
    full, full_sd, full_same = (_to_pixels(one, step, shape) for one in (level, np.sqrt(variance), same))
    evidence = np.where(valid, 2, np.where(full_same >= NEAR, 1, 0)).astype(np.uint8)
    return Dense(
        np.where(valid, vergence, full).astype(np.float32),
        np.where(valid, vergence_sd, full_sd).astype(np.float32),
        evidence,
    )


def _of_others(level: FloatArray, middle: float, spread: float, searched: tuple[float, float] | None) -> FloatArray:
    """Return the mean square difference in vergence (D) between other surfaces and each node's `level` (h x w).

    They scatter by `spread` about `middle`, or evenly over the range `searched`: the smaller of the two counts.
    """
    scattered = spread**2 + (level - middle) ** 2
    if searched is None:
        return scattered
    lowest, highest = searched
    even = (highest - lowest) ** 2 / 12 + (level - (lowest + highest) / 2) ** 2
    return np.minimum(scattered, even)


@dataclass(frozen=True, slots=True, eq=False)
class _Field:
    """The field before anything is known: its precision, by differences of neighbours."""

    differences: sparse.csr_matrix  # of neighbours, each over its standard deviation
    spread: float  # standard deviation about the mean

    @classmethod
    def over(cls, picture: FloatArray, step: int, spread: float) -> _Field:
        """Return the field on a grid of `step` pixels; `picture` (h x w) sets the differences of neighbours."""
        number = np.arange(picture.size).reshape(picture.shape)
        light = np.sqrt(np.maximum(picture, 0))  # by which noise, and what is seen, changes evenly
        rows = []
        for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
            change = np.abs(light[one] - light[other])
            clear = (change / (CLEAR * (np.median(change) + 1e-6 * light.max() + 1e-12))) ** 2
            sd = STEP_SD * np.sqrt(step) * (1 + (ACROSS - 1) * clear / (1 + clear))
            rows.append((number[one].ravel(), number[other].ravel(), 1 / sd.ravel()))
        first, second, scale = (np.concatenate(parts) for parts in zip(*rows, strict=True))
        place = np.arange(first.size)
        matrix = sparse.csr_matrix(
            (np.concatenate([scale, -scale]), (np.concatenate([place, place]), np.concatenate([first, second]))),
            (first.size, picture.size),
        )
        return cls(matrix, spread)

    def given(self, weight: FloatArray) -> Callable[[FloatArray], FloatArray]:
        """Return a solver for the field, given nodes measured with `weight` (h x w, 1 / variance)."""
        return self._solver(weight.ravel() + self._anchor())

    def reach(self, share: FloatArray, step: int) -> FloatArray:
        """Return the probability (h x w) that a walk from a node comes to measured depth before its surface ends.

        The walk goes from node to node as conductance lets it, which is small across edges of the picture, and its
        surface ends at an even rate, by `SURFACE`. `share` (h x w) of each node's pixels are measured.
        """
        conductance = float(np.median(self.differences.data**2))
        measured = MEASURED * conductance * share.ravel()
        found = self._solver(measured + conductance * (step / SURFACE) ** 2)(measured)
        return np.clip(found, 0, 1).reshape(share.shape)

    def _solver(self, weight: FloatArray) -> Callable[[FloatArray], FloatArray]:
        """Return a solver for the precision matrix of the differences with `weight` added to each node."""
        precision = self.differences.T @ self.differences + sparse.diags_array(weight)
        factors = linalg.splu(precision.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        solve: Callable[[FloatArray], FloatArray] = factors.solve
        return solve

    def drawn(self, random: np.random.Generator) -> FloatArray:
        """Return a random vector whose covariance is the field's precision."""
        count, nodes = self.differences.shape
        by_neighbours = self.differences.T @ random.standard_normal(count)
        return np.asarray(by_neighbours + np.sqrt(self._anchor()) * random.standard_normal(nodes), float)

    def _anchor(self) -> float:
        """Return each node's prior precision about the mean, which limits the field far from measured pixels."""
        return 1e-3 / self.spread**2


def _to_pixels(values: FloatArray, step: int, shape: tuple[int, ...]) -> FloatArray:
    """Interpolate values at nodes, the centres of blocks of `step` pixels, to all pixels."""
    place = np.meshgrid(*((np.arange(n) + 0.5) / step - 0.5 for n in shape), indexing="ij")
    return np.asarray(ndimage.map_coordinates(values, place, order=1, mode="nearest"), float)
