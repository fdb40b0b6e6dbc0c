"""Depth from the energies of several bands, compiled: each square of the grid on its own.

The logarithms of all energies, of both views in all bands, are compared with those expected at each level of defocus,
by their joint covariance (`focalgradient.depth.ratio.covariance`): the likeliest level is the estimate.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.depth.ratio.covariance import CHANNELS, STEPS, EnergyCovariance
from focalgradient.depth.ratio.energies import CLEAR_OF_NOISE, Plane, noise_at
from focalgradient.parallel import share_rows

STRIDE = 8
"""Initial step in levels of the search, a power of 2, halved around the likeliest level; limits the time. Chosen by
hand."""

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})


def likeliest_defocus(
    energy: Plane,
    brightness: Plane,
    noise: Plane,
    span: float,
    defocus: NDArray[np.float64],
    covariance: EnergyCovariance,
    least: float,
) -> tuple[Plane, Plane, Plane]:
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
        What each level makes one expect.
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

    def work(first: int, last: int) -> None:
        _read_rows(
            energy, brightness, noise, step, levels, covariance.expected, covariance.weights,
            covariance.log_determinant, covariance.sd, covariance.noise, log_steps, np.float32(least**2), first, last,
            value, sd, misfit,
        )  # fmt: skip

    share_rows(shape[0], work)
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
