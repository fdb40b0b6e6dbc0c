"""Windowed patches on a grid, their orientation-summed spectra, and what two images' spectra differ by.

A windowed patch of a blurred image is not the blurred windowed patch: power leaks across its edges and into the
neighbouring frequencies, so that the ratio of two patches' spectra reads too small a difference of blur, by more the
larger it is. Images of *one* blur leak alike, whatever they show. So the whole images are first equalised, each with
the other's supposed blur; what is left between their patches tells how far the supposition is off, and says zero,
without bias, where it is right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from focalgradient.depth.filters import RADIAL, FloatArray, Image, Spectra

__all__ = ["RADII", "Compared", "Patches", "compare", "scene_power"]

RADII: FloatArray = np.linspace(0, np.sqrt(0.5), RADIAL)
"""Radial frequencies, in cycles per pixel, at which transfers are given."""

FINEST = 0.47
"""Cycles per pixel up to which spectra are compared: finer detail is aliased by the pixels."""

HEARD = 0.05
"""Power of the scene over the noise's below which a frequency tells nothing, and need not be kept."""

NOTHING = 1e12
"""Variance of a slope, in pixels^4, of which nothing is known."""

ALONE = 0.45
"""Variance of a single ring over what `Patches.freedom` gives it: the rest it has in common with its neighbours."""

CHUNK = 1_000_000
"""Pixels of patches that are transformed at a time."""


@dataclass(frozen=True)
class Patches:
    """Gaussian-windowed patches of `side` pixels, one in the middle of each block of `step` pixels.

    The power that a patch gathers is weighted by a Gaussian of sd `window`: the window itself is sqrt(2) wider.
    Spectra are summed over orientation, in rings one frequency of the patch wide. Only every `skip`-th pixel is
    looked at, which is enough for images without detail finer than 0.5 / skip cycles per pixel.

    Examples
    --------
    >>> patches = Patches.of(8.0)
    >>> patches.side, patches.step, patches.frequency[:3].round(3).tolist()
    (64, 8, [0.019, 0.034, 0.048])
    """

    window: float
    step: int
    side: int
    skip: int = 1

    @classmethod
    def of(cls, window: float) -> Patches:
        """Patches about as far apart as the window is wide."""
        return cls(window, 2 ** max(0, round(np.log2(window))), 8 * int(np.ceil(window)))

    @cached_property
    def _taper(self) -> FloatArray:
        """The window along one axis; its squares sum to 1."""
        place = (np.arange(self.side // self.skip) + 0.5) * self.skip - self.side / 2
        edge = np.exp(-(place**2) / (4 * self.window**2))
        return edge / np.linalg.norm(edge)

    @cached_property
    def _squared(self) -> FloatArray:
        """Squared frequency of each element of a patch's half spectrum."""
        count = self.side // self.skip
        along = fft.rfftfreq(count, self.skip)
        return fft.fftfreq(count, self.skip)[:, None] ** 2 + along**2

    @cached_property
    def _rings(self) -> Image:
        """The sum over each ring, as a matrix: elements of a half spectrum x R."""
        ring = np.rint(self.side * np.sqrt(self._squared)).reshape(-1, 1)
        twice = np.full(self._squared.shape, 2.0)
        twice[:, [0, -1]] = 1.0  # a real image's spectrum is stored by half
        rings = np.arange(1, int(FINEST * self.side / self.skip) + 1)
        return np.asarray((ring == rings) * twice.reshape(-1, 1), np.float32)

    @cached_property
    def frequency(self) -> FloatArray:
        """Root mean square frequency of each ring (R), in cycles per pixel."""
        return np.sqrt(self._squared.ravel() @ self._rings / self._rings.sum(axis=0))

    @cached_property
    def frequencies(self) -> FloatArray:
        """Number of a patch's frequencies in each ring (R)."""
        return self._rings.sum(axis=0, dtype=float)

    @cached_property
    def freedom(self) -> FloatArray:
        """Independent real numbers in each ring (R): as many as its frequencies, less what the window makes alike."""
        alike = (self.side // self.skip * np.sum(self._taper**4)) ** 2
        return self.frequencies / alike

    def spectra(self, image: Image, power: int = 2) -> FloatArray:
        """Ring sums of |F|^`power` (1 or 2) for every patch of `image` (H x W): h x w x R. Beyond the frame is dark."""
        rows, columns = (-(-n // self.step) for n in image.shape)
        # Of patches at the blocks' middles, as many pixels lie before the first block as behind it.
        margin = (self.side - self.step) // 2
        around = [(margin, margin + m * self.step - n) for m, n in zip((rows, columns), image.shape, strict=True)]
        side, step = self.side // self.skip, self.step // self.skip
        wide = np.pad(image, around)[:: self.skip, :: self.skip]
        every = np.lib.stride_tricks.sliding_window_view(wide, (side, side))[::step, ::step]
        taper = np.outer(self._taper, self._taper).astype(np.float32)
        sums = np.empty((rows, columns, self._rings.shape[1]))
        band = max(1, CHUNK // (columns * side**2))
        for row in range(0, rows, band):
            spectrum = fft.rfft2(every[row : row + band] * taper, workers=-1)
            values = np.square(spectrum.view(np.float32)).reshape(*spectrum.shape[:2], -1, 2).sum(axis=-1)
            sums[row : row + band] = (np.sqrt(values) if power == 1 else values) @ self._rings
        return sums

    def support(self, usable: NDArray[np.bool_]) -> FloatArray:
        """Share of each patch's window that falls on `usable` pixels (H x W): h x w."""
        smooth = ndimage.gaussian_filter(usable.astype(np.float32), self.window, mode="constant", truncate=3)
        places = [(np.arange(-(-n // self.step)) + 0.5) * self.step - 0.5 for n in usable.shape]
        return np.asarray(
            ndimage.map_coordinates(smooth, np.meshgrid(*places, indexing="ij"), order=1, mode="nearest"), float
        )

    def expected(self, power: FloatArray) -> FloatArray:
        """Ring sums (R) to expect of a field of spectral density `power` at `RADII`, leaks and all."""
        wide = 2 * self.side // self.skip
        frequency = np.hypot(fft.fftfreq(wide, self.skip)[:, None], fft.rfftfreq(wide, self.skip))
        correlation = fft.irfft2(np.interp(frequency, RADII, power), (wide, wide)) / self.skip**2
        edge = fft.irfft(np.abs(fft.rfft(self._taper, wide)) ** 2, wide)
        return fft.rfft2(correlation * np.outer(edge, edge)).real[::2, ::2].ravel() @ self._rings


@dataclass(frozen=True)
class Compared:
    """Two images' patches, each equalised with the other's supposed blur: a line through what is left.

    ln P1 - ln P2 = `slope` x frequency^2 (Eq. 9), fitted to the ring sums with the weight of their information, as
    the patches' usual spectrum and the noise tell it.
    """

    slope: FloatArray  # h x w, in pixels^2
    weight: Image  # h x w x R: of the difference of power in each ring, in the slope
    power: Image  # h x w x R: the scene's
    noise: FloatArray  # 2 x R: either image's noise power, in a whole window
    misfit: FloatArray  # h x w: squared differences of power over their variance, summed, beyond what noise leaves
    support: FloatArray  # h x w: share of the window that could be used
    freedom: FloatArray  # R

    @classmethod
    def of(
        cls,
        patches: Patches,
        sums: Sequence[FloatArray],
        squared: FloatArray,
        trust: FloatArray,
        noise: FloatArray,
        support: FloatArray,
    ) -> Compared:
        """Fit the ring `sums` (h x w x R) of two images, in rings of mean `squared` frequency and given `trust`."""
        one, other = (total - part * support[..., None] for total, part in zip(sums, noise, strict=True))
        usual = np.maximum(np.average((one + other) / 2, axis=(0, 1), weights=support + 1e-9), 0)
        power = (one + other) / 2
        known = usual / (2 * usual * noise.sum(axis=0) + (noise**2).sum(axis=0))
        scale = np.maximum((power @ known) / (usual @ known + 1e-30), 0)[..., None]
        told = patches.freedom * scale * usual / (2 * scale * usual * noise.sum(axis=0) + (noise**2).sum(axis=0))
        weight = squared * told * trust
        weight /= (weight * squared * power).sum(axis=-1, keepdims=True) + 1e-30
        slope = (weight * (one - other)).sum(axis=-1)
        spread = 2 * power * noise.sum(axis=0) + support[..., None] * (noise**2).sum(axis=0)
        misfit = (((one - other) ** 2 * patches.freedom / (2 * np.maximum(spread, 1e-30))) - ALONE).sum(axis=-1)
        seen = np.maximum(power, 0).astype(np.float32)
        return cls(slope, weight.astype(np.float32), seen, noise, misfit, support, patches.freedom)

    @cached_property
    def variance(self) -> FloatArray:
        """Variance of the slope (h x w); huge where the patch tells nothing."""
        variance = self.covariance(self, 0, 0) + self.covariance(self, 1, 1)
        return np.where((self.support > 0.01) & (variance > 0), variance, NOTHING)

    def covariance(self, other: Compared, mine: int, its: int) -> FloatArray:
        """Covariance (h x w) of the slope with another's through the noise of a view that both compare.

        `mine` and `its` say whether it is the first view of either comparison (0) or the second (1).
        """
        rings = min(len(self.freedom), len(other.freedom))  # the others have no weight
        weight = self.weight[..., :rings] * other.weight[..., :rings]
        power = np.sqrt(self.power[..., :rings] * other.power[..., :rings])
        noise = self.noise[mine, :rings] * other.noise[its, :rings]
        total = np.einsum("yxr,yxr,r->yx", weight, power, 4 * np.sqrt(noise) / self.freedom[:rings], optimize=True)
        total += self.support * (weight @ (2 * noise / self.freedom[:rings]))
        return total if mine == its else -total


def compare(
    patches: Patches,
    spectra: Sequence[Spectra],
    transfers: FloatArray,
    heard: FloatArray,
    noise_sd: Sequence[float],
    scene: float,
    usable: NDArray[np.bool_],
) -> Compared:
    """Compare two whole images' patches once each is given the other's supposed blur.

    Parameters
    ----------
    patches
        Where to look, and how widely.
    spectra
        Either image's, as a whole.
    transfers
        2 x RADIAL: what either image's blur is supposed to transfer, at `RADII`.
    heard
        Share (amplitude, RADIAL) at which either is heard.
    noise_sd
        Standard deviation of either image's noise.
    scene
        About the scene's power at frequency 1, as `scene_power` tells it.
    usable
        Pixels (H x W) that blur has not mixed with what is not seen, or saturated.
    """
    sharp = scene / np.maximum(RADII, RADII[1]) ** 2 * np.prod(transfers, axis=0) ** 2
    noise = (np.asarray(noise_sd)[:, None] * transfers[::-1]) ** 2
    finest = RADII[sharp * heard**2 > HEARD * noise.sum(axis=0)].max(initial=0.1)
    skip = next(skip for skip in (4, 2, 1) if patches.step % skip == 0 and (finest * skip < 0.4 or skip == 1))
    patches = replace(patches, skip=skip)
    # White as far as it is heard: what leaks comes from elsewhere and tells nothing.
    total = sharp + noise.sum(axis=0)
    heard = heard * np.exp(-((RADII * skip / FINEST) ** 16) / 2)
    gains = transfers[::-1] * heard / np.sqrt(total + 1e-9 * total.max())
    seen = sharp * heard**2 / (total + 1e-9 * total.max())
    # What has leaked into a ring keeps the blur of the frequency it came from.
    leaked = patches.expected(seen)
    squared = patches.expected(seen * RADII**2) / leaked
    images = [s.filtered(gain[None]) * usable for s, gain in zip(spectra, gains, strict=True)]
    expected = np.stack([patches.expected((sd * gain) ** 2) for sd, gain in zip(noise_sd, gains, strict=True)])
    # ... and says again what was said there: a ring counts by how much of its power is its own.
    own = np.interp(patches.frequency, RADII, seen) * patches.frequencies
    trust = np.minimum(own / leaked, 1) * np.interp(patches.frequency, RADII, heard**2)
    sums = [patches.spectra(image) for image in images]
    return Compared.of(patches, sums, squared, trust, expected, patches.support(usable))


def scene_power(spectra: Sequence[Spectra]) -> float:
    """Power of the sharp scene at frequency 1, if natural: falling as 1 / f^2 from what no moderate blur removes."""
    low = (RADII > 0.01) & (RADII < 0.08)
    powers = (one.measure_and_power()[1][0] for one in spectra)
    return max(float(np.median(power[low] * RADII[low] ** 2)) for power in powers)
