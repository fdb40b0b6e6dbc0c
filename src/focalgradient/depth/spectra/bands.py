"""Local spectra: bands of whole images, each equalised with the blur assumed of the other first.

A windowed patch of a blurred image is not the blurred windowed patch: power leaks across its edges and into the
neighbouring frequencies, so that the ratio of two patches' spectra gives too small a difference of blur, by more the
larger it is. So each whole image is first given the blur assumed of the other, then filtered into bands of frequency,
whose power is gathered around each node only then: nothing leaks, and where the hypothesis is right the two differ by
noise alone. The difference between them measures how far it is off.

Within a band the equalisers of all hypotheses are combinations of very few filters. Only those are applied to the
images; the power after any equaliser is a quadratic form of their products, gathered once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage, special

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth import numerics
from focalgradient.depth.filters import (
    FINE_PASS,
    FINEST,
    RADIAL,
    RADII,
    Image,
    Spectra,
    mirrored_spectra,
    natural_levels,
    natural_power,
)

__all__ = ["Bands", "Compared", "Hypothesis", "compare", "scene_level", "spacing"]

MEASURE: FloatArray = 2 * np.pi * RADII * RADII[1]
"""Proportion of all frequencies at each of `RADII`: the area of its ring relative to the plane."""

BAND_SPACING = 0.35
"""Spacing of the bands relative to their frequency, unless the window requires more. Chosen by hand."""

LEAST_SPACING = 0.24
"""Spacing of the bands at frequency 0, in cycles per window: filters of narrower bands would extend beyond the window.
"""

FAINT = 0.01
"""Ratio of scene to noise power below which a band is omitted. Chosen by hand."""

NOTHING = 1e12
"""Variance of an undetermined slope, in pixels^4."""

FILTER_ERROR = 1e-3
"""Maximum amplitude error of the low-rank filters, relative to an equaliser's amplitude. Chosen by hand."""


@dataclass(frozen=True)
class Bands:
    """Overlapping bands of frequency, and the Gaussian of sd `window` pixels in which their power is gathered.

    They are smooth, and none is narrower than the window resolves frequencies, so that no band's filter reaches
    much farther than the window. Nodes lie in the middles of blocks of `step` pixels.

    Examples
    --------
    >>> bands = Bands.of(8.0)
    >>> [round(float(RADII[shape.argmax()]), 2) for shape in bands.shapes]
    [0.04, 0.09, 0.16, 0.26, 0.41]
    """

    window: float
    step: int

    @classmethod
    def of(cls, window: float) -> Bands:
        """Return the bands for a window, with nodes about as far apart as it is wide."""
        return cls(window, spacing(window))

    @cached_property
    def shapes(self) -> FloatArray:
        """Each band's gain (K x RADIAL)."""
        place = np.log1p(BAND_SPACING * RADII / (LEAST_SPACING / self.window)) / BAND_SPACING
        middles = np.arange(1, max(2, int(np.interp(FINEST, RADII, place))) + 1)[:, None]
        # The finest reaches as far as anything is compared.
        return np.cos(np.pi / 2 * np.minimum(np.abs(np.minimum(place, middles[-1]) - middles), 1)) ** 2

    @cached_property
    def _squares(self) -> FloatArray:
        """Products of the gains of each band with itself, and with the next: 2K - 1 x RADIAL."""
        return np.concatenate([self.shapes**2, self.shapes[:-1] * self.shapes[1:]])

    @cached_property
    def _some(self) -> slice:
        """Return about as many of RADII as the window resolves."""
        blur = 1 / (2 * np.sqrt(2) * np.pi * self.window)
        return slice(None, None, max(1, int(0.4 * blur / RADII[1])))

    @cached_property
    def _blend(self) -> FloatArray:
        """Return the overlap of two frequencies at the window's resolution."""
        some, wide = RADII[self._some], 4 * np.pi**2 * self.window**2
        blend = np.exp(-wide * (some[:, None] - some) ** 2) * special.i0e(2 * wide * np.outer(some, some))
        return np.asarray(blend * self._some.step**2)

    def means(self, power: FloatArray) -> FloatArray:
        """Mean square, in each band (... x K), of a field of spectral density `power` (... x RADIAL)."""
        return (power * MEASURE) @ (self.shapes**2).T

    def covariance(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """Return the covariance between bands (K x K) of the products of two independent fields.

        `one` and `other` are their spectral densities (RADIAL), or the cross densities of two versions of either.
        """
        first, second = ((self._squares * (power * MEASURE))[:, self._some] for power in (one, other))
        terms = np.einsum("mf,mf->m", first @ self._blend, second)
        count = len(self.shapes)
        return np.diag(terms[:count]) + np.diag(terms[count:], 1) + np.diag(terms[count:], -1)

    def gather(self, blocks: NDArray[np.floating]) -> Image:
        """Return sums over blocks (r x h x w) gathered at each node, with weights that sum to 1 in sum over pixels."""
        # A block is itself as wide as (step^2 - 1) / 12.
        wide = np.sqrt(self.window**2 - (self.step**2 - 1) / 12) / self.step
        total = np.exp(-(np.arange(-int(np.ceil(4 * wide)), int(np.ceil(4 * wide)) + 1) ** 2) / (2 * wide**2)).sum()
        return numerics.gather(blocks.astype(np.float32), float(wide)) / np.float32((total * self.step) ** 2)


@dataclass(frozen=True)
class Hypothesis:
    """Blurs assumed of two images, and the scene's and noise's power where each is given the other's."""

    pair: tuple[int, int]
    gains: FloatArray  # 2 x RADIAL: what either image is filtered by
    scene: FloatArray  # RADIAL: the scene's power, in either
    noise: FloatArray  # 2 x RADIAL: amplitude of either's noise
    margin: int  # pixels within which unusable pixels invalidate usable ones

    @classmethod
    def of(
        cls,
        pair: tuple[int, int],
        transfers: FloatArray,
        weight: FloatArray,
        noise_sd: Sequence[float],
        level: float,
        margin: int,
    ) -> Hypothesis:
        """Equalise blurs of given `transfers` (2 x RADIAL) of the images numbered `pair`.

        `weight` is the pass band (amplitude, RADIAL) of either; `level` about the scene's power at frequency 1, as
        `scene_level` estimates it; `noise_sd` the standard deviation of either image's noise.
        """
        sharp = natural_power(level) * np.prod(transfers, axis=0) ** 2
        noise = np.asarray(noise_sd)[:, None] * transfers[::-1]
        # White within the pass band.
        total = sharp + (noise**2).sum(axis=0)
        white = weight * FINE_PASS / np.sqrt(total + 1e-9 * total.max())
        return cls(pair, transfers[::-1] * white, sharp * white**2, noise * white, margin)


@dataclass(frozen=True)
class Compared:
    """Two images' local power, each equalised with the blur assumed of the other: a line through the difference.

    ln P1 - ln P2 = `slope` x frequency^2 (Eq. 9), fitted to the bands with the weight of their information, from
    the image's usual spectrum and the noise.
    """

    bands: Bands
    hypothesis: Hypothesis
    slope: Image  # h x w, in pixels^2
    difference: Image  # K x h x w: P1 - P2
    weight: Image  # K x h x w: of the difference of power in each band, in the slope
    power: Image  # K x h x w: the scene's
    misfit: Image  # h x w: what the line leaves, squared, over its variance, summed, beyond what noise leaves
    support: Image  # h x w: share of the window that nothing invalidates under this hypothesis
    shares: Image  # K x h x w: share of the window that was used
    covariances: tuple[FloatArray, FloatArray]  # K x K: of the difference, per unit of the scene's power, and without

    @classmethod
    def of(
        cls, bands: Bands, hypothesis: Hypothesis, gathered: Image, used: Mask, support: Image, shares: Image
    ) -> Compared:
        """Fit the power (2 x K x h x w) gathered of two images in the bands that are `used`."""

        def row(values: NDArray[Any]) -> Image:
            return values.astype(np.float32)[:, None, None]

        noise = hypothesis.noise**2
        one, other = (total - row(bands.means(part)) for total, part in zip(gathered, noise, strict=True))
        difference, power = one - other, np.maximum((one + other) / 2, 0)
        scene = bands.means(hypothesis.scene) + 1e-30
        squared = bands.means(hypothesis.scene * RADII**2) / scene
        # Variance of the difference in a whole window: for each unit of the scene's power, and without any.
        covariances = (
            4 * bands.covariance(hypothesis.scene, noise.sum(axis=0)) / np.sqrt(np.outer(scene, scene)),
            2 * bands.covariance(noise[0], noise[0]) + 2 * bands.covariance(noise[1], noise[1]),
        )
        lit, dark = (np.diag(matrix) + 1e-30 for matrix in covariances)
        # Each place has the usual spectrum, more or less.
        usual = used * np.maximum(np.average((one + other) / 2, axis=(1, 2), weights=support + 1e-9), 0)
        known = usual / (lit * usual + dark)
        scale = np.maximum(np.tensordot(known, (one + other) / 2, 1) / (usual @ known + 1e-30), 0)
        scaled = row(usual) * scale.astype(np.float32)
        weight = row(squared) * scaled / (row(lit) * scaled + row(dark)) * shares
        weight /= (weight * row(squared) * power).sum(axis=0) + 1e-30
        slope = (weight * difference).sum(axis=0)
        left = difference - 2 * power * np.tanh(slope * row(squared) / 2)
        spread = (row(lit) * power + row(dark)) / np.maximum(shares, 1e-6)
        misfit = (row(used) * left**2 / spread).sum(axis=0) - (used.sum() - 1)
        return cls(bands, hypothesis, slope, difference, weight, power, misfit, support, shares, covariances)

    @cached_property
    def variance(self) -> FloatArray:
        """Variance of the slope (h x w); very large where the patch is uninformative."""
        variance = self._variance(self.weight)
        return np.where((self.support > 0.01) & (variance > 0), variance, NOTHING)

    def coarse_less_fine(self, share: float) -> tuple[FloatArray, FloatArray]:
        """Return the slope from coarse detail minus that from fine, and the variance of the difference (h x w each).

        The coarse half has `share` of the bands' information about the slope over the whole frame. What it has of a
        band that falls to both is counted in both: its noise cancels.
        """
        scene = self.bands.means(self.hypothesis.scene) + 1e-30
        squared = self.bands.means(self.hypothesis.scene * RADII**2) / scene
        information = self.weight * squared.astype(np.float32)[:, None, None] * self.power
        whole = information.mean(axis=(1, 2), dtype=float)
        before = np.cumsum(whole) - whole
        coarse = np.clip((share * whole.sum() - before) / np.maximum(whole, 1e-30), 0, 1)
        coarse = coarse.astype(np.float32)[:, None, None]
        parts = [(information * half).sum(axis=0) for half in (coarse, 1 - coarse)]
        contrast = self.weight * (coarse / (parts[0] + 1e-6) - (1 - coarse) / (parts[1] + 1e-6))
        known = (np.minimum(*parts) > 0.01) & (self.support > 0.01)
        return (contrast * self.difference).sum(axis=0), np.where(known, self._variance(contrast), NOTHING)

    def _variance(self, weight: Image) -> FloatArray:
        """Variance of the sum over bands of the differences times `weight` (K x h x w)."""
        dark, lit = self._parts(weight, np.s_[:])
        return _quadratic(lit, self.covariances[0], lit) + _quadratic(dark, self.covariances[1], dark)

    def covariance(self, other: Compared, mine: int, its: int, where: Mask) -> FloatArray:
        """Covariance, at nodes `where`, of the slope with another's, through a view that both compare.

        `mine` and `its` say whether it is the first view of either comparison (0) or the second (1).
        """
        noise = self.hypothesis.noise[mine] * other.hypothesis.noise[its]
        scene = np.sqrt(self.hypothesis.scene * other.hypothesis.scene)
        usual = (self.bands.means(one.hypothesis.scene) + 1e-30 for one in (self, other))
        lit = 4 * self.bands.covariance(scene, noise) / np.sqrt(np.outer(*usual))
        dark = 2 * self.bands.covariance(noise, noise)
        (own_dark, own_lit), (its_dark, its_lit) = (one._parts(one.weight, np.s_[:, where]) for one in (self, other))
        total = _quadratic(own_lit, lit, its_lit) + _quadratic(own_dark, dark, its_dark)
        return total if mine == its else -total

    def _parts(self, weight: Image, place: Any) -> tuple[Image, Image]:
        """Return a `weight` at `place`, as the noise meets it alone and together with the scene."""
        weight = weight[place] / np.sqrt(np.maximum(self.shares[place], 1e-6))
        return weight, weight * np.sqrt(self.power[place])


def _quadratic(left: Image, matrix: FloatArray, right: Image) -> FloatArray:
    return np.asarray((np.tensordot(matrix, left, 1) * right).sum(axis=0))


def compare(
    bands: Bands, images: Sequence[Image], usable: Mask, hypotheses: Sequence[Hypothesis], reach: int
) -> list[Compared]:
    """Compare pairs of whole `images` (each H x W) under every hypothesis.

    `usable` says which pixels (H x W) can be used; `reach` is how far the frame is mirrored beyond its border.
    """
    distance = ndimage.distance_transform_cdt(np.pad(usable, 1), "chessboard")[1:-1, 1:-1]
    scene, noise = (
        np.stack([bands.means(p) for p in powers])
        for powers in zip(*((one.scene, (one.noise**2).sum(axis=0)) for one in hypotheses), strict=True)
    )
    used = scene > FAINT * noise  # hypotheses x K
    used[~used.any(axis=1), 0] = True
    around = min(reach, *usable.shape) // 4 * 4
    # Multiples of 4, so that bands can be sampled at every second or fourth pixel.
    rows, columns = (4 * fft.next_fast_len(-(-(n + 2 * around) // 4), real=True) for n in usable.shape)
    spectra = mirrored_spectra(images, around, (rows, columns))
    nodes = [-(-n // bands.step) for n in usable.shape]
    power = np.zeros((len(hypotheses), 2, len(bands.shapes), *nodes), np.float32)
    shares = np.zeros((len(bands.shapes), *nodes), np.float32)
    for band in np.flatnonzero(used.any(axis=0)):
        those = np.flatnonzero(used[:, band])
        gains = np.stack([hypotheses[m].gains for m in those]) * bands.shapes[band]
        filters, coefficients = _few(gains)
        finest = RADII[np.flatnonzero(bands.shapes[band] > 1e-3)[-1]]
        skip = next(s for s in (4, 2, 1) if s == 1 or (bands.step % s == 0 and finest * s <= 0.3))
        mask = _sampled(distance > max(hypotheses[m].margin for m in those), skip)
        shares[band] = bands.gather(numerics.block_sum(mask, bands.step // skip)[None])[0] * skip**2
        first, second = np.tril_indices(len(filters))
        squares = coefficients[..., first] * coefficients[..., second] * np.where(first == second, 1.0, 2.0)
        top, left = (slice(around // skip, around // skip - (-n // skip)) for n in usable.shape)
        for view, spectrum in enumerate(spectra):
            filtered = _filtered(spectrum, (rows, columns), (top, left), filters, skip)
            products = numerics.block_products(filtered, mask, bands.step // skip)
            gathered = bands.gather(products) * skip**2 / np.maximum(shares[band], 1e-4)
            for side in (0, 1):
                mine = np.array([hypotheses[m].pair[side] == view for m in those])
                found = np.tensordot(squares[mine, side].astype(np.float32), gathered, 1)
                power[those[mine], side, band] = found
    supports = {
        margin: bands.gather(numerics.block_sum(_sampled(distance > margin, 1), bands.step)[None])[0]
        for margin in {one.margin for one in hypotheses}
    }
    return [
        Compared.of(bands, one, power[m], used[m], supports[one.margin], shares) for m, one in enumerate(hypotheses)
    ]


def _few(gains: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a few filters (r x RADIAL), and how they combine (... x r) to each of `gains` (... x RADIAL)."""
    # An image's amplitude falls about as 1 / frequency: there its filters must be more exact.
    fall = np.maximum(RADII, RADII[1])
    rows = (gains / fall).reshape(-1, RADIAL)
    # By all frequencies: large blur may pass next to nothing but a sliver between two of a coarser grid.
    rows /= (size := np.linalg.norm(rows, axis=1, keepdims=True) + 1e-30)
    few = len(rows) < RADIAL  # products of few rows, or of few columns: faster than decomposing `rows`
    values, vectors = np.linalg.eigh(rows @ rows.T if few else rows.T @ rows)
    kept = values >= min(FILTER_ERROR**2 * len(rows), values[-1])
    left = vectors[:, kept] if few else rows @ vectors[:, kept] / np.sqrt(values[kept])
    return (left.T @ rows) * fall, (size * left).reshape(*gains.shape[:-1], -1)


def _filtered(
    spectrum: NDArray[np.complex64], size: tuple[int, int], within: tuple[slice, slice], filters: FloatArray, skip: int
) -> Image:
    """Filter a view by each of `filters` (r x RADIAL), at the centre of each block of `skip` pixels: r x h x w.

    Its `spectrum` is that of the view mirrored to `size`; blocks `within` that are returned.
    """
    rows, columns = (n // skip for n in size)
    down, right = fft.fftfreq(rows, skip)[:, None], fft.rfftfreq(columns, skip)
    part = spectrum[np.rint(down[:, 0] * size[0]).astype(int), : len(right)]
    part = part * np.exp(1j * np.pi * (skip - 1) * (down + right)).astype(np.complex64) / np.float32(skip**2)
    frequency = np.hypot(down, right)
    images = np.empty((len(filters), *(place.stop - place.start for place in within)), np.float32)
    for image, row in zip(images, filters, strict=True):
        gain = np.interp(frequency, RADII, row).astype(np.float32)
        image[:] = fft.irfft2(part * gain, (rows, columns), workers=-1, overwrite_x=True)[within]
    return images


def scene_level(images: Sequence[Image]) -> float:
    """Power of the sharp scene at frequency 1, if natural: that of the image with most."""
    return float(natural_levels(Spectra.of(images, 32).measure_and_power()[1]).max())


def _sampled(usable: Mask, skip: int) -> Image:
    """Return which blocks of `skip` pixels are usable."""
    around = [(0, -n % skip) for n in usable.shape]
    return np.pad(usable, around)[skip // 2 :: skip, skip // 2 :: skip].astype(np.float32)


def spacing(window: float) -> int:
    """Return the spacing of nodes in pixels."""
    return 2 ** max(0, round(np.log2(window)))
