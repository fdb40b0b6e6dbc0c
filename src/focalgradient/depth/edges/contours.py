"""Where the edges are: zero-crossings of the Laplacian of a Gaussian, linked into smooth contours.

An edge is sought at the finest of a few scales at which the image's noise leaves its zero-crossing in place: a sharp
one is not mixed with its neighbours, a faint or wide one is not lost in the noise. Contours are cut where they turn
sharply.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, laplace, maximum_filter

from focalgradient.arrays import FloatArray
from focalgradient.loops import compiled

__all__ = ["find_contours"]


SCALES = (1.0, 2.0, 4.0, 8.0)
"""Standard deviations in pixels of the Gaussians, in octaves, the finest first. Chosen by hand."""

SIGNIFICANT = 8.0
"""Slope of an edge, in standard deviations of the slope of noise, above which a contour starts. Chosen by hand."""

JITTER = 0.15
"""Maximum displacement of a zero-crossing by noise, relative to the Gaussian's standard deviation, at which a contour
may start at this scale. Chosen by hand."""

WEAKER = 0.6
"""Slope that continues a contour, relative to the slope that starts one. Chosen by hand."""

SHARP_TURN = 0.6
"""Angle in radians (34 degrees) between consecutive stretches of a contour above which it is cut. Chosen by hand."""

STRETCH = 1.5
"""Length of a stretch between two turns, in standard deviations of the blur. Chosen by hand."""


def find_contours(
    image: NDArray[np.float32], noise: float, least: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, NDArray[np.intp]]:
    """Find contours of at least `least` points in `image`, whose pixels' noise has the standard deviation `noise`.

    Returns
    -------
    row, column, angle, blur, segment
        Of points about one pixel apart along contours: position in pixels, the first pixel's centre at (0, 0);
        direction of the steepest rise, in radians from +column towards +row; rough standard deviation of the edge in
        pixels, the Gaussian of the search removed; and number of the contour, whose points follow each other.
    """
    taken = np.zeros(image.shape, np.bool_)
    found: list[FloatArray] = []
    counts: list[NDArray[np.intp]] = []
    for scale in SCALES:
        if min(image.shape) < 4 * scale:
            break
        smooth = gaussian_filter(image, scale)
        curved = laplace(smooth)
        signs = curved > 0
        most = int((signs[1:] != signs[:-1]).sum() + (signs[:, 1:] != signs[:, :-1]).sum())
        # Noise of the two: n / (sqrt(8 pi) s^2) and n / (sqrt(2 pi) s^3).
        slope = SIGNIFICANT * noise / (np.sqrt(8 * np.pi) * scale**2)
        bend = noise / (np.sqrt(2 * np.pi) * scale**3) / (JITTER * scale)
        rim = 1 + int(scale)  # nearer to the frame the Gaussian meets what lies beyond it
        chain, ends = _link(smooth, curved, taken, slope, bend, rim, most)
        points, lengths = _cut(chain, ends, scale, least)
        found.append(points)
        counts.append(lengths)
        if len(points):
            drawn = np.zeros_like(taken)
            drawn[tuple(np.rint(points[:, :2]).astype(np.intp).T)] = True
            taken |= maximum_filter(drawn, 2 * int(4 * scale) + 1)
    points, lengths = np.concatenate(found), np.concatenate(counts)
    segment = np.repeat(np.arange(len(lengths)), lengths)
    row, column, down, right, bend_at = points.T
    return row, column, np.arctan2(down, right), bend_at, segment


@compiled
def _crossing(smooth, curved, i, j, down, rim):  # type: ignore[no-untyped-def]
    """Return the zero-crossing between pixel (i, j) and the next one below (`down`) or right of it.

    Row, column, gradient (down, right), and the slope of the Laplacian down the gradient. None within `rim` pixels of
    the frame.
    """
    i1, j1 = (i + 1, j) if down else (i, j + 1)
    if i < rim or j < rim or i1 >= smooth.shape[0] - rim or j1 >= smooth.shape[1] - rim:
        return 0.0, 0.0, 0.0, 0.0, -1.0
    a = curved[i, j] / (curved[i, j] - curved[i1, j1])
    b = 1 - a
    gy = 0.5 * (b * (smooth[i + 1, j] - smooth[i - 1, j]) + a * (smooth[i1 + 1, j1] - smooth[i1 - 1, j1]))
    gx = 0.5 * (b * (smooth[i, j + 1] - smooth[i, j - 1]) + a * (smooth[i1, j1 + 1] - smooth[i1, j1 - 1]))
    cy = 0.5 * (b * (curved[i + 1, j] - curved[i - 1, j]) + a * (curved[i1 + 1, j1] - curved[i1 - 1, j1]))
    cx = 0.5 * (b * (curved[i, j + 1] - curved[i, j - 1]) + a * (curved[i1, j1 + 1] - curved[i1, j1 - 1]))
    fall = -(cy * gy + cx * gx) / (np.hypot(gy, gx) + 1e-30)
    return i + (a if down else 0.0), j + (0.0 if down else a), gy, gx, fall


@compiled
def _way_out(curved, i, j, way_in):  # type: ignore[no-untyped-def]
    """Return the side (top, right, bottom, left) by which a contour leaves the square of pixels at (i, j)."""
    a, b = curved[i, j] > 0, curved[i, j + 1] > 0
    d, c = curved[i + 1, j] > 0, curved[i + 1, j + 1] > 0
    if a == c and b == d:  # a saddle, all four sides crossed: the middle decides which corners hang together
        middle = curved[i, j] + curved[i, j + 1] + curved[i + 1, j] + curved[i + 1, j + 1] > 0
        return way_in ^ 1 if middle == a else 3 - way_in
    for side, crossed in enumerate((a != b, b != c, c != d, d != a)):
        if crossed and side != way_in:
            return side
    return -1


@compiled
def _link(smooth, curved, taken, least_slope, least_bend, rim, most):  # type: ignore[no-untyped-def]
    """Trace zero-crossings from square to square; return points (row, column, gradient, bend) and each chain's end."""
    height, width = smooth.shape
    points = np.empty((most, 5))
    ends = np.empty(most + 1, np.intp)
    visited = np.zeros((height, width, 2), np.bool_)
    count, chains = 0, 0
    for i0 in range(1, height - 2):
        for j0 in range(1, width - 2):
            for down0 in range(2):
                first = count
                for back in range(2):
                    # The two squares on either side of the crossing.
                    i, j, down = i0, j0, down0
                    if down:
                        ci, cj, way_in = (i, j, 3) if not back else (i, j - 1, 1)
                    else:
                        ci, cj, way_in = (i, j, 0) if not back else (i - 1, j, 2)
                    start = True
                    while True:
                        if not (start and back):  # the crossing to start from is there already
                            i1, j1 = (i + 1, j) if down else (i, j + 1)
                            if (
                                i1 >= height
                                or j1 >= width
                                or (curved[i, j] > 0) == (curved[i1, j1] > 0)
                                or visited[i, j, down]
                                or taken[i, j]
                            ):
                                break
                            row, column, gy, gx, fall = _crossing(smooth, curved, i, j, down, rim)
                            enough = 1.0 if start else WEAKER
                            if not (fall > enough * least_bend and np.hypot(gy, gx) > enough * least_slope):
                                break
                            visited[i, j, down] = True
                            points[count, 0], points[count, 1] = row, column
                            points[count, 2], points[count, 3], points[count, 4] = gy, gx, fall
                            count += 1
                        start = False
                        if ci < 0 or cj < 0 or ci > height - 2 or cj > width - 2:
                            break
                        out = _way_out(curved, ci, cj, way_in)
                        if out == 0:
                            i, j, down, ci, way_in = ci, cj, 0, ci - 1, 2
                        elif out == 1:
                            i, j, down, cj, way_in = ci, cj + 1, 1, cj + 1, 3
                        elif out == 2:
                            i, j, down, ci, way_in = ci + 1, cj, 0, ci + 1, 0
                        else:
                            i, j, down, cj, way_in = ci, cj, 1, cj - 1, 1
                    if count == first:
                        break
                    if not back:
                        for n in range((count - first) // 2):
                            for m in range(5):
                                one, other = first + n, count - 1 - n
                                points[one, m], points[other, m] = points[other, m], points[one, m]
                if count > first:
                    ends[chains] = count
                    chains += 1
    return points[:count], ends[:chains]


@compiled
def _cut(points, ends, scale, least):  # type: ignore[no-untyped-def]
    """Resample chains at steps of one pixel and cut them at sharp turns; the last value of a point becomes its blur."""
    sampled = np.empty((2 * len(points) + len(ends), 5))
    lengths = np.empty(len(sampled), np.intp)
    count, pieces, first = 0, 0, 0
    for end in ends:
        chain = points[first:end]
        first = end
        # Every whole pixel along the chain.
        walked, begin = 0.0, count
        for n in range(len(chain) - 1):
            step = np.hypot(chain[n + 1, 0] - chain[n, 0], chain[n + 1, 1] - chain[n, 1])
            while count - begin <= walked + step:
                part = (count - begin - walked) / step if step > 0 else 0.0
                if count >= len(sampled) or part > 1:
                    break
                for m in range(5):
                    sampled[count, m] = chain[n, m] + part * (chain[n + 1, m] - chain[n, m])
                # A Gaussian edge filtered by a Gaussian: slope over bend is their variances' sum.
                steep = np.hypot(sampled[count, 2], sampled[count, 3])
                sampled[count, 4] = np.sqrt(max(steep / sampled[count, 4], 0.0))
                count += 1
            walked += step
        length = count - begin
        if length < least:
            count = begin
            continue
        width = np.median(sampled[begin:count, 4])
        reach = int(min(max(3.0, STRETCH * float(width)), 24.0))
        turn = np.zeros(length)
        for n in range(reach, length - reach):
            here = sampled[begin + n]
            before, after = sampled[begin + n - reach], sampled[begin + n + reach]
            ay, ax, by, bx = here[0] - before[0], here[1] - before[1], after[0] - here[0], after[1] - here[1]
            turn[n] = abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by))
        start, kept = 0, begin
        for n in range(length + 1):
            cut = n == length or (turn[n] > SHARP_TURN and turn[n] == turn[max(0, n - reach) : n + reach + 1].max())
            if cut:
                if n - start >= least:
                    blur = np.median(sampled[begin + start : begin + n, 4])
                    for m in range(start, n):
                        for k in range(4):
                            sampled[kept, k] = sampled[begin + m, k]
                        sampled[kept, 4] = np.sqrt(max(blur**2 - scale**2, 0.0))
                        kept += 1
                    lengths[pieces] = n - start
                    pieces += 1
                start = n + 1
        count = kept
    return sampled[:count].copy(), lengths[:pieces].copy()
