"""The peak of sharpness along a stack of focus settings: the vertex of a parabola in vergence."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.filters import FloatArray

__all__ = ["Peaks", "peaks"]

ROUNDS = 2
"""Times that the settings to be fitted are chosen anew about the peak found."""

POWER = 1 / 2
"""Power of 1/sharpness that is a parabola in vergence."""

POWERS = (1 / 3, 2 / 3)
"""The same over white texture and over lone edges: between these the power may be anything."""

CERTAIN = 6.0
"""Standard deviations of noise by which the sharpest setting must stand out."""


@dataclass(frozen=True, slots=True)
class Peaks:
    """Where along n settings each node (h x w) is sharpest."""

    vergence: FloatArray  # h x w, D
    sd: FloatArray  # of it by noise, D
    shape_sd: FloatArray  # of it by what the power may be off, D
    valid: NDArray[np.bool_]  # there is a peak
    clear: NDArray[np.bool_]  # the sharpest setting stands out from noise
    sharpest: NDArray[np.intp]  # the setting that is sharpest
    rise: FloatArray  # n x h x w: change of the vergence with the measure at each setting
    share: FloatArray  # n x h x w: weights with which the measures give the peak's height, in units of itself


def peaks(measure: FloatArray, variance: FloatArray, focus: FloatArray, reach: float) -> Peaks:
    """Where each node's sharpness peaks: the vertex of a weighted parabola through its inverse square root.

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

    def vertex(about: FloatArray, power: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Vertex against `about` in units of `reach`, curvature there, and the vertex's rise with the heights."""
        offset = (focus[:, None, None] - about) / reach
        # A parabola takes three settings, however far.
        third = np.partition(np.abs(distinct[:, None, None] - about) / reach, 2, axis=0)[2]
        near = np.maximum(1 - (offset / np.maximum(1, 1.25 * third)) ** 2, 0) ** 2
        bent = height**-power
        weight = height**2 / (relative * bent**2)
        weight = near * np.maximum(weight / weight.max(axis=0), 1e-6)  # no farther apart, for three to be solved for
        columns = offset ** np.arange(3)[:, None, None, None]
        weighted = columns * weight
        normal = np.einsum("anij,bnij->ijab", weighted, columns)
        gain = np.linalg.solve(normal + 1e-12 * np.eye(3), np.moveaxis(weighted, (0, 1), (2, 3)))
        _, slope, bend = np.einsum("ijan,nij->aij", gain, bent)
        safe = np.maximum(bend, 1e-9)
        place = -slope / (2 * safe)
        by_bent = -(np.moveaxis(gain[..., 1, :], -1, 0) + 2 * place * np.moveaxis(gain[..., 2, :], -1, 0)) / (2 * safe)
        return place, bend, by_bent * -power * bent / height

    about = focus[best]
    for _ in range(ROUNDS):
        about = np.clip(about + reach * vertex(about, POWER)[0], least, most)
    place, bend, rise = vertex(about, POWER)
    low, high = (vertex(about, power)[0] for power in POWERS)
    clear = top**2 > CERTAIN**2 * variance.max(axis=0)
    return Peaks(
        about + reach * place,
        reach * np.sqrt((rise**2 * relative).sum(axis=0)),
        reach * np.abs(high - low) / math.sqrt(12),  # as of an even spread between them
        (bend > 0) & clear,
        clear,
        best,
        reach * rise / top,
        height / ((height**2).sum(axis=0) * top),
    )
