"""Maximum likelihood by equalisation: the vergence at which one sharp scene explains every view.

The whole images are filtered, for each candidate vergence, onto the complement of the views' transfers, and the squares
are averaged in a window: minus twice the log likelihood with the scene unknown, over the noise a chi-square
(`docs/report/method.md`). Filtering whole images, never patches, leaves no window leakage and so no bias (Pentland 1987
asks for patches that trail off smoothly; even those are biased). The filters' family is mostly of low rank: a few
filtered images then give the cost of every candidate (`residuals`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, stats

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth import numerics
from focalgradient.depth.equalise.residuals import (
    BAND,
    Residuals,
    lower_quartile,
    mixed_residuals,
    quartile_by_chance,
    whitened_filters,
)
from focalgradient.depth.filters import (
    Frequencies,
    Image,
    Spectra,
    independent_samples,
    mean_in_squares,
    natural_levels,
    natural_power,
)
from focalgradient.depth.planes import SMOOTH, STEEP, Growth, grow_planes
from focalgradient.depth.read import EvenCoordinate, read_minima, summed_levels
from focalgradient.depth.search import Blurs
from focalgradient.depth.validity import MIN_SUPPORT
from focalgradient.parallel import linear_algebra_on_one_thread

__all__ = [
    "Equalised",
    "Filters",
    "Nodes",
    "ResidualStatistics",
    "SharedPower",
    "assumed_sd",
    "comparing_filters",
    "equalise",
    "scene_power",
]

MIN_NOISE_VARIANCE = 1e-4
"""Minimum estimated noise variance relative to the assumed one: with noiseless views a parabola may lie below 0."""

SUPPORTED, FEW = 0.5, 0.02
"""Minimum proportion of a node's window that must be usable for it to count in statistics of the frame; and proportion
of the nodes with texture up to which all count. Chosen by hand."""

RANGE_SDS = 2.0
"""Distance of a plane of depth beyond an end of the search range, in standard deviations, above which it is outside: a
one-sided test at 2.5 %."""

MIN_JUMP = 0.5
"""Minimum difference of blur radius, in pixels of the widest view, at a large depth discontinuity. Chosen on
`MADE_WITH` of `benchmarks/depth_at_outlines.py`."""

Filters = tuple[list[NDArray[Any]], NDArray[Any]]
"""Filters (n x L x F) of each comparison, and the amplitude of wavebands' independent textures, m x n x L x F."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedPower:
    """Texture that views in wavebands share: view i shows ``gain[i]`` x the first waveband's texture, and another.

    This other texture is independent of the first waveband's, common to the views in one waveband, and as natural, of
    ``independent[waveband]`` times its power. It is uninformative about depth, and is treated as noise.
    """

    waveband: NDArray[np.intp]  # of each view; the first view's is 0
    gain: FloatArray  # of each view
    independent: FloatArray  # of each waveband; the first's is 0
    least_sd: FloatArray  # of each view's noise: the least that filters assume

    def noises(self, transfer: NDArray[Any], power: FloatArray) -> NDArray[Any]:
        """Amplitude of each waveband's independent texture in each view (m x n x L x F), the first waveband left out.

        `transfer` is each view's (n x L x F), `power` that of the shared texture (F).
        """
        mine = self.waveband == np.arange(1, len(self.independent))[:, None]
        scale = np.sqrt(self.independent[1:, None] * power).astype(transfer.real.dtype)
        return np.asarray(mine[:, :, None, None] * scale[:, None, None, :] * transfer)


@dataclass(frozen=True, slots=True)
class Nodes:
    """Estimates on a coarse grid of nodes, one for each block of `step` pixels."""

    level: FloatArray  # fractional candidate level, h x w
    sd: FloatArray  # in levels
    misfit: FloatArray  # mean squared residual over what noise explains: 1 where the views agree
    texture: FloatArray  # power that is informative about depth, over the noise in its band
    unambiguous: Mask  # no secondary minimum fits about as well
    inside: Mask  # the best level is not merely the last one searched
    support: FloatArray  # share of the window that could be used
    curved_by_depth: Mask  # the residual's change by depth, not the residual, curves the cost

    @property
    def is_supported(self) -> Mask:
        """Return the nodes of whose window half or more could be used."""
        return self.support > SUPPORTED

    @property
    def has_texture(self) -> Mask:
        """Return the supported nodes with more texture than noise."""
        return self.is_supported & (self.texture >= 1)

    def with_texture(self, among: Mask) -> Mask:
        """Return the nodes with texture `among` some (h x w); all of these where hardly any has."""
        textured = among & (self.texture >= 1)
        return textured if textured.mean() > FEW else among

    @property
    def is_textured(self) -> Mask:
        """Return the usable nodes with more texture than noise whose depth is unambiguous and in the searched range."""
        return self.unambiguous & self.inside & (self.texture >= 1) & (self.support >= MIN_SUPPORT)

    def part(self, rows: slice, columns: slice) -> Nodes:
        """Return the nodes of these rows and columns."""
        return Nodes(*(np.ascontiguousarray(getattr(self, name)[rows, columns]) for name in self.__slots__))


@dataclass(frozen=True, slots=True)
class ResidualStatistics:
    """Residual at each pixel's own level (H x W): sums over the comparisons of r^2, r r' and r'^2."""

    level: Image
    rest: Image
    cross: Image
    slope: Image


@dataclass(frozen=True, slots=True)
class Equalised:
    """Whitened residuals of the views at every candidate level."""

    residuals: list[Residuals]
    step: int
    window: float
    change: FloatArray  # L: what the noise's own change by level would add to the residual's variance
    even: EvenCoordinate
    summed: NDArray[np.intp]  # M: the levels at which residuals are summed
    weights: Image  # L x M: with which all levels follow from these
    radii: FloatArray  # n x L: each view's blur radius in pixels
    limited: tuple[bool, bool] = (False, False)  # whether depth may lie beyond the first, and the last level
    scale: float = 1.0  # noise variance in units of the one assumed
    compressed: bool = False  # whether noise rises with contrast in views that show blocks of JPEG

    @property
    def levels(self) -> int:
        """Number of candidate levels."""
        return len(self.weights)

    @property
    def noise(self) -> FloatArray:
        """Variance that noise leaves of the residuals at each level (L)."""
        return np.asarray(self.scale * np.sum([r.noise for r in self.residuals], axis=0))

    @property
    def noise_slope(self) -> FloatArray:
        """What noise of the variance assumed adds to the variance of the score, per level^2, at each level (L)."""
        return np.asarray(np.sum([r.noise_slope for r in self.residuals], axis=0))

    @property
    def noise_derivative(self) -> FloatArray:
        """Variance of the residuals' derivative by level, from noise, at each level (L)."""
        return np.asarray(self.scale * np.sum([r.noise_derivative for r in self.residuals], axis=0))

    @property
    def levels_per_pixel(self) -> float:
        """Number of levels per pixel of blur radius in the most blurred view."""
        return float(1 / np.abs(np.diff(self.radii, axis=1)).max())

    def jump_gap(self) -> float:
        """Return the number of levels by which depth differs at a jump."""
        return MIN_JUMP * self.levels_per_pixel

    def zone_reach(self) -> int:
        """Return the distance in pixels from a jump within which depth in a window may be due to it."""
        return int(2 * self.radii.max() + 3 * self.window)

    def blur(self, level: FloatArray) -> FloatArray:
        """Return the blur radius in pixels of the most blurred view at each `level`."""
        return np.interp(level, np.arange(self.levels), self.radii.max(axis=0))

    def window_size(self) -> float:
        """Return the effective number of pixels of the window: 1 / sum of its squared weights."""
        return 4 * np.pi * (self.window**2 + self.step**2 / 12)

    def part(self, rows: slice, columns: slice) -> Equalised:
        """Return the residuals of these rows and columns of pixels, without a copy of them."""
        return replace(self, residuals=[replace(one, images=one.images[:, rows, columns]) for one in self.residuals])

    def without_images(self) -> Equalised:
        """Return what all parts of a frame share, which holds no image."""
        return replace(self, residuals=[replace(one, images=one.images[:, :0, :0].copy()) for one in self.residuals])

    def in_windows(self, window: float) -> Equalised:
        """Return the same residuals, averaged in windows of another size at their own nodes."""
        return replace(self, window=window, step=numerics.step_of(window))

    def divide(self, noise_sd: Image) -> None:
        """Divide the residuals, in place, by the noise of each pixel over the one assumed (H x W)."""
        for residual in self.residuals:
            np.divide(residual.images, noise_sd, out=residual.images)

    def reach(self, nodes: Nodes) -> FloatArray:
        """Return the reach of window and blur about each node, in nodes (h x w)."""
        return (self.window + self.blur(nodes.level)) / self.step

    def read(self, weight: Image) -> Nodes:
        """Return the depth of least cost at each node, over the pixels of `weight` (H x W, 0 or 1)."""
        return self.minima(*self.averages(self.energy(weight), weight))

    def energy(self, weight: Image) -> Image:
        """Return the squared residuals of the M `candidates`, summed over each node's block (M x h x w)."""
        energy = self.residuals[0].energy(weight, self.step, self.summed)
        for residual in self.residuals[1:]:
            energy += residual.energy(weight, self.step, self.summed)
        return energy

    def sum_again(self, energy: Image, weight: Image, changed: Mask) -> None:
        """Update `energy` in place to `weight`, which differs at the pixels of `changed` (H x W) only."""
        blocks = numerics.block_sum(changed.astype(np.float32), self.step) > 0
        levels = self.summed
        energy[:, blocks] = sum(r.energy_of_blocks(blocks, weight, self.step, levels) for r in self.residuals)

    def averages(self, energy: Image, weight: Image) -> tuple[Image, FloatArray]:
        """Mean squared residual of the candidates in each node's window (M x h x w), and the window's usable share."""
        count = numerics.gather(numerics.block_sum(weight, self.step).astype(np.float32)[None], self.window / self.step)
        full = 2 * np.pi * self.window**2
        mean = numerics.gather(energy, self.window / self.step)
        mean /= np.maximum(count, 1e-6 * full)
        return mean, (count[0] / full).astype(float)

    def minima(self, mean: Image, support: FloatArray) -> Nodes:
        """Return the depth of least cost at each node, of what `averages` returns."""
        expected, slope = self.noise, self.noise_slope
        # Noise that is blurred with the scene changes by level; the filters take that in, the images do not.
        more = self.scale * integrate.cumulative_trapezoid(self.change, initial=0)
        size = np.maximum(self.window_size() * support.ravel(), 1e-3)
        by_node, weights = mean.reshape(len(mean), -1).T, self.weights.T
        values, flags = np.empty((4, size.size)), np.empty((2, size.size), np.bool_)
        each = max(1, BAND // self.levels)
        for first in range(0, size.size, each):  # some nodes at a time, for memory
            some = slice(first, first + each)
            with linear_algebra_on_one_thread:
                every = np.matmul(by_node[some], weights)
            every += more.astype(np.float32)
            values[:, some], flags[:, some] = read_minima(every, expected, slope, self.scale, size[some])
        level, sd, misfit, texture = values.reshape(4, *support.shape)
        # That also adds to the least cost, but is not misfit, of which a little always stays.
        added = np.interp(level, np.arange(self.levels), more / expected)
        misfit = np.maximum(misfit - added, np.minimum(misfit, 0.01))
        unambiguous, inside = flags.reshape(2, *support.shape)
        return Nodes(level, sd, misfit, texture, unambiguous, inside, support, np.ones_like(inside))

    def noise_found(self, nodes: Nodes) -> float:
        """Estimate the noise variance, relative to that assumed, from the best-fitting quarter of the textured nodes.

        Where depth jumps, or the views contradict each other, the misfit is not the noise's; chi-square gives how
        well the best quarter would fit by chance alone.
        """
        gains = [r.gains.sum(axis=0) for r in self.residuals]
        mean, square = (sum((g**power) @ self.residuals[0].measure for g in gains) for power in (1, 2))
        freedom = np.interp(nodes.level, np.arange(self.levels), mean**2 / square) * self.window_size() * nodes.support
        some = nodes.with_texture(nodes.is_supported)
        if some.mean() <= FEW:
            return 1.0
        return max(MIN_NOISE_VARIANCE, lower_quartile(nodes.misfit[some] / quartile_by_chance(freedom[some])))

    def evaluate(self, nodes: Nodes) -> ResidualStatistics:
        """Return the residual statistics of each pixel at the depth estimated around it."""
        return self.evaluate_images(nodes)[0]

    def evaluate_images(self, nodes: Nodes) -> tuple[ResidualStatistics, list[tuple[Image, Image]]]:
        """Evaluate as `evaluate` does; also return each comparison's residual (H x W) and its derivative by level."""
        shape = self.residuals[0].images.shape[1:]
        level = self.to_pixels(nodes.level, nodes.sd, shape).astype(np.float32)
        images = [residual.at(level) for residual in self.residuals]
        return ResidualStatistics(level, *numerics.sum_products(images)), images

    def evaluate_to_refine(self, nodes: Nodes, local: ResidualStatistics) -> ResidualStatistics:
        """Re-evaluate `local` where depths lie so near the focus that residuals do not change with depth."""
        level = self.even.changing(nodes.level)
        return self.evaluate(replace(nodes, level=level)) if (level != nodes.level).any() else local

    def refine(self, nodes: Nodes, local: ResidualStatistics, weight: Image, growth: Growth = SMOOTH) -> Nodes:
        """Fit a local plane through the levels that pixels give, so that depth may slope within the window.

        A window estimates the depth where its texture happens to lie, not at its middle. Linearised at the depth of
        `local`, pixel x gives the level level(x) - r/r' with the weight r'^2; a plane fitted to that gives the level at
        the node, and its sandwich variance the sd, uneven texture included. All this in the coordinate by which
        residuals change evenly.
        """
        # What noise alone puts into r r' on average is known, and taken out.
        drift = (sum(np.gradient(r.noise) for r in self.residuals) - self.change) * (self.scale / 2)
        rate, start = self.even.rate_at_pixels(local.level), self.even.at_pixels(local.level)
        score, slope = (numerics.at_levels(drift, local.level) - local.cross) / rate, local.slope / rate**2
        # Noise in r'^2 makes the fit look more certain than it is; misfit adds to noise.
        noise_sd = np.sqrt(self.scale * np.maximum(1, nodes.misfit)) * (1 + 1 / np.maximum(nodes.texture, 0.5))
        # The noise's part of r'^2 is uninformative: on blank paper near the focus, whose levels stray to one side, it
        # would pull depth that way.
        share = np.maximum(nodes.texture, 0.01) / (1 + nodes.texture)
        fitted, sd = grow_planes(
            share * numerics.block_sum(weight * slope, self.step),
            share * numerics.block_sum(weight * (score + slope * start), self.step),
            self.even.at(nodes.level),
            noise_sd,
            [self.window * g / self.step for g in growth.windows],
            STEEP,
            growth.separate,
        )
        inside = nodes.inside & ~self._leaves_range(fitted, sd)
        fitted, sd = self.even.levels(fitted, sd)
        # Where blur vanishes the cost is not a parabola: its own width counts.
        reach = 3 + 3 * nodes.sd
        fitted = np.clip(nodes.level + np.clip(fitted - nodes.level, -reach, reach), 0, self.levels - 1)
        sd = np.maximum(sd, np.minimum(nodes.sd / growth.windows[-1], 2 * sd))
        return replace(nodes, level=fitted, sd=sd, inside=inside)

    def _leaves_range(self, value: FloatArray, sd: FloatArray) -> Mask:
        """Return whether a `value` of the even coordinate lies beyond an end of the range that depth may pass."""
        first, last = self.even.value[[0, -1]]
        below, above = self.limited
        return np.asarray((below & (value < first - RANGE_SDS * sd)) | (above & (value > last + RANGE_SDS * sd)))

    def agreement(self, local: ResidualStatistics, side: int, false_alarm: float, tolerance: FloatArray) -> Mask:
        """Test by chi-square whether each pixel's views agree at the depth of `local`, with this false-alarm rate.

        The squared residual is averaged over squares of `side` pixels. They are much smaller than the window in which
        depth is estimated, and have sharp edges, to separate contradicting pixels from their neighbours. The part
        that a slightly different depth would explain is subtracted, and the part that an error of the blur model of
        `tolerance` (L, in levels) would cause.
        """
        rest, cross, slope = (mean_in_squares(image, side) for image in (local.rest, local.cross, local.slope))
        energy = rest - cross**2 / (slope + np.float32(1e-12))
        expected = self.noise
        samples = [independent_samples(r.gains.sum(axis=0) * r.measure, side) for r in self.residuals]
        variance = sum((self.scale * r.noise) ** 2 / count for r, count in zip(self.residuals, samples, strict=True))
        freedom = expected**2 / variance
        limit = np.asarray(expected * stats.chi2.isf(false_alarm, freedom) / freedom)
        forgiven = slope * numerics.at_levels(tolerance**2, local.level)
        return np.asarray(energy - forgiven <= numerics.at_levels(limit, local.level))

    def to_pixels(self, values: FloatArray, sd: FloatArray, shape: tuple[int, int]) -> FloatArray:
        """Interpolate values at nodes to the pixels between them."""
        return numerics.interpolate_nodes(values, sd, self.step, shape)

    def to_blocks(self, values: Mask, shape: tuple[int, int]) -> Mask:
        """Repeat values at nodes over all pixels of their blocks."""
        return numerics.repeat_blocks(values, self.step, shape)


def equalise(
    images: Sequence[Image] | Spectra,
    blurs: Blurs,
    noise_sd: Sequence[float],
    *,
    window: float,
    shared: SharedPower | None = None,
    power: FloatArray | None = None,
    filters: Filters | None = None,
    shares: NDArray[np.floating] | None = None,
    interpolate: bool = True,
) -> Equalised:
    """Compare whole images at every candidate level.

    Parameters
    ----------
    images
        The views on one grid and at one exposure, each H x W; or their spectra, mirrored as far as `Blurs.reach`.
    blurs
        Each view's blur at each candidate level.
    noise_sd
        Standard deviation of each view's noise, in the images' units.
    window
        Standard deviation of the averaging window in pixels.
    shared
        What the views share where they are in different wavebands.
    power
        Of the sharp scene at the blurs' frequencies, in the images' unit squared; estimated from the images where it is
        not given.
    filters
        What `comparing_filters` gives, where that is known.
    shares
        Of each of the blurs of which that at each pixel is a mixture (`Blurs.parts`), C x H x W.
    interpolate
        Sum residuals at some of the candidates only and interpolate between them, which is too rough for the power of
        noise.
    """
    assumed = assumed_sd(noise_sd, shared)
    spectra = (images if isinstance(images, Spectra) else Spectra.of(images, blurs.reach)).over(assumed)
    frequencies = blurs.frequencies
    if filters is None:
        power = scene_power(spectra, assumed, frequencies) if power is None else power
        filters = comparing_filters(blurs, noise_sd, power, shared)
    rows, own = filters
    known = None if shared is None else (np.asarray(noise_sd) / assumed) ** 2
    with linear_algebra_on_one_thread:
        residuals = [Residuals.of(spectra, one, own if len(own) else None, frequencies, variance=known) for one in rows]
    if shares is not None and blurs.parts:
        parts = [
            equalise(images, one, noise_sd, window=window, shared=shared, power=power, interpolate=False)
            for one in blurs.parts
        ]
        residuals = [mixed_residuals(same, shares) for same in zip(*(one.residuals for one in parts), strict=True)]
    change = np.sum([residual.change for residual in residuals], axis=0)
    bend = np.sqrt(np.sum([residual.bend for residual in residuals], axis=0))
    levels, weights = np.arange(len(bend)), np.eye(len(bend), dtype=np.float32)
    # Filters for different wavebands assume more noise than there may be, over which their residuals hardly bend.
    if interpolate and shared is None:
        levels, weights = summed_levels(bend)
    return Equalised(
        residuals,
        numerics.step_of(window),
        window,
        change,
        EvenCoordinate.of(blurs.radius, blurs.even),
        levels,
        weights,
        blurs.radius,
        blurs.limited,
    )


def assumed_sd(noise_sd: Sequence[float] | FloatArray, shared: SharedPower | None) -> FloatArray:
    """Standard deviation of each view's noise that filters assume: at least `SharedPower.least_sd`."""
    return np.asarray(noise_sd, float) if shared is None else np.maximum(noise_sd, shared.least_sd)


def comparing_filters(
    blurs: Blurs, noise_sd: Sequence[float] | FloatArray, power: FloatArray, shared: SharedPower | None
) -> Filters:
    """Return the noise-whitened filters (n x L x F each) that cancel a scene of `power` at each level.

    The images are to be over the noise that is assumed (`assumed_sd`). Also returns the amplitude of wavebands'
    independent textures over it, wavebands x n x L x F.
    """
    kind = blurs.transfer.real.dtype
    view_weight = blurs.pass_band
    transfers = view_weight * blurs.transfer / assumed_sd(noise_sd, shared).astype(kind)[:, None, None]
    own: NDArray[Any] = np.zeros((0, *transfers.shape), transfers.dtype)
    if shared is not None:
        own = shared.noises(transfers, power)
        transfers *= shared.gain[:, None, None].astype(kind)
    # A frequency whose signal has q times the power of the noise is best given the weight q / (1 + q). The lowest
    # depend little on blur and much on uneven light, and their filters reach far over the image.
    lowest = 1 / np.maximum(16, 6 * blurs.radius.max(axis=0))
    band = (1 - np.exp(-((blurs.frequencies.radius / lowest[:, None]) ** 2))) * blurs.frequencies.fine_pass()
    # The sharpest view at the depth where any is: there its transfer keeps its sign.
    start = int(np.argmin(blurs.radius.min(axis=0)))
    order = np.argsort(blurs.radius[:, start], kind="stable")
    filters = whitened_filters(transfers[order], own[:, order], view_weight[order], band, power, start)
    return [one[np.argsort(order)] for one in filters], own


def scene_power(spectra: Spectra, noise_sd: Sequence[float] | FloatArray, frequencies: Frequencies) -> FloatArray:
    """Return the power of a natural sharp scene at the `frequencies`, in the images' units.

    Its level is that of the view with most. `spectra` are those of the images over their noise.
    """
    share, power = spectra.measure_and_power()
    return natural_power(float(np.max(natural_levels(power, share > 0) * np.square(noise_sd))), frequencies)
