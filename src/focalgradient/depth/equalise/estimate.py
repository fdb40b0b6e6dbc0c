"""The default method: maximum likelihood by equalisation of whole images (Pentland 1987, Eqs. 7-11, any optics).

Each view's noise, the law by which it rises and the power of the scene are estimated once for all tiles. Noise may rise
with brightness, as that of photons does, and with contrast, as the errors of compression do. Where the views agree, the
residual is noise, so that its power in dark and in bright places, and in flat places and those with contrast, gives the
law. The residuals of each pixel are then divided by its own noise, and all that follows takes noise to be even.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.equalise.coarse import halved, joined
from focalgradient.depth.equalise.frame import Frame, depth_at_nodes, depth_at_pixels
from focalgradient.depth.equalise.likelihood import Equalised, Nodes, equalise, scene_power
from focalgradient.depth.equalise.outlines import curves, find_outlines
from focalgradient.depth.equalise.parts import ERRS, Likelihood, Tile, detail_halves, refine, tiles, usable_at_first
from focalgradient.depth.equalise.signal import BY_CHANCE, Signal, are_compressed, beyond_ends, beyond_infinity
from focalgradient.depth.equalise.wavebands import BandGains, estimate_band_gains
from focalgradient.depth.filters import Image, Spectra
from focalgradient.depth.hypotheses import check_model, judge_blur
from focalgradient.depth.noise import (
    LENIENCE,
    NOISE_SIDE,
    NoiseLaw,
    brightness_of,
    local_contrast,
    noise_from_residuals,
    noise_law,
    uneven_noise,
)
from focalgradient.depth.numerics import block_mean, repeat_blocks, step_of
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Blurs, Estimate, Problem
from focalgradient.depth.validity import LARGEST_TAU, NEARLY_NOTHING

__all__ = ["Whitening", "estimate", "estimate_noise"]

COMMON_SIDE = 1024
"""Side in pixels of the part of a large frame from which parameters common to all tiles are estimated; limits the time.
Chosen by hand."""

BANDS_SIDE = 256
"""Side in pixels of the part of the views from which texture shared by wavebands is estimated. Chosen by hand."""

EVENING_ROUNDS = 4
"""Maximum number of times noise is equalised and depth is estimated again. Chosen by hand."""

SHARE_SETTLED, CONTRAST_SETTLED = 0.02, 0.1
"""Change of the brightness-dependent share, and relative change of the contrast-dependent part, below which the noise
law has converged. Chosen by hand."""


EstimatedNoise = tuple[list[float], float | None, BandGains | None]
"""Standard deviation of each view's noise, the largest factor of its variance, and what wavebands share."""


def estimate_noise(problem: Problem, blurs: Blurs) -> EstimatedNoise:
    """Estimate the noise of each registered view, where it is not given, and what wavebands share.

    Returns
    -------
    sd, raisable, gains
        Standard deviation of each view's noise; the factor by which its variance may still be raised (None where noise
        is given); and what wavebands share (None: all views are in one).
    """
    settings, registered, wavebands = problem.settings, problem.registered, problem.search.wavebands
    given = settings.given_noise(len(problem.views))
    if len(set(wavebands)) == 1:
        return *noise_from_residuals(registered, blurs, settings.window, given), None
    known = None if given is None else noise_from_residuals(registered, blurs, settings.window, given)[0]
    part = registered.most_textured_crop(BANDS_SIDE)
    mixtures = [one.mixture for one in problem.search.stated]
    expected = None
    if mixtures[0] is not None:  # then all are
        stated = np.array([(one.gain / mixtures[0].gain, one.gain_sd) for one in mixtures if one is not None])
        expected = stated[:, 0], stated[:, 1]
    gains = estimate_band_gains(wavebands, part, blurs, settings.window, known, expected)
    return gains.noise_sd, LENIENCE**2, gains


@dataclass(slots=True, eq=False)
class Whitening:
    """Whitening of the tiles of a frame."""

    problem: Problem
    whiten: Callable[..., Equalised]  # `equalise` by the views' blurs in the window of the settings
    noise_sd: list[float]  # of each view, as assumed
    scale: float  # noise variance in units of the one assumed
    law: NoiseLaw | None  # by which noise rises with brightness and contrast
    power: FloatArray | None  # of the sharp scene; None: that of the tile
    shows_blocks: bool  # of JPEG; in other views noise by contrast is an error of the model, and hides no surface
    tiles: Sequence[Tile]
    whole: tuple[Equalised, Image] | None  # the frame, where it is one tile: whitened already, with its energy

    @classmethod
    def of(cls, problem: Problem, blurs: Blurs, estimated: EstimatedNoise, compressed: bool) -> Whitening:
        """Estimate what all tiles share, from the most textured part of a large frame."""
        registered, settings, (noise_sd, raisable, gains) = problem.registered, problem.settings, estimated
        shared, step = None if gains is None else gains.shared, step_of(settings.window)
        parts = list(tiles(registered.shape, step))
        is_large = len(parts) > 1
        crop = registered.most_textured_crop(COMMON_SIDE) if is_large else registered
        at = None if raisable is None else _brightness_of_noise(registered)
        whiten = partial(equalise, blurs=blurs, window=settings.window, shared=shared)
        for again in (False, True):
            power = None
            if is_large:
                power = scene_power(Spectra.of(crop.images, 16).over(noise_sd), noise_sd, blurs.frequencies)
            first = whiten(crop.images, noise_sd=noise_sd, power=power, shares=crop.shares)
            # A crop of a large frame has no border.
            is_used = crop.usable if is_large else usable_at_first(crop, first)
            law, nodes, energy = _even_out(first, crop, is_used, at, shared is None, compressed)
            if again or raisable is None or law is None or not law.by_contrast or len(set(noise_sd)) == 1:
                break
            # Compression's errors have the spectrum of neither view's noise, by which these were distinguished: all
            # are treated alike.
            noise_sd = [math.sqrt(float(np.mean(np.square(noise_sd))))] * len(noise_sd)
        scale = 1.0 if raisable is None else min(raisable, first.noise_found(nodes))
        whole = None if is_large else (replace(first, scale=scale), energy)
        if is_large:
            parts = list(tiles(registered.shape, step, sum(len(one.images) for one in first.residuals)))
            noise_sd, scale = [math.sqrt(scale) * sd for sd in noise_sd], 1.0
        return cls(problem, whiten, noise_sd, scale, law, power, compressed, parts, whole)

    @property
    def noise_found(self) -> list[float]:
        """Standard deviation of each registered view's noise."""
        return [math.sqrt(self.scale) * sd for sd in self.noise_sd]

    @property
    def is_compressed(self) -> bool:
        """Whether noise rises with contrast, as that of compression does."""
        return self.law is not None and self.law.by_contrast > 0

    def of_tile(self, tile: Tile) -> tuple[RegisteredViews, Equalised, Image | None]:
        """Return the views of a tile, the same whitened at every candidate, and their energy if known."""
        settings, registered = self.problem.settings, self.problem.registered
        if len(self.tiles) > 1:
            number = self.tiles.index(tile)
            share, words = number / len(self.tiles), f"equalising blur, tile {number + 1} of {len(self.tiles)}"
            settings.progress(0.4 + 0.5 * share, words)
        if self.whole is not None:
            views, (equalised, energy), self.whole = registered, self.whole, None
        else:
            views, energy = registered.part(*tile.outer), None
            equalised = self.whiten(views.images, noise_sd=self.noise_sd, power=self.power, shares=views.shares)
            if self.law is not None:
                equalised.divide(uneven_noise(self.law, views))
        return views, replace(equalised, compressed=self.is_compressed and self.shows_blocks), energy


def _brightness_of_noise(registered: RegisteredViews) -> float:
    """Mean brightness of the part in which noise is estimated."""
    part = registered.most_textured_crop(NOISE_SIDE)
    return float(np.mean([image[part.usable].mean() for image in part.images])) if part.usable.any() else 0.0


def _even_out(
    equalised: Equalised, views: RegisteredViews, is_used: Mask, at: float | None, one_waveband: bool, compressed: bool
) -> tuple[NoiseLaw | None, Nodes, Image]:
    """Equalise noise that rises with brightness or contrast, in place; return the law, depth and energy.

    Over the pixels that are used (H x W). At brightness `at` noise is as assumed. None: noise is given, and alike in
    bright and in dark places. Photons of different wavebands, with textures of their own, are not compared.
    `compressed`: whether the views show JPEG blocks.
    """
    weight, step = is_used.astype(np.float32), equalised.step

    def read() -> tuple[Nodes, Image]:  # every other node
        energy = equalised.energy(weight)
        mean, support = equalised.averages(energy, weight)
        return equalised.minima(mean[:, ::2, ::2], support[::2, ::2]), energy

    def at_nodes(image: Image) -> FloatArray:
        return block_mean(image, step)[::2, ::2]

    (nodes, energy), law = read(), None
    if not one_waveband:
        return None, nodes, energy
    image, contrast = brightness_of(views), local_contrast(views)
    bright, varied, divided = at_nodes(image), at_nodes(contrast), np.ones_like(image)
    brightness = float(image.mean()) if at is None else at
    for _ in range(EVENING_ROUNDS):
        # Where noise is less than assumed, depth is wrong and more is left of the views: the law mends both.
        variance = nodes.misfit * (1 if law is None else law.variance(bright, varied))
        some = nodes.with_texture(nodes.is_supported)
        places = variance[some], bright[some], varied[some]
        found = noise_law(*places, brightness, level_known=at is None, compressed=compressed)
        if found is None or (law is not None and _alike(found, law)):
            break
        noise_sd = np.sqrt(found.variance(image, contrast)).astype(np.float32)
        equalised.divide(noise_sd / divided)
        law, divided, (nodes, energy) = found, noise_sd, read()
    return law, nodes, energy


def _alike(one: NoiseLaw, other: NoiseLaw) -> bool:
    change = abs(one.by_contrast - other.by_contrast)
    return abs(one.share - other.share) < SHARE_SETTLED and change <= CONTRAST_SETTLED * other.by_contrast


def estimate(problem: Problem) -> Estimate:
    """Estimate depth for `focalgradient.recover_depth`; of compressed views, from their coarse detail as well.

    The views of `problem` are registered (`focalgradient.depth.registration`).
    """
    compressed = are_compressed([view.image for view in problem.views])
    fine, beside_sd = estimate_at_one_scale(problem, compressed)
    is_misfit = fine.details["misfit"] > BY_CHANCE and fine.valid.mean() >= NEARLY_NOTHING
    is_lost = is_misfit and len(set(problem.search.wavebands)) == 1
    coarse = halved(problem) if is_lost or beside_sd is not None else None
    if coarse is None:
        return fine
    other = estimate_at_one_scale(coarse, compressed)[0]
    is_joined = beside_sd is not None or other.details["misfit"] < ERRS
    return joined(fine, other, beside_sd, problem.settings.window) if is_joined else fine


def estimate_at_one_scale(problem: Problem, compressed: bool) -> tuple[Estimate, NDArray[np.float32] | None]:
    """Estimate depth from the views' detail as it is, stage by stage as `docs/report/method.md` derives them.

    `compressed`: whether the views as they were given show blocks of JPEG.
    Where compression has taken away fine detail and something is valid, also returns the part of the standard deviation
    that is due to a surface without texture where that is the likelier one (H x W, in dioptres); else None.
    """
    views, search, settings = problem.registered, problem.search, problem.settings
    settings.progress(0.15, "estimating noise")
    blurs = search.blurs(settings.psf).averaged(views.shares)
    assumed_sd, _, gains = estimated = estimate_noise(problem, blurs)
    one_waveband = gains is None  # textures of other wavebands leave residuals that are not a contradiction

    settings.progress(0.4, "equalising blur")
    whitening = Whitening.of(problem, blurs, estimated, compressed)
    frame = Frame.empty(views.shape)
    for tile in whitening.tiles:
        part, whitened, energy = whitening.of_tile(tile)
        likelihood = Likelihood.of(whitened, usable_at_first(part, whitened), energy)
        beyond = repeat_blocks(beyond_ends(likelihood.nodes, search), whitened.step, part.shape)
        refined = refine(whitened, part, likelihood, settings.false_alarm)
        halves = detail_halves(whitened, refined, one_waveband)
        split, outlines = halves.test(), None
        if settings.outlines and one_waveband:
            outlines = find_outlines(whitened, refined, part, settings.false_alarm, split.tau)
            if outlines is not None:  # whose windows hold two depths: no error of the model
                split = halves.test(outlines.is_clear(whitened, refined.nodes))
        frame.fill(tile, beyond, refined, split, outlines)
        grid = whitened.without_images()
        # Before the next tile's are made, for memory.
        del part, whitened, energy, likelihood, refined, halves, outlines

    settings.progress(0.9, "estimating depth")
    noise_sd = whitening.noise_found
    nodes, split, jump_variance = depth_at_nodes(frame, grid, blurs, gains, settings.outlines, compressed)
    alternative = judge_blur(problem, blurs, noise_sd, frame.is_consistent) if one_waveband else None
    tau = split.tau if alternative is None else max(split.tau, min(alternative.change, LARGEST_TAU))
    signal = Signal.of(problem, nodes, gains, grid.step)
    vergence, sd, is_valid, beside_sd = depth_at_pixels(
        problem, grid, frame, nodes, jump_variance, signal, tau, whitening.law
    )
    model_details: dict[str, Any] = {}
    texts: list[str] = []
    if one_waveband:
        found = split, alternative, signal.misfit(nodes), signal.explained, bool(is_valid.any())
        model_details, texts = check_model(problem, assumed_sd, noise_sd, *found)
    outlines = frame.outlines if signal.is_trusted else None
    details = {
        **({} if gains is None else gains.stated(search.wavebands)),
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
    result = Estimate(vergence, sd, is_valid, in_own_unit, True, details, [*texts, *impossible], beyond=beyond)
    return result, beside_sd if whitening.is_compressed and is_valid.any() else None
