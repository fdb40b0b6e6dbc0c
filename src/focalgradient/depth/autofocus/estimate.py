"""Autofocus: depth from a stack of focus settings, each point at the setting that shows it sharpest.

This is what the paper's methods save: autofocus stores and searches thirty images or more where they take one or two.
It needs no model of blur, only that blur is even about focus; it serves to compare with.

Sharpness is the energy of the Laplacian of a Gaussian, gathered in the window, with the noise's own energy taken off.
Over texture whose amplitude falls as 1/frequency it goes as (s^2 + sigma^2)^-2, where s is the measure's own width and
sigma, that of a Gaussian blur, is proportional to the defocus: **its inverse square root is a parabola in vergence**,
near focus and far from it, for any aperture. For blur of other shapes and other textures it is another power, estimated
from the residuals of the parabolas (as by Box and Cox, 1964) where more than three settings are near a peak. The vertex
of a parabola through the settings about the sharpest is the depth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.noise import noise_from_spectrum, storage
from focalgradient.depth.numerics import block_sum, gather, interpolate_nodes, repeat_blocks, step_of
from focalgradient.depth.planes import SMOOTH, STEEP, grow_planes
from focalgradient.depth.registration import filled
from focalgradient.depth.search import LEVEL_STEP, Estimate, Problem
from focalgradient.depth.validity import MIN_SUPPORT, OUTSIDE, blur_is_known
from focalgradient.errors import InputError
from focalgradient.view import View

__all__ = ["Peaks", "check", "estimate", "peaks"]

WIDTH = 1.0
"""Standard deviation in pixels of the Gaussian whose Laplacian measures sharpness."""

REACH = 2.0
"""Blur radius in pixels, relative to the peak, up to which settings are fitted, with decreasing weight; at least three
settings are."""


def check(views: Sequence[View]) -> None:
    """Raise `InputError` unless the views are a stack of focus settings."""
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


def estimate(problem: Problem) -> Estimate:
    """Estimate depth from the best focus, for `focalgradient.recover_depth`."""
    search, registered, settings = problem.search, problem.registered, problem.settings
    order = np.argsort(search.focus, kind="stable")
    focus = search.focus[order]
    lowest, highest = max(search.lowest, focus[0]), min(search.highest, focus[-1])
    if lowest >= highest:
        raise InputError(
            f"the stack is focused from {_metres(focus[-1])} to {_metres(focus[0])} m, but the search is limited to "
            "distances outside that: change near or far, or focus within the search."
        )
    settings.progress(0.3, "estimating noise")
    noise = _noise(problem)
    settings.progress(0.4, "measuring sharpness")
    step = step_of(settings.window)
    usable, sharpness, change = _sharpness([registered.images[i] for i in order], registered.usable, step)
    power, alike = _noise_passed()
    own = power * noise[order, None, None] ** 2  # of sharpness, by noise alone
    sharpness -= own * usable

    settings.progress(0.7, "estimating depth")
    window = settings.window / step
    count = gather(usable.astype(np.float32)[None], window)[0].astype(float)
    mean = gather(sharpness.astype(np.float32), window) / np.maximum(count, 1e-6)
    # Sharpness is a mean of squares of signal and noise: its variance, over one independent pixel.
    single = alike * (4 * np.maximum(mean, 0) * own + 2 * own**2)
    pixels = np.maximum(2 * count, 1)  # a Gaussian window of sum 2 pi w^2 has 4 pi w^2 effective pixels
    peak = peaks(mean, single / pixels, focus, REACH / search.slope)
    change = gather(change.astype(np.float32), window) / np.maximum(count, 1e-6)
    unresolved = np.diff(focus)[:, None, None] * (change < UNCHANGED * own.min())

    # From here on in levels, as fine as other methods search.
    unit = LEVEL_STEP / search.slope
    level = (np.clip(peak.vergence, lowest, highest) - lowest) / unit
    weight = np.maximum((peak.share * sharpness).sum(axis=0), 0)
    weighted = (peak.rise * sharpness).sum(axis=0) / unit + weight * level
    noise_sd = np.sqrt((peak.rise**2 * single).sum(axis=0)) / unit
    windows = [window * growth for growth in SMOOTH.windows]
    fine, fine_sd = grow_planes(weight, weighted, level, noise_sd, windows, STEEP, SMOOTH.separate)
    shape_variance = peak.shape_sd**2 + _about(peak.sharpest, unresolved) ** 2
    sd = np.sqrt(fine_sd**2 + shape_variance / unit**2 + _across_jumps(fine, window))
    apart = sd + STEEP  # as far as blocks of one surface differ
    shape = registered.shape
    depth = lowest + unit * interpolate_nodes(fine, apart, step, shape)
    depth_sd = unit * interpolate_nodes(sd, apart, step, shape)
    enough = count > MIN_SUPPORT * count.max()
    inside = (peak.vergence > lowest) & (peak.vergence < highest)
    seen = peak.valid & inside & enough
    # The sharpest setting of all is an end, and no peak lies within.
    at_end = peak.clear & enough & ~seen
    beyond = (at_end & (focus[peak.sharpest] >= highest)).astype(np.int8)
    beyond -= at_end & (focus[peak.sharpest] <= lowest)
    # Where it borders on what lies beyond, the peak of a window that reaches over both is neither's.
    narrow = np.ones((max(1, round(window)),) * 2, np.bool_)
    wide = ndimage.binary_opening(np.pad(seen, len(narrow), mode="edge"), narrow)
    valid = repeat_blocks(seen & wide[len(narrow) : -len(narrow), len(narrow) : -len(narrow)], step, shape)
    # Blur as stated or, where less, as shown: if only the order of the foci is known, none is.
    shown = min(1.0, REACH * peak.narrowness / search.slope)
    known = blur_is_known(depth_sd * search.slope * shown, search.radius(depth) * shown)
    limits = repeat_blocks(beyond, step, shape) * registered.usable
    return Estimate(
        np.where(limits == 0, depth, np.where(limits > 0, highest, lowest)).clip(lowest, highest).astype(np.float32),
        depth_sd.astype(np.float32),
        registered.usable & valid & known & (limits == 0),
        noise=(noise * registered.gains).tolist(),
        details={"focus_sd_D": peak.focus_sd, **_stated_limits(limits, order + 1)},
        searched=(lowest, highest),
        beyond=limits,
    )


def _stated_limits(limits: NDArray[np.int8], views: NDArray[np.intp]) -> dict[str, Any]:
    """Return the shares of the frame at or beyond each end of the stack, and the reason to state if they are large.

    `views` are the views' numbers, from the farthest focus to the nearest.
    """
    farther, nearer = float(np.mean(limits < 0)), float(np.mean(limits > 0))
    stated: dict[str, Any] = {"share_at_or_beyond": {"farthest": farther, "nearest": nearer}}
    if farther + nearer > OUTSIDE:
        stated["share_outside_range"] = farther + nearer
        stated["rejected"] = (
            f"{farther:.0%} of the frame lies at or beyond the farthest focus (view {views[0]}) and {nearer:.0%} "
            f"at or nearer than the nearest (view {views[-1]}), where the stack has no peak of sharpness: add "
            "views focused beyond these"
        )
    return stated


def _noise(problem: Problem) -> FloatArray:
    """Return each registered view's noise sd: given, or estimated from the finest detail of the least sharp view."""
    gains = np.array(problem.registered.gains)
    given = problem.settings.given_noise(len(problem.views))
    if given is not None:
        return given / gains
    images = [filled(view.image, view.mask) for view in problem.views]
    return max(min(map(noise_from_spectrum, images)), storage(images[0])) / gains


def _sharpness(
    images: Sequence[NDArray[np.float32]], usable: Mask, step: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Count each block's usable pixels (h x w); sum over them each image's squared Laplacian, and its squared change.

    The change is that from each of n images to the next: (n - 1) x h x w.
    """
    reach = math.ceil(4 * WIDTH)
    inside = ndimage.minimum_filter(usable, 2 * reach + 1).astype(np.float32)
    squares, changes = [], []
    before = None
    for image in images:
        detail = ndimage.gaussian_laplace(image, WIDTH)
        squares.append(block_sum(detail**2 * inside, step))
        if before is not None:
            changes.append(block_sum((detail - before) ** 2 * inside, step))
        before = detail
    return block_sum(inside, step), np.stack(squares), np.stack(changes)


def _about(sharpest: NDArray[np.intp], gaps: FloatArray) -> FloatArray:
    """Return half the sum of the two of n - 1 `gaps` (n - 1 x h x w) beside the `sharpest` of n settings (h x w)."""
    padded = np.pad(gaps, ((1, 1), (0, 0), (0, 0)))
    before, after = (np.take_along_axis(padded, sharpest[None] + side, axis=0)[0] for side in (0, 1))
    return (before + after) / 2


def _noise_passed() -> tuple[float, float]:
    """Return the sharpness measure of white noise of variance 1, and its correlation area in pixels."""
    impulse = np.zeros((65, 65))
    impulse[32, 32] = 1
    power = np.abs(np.fft.fft2(ndimage.gaussian_laplace(impulse, WIDTH))) ** 2
    return float(power.mean()), float((power**2).mean() / power.mean() ** 2)


def _across_jumps(level: FloatArray, window: float) -> FloatArray:
    """Return the variance of `level` (h x w) about its local plane: at an outline the sharper side decides for both."""
    mean, square = (ndimage.gaussian_filter(values, window, mode="nearest") for values in (level, level**2))
    down, right = np.gradient(mean)
    return np.maximum(square - mean**2 - window**2 * (down**2 + right**2), 0)


def _metres(vergence: float) -> str:
    return "infinity" if vergence <= 0 else f"{1 / vergence:.3g}"


ROUNDS = 2
"""Number of times the settings to fit are selected again around the peak found."""

UNCHANGED = 0.25
"""Maximum squared change of detail from one view to the next, relative to one view's noise, at which both are the same
picture: twice the noise is expected. Rounding then removed what their focus changes, and depth lies between the two."""

POWER = (0.45, 0.14)
"""Prior mean and standard deviation of the power of 1/sharpness that is parabolic in vergence: for Gaussian blur it is
1/3 with white texture, 1/2 with natural texture and 2/3 with isolated edges; for discs some .6 of that."""

POWERS = np.arange(0.15, 0.76, 0.05)
"""Powers that are compared."""

WIDE_POWER = 0.5
"""The power as far from the peak as `WIDER`, where that of discs is the same (simulated stacks at f/2.8 and f/4)."""

REGIONS = 10
"""Number of independent regions that the nodes of a frame count as in the estimate of the power: textures differ, and
errors of a setting's focus are common to all nodes (our choice)."""

KNOWN = 0.01
"""Relative error of sharpness by noise above which a setting says less about the power."""

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
    narrowness: float  # 1 / (distance from the peak at which the root of sharpness is halved), 1/D; 0 without a peak
    valid: Mask  # there is a peak
    clear: Mask  # the sharpest setting stands out from noise
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
    >>> focus = np.array([0.5, 0.6, 0.7, 0.8, 1.0, 1.4])
    >>> measure = 1 / (0.02 + (focus - 0.75) ** 2) ** 2
    >>> peak = peaks(measure[:, None, None], np.ones((6, 1, 1)), focus, reach=0.5)
    >>> peak.vergence.round(3).tolist(), peak.valid.tolist()
    ([[0.75]], [[True]])
    """
    best = measure.argmax(axis=0)
    distinct = np.unique(focus)  # of a setting there may be several views
    place = np.searchsorted(distinct, focus[best])
    least = np.minimum(distinct[np.maximum(place - 1, 0)], focus[best] - reach)
    most = np.maximum(distinct[np.minimum(place + 1, len(distinct) - 1)], focus[best] + reach)
    height = np.maximum(measure, np.sqrt(variance))  # below its own sd it is not known to be less
    top = height.max(axis=0)
    height, relative = height / top, variance / top**2
    clear = top**2 > CERTAIN**2 * variance.max(axis=0)

    def vertex(about: FloatArray, power: float, width: float = 1.0) -> _Parabola:
        return _parabola((focus[:, None, None] - about) / reach, height, relative, power, width)

    about, power = focus[best], POWER[0]
    for _ in range(ROUNDS):
        about = np.clip(about + reach * vertex(about, power).place, least, most)
        power, power_sd = _power((focus[:, None, None] - about) / reach, height, relative, clear)
    found = vertex(about, power)
    rise = found.by_bent * found.by_height
    noise = (rise**2 * relative).sum(axis=0)
    low, high = (vertex(about, power + way * power_sd).place for way in (-1, 1))
    valid = (found.bend > 0) & clear
    focus_variance = vertex(about, WIDE_POWER, WIDER).focus_variance(noise, valid)
    by_focus = focus_variance * ((found.by_bent * found.by_focus) ** 2).sum(axis=0)
    return Peaks(
        about + reach * found.place,
        reach * np.sqrt(noise),
        reach * np.sqrt((high - low) ** 2 / 4 + by_focus),
        reach * math.sqrt(focus_variance),
        math.sqrt(np.median((found.bend / np.maximum(found.level, 1e-9))[valid])) / reach if valid.any() else 0.0,
        valid,
        clear,
        best,
        reach * rise / top,
        height / ((height**2).sum(axis=0) * top),
    )


@dataclass(frozen=True, slots=True)
class _Parabola:
    """A parabola fitted through n settings at each node (h x w), against where it was sought, in units of its reach."""

    offset: FloatArray  # n x h x w: of the settings
    place: FloatArray  # h x w: of the vertex
    level: FloatArray  # h x w: at the vertex
    bend: FloatArray  # h x w: curvature
    by_bent: FloatArray  # n x h x w: change of the vertex with the fitted values
    by_height: FloatArray  # n x h x w: change of the fitted values with the heights
    left: FloatArray  # n x h x w: residuals of the fitted values
    by_focus: FloatArray  # n x h x w: change of the fitted values with each setting's focus
    near: FloatArray  # n x h x w: weight by the distance of the settings
    gain: FloatArray  # h x w x 3 x n: change of the coefficients with the fitted values

    def kept(self, some: NDArray[np.intp]) -> FloatArray:
        """Return the change of the residuals with the fitted values at some nodes (k x n x n)."""
        n = len(self.offset)
        columns = self.offset.reshape(n, -1)[:, some].T[:, :, None] ** np.arange(3)
        return np.eye(n) - columns @ self.gain.reshape(-1, 3, n)[some]

    def focus_variance(self, noise: FloatArray, valid: Mask) -> float:
        """Estimate the variance of the focus settings from the residuals; 0 if the residuals are explained by noise.

        An error of one setting's focus displaces its sharpness at all nodes alike, as far as each parabola does not
        follow it: least squares over the `valid` nodes (h x w) that have less `noise` than most. Errors in proportion
        to the focus, or alike for all, move all peaks with them and are not seen.
        """
        if not valid.any():
            return 0.0
        some = _pooled(valid & (noise <= np.median(noise[valid])))
        n = len(self.offset)
        left, by_focus, near = (values.reshape(n, -1)[:, some].T for values in (self.left, self.by_focus, self.near))
        kept = self.kept(some)
        if np.einsum("ki,kii->", near, kept) < LEAST_FREE * near.sum():
            return 0.0
        moved = kept * by_focus[:, None, :]  # k x n x n: residuals by each setting's focus
        weighted = moved * (near / self.bend.ravel()[some, None] ** 2)[:, :, None]  # all nodes in one unit
        normal = np.einsum("kij,kil->jl", weighted, moved)
        error = np.linalg.pinv(normal, SEEN, hermitian=True) @ np.einsum("kij,ki->j", weighted, left)
        return float(max(0.0, error @ error / (n - 2) - UNEVEN**2))


def _pooled(nodes: Mask) -> NDArray[np.intp]:
    """Return the places of `POOLED` of the marked nodes at most, evenly chosen."""
    places = np.flatnonzero(nodes)
    return places[:: max(1, len(places) // POOLED)]


def _parabola(
    offset: FloatArray, height: FloatArray, relative: FloatArray, power: float, width: float = 1.0
) -> _Parabola:
    """Fit a parabola to the power of 1/height of settings (n x h x w) up to `width` times the usual reach away."""
    # A parabola takes three settings, however far.
    near = np.maximum(1 - (offset / (width * np.maximum(1, 1.25 * _reach_of(offset, 3)))) ** 2, 0) ** 2
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
    by_focus = 2 * safe * (offset - place)
    top = level - bend * place**2
    return _Parabola(offset, place, top, bend, by_bent, -power * bent / height, left, by_focus, near, gain)


def _reach_of(offset: FloatArray, number: int) -> FloatArray:
    """Return how far the given number of different settings reaches from each node (h x w); inf with fewer."""
    distinct = np.unique(offset[:, 0, 0], return_index=True)[1]
    if len(distinct) < number:
        return np.full(offset.shape[1:], np.inf)
    return np.partition(np.abs(offset[distinct]), number - 1, axis=0)[number - 1]


def _power(offset: FloatArray, height: FloatArray, relative: FloatArray, clear: Mask) -> tuple[float, float]:
    """Estimate the power of 1/height that is parabolic, with its standard deviation.

    `POWER` is the prior; the likelihood is that of the residuals of log height at nodes with more than three settings
    within reach.
    """
    some = _pooled(clear & (_reach_of(offset, 4) < 1))
    offset, height, relative = (values.reshape(len(offset), 1, -1)[:, :, some] for values in (offset, height, relative))
    weight = np.maximum(1 - offset**2, 0) ** 2 / (1 + relative / (KNOWN * height) ** 2)
    deviance = ((POWERS - POWER[0]) / POWER[1]) ** 2
    if len(some):
        fits = [_parabola(offset, height, relative, power) for power in POWERS.tolist()]
        squares = np.array([(weight * (fit.left / (fit.by_height * height)) ** 2).sum() for fit in fits])
        free = np.einsum("nik,knn->", weight, fits[0].kept(np.arange(len(some)))) / len(some)
        deviance += REGIONS * free * np.log(squares + 1e-30)
    posterior = np.exp(-(deviance - deviance.min()) / 2)
    mean = float(np.average(POWERS, weights=posterior))
    return mean, math.sqrt(np.average((POWERS - mean) ** 2, weights=posterior))
