"""The split-band test of the blur model: coarse and fine detail, along and across, must give the same depth.

An error of the blur's shape moves depth over whole windows alike, where neither chi-square nor neighbours show it, but
it moves depth from coarse detail one way and from fine detail the other. What the two differ by beyond their noise is
attributed to a model error in proportion to the blur (random effects: DerSimonian & Laird 1986), and adds to the
standard deviation. The test does not see what moves both halves alike, such as a wrong focus or aperture. Split by
direction instead of frequency, it sees blur that differs between directions, as that of a view that moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth import numerics
from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.filters import RADII, Image
from focalgradient.depth.planes import SMOOTH
from focalgradient.depth.validity import LEAST_BLUR, LEAST_NODES, random_effects

__all__ = ["UNLIKE", "DetailHalves", "SplitBand", "join_splits"]

CUTS = (0.25, 0.35)
"""Frequencies at which the band is split, in cycles per blur radius; a single one misses some errors. Chosen on 70
rendered pairs."""

SPLIT_DIRECTIONS = (0.0, np.pi / 4)
"""Directions (rad) that separate detail along from detail across them; a feature at 22.5 degrees from both appears in
either."""

PARTING = 3.0
"""Steepness of the split by direction, in amplitude per cosine of twice the angle. Chosen by hand."""

UNLIKE = 0.03
"""Difference of depth between directions, relative to the blur radius, above which a warning is issued: up to 0.005 for
correct models of walls, slants, steps and spheres, 0.04 to 0.05 for 2 pixels of motion in one view."""

LEAST_RADIUS = 0.8
"""Blur radius in pixels below which the split frequencies stay fixed, as higher ones contain aliased detail only."""

SURROUND = 24
"""Width in pixels of the mirrored surround that prevents filters from wrapping around. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class SplitBand:
    """Error of the blur model, estimated from the difference between depth from coarse and from fine detail."""

    tau: float
    """Standard deviation of the model error, as a share of the blur radius: the largest over all splits."""
    cuts: tuple[float, ...]
    """Frequencies of the cuts, in cycles per pixel."""
    taus: tuple[float, ...]
    """The share from each cut."""
    differences: tuple[float, ...]
    """Depth from coarse detail less depth from fine detail, at each cut, as a mean share of the blur radius."""
    directions: tuple[float, ...]
    """The share from each split by direction, of 0 and of 45 degrees against those across."""
    nodes: int
    """Nodes that it rests on."""

    def warnings(self) -> list[str]:
        """Return the warnings on blur that differs by direction."""
        largest = max(self.directions, default=0.0)
        if largest < UNLIKE:
            return []
        return [
            f"the blur is not alike in all directions: depth from detail along and across differs by {largest:.0%} of "
            "the blur radius, which is part of the standard deviations: the camera or the scene moved during an "
            "exposure (motion blur), the views are turned against each other, or the lens is astigmatic or clips its "
            "pupil off axis (vignetting), as at its largest apertures."
        ]

    def stated(self) -> dict[str, object]:
        """Return the test as a map's details state it."""
        return {
            "tau": self.tau,
            "cuts_cycles_per_px": list(self.cuts),
            "tau_by_cut": list(self.taus),
            "coarse_less_fine": list(self.differences),
            "tau_by_direction": list(self.directions),
            "nodes": self.nodes,
        }


def join_splits(splits: Sequence[SplitBand]) -> SplitBand:
    """Return the model error of a whole frame from those of its tiles, each with the weight of its nodes."""
    some = [split for split in splits if split.taus]
    if len(some) < 2:
        return some[0] if some else splits[0]
    weight = np.array([split.nodes for split in some], float)

    def mean(values: list[tuple[float, ...]]) -> tuple[float, ...]:
        return tuple(float(value) for value in weight @ np.array(values) / weight.sum())

    def root_mean_square(values: list[tuple[float, ...]]) -> tuple[float, ...]:
        return tuple(float(np.sqrt(v)) for v in mean([tuple(one**2 for one in some) for some in values]))

    taus, directions = (root_mean_square([getattr(split, name) for split in some]) for name in ("taus", "directions"))
    return SplitBand(
        max(*taus, *directions),
        mean([split.cuts for split in some]),
        taus,
        mean([split.differences for split in some]),
        directions,
        int(weight.sum()),
    )


@dataclass(frozen=True, slots=True, eq=False)
class DetailHalves:
    """Depth at nodes from either half of the detail, for each way to split it, h x w each."""

    radius: float  # px: blur radius that sets the cuts
    share: FloatArray  # levels: error of depth if the blur erred by its own radius
    is_used: Mask  # nodes that are compared
    differences: list[FloatArray]  # levels: depth from the first half less that from the second
    variances: list[FloatArray]  # levels squared: variance of the difference due to noise

    @classmethod
    def of(
        cls,
        equalised: Equalised,
        nodes: Nodes,
        at_pixels: Sequence[tuple[Image, Image]],
        weight: Image,
        is_trusted: Mask,
    ) -> DetailHalves:
        """Estimate depth from coarse and fine detail, and from detail along and across, at the nodes of `is_trusted`.

        Parameters
        ----------
        equalised
            The views, compared at every level.
        nodes
            Depth as read.
        at_pixels
            For each comparison, the residual image at the level read around each pixel, and its derivative by level.
        weight
            H x W, 0 or 1: the pixels that are used.
        is_trusted
            h x w: nodes whose depth is to be claimed.
        """
        blurs = equalised.blur(nodes.level)
        use = is_trusted & nodes.is_supported
        if use.sum() < LEAST_NODES:  # views contradict the model all over: the rest does not prove it right
            use = nodes.is_textured
        share = np.maximum(LEAST_BLUR, blurs) * equalised.levels_per_pixel
        if use.sum() < LEAST_NODES:
            return cls(LEAST_RADIUS, share, use, [], [])
        radius = max(LEAST_RADIUS, float(np.median(blurs[use])))
        widening = equalised.scale * np.maximum(1, nodes.misfit) * (1 + 1 / np.maximum(nodes.texture, 0.5)) ** 2
        spectra = _spectra(at_pixels)
        rows, columns, _ = _surround(weight.shape)
        down, right = fft.fftfreq(rows)[:, None], fft.fftfreq(columns)
        squared = (down**2 + right**2).astype(np.float32)
        splits = []
        for cut in CUTS:
            coarse = _low_pass(RADII**2, cut / radius)
            splits.append((_low_pass(squared, cut / radius), (coarse, 1 - coarse)))
        even, odd = ((down**2 - right**2).astype(np.float32), (2 * down * right).astype(np.float32))
        even, odd = (image / np.maximum(squared, np.finfo(np.float32).tiny) for image in (-even, odd))
        for angle in SPLIT_DIRECTIONS:  # cosine of twice the angle between a frequency's direction and this one
            cosine = np.float32(np.cos(2 * angle)) * even + np.float32(np.sin(2 * angle)) * odd
            splits.append((_along(cosine), (np.full(RADII.shape, ALONG_RMS),) * 2))
        differences, variances = [], []
        for gain, passed in splits:
            first, first_variance, second, second_variance = _halves(
                equalised, nodes, spectra, at_pixels, weight, gain, passed
            )
            differences.append(first - second)
            variances.append(widening * (first_variance + second_variance))
        return cls(radius, share, use, differences, variances)

    def test(self, is_clear: Mask | None = None) -> SplitBand:
        """Estimate the error of the blur model, from the nodes of `is_clear` (h x w) if these are enough."""
        use = self.is_used
        if is_clear is not None and (use & is_clear).sum() >= LEAST_NODES:
            use = use & is_clear
        count = int(use.sum())
        if not self.differences:
            return SplitBand(0.0, (), (), (), (), count)
        found = [
            random_effects(difference[use], variance[use], self.share[use])
            for difference, variance in zip(self.differences, self.variances, strict=True)
        ]
        taus, means = ([pair[n] for pair in found] for n in (0, 1))
        split = len(CUTS)
        cuts = tuple(cut / self.radius for cut in CUTS)
        return SplitBand(max(taus), cuts, tuple(taus[:split]), tuple(means[:split]), tuple(taus[split:]), count)


def _spectra(at_pixels: Sequence[tuple[Image, Image]]) -> list[NDArray[np.complex64]]:
    """Return spectra of the residuals, with their derivatives as imaginary parts: real filters keep the two apart."""
    rows, columns, around = _surround(at_pixels[0][0].shape)
    spectra = []
    for value, derivative in at_pixels:
        both = np.empty((rows, columns), np.complex64)
        both.real, both.imag = (np.pad(image, around, mode="symmetric") for image in (value, derivative))
        spectra.append(fft.fft2(both, workers=-1, overwrite_x=True))
    return spectra


def _surround(shape: tuple[int, ...]) -> tuple[int, int, tuple[tuple[int, int], ...]]:
    """Rows and columns of the frame with its surround, and the pixels added before and after."""
    reach = [min(SURROUND, n) for n in shape]
    rows, columns = (fft.next_fast_len(n + 2 * r) for n, r in zip(shape, reach, strict=True))
    return rows, columns, tuple((r, m - n - r) for n, m, r in zip(shape, (rows, columns), reach, strict=True))


def _halves(
    equalised: Equalised,
    nodes: Nodes,
    spectra: Sequence[NDArray[np.complex64]],
    at_pixels: Sequence[tuple[Image, Image]],
    weight: Image,
    gain: Image,
    passed: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """How far either half of the detail moves depth at each node, in levels, and its variance for noise of variance 1.

    `gain` is the amplitude of the first half at the residuals' frequencies, `passed` that of either half at the radial
    samples, root mean square over directions. Of the first half first, then of the rest.
    """
    _, _, around = _surround(weight.shape)
    inside = tuple(slice(before, before + n) for (before, _), n in zip(around, weight.shape, strict=True))
    sums = np.zeros((4, *nodes.level.shape))  # score and information of the coarse half, then of the fine
    drifts = np.zeros((2, equalised.levels))  # what noise alone puts into the score of a pixel
    for residual, spectrum, (value, derivative) in zip(equalised.residuals, spectra, at_pixels, strict=True):
        coarse = fft.ifft2(spectrum * gain, workers=-1, overwrite_x=True)[inside]
        sums += numerics.half_sums(value, derivative, coarse, weight, equalised.step)
        for number, amplitude in enumerate(passed):
            drifts[number] += (
                np.gradient(residual.gains.sum(axis=0) @ (residual.measure * amplitude**2)) * equalised.scale / 2
            )
    count = numerics.block_sum(weight, equalised.step)
    for number, drift in enumerate(drifts):
        sums[2 * number] += count * np.interp(nodes.level, np.arange(equalised.levels), drift)
    # The window that depth is gathered over last.
    window = equalised.window * SMOOTH.windows[-1] / equalised.step
    gathered = numerics.gather(sums.astype(np.float32), window).astype(float)
    squares = numerics.gather(sums[1::2].astype(np.float32), window / np.sqrt(2)).astype(float)
    total = np.maximum(gathered[1::2], 1e-9)
    moved, variance = gathered[::2] / total, np.maximum(squares, 1e-12) / total**2
    return moved[0], variance[0], moved[1], variance[1]


def _low_pass(squared: NDArray[Any], cut: float) -> NDArray[Any]:
    """Return the amplitude of the coarse half at frequencies given by their squares: 1/2 at the cut, falling fast."""
    steep = np.minimum(squared / squared.dtype.type(cut**2), 64.0) ** 4
    return np.asarray(np.exp(-squared.dtype.type(np.log(2)) * steep))


def _along(cosine: NDArray[np.floating]) -> Image:
    """Return amplitude of the half along a direction, by the `cosine` of twice the angle to it: 1/2 at 45 degrees."""
    return np.asarray((1 + np.clip(PARTING * cosine, -1, 1)) / 2, np.float32)


ALONG_RMS = float(np.sqrt(np.mean(_along(np.cos(2 * np.linspace(0, np.pi, 1440, endpoint=False))) ** 2)))
"""Root mean square over all directions of the amplitude of the half along a direction (computed)."""
