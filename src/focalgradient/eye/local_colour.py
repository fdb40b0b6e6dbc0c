"""The spectrum of a texture at each place, as an eye's own cones show it; and cones that see it.

The focus of a band moves with the colour that a texture varies in, which is not that of its mean: light and shade of a
photograph of brown wood are nearly grey. So the spectrum of the local *contrast* is estimated: how what L, M and S
cones catch varies with what L and M catch together. Their blurs differ, which changes these ratios by depth: at each
candidate depth the spectrum is the one that gives the ratios seen through the blurs there. Over the frame the blur is a
mixture of that of a few colours (`focalgradient.optics.Mixture`), evenly along the focus of the L and M cones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import attrgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from focalgradient.arrays import FloatArray
from focalgradient.depth.filters import SCENE_SLOPE
from focalgradient.errors import InputError
from focalgradient.eye.cones import Cones
from focalgradient.eye.protocol import EyeModel, chromatic_scale
from focalgradient.eye.spectral import CLASSES, SpectralBasis
from focalgradient.optics import Mixture

__all__ = ["ColouredCones", "KnownSpectrum", "LocalColours", "SeenContrast", "estimate_colours"]


SCALES = ((3.0, 12.0), (3.0, 12.0), (6.0, 20.0))
"""Standard deviations (pixels) of the Gaussians between which detail of L, M and S images is compared: the light of
S cones is blurred more, and compared in coarser detail. Our choice."""

WINDOW = 10.0
"""Standard deviation of the window (pixels) in which contrasts are compared: about that of depth. Our choice."""

PRIOR = 0.1
"""Contrast of the frame's mean colour that is added to every place, relative to the median contrast. Our choice."""

STEP_D, MOST = 0.06, 6
"""Focus (D) from one colour of the mixture to the next, and the greatest number of them: a focus between two is met to
0.03 D, and by interpolation to far less. Our choice."""

EXTREME = 0.02
"""Share of the texture's contrast whose colour may lie beyond each end of the mixture's. Our choice."""

LEAST_POWER = 1e-4
"""Power of a transfer below which no covariance is divided by it."""

LEAST_CONTRAST = 0.01
"""Minimum contrast of a band, relative to that of L and M cones: S cones hardly respond to red."""

GAIN_SD, WIDER = 0.15, 1.7
"""SD of the log ratio of S-cone contrast to L- and M-cone contrast between coarse and fine detail (up to 0.2 in
photographs); and factor by which the error of a slope exceeds its standard error, as of wavebands' gains
(`focalgradient.depth.equalise.wavebands`). Our choice."""

ROUNDS = 3
"""Times that the spectrum at a depth is solved for, with the blur of the last one."""

FREQUENCIES = np.linspace(0.004, 0.25, 40)
"""Cycles per pixel at which the blur of compared detail is averaged."""


class Spectrum(Protocol):
    """The spectrum of a texture, which may be the likelier one at each candidate depth."""

    def amounts(self, basis: SpectralBasis, vergences: FloatArray) -> FloatArray:
        """Return the amounts of the basis components if the texture lies at each vergence (D): L x K."""


@dataclass(frozen=True, slots=True)
class KnownSpectrum:
    """A spectrum that is known: the amounts of the components (K)."""

    amount: tuple[float, ...]

    def amounts(self, basis: SpectralBasis, vergences: FloatArray) -> FloatArray:
        """Return the same amounts at every vergence (D)."""
        return np.broadcast_to(np.asarray(self.amount, float), (len(vergences), basis.components))


@dataclass(frozen=True, slots=True)
class SeenContrast:
    """A spectrum of known visible contrast: that of L, M and S cones, over that of L and M together.

    Parameters
    ----------
    slopes
        The three ratios, each at its scale (`SCALES`).
    eye
        The eye that saw them.
    pixel_angle
        Angle in radians of a pixel.
    """

    slopes: tuple[float, float, float]
    eye: Any
    pixel_angle: float

    def amounts(self, basis: SpectralBasis, vergences: FloatArray) -> FloatArray:
        """Return the amounts of the primaries whose blurred contrasts have these ratios, at each vergence (D)."""
        return _seen_amounts(self, basis, tuple(vergences.tolist()))


@lru_cache(maxsize=32)
def _seen_amounts(spectrum: SeenContrast, basis: SpectralBasis, vergences: tuple[float, ...]) -> FloatArray:
    """Return the amounts of a spectrum at each vergence; kept, as every view asks for them."""
    classes, both = _blurs(basis, spectrum.eye, spectrum.pixel_angle, vergences)
    catch, whole, slopes = basis.class_catches, basis.catch("L+M"), np.asarray(spectrum.slopes)
    weight = np.stack([_passed(*scale) for scale in SCALES])  # class x F
    found = np.broadcast_to(_amounts(basis, slopes), (len(vergences), basis.components))
    for _ in range(ROUNDS):
        seen = np.einsum("lk,k,klf->lf", found, whole, both)
        size = np.einsum("cf,lf->lc", weight, seen**2)
        ratio = np.einsum("cf,cklf,lf->lck", weight, classes, seen) / np.maximum(size, 1e-9)[..., None]
        # Towards no difference of blur where next to nothing passes.
        ratio = np.clip(ratio, 0.3, 3.0)
        found = _normed(np.linalg.pinv(catch * ratio) @ slopes, whole)
    return found


@lru_cache(maxsize=8)
def _blurs(
    basis: SpectralBasis, eye: EyeModel, pixel_angle: float, vergences: tuple[float, ...]
) -> tuple[FloatArray, FloatArray]:
    """Transfer at FREQUENCIES of what each class catches of each component (3 x K x L x F), and L+M (K x L x F)."""
    levels = np.asarray(vergences)

    def of(band: str) -> FloatArray:
        at = FREQUENCIES / pixel_angle
        return np.stack([part.through_focus(np.zeros_like(at), at, levels).real for part in basis.cones(eye, band)])

    return np.stack([of(band) for band in CLASSES]), of("L+M")


def _passed(fine: float, coarse: float) -> FloatArray:
    """Power of natural texture between two scales, at FREQUENCIES."""
    passed = np.exp(-2 * (np.pi * FREQUENCIES * fine) ** 2) - np.exp(-2 * (np.pi * FREQUENCIES * coarse) ** 2)
    power = passed**2 / FREQUENCIES ** (SCENE_SLOPE - 1)  # over rings of area f
    return np.asarray(power / power.sum())


def _amounts(basis: SpectralBasis, slopes: FloatArray) -> FloatArray:
    """Return the amounts of components (... x K) whose contrast has these ratios (... x 3) without blur."""
    return _normed(slopes @ np.linalg.pinv(basis.class_catches).T, basis.catch("L+M"))


def _normed(amounts: FloatArray, whole: FloatArray) -> FloatArray:
    """Clip the amounts at 0 and scale them to a total catch of 1 by L and M cones."""
    positive = np.clip(amounts, 0, None)
    return positive / np.maximum(positive @ whole, 1e-9)[..., None]


@dataclass(frozen=True, slots=True)
class LitCones:
    """Cones imaging a texture of one spectrum: their blur is the mean over its components, weighted by catch.

    `usual` is their catch of the field's mean spectrum, relative to that of L and M cones together, and `rest` the
    residual covariance of the components' amounts (`LocalColours.rest_of_amounts`).
    """

    whole: Cones
    basis: SpectralBasis
    spectrum: Spectrum
    usual: float
    rest: tuple[tuple[float, ...], ...] = ()

    aperture_diameter = property(attrgetter("whole.aperture_diameter"), doc="Diameter of the pupil in metres.")
    focus_vergence = property(attrgetter("whole.focus_vergence"), doc="Focus in the mean colour of the field, in D.")
    light = property(attrgetter("whole.light"), doc="Name of the band.")
    isotropic = property(attrgetter("whole.isotropic"), doc="Whether blur is alike in all directions.")

    def contrast(self, vergences: FloatArray) -> FloatArray:
        """Return the contrast of the texture at each vergence (D), relative to that of the field's mean spectrum."""
        caught = self.spectrum.amounts(self.basis, np.asarray(vergences, float)) @ self.basis.catch(self.light)
        return np.asarray(np.maximum(caught, LEAST_CONTRAST) / self.usual)

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> FloatArray | NDArray[np.complex128]:
        """Return the transfer at frequencies (cycles per radian) for L vergences (D): L x the frequencies' shape."""
        levels = np.atleast_1d(np.asarray(vergences, float))
        amounts = self.spectrum.amounts(self.basis, levels)

        def parts(light: str, finest_cpd: float) -> list[NDArray[Any]]:
            """Return the transfer of the light of each component."""
            every = self.basis.cones(self.whole.eye, light, finest_cpd=finest_cpd, model=self.whole.model)
            keys = *_kept(frequency_y), *_kept(frequency_x), tuple(levels.tolist())
            return [_component_transfer(one, *keys) for one in every]

        own = parts(self.light, self.whole.finest_cpd)
        caught = amounts * self.basis.catch(self.light)
        sizes = np.maximum(caught.sum(axis=1), 1e-9)
        seen = _mix(caught / sizes[:, None], own)
        if not self.rest or self.light != "S":
            return seen
        # S cones' texture that the spectrum leaves is blue light, which L and M cones see too, in its own focus.
        # Of what L and M cones see, S cones show the regression: covariance over variance.
        whole = parts("L+M", np.inf)
        both, catch = self.basis.catch("L+M"), self.basis.catch(self.light)
        shown = _mix(amounts * both, whole)
        rest = np.asarray(self.rest)
        alike = [np.tensordot(row * both, np.stack(whole), 1).conj() for row in rest]
        cross = _mix(catch / sizes[:, None], [a * b for a, b in zip(own, alike, strict=True)])
        more = np.tensordot(both, np.stack([(a * b).real for a, b in zip(whole, alike, strict=True)]), 1)
        return seen + (shown * cross - seen * more) / (np.abs(shown) ** 2 + more + LEAST_POWER)


def _mix(shares: FloatArray, parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Sum of `parts` (K of L x the frequencies' shape) by their `shares` at each level (L x K)."""
    shape = -1, *(1,) * (parts[0].ndim - 1)
    return np.sum([share.reshape(shape) * part for share, part in zip(shares.T, parts, strict=True)], axis=0)


def _kept(frequency: ArrayLike) -> tuple[bytes, tuple[int, ...]]:
    """Return the frequencies as a key: their numbers, and their shape."""
    numbers = np.ascontiguousarray(frequency, np.float64)
    return numbers.tobytes(), numbers.shape


@lru_cache(maxsize=12)
def _component_transfer(
    cones: Cones,
    down: bytes,
    down_shape: tuple[int, ...],
    right: bytes,
    right_shape: tuple[int, ...],
    vergences: tuple[float, ...],
) -> FloatArray | NDArray[np.complex128]:
    """Transfer of cones in the light of one component; kept, as all spectra of a mixture are mixes of the same."""
    y, x = np.frombuffer(down).reshape(down_shape), np.frombuffer(right).reshape(right_shape)
    return cones.through_focus(y, x, np.asarray(vergences))


@dataclass(frozen=True, slots=True, eq=False)
class LocalColours:
    """Spectra of the texture over the field: C of them, their shares of each pixel, and how well they are known.

    Parameters
    ----------
    basis
        The light of which spectra are mixes.
    spectra
        The spectra, each a `KnownSpectrum` or a `SeenContrast`.
    mean
        Amounts of the components on average over the field (K).
    shares
        Share of each spectrum at each pixel, C x H x W, in sum 1.
    focus_sd
        Standard deviation of the focus of the L and M cones at each pixel (D, H x W).
    light
        Amounts of the components in the mean light of the field (K), which differ from those in its contrast.
    gain_sd
        Standard deviation of the logarithm of the contrast that S cones see over that of L and M cones.
    rest
        Covariance of what L, M and S cones catch that the spectra leave, over the variance of what L and M cones
        catch together (3 x 3); empty: none.
    """

    basis: SpectralBasis
    spectra: tuple[Spectrum, ...]
    mean: FloatArray
    shares: FloatArray
    focus_sd: FloatArray
    light: FloatArray
    gain_sd: float = np.inf
    rest: tuple[tuple[float, ...], ...] = ()

    @classmethod
    def known(cls, basis: SpectralBasis, amounts: Sequence[float], shape: tuple[int, int]) -> LocalColours:
        """Return one colour all over a field of `shape` (H, W), of which the spectrum is known.

        >>> red = LocalColours.known(SpectralBasis.of_srgb(), [0.8, 0.1, 0.1], (48, 64))
        >>> red.shares.shape, float(red.focus_sd.max())
        ((1, 48, 64), 0.0)
        """
        amount = np.asarray(amounts, float)
        return cls(
            basis, (KnownSpectrum(tuple(amount.tolist())),), amount, np.ones((1, *shape)), np.zeros(shape), amount
        )

    def lit_by(self, basis: SpectralBasis) -> LocalColours:
        """Return the colours in another light, that of a `basis` of surfaces.

        What cones catch, over what they catch of white, stays as it was seen; of known surfaces the amounts stay.
        """
        if all(isinstance(one, KnownSpectrum) for one in self.spectra):
            if basis.components != self.basis.components:
                raise InputError(
                    f"colours are known as amounts of {self.basis.components} components, but those of surfaces in "
                    f"another light must be of {basis.components}: give them in SpectralBasis.of_srgb()."
                )
            return replace(self, basis=basis)
        mean, light = (_amounts(basis, self.basis.class_catches @ one) for one in (self.mean, self.light))
        return replace(self, basis=basis, mean=mean, light=light)

    def rest_of_amounts(self) -> tuple[tuple[float, ...], ...]:
        """Return the covariance of the components' amounts that the spectra leave (K x K)."""
        if not self.rest:
            return ()
        both = self.basis.catch("L+M")
        back = np.linalg.pinv(self.basis.class_catches)
        # L and M cones together see none of it.
        without = (np.eye(len(both)) - np.outer(self.mean / (self.mean @ both), both)) @ back
        return tuple(tuple(row) for row in (without @ np.asarray(self.rest) @ without.T).tolist())

    def seen_by(self, cones: Cones) -> ColouredCones:
        """Return the cones with the blur of these colours."""
        light = self.basis.mixed(cones.light, self.mean)
        whole = Cones.in_light(cones.eye, cones.light, light, finest_cpd=cones.finest_cpd, model=cones.model)
        base = whole.eye, whole.light, whole.wavelengths_nm, whole.finest_cpd, whole.model, whole.weights, cones.scatter
        return ColouredCones(*base, self)


@dataclass(frozen=True, slots=True)
class ColouredCones(Cones):
    """Cones before surfaces of several colours: at each pixel they have the blur of the light that it sends.

    As `Cones` they have that of the mean colour.

    Parameters
    ----------
    colours
        The colours, and where they are.

    Examples
    --------
    >>> red = LocalColours.known(SpectralBasis.of_srgb(), [1, 0, 0], (48, 64))
    >>> from focalgradient import Eye
    >>> cones = Cones.of(Eye(0.004, 1.0), "L+M")
    >>> round(red.seen_by(cones).focus_vergence - cones.focus_vergence, 2)
    -0.3
    """

    colours: LocalColours | None = None

    @property
    def assumption(self) -> str:
        """None about the colour, where it is given."""
        return super(ColouredCones, self).assumption if self.colours is None else ""

    @property
    def mixture(self) -> Mixture | None:
        """How the blur varies over the field."""
        if self.colours is None:
            return None
        base = self.eye, self.light, self.wavelengths_nm, self.finest_cpd, self.model, self.weights, self.scatter
        plain = Cones(*base)
        basis, own, whole = self.colours.basis, self.colours.basis.catch(self.light), self.colours.basis.catch("L+M")
        varies, shines = (
            max(float(amounts @ own) / max(float(amounts @ whole), 1e-9), LEAST_CONTRAST)
            for amounts in (self.colours.mean, self.colours.light)
        )
        rest = self.colours.rest_of_amounts()
        parts = tuple(LitCones(plain, basis, one, varies, rest) for one in self.colours.spectra)
        return Mixture(parts, self.colours.shares, self.colours.focus_sd, varies / shines, self.colours.gain_sd)


def estimate_colours(
    cones: NDArray[np.floating], basis: SpectralBasis, eye: EyeModel, pixel_angle: float
) -> LocalColours:
    """Estimate the spectra of a texture from what L, M and S cones catch of it (H x W x 3, of white 1) through an eye.

    Examples
    --------
    A red texture, in focus.

    >>> from focalgradient import Eye
    >>> texture = 1 + 0.2 * np.random.default_rng(1).standard_normal((64, 64, 1))
    >>> basis = SpectralBasis.of_srgb()
    >>> colours = estimate_colours(texture * (basis.class_catches @ [0.8, 0.1, 0.1]), basis, Eye(0.002, 1.0), 3e-4)
    >>> (colours.mean / colours.mean.sum()).round(2).tolist()
    [0.8, 0.1, 0.1]
    """
    catch, both = basis.class_catches, basis.catch("L+M")
    # What L and M cones catch together is this mix of either's.
    mix = np.append(np.linalg.lstsq(catch[:2].T, both, rcond=None)[0], 0.0)
    found, variance, power, gain_sd = [], [], np.zeros(cones.shape[:2]), 0.0
    for number, (fine, coarse) in enumerate(SCALES):
        own, whole = (_between(image, fine, coarse) for image in (cones[..., number], cones @ mix))
        square, product, rest = (_local(image) for image in (whole**2, own * whole, own**2))
        little = PRIOR * float(np.median(square))
        frame = float(product.mean() / max(square.mean(), 1e-30))
        slope = (product + little * frame) / (square + little)
        left = np.maximum(rest - 2 * slope * product + slope**2 * square, 0)
        samples = WINDOW**2 / fine**2 / 2
        found.append(slope)
        variance.append(left / np.maximum(square + little, 1e-30) / samples)
        power = power if number else square
        gain_sd = float(np.hypot(GAIN_SD, WIDER * _share_left(own, whole, fine)))  # that of S cones comes last
    slopes = np.stack(found, axis=-1)
    amounts = _amounts(basis, slopes)
    differences = np.array([basis.mixed("L+M", one).difference() for one in np.eye(basis.components)])
    scale = chromatic_scale(eye)
    focus = scale * (amounts @ (both * differences))
    by_class = scale * (both * (differences - differences @ both)) @ np.linalg.pinv(catch)
    focus_sd = WIDER * np.sqrt(sum(one * weight**2 for one, weight in zip(variance, by_class, strict=True)))
    weights, shares = _parted(focus, power)
    own = np.einsum("chw,hwk->ck", weights, slopes) / weights.sum(axis=(1, 2))[:, None]
    spectra = tuple(SeenContrast((float(r), float(g), float(b)), eye, pixel_angle) for r, g, b in own)
    mean = np.average(amounts.reshape(-1, len(both)), 0, power.ravel())
    light = _amounts(basis, cones.mean(axis=(0, 1)))
    return LocalColours(basis, spectra, mean, shares, focus_sd, light, gain_sd, _rest(cones, mix))


def _rest(cones: NDArray[np.floating], mix: FloatArray) -> tuple[tuple[float, ...], ...]:
    """Return the covariance of what the cones catch that the spectrum at each place leaves (`LocalColours.rest`)."""
    fine, coarse = SCALES[2]
    images = [_between(cones[..., number], fine, coarse) for number in range(3)]
    whole = _between(cones @ mix, fine, coarse)
    square = _local(whole**2)
    little = PRIOR * float(np.median(square))
    left = []
    for own in images:
        frame = float(np.mean(own * whole)) / max(float(np.mean(whole**2)), 1e-30)
        left.append(own - (_local(own * whole) + little * frame) / (square + little) * whole)
    covariance = np.cov(np.stack(left).reshape(3, -1), bias=True) / max(float(np.mean(whole**2)), 1e-30)
    return tuple(tuple(row) for row in covariance.tolist())


def _share_left(own: FloatArray, whole: FloatArray, fine: float) -> float:
    """Standard error of the slope of `own` by `whole` (H x W) over the slope, of detail coarser than `fine` pixels."""
    product, square = float(np.mean(own * whole)), float(np.mean(whole**2))
    left = max(float(np.mean(own**2)) * square - product**2, 0.0)
    samples = own.size / (4 * np.pi * fine**2)
    return float(np.sqrt(left / max(product**2, 1e-30) / samples))


def _parted(focus: FloatArray, power: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Power and share (C x H x W) at each pixel of a few colours that lie evenly along the `focus` (D, H x W)."""
    order = np.argsort(focus, axis=None)
    reached = np.cumsum(power.ravel()[order])
    low, high = np.interp((EXTREME, 1 - EXTREME), reached / reached[-1], focus.ravel()[order])
    count = int(np.clip(1 + np.ceil((high - low) / STEP_D), 1, MOST)) if high - low > STEP_D / 2 else 1
    place = np.clip((focus - low) / max(high - low, 1e-9), 0, 1) * (count - 1)
    shares = np.stack([np.clip(1 - np.abs(place - one), 0, 1) for one in range(count)])
    weights = shares * power
    some = weights.sum(axis=(1, 2)) > 1e-6 * power.sum()
    shares = shares[some]
    shares[0] += 1 - shares.sum(axis=0)
    return weights[some], shares


def _between(image: NDArray[np.floating], fine: float, coarse: float) -> FloatArray:
    """Return the detail between two scales (sd of Gaussians, in pixels)."""
    return np.asarray(ndimage.gaussian_filter(image, fine) - ndimage.gaussian_filter(image, coarse), float)


def _local(image: FloatArray) -> FloatArray:
    return np.asarray(ndimage.gaussian_filter(image, WINDOW), float)
