"""Noise of a frame's views, and the views whitened: residuals with noise of one variance, tile by tile.

Each view's noise, the law by which it rises and the power of the scene are estimated once for all tiles.

Noise may rise with brightness, as that of photons does, and with contrast, as the errors of compression do. Where the
views agree, the residual is noise, so that its power in dark and in bright places, and in flat places and those
with contrast, gives the law. The residuals of each pixel are then divided by its own noise, and all that follows takes
noise to be even.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focalgradient.depth.equalise.likelihood import Equalised, Nodes, SharedPower, equalise, scene_power, step_of
from focalgradient.depth.equalise.parts import Part, Tile, tiles
from focalgradient.depth.equalise.wavebands import BandGains, estimate_band_gains
from focalgradient.depth.filters import FloatArray, Image, Spectra, smoothed
from focalgradient.depth.noise import LENIENCE, NOISE_SIDE, NoiseLaw, noise_from_residuals, noise_law
from focalgradient.depth.numerics import block_mean
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Blurs, Problem

__all__ = ["FrameNoise", "Whitening", "estimate_noise", "uneven_noise"]

COMMON_SIDE = 1024
"""Side in pixels of the part of a large frame from which parameters common to all tiles are estimated; limits the time.
Chosen by hand."""

BANDS_SIDE = 256
"""Side in pixels of the part of the views from which texture shared by wavebands is estimated. Chosen by hand."""


BRIGHTNESS_SD = 2.0
"""Standard deviation in pixels of the Gaussian that smooths brightness; it reduces noise to 1/7. Chosen by hand."""

CONTRAST_SD = 3.0
"""Standard deviation in pixels of the Gaussian window in which contrast is measured: JPEG blocks are 8 wide, and their
errors do not extend beyond them."""

EVENING_ROUNDS = 4
"""Maximum number of times noise is equalised and depth is estimated again. Chosen by hand."""

SHARE_SETTLED, CONTRAST_SETTLED = 0.02, 0.1
"""Change of the brightness-dependent share, and relative change of the contrast-dependent part, below which the noise
law has converged. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameNoise:
    """Noise of registered views, and what views in different wavebands share."""

    sd: list[float]  # of each view
    raisable: float | None  # factor by which its variance may still be raised; None where noise is given
    gains: BandGains | None = None  # None: all views are in one waveband

    @property
    def shared(self) -> SharedPower | None:
        """Texture that wavebands share; None: all views are in one waveband."""
        return None if self.gains is None else self.gains.shared


def estimate_noise(problem: Problem, blurs: Blurs) -> FrameNoise:
    """Estimate the noise of each registered view, where it is not given, and what wavebands share."""
    settings, registered, wavebands = problem.settings, problem.registered, problem.search.wavebands
    given = settings.given_noise(len(problem.views))
    if len(set(wavebands)) == 1:
        return FrameNoise(*noise_from_residuals(registered, blurs, settings.window, given))
    known = None if given is None else noise_from_residuals(registered, blurs, settings.window, given)[0]
    part = registered.most_textured_crop(BANDS_SIDE)
    mixtures = [one.mixture for one in problem.search.stated]
    expected = None
    if mixtures[0] is not None:  # then all are
        stated = np.array([(one.gain / mixtures[0].gain, one.gain_sd) for one in mixtures if one is not None])
        expected = stated[:, 0], stated[:, 1]
    gains = estimate_band_gains(wavebands, part, blurs, settings.window, known, expected)
    return FrameNoise(gains.noise_sd, LENIENCE**2, gains)


@dataclass(slots=True, eq=False)
class Whitening:
    """Whitening of the tiles of a frame."""

    problem: Problem
    blurs: Blurs
    shared: SharedPower | None
    noise_sd: list[float]  # of each view, as assumed
    scale: float  # noise variance in units of the one assumed
    law: NoiseLaw | None  # by which noise rises with brightness and contrast
    power: FloatArray | None  # of the sharp scene; None: that of the tile
    tiles: Sequence[Tile]
    whole: tuple[Equalised, Image] | None  # the frame, where it is one tile: whitened already, with its energy

    @classmethod
    def of(cls, problem: Problem, blurs: Blurs, noise: FrameNoise) -> Whitening:
        """Estimate what all tiles share, from the most textured part of a large frame."""
        registered, settings, shared, noise_sd = problem.registered, problem.settings, noise.shared, noise.sd
        step = step_of(settings.window)
        parts = list(tiles(registered.shape, step))
        is_large = len(parts) > 1
        crop, inward = registered, parts[0].inward(registered.shape)
        if is_large:
            crop = registered.most_textured_crop(COMMON_SIDE)
            inward = np.full(crop.shape, max(registered.shape))
        part = Part(crop, inward, settings.false_alarm, problem.search)
        at = None if noise.raisable is None else _brightness_of_noise(registered)
        for again in (False, True):
            power = None
            if is_large:
                power = scene_power(Spectra.of(crop.images, 16).over(noise_sd), noise_sd, blurs.frequencies)
            first = equalise(
                crop.images, blurs, noise_sd, window=settings.window, shared=shared, power=power, shares=crop.shares
            )
            law, nodes, energy = _even_out(first, part, at, shared is None)
            if again or noise.raisable is None or law is None or not law.by_contrast or len(set(noise_sd)) == 1:
                break
            # Compression's errors have the spectrum of neither view's noise, by which these were distinguished: all
            # are treated alike.
            noise_sd = [math.sqrt(float(np.mean(np.square(noise_sd))))] * len(noise_sd)
        scale = 1.0 if noise.raisable is None else min(noise.raisable, first.noise_found(nodes))
        if not is_large:
            return cls(problem, blurs, shared, noise_sd, scale, law, power, parts, (first, energy))
        parts = list(tiles(registered.shape, step, sum(len(one.images) for one in first.residuals)))
        noise_sd = [math.sqrt(scale) * sd for sd in noise_sd]
        return cls(problem, blurs, shared, noise_sd, 1.0, law, power, parts, None)

    @property
    def noise_found(self) -> list[float]:
        """Standard deviation of each registered view's noise."""
        return [math.sqrt(self.scale) * sd for sd in self.noise_sd]

    @property
    def is_compressed(self) -> bool:
        """Whether noise rises with contrast, as that of compression does."""
        return self.law is not None and self.law.by_contrast > 0

    def of_tile(self, tile: Tile) -> tuple[Part, Equalised, Image | None]:
        """Return a tile as a part of the frame, its views whitened at every candidate, and their energy if known."""
        settings, registered = self.problem.settings, self.problem.registered
        if len(self.tiles) > 1:
            number = self.tiles.index(tile)
            share, words = number / len(self.tiles), f"equalising blur, tile {number + 1} of {len(self.tiles)}"
            settings.progress(0.4 + 0.5 * share, words)
        views = registered if self.whole is not None else tile.of(registered)
        part = Part(views, tile.inward(registered.shape), settings.false_alarm, self.problem.search, self.is_compressed)
        if self.whole is not None:
            whole, self.whole = self.whole, None
            return part, *whole
        equalised = equalise(
            views.images,
            self.blurs,
            self.noise_sd,
            window=settings.window,
            shared=self.shared,
            power=self.power,
            shares=views.shares,
        )
        if self.law is not None:
            equalised.divide(uneven_noise(self.law, views))
        return part, equalised, None


def _brightness(views: RegisteredViews) -> Image:
    """Return the brightness of registered views, smoothed to remove noise (H x W)."""
    mean: Image = np.mean(views.images, axis=0, dtype=np.float32)
    return np.asarray(smoothed(mean, BRIGHTNESS_SD), np.float32)


def _brightness_of_noise(registered: RegisteredViews) -> float:
    """Mean brightness of the part in which noise is estimated."""
    part = registered.most_textured_crop(NOISE_SIDE)
    return float(np.mean([image[part.usable].mean() for image in part.images])) if part.usable.any() else 0.0


def _local_contrast(views: RegisteredViews) -> Image:
    """Return the local variance of registered views, averaged over views (H x W)."""
    total = np.zeros(views.shape, np.float32)
    for image in views.images:
        mean = smoothed(image, CONTRAST_SD)
        total += smoothed((image - mean) ** 2, CONTRAST_SD)
    return np.asarray(total / len(views.images), np.float32)


def uneven_noise(law: NoiseLaw, views: RegisteredViews) -> Image:
    """Return the noise of each pixel (H x W), relative to that estimated for the views."""
    return np.sqrt(law.variance(_brightness(views), _local_contrast(views))).astype(np.float32)


def _even_out(
    equalised: Equalised, part: Part, at: float | None, one_waveband: bool
) -> tuple[NoiseLaw | None, Nodes, Image]:
    """Equalise noise that rises with brightness or contrast, in place; return the law, depth and energy.

    At brightness `at` noise is as assumed. None: noise is given, and alike in bright and in dark places. Photons of
    different wavebands, with textures of their own, are not compared.
    """
    weight, views, step = part.usable(equalised).astype(np.float32), part.views, equalised.step

    def read() -> tuple[Nodes, Image]:  # every other node
        energy = equalised.energy(weight)
        mean, support = equalised.averages(energy, weight)
        return equalised.minima(mean[:, ::2, ::2], support[::2, ::2]), energy

    def at_nodes(image: Image) -> FloatArray:
        return block_mean(image, step)[::2, ::2]

    (nodes, energy), law = read(), None
    if not one_waveband:
        return None, nodes, energy
    image, contrast = _brightness(views), _local_contrast(views)
    bright, varied, divided = at_nodes(image), at_nodes(contrast), np.ones_like(image)
    brightness = float(image.mean()) if at is None else at
    for _ in range(EVENING_ROUNDS):
        # Where noise is less than assumed, depth is wrong and more is left of the views: the law mends both.
        variance = nodes.misfit * (1 if law is None else law.variance(bright, varied))
        some = nodes.with_texture(nodes.is_supported)
        found = noise_law(variance[some], bright[some], varied[some], brightness, level_known=at is None)
        if found is None or (law is not None and _alike(found, law)):
            break
        noise_sd = np.sqrt(found.variance(image, contrast)).astype(np.float32)
        equalised.divide(noise_sd / divided)
        law, divided, (nodes, energy) = found, noise_sd, read()
    return law, nodes, energy


def _alike(one: NoiseLaw, other: NoiseLaw) -> bool:
    change = abs(one.by_contrast - other.by_contrast)
    return abs(one.share - other.share) < SHARE_SETTLED and change <= CONTRAST_SETTLED * other.by_contrast
