"""A blurred step fitted to the pixels along an edge, by maximum likelihood.

The pixels of a band along the edge are explained as low + (high - low) E(d / width), d their distance from an arc and
E the integral of the blur's line spread. Nothing is interpolated, so that the noise stays independent from pixel to
pixel. Where the arc lies, its turn and its bend cost no precision of the width: they are even in d where it is odd.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.loops import compiled, inlined
from focalgradient.parallel import share_rows
from focalgradient.psf import Psf

__all__ = ["FIELDS", "Profile", "distance_from_arc", "fit_steps"]


EDGE_ERROR = 0.01
"""Deviation of real lenses' edges from the model, relative to contrast, that is tolerated. Chosen by hand."""

REACHES = (4.5, 6.0, 8.0, 11.0)
"""Half-widths of the band, in standard deviations of the blur: the first must fit; wider ones are tried in turn."""

IN_FRAME = 0.5
"""Minimum proportion of the first band within the frame; with less the step, which is in the middle of the band, cannot
be seen."""

WIDENING = 2.05
"""Misfit in standard deviations above which a wider band is rejected (probability 2 %)."""

LEAST_BAND, WIDEST_BAND = 4.0, 96.0
"""Minimum and maximum half-width of the band in pixels. Chosen by hand."""

WIDEST_SIGMA = 20.0
"""Maximum standard deviation of the blur in pixels. Chosen by hand."""

NARROWEST_SIGMA = 0.15
"""Minimum standard deviation of the blur in pixels, including that of the pixel: the value of an edge in focus."""

PIXEL_POINTS = 1 / math.sqrt(15)
"""Spacing in pixels of four equally spaced points with the variance of a pixel, 1/12: 5/4 of the squared spacing."""

TABLE = 4097
"""Number of samples of an edge response from the step to its end; linear interpolation is accurate to 1e-7."""

MAX_FIT_STEPS = 20
"""Maximum number of iterations of a fit; an edge takes about five."""

NOISE_EXCESS = 2.0
"""Ratio of a band's residual to the image's noise up to which the residual is attributed to noise if noise is not
given. Chosen by hand."""

FIELDS = ("low", "high", "square", "square_sd", "angle", "offset", "bend", "misfit", "freedom", "allowed", "pixels")
"""Quantities estimated of each step; `misfit` is a chi-square of `freedom` degrees, `allowed` its noncentrality from a
real lens's error, and `pixels` the degrees of freedom of the noise in it."""


class Profile(NamedTuple):
    """The edge spread of a blur of width 1, as a table, and how the square pixel joins it.

    A Gaussian takes the pixel's variance, 1/12, into its own. A shape with a rim is averaged over four points of the
    pixel, so far apart that they have that variance too.
    """

    edge: FloatArray  # E(u) from u = 0 to `end`
    line: FloatArray  # its derivative
    end: float
    averaged: bool
    sd: float  # of the line spread of width 1

    per_radius: float  # of a width, over the blur radius

    @classmethod
    def of(cls, psf: Psf) -> Profile:
        """The profile of a shape of blur: its width is the blur radius, or sigma of a shape that absorbs the pixel.

        >>> from focalgradient.psf import Gaussian
        >>> round(float(np.interp(1.0, np.linspace(0, 6, 4097), Profile.of(Gaussian()).edge)), 4)
        0.8413
        """
        sd = psf.sd_per_radius
        width = sd if psf.absorbs_pixel else 1.0  # in radii
        end = psf.edge_reach / width
        u = np.linspace(0, end, TABLE)
        edge, line = psf.edge_response(u * width, 1.0), psf.line_response(u * width, 1.0) * width
        return cls(edge, line, end, not psf.absorbs_pixel, sd / width, width)


def fit_steps(
    image: NDArray[np.float32],
    row: FloatArray,
    column: FloatArray,
    angle: FloatArray,
    blur: FloatArray,
    *,
    profile: Profile,
    length: float,
    noise: float,
    noise_known: bool,
) -> dict[str, FloatArray]:
    """Fit a step at each of P places.

    Parameters
    ----------
    image
        H x W; NaN where a pixel is masked.
    row, column, angle
        Where the edges are (pixels) and the direction of their rise (rad, from +column towards +row).
    blur
        Rough standard deviation of each, in pixels.
    profile, length
        The blur, and the length of the band in pixels.
    noise, noise_known
        Standard deviation of the pixels' noise; where it is not known for sure, each band's own is taken, as far as
        it lies within `NOISE_EXCESS` times it.

    Returns
    -------
    dict of ndarray
        `FIELDS`, each P; ``square`` is NaN where no step was found.
    """
    table = np.full((len(row), len(FIELDS)), np.nan)
    given = image, np.stack([row, column, angle, blur], axis=1), profile, length, noise, noise_known, table
    share_rows(len(row), lambda first, last: _fit_places(first, last, *given))
    return dict(zip(FIELDS, table.T, strict=True))


@compiled
def _gather(image, row, column, angle, half, reach, room):  # type: ignore[no-untyped-def]
    """Return the pixels of the band about (row, column): their x, t and values, in the arrays of `room`."""
    height, width = image.shape
    xs, ts, values = room
    c, s = math.cos(angle), math.sin(angle)
    across, down = (c if abs(c) > 1e-9 else 1e-9), (s if abs(s) > 1e-9 else 1e-9)
    count = 0
    extent = abs(s) * reach + abs(c) * half
    for i in range(max(0, math.ceil(row - extent)), min(height - 1, math.floor(row + extent)) + 1):
        dy = i - row
        # |dx c + dy s| <= reach and |dy c - dx s| <= half
        a, b = (-reach - dy * s) / across, (reach - dy * s) / across
        d, e = (dy * c - half) / down, (dy * c + half) / down
        left, right = max(min(a, b), min(d, e), -column), min(max(a, b), max(d, e), width - 1 - column)
        first, last = math.ceil(column + left), math.floor(column + right)
        for j in range(first, last + 1):
            if count < len(xs) and image[i, j] == image[i, j]:  # NaN: masked
                dx = j - column
                xs[count], ts[count], values[count] = dx * c + dy * s, dy * c - dx * s, image[i, j]
                count += 1
    return xs[:count], ts[:count], values[:count]


@compiled
def _spread(x, w, profile):  # type: ignore[no-untyped-def]
    """Return the edge spread at x, its slope, and minus its derivative by the width w."""
    edge, line, end = profile.edge, profile.line, profile.end
    scale = (len(edge) - 1) / end
    total, slope, by_width = 0.0, 0.0, 0.0
    nodes = 4 if profile.averaged else 1
    for node in range(nodes):
        u = (x + (node - (nodes - 1) / 2) * PIXEL_POINTS) / w
        a = abs(u)
        if a >= end:
            e, f = 1.0, 0.0
        else:
            place = a * scale
            n = int(place)
            part = place - n
            e, f = edge[n] + part * (edge[n + 1] - edge[n]), line[n] + part * (line[n + 1] - line[n])
        total += e if u >= 0 else 1 - e
        slope += f
        by_width += f * u
    return total / nodes, slope / (nodes * w), by_width / (nodes * w)


@inlined
def distance_from_arc(x, t, bend):  # type: ignore[no-untyped-def]
    """Return the signed distance of (x, t) from an arc (curvature `bend`) tangent to x = 0 at t = 0, and its slope."""
    a = 1 - bend * x
    b = math.sqrt(a * a + (bend * t) ** 2)
    return (2 * x - bend * (x * x + t * t)) / (1 + b), a / max(b, 1e-9)


@compiled
def _residual(p, x, t, value, profile, d):  # type: ignore[no-untyped-def]
    """Return the distance of a pixel at (x, t) from the step and its residual; set `d` to the step's derivatives."""
    contrast = p[1] - p[0]
    x, steep = distance_from_arc(x - p[2] - p[3] * t, t, p[4])
    e, f, g = _spread(x, p[5], profile)
    f *= contrast * steep
    d[0], d[1], d[2], d[3], d[4], d[5] = 1 - e, e, -f, -f * t, -f * t * t / 2, -contrast * g
    return x, value - p[0] - contrast * e


@compiled
def _normal_equations(p, band, profile, matrix, vector):  # type: ignore[no-untyped-def]
    """Return the sums of products of the derivatives, and with the residuals; the residuals' sum of squares."""
    xs, ts, values = band
    matrix[:], vector[:] = 0.0, 0.0
    square, d = 0.0, np.empty(6)
    for n in range(len(xs)):
        _, residual = _residual(p, xs[n], ts[n], values[n], profile, d)
        square += residual * residual
        for k in range(6):
            vector[k] += d[k] * residual
            for m in range(k + 1):
                matrix[k, m] += d[k] * d[m]
    return square


@compiled
def _copy(values, to):  # type: ignore[no-untyped-def]
    """Copy an array. ``to[:] = values`` would do, but the text of its errors takes numba seconds to compile."""
    given, taken = values.ravel(), to.ravel()
    for k in range(len(taken)):
        taken[k] = given[k]


@compiled
def _solve(matrix, vector, damping, lower, out):  # type: ignore[no-untyped-def]
    """Solve by Cholesky with a damped diagonal, given the lower triangle; return False if it is singular."""
    size = len(vector)
    for k in range(size):
        for m in range(k + 1):
            total = matrix[k, m] * (1 + damping if k == m else 1.0)
            for i in range(m):
                total -= lower[k, i] * lower[m, i]
            if k == m:
                if not total > 1e-12 * matrix[k, k]:
                    return False
                lower[k, k] = math.sqrt(total)
            else:
                lower[k, m] = total / lower[m, m]
    for k in range(size):
        total = vector[k]
        for i in range(k):
            total -= lower[k, i] * out[i]
        out[k] = total / lower[k, k]
    for k in range(size - 1, -1, -1):
        total = out[k]
        for i in range(k + 1, size):
            total -= lower[i, k] * out[i]
        out[k] = total / lower[k, k]
    return True


@compiled
def _converge(p, band, profile, least, matrix):  # type: ignore[no-untyped-def]
    """Fit by Levenberg-Marquardt least squares, starting at `p`, in place; return False if it does not converge."""
    vector, lower, step, trial, other = np.empty(6), np.zeros((6, 6)), np.empty(6), np.empty(6), np.empty((6, 6))
    square = _normal_equations(p, band, profile, matrix, vector)
    trial_vector = np.empty(6)
    damping = 1e-3
    for _ in range(MAX_FIT_STEPS):
        if not _solve(matrix, vector, damping, lower, step):
            return False
        for k in range(6):
            trial[k] = p[k] + step[k]
        trial[5] = min(max(trial[5], 0.5 * p[5], least), 2 * p[5])
        if not abs(trial[2]) < 1e3:
            return False
        new = _normal_equations(trial, band, profile, other, trial_vector)
        if new <= square:
            small = abs(trial[5] - p[5]) < 1e-3 * p[5] and abs(trial[2] - p[2]) < 1e-3 * p[5]
            _copy(trial, p)
            _copy(other, matrix)
            _copy(trial_vector, vector)
            square = new
            damping *= 0.1
            if small:
                return True
        else:
            if damping > 1e6:
                return abs(step[5]) < 1e-3 * p[5]
            damping = max(10 * damping, 1e-4)
    return False


@compiled
def _judge(p, band, profile, matrix, cell, noise, noise_known, sums):  # type: ignore[no-untyped-def]
    """Test the residuals, averaged in cells of the band, against noise.

    Chi-square, its degrees of freedom, what a real lens may add to it, the noise taken, and from how many pixels. Two
    cells along the edge, each `cell` pixels across it: departures as smooth as the blur, which single pixels hide.
    """
    xs, ts, values = band
    sums[:] = 0.0
    count, rows, square, d = len(xs), sums.shape[0] // 2, 0.0, np.empty(6)
    for n in range(count):
        x, residual = _residual(p, xs[n], ts[n], values[n], profile, d)
        across = min(max(math.floor(x / cell) + rows // 2, 0), rows - 1)
        k = 2 * across + (1 if ts[n] > 0 else 0)
        sums[k, 0] += 1
        sums[k, 1] += residual
        for m in range(6):
            sums[k, 2 + m] += d[m]
        square += residual * residual
    cells = 0
    within = square
    for k in range(len(sums)):
        if sums[k, 0] > 0:
            cells += 1
            within -= sums[k, 1] ** 2 / sums[k, 0]
    if not noise_known and count > cells:
        noise = min(max(math.sqrt(max(within, 0.0) / (count - cells)), noise / NOISE_EXCESS), noise * NOISE_EXCESS)
    # What of the cells' noise the fit has taken up: trace of the derivatives' cells in the inverse of the whole.
    lower, out, column = np.zeros((6, 6)), np.empty(6), np.empty(6)
    taken = 0.0
    misfit = 0.0
    for k in range(len(sums)):
        members = sums[k, 0]
        if members == 0:
            continue
        for m in range(6):
            column[m] = sums[k, 2 + m]
        if not _solve(matrix, column, 0.0, lower, out):
            return np.inf, 1.0, 0.0, noise, count - cells
        taken += (column * out).sum() / members
        misfit += sums[k, 1] ** 2 / members / noise**2
    allowed = count * (EDGE_ERROR * (p[1] - p[0]) / noise) ** 2
    return misfit, max(cells - taken, 1.0), allowed, noise, count - cells


@compiled
def _fits(misfit, freedom, allowed):  # type: ignore[no-untyped-def]
    """Test whether a noncentral chi-square is explained by chance (Wilson and Hilferty's quantile, with Patnaik's)."""
    d = (freedom + allowed) ** 2 / (freedom + 2 * allowed)
    return misfit <= (freedom + allowed) * (1 - 2 / (9 * d) + WIDENING * math.sqrt(2 / (9 * d))) ** 3


@compiled
def _fit_places(first, last, image, places, profile, length, noise, noise_known, table):  # type: ignore[no-untyped-def]
    """Fill `table` from row `first` to `last`."""
    most = int((length + 2) * (2 * WIDEST_BAND + 2))
    room = np.empty(most), np.empty(most), np.empty(most)
    for place in range(first, last):
        _fit_place(image, places[place], profile, length, noise, noise_known, room, table[place])


@compiled
def _fit_place(image, place, profile, length, noise, noise_known, room, fields):  # type: ignore[no-untyped-def]
    """Fit one step in bands that grow as long as it fits, and fill its `fields`, or leave them where there is none."""
    row, column, angle, sd = place
    sd, unit = max(sd, 0.5), profile.sd
    reaches, least = np.array(REACHES), NARROWEST_SIGMA / unit
    matrix, kept_matrix = np.zeros((6, 6)), np.zeros((6, 6))
    p, kept = np.empty(6), np.empty(6)
    fitted = False
    judged, kept_judged = (0.0, 0.0, 0.0, 0.0, 0), (0.0, 0.0, 0.0, 0.0, 0)
    kept_angle, kept_row, kept_column = angle, row, column
    for number in range(-2, len(reaches)):
        reach = min(max(reaches[max(number, 0)] * sd, LEAST_BAND), WIDEST_BAND)
        if number > 0 and reach < 1.05 * min(max(reaches[number - 1] * sd, LEAST_BAND), WIDEST_BAND):
            break
        band = _gather(image, row, column, angle, length / 2, reach, room)
        count = len(band[0])
        if number == -2 and not _start(p, band, sd, max(sd / unit, least)):
            break
        if number == 0 and count < IN_FRAME * length * 2 * reach:
            break
        if count < 24 or not _converge(p, band, profile, least, matrix):
            break
        sd = unit * p[5]
        if not (p[1] > p[0] and sd < WIDEST_SIGMA and abs(p[3]) < 0.5 and abs(p[2]) < 2 * sd + 2):
            break
        if number == 0 and reach < min(0.9 * reaches[0] * sd, WIDEST_BAND):
            break  # no width goes with its own band
        if number >= 0:
            cell = max(1.0, sd)
            sums = np.zeros((4 * (int(reach / cell) + 3), 8))
            judged = _judge(p, band, profile, matrix, cell, noise, noise_known, sums)
            fits = _fits(judged[0], judged[1], judged[2])
            if fitted and not fits:
                break
            fitted, kept_judged = True, judged
            _copy(p, kept)
            _copy(matrix, kept_matrix)
            kept_angle, kept_row, kept_column = angle, row, column
            if not fits:
                break
        # Straighten the band: x and t along the edge that was found.
        row, column = row + p[2] * math.sin(angle), column + p[2] * math.cos(angle)
        angle -= math.atan(p[3])
        p[2], p[3] = 0.0, 0.0
    if fitted:
        across = (kept_row - place[0]) * math.sin(kept_angle) + (kept_column - place[1]) * math.cos(kept_angle)
        pixel = 0.0 if profile.averaged else 1.0 / 12.0  # of the width's square that is the pixel's
        _fill(fields, kept, kept_matrix, kept_judged, kept_angle, across, pixel)


@compiled
def _start(p, band, sd, width):  # type: ignore[no-untyped-def]
    """Set the initial parameters `p`, with the levels far to each side; return False if a side is missing."""
    xs, _, values = band
    low, lows, high, highs = 0.0, 0, 0.0, 0
    for n in range(len(xs)):
        if xs[n] < -sd:
            low, lows = low + values[n], lows + 1
        elif xs[n] > sd:
            high, highs = high + values[n], highs + 1
    if lows < 4 or highs < 4:
        return False
    p[0], p[1], p[2], p[3], p[4], p[5] = low / lows, high / highs, 0.0, 0.0, 0.0, width
    return True


@compiled
def _fill(fields, p, matrix, judged, angle, across, pixel):  # type: ignore[no-untyped-def]
    """Fill one step's `FIELDS` from its parameters `p`, their information `matrix`, and what `_judge` found."""
    misfit, freedom, allowed, noise, members = judged
    last = np.zeros(6)
    last[5] = 1.0
    lower, out = np.zeros((6, 6)), np.empty(6)
    if not _solve(matrix, last, 0.0, lower, out):
        return
    w, variance = p[5], noise**2 * out[5] * max(1.0, misfit / freedom)
    fields[0], fields[1], fields[2] = p[0], p[1], w * w - pixel
    fields[3] = 2 * w * math.sqrt(variance)
    fields[4] = angle - math.atan(p[3])
    fields[5] = across + p[2]
    fields[6] = p[4]
    fields[7], fields[8], fields[9], fields[10] = misfit, freedom, allowed, members
