"""The default method: maximum likelihood by equalisation over the whole image (Pentland 1987, Eqs. 7-11, any optics).

Views are brought onto one grid and one exposure, equalised at every candidate depth
(`focalgradient.depth.equalise.likelihood`), and read; what contradicts itself is left out and refused.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.equalise.likelihood import GROWTH, Blurs, Equalised, Nodes, equalise
from focalgradient.depth.equalise.wavebands import settle, shift_by_gain
from focalgradient.depth.filters import fine_noise
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.depth.settings import RecoverySettings
from focalgradient.errors import FocalGradientWarning
from focalgradient.view import View

__all__ = ["measured_noise", "recover"]

CHECK_SIDE = 5
"""Side in pixels of the squares in which the views' agreement is tested."""

MODEL_ERROR = 0.03
"""Error of real lenses' blur against the model, as a share of its radius, that is not yet a contradiction."""

LENIENCE = 2.0
"""Times the noise that an image can hold up to which what is left of the views is put down to noise."""

MISFIT = 4.0
"""Times the noise's power that may be left of the views in the wide window, beyond which nothing is claimed."""

REACH = 2.0
"""How far into the frame the light from beyond it is felt, in radii of blur."""

ROUNDS = 6
"""Times that contradicting pixels are looked for, at most."""


def recover(views: Sequence[View], asked: RecoverySettings) -> DepthMap:
    """Depth of `views` as `focalgradient.recover_depth` returns it, for checked views and settings."""
    search = Search.over(views, asked.near, asked.far)

    asked.say("placing the views")
    unlike = len(set(search.lights)) > 1
    with warnings.catch_warnings():
        if unlike:  # a texture that is not quite the same seems displaced: nothing to warn of
            warnings.simplefilter("ignore", FocalGradientWarning)
        placed = RegisteredViews.of(views, asked.align)
    asked.say("measuring noise")
    blurs, settled = search.blurs(asked.psf, asked.k), None
    raisable: float | None
    if unlike:
        given = None if asked.noise is None else measured_noise(asked, placed, blurs)[0]
        settled = settle(search.lights, placed.busiest(256), blurs, asked.window, given)
        noise_sd, raisable = settled.noise_sd, LENIENCE**2
    else:
        noise_sd, raisable = measured_noise(asked, placed, blurs)
    asked.say("equalising blur")
    shares = None if settled is None else settled.shares
    equalised = equalise(placed.images, blurs, noise_sd, window=asked.window, shares=shares)
    asked.say("reading depth")
    blur = search.radius(search.vergences)
    tolerance = MODEL_ERROR * blur / (search.slope * search.spacing)
    nodes, agrees, scale = _read_robustly(equalised, placed, asked.false_alarm, blur, tolerance, raisable)
    if settled is not None:
        moved = np.interp(nodes.level, np.arange(search.levels), shift_by_gain(settled, blurs))
        nodes = replace(nodes, sd=np.hypot(nodes.sd, moved))

    level = equalised.to_pixels(nodes.level, nodes.sd, placed.shape)
    sd_level = equalised.to_pixels(nodes.sd, nodes.sd, placed.shape)
    vergence = (search.lowest + level * search.spacing).astype(np.float32)
    vergence_sd = (sd_level * search.spacing).astype(np.float32)
    # Texture enough: blur known to 0.3 pixel or to a tenth, and told by signal rather than by noise.
    found = search.radius(vergence.astype(float))
    clear = vergence_sd * search.slope <= np.maximum(0.3, 0.1 * found)
    told = nodes.alone & nodes.inside & (nodes.texture >= 1) & (nodes.support >= 0.1) & (nodes.misfit < MISFIT)
    valid = clear & agrees & equalised.to_blocks(told, placed.shape)
    if not search.side_known:
        warnings.warn(FocalGradientWarning(search.side_text), stacklevel=3)
    details = {
        **asked.stated(),
        "searched_vergence_D": [search.lowest, search.highest],
        "side": search.side_text,
        "noise": [float(sd * gain * math.sqrt(scale)) for sd, gain in zip(noise_sd, placed.gains, strict=True)],
        "noise_estimated": asked.noise is None,
        "gain": placed.gains,
        **({} if settled is None else settled.stated(search.lights)),
        "shift_px": [[p.down, p.right] for p in placed.found],
        "scale": [p.scale for p in placed.found],
        "misfit": float(np.median(nodes.misfit)),
        "share_disagreeing": float(1 - agrees.mean()),
        "share_valid": float(valid.mean()),
    }
    side_known = np.full(placed.shape, search.side_known)
    return DepthMap(vergence, vergence_sd, valid, side_known, details)


def measured_noise(asked: RecoverySettings, placed: RegisteredViews, blurs: Blurs) -> tuple[list[float], float | None]:
    """Standard deviation of each placed view's noise, as given or from what equalising leaves of the busiest part.

    Also returns by how much its variance may still be raised, as the whole frame may ask for; None where it is given.
    """
    if asked.noise is not None:
        given = np.broadcast_to(np.asarray(asked.noise, float), len(placed.images))
        return [float(sd / gain) for sd, gain in zip(given, placed.gains, strict=True)], None
    part = placed.busiest(192)
    spread = float(np.mean([image.std() for image in part.images]))
    floor = 2e-4 * spread  # storage and rounding leave at least this
    gains = np.array(placed.gains)
    # An upper bound first: what the finest detail of the most blurred view holds.
    level = max(floor, min(fine_noise(image) * gain for image, gain in zip(part.images, gains, strict=True)))

    # What an image holds of finest detail bounds its noise; that the blur model errs a little is counted as noise too.
    most = LENIENCE * np.array([fine_noise(image) for image in part.images]) + floor

    def settle(shape: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """Noise of the given proportions, and how much speaks against them."""
        noise_sd = np.maximum(floor, level * shape)
        for _ in range(3):
            equalised = equalise(part.images, blurs, noise_sd.tolist(), window=asked.window)
            nodes = equalised.read(part.usable.astype(np.float32))
            change = math.sqrt(equalised.noise_found(nodes))
            # Of the wrong proportions the fit is uneven over the frame, and each view's residual says otherwise.
            misfit = np.log(nodes.misfit[nodes.support > 0.5])
            each = equalised.noise_by_view(equalised.look(nodes)) if uneven else np.ones(1)
            doubt = float(misfit.std() + 0.2 * np.ptp(np.log(each)))
            noise_sd = np.maximum(floor, noise_sd * min(change, float(np.min(most / noise_sd))))
            if 0.7 < change < 1.4:
                break
        return doubt, noise_sd

    # Noise comes after exposure, alike in all views, or before, in proportion to it.
    uneven = float(np.ptp(np.log(gains))) > 0.05
    shapes = [1 / gains, np.ones_like(gains)] if uneven else [1 / gains]
    _, noise_sd = min((settle(shape) for shape in shapes), key=lambda settled: settled[0])
    return [float(sd) for sd in noise_sd], float(np.min((most / noise_sd) ** 2))


def _read_robustly(
    equalised: Equalised,
    placed: RegisteredViews,
    false_alarm: float,
    blur: NDArray[np.float64],
    tolerance: NDArray[np.float64],
    raisable: float | None,
) -> tuple[Nodes, NDArray[np.bool_], float]:
    """Read depth without what contradicts itself, and without what blur from beyond the frame reaches.

    `blur` and `tolerance` are the largest blur radius in pixels, and the tolerated error in levels, at each level.
    Contradicting pixels mislead the windows around them, so they are found, left out, and looked for again.
    Returns the nodes, which pixels agree, and the noise variance in units of the one assumed.
    """
    # Blur carries light in from beyond the frame: its rim is not read, and goes by what lies next to it.
    rim = min(round(equalised.window), min(placed.shape) // 8)
    middle = (slice(rim, -rim), slice(rim, -rim))
    inward = np.minimum.outer(*(np.minimum(np.arange(n), np.arange(n)[::-1]) for n in placed.shape))
    agrees, used = placed.usable, placed.usable & (inward >= rim)
    # Only once: where contradiction is wide, what is left of it after each round would pass for ever less noise.
    mean, support = equalised.averages(used.astype(np.float32))
    some = equalised.minima(mean[:, ::2, ::2], support[::2, ::2])
    scale = min(raisable, equalised.noise_found(some)) if raisable is not None else 1.0
    nodes = equalised.minima(mean, support, scale)
    for _ in range(ROUNDS):
        seen, before = equalised.look(nodes), used
        agreement = equalised.agreement(seen, scale, CHECK_SIDE, false_alarm, tolerance)
        agrees = placed.usable & np.pad(agreement[middle], rim, mode="edge")
        reach = REACH * np.interp(seen.level, np.arange(equalised.levels), blur)
        used = agrees & (inward >= np.clip(reach, rim, min(placed.shape) / 6))
        if (before ^ used).mean() < 2e-3:
            break
        nodes = equalised.read(used.astype(np.float32), scale)
    weight = used.astype(np.float32)
    nodes = replace(equalised.refine(nodes, seen, weight, scale, GROWTH[:2]), sd=nodes.sd)
    nodes = equalised.refine(nodes, equalised.look(nodes), weight, scale)  # again, about the first's answer
    return equalised.beside_jumps(nodes), agrees, scale
