"""Estimation of the blur of the border between two regions, which is the blur of the occluding side.

Let L and R be the light of the near and the far side, and a the coverage of the near side (a step blurred with SD s);
the light is a L + (1 - a) R. For independent textures, the mean square of its derivative across the border at distance
x is

    E(x) = c g(x; s)^2 + a(x)^2 E_L + (1 - a(x))^2 E_R ,

where g is a Gaussian, E_L and E_R are the mean squares far from the border, and c is that of L - R. The width of the
rise of E thus gives s independently of the blur of the textures.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.special import ndtr

from focalgradient.arrays import FloatArray
from focalgradient.observers.retinal_blur import MISFIT, SAMPLING_BLUR

__all__ = ["border_blur", "share_border"]

Region = NDArray[np.bool_]

REACH = 24
"""Width of the profile on either side of the border in pixels; the sides' own energy is taken over as many more."""

FIELD = 1.0
"""Standard deviation of the Gaussian derivative filter, in pixels."""

BLURS = np.geomspace(0.05, 12.0, 48)
"""Candidate blurs of the border, in pixels."""

JUMPS, JUMP_SD = np.geomspace(1 / 16, 16, 17), 1.0
"""Ratio of the mean-square step across the border to that expected of independent textures, and SD of its logarithm."""


def share_border(one: Region, other: Region) -> bool:
    """Return whether two regions share a border of 16 pixels or more.

    >>> left = np.arange(64) < 32 + np.zeros((64, 1))
    >>> share_border(left, ~left), share_border(left, np.roll(left, 20, 1) & ~left & ~np.roll(left, 8, 1))
    (True, False)
    """
    return int((_away(one) <= 1.5)[other].sum()) >= 16


def _away(region: Region) -> FloatArray:
    return np.asarray(distance_transform_edt(~region), float)


def border_blur(seen: FloatArray, one: Region, other: Region, own: float) -> tuple[float, float]:
    """Estimate the logarithm of the blur of the border, and its standard deviation.

    Parameters
    ----------
    seen
        Retinal contrast, H x W.
    one, other
        Regions on the two sides.
    own
        Blur (px) of the eye itself, which is subtracted.

    Returns
    -------
    tuple of float
        Log SD in pixels, with `SAMPLING_BLUR` added in quadrature as for other places, and its standard deviation.
    """
    across = np.where(one, 0.5 - _away(other), _away(one) - 0.5)  # distance from the border in px, negative in `one`
    smooth = gaussian_filter(across, 2.0)
    down, right = np.gradient(smooth)
    norm = np.maximum(np.hypot(down, right), 1e-9)
    light = [gaussian_filter(seen, FIELD, order=order) for order in ((1, 0), (0, 1))]
    energy = ((light[0] * down + light[1] * right) / norm) ** 2
    inside = one | other
    place = np.where(inside, np.floor(across).astype(int), 10**6)

    def mean(low: int, high: int, values: FloatArray) -> float:
        chosen = values[(place >= low) & (place < high)]
        return float(chosen.mean()) if chosen.size else 0.0

    x = np.arange(-REACH, REACH)
    count = np.array([np.count_nonzero(place == at) for at in x])
    x, count = x[count > 0], count[count > 0]
    profile = np.array([energy[place == at].mean() for at in x])
    own_one, own_other = mean(-2 * REACH, -REACH, energy), mean(REACH, 2 * REACH, energy)
    jump = float(seen[one].var() + seen[other].var() + (seen[one].mean() - seen[other].mean()) ** 2)
    sd = np.hypot(BLURS, own)[:, None]
    wide = np.hypot(sd, FIELD)
    middle = x + 0.5
    step = np.exp(-((middle / wide) ** 2)) / (2 * np.pi * wide**2)
    share = ndtr(-middle / sd)
    sides = share**2 * own_one + (1 - share) ** 2 * own_other
    expected = JUMPS[:, None, None] * jump * step + sides
    # derivatives are uncorrelated at a distance of three pixels along or across the border
    variance = 2 * 3 / count + MISFIT**2
    cost = (np.log(np.maximum(profile, 1e-30) / np.maximum(expected, 1e-30)) ** 2 / variance).sum(-1) / 3
    cost += (np.log(JUMPS) / JUMP_SD)[:, None] ** 2
    posterior = np.exp(-(cost - cost.min()) / 2).sum(0)
    posterior /= posterior.sum()
    log = np.log(np.hypot(BLURS, SAMPLING_BLUR))
    mean_log = float(posterior @ log)
    return mean_log, float(np.sqrt(posterior @ (log - mean_log) ** 2 + MISFIT**2))
