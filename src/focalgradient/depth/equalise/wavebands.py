"""Views in different wavebands: how much of a texture they share, estimated from the views themselves.

Red and blue light do not show quite the same texture. View i is taken to show gain x the first waveband's texture, and
in each other waveband an independent texture on top, as natural (`SharedPower` in
`focalgradient.depth.equalise.likelihood`). The gain is fitted with the depth of every place left free; the power of
the independent texture, like noise, from the residual. An error of the gain moves depth everywhere alike: that
joins the depth's uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from focalgradient.arrays import FloatArray
from focalgradient.depth import numerics
from focalgradient.depth.equalise.likelihood import (
    Equalised,
    Nodes,
    SharedPower,
    assumed_sd,
    comparing_filters,
    equalise,
    scene_power,
)
from focalgradient.depth.equalise.residuals import Residuals, mixed_residuals, noise_passed
from focalgradient.depth.filters import Image, Spectra
from focalgradient.depth.noise import LOG_SETTLED, noise_from_spectrum, storage
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Blurs

__all__ = ["BandGains", "common_error", "estimate_band_gains"]

MAX_ROUNDS, MAX_STEPS = 2, 3
"""Maximum number of noise estimates, and of steps of the gain in each. Chosen by hand."""

GAIN_STEP = 0.05
"""Relative change of the gain in its numerical derivative: the residual is in error by 2.5e-5 of the noise."""

CONTRADICTS = 2.0
"""Misfit, relative to that of the better part of the frame or to noise, above which a place is excluded. Chosen by
hand."""

CONTRAST_NOISE = 1e-3
"""Minimum noise relative to contrast: texture shared by wavebands is not known more precisely. Without it, rounding
errors of the processor decide the rejection of noiseless views."""

LITTLE = 1e-3
"""Initial power of a waveband's independent texture relative to the shared one: small, to be estimated. Chosen by hand.
"""

WIDER = 1.7
"""Ratio of actual to nominal standard error of gains on walls (`benchmarks/coverage_of_walls.py`): chance correlations
of two textures extend over their coarse detail, beyond the windows."""

LEAST_KNOWN = 3.0
"""Minimum gain in its standard deviations; below it the wavebands share no texture that can be compared."""

COARSE_LEVELS = 4
"""Step in levels before the final refinement of the gains; such steps give an error of a few per cent."""

SIDEWAYS = 1e-2
"""Maximum energy error, in units of the noise variance, of the derivative of residuals with respect to the gain: with a
gain in error by 5 % it contributes 2.5e-5."""

FLOOR = 3e-2
"""Minimum noise assumed by the filters, relative to the image's standard deviation: less would resolve differences
finer than the spacing of levels. Residuals are compared with the actual noise."""


@dataclass(frozen=True, slots=True, eq=False)
class BandGains:
    """Texture that views in different wavebands share, the noise of each, and the uncertainty of the gains."""

    shared: SharedPower
    noise_sd: list[float]
    gain_sd: FloatArray  # of each waveband's gain, over the gain; the first's is 0
    power: FloatArray  # of the sharp scene, at the blurs' frequencies
    local_sd: FloatArray  # by which each waveband's gain differs from place to place, over the gain
    coloured: bool = False  # whether the gains are those of a texture in several colours, known beforehand

    @property
    def assumed_sd(self) -> FloatArray:
        """Standard deviation of each view's noise that filters assume."""
        return assumed_sd(self.noise_sd, self.shared)

    @property
    def comparable(self) -> bool:
        """Whether all wavebands are known to share texture."""
        return bool(np.all(self.gain_sd * LEAST_KNOWN < 1))

    def stated(self, wavebands: Sequence[str]) -> dict[str, Any]:
        """Return details for a map: each other waveband's contrast relative to, and correlation with, the first."""
        names = list(dict.fromkeys(wavebands))
        gain = {name: float(self.shared.gain[wavebands.index(name)]) for name in names[1:]}
        parts = zip(names[1:], self.shared.independent[1:], self.gain_sd[1:], strict=True)
        return {
            "shared_texture": {
                name: {
                    "contrast": float(np.hypot(gain[name], np.sqrt(own))),
                    "correlation": float(gain[name] / np.hypot(gain[name], np.sqrt(own))),
                    "gain": gain[name],
                    "gain_sd": float(sd * gain[name]),
                }
                for name, own, sd in parts
            }
        }


def estimate_band_gains(
    wavebands: Sequence[str],
    part: RegisteredViews,
    blurs: Blurs,
    window: float,
    noise_sd: Sequence[float] | None,
    known: tuple[FloatArray, FloatArray] | None = None,
) -> BandGains:
    """Estimate what views in `wavebands` share, from a `part` of them; their noise too where it is not given.

    `known` are the gains of the views that are expected, but for the blurs' contrast at the depth that is found; and
    the standard deviation of their logarithms.
    """
    names = list(dict.fromkeys(wavebands))
    band = np.array([names.index(name) for name in wavebands])
    coarse = blurs.every(COARSE_LEVELS)
    # Blur carries in light from beyond the part: its rim is left out.
    rim = min(part.shape) // 4
    weight = np.zeros(part.shape, np.float32)
    weight[rim:-rim, rim:-rim] = part.usable[rim:-rim, rim:-rim]
    floors = np.array([FLOOR * float(image.std()) for image in part.images])
    # The finest detail is at least as strong as the noise. Cones of one class are alike: one noise for each waveband.
    finest = np.array([noise_from_spectrum(image) for image in part.images])
    least = np.array([max(storage(image), CONTRAST_NOISE * float(image.std())) for image in part.images])
    most = np.maximum(least, [finest[band == one].min() for one in band])
    sd = most if noise_sd is None else np.asarray(noise_sd, float)
    gain, prior_sd = (np.ones(len(wavebands)), np.full(len(wavebands), np.inf)) if known is None else known
    start, expected = gain, gain
    little = np.where(np.arange(len(names)) > 0, LITTLE, 0.0)
    gain_sd, local_sd = np.zeros(len(names)), np.zeros(len(names))

    spectra = part.spectra(blurs.reach)
    power = scene_power(Spectra.of(part.images, 16), np.ones(len(sd)), blurs.frequencies)

    def compare(blurs: Blurs, own: FloatArray) -> tuple[Equalised, Nodes]:
        shared = SharedPower(band, gain, own, floors)
        filters = comparing_filters(blurs, sd, power, shared)
        equalised = equalise(
            spectra, blurs, sd.tolist(), window=window, shared=shared, power=power, filters=filters, shares=part.shares
        )
        return equalised, equalised.read(weight)

    def improve(blurs: Blurs, own: FloatArray) -> float:
        """Improve the gains, by filters that know them; return the greatest change of a logarithm."""
        nonlocal gain
        equalised, nodes = compare(blurs, own)
        moved, now = 0.0, BandGains(SharedPower(band, gain, own, floors), sd.tolist(), gain_sd, power, local_sd)
        for number in range(1, len(names)):
            shown = _gain_change(equalised, nodes, spectra, now, number, blurs, weight, part.shares)
            change, sd_here, local_sd[number] = shown
            first = int(np.argmax(band == number))
            before = np.log(expected[first] * _contrast_at(blurs, nodes, first) / gain[first])
            change, gain_sd[number] = _with_prior(change, sd_here, float(before), float(prior_sd[first]))
            gain = gain * np.where(band == number, np.exp(np.clip(change, -0.3, 0.3)), 1)
            moved = max(moved, abs(change))
        return moved

    for _ in range(MAX_ROUNDS):
        # Independent texture is estimated with filters that assume little of it: were more assumed, depth would give
        # way to it, and more be found.
        equalised, nodes = compare(coarse, little)
        # Outlines that hide what lies behind contradict every depth, in one waveband as in another: they are left out.
        usual = max(1.0, float(np.quantile(nodes.misfit[nodes.support > 0.2], 0.25)))  # 1 is noise as stated
        weight = weight * equalised.to_blocks(nodes.misfit <= CONTRADICTS * usual, part.shape)
        taper = ndimage.gaussian_filter(weight, window / 2)
        found = _noise_by_source(equalised, equalised.evaluate(nodes).level, taper, len(sd))
        own = np.concatenate([[0.0], np.clip(LITTLE * found[1:], 1e-6, 2)])
        if noise_sd is None:
            sd = np.clip(sd * np.sqrt(found[0]), least, most)
        for _ in range(MAX_STEPS):
            if improve(coarse, own) < LOG_SETTLED:
                break
        if np.abs(np.log(gain / start)).max() < LOG_SETTLED:
            break  # the assumed gain was accurate enough for this estimate
    improve(blurs, own)  # levels far apart bias the gain by some per cent
    coloured = bool(np.isfinite(prior_sd).all())
    return BandGains(SharedPower(band, gain, own, floors), sd.tolist(), gain_sd, power, coloured * local_sd, coloured)


def _noise_by_source(equalised: Equalised, level: Image, taper: Image, views: int) -> FloatArray:
    """Estimate the noise variance of all views, and of each waveband's independent texture, relative to those assumed.

    It is estimated from the spectrum of what equalising leaves at each pixel's `level`, weighted by a `taper` (H x W).
    Where a view is much blurred the residual's fine detail is that view's own noise, its coarse detail all views'.
    """
    share = np.bincount(np.rint(level).astype(np.intp).ravel(), minlength=equalised.levels) / level.size
    found, shaped = [], []
    for residual in equalised.residuals:
        counts, power = Spectra.of([residual.at(level)[0] * taper], 0).measure_and_power()
        some = counts > 0
        found.append(power[0, some] / np.mean(taper**2))
        shaped.append(np.einsum("nlf,l->fn", residual.gains[:, :, some], share))
    powers, model = np.concatenate(found), np.concatenate(shaped)
    model = np.concatenate([model[:, :views].sum(axis=1, keepdims=True), model[:, views:]], axis=1)
    count = model.shape[1]
    variance = np.full(count, np.median(powers / np.maximum(model.sum(axis=1), 1e-9)))
    for _ in range(4):
        # Power is known to a share of itself; what the spectrum leaves open goes by equal parts.
        weight = 1 / (model @ variance + 0.02 * variance.mean())
        alike = (np.eye(count) - 1 / count) * 2 / variance.mean()
        rows = np.vstack([model * weight[:, None], alike])
        variance, _ = optimize.nnls(rows, np.concatenate([powers * weight, np.zeros(count)]))
        variance = np.clip(variance, 0.01 * variance.max(), None)
    return variance


def _contrast_at(blurs: Blurs, nodes: Nodes, view: int) -> float:
    """Return the contrast stated for a view at the depth of the nodes: geometric mean; 1 if not stated."""
    if blurs.contrast is None:
        return 1.0
    at = np.interp(nodes.level, np.arange(blurs.contrast.shape[1]), np.log(blurs.contrast[view]))
    weight = nodes.is_textured.astype(float)
    return float(np.exp(np.average(at, weights=weight))) if weight.any() else 1.0


def _with_prior(change: float, sd: float, expected: float, prior_sd: float) -> tuple[float, float]:
    """Combine a change and its standard deviation, as estimated from views, with the one `expected`.

    Both rest on the same textures, and are wrong by what these have in common by chance: errors are taken to be alike.

    >>> change, sd = _with_prior(0.2, 0.3, 0.0, 0.3)
    >>> round(change, 2), round(sd, 2)
    (0.1, 0.3)
    """
    if not np.isfinite(prior_sd):
        return change, sd
    share = prior_sd**2 / max(prior_sd**2 + sd**2, 1e-12)
    return share * change + (1 - share) * expected, share * sd + (1 - share) * prior_sd


def _gain_change(
    equalised: Equalised,
    nodes: Nodes,
    spectra: Spectra,
    now: BandGains,
    number: int,
    blurs: Blurs,
    weight: Image,
    shares: NDArray[np.floating] | None,
) -> tuple[float, float, float]:
    """Estimate the change of the log gain of waveband `number`, with depth free at every node.

    Also its standard deviation, and that of the change from place to place. The gains are as they are `now`.
    """
    assumed = now.assumed_sd
    over_noise, known_noise = spectra.over(assumed), (np.array(now.noise_sd) / assumed) ** 2
    # By filters of the gain raised by a share.
    raised = comparing_filters(blurs, now.noise_sd, now.power, _raised(now.shared, number))
    level = equalised.evaluate(nodes).level
    steps = _by_gain(over_noise, now, number, blurs, shares)
    sums = np.zeros((5, *level.shape), np.float32)  # of r'^2, r' g', g'^2, r r' and r g', with g' by the gain
    by_level, by_gain = -equalised.change / 2, np.zeros(equalised.levels)  # what noise alone makes of the last two
    left, noise = np.zeros_like(level), np.zeros(equalised.levels)
    for here, by_step, new in zip(equalised.residuals, steps, raised[0], strict=True):
        rest, slope = here.at(level)
        aside = by_step.at(level)[0]
        sums += np.stack([slope**2, slope * aside, aside**2, rest * slope, rest * aside])
        by_level += np.gradient(here.noise) / 2
        risen = noise_passed(new, raised[1], here.measure_at(blurs.frequencies), known_noise)[1]
        by_gain += (risen - here.noise) / GAIN_STEP / 2
        left, noise = left + rest**2, noise + here.noise
    places = np.arange(equalised.levels)
    # Noise explains at most the whole residual.
    there_is = min(1.0, float((weight * left).sum() / (weight * np.interp(level, places, noise)).sum()))
    sums[3] -= np.interp(level, places, there_is * by_level).astype(np.float32)
    sums[4] -= np.interp(level, places, there_is * by_gain).astype(np.float32)
    blocks = np.stack([numerics.block_sum(weight * image, equalised.step) for image in sums]).astype(np.float32)
    wide = equalised.window / equalised.step
    valid = nodes.is_textured
    slope, both, size, depth, pull = numerics.gather(blocks, wide).astype(float) * valid
    lever = both / np.maximum(slope, 1e-9)
    known = np.where(valid, np.maximum(size - lever * both, 0), 0).ravel()
    if not known.any():
        return 0.0, 0.1, 0.0
    # The median over the nodes, each by what it knows: outlines, where the model fails, pull a mean anywhere.
    each = -(pull - lever * depth).ravel() / np.maximum(known, 1e-9)
    change = numerics.weighted_median(each, known)
    spread = 1.48 * numerics.weighted_median(np.abs(each - change), known)
    overlap = 2 * np.pi * wide**2  # nodes' windows overlap
    independent = max(1.0, known.sum() ** 2 / (known**2).sum() / (2 * overlap))
    sd = WIDER * 1.25 * max(float(np.sqrt(overlap / known.sum())), spread / np.sqrt(independent))
    return change, sd, float(spread)


def _by_gain(
    over_noise: Spectra, now: BandGains, number: int, blurs: Blurs, shares: NDArray[np.floating] | None
) -> list[Residuals]:
    """Return the derivative of each comparison's residual by the log gain of waveband `number`."""
    if shares is not None and blurs.parts:
        parts = [_by_gain(over_noise, now, number, one, None) for one in blurs.parts]
        return [mixed_residuals(same, shares) for same in zip(*parts, strict=True)]
    old, new = (
        comparing_filters(blurs, now.noise_sd, now.power, shared)[0]
        for shared in (now.shared, _raised(now.shared, number))
    )
    return [
        Residuals.of(over_noise, (after - before) / np.float32(GAIN_STEP), None, blurs.frequencies, SIDEWAYS)
        for before, after in zip(old, new, strict=True)
    ]


def _raised(shared: SharedPower, number: int) -> SharedPower:
    return replace(shared, gain=shared.gain * np.where(shared.waveband == number, 1 + GAIN_STEP, 1))


def common_error(gains: BandGains, blurs: Blurs) -> FloatArray:
    """Return the sd of depth due to uncertain and locally varying gains, in levels, at each level.

    For a natural scene at that level: -(r' g') / r'^2, summed over frequency, is how far depth gives way to the gain.
    """
    every = 2  # the shift changes slowly by level
    some = blurs.every(every)
    areas = gains.power * some.frequencies.areas
    scene = some.transfer * gains.shared.gain[:, None, None] / gains.assumed_sd[:, None, None]
    filters, _ = comparing_filters(some, gains.noise_sd, gains.power, gains.shared)
    by_level = [(np.gradient(here, every, axis=1) * scene).sum(axis=0) for here in filters]
    slope = np.sum([np.abs(one) ** 2 @ areas for one in by_level], axis=0)
    slope = np.maximum(slope, 1e-12 * slope.max())
    variance = np.zeros(some.radius.shape[1])
    for number in range(1, len(gains.gain_sd)):
        others, _ = comparing_filters(some, gains.noise_sd, gains.power, _raised(gains.shared, number))
        both = np.zeros_like(variance)
        for here, there, risen in zip(filters, others, by_level, strict=True):
            by_gain = ((there - here) / GAIN_STEP * scene).sum(axis=0)
            both += (risen.conj() * by_gain).real @ areas
        variance += (both / slope * np.hypot(gains.gain_sd[number], gains.local_sd[number])) ** 2
    levels = blurs.radius.shape[1]
    return np.sqrt(np.interp(np.arange(levels), np.arange(0, levels, every), variance))
