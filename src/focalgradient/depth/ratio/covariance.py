"""Joint covariance of both views' energies in all bands: it turns several ratios into one depth.

In a window of a few blur widths the texture is a sample, and the ratio of two energies no longer that of their
expectations. But the sample is the same one in both views and in all bands, so that the sharper view's energies
account for most of what the blurred view's have by chance. All energies together are therefore compared with all that
a defocus makes one expect, by their joint covariance, which has four parts:

- chance: energies are sums of squares of a random field, whose covariance is the summed square of the field's;
- the texture: its spectrum is a power law of any slope and strength, with bumps that are smooth in log frequency;
- noise, which is not subtracted but expected, of uncertain strength;
- and a share of each energy, for all that is not as the model has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.ratio.table import DisparityTable, band_transfer, frequencies, texture, transfers

__all__ = ["CHANNELS", "STEPS", "EnergyCovariance", "energy_covariance"]

FloatArray = NDArray[np.float64]
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


@dataclass(frozen=True, slots=True, eq=False)
class EnergyCovariance:
    """Tables for `focalgradient.depth.ratio.likelihood`, at S strengths of noise and L levels of defocus.

    Parameters
    ----------
    expected
        S x L x 8: logarithm of the energy expected, noise included, over that of the coarsest band of the sharper
        view without; channels are view 1 and view 2 in the finest band, in the next, and so on.
    weights
        S x L x 8 x 8: inverse covariance of those logarithms, blind to the texture's contrast.
    log_determinant
        S x L: logarithm of the determinant of the covariance, but for the contrast.
    sd
        S x L: standard deviation of the defocus, in dioptres; infinite where nothing is known.
    noise
        8: energy of noise of variance 1.
    """

    expected: Tables
    weights: Tables
    log_determinant: Tables
    sd: Tables
    noise: Tables


@lru_cache(maxsize=8)
def energy_covariance(table: DisparityTable, window: float) -> EnergyCovariance:
    """Return the covariance of energies averaged in a Gaussian of sd `window` pixels; cached for the next frame.

    >>> from focalgradient import Lens
    >>> lenses = [Lens(focal_length=0.025, f_number=n, focus_distance=0.85) for n in (16, 5.6)]
    >>> covariance = energy_covariance(DisparityTable.of(lenses, pixel_angle=3.1e-4), 8.0)
    >>> covariance.weights.shape
    (26, 65, 8, 8)
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
    return EnergyCovariance(
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
