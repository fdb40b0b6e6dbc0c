"""Noise-whitened filters that cancel the scene at every candidate depth, compiled.

Blur that is not round needs filters over the plane of frequencies, some million values at a time. They are worked out
frequency by frequency, without the intermediate arrays that array expressions would need.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.depth.filters import FloatArray
from focalgradient.parallel import share_rows

__all__ = ["noise_passed", "whitened_filters"]

TINY = 1e-6
"""Transfer relative to the largest one below which a frequency is considered lost in all views."""


def whitened_filters(
    transfers: NDArray[Any],
    own: NDArray[Any],
    view_weight: FloatArray,
    weight: FloatArray,
    power: Any = None,
    start: int = 0,
) -> list[NDArray[Any]]:
    """Return orthonormal filters onto the complement of the views' transfers, one set for each view after the first.

    The covariance of the noise is 1 + the sum of u u^H over `own`.

    With three and more views the complement has several dimensions, in which filters could turn with depth without
    any change of the residual, and noise with them. So the filters of each candidate are those of the one beside it,
    turned no more than the complement turns.

    Parameters
    ----------
    transfers
        n x L x F: transfer of view i at candidate l and frequency f, over the standard deviation of its noise; complex
        where blur is not round.
    own
        m x n x L x F: each further source's amplitude in each view.
    view_weight
        n x L x F: weight of each view, by which filters are multiplied.
    weight
        L x F: weight of each frequency, the same for all views.
    power
        F: power of the scene. Where given, a frequency whose signal has q times the power of the noise has the weight
        sqrt(q / (1 + q)) besides.
    start
        The candidate from which filters are carried to the others: best one where the first view is sharp, and the
        sharpest, as its transfer then keeps its sign.

    Returns
    -------
    list of ndarray
        n - 1 arrays n x L x F. At `start` the j-th compares view j + 1 with the best estimate from the views before
        it, so that for two views in white noise it is (H2, -H1) / sqrt(H1^2 + H2^2), there and at every candidate.

    Examples
    --------
    >>> transfers, white = np.array([[[0.8]], [[0.6]]]), np.zeros((0, 2, 1, 1))
    >>> whitened_filters(transfers, white, np.ones((2, 1, 1)), np.ones((1, 1)))[0].ravel().round(3).tolist()
    [0.6, -0.8]
    """
    views, _, count = transfers.shape
    filters = np.empty((views - 1, *transfers.shape), transfers.dtype)
    tiny = TINY * float(np.abs(transfers).max())
    known = np.full(count, np.inf) if power is None else power

    def some(first: int, last: int) -> None:
        _whitened_filters(transfers, own, view_weight, weight, known, tiny, start, first, last, filters)

    share_rows(count, some)
    return list(filters)


@njit(nogil=True, cache=True, error_model="numpy")
def _whitened_filters(  # type: ignore[no-untyped-def]
    transfers, own, view_weight, weight, power, tiny, start, first, last, filters
):
    views, levels, _ = transfers.shape
    # Of this frequency: the views' transfers, their direction (conjugate, as filters meet spectra without one), and
    # the filters orthogonal to it.
    column, along, row = np.empty((3, views), transfers.dtype)
    across = np.empty((views - 1, views), transfers.dtype)
    for f in range(first, last):
        for way in (1, -1):
            level = start
            while 0 <= level < levels:
                for i in range(views):
                    column[i] = transfers[i, level, f]
                _whiten(column, own, level, f, False)
                signal = 0.0
                for i in range(views):
                    signal += column[i].real ** 2 + column[i].imag ** 2
                # Two views leave one direction, which cannot turn.
                if views == 2 or level == start:
                    _complement(column, tiny, across, along)
                elif signal > tiny**2:
                    _carry(across, along, column, math.sqrt(signal))
                share = weight[level, f]
                if power[f] < np.inf:
                    share *= math.sqrt(power[f] * signal / (1 + power[f] * signal))
                for j in range(views - 1):
                    for i in range(views):
                        row[i] = across[j, i]
                    _whiten(row, own, level, f, True)
                    for i in range(views):
                        filters[j, i, level, f] = row[i] * view_weight[i, level, f] * share
                level += way


@njit(nogil=True, cache=True, error_model="numpy")
def _complement(column, tiny, across, along):  # type: ignore[no-untyped-def]
    """Return orthonormal rows orthogonal to `column`: each compares a view with the best estimate from those before it.

    `along` becomes how views are joined to the best estimate: first to that from those before, then from all.
    """
    views = len(column)
    # The estimate's transfer is `reached`. Its sign follows the first view's, for the filters to change smoothly.
    for i in range(views):
        along[i] = 1 if i == 0 else 0
    reached = column[0]
    for j in range(1, views):
        square = reached.real**2 + reached.imag**2 + column[j].real ** 2 + column[j].imag ** 2
        if square <= tiny**2:  # what is blind to both is either of them
            for i in range(views):
                across[j - 1, i] = 1 if i == j else 0
            continue
        norm = math.sqrt(square)
        over = 1 / norm
        for i in range(views):
            across[j - 1, i] = along[i] * column[j] * over if i < j else 0
        across[j - 1, j] = -reached * over
        for i in range(j + 1):
            along[i] = np.conj(column[i]) * over
        reached = reached * 0 + norm


@njit(nogil=True, cache=True, error_model="numpy")
def _carry(across, along, column, norm):  # type: ignore[no-untyped-def]
    """Rotate the rows of `across` by the smallest rotation that takes `along` to the direction of `column`."""
    views = len(column)
    met = column[0] * 0
    for i in range(views):
        met += np.conj(along[i]) * np.conj(column[i]) / norm
    size = math.sqrt(met.real**2 + met.imag**2)
    phase = np.conj(met) / size if size > 0 else met * 0 + 1  # the direction's own has no meaning
    for i in range(views):
        column[i] = np.conj(column[i]) / norm * phase
    for j in range(views - 1):
        share = column[0] * 0
        for i in range(views):
            share += np.conj(column[i]) * across[j, i]
        share /= 1 + size
        for i in range(views):
            across[j, i] -= (along[i] + column[i]) * share
    for i in range(views):
        along[i] = column[i]


@njit(nogil=True, cache=True, error_model="numpy")
def _whiten(row, own, level, f, conjugate):  # type: ignore[no-untyped-def]
    """Multiply by the inverse square root of 1 + the sum of u u^H, or by its conjugate."""
    for source in range(len(own)):
        size = 1e-30
        met = row[0] * 0
        for i in range(len(row)):
            u = own[source, i, level, f]
            size += u.real**2 + u.imag**2
            met += (u if conjugate else np.conj(u)) * row[i]
        met *= (1 / math.sqrt(1 + size) - 1) / size
        for i in range(len(row)):
            u = own[source, i, level, f]
            row[i] += (np.conj(u) if conjugate else u) * met


def noise_passed(
    filters: NDArray[Any], own: NDArray[Any], measure: FloatArray, variance: FloatArray | None = None
) -> tuple[NDArray[Any], FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return gains of `filters` (n x L x F) for noise of a `variance` (n; 1 in every view) and for the sources `own`.

    Returns
    -------
    gains
        (n + m) x L x F: power gain of each source.
    noise
        L: the variance left.
    noise_slope
        L: what it adds to the variance of the score, per level^2.
    change
        L: what the noise's own change by level would add to the residual's variance.
    derivative
        L: the variance of the residual's derivative by level.
    """
    views, levels, count = filters.shape
    gains = np.empty((views + len(own), levels, count), filters.real.dtype)
    sums = np.zeros((4, levels))
    white = np.asarray(np.ones(views) if variance is None else variance, filters.real.dtype)
    share_rows(levels, lambda first, last: _noise_passed(filters, own, measure, white, first, last, gains, sums))
    return gains, *sums


@njit(nogil=True, cache=True, error_model="numpy")
def _noise_passed(filters, own, measure, white, first, last, gains, sums):  # type: ignore[no-untyped-def]
    views, levels, count = filters.shape
    for level in range(first, last):
        before, after = max(level - 1, 0), min(level + 1, levels - 1)
        over = 1 / max(after - before, 1)
        for f in range(count):
            gain = slope = change = 0.0
            for i in range(views):
                value = filters[i, level, f]
                risen = (filters[i, after, f] - filters[i, before, f]) * over
                gains[i, level, f] = white[i] * (value.real**2 + value.imag**2)
                gain += gains[i, level, f]
                slope += white[i] * (risen.real**2 + risen.imag**2)
            for source in range(len(own)):
                value = risen = altered = filters[0, level, f] * 0
                for i in range(views):
                    u = own[source, i, level, f]
                    value += u * filters[i, level, f]
                    risen += u * ((filters[i, after, f] - filters[i, before, f]) * over)
                    altered += (own[source, i, after, f] - own[source, i, before, f]) * over * filters[i, level, f]
                gains[views + source, level, f] = value.real**2 + value.imag**2
                gain += gains[views + source, level, f]
                slope += risen.real**2 + risen.imag**2
                change += value.real * altered.real + value.imag * altered.imag
            sums[0, level] += gain * measure[f]
            sums[1, level] += gain * slope * measure[f]
            sums[2, level] += 2 * change * measure[f]
            sums[3, level] += slope * measure[f]
