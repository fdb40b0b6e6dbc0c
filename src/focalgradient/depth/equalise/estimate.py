"""The default method: maximum likelihood by equalisation of whole images (Pentland 1987, Eqs. 7-11, any optics).

JPEG leaves less of fine detail, and less still of the blurred: depth of compressed views is estimated again at half
their size, where most of what compression took away is averaged out, in a window twice as wide in the scene. It is used
where fine detail gives no depth, and joined with that of fine detail where both are valid; where fine detail leaves
more than noise, and coarse detail does not, it is used alone.
"""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.equalise.alternatives import check_model, error_with, judge_alternatives
from focalgradient.depth.equalise.frame import Frame, depth_at_nodes, depth_at_pixels
from focalgradient.depth.equalise.outlines import curves, find_outlines
from focalgradient.depth.equalise.parts import ERRS, Likelihood, detail_halves, refine, reject_outliers
from focalgradient.depth.equalise.signal import BY_CHANCE, NEARLY_NOTHING, Signal, beyond_ends, beyond_infinity
from focalgradient.depth.equalise.whitening import Whitening, estimate_noise
from focalgradient.depth.filters import smoothed
from focalgradient.depth.numerics import interpolate_nodes, repeat_blocks
from focalgradient.depth.registration import RegisteredViews, shrunk
from focalgradient.depth.search import LEAST_LEVELS, Estimate, Problem
from focalgradient.depth.settings import LEAST_SIDE, WINDOWS

__all__ = ["estimate", "halved", "joined"]


def estimate(problem: Problem) -> Estimate:
    """Estimate depth for `focalgradient.recover_depth`; of compressed views, from their coarse detail as well.

    The views of `problem` are registered (`focalgradient.depth.registration`).
    """
    fine, beside_sd = estimate_at_one_scale(problem)
    is_misfit = fine.details["misfit"] > BY_CHANCE and fine.valid.mean() >= NEARLY_NOTHING
    is_lost = is_misfit and len(set(problem.search.wavebands)) == 1
    coarse = halved(problem) if is_lost or beside_sd is not None else None
    if coarse is None:
        return fine
    other = estimate_at_one_scale(coarse)[0]
    is_joined = beside_sd is not None or other.details["misfit"] < ERRS
    return joined(fine, other, beside_sd, problem.settings.window) if is_joined else fine


def estimate_at_one_scale(problem: Problem) -> tuple[Estimate, NDArray[np.float32] | None]:
    """Estimate depth from the views' detail as it is, stage by stage as `docs/report/method.md` derives them.

    Where compression has taken away fine detail and something is valid, also returns the part of the standard deviation
    that is due to a surface without texture where that is the likelier one (H x W, in dioptres); else None.
    """
    views, search, settings = problem.registered, problem.search, problem.settings
    settings.progress(0.15, "estimating noise")
    blurs = search.blurs(settings.psf).averaged(views.shares)
    noise = estimate_noise(problem, blurs)
    one_waveband = noise.gains is None  # textures of other wavebands leave residuals that are not a contradiction

    settings.progress(0.4, "equalising blur")
    whitening, frame = Whitening.of(problem, blurs, noise), Frame.empty(views.shape)
    for tile in whitening.tiles:
        part, whitened, energy = whitening.of_tile(tile)
        likelihood = Likelihood.of(whitened, part.usable(whitened), whitening.scale, energy)
        beyond = repeat_blocks(beyond_ends(likelihood.nodes, search), whitened.step, part.views.shape)
        inliers, local = reject_outliers(whitened, part, likelihood)
        refined = refine(whitened, part, inliers, local)
        halves = detail_halves(whitened, part, refined, one_waveband)
        split, outlines = halves.test(), None
        if settings.outlines and one_waveband:
            outlines = find_outlines(whitened, refined, part, blurs.radius, split.tau)
            if outlines is not None:  # whose windows hold two depths: no error of the model
                split = halves.test(outlines.is_clear(whitened, refined.nodes, blurs.radius))
        frame.fill(tile, beyond, refined, split, outlines)
        grid = whitened.without_images()
        # Before the next tile's are made, for memory.
        del part, whitened, energy, likelihood, inliers, local, refined, halves, outlines

    settings.progress(0.9, "estimating depth")
    noise_sd = whitening.noise_found
    nodes, split, jump_variance = depth_at_nodes(
        frame, grid, blurs, search.levels_per_pixel, noise.gains, settings.outlines
    )
    alternative = judge_alternatives(problem, blurs, noise_sd) if one_waveband else None
    tau = error_with(split, alternative)
    signal = Signal.of(problem, nodes, noise.gains, grid.step)
    vergence, sd, is_valid, beside_sd = depth_at_pixels(
        problem, grid, frame, nodes, jump_variance, signal, tau, whitening.law
    )
    model_details: dict[str, Any] = {}
    texts: list[str] = []
    if one_waveband:
        misfit, any_valid = signal.misfit(nodes), bool(is_valid.any())
        found = split, alternative, misfit, signal.explained, any_valid
        model_details, texts = check_model(problem, noise.sd, noise_sd, *found)
    outlines = frame.outlines if signal.is_trusted else None
    details = {
        **({} if noise.gains is None else noise.gains.stated(search.wavebands)),
        "noise_by_brightness": None if whitening.law is None else asdict(whitening.law),
        "misfit": float(np.median(nodes.misfit)),
        "split_band": split.stated(),
        **model_details,
        "share_of_texture_explained": signal.explained,
        **({"outlines": [] if outlines is None else curves(outlines.side)} if settings.outlines else {}),
        "share_disagreeing": float(1 - frame.is_consistent.mean()),
        **signal.rejection(nodes, split.tau, (search.lowest, search.highest), is_valid),
    }
    beyond = frame.beyond * (views.usable & ~is_valid & (one_waveband and signal.is_trusted))
    details["share_at_or_beyond"] = {"farthest": float(np.mean(beyond < 0)), "nearest": float(np.mean(beyond > 0))}
    farther = details["share_at_or_beyond"]["farthest"]
    impossible = [] if search.lowest > 0 or views.warnings else beyond_infinity(farther, signal.explained)
    in_own_unit = [sd * gain for sd, gain in zip(noise_sd, views.gains, strict=True)]
    result = Estimate(
        *(
            vergence,
            sd,
            is_valid,
            in_own_unit,
            True,
            details,
            [*texts, *impossible],
        ),
        beyond=beyond,
    )
    return result, beside_sd if whitening.is_compressed and is_valid.any() else None


FACTOR = 2
"""Reduction of the views. Where fine detail gives no depth, the mean relative error by half-sized views is 0.13 in 20
rooms in JPEG of quality 75 (by fine detail 0.12), and 0.35 where only views reduced by 4 give any."""

AROUND, KNOWN = 2.0, 0.1
"""Standard deviation in windows of the neighbourhood of a pixel in which both must give depth; and minimum proportion
of the pixels in it at which they do. Chosen with `CONTINUED`."""

CONTINUED = 0.12
"""Maximum difference of coarse detail's depth from the mean of fine detail's around it, relative to the frame's median
vergence. Without this limit 50 % of the pixels of 20 rooms are valid instead of 40 %, with a mean relative error of
0.12 instead of 0.11, and a completed map is worse than one from fine detail alone (`benchmarks/rooms.py`)."""

ALIKE = 0.7
"""Correlation of the errors of fine and of coarse detail, which come of the same texture: 0.65 in 18 rooms (median; 0.3
to 0.9), 0.8 on rendered layers, each error over its standard deviation (`benchmarks/rooms.py`)."""


def halved(problem: Problem) -> Problem | None:
    """Return the problem with views of half the size; None where they are too small, or blur is a mixture of several.

    The range searched is the same.
    """
    registered, search, settings = problem.registered, problem.search, problem.settings
    least = max(LEAST_SIDE, WINDOWS * settings.window)
    if registered.shares is not None or min(registered.shape) // FACTOR < least:
        return None
    reduced = RegisteredViews(
        [shrunk(image, FACTOR) for image in registered.images],
        shrunk(registered.usable.astype(np.float32), FACTOR) == 1,
        registered.gains,
        registered.placements,
        registered.warnings,
    )
    views = [
        replace(view, image=shrunk(view.image, FACTOR), pixel_angle=FACTOR * view.pixel_angle, mask=None)
        for view in problem.views
    ]
    levels = max(LEAST_LEVELS, math.ceil((search.levels - 1) / FACTOR)) + 1
    noise = settings.given_noise(len(views))
    given = None if noise is None else (noise / FACTOR).tolist()  # white noise, of which the mean of a block has less
    return Problem(
        views,
        reduced,
        replace(search, pixels=search.pixels / FACTOR, pixel_angle=FACTOR * search.pixel_angle, levels=levels),
        replace(settings, noise=given, progress=lambda share, words: None),
    )


def joined(fine: Estimate, coarse: Estimate, least_sd: NDArray[np.float32] | None, window: float) -> Estimate:
    """Join estimates from fine detail, in a `window` (pixels), and from the `halved` problem.

    Where both are valid each has the weight of its precision, and their errors are correlated (`ALIKE`). Coarse detail
    alone is valid where it continues the depth around it at which both are. The standard deviation includes what the
    two differ by, or what differs from that around, and is `least_sd` (H x W, in dioptres) at least wherever coarse
    detail contributes: it says less of where a surface ends. None: coarse detail is used alone, unless it gives depth
    at fewer pixels.
    """
    shape = fine.valid.shape
    vergence, sd, known = (
        interpolate_nodes(values.astype(float), None, FACTOR, shape).astype(np.float32)
        for values in (coarse.vergence, coarse.vergence_sd, coarse.valid)
    )
    is_coarse = known > 0.5
    if least_sd is None and is_coarse.mean() < fine.valid.mean():
        return fine
    is_both = fine.valid & is_coarse & (least_sd is not None)
    near = smoothed(is_both.astype(np.float32), AROUND * window)
    around = smoothed(is_both * fine.vergence, AROUND * window) / np.maximum(near, 1e-6)
    apart = CONTINUED * abs(float(np.median(fine.vergence[fine.valid])))
    is_added = is_coarse & ~fine.valid & (near > KNOWN) & (np.abs(vergence - around) < apart)
    valid = fine.valid | is_added
    if least_sd is None:
        is_added, valid, around, least_sd = is_coarse, is_coarse, vergence, np.zeros_like(sd)
    share = np.where(is_both, 1 / (1 + (fine.vergence_sd / sd) ** 2), ~is_added).astype(np.float32)  # of fine detail
    outdated = set() if valid.mean() < NEARLY_NOTHING else {"rejected", "share_outside_range"}
    details = {
        **{name: value for name, value in fine.details.items() if name not in outdated},
        "coarse_detail": {
            "share_joined": float(is_both.mean()),
            "share_added": float(is_added.mean()),
            "tau": coarse.details["split_band"]["tau"],
        },
    }
    differ = np.where(is_added, vergence - around, np.sqrt(share * (1 - share)) * (vergence - fine.vergence))
    one, other = share * fine.vergence_sd, (1 - share) * sd
    joint_sd = np.sqrt(one**2 + other**2 + 2 * ALIKE * one * other + differ**2)
    return replace(
        fine,
        vergence=share * fine.vergence + (1 - share) * vergence,
        vergence_sd=np.where(share < 1, np.maximum(joint_sd, least_sd), joint_sd).astype(np.float32),
        valid=valid,
        details=details,
        beyond=None if fine.beyond is None else fine.beyond * ~valid,
    )
