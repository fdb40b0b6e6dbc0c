"""Target of an accommodating eye: a textured plane at one vergence, and the patch of retina that it falls on.

The texture is periodic, so that a small patch contains everything that blur reaches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields
from focalgradient.eye.chromatic import PRIMARIES_NM
from focalgradient.eye.cones import Cones
from focalgradient.eye.model_eye import Eye
from focalgradient.optics import Optics
from focalgradient.psf import pixel_transfer
from focalgradient.quantities import Range
from focalgradient.scenes.texture import BELOW_NYQUIST, random_field
from focalgradient.view import View

__all__ = ["BandOptics", "Target"]


class BandOptics(Optics, Protocol):
    """Optics of one waveband with a known transfer, such as `Cones`."""

    @property
    def light(self) -> str:
        """Name of the waveband: see `focalgradient.optics.Optics`."""

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> FloatArray:
        """Return the transfer of isotropic blur: see `focalgradient.optics.own_blur`."""


@dataclass(frozen=True, slots=True)
class Target:
    """Texture of a target: natural (amplitude falls as 1 / frequency), or part of its spectrum.

    Parameters
    ----------
    contrast
        Standard deviation over mean, of the texture before any filter: 0 is an empty field.
    correlation
        Correlation of the S cones' texture with the others'.
    finest_cpd
        Cut-off frequency of the target's own spectrum in cycles per degree: infinite for a sharp target.
    shape, pixel_angle
        Height and width in pixels of the retinal patch, and the visual angle in radians of one.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> from focalgradient.eye import Cones, Eye
    >>> cones = [Cones.of(Eye(0.004, 1.0), band) for band in ("L+M", "S")]
    >>> views = Target().views(cones, 1.0, noise=0.01, random=np.random.default_rng(1))
    >>> [view.shape for view in views], bool(views[0].image.std() > views[1].image.std())
    ([(64, 64), (64, 64)], True)
    """

    contrast: Annotated[float, Range("shares of the mean", 0)] = 0.2
    correlation: Annotated[float, Range("shares", most=1, positive=True)] = 0.95
    finest_cpd: Annotated[float, Range("cycles per degree", positive=True, finite=False)] = math.inf
    shape: tuple[int, int] = (64, 64)
    pixel_angle: Annotated[float, Range("radians", positive=True)] = math.radians(1 / 60)

    def __post_init__(self) -> None:
        check_fields(self)
        if min(self.shape) < 16:
            raise InputError(f"shape is {self.shape!r}, but a patch of at least 16 x 16 pixels is needed.")

    def views(
        self,
        cones: Sequence[BandOptics],
        vergence: float,
        *,
        noise: float,
        random: np.random.Generator,
        texture: int = 0,
        contrast: float = 1.0,
        seen_as: Sequence[BandOptics] | None = None,
        shown: Sequence[FloatArray] | None = None,
    ) -> list[View]:
        """Return the view of each of the `cones` of the target at `vergence` (D), with a mean of 1.

        Parameters
        ----------
        cones
            Optics that form the views, one for each waveband.
        vergence
            Vergence of the target in dioptres.
        noise
            Standard deviation of every pixel's noise over the mean.
        random
            Random generator of the noise.
        texture
            Index of the place fixated on the target: each has its own texture.
        contrast
            Factor on the target's contrast at this moment.
        seen_as
            Optics that the eye assumes for the views, if other than `cones`.
        shown
            Filters applied to the displayed picture, one for each of the cones, on the grid of `frequency`.
        """
        size = self.contrast * contrast
        radii, place = _radii(self.shape)
        passed = self._filter()
        views = []
        for number, one in enumerate(cones):
            shares = (1.0, 0.0)
            if one.light != cones[0].light:
                shares = (self.correlation, math.sqrt(1 - self.correlation**2))
            blur = one.transfer(radii / self.pixel_angle, vergence)[place]
            field = blur * sum(share * _field(self.shape, texture, part) for part, share in enumerate(shares) if share)
            if shown is not None:
                field = field * shown[number]
            image = 1 + size * np.fft.irfft2(field * passed, self.shape)
            image = image + noise * random.standard_normal(self.shape)
            views.append(View(image, (seen_as or cones)[number], self.pixel_angle))
        return views

    def film(
        self,
        vergences: ArrayLike,
        accommodation: ArrayLike,
        pupil_diameter: float,
        *,
        texture: int = 0,
        enlarged: int = 5,
    ) -> list[NDArray[np.uint8]]:
        """Return the retinal image of the target, grey in white light, at every moment of a course, in colour.

        Parameters
        ----------
        vergences, accommodation
            Vergence of the target and of the plane in focus at each moment, in dioptres.
        pupil_diameter
            Metres.
        texture
            Index of the place fixated.
        enlarged
            Factor by which the frames are larger than the patch of retina.

        Returns
        -------
        list
            8-bit frames, H x W x 3, with twice the mean light as white and a gamma of 2.2.

        Examples
        --------
        >>> Target(contrast=0.35).film([1.0], [1.5], 0.004)[0].shape
        (320, 320, 3)
        """
        frames, unused = [], np.random.default_rng(0)
        for vergence, focus in np.column_stack([vergences, accommodation]).tolist():
            cones = [Cones(Eye(pupil_diameter, focus), "L+M", (nm,)) for nm in PRIMARIES_NM]
            views = self.views(cones, vergence, noise=0.0, random=unused, texture=texture)
            light = np.clip(np.stack([view.image for view in views], axis=-1) / 2, 0, 1) ** (1 / 2.2)
            small = np.rint(255 * light).astype(np.uint8)
            frames.append(small.repeat(enlarged, axis=0).repeat(enlarged, axis=1))
        return frames

    @property
    def frequency(self) -> FloatArray:
        """Frequencies in cycles per radian of the patch's half spectrum."""
        radii, place = _radii(self.shape)
        return np.asarray(radii[place] / self.pixel_angle)

    def _filter(self) -> FloatArray:
        down, right = np.fft.fftfreq(self.shape[0])[:, None], np.fft.rfftfreq(self.shape[1])
        cpd = np.radians(self.frequency)
        return np.asarray(pixel_transfer(down, right) * (cpd <= self.finest_cpd))


@lru_cache(maxsize=8)
def _radii(shape: tuple[int, int]) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return the distinct frequencies (cycles per pixel) of a half spectrum, and which of them each place has."""
    radial = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1]))
    # Equal frequencies differ by rounding where their parts are exchanged.
    radii, place = np.unique(radial.round(12), return_inverse=True)
    return radii, place.reshape(radial.shape)


@lru_cache(maxsize=64)
def _field(shape: tuple[int, int], texture: int, part: int) -> NDArray[np.complex128]:
    """Return the half spectrum of a natural texture with a standard deviation of 1; deterministic in its arguments."""
    return np.fft.rfft2(random_field(shape, [7919, texture, part], finest=BELOW_NYQUIST))
