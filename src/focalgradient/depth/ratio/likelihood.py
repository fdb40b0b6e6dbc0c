"""Depth from the energies of several bands, each square of the grid on its own.

The logarithms of all energies, of both views in all bands, are compared with those expected at each level of defocus,
by their joint covariance: the likeliest level is the estimate. In a window of a few blur widths the texture is a
sample, and the ratio of two energies no longer that of their expectations. But the sample is the same one in both views
and in all bands, so that the sharper view's energies account for most of what the blurred view's have by chance. The
joint covariance has four parts:

- chance: energies are sums of squares of a random field, whose covariance is the summed square of the field's;
- the texture: its spectrum is a power law of any slope and strength, with bumps that are smooth in log frequency;
- noise, which is not subtracted but expected, of uncertain strength;
- and a share of each energy, for all that is not as the model has it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.depth.filters import Image
from focalgradient.depth.ratio.energies import CLEAR_OF_NOISE, noise_at
from focalgradient.depth.ratio.table import DisparityTable, band_transfer, frequencies, texture, transfers
from focalgradient.parallel import share_rows

__all__ = ["CHANNELS", "STEPS", "energy_covariance"]

Tables = NDArray[np.float32]

CHANNELS = 8
"""Number of compared energies: two views in four bands. Omitted bands have weight 0."""

SLOPE_SD = 1.0
"""Standard deviation of the slope of the texture's amplitude spectrum, which is 1 on average. Chosen by hand."""

BUMPS_SD = 1.0
"""Standard deviation of the logarithm of the texture's power about a power law. Chosen by hand."""

BUMPS_WIDTH = 0.7
"""Correlation length of the deviations of `BUMPS_SD` in log frequency: one octave."""

NOISE_ERROR = 0.3
"""Relative error of the noise variance. Chosen by hand."""

ENERGY_ERROR = 0.05
"""Relative error of each energy that the model does not explain. Chosen by hand."""

STEPS = np.geomspace(2.0**-24, 2.0, 26)
"""Variances of noise, in units of the sharper view's energy in the coarsest band, for which tables are computed."""

COVARIANCE_REACH = 48
"""Maximum distance in pixels at which the covariance of the filtered field is computed. Chosen by hand."""


@lru_cache(maxsize=8)
def energy_covariance(table: DisparityTable, window: float) -> tuple[Tables, ...]:
    """Return the covariance of energies averaged in a Gaussian of sd `window` pixels; cached for the next frame.

    Returns
    -------
    expected, weights, log_determinant, sd, noise
        At S strengths of noise and L levels of defocus: the logarithm of the energy expected, noise included, over that
        of the coarsest band of the sharper view without (S x L x 8: channels are view 1 and view 2 in the finest band,
        in the next, and so on); the inverse covariance of those logarithms, blind to the texture's contrast (S x L x 8
        x 8); the logarithm of the determinant of the covariance, but for the contrast (S x L); the standard deviation
        of the defocus, in dioptres, infinite where nothing is known (S x L); and the energy of noise of variance 1 (8).

    Examples
    --------
    >>> from focalgradient import Lens
    >>> lenses = [Lens(focal_length=0.025, f_number=n, focus_distance=0.85) for n in (16, 5.6)]
    >>> [one.shape for one in energy_covariance(DisparityTable.of(lenses, pixel_angle=3.1e-4), 8.0)]
    [(26, 65, 8), (26, 65, 8, 8), (26, 65), (26, 65), (8,)]
    """
    count = 2 * len(table.bands)
    chance, mixed, noise_alone, bumps, mean, unit = _moments(table, window)
    # Measured ratios that mend the table scale what the second view shows.
    gain = np.ones_like(mean)
    gain[:, 1::2] = np.exp(2 * table.curves.T) * mean[:, ::2] / mean[:, 1::2]
    mean = gain * mean
    outer = gain[:, :, None] * gain[:, None, :]
    # For texture whose coarsest energy is 1 in the sharper view.
    scale = mean[:, [count - 2]]
    mean, square = mean / scale, scale[:, :, None] ** 2
    chance, bumps, mixed = outer * chance / square, outer * bumps / square, np.sqrt(outer) * mixed / np.sqrt(square)

    strength = STEPS[:, None, None, None]
    same_view = np.arange(count)[:, None] % 2 == np.arange(count) % 2
    covariance = chance + bumps + 2 * strength * mixed
    covariance = covariance + strength**2 * (noise_alone + NOISE_ERROR**2 * same_view * np.outer(unit, unit))
    total = mean + STEPS[:, None, None] * unit
    covariance = covariance / (total[..., :, None] * total[..., None, :]) + ENERGY_ERROR**2 * np.eye(count)
    inverse = np.linalg.inv(covariance)
    # Contrast moves the logarithms by this, and is not known.
    moved = mean / total
    projected = np.einsum("slij,slj->sli", inverse, moved)
    total_weight = np.einsum("sli,sli->sl", projected, moved)
    weights = inverse - projected[..., :, None] * projected[..., None, :] / total_weight[..., None, None]
    log_determinant = np.log(total_weight) - np.linalg.slogdet(inverse)[1]
    expected = np.log(total)
    padding = CHANNELS - count
    return (
        np.pad(expected, ((0, 0), (0, 0), (0, padding))).astype(np.float32),
        np.pad(weights, ((0, 0), (0, 0), (0, padding), (0, padding))).astype(np.float32),
        log_determinant.astype(np.float32),
        _sd(expected, weights, table.defocus).astype(np.float32),
        np.pad(unit, (0, padding)).astype(np.float32),
    )


def _moments(table: DisparityTable, window: float) -> tuple[FloatArray, ...]:
    """Return the covariance of energies, for texture of the table's contrast, and means.

    Returns
    -------
    chance, mixed, noise_alone, bumps, mean, unit
        Covariance by the texture's chance (L x c x c), its part that goes as the variance of noise (L x c x c) and that
        which goes as its square (c x c), and by the spectrum's bumps and slope (L x c x c); energies (L x c), and
        those of noise of variance 1 (c). Channels c are view 1 and view 2 in the finest band, in the next, and so on.
    """
    down, right, weight = frequencies()
    field = texture()
    blurs = transfers(table.pixels, table.defocus, table.psf)
    filters = [band_transfer(band, down, right) for band in table.bands]
    count, levels = 2 * len(filters), len(blurs)
    chance, mixed = np.zeros((2, levels, count, count))
    noise_alone = np.zeros((count, count))
    for one, fine in enumerate(table.bands):
        for other in range(one, len(table.bands)):
            # Squares of the two bands lie so far apart; a half step, where the bands differ.
            apart = fine * (np.arange(COVARIANCE_REACH // fine) + (0.0 if one == other else 0.5))
            share = np.where(apart == 0, 1, 2) * np.exp(-(apart**2) / (4 * window**2))
            share *= fine / np.sqrt(4 * np.pi * window**2)
            waves = np.cos(2 * np.pi * apart[:, None] * right)
            both = filters[one] * filters[other]
            noise = waves @ (weight * both) @ waves.T
            for first in range(2):
                for second in range(2):
                    together = waves @ (field * both * blurs[:, first] * blurs[:, second]) @ waves.T
                    i, j = 2 * one + first, 2 * other + second
                    chance[:, i, j] = chance[:, j, i] = 2 * (together**2 @ share) @ share
                    if first == second:
                        mixed[:, i, j] = mixed[:, j, i] = 2 * (together * noise @ share) @ share
                        noise_alone[i, j] = noise_alone[j, i] = 2 * share @ noise**2 @ share
    frequency = np.hypot(down, right)
    edges = np.geomspace(0.003, 0.5, 21)
    part = np.digitize(frequency, edges).ravel()
    middle = np.log(np.concatenate([edges[:1], np.sqrt(edges[1:] * edges[:-1]), edges[-1:]]))
    spectrum = 4 * SLOPE_SD**2 * np.outer(middle, middle)
    spectrum += BUMPS_SD**2 * np.exp(-0.5 * ((middle[:, None] - middle) / BUMPS_WIDTH) ** 2)
    by_part = np.stack(
        [
            np.bincount(part, (field * one**2 * blur[view] ** 2).ravel(), middle.size)
            for blur in blurs
            for one in filters
            for view in range(2)
        ]
    ).reshape(levels, count, middle.size)
    unit = np.repeat([(weight * one**2).sum() for one in filters], 2)
    return chance, mixed, noise_alone, by_part @ spectrum @ by_part.swapaxes(1, 2), by_part.sum(axis=-1), unit


def _sd(expected: FloatArray, weights: FloatArray, defocus: FloatArray) -> FloatArray:
    """Return the change of defocus that raises the misfit by 1: mean of both directions, or the one that is finite."""
    steps, levels = expected.shape[:2]
    sd = np.empty((steps, levels))
    for step in range(steps):
        for level in range(levels):
            apart = expected[step] - expected[step, level]
            distance = np.sqrt(np.maximum(np.einsum("li,ij,lj->l", apart, weights[step, level], apart), 0))
            ways = []
            for way in (slice(level, None), slice(level, None, -1)):
                rising = np.maximum.accumulate(distance[way])
                if rising[-1] >= 1:
                    ways.append(abs(np.interp(1.0, rising, defocus[way]) - defocus[level]))
                elif way.step is None:
                    ways.append(np.inf)
            sd[step, level] = np.mean(ways)
    return sd


STRIDE = 8
"""Initial step in levels of the search, a power of 2, halved around the likeliest level; limits the time. Chosen by
hand."""

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})


def likeliest_defocus(
    energy: Image,
    brightness: Image,
    noise: Image,
    span: float,
    defocus: FloatArray,
    covariance: tuple[Tables, ...],
    least: float,
) -> tuple[Image, Image, Image]:
    """Estimate the magnitude of defocus, and its standard deviation, from the energies of all bands.

    Parameters
    ----------
    energy, brightness
        b x 2 x h x w and 2 x h x w, gathered in the window.
    noise, span
        Variance of a pixel's noise at a brightness of 0 .. `span` in equal steps, 2 x levels.
    defocus
        L levels, rising from 0, in any unit.
    covariance
        What each level makes one expect: see `energy_covariance`.
    least
        Least high-frequency content of the first view, as a share of its brightness.

    Returns
    -------
    defocus, sd, misfit
        h x w each. Where no band has detail, sd is infinite. `misfit` follows chi-square with 2 b - 2 degrees of
        freedom for texture through this optics at some defocus.
    """
    shape = energy.shape[2:]
    value, sd, misfit = np.empty((3, *shape), np.float32)
    step = np.float32((noise.shape[1] - 1) / span)
    log_steps = np.float32(np.log(STEPS[0])), np.float32(1 / np.log(STEPS[1] / STEPS[0]))
    levels = defocus.astype(np.float32)

    expected, weights, log_det, sds, unit = covariance
    given = energy, brightness, noise, step, levels, expected, weights, log_det, sds, unit, log_steps
    share_rows(shape[0], lambda first, last: _read_rows(*given, np.float32(least**2), first, last, value, sd, misfit))
    return value, sd, misfit


@_compiled
def _read_rows(  # type: ignore[no-untyped-def]
    energy, brightness, noise, step, defocus, expected, weights, log_det, sds, unit, log_steps, least, first, last,
    value, sd, misfit,
):  # fmt: skip
    bands, _, _, width = energy.shape
    steps, levels = log_det.shape
    own, other = np.empty(width, np.float32), np.empty(width, np.float32)
    seen, apart, costs = np.zeros(CHANNELS, np.float32), np.empty(CHANNELS, np.float32), np.empty(levels, np.float32)
    tiny = np.float32(1e-30)
    for row in range(first, last):
        noise_at(noise[0], step, brightness[0, row], own)
        noise_at(noise[1], step, brightness[1, row], other)
        for x in range(width):
            value[row, x], sd[row, x], misfit[row, x] = 0, np.inf, 0
            light, light2 = brightness[0, row, x], brightness[1, row, x]
            if not (light > 0 and light2 > 0):
                continue
            gain = (light / light2) * (light / light2)
            # The tables have one strength of noise for both views: what they differ by is added or taken off.
            usual = np.float32(0.5) * (own[x] + gain * other[x])
            clear = False
            for band in range(bands):
                one, two = energy[band, 0, row, x], gain * energy[band, 1, row, x]
                sharp = one - unit[2 * band] * own[x]
                clear |= sharp > CLEAR_OF_NOISE * unit[2 * band] * own[x] and sharp > least * light * light
                floor = np.float32(0.1) * unit[2 * band] * usual + tiny
                seen[2 * band] = max(one + unit[2 * band] * (usual - own[x]), floor)
                seen[2 * band + 1] = max(two + unit[2 * band] * (usual - gain * other[x]), floor)
            if not clear:
                continue
            coarse = seen[2 * bands - 2]
            texture = max(coarse - unit[2 * bands - 2] * usual, np.float32(1e-2) * coarse)
            place = (np.log(usual / texture + tiny) - log_steps[0]) * log_steps[1]
            place = min(max(place, np.float32(0)), np.float32(steps - 1) - np.float32(1e-3))
            at = int(place)
            share = place - np.float32(at)
            for channel in range(2 * bands):
                seen[channel] = np.log(seen[channel] / texture)

            best, stride = 0, STRIDE
            for level in range(0, levels, STRIDE):
                costs[level] = _misfit(seen, apart, expected, weights, at, share, level) + log_det[at, level]
                if costs[level] < costs[best]:
                    best = level
            while stride > 1:
                stride //= 2
                middle = best
                for level in (middle - stride, middle + stride):
                    if 0 <= level < levels:
                        costs[level] = _misfit(seen, apart, expected, weights, at, share, level) + log_det[at, level]
                        if costs[level] < costs[best]:
                            best = level
            found, cost = defocus[best], costs[best]
            if 0 < best < levels - 1:
                # The least of the parabola through three unevenly spaced levels.
                less, more = costs[best - 1] - cost, costs[best + 1] - cost
                back, on = defocus[best] - defocus[best - 1], defocus[best + 1] - defocus[best]
                curvature = less * on + more * back
                if 0 < curvature < np.inf:
                    found += np.float32(0.5) * (less * on * on - more * back * back) / curvature
            value[row, x], sd[row, x], misfit[row, x] = found, sds[at, best], cost - log_det[at, best]


@_compiled
def _misfit(seen, apart, expected, weights, at, share, level):  # type: ignore[no-untyped-def]
    """Return the squared distance of the logarithms `seen` from those expected at a level, by the covariance there."""
    near, far, weight = expected[at, level], expected[at + 1, level], weights[at, level]
    for i in range(CHANNELS):
        apart[i] = seen[i] - near[i] - share * (far[i] - near[i])
    total = np.float32(0)
    for i in range(CHANNELS):
        for j in range(CHANNELS):
            total += weight[i, j] * (apart[i] * apart[j])
    return total
