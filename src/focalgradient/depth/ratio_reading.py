"""Depth from the energies of several bands, compiled: each square of the grid on its own.

A band's ratio of energies gives a defocus by the table, but not every band can: the finest ones lose to blur what they
would measure and hold noise instead, and the coarsest hardly change near focus. So each band proposes a defocus, all
bands judge it by how likely it makes what they saw, and those that agree with the best are averaged, each weighed by
what a band is worth at that defocus.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.depth.kernels import share_rows
from focalgradient.depth.ratio_kernels import CLEAR, Plane, noise_at

SPECTRUM_SD = 0.2
"""Error of the slope of the texture's spectrum, as far as a window tells it, that is counted as an error of depth."""

DOUBTED = 0.5
"""Share of the correction for that slope that is counted as an error: smooth texture is no steeper power law."""

NOISE_SD = 0.3
"""Error of the noise's energy, as a share of it: what the finest detail of blurred places is told from."""

AGREE = 9.0
"""Squared distance from the others, over its variance, up to which a band adds to what they tell together."""

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})


def read(
    energy: Plane,
    brightness: Plane,
    noise: Plane,
    span: float,
    defocus: NDArray[np.float64],
    curves: NDArray[np.float64],
    scales: NDArray[np.float64],
    least: float,
) -> tuple[Plane, Plane, Plane]:
    """Size of the defocus, and its standard deviation, that fit the bands' energies, all bands weighed together.

    Parameters
    ----------
    energy, brightness
        b x 2 x h x w and 2 x h x w, gathered in the window.
    noise, span
        Variance of a pixel's noise at a brightness of 0 .. `span` in equal steps, 2 x levels.
    defocus
        L levels, rising from 0, in any unit.
    curves
        b x 8 x L: logarithm of the focal disparity (falling); its own variance, and what noise adds to it for the
        first and the second view; its change with the slope of the texture's spectrum; the logarithm of the first
        view's energy, and its change with that slope; the disparity squared.
    scales
        b x 4: last level of each band that tells; noise energy for noise of variance 1; variance of the logarithm of
        the disparity for curves of 1; that for noise alone.
    least
        Least high-frequency content of the first view, as a share of its brightness.

    Returns
    -------
    defocus, sd, misfit
        h x w each. Where no band tells, sd is infinite. `misfit` is the sum of the bands' squared distances from what
        they tell together, or that of the worst outside what any defocus can explain, in units of their variance.
    """
    shape = energy.shape[2:]
    value, sd, misfit = np.empty((3, *shape), np.float32)
    step = np.float32((noise.shape[1] - 1) / span)

    def work(first: int, last: int) -> None:
        _read_rows(energy, brightness, noise, step, defocus, curves, scales, least**2, first, last, value, sd, misfit)

    share_rows(shape[0], work)
    return value, sd, misfit


@_compiled
def _read_rows(  # type: ignore[no-untyped-def]
    energy, brightness, noise, step, defocus, curves, scales, least, first, last, value, sd, misfit
):
    bands, _, _, width = energy.shape
    own, other = np.empty(width, np.float32), np.empty(width, np.float32)
    sharp, ratio, tilt = np.empty(bands), np.empty(bands), np.empty(bands)
    fall = -defocus
    for row in range(first, last):
        noise_at(noise[0], step, brightness[0, row], own)
        noise_at(noise[1], step, brightness[1, row], other)
        for x in range(width):
            value[row, x], sd[row, x], misfit[row, x] = 0, np.inf, 0
            light = brightness[0, row, x]
            if not (light > 0 and brightness[1, row, x] > 0):
                continue
            gain = (light / brightness[1, row, x]) ** 2
            for band in range(bands):
                unit = scales[band, 1]
                sharp[band] = energy[band, 0, row, x] - unit * own[x]
                if sharp[band] > CLEAR * unit * own[x] and sharp[band] > least * light * light:
                    ratio[band] = gain * (energy[band, 1, row, x] - unit * other[x]) / sharp[band]
                else:
                    sharp[band] = 0.0
            # First for the usual texture, then for the spectrum that the sharper view shows here.
            at = 0.0
            for again in range(2):
                # Each band proposes a defocus, and all judge it: a band whose ratio is noise, or lies where blur has
                # taken all it can, proposes nonsense that the others see through.
                least_unlike, best = np.inf, -1.0
                for band in range(bands):
                    tilt[band] = _tilt(curves, sharp, band, at) if again else 0.0
                for band in range(bands):
                    if sharp[band] > 0:
                        place = _propose(curves[band], scales[band], ratio[band], tilt[band])
                        unlike = 0.0
                        for judge in range(bands):
                            if sharp[judge] > 0:
                                unlike += _unlike(
                                    curves[judge], scales[judge], ratio[judge], tilt[judge],
                                    own[x] / sharp[judge], gain * other[x] / sharp[judge], place,
                                )  # fmt: skip
                        if unlike < least_unlike:
                            least_unlike, best = unlike, place
                if best < 0:
                    break
                total = weights = 0.0
                for band in range(bands):
                    if sharp[band] == 0:
                        continue
                    curve, scale = curves[band], scales[band]
                    n1, n2 = own[x] / sharp[band], gain * other[x] / sharp[band]
                    if _unlike(curve, scale, ratio[band], tilt[band], n1, n2, best) > AGREE:
                        continue
                    # What a band is worth is judged where all agree, lest its own accidents decide it.
                    told = _between(curve[0], best)
                    doubt = np.sqrt(_expected(curve, scale, tilt[band], n1, n2, best)[1])
                    end = int(scale[0])
                    below = _locate(curve[0], end, told - doubt)
                    if below >= end:
                        continue  # as blurred as this band can tell, or more
                    above = _locate(curve[0], end, told + doubt)
                    here = _between(defocus, best)
                    less, more = here - _between(defocus, above), _between(defocus, below) - here
                    error = max(less, more) if above == 0.0 else 0.5 * (less + more)
                    told = _propose(curve, scale, ratio[band], tilt[band])
                    total += _between(defocus, told) / (error * error)
                    weights += 1.0 / (error * error)
                if weights == 0:
                    sd[row, x] = np.inf
                    break
                at = _locate(fall, fall.size - 1, -total / weights)
                value[row, x], sd[row, x], misfit[row, x] = total / weights, np.sqrt(1.0 / weights), least_unlike


@_compiled
def _propose(curve, scale, ratio, tilt):  # type: ignore[no-untyped-def]
    """Level at which one band's curve, for texture steeper by `tilt`, has the `ratio` of energies."""
    end = int(scale[0])
    told = 0.5 * np.log(max(ratio, 1e-3 * curve[7, end]))
    place = _locate(curve[0], end, told)
    return _locate(curve[0], end, told - tilt * _between(curve[4], place)) if tilt != 0 else place


@_compiled
def _expected(curve, scale, tilt, n1, n2, place):  # type: ignore[no-untyped-def]
    """One band's ratio of energies at a level, and the variance of its logarithm's half (of the disparity's).

    `n1` and `n2` are the variances of both views' noise, over the sharper view's signal.
    """
    low = min(int(place), curve.shape[1] - 2)
    high = place - low
    own, first, second, by_slope, ratio = (
        curve[1, low] + high * (curve[1, low + 1] - curve[1, low]),
        curve[2, low] + high * (curve[2, low + 1] - curve[2, low]),
        curve[3, low] + high * (curve[3, low + 1] - curve[3, low]),
        curve[4, low] + high * (curve[4, low + 1] - curve[4, low]),
        curve[7, low] + high * (curve[7, low + 1] - curve[7, low]),
    )
    n1, n2 = scale[1] * n1, scale[1] * n2 / ratio
    noise = n1 * n1 + n2 * n2
    variance = scale[2] * (own + first * n1 + second * n2 + scale[3] * noise)
    variance += (SPECTRUM_SD**2 + (DOUBTED * tilt) ** 2) * by_slope * by_slope + 0.25 * NOISE_SD**2 * noise
    return ratio * np.exp(2 * tilt * by_slope) if tilt != 0 else ratio, variance


@_compiled
def _unlike(curve, scale, ratio, tilt, n1, n2, place):  # type: ignore[no-untyped-def]
    """Squared distance of one band's ratio of energies from that at a level, in units of its variance, 25 at most."""
    expected, variance = _expected(curve, scale, tilt, n1, n2, place)
    apart = 0.5 * (ratio / expected - 1)
    return min(apart * apart / variance, 25.0)


@_compiled
def _tilt(curves, sharp, band, at):  # type: ignore[no-untyped-def]
    """By how much the texture's amplitude spectrum is steeper here than the table's, about this band."""
    low = band if band + 1 < sharp.size else band - 1
    if low < 0 or sharp[low] == 0.0 or sharp[low + 1] == 0.0:
        return 0.0
    fine, coarse = curves[low], curves[low + 1]
    seen = np.log(sharp[low] / sharp[low + 1]) - (_between(fine[5], at) - _between(coarse[5], at))
    return min(max(seen / (_between(fine[6], at) - _between(coarse[6], at)), -1.5), 1.5)


@_compiled
def _locate(curve, end, value):  # type: ignore[no-untyped-def]
    """Fractional index, 0 .. `end`, at which the falling `curve` has the `value`."""
    if value >= curve[0]:
        return 0.0
    if value <= curve[end]:
        return float(end)
    low, high = 0, end
    while high - low > 1:
        middle = (low + high) // 2
        if curve[middle] > value:
            low = middle
        else:
            high = middle
    return low + (curve[low] - value) / (curve[low] - curve[high])


@_compiled
def _between(curve, place):  # type: ignore[no-untyped-def]
    """The `curve` at a fractional index."""
    i = min(int(place), curve.size - 2)
    return curve[i] + (place - i) * (curve[i + 1] - curve[i])
