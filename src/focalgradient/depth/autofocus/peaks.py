"""The peak of sharpness along a stack of focus settings: the vertex of a parabola in vergence."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.filters import FloatArray

__all__ = ["Peaks", "peaks"]

ROUNDS = 2
"""Number of times the settings to fit are selected again around the peak found."""

POWER = 1 / 2
"""Power of 1/sharpness that is parabolic in vergence."""

POWERS = (1 / 3, 2 / 3)
"""Range of `POWER`: its value for white texture, and for isolated edges."""

CERTAIN = 6.0
"""Minimum prominence of the sharpest setting, in standard deviations of noise."""

WIDER = 2.5
"""Reach of the parabolas whose residuals show the error of the focus settings, relative to the reach of those that give
depth, which have few degrees of freedom."""

POOLED = 4000
"""Maximum number of grid points from which the error of the focus settings is estimated."""

SEEN = 1e-3
"""Minimum effect of an error pattern on the residuals, relative to the most visible pattern, for it to be estimated
(our choice)."""

UNEVEN = 0.035
"""Apparent error of exact settings, in units of the reach, that arises because sharpness is not exactly parabolic:
0.017 to 0.03 on simulated stacks of slants and steps at f/4 and f/2.8."""

LEAST_FREE = 0.05
"""Minimum proportion of a parabola's weighted settings that its three coefficients leave free, averaged over grid
points, for the error of the settings to be estimated; with three settings it is 0."""


@dataclass(frozen=True, slots=True)
class Peaks:
    """Where along n settings each node (h x w) is sharpest."""

    vergence: FloatArray  # h x w, D
    sd: FloatArray  # of it by noise, D
    shape_sd: FloatArray  # of it by what the power may be off, and by the error of the focus settings, D
    focus_sd: float  # error of each setting's focus that the parabolas' residuals show, D; 0 if nothing shows it
    valid: NDArray[np.bool_]  # there is a peak
    clear: NDArray[np.bool_]  # the sharpest setting stands out from noise
    sharpest: NDArray[np.intp]  # the setting that is sharpest
    rise: FloatArray  # n x h x w: change of the vergence with the measure at each setting
    share: FloatArray  # n x h x w: weights with which the measures give the peak's height, in units of itself


def peaks(measure: FloatArray, variance: FloatArray, focus: FloatArray, reach: float) -> Peaks:
    """Return each node's peak of sharpness: the vertex of a weighted parabola through its inverse square root.

    Parameters
    ----------
    measure, variance
        Sharpness less the noise's own, at each setting, n x h x w; and its variance by noise.
    focus
        Focus vergence of the n settings in dioptres, rising; three different ones at least.
    reach
        Dioptres from the peak up to which settings are fitted.

    Examples
    --------
    >>> focus = np.array([0.5, 0.7, 1.0, 1.4])
    >>> measure = 1 / (0.02 + (focus - 0.8) ** 2) ** 2
    >>> peak = peaks(measure[:, None, None], np.ones((4, 1, 1)), focus, reach=0.5)
    >>> peak.vergence.round(6).tolist(), peak.valid.tolist()
    ([[0.8]], [[True]])
    """
    best = measure.argmax(axis=0)
    distinct = np.unique(focus)  # of a setting there may be several views
    place = np.searchsorted(distinct, focus[best])
    least = np.minimum(distinct[np.maximum(place - 1, 0)], focus[best] - reach)
    most = np.maximum(distinct[np.minimum(place + 1, len(distinct) - 1)], focus[best] + reach)
    height = np.maximum(measure, np.sqrt(variance))  # below its own sd it is not known to be less
    top = height.max(axis=0)
    height, relative = height / top, variance / top**2

    def vertex(about: FloatArray, power: float, width: float = 1.0) -> _Parabola:
        """Fit a parabola about `about`, in units of `reach`, to settings up to `width` times the usual reach."""
        offset = (focus[:, None, None] - about) / reach
        # A parabola takes three settings, however far.
        third = np.partition(np.abs(distinct[:, None, None] - about) / reach, 2, axis=0)[2]
        near = np.maximum(1 - (offset / (width * np.maximum(1, 1.25 * third))) ** 2, 0) ** 2
        bent = height**-power
        weight = height**2 / (relative * bent**2)
        weight = near * np.maximum(weight / weight.max(axis=0), 1e-6)  # no farther apart, for three to be solved for
        columns = offset ** np.arange(3)[:, None, None, None]
        weighted = columns * weight
        normal = np.einsum("anij,bnij->ijab", weighted, columns)
        gain = np.linalg.solve(normal + 1e-12 * np.eye(3), np.moveaxis(weighted, (0, 1), (2, 3)))
        level, slope, bend = np.einsum("ijan,nij->aij", gain, bent)
        safe = np.maximum(bend, 1e-9)
        place = -slope / (2 * safe)
        by_bent = -(np.moveaxis(gain[..., 1, :], -1, 0) + 2 * place * np.moveaxis(gain[..., 2, :], -1, 0)) / (2 * safe)
        left = bent - (level + slope * offset + bend * offset**2)
        return _Parabola(place, bend, by_bent, -power * bent / height, left, 2 * safe * (offset - place), near, gain)

    about = focus[best]
    for _ in range(ROUNDS):
        about = np.clip(about + reach * vertex(about, POWER).place, least, most)
    found = vertex(about, POWER)
    rise = found.by_bent * found.by_height
    noise = (rise**2 * relative).sum(axis=0)
    low, high = (vertex(about, power).place for power in POWERS)
    clear = top**2 > CERTAIN**2 * variance.max(axis=0)
    valid = (found.bend > 0) & clear
    focus_variance = vertex(about, POWER, WIDER).focus_variance((focus[:, None, None] - about) / reach, noise, valid)
    by_focus = focus_variance * ((found.by_bent * found.by_focus) ** 2).sum(axis=0)
    return Peaks(
        about + reach * found.place,
        reach * np.sqrt(noise),
        # The powers as of an even spread between the two.
        reach * np.sqrt((high - low) ** 2 / 12 + by_focus),
        reach * math.sqrt(focus_variance),
        valid,
        clear,
        best,
        reach * rise / top,
        height / ((height**2).sum(axis=0) * top),
    )


@dataclass(frozen=True, slots=True)
class _Parabola:
    """A parabola fitted through n settings at each node (h x w), against where it was sought, in units of its reach."""

    place: FloatArray  # h x w: of the vertex
    bend: FloatArray  # h x w: curvature
    by_bent: FloatArray  # n x h x w: change of the vertex with the fitted values
    by_height: FloatArray  # n x h x w: change of the fitted values with the heights
    left: FloatArray  # n x h x w: residuals of the fitted values
    by_focus: FloatArray  # n x h x w: change of the fitted values with each setting's focus
    near: FloatArray  # n x h x w: weight by the distance of the settings
    gain: FloatArray  # h x w x 3 x n: change of the coefficients with the fitted values

    def focus_variance(self, offset: FloatArray, noise: FloatArray, valid: NDArray[np.bool_]) -> float:
        """Estimate the variance of the focus settings from the residuals; 0 if the residuals are explained by noise.

        An error of one setting's focus displaces its sharpness at all nodes alike, as far as each parabola does not
        follow it: least squares over the `valid` nodes (h x w) that have less `noise` than most. Errors in proportion
        to the focus, or alike for all, move all peaks with them and are not seen.
        """
        if not valid.any():
            return 0.0
        some = np.flatnonzero(valid & (noise <= np.median(noise[valid])))
        some = some[:: max(1, len(some) // POOLED)]
        n = len(offset)
        at, left, by_focus, near = (
            one.reshape(n, -1)[:, some].T for one in (offset, self.left, self.by_focus, self.near)
        )
        gain = self.gain.reshape(-1, 3, n)[some]
        kept = np.eye(n) - at[:, :, None] ** np.arange(3) @ gain
        if np.einsum("ki,kii->", near, kept) < LEAST_FREE * near.sum():
            return 0.0
        moved = kept * by_focus[:, None, :]  # k x n x n: residuals by each setting's focus
        weighted = moved * (near / self.bend.ravel()[some, None] ** 2)[:, :, None]  # all nodes in one unit
        normal = np.einsum("kij,kil->jl", weighted, moved)
        error = np.linalg.pinv(normal, SEEN, hermitian=True) @ np.einsum("kij,ki->j", weighted, left)
        return float(max(0.0, error @ error / (n - 2) - UNEVEN**2))
