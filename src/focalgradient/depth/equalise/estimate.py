"""The default method: maximum likelihood by equalisation of whole images (Pentland 1987, Eqs. 7-11, any optics)."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.equalise.alternatives import ModelChecks, check_model, error_with, judge_alternatives
from focalgradient.depth.equalise.coarse import halved, joined
from focalgradient.depth.equalise.curves import curves
from focalgradient.depth.equalise.frame import Frame, depth_at_nodes, depth_at_pixels
from focalgradient.depth.equalise.outlines import find_outlines
from focalgradient.depth.equalise.robust import Likelihood, detail_halves, refine, reject_outliers
from focalgradient.depth.equalise.signal import Signal, beyond_ends, beyond_infinity
from focalgradient.depth.equalise.whitening import Whitening, estimate_noise
from focalgradient.depth.estimate import Estimate, Problem
from focalgradient.depth.numerics import repeat_blocks

__all__ = ["estimate"]


def estimate(problem: Problem) -> Estimate:
    """Estimate depth for `focalgradient.recover_depth`; of compressed views, from their coarse detail as well.

    The views of `problem` are registered (`focalgradient.depth.registration`).
    """
    fine, beside_sd = estimate_at_one_scale(problem)
    coarse = None if beside_sd is None else halved(problem)
    if beside_sd is None or coarse is None:
        return fine
    return joined(fine, estimate_at_one_scale(coarse)[0], beside_sd, problem.settings.window)


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
    depth = depth_at_nodes(frame, grid, blurs, search.levels_per_pixel, noise.gains, settings.outlines)
    alternative = judge_alternatives(problem, blurs, noise_sd) if one_waveband else None
    tau = error_with(depth.split, alternative)
    signal = Signal.of(problem, depth.nodes, noise.gains, grid.step)
    pixels = depth_at_pixels(problem, grid, frame, depth, signal, tau, whitening.law)
    checks = ModelChecks()
    if one_waveband:
        misfit, any_valid = signal.misfit(depth.nodes), bool(pixels.is_valid.any())
        found = depth.split, alternative, misfit, signal.explained, any_valid
        checks = check_model(problem, noise.sd, noise_sd, *found)
    outlines = frame.outlines if signal.is_trusted else None
    details = {
        **({} if noise.gains is None else noise.gains.stated(search.wavebands)),
        "noise_by_brightness": None if whitening.law is None else asdict(whitening.law),
        "misfit": float(np.median(depth.nodes.misfit)),
        "split_band": depth.split.stated(),
        **checks.details,
        "share_of_texture_explained": signal.explained,
        **({"outlines": [] if outlines is None else curves(outlines.side)} if settings.outlines else {}),
        "share_disagreeing": float(1 - frame.is_consistent.mean()),
        **signal.rejection(depth.nodes, depth.split.tau, (search.lowest, search.highest), pixels.is_valid),
    }
    beyond = frame.beyond * (views.usable & ~pixels.is_valid & (one_waveband and signal.is_trusted))
    details["share_at_or_beyond"] = {"farthest": float(np.mean(beyond < 0)), "nearest": float(np.mean(beyond > 0))}
    farther = details["share_at_or_beyond"]["farthest"]
    impossible = [] if search.lowest > 0 or views.warnings else beyond_infinity(farther, signal.explained)
    in_own_unit = [sd * gain for sd, gain in zip(noise_sd, views.gains, strict=True)]
    result = Estimate(
        *(
            pixels.vergence,
            pixels.vergence_sd,
            pixels.is_valid,
            in_own_unit,
            True,
            details,
            [*checks.warnings, *impossible],
        ),
        beyond=beyond,
    )
    return result, pixels.beside_sd if whitening.is_compressed and pixels.is_valid.any() else None
