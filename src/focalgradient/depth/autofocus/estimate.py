"""Autofocus: depth from a stack of focus settings, each point at the setting that shows it sharpest.

This is what the paper's methods save: autofocus stores and searches thirty images or more where they take one or two.
It needs no model of blur, only that blur is even about focus; it serves to compare with.

Sharpness is the energy of the Laplacian of a Gaussian, gathered in the window, with the noise's own energy taken off.
Over texture whose amplitude falls as 1/frequency it goes as (s^2 + sigma^2)^-2, where s is the measure's own width and
sigma, the blur's, is proportional to the defocus: **its inverse square root is a parabola in vergence**, near focus and
far from it, for any aperture. The vertex of a parabola through the settings about the sharpest is the depth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.depth import numerics
from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.equalise.likelihood import GROWTH, NODES, STEEP
from focalgradient.depth.filters import fine_noise
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import LEVEL_STEP, Search
from focalgradient.depth.settings import RecoverySettings
from focalgradient.errors import InputError
from focalgradient.view import View

__all__ = ["Peaks", "peaks", "recover"]

FloatArray = NDArray[np.float64]

WIDTH = 1.0
"""Standard deviation in pixels of the Gaussian whose Laplacian measures sharpness."""

REACH = 2.0
"""Pixels of blur radius from the peak up to which settings are fitted, ever less; three always are."""

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
    found: NDArray[np.bool_]  # there is a peak
    rise: FloatArray  # n x h x w: change of the vergence with the measure at each setting
    share: FloatArray  # n x h x w: weights with which the measures give the peak's height, in units of itself


def peaks(measure: FloatArray, variance: FloatArray, focus: FloatArray, reach: float) -> Peaks:
    """Where each node's sharpness peaks: the vertex of a weighted parabola through its inverse square root.

    Parameters
    ----------
    measure, variance
        Sharpness less the noise's own, at each setting, n x h x w; and its variance by noise.
    focus
        Focus vergence of the n settings in dioptres, rising.
    reach
        Dioptres from the peak up to which settings are fitted.

    Examples
    --------
    >>> focus = np.array([0.5, 0.7, 1.0, 1.4])
    >>> measure = 1 / (0.02 + (focus - 0.8) ** 2) ** 2
    >>> peak = peaks(measure[:, None, None], np.ones((4, 1, 1)), focus, reach=0.5)
    >>> peak.vergence.round(6).tolist(), peak.found.tolist()
    ([[0.8]], [[True]])
    """
    best = measure.argmax(axis=0)
    least = np.minimum(focus[np.maximum(best - 1, 0)], focus[best] - reach)
    most = np.maximum(focus[np.minimum(best + 1, len(focus) - 1)], focus[best] + reach)
    height = np.maximum(measure, np.sqrt(variance))  # what is below its own sd is not known to be less than that
    top = height.max(axis=0)
    height, relative = height / top, variance / top**2

    def vertex(about: FloatArray, power: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Vertex against `about` in units of `reach`, curvature there, and the vertex's rise with the heights."""
        offset = (focus[:, None, None] - about) / reach
        third = np.partition(np.abs(offset), 2, axis=0)[2]  # a parabola takes three settings, however far
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
    return Peaks(
        about + reach * place,
        reach * np.sqrt((rise**2 * relative).sum(axis=0)),
        reach * np.abs(high - low) / math.sqrt(12),  # as of an even spread between them
        (bend > 0) & (top**2 > CERTAIN**2 * variance.max(axis=0)),
        reach * rise / top,
        height / ((height**2).sum(axis=0) * top),
    )


def recover(views: Sequence[View], asked: RecoverySettings) -> DepthMap:
    """Depth of `views` as `focalgradient.recover_depth` returns it, for checked views and settings."""
    _check(views)
    search = Search.over(views, asked.near, asked.far)
    order = np.argsort(search.focus, kind="stable")
    focus = search.focus[order]
    lowest, highest = max(search.lowest, focus[0]), min(search.highest, focus[-1])
    if lowest >= highest:
        raise InputError(
            f"the stack is focused from {_metres(focus[-1])} to {_metres(focus[0])} m, but the search is limited to "
            "distances outside that: change near or far, or focus on what is searched."
        )
    asked.say("placing the views")
    placed = RegisteredViews.of(views, asked.align)
    asked.say("measuring noise")
    noise = _noise(views, asked, placed)
    asked.say("measuring sharpness")
    step = max(1, round(asked.window / NODES))
    usable, sharpness = _sharpness([placed.images[i] for i in order], placed.usable, step)
    power, alike = _noise_passed()
    own = power * noise[order, None, None] ** 2  # of sharpness, by noise alone
    sharpness -= own * usable

    asked.say("reading depth")
    window = asked.window / step
    count = numerics.gather(usable.astype(np.float32)[None], window)[0].astype(float)
    mean = numerics.gather(sharpness.astype(np.float32), window) / np.maximum(count, 1e-6)
    # Sharpness is a mean of squares of signal and noise: its variance, over one pixel that is alone.
    single = alike * (4 * np.maximum(mean, 0) * own + 2 * own**2)
    pixels = np.maximum(2 * count, 1)  # a Gaussian window of sum 2 pi w^2 is worth 4 pi w^2 pixels
    peak = peaks(mean, single / pixels, focus, REACH / search.slope)

    # From here on in levels, as fine as other methods search.
    unit = LEVEL_STEP / search.slope
    level = (np.clip(peak.vergence, lowest, highest) - lowest) / unit
    weight = np.maximum((peak.share * sharpness).sum(axis=0), 0)
    said = (peak.rise * sharpness).sum(axis=0) / unit + weight * level
    doubt = np.sqrt((peak.rise**2 * single).sum(axis=0)) / unit
    windows = [window * growth for growth in GROWTH]
    fine, fine_sd = numerics.grow_planes(weight, said, level, doubt, windows, STEEP)
    sd = np.sqrt(fine_sd**2 + (peak.shape_sd / unit) ** 2 + _across_jumps(fine, window))
    apart = sd + STEEP  # as far as blocks of one surface differ
    depth = lowest + unit * numerics.spread(fine, apart, step, placed.shape)
    depth_sd = unit * numerics.spread(sd, apart, step, placed.shape)
    told = peak.found & (peak.vergence > lowest) & (peak.vergence < highest) & (count > 0.1 * count.max())
    told = told.repeat(step, axis=0).repeat(step, axis=1)[: placed.shape[0], : placed.shape[1]]
    # Texture enough, as for other methods: blur known to 0.3 pixel or to a tenth, in the most blurred view.
    clear = depth_sd * search.slope <= np.maximum(0.3, 0.1 * search.radius(depth))
    valid = placed.usable & told & clear
    details = {
        **asked.stated(),
        "searched_vergence_D": [lowest, highest],
        "side": "told by the views",
        "noise": (noise * placed.gains).tolist(),
        "noise_estimated": asked.noise is None,
        "gain": placed.gains,
        "shift_px": [[p.down, p.right] for p in placed.found],
        "scale": [p.scale for p in placed.found],
        "share_valid": float(valid.mean()),
    }
    return DepthMap(
        depth.clip(lowest, highest).astype(np.float32),
        depth_sd.astype(np.float32),
        valid,
        np.ones(placed.shape, np.bool_),
        details,
    )


def _check(views: Sequence[View]) -> None:
    """Refuse views that are no stack of focus settings."""
    apertures = np.array([view.optics.aperture_diameter for view in views])
    focus = np.unique([view.optics.focus_vergence for view in views])
    if len(focus) < 3:
        raise InputError(
            f"the {len(views)} views hold {len(focus)} different focus setting{'s' * (len(focus) > 1)}, but method "
            "'autofocus' needs three or more: refocus between views, or use another method."
        )
    if np.ptp(apertures) > 0.01 * apertures.max():
        raise InputError(
            "the views differ in aperture, but method 'autofocus' compares sharpness at one aperture: take all views "
            "through the same, or use method 'equalise'."
        )


def _noise(views: Sequence[View], asked: RecoverySettings, placed: RegisteredViews) -> FloatArray:
    """Standard deviation of each placed view's noise: as given, or what the least sharp view holds of finest detail."""
    gains = np.array(placed.gains)
    if asked.noise is not None:
        return np.broadcast_to(np.asarray(asked.noise, float), len(views)) / gains
    images = [np.asarray(view.image, np.float32) for view in views]
    # Storage and rounding leave at least something.
    return max(min(map(fine_noise, images)), 2e-4 * float(images[0].std())) / gains


def _sharpness(
    images: Sequence[NDArray[np.float32]], usable: NDArray[np.bool_], step: int
) -> tuple[FloatArray, FloatArray]:
    """Usable pixels in each block of `step` pixels, h x w, and each image's squared Laplacian summed over them."""
    reach = math.ceil(4 * WIDTH)
    inside = ndimage.minimum_filter(usable, 2 * reach + 1).astype(np.float32)
    blocks = [numerics.block_sum(ndimage.gaussian_laplace(image, WIDTH) ** 2 * inside, step) for image in images]
    return numerics.block_sum(inside, step), np.stack(blocks)


def _noise_passed() -> tuple[float, float]:
    """What the measure makes of white noise of variance 1: its power, and the pixels over which it stays alike."""
    impulse = np.zeros((65, 65))
    impulse[32, 32] = 1
    power = np.abs(np.fft.fft2(ndimage.gaussian_laplace(impulse, WIDTH))) ** 2
    return float(power.mean()), float((power**2).mean() / power.mean() ** 2)


def _across_jumps(level: FloatArray, window: float) -> FloatArray:
    """Variance of `level` (h x w) about its plane in the window: beside an outline the sharper side speaks for both."""
    mean, square = (ndimage.gaussian_filter(values, window, mode="nearest") for values in (level, level**2))
    down, right = np.gradient(mean)
    return np.maximum(square - mean**2 - window**2 * (down**2 + right**2), 0)


def _metres(vergence: float) -> str:
    return "infinity" if vergence <= 0 else f"{1 / vergence:.3g}"
