"""The paper's estimate of an edge's blur: a straight line through ln|C/x| over x^2 (Pentland 1987, Eqs. 5-6).

Across a step of height h blurred by a Gaussian of variance T^2 the Laplacian is
C = -h x exp(-x^2 / 2 T^2) / (sqrt(2 pi) T^3), so that ln|C/x| falls as -x^2 / (2 T^2). T^2 is the sum of the variances
of the blur, the Gaussian that is smoothed with before, the discrete Laplacian, the pixel, and the bins in which C is
averaged along the edge.

Noise makes ln|C/x| wildly unequal in variance: unweighted, as the paper has it, the line is led by the points that
know least. Here each point can be weighted by what it knows, (C / sd of C)^2, with C from the line itself.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, laplace

from focalgradient.depth.edges.steps import distance_from_arc
from focalgradient.depth.numerics import share_rows

__all__ = ["regress_edges"]

FloatArray = NDArray[np.float64]

SCALES = (0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0)
"""Standard deviations in pixels of the Gaussians to smooth with; each edge takes the one nearest its own blur."""

PLAIN = 1.0
"""The same where all points count alike."""

BIN = 0.5
"""Width in pixels, across the edge, of the bins in which C is averaged along it."""

REACH = 2.5
"""Distance from the edge, in units of T, up to which the line is fitted."""

CLEAR = 3.0
"""Size of C in its standard deviations below which a point is left out of the weighted line."""

ROUNDS = 8
"""Times that weights and reach are renewed."""


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
    weighted: bool,
) -> tuple[FloatArray, FloatArray]:
    """Variance of the Gaussian blur at each of P edges, in pixels^2, and its standard deviation from the noise.

    C, the Laplacian of the blurred image (Eq. 2), is the derivative of a Gaussian across a step (Eq. 3); the logarithm
    of C / x (Eq. 4) is a straight line in x^2 (Eq. 5), which is fitted by least squares (Eq. 6), weighted or not.

    Parameters
    ----------
    image
        H x W.
    row, column, angle, bend
        Position in pixels, direction of the normal (rad, from +column towards +row), and curvature (1/px).
    blur
        A rough standard deviation of each, which sets the smoothing and where the line is first fitted.
    length
        Length in pixels along the edge over which C is averaged.
    noise
        Standard deviation of the pixels' noise.
    weighted
        Whether points are weighted; else all count alike, as in the paper.

    Returns
    -------
    ndarray, ndarray
        P each; NaN where no line falls. The variance may come out below zero, where there is no blur.
    """
    square, sd = np.full((2, len(row)), np.nan)
    scales = np.array(SCALES if weighted else (PLAIN,))
    nearest = np.argmin(np.abs(np.log(np.maximum(blur, 0.1))[:, None] - np.log(scales)), axis=1)
    for number, scale in enumerate(scales.tolist()):
        chosen = np.flatnonzero((nearest == number) & np.isfinite(angle))
        if not len(chosen):
            continue
        curved = laplace(gaussian_filter(image, scale))
        places = np.stack([row, column, angle, bend, blur], axis=1)[chosen]
        found = np.full((len(chosen), 2), np.nan)

        def work(first: int, last: int, curved=curved, places=places, scale=scale, found=found) -> None:  # type: ignore[no-untyped-def]
            _regress(curved, places, first, last, scale, length, noise, weighted, found)

        share_rows(len(chosen), work)
        square[chosen], sd[chosen] = found.T
    return square, sd


@njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def _regress(curved, places, first, last, scale, length, noise, weighted, found):  # type: ignore[no-untyped-def]
    height, width = curved.shape
    for place in range(first, last):
        row, column, angle, bend, blur = places[place]
        c, s = math.cos(angle), math.sin(angle)
        added = scale**2 + (c**4 + s**4) / 6 + 1.0 / 12.0  # Gaussian, Laplacian, pixel
        total = blur**2 + added
        for again in range(ROUNDS):
            reach = REACH * math.sqrt(total)
            bins = 2 * int(reach / BIN + 0.5) + 1
            sums = np.zeros((bins, 4))  # members, x, x^2, C
            extent = reach + length / 2
            rim = math.ceil(3 * scale)  # where the Gaussian meets what lies beyond the frame
            for i in range(max(rim, math.ceil(row - extent)), min(height - 1 - rim, math.floor(row + extent)) + 1):
                for j in range(
                    max(rim, math.ceil(column - extent)), min(width - 1 - rim, math.floor(column + extent)) + 1
                ):
                    dx, dy = j - column, i - row
                    t = dy * c - dx * s
                    x, _ = distance_from_arc(dx * c + dy * s, t, bend)
                    b = math.floor(x / BIN + 0.5) + bins // 2
                    if abs(t) <= length / 2 and 0 <= b < bins:
                        sums[b, 0] += 1
                        sums[b, 1] += x
                        sums[b, 2] += x * x
                        sums[b, 3] += curved[i, j]
            # Bins with something on the steep part of the edge.
            x, value = np.empty(bins), np.empty(bins)
            count, spread = 0, 0.0
            for b in range(bins):
                if sums[b, 0] >= 0.5 * BIN * length:
                    middle = sums[b, 1] / sums[b, 0]
                    if abs(middle) >= 0.5:
                        x[count], value[count] = middle, sums[b, 3] / sums[b, 0]
                        spread += sums[b, 2] / sums[b, 0] - middle**2
                        count += 1
            if count < 4:
                break
            spread /= count
            density = noise**2 / (sums[:, 0].sum() / (bins * BIN))  # of the averaged noise, per pixel across
            smooth = 2 * (added - 1.0 / 12.0 + spread)  # of the noise's correlation from bin to bin
            if again == 0:
                # A first height of the edge, from C itself where it is largest.
                scaled = 0.0
                for n in range(count):
                    scaled = max(scaled, abs(value[n]))
                height_ln = math.log(scaled / math.sqrt(total) + 1e-30) + 0.5
            # Weights, and the line by weighted least squares.
            expected = np.empty(count)
            weight = np.zeros(count)
            s0 = s1 = s2 = r0 = r1 = 0.0
            used = 0
            for n in range(count):
                z = x[n] ** 2
                expected[n] = abs(x[n]) * math.exp(height_ln - z / (2 * total))
                variance = density * _correlation(0.0, smooth)
                clear = expected[n] ** 2 / variance
                if weighted:
                    if clear < CLEAR**2 or value[n] * x[n] >= 0:
                        continue
                    weight[n] = clear
                    y = math.log(abs(value[n] / x[n])) + 0.5 / clear  # noise lowers a logarithm's mean
                else:
                    if value[n] == 0:
                        continue
                    weight[n] = 1.0
                    y = math.log(abs(value[n] / x[n]))
                used += 1
                s0 += weight[n]
                s1 += weight[n] * z
                s2 += weight[n] * z * z
                r0 += weight[n] * y
                r1 += weight[n] * z * y
            determinant = s0 * s2 - s1 * s1
            if used < 4 or determinant <= 0:
                break
            slope = (s0 * r1 - s1 * r0) / determinant
            if slope >= 0:
                break
            before = total
            total = min(max(-0.5 / slope, 0.5 * before), 2 * before)
            height_ln = (s2 * r0 - s1 * r1) / determinant
            if abs(total - before) < 1e-4 * total or again == ROUNDS - 1:
                variance = 0.0
                for n in range(count):
                    for m in range(count):
                        if weight[n] > 0 and weight[m] > 0:
                            a = weight[n] * (s0 * x[n] ** 2 - s1) / expected[n]
                            b = weight[m] * (s0 * x[m] ** 2 - s1) / expected[m]
                            sign = 1.0 if x[n] * x[m] > 0 else -1.0
                            variance += sign * a * b * density * _correlation(x[n] - x[m], smooth)
                found[place, 0] = total - added - spread
                found[place, 1] = 2 * total**2 * math.sqrt(max(variance, 0.0)) / determinant
                break


@njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def _correlation(d, variance):  # type: ignore[no-untyped-def]
    """Covariance, at distance d, of white noise seen through the second derivative of a Gaussian of half `variance`."""
    q = d * d / variance
    return (3 - 6 * q + q * q) / variance**2 * math.exp(-q / 2) / math.sqrt(2 * math.pi * variance)
