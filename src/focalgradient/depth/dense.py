"""Complete a depth map at every pixel, with an uncertainty that grows with the distance to measured depth.

Vergence is the sum of two Gaussian Markov random fields (Rue & Held 2005, Gaussian Markov Random Fields). One is the
layout of the scene on a coarse grid: it bends little (a thin plate), as the vergence of a plane is linear in the
picture. The other is what departs from it, on a fine grid: neighbours differ by little, by more where the picture has
an edge between them (a membrane). Given the map's valid pixels, the mean is the solution of one sparse linear system,
and the standard deviation is that of samples of it. Values that contradict their surroundings count less (Student's t).

A surface without texture shows no depth, so that no measured pixel shows where another surface ends. The standard
deviation is therefore that of a mixture: with a probability that falls with the distance to measured depth, and across
edges of the picture, a pixel belongs to the surface that it is completed from; else to any other of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.interpolate import BSpline
from scipy.sparse import linalg

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.numerics import block_mean, block_sum, interpolate_nodes

__all__ = ["complete"]

MOST_NODES = 24_000
"""Maximum number of grid points: one solution takes about 0.3 s."""

LEAST_STEP = 3
"""Minimum spacing of the grid points in pixels."""

STEP_SD = 0.012
"""Standard deviation of the difference between neighbouring pixels of one surface in their departure from the layout,
relative to the mean measured vergence. Chosen between 0.006 and 0.025 on the 18 rooms that show depth
(`benchmarks/rooms.py`): mean relative error at every pixel .135 to .136 up to 0.017, .138 at 0.025."""

BEND = 3.3
"""Bending of the layout: standard deviation of the second derivative of vergence by place (in frame widths), averaged
over one square frame width, relative to the mean measured vergence. Chosen on the same rooms: mean relative error .135,
.136 at 1.6, .137 at 5, .145 at 10."""

SLOPE = 0.5
"""Standard deviation of the layout's change across one frame width, relative to the mean measured vergence. Chosen on
the same rooms: mean relative error .138 at 0.25, .135 at 0.5 and 1."""

CELLS = 11
"""Cells of the layout's grid along the longer side of the frame; 6 and 16 give the same error to 1 %."""

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


def complete(
    vergence: NDArray[np.floating],
    vergence_sd: NDArray[np.floating],
    valid: Mask,
    picture: NDArray[np.floating],
    window: float,
    *,
    searched: tuple[float, float] | None = None,
    seed: int = 0,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint8]]:
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

    Returns
    -------
    vergence, vergence_sd, evidence
        H x W each: in dioptres, and 2 where the views show depth, 1 near such pixels, 0 where depth is extrapolated.

    Examples
    --------
    Two measured stripes of a slant: half-way between them depth lies half-way, and is known less well.

    >>> slant = np.tile(np.linspace(0.4, 0.6, 120), (60, 1))
    >>> valid = np.zeros(slant.shape, bool)
    >>> valid[:, 10:20] = valid[:, 100:110] = True
    >>> vergence, sd, _ = complete(slant, np.full(slant.shape, 0.005), valid, np.ones(slant.shape), window=8.0)
    >>> bool(abs(vergence[30, 60] - 0.5) < 0.02), bool(sd[30, 60] > sd[30, 25])
    (True, True)
    """
    shape = vergence.shape
    step = max(LEAST_STEP, int(np.ceil(np.sqrt(vergence.size / MOST_NODES))))
    counts = block_sum(np.ones(shape, np.float32), step)
    known = valid / np.maximum(vergence_sd, 1e-6).astype(float) ** 2
    weight = block_sum(known.astype(np.float32), step)
    mean = block_sum((known * vergence).astype(np.float32), step) / np.maximum(weight, 1e-12)
    # Errors are alike over a window: all its nodes together know as much as one.
    share = block_mean(valid, step)
    alike = np.maximum(ndimage.gaussian_filter(share, window / step, mode="constant"), 0.02)
    weight = weight / counts / (alike * 4 * np.pi * (window / step) ** 2)
    weight = np.where(share > 0, weight, 0.0)
    middle = float(np.average(mean[share > 0], weights=weight[share > 0]))
    scale = max(abs(middle), float(np.median(vergence_sd[valid])) / SPREAD)
    field = _Field.over(block_mean(picture, step), step, scale)
    trust, level = np.ones(weight.shape), np.full(weight.shape, middle)
    for _ in range(ROUNDS):
        given = field.given(weight * trust)
        level = middle + given(np.zeros(field.prior.shape[0]), np.sqrt(weight * trust) * (mean - middle))
        off = (mean - level) ** 2 * weight * alike * 4 * np.pi * (window / step) ** 2
        trust = (FREEDOM + 1) / (FREEDOM + off)
    random = np.random.default_rng(seed)
    squares = sum(
        given(random.standard_normal(field.prior.shape[0]), random.standard_normal(weight.size)) ** 2
        for _ in range(SAMPLES)
    )
    variance = ndimage.gaussian_filter(squares / SAMPLES, 1.0)
    same = SAME * field.reach(share, step)
    variance = same * variance + (1 - same) * _of_others(level, middle, SPREAD * scale, searched)
    full, full_sd, full_same = (interpolate_nodes(one, None, step, shape) for one in (level, np.sqrt(variance), same))
    evidence = np.where(valid, 2, np.where(full_same >= NEAR, 1, 0)).astype(np.uint8)
    return (
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
    """The field before anything is known: rows over standard deviations of its two parts."""

    differences: sparse.csr_matrix  # of neighbouring departures
    prior: sparse.csr_matrix  # of both parts: differences and size of the departures, then bends of the layout
    to_nodes: sparse.csr_matrix  # from both parts to the field's values

    @classmethod
    def over(cls, picture: FloatArray, step: int, scale: float) -> _Field:
        """Return the field on a grid of `step` pixels; `picture` (h x w) sets the differences of neighbours.

        `scale` is the size of the mean vergence in dioptres, of which the constants are shares.
        """
        number = np.arange(picture.size).reshape(picture.shape)
        light = np.sqrt(np.maximum(picture, 0))  # noise and visible contrast are uniform on this scale
        rows = []
        for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
            change = np.abs(light[one] - light[other])
            clear = (change / (CLEAR * (np.median(change) + 1e-6 * light.max() + 1e-12))) ** 2
            sd = STEP_SD * scale * np.sqrt(step) * (1 + (ACROSS - 1) * clear / (1 + clear))
            rows.append((number[one].ravel(), number[other].ravel(), 1 / sd.ravel()))
        first, second, inverse = (np.concatenate(parts) for parts in zip(*rows, strict=True))
        place = np.arange(first.size)
        differences = sparse.csr_matrix(
            (np.concatenate([inverse, -inverse]), (np.concatenate([place, place]), np.concatenate([first, second]))),
            (first.size, picture.size),
        )
        high, wide = picture.shape
        cells = [max(3, round(count / max(picture.shape) * CELLS) + 1) for count in picture.shape]
        layout = sparse.csr_matrix(sparse.kron(_between(high, cells[0]), _between(wide, cells[1])))
        own = sparse.eye_array(picture.size, format="csr")
        anchor = np.sqrt(1e-3) / (SPREAD * scale)  # without which a constant could belong to either part
        departures = sparse.vstack([differences, anchor * own])
        prior = sparse.csr_matrix(sparse.block_diag([departures, _bends(cells, high / wide, scale)]))
        return cls(differences, prior, sparse.hstack([own, layout], format="csr"))

    def given(self, weight: FloatArray) -> Callable[[FloatArray, FloatArray], FloatArray]:
        """Return the solution (h x w) for given rows of the prior, and values of nodes measured with `weight` (h x w).

        Least squares over the departures from the layout, then the layout's values; each row, and each value, is over
        its standard deviation. `weight` is 1 / variance.
        """
        measured = sparse.diags_array(np.sqrt(weight).ravel()) @ self.to_nodes
        rows = sparse.vstack([self.prior, measured], format="csr")
        solve = _solver(rows.T @ rows)

        def solved(prior: FloatArray, values: FloatArray) -> FloatArray:
            found = self.to_nodes @ solve(rows.T @ np.concatenate([prior, values.ravel()]))
            return np.asarray(found, float).reshape(weight.shape)

        return solved

    def reach(self, share: FloatArray, step: int) -> FloatArray:
        """Return the probability (h x w) that a walk from a node comes to measured depth before its surface ends.

        The walk goes from node to node as conductance lets it, which is small across edges of the picture, and its
        surface ends at an even rate, by `SURFACE`. `share` (h x w) of each node's pixels are measured.
        """
        conductance = float(np.median(self.differences.data**2))
        measured = MEASURED * conductance * share.ravel()
        ends = sparse.diags_array(measured + conductance * (step / SURFACE) ** 2)
        found = _solver(self.differences.T @ self.differences + ends)(measured)
        return np.clip(found, 0, 1).reshape(share.shape)


def _solver(precision: sparse.csr_matrix) -> Callable[[FloatArray], FloatArray]:
    """Return a solver for a sparse positive definite matrix."""
    factors = linalg.splu(precision.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    solve: Callable[[FloatArray], FloatArray] = factors.solve
    return solve


def _between(nodes: int, cells: int) -> sparse.csr_array:
    """Return the linear interpolation (nodes x cells) from grid points at equal distances over the same length."""
    place = (np.arange(nodes) + 0.5) / nodes * (cells - 1)
    return BSpline.design_matrix(place, np.pad(np.arange(cells, dtype=float), 1, mode="edge"), 1)


def _bends(cells: Sequence[int], aspect: float, scale: float) -> sparse.csr_matrix:
    """Return the rows of the layout's prior (rows x grid points), for a mean vergence of `scale` dioptres.

    The energy of a thin plate: the integral of the squared second derivatives over the frame, which is one wide and
    `aspect` high. Then its mean and its slopes, which that energy leaves free.
    """
    (down, across), (tall, long) = cells, (aspect / (cells[0] - 1), 1 / (cells[1] - 1))

    def bent(down_order: int, across_order: int, size: float) -> sparse.csr_matrix:
        by_line, by_column = (
            np.diff(np.eye(count), order, axis=0) for count, order in ((down, down_order), (across, across_order))
        )
        return sparse.csr_matrix(sparse.kron(size * by_line, by_column))

    root = math.sqrt(tall * long) / (BEND * scale)
    second = [bent(2, 0, root / tall**2), bent(0, 2, root / long**2), bent(1, 1, root * math.sqrt(2) / (tall * long))]
    y, x = np.meshgrid(np.linspace(-0.5, 0.5, down) * aspect, np.linspace(-0.5, 0.5, across), indexing="ij")
    plane = np.linalg.pinv(np.stack([np.ones(y.size), y.ravel(), x.ravel()], axis=1))
    known = sparse.csr_matrix(plane / (scale * np.array([[SPREAD], [SLOPE], [SLOPE]])))
    return sparse.vstack([*second, known], format="csr")
