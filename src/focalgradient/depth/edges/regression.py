"""The paper's estimate of an edge's blur: a straight line through ln|C/x| over x^2 (Pentland 1987, Eqs. 5-6).

Across a step of height h blurred by a Gaussian of variance T^2 the Laplacian is
C = -h x exp(-x^2 / 2 T^2) / (sqrt(2 pi) T^3), so that ln|C/x| falls as -x^2 / (2 T^2). T^2 is the sum of the variances
of the blur, the Gaussian that is smoothed with before, the discrete Laplacian, the pixel, and the bins in which C is
averaged along the edge.

Noise makes ln|C/x| wildly unequal in variance: unweighted, as the paper has it, the line is led by the points that
know least.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, laplace

from focalgradient.arrays import FloatArray
from focalgradient.depth.edges.steps import distance_from_arc
from focalgradient.loops import compiled
from focalgradient.parallel import share_rows

__all__ = ["regress_edges"]


SMOOTHING = 1.0
"""Standard deviation in pixels of the smoothing Gaussian. Chosen by hand."""

BIN = 0.5
"""Width in pixels, across the edge, of the bins in which C is averaged along the edge. Chosen by hand."""

LINE_REACH = 2.5
"""Maximum distance from the edge, in units of T, of the points to which the line is fitted. Chosen by hand."""

MAX_RENEWALS = 8
"""Maximum number of updates of the reach. Chosen by hand."""


def regress_edges(
    image: NDArray[np.float32],
    row: FloatArray,
    column: FloatArray,
    angle: FloatArray,
    bend: FloatArray,
    blur: FloatArray,
    *,
    length: float,
    noise: float,
) -> tuple[FloatArray, FloatArray]:
    """Estimate the variance of Gaussian blur at each of P edges, in pixels^2, and its standard deviation due to noise.

    C, the Laplacian of the blurred image (Eq. 2), is the derivative of a Gaussian across a step (Eq. 3); the logarithm
    of C / x (Eq. 4) is a straight line in x^2 (Eq. 5), which is fitted by least squares (Eq. 6).

    Parameters
    ----------
    image
        H x W.
    row, column, angle, bend
        Position in pixels, direction of the normal (rad, from +column towards +row), and curvature (1/px).
    blur
        A rough standard deviation of each, which sets where the line is first fitted.
    length
        Length in pixels along the edge over which C is averaged.
    noise
        Standard deviation of the pixels' noise.

    Returns
    -------
    ndarray, ndarray
        P each; NaN where no line falls. The variance may come out below zero, where there is no blur.
    """
    curved = laplace(gaussian_filter(image, SMOOTHING))
    places, found = np.stack([row, column, angle, bend, blur], axis=1), np.full((len(row), 2), np.nan)
    share_rows(len(row), lambda first, last: _regress(curved, places, first, last, length, noise, found))
    return found[:, 0], found[:, 1]


@compiled
def _regress(curved, places, first, last, length, noise, found):  # type: ignore[no-untyped-def]
    for place in range(first, last):
        row, column, angle, bend, blur = places[place]
        if not math.isfinite(angle):
            continue
        c, s = math.cos(angle), math.sin(angle)
        added = SMOOTHING**2 + (c**4 + s**4) / 6 + 1.0 / 12.0  # Gaussian, Laplacian, pixel
        total = blur**2 + added
        height_ln = 0.0
        for again in range(MAX_RENEWALS):
            reach = LINE_REACH * math.sqrt(total)
            sums = _binned(curved, row, column, c, s, bend, length, reach)
            x, value, spread = _steep_bins(sums, length)
            if len(x) < 4:
                break
            density = noise**2 / (sums[:, 0].sum() / (len(sums) * BIN))  # of the averaged noise, per pixel across
            smooth = 2 * (added - 1.0 / 12.0 + spread)  # of the noise's correlation from bin to bin
            if again == 0:
                # A first height of the edge, from C itself where it is largest.
                height_ln = math.log(np.abs(value).max() / math.sqrt(total) + 1e-30) + 0.5
            expected = np.abs(x) * np.exp(height_ln - x**2 / (2 * total))
            weight = (value != 0).astype(np.float64)
            y = np.log(np.where(value != 0, np.abs(value / x), 1.0))
            s0, s1, s2 = weight.sum(), (weight * x**2).sum(), (weight * x**4).sum()
            r0, r1 = (weight * y).sum(), (weight * x**2 * y).sum()
            determinant = s0 * s2 - s1 * s1
            if (weight > 0).sum() < 4 or determinant <= 0:
                break
            slope = (s0 * r1 - s1 * r0) / determinant
            if slope >= 0:
                break
            before = total
            total = min(max(-0.5 / slope, 0.5 * before), 2 * before)
            height_ln = (s2 * r0 - s1 * r1) / determinant
            if abs(total - before) < 1e-4 * total or again == MAX_RENEWALS - 1:
                lever = weight * (s0 * x**2 - s1) / expected
                variance = _line_variance(x, lever, density, smooth)
                found[place, 0] = total - added - spread
                found[place, 1] = 2 * total**2 * math.sqrt(max(variance, 0.0)) / determinant
                break


@compiled
def _binned(curved, row, column, c, s, bend, length, reach):  # type: ignore[no-untyped-def]
    """Return the sums over the bins across an edge: of members, x, x^2 and C."""
    height, width = curved.shape
    bins = 2 * int(reach / BIN + 0.5) + 1
    sums = np.zeros((bins, 4))
    extent = reach + length / 2
    rim = math.ceil(3 * SMOOTHING)  # where the Gaussian meets what lies beyond the frame
    for i in range(max(rim, math.ceil(row - extent)), min(height - 1 - rim, math.floor(row + extent)) + 1):
        for j in range(max(rim, math.ceil(column - extent)), min(width - 1 - rim, math.floor(column + extent)) + 1):
            dx, dy = j - column, i - row
            t = dy * c - dx * s
            x, _ = distance_from_arc(dx * c + dy * s, t, bend)
            b = math.floor(x / BIN + 0.5) + bins // 2
            if abs(t) <= length / 2 and 0 <= b < bins:
                sums[b, 0] += 1
                sums[b, 1] += x
                sums[b, 2] += x * x
                sums[b, 3] += curved[i, j]
    return sums


@compiled
def _steep_bins(sums, length):  # type: ignore[no-untyped-def]
    """Return mean x and C of the bins on the edge's slope that are at least half filled, and the mean variance of x."""
    x, value = np.empty(len(sums)), np.empty(len(sums))
    count, spread = 0, 0.0
    for b in range(len(sums)):
        if sums[b, 0] >= 0.5 * BIN * length:
            middle = sums[b, 1] / sums[b, 0]
            if abs(middle) >= 0.5:
                x[count], value[count] = middle, sums[b, 3] / sums[b, 0]
                spread += sums[b, 2] / sums[b, 0] - middle**2
                count += 1
    return x[:count], value[:count], spread / max(count, 1)


@compiled
def _line_variance(x, lever, density, smooth):  # type: ignore[no-untyped-def]
    """Return the variance of the sum of ln|C/x| x `lever`, with noise correlated between bins."""
    variance = 0.0
    for n in range(len(x)):
        for m in range(len(x)):
            if lever[n] != 0 and lever[m] != 0:
                sign = 1.0 if x[n] * x[m] > 0 else -1.0
                variance += sign * lever[n] * lever[m] * density * _correlation(x[n] - x[m], smooth)
    return variance


@compiled
def _correlation(d, variance):  # type: ignore[no-untyped-def]
    """Return the covariance at distance d of white noise filtered by g'', g a Gaussian of variance `variance` / 2."""
    q = d * d / variance
    return (3 - 6 * q + q * q) / variance**2 * math.exp(-q / 2) / math.sqrt(2 * math.pi * variance)
