"""Spectra of whole images, and what every filter on them shares: radial frequencies, pass bands, natural power."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Any

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import fft, sparse, special

from focalgradient.arrays import FloatArray, Mask
from focalgradient.parallel import share_rows

__all__ = [
    "FINE_PASS",
    "RADIAL",
    "RADII",
    "ROUND",
    "Frequencies",
    "Spectra",
    "disc_pass",
    "independent_samples",
    "mean_in_squares",
    "mirrored_spectra",
    "natural_levels",
    "natural_power",
    "plane",
    "smoothed",
]

Floats = NDArray[np.floating]
Image = NDArray[np.float32]

RADIAL = 512
"""Number of samples of radial frequency, 0 to 1/sqrt(2) cycles per pixel, at which filters are computed. Chosen by
hand: one period of the transfer of 64 pixels of blur spans 11 of them."""

RADII: FloatArray = np.linspace(0, np.sqrt(0.5), RADIAL)
"""Radial frequencies of the samples, in cycles per pixel: the corner of the plane of frequencies lies at 1/sqrt(2)."""

FINEST = 0.47
"""Maximum frequency in cycles per pixel of compared images: higher ones are aliased (0.5 is the limit) and lost in
resampling. Chosen by hand."""

PARTS = 8
"""Number of subdivisions of a radial sample to which filters are interpolated. Chosen by hand."""

LOW = (0.01, 0.08)
"""Frequency band in cycles per pixel in which a scene's power is measured: moderate blur does not attenuate it. Chosen
by hand."""


SCENE_SLOPE = 2
"""Exponent of the power of natural scenes, which falls as 1 / frequency^2: the one law of scenes that depth from blur
assumes where the views leave the power of a texture open. In photographs, which lenses soften, it falls by 2.5 in the
median, on gravel and grass by 2.1 and 1.7 (`tests/depth/test_scene_law.py`)."""

HALF_PLANE = 0.5
"""Area of the frequency half-plane of a real image in squared cycles per pixel: -0.5 to 0.5 down, 0 to 0.5 to the
right."""

FINEST_STEP, GROWTH = 1 / 320, 0.06
"""Spacing in cycles per pixel of the lowest frequencies of a plane, and relative increase of the spacing with
frequency: blur passes little above 1.3 cycles per radius, up to which cubic splines are accurate to 1e-3."""


@dataclass(frozen=True, slots=True, eq=False)
class Frequencies:
    """Where filters are worked out: at radial frequencies, or, for blur that is not round, over half the plane.

    The plane's frequencies are those of a column by those of a row, close together in the middle.
    """

    radius: FloatArray  # F: cycles per pixel
    axes: tuple[FloatArray, ...] = ()  # of the plane, down and to the right, cycles per pixel, rising; none if radial

    @property
    def is_radial(self) -> bool:
        """Whether these are radial frequencies, which suffice for circular blur."""
        return not self.axes

    @property
    def areas(self) -> FloatArray:
        """Return the share of all frequencies that each represents, in any unit: rings f df, or cells of the plane."""
        if self.is_radial:
            return self.radius
        return np.outer(*(np.convolve(np.diff(axis), [0.5, 0.5]) for axis in self.axes)).ravel()

    @property
    def measure(self) -> FloatArray:
        """Share of the whole frequency plane that each sample represents; the samples may end before the plane does."""
        return self.areas / (self.areas.sum() if self.is_radial else HALF_PLANE)

    def fine_pass(self) -> FloatArray:
        """Return the amplitude of the pass band that ends at `FINEST`."""
        return np.asarray(np.exp(-((self.radius / FINEST) ** 16) / 2))

    def to_radial(self, values: FloatArray) -> FloatArray:
        """Return `values` (... x F) at RADII; values over the plane are averaged over all directions."""
        if self.is_radial:
            return values
        flat = values.reshape(-1, values.shape[-1])
        return np.asarray((_circles(self) @ flat.T).T).reshape(*values.shape[:-1], RADIAL)


ROUND = Frequencies(RADII)
"""Radial frequencies (cycles per pixel), sufficient for circular blur."""

FINE_PASS: FloatArray = ROUND.fine_pass()
"""Amplitude at RADII of the pass band that ends at `FINEST`."""


def plane(finest: float = 0.5) -> Frequencies:
    """Return frequencies of the plane, along its axes up to the first that is not below `finest` (cycles per pixel).

    >>> plane().axes[1][:2].round(4).tolist(), plane().radius.size, plane(0.2).radius.size
    ([0.0, 0.0031], 5151, 2556)
    """
    return _plane(int(np.searchsorted(_axis(), min(finest, 0.5) - 1e-9)))


@cache
def _axis() -> FloatArray:
    """Return the plane's frequencies along half an axis, 0 to 0.5 cycles per pixel."""
    count = math.ceil(math.asinh(0.5 * GROWTH / FINEST_STEP) / GROWTH)
    steps = math.asinh(0.5 * GROWTH / FINEST_STEP) * np.arange(count + 1) / count
    return FINEST_STEP / GROWTH * np.sinh(steps)


@cache
def _plane(last: int) -> Frequencies:
    right = _axis()[: last + 1]
    down = np.concatenate([-right[:0:-1], right])
    return Frequencies(np.hypot(down[:, None], right).ravel(), (down, right))


@cache
def _circles(at: Frequencies, directions: int = 48) -> sparse.csr_array:
    """Return the matrix that takes values at the plane's frequencies to their means over circles (RADIAL x F)."""
    angle = np.pi * (np.arange(directions) + 0.5) / directions - np.pi / 2
    places = []
    for axis, way in zip(at.axes, (np.sin(angle), np.cos(angle)), strict=True):
        wanted = np.clip(np.multiply.outer(RADII, way).ravel(), axis[0], axis[-1])
        before = np.clip(np.searchsorted(axis, wanted) - 1, 0, axis.size - 2)
        places.append((before, (wanted - axis[before]) / (axis[before + 1] - axis[before])))
    (row, down), (column, right) = places
    parts = [
        ((down if i else 1 - down) * (right if j else 1 - right) / directions, (row + i) * axis.size + column + j)
        for i in (0, 1)
        for j in (0, 1)
    ]
    ring = np.repeat(np.arange(RADIAL), directions)
    return sparse.csr_array(
        (np.concatenate([w for w, _ in parts]), (np.tile(ring, 4), np.concatenate([n for _, n in parts]))),
        (RADIAL, at.radius.size),
    )


@cache
def _to_coefficients(at: Frequencies) -> tuple[Image, Image]:
    """Matrices that take values along the plane's two axes to the coefficients of cubic splines through them."""
    from scipy.interpolate import make_interp_spline  # deferred: slow to import

    down, right = (make_interp_spline(axis, np.eye(axis.size)).c.astype(np.float32) for axis in at.axes)
    return down, right


@lru_cache(maxsize=16)
def _splines(at: Frequencies, rows: int, columns: int) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Matrices that take these coefficients to values at the frequencies of a real image's spectrum.

    Beyond the plane's ends those are the values there.
    """
    from scipy.interpolate import BSpline, make_interp_spline  # deferred: slow to import

    down, right = (
        BSpline.design_matrix(np.clip(wanted, *axis[[0, -1]]), make_interp_spline(axis, axis).t, 3).astype(np.complex64)
        for axis, wanted in zip(at.axes, (fft.fftfreq(rows), fft.rfftfreq(columns)), strict=True)
    )
    return down, right


def _real_times_complex(left: Image, right: NDArray[Any]) -> NDArray[np.complex64]:
    """Return the product, as one of real matrices."""
    parts = np.ascontiguousarray(right, np.complex64).view(np.float32)
    return np.asarray(np.matmul(left, parts)).view(np.complex64)


def smoothed(image: NDArray[Any], sd: float) -> NDArray[Any]:
    """Return `image` (H x W) smoothed by a Gaussian of `sd` pixels, which ends at 4 sd; mirrored beyond its border.

    As `scipy.ndimage.gaussian_filter`, in a quarter of the time.

    >>> round(float(smoothed(np.eye(9, dtype=np.float32), 1.0)[4, 4]), 4)
    0.2821
    """
    side = 2 * int(4 * sd + 0.5) + 1
    return np.asarray(cv2.GaussianBlur(image, (side, side), sd, borderType=cv2.BORDER_REFLECT))


def disc_pass(radius: FloatArray | float, *, limit: float, power: int, frequencies: Frequencies = ROUND) -> FloatArray:
    """Return pass band (amplitude) of a disc of `radius` pixels that ends where 2 pi radius f is `limit`; broadcasts.

    The disc's transfer has its first zeros at 3.8 and 7.0. The larger `power`, the steeper the band's end.
    """
    return np.asarray(np.exp(-((2 * np.pi * radius * frequencies.radius / limit) ** power) / 2))


def natural_levels(power: FloatArray, occupied: Mask | None = None) -> FloatArray:
    """Return the power at frequency 1 of n natural scenes (power as 1 / f^2), from `power` at RADII (n x F).

    The median over low frequencies; samples that are not `occupied` (F) hold no frequency of a small image.
    """
    low = (LOW[0] < RADII) & (LOW[1] > RADII)
    if occupied is not None:
        low &= occupied
    return np.median(power[:, low] * RADII[low] ** SCENE_SLOPE, axis=1)


def natural_power(level: float, frequencies: Frequencies = ROUND) -> FloatArray:
    """Power of a natural scene whose power at frequency 1 is `level`: level / f^2."""
    return level / np.maximum(frequencies.radius, RADII[1]) ** SCENE_SLOPE


def mean_in_squares(image: Image, side: int) -> Image:
    """Return the mean over the square of `side` pixels about each pixel, odd, of an image mirrored at its borders."""
    return np.asarray(cv2.blur(image, (side, side), borderType=cv2.BORDER_REFLECT), np.float32)


def independent_samples(spectrum: FloatArray, side: int) -> FloatArray:
    """Return the number of independent samples, in a square of `side` pixels, of noise with power `spectrum` (L x F).

    Noise confined to few frequencies repeats itself over the square and averages out less than white noise does.
    """
    lag = np.hypot(*np.mgrid[1 - side : side, 1 - side : side])
    lags, index = np.unique(lag, return_inverse=True)
    correlation = spectrum @ special.j0(2 * np.pi * RADII[:, None] * lags) / spectrum.sum(axis=1, keepdims=True)
    ramp = (side - np.abs(np.arange(1 - side, side))) / side**2
    overlap = np.bincount(index.ravel(), np.outer(ramp, ramp).ravel())
    return np.asarray(1 / (correlation**2 @ overlap))


def mirrored_spectra(images: Sequence[Image], reach: int, size: tuple[int, int]) -> NDArray[np.complex64]:
    """Return half spectra of n images (H x W), mirrored all around to `size`, with `reach` pixels before the first."""
    height, width = images[0].shape
    around = ((reach, size[0] - height - reach), (reach, size[1] - width - reach))
    spectra = np.empty((len(images), size[0], size[1] // 2 + 1), np.complex64)
    for spectrum, image in zip(spectra, images, strict=True):
        spectrum[:] = fft.rfft2(np.pad(image - image.mean(), around, mode="symmetric"), workers=-1)
    return spectra


@dataclass(frozen=True, slots=True)
class Spectra:
    """Whole images as spectra, mirrored all around so that no filter wraps, with where each frequency lies."""

    values: NDArray[np.complex64]  # n x rows x columns
    shape: tuple[int, int]
    size: tuple[int, int]
    reach: int
    position: NDArray[np.int16]  # of each frequency along the radial samples, in PARTS parts of one

    @classmethod
    def of(cls, images: Sequence[Image], reach: int) -> Spectra:
        """Return the spectra of `images`, each H x W, with at least `reach` pixels of mirrored surround."""
        height, width = images[0].shape
        reach = min(reach, height, width)
        rows, columns = (fft.next_fast_len(n + 2 * reach, real=True) for n in (height, width))
        frequency = np.hypot(fft.fftfreq(rows)[:, None], fft.rfftfreq(columns)[None])
        return cls(
            mirrored_spectra(images, reach, (rows, columns)),
            (height, width),
            (rows, columns),
            reach,
            np.rint(frequency * (PARTS * (RADIAL - 1) * np.sqrt(2))).astype(np.int16),
        )

    def over(self, noise_sd: Sequence[float] | FloatArray) -> Spectra:
        """Return the spectra of the images divided by their noise."""
        return replace(self, values=self.values / np.asarray(noise_sd, np.float32)[:, None, None])

    def measure_and_power(self) -> tuple[FloatArray, FloatArray]:
        """Share of all frequencies that falls to each radial sample (F), and each image's mean power there (n x F)."""
        sample = (self.position.ravel() + PARTS // 2) // PARTS
        # A real image's spectrum is stored by half: all but the first column stand for two.
        times = np.full(self.position.shape, 2, np.float32)
        times[:, 0] = 1
        counts = np.bincount(sample, times.ravel(), RADIAL)
        squares = (times * (one.real**2 + one.imag**2) for one in self.values)
        power = np.stack([np.bincount(sample, square.ravel(), RADIAL) for square in squares])
        return counts / counts.sum(), power / (np.maximum(counts, 1) * self.size[0] * self.size[1])

    def measure_and_power_at(self, frequencies: Frequencies) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return `measure_and_power` at the `frequencies` of filters, between them the measure at the radial samples.

        Power over the plane is its radial mean.
        """
        radial, power = self.measure_and_power()
        if frequencies.is_radial:
            return radial, radial, power
        some = radial > 0
        everywhere = np.stack([np.interp(frequencies.radius, RADII[some], row[some]) for row in power])
        return frequencies.measure, radial, everywhere

    def filtered(self, filters: NDArray[Any], frequencies: Frequencies = ROUND) -> Image:
        """Return the sum of the images, each filtered by its row of `filters` (n x F): H x W."""
        if frequencies.is_radial:
            total = np.empty(self.position.shape, np.complex64)
            _sum_filtered(self.values, self.position, _between_samples(filters), total)
        else:
            total = np.zeros(self.position.shape, np.complex64)
            for row, spectrum in zip(filters, self.values, strict=True):
                if row.any():  # a comparison of early views leaves out those after
                    total += self._gain(row, frequencies) * spectrum
        inside = tuple(slice(self.reach, self.reach + n) for n in self.shape)
        return np.asarray(fft.irfft2(total, self.size, overwrite_x=True)[inside])

    def _gain(self, row: NDArray[Any], frequencies: Frequencies) -> NDArray[Any]:
        """Return a filter over the plane (F) at the images' own frequencies."""
        (first, second), (down, right) = _to_coefficients(frequencies), _splines(frequencies, *self.size)
        across = _real_times_complex(first, row.reshape(len(first), -1))
        coefficients = _real_times_complex(second, across.T)
        return np.asarray(down @ (right @ coefficients).T)

    def stack(self, filters: NDArray[Any], frequencies: Frequencies = ROUND) -> Image:
        """One filtered image for each of `filters` (r x n x F): r x H x W."""
        images = np.empty((len(filters), *self.shape), np.float32)

        def some(first: int, last: int) -> None:
            for number in range(first, last):
                images[number] = self.filtered(filters[number], frequencies)

        share_rows(len(filters), some)
        return images


def _between_samples(filters: NDArray[Any]) -> Image:
    """Interpolate `filters` (n x RADIAL) linearly to the PARTS parts of a sample, and to the last sample."""
    part = (np.arange(PARTS) / PARTS).astype(np.float32)
    first, rise = filters[:, :-1, None].astype(np.float32), np.diff(filters, axis=1)[:, :, None].astype(np.float32)
    between = (first + rise * part).reshape(len(filters), -1)
    return np.append(between, filters[:, -1:].astype(np.float32), axis=1)


@njit(nogil=True, cache=True, fastmath=True)
def _sum_filtered(spectra, position, gains, total):  # type: ignore[no-untyped-def]
    """Sum the `spectra`, each times its `gains` at the `position` of each frequency."""
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            total[i, j] = gains[0, position[i, j]] * spectra[0, i, j]
        for view in range(1, len(spectra)):
            for j in range(total.shape[1]):
                total[i, j] += gains[view, position[i, j]] * spectra[view, i, j]
