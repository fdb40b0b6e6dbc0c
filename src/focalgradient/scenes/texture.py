"""Natural textures: random fields with the 1/f amplitude spectrum of natural images."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields
from focalgradient.quantities import Range, Seed

__all__ = ["BELOW_NYQUIST", "NATURAL_SLOPE", "TILE", "Texture", "random_field"]

TILE = 1024
"""Number of texels along one side of the square, periodic tile of a texture."""

NATURAL_SLOPE = 1.0
"""Exponent with which the amplitude of natural scenes falls with spatial frequency (Field 1987): half of that of their
power, which depth from blur assumes (`focalgradient.depth.filters.SCENE_SLOPE`)."""

BELOW_NYQUIST = float(np.nextafter(0.5, 0))
"""Frequency in cycles per pixel just below the Nyquist limit, at which a field would have no phase."""


@dataclass(frozen=True, slots=True)
class Texture:
    """Reflectance of a surface: a lognormal random field with a 1/f amplitude spectrum.

    The field is the cubic spline through a periodic array of 1024 x 1024 texels, so it is exactly defined at every
    point and band-limited to half a cycle per texel. With texels of the size of a pixel (seen from the camera) it is as
    detailed as a photograph in focus, with little aliasing.

    Parameters
    ----------
    seed
        Random seed of the field.
    texel
        Texel size: metres on the surface, or radians seen from the camera if `projected`.
    mean
        Mean reflectance, between 0 and 1.
    contrast
        Standard deviation / mean over the tile; 0 is a uniform surface.
    projected
        Whether the texture is projected from the camera, which gives it the same angular scale at every distance and
        slant.

    Raises
    ------
    InputError
        If a number is out of range, or the reflectance five standard deviations above the mean exceeds 1.

    Examples
    --------
    >>> values = Texture(seed=1, mean=0.3, contrast=0.2).values()
    >>> values.shape, round(float(values.mean()), 3), round(float(values.std() / values.mean()), 3)
    ((1024, 1024), 0.3, 0.2)
    """

    seed: Seed = 0
    texel: Annotated[float, Range("metres, or radians where it is projected", positive=True)] = 0.3e-3
    mean: float = 0.35
    contrast: float = 0.2
    projected: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if not (self.contrast >= 0 and self.mean > 0 and self.mean * math.exp(5 * self._spread) <= 1):
            raise InputError(
                f"mean {self.mean!r} with contrast {self.contrast!r} is not a reflectance between 0 and 1: "
                "lower the mean or the contrast, both positive."
            )

    @property
    def _spread(self) -> float:
        """Standard deviation of the logarithm of reflectance."""
        return math.sqrt(math.log1p(self.contrast * self.contrast))

    def values(self) -> NDArray[np.float32]:
        """Return reflectance at the texels, 1024 x 1024, periodic; row i, column j is (j, i) texels from the anchor."""
        field = np.exp(self._spread * random_field((TILE, TILE), self.seed, finest=0.5))
        return np.asarray(self.mean / field.mean() * field, np.float32)

    def coefficients(self) -> NDArray[np.float32]:
        """Return the coefficients, 1024 x 1024, of the cubic B-spline that interpolates `values`."""
        return _coefficients(self.seed, self.mean, self.contrast)


@lru_cache(maxsize=16)
def _coefficients(seed: int, mean: float, contrast: float) -> NDArray[np.float32]:
    # Cubic B-splines weight neighbouring texels 1/6, 4/6, 1/6, which is inverted exactly in the frequency domain.
    seen = (2 + np.cos(2 * np.pi * np.fft.fftfreq(TILE))) / 3
    spectrum = np.fft.rfft2(Texture(seed, mean=mean, contrast=contrast).values().astype(float))
    spectrum /= seen[:, None] * seen[None, : TILE // 2 + 1]
    return np.fft.irfft2(spectrum, (TILE, TILE)).astype(np.float32)


def random_field(
    shape: tuple[int, int],
    seed: int | Sequence[int] | np.random.Generator,
    *,
    slope: float = NATURAL_SLOPE,
    coarsest: float = 0.0,
    finest: float = math.inf,
) -> FloatArray:
    """Return a periodic Gaussian field with mean 0, standard deviation 1 and amplitude spectrum 1/f^slope.

    Parameters
    ----------
    shape
        Height and width in pixels.
    seed
        Random seed, or a generator.
    slope
        Exponent of the amplitude spectrum; 1 for natural images.
    coarsest
        Frequency below which the amplitude is constant, in cycles per pixel.
    finest
        Highest frequency in any direction, in cycles per pixel; those of the pixels' corners exceed 1/2.

    Examples
    --------
    >>> field = random_field((64, 64), seed=1)
    >>> field.shape, round(float(field.std()), 6)
    ((64, 64), 1.0)
    """
    frequency = np.maximum(np.hypot(fft.fftfreq(shape[0])[:, None], fft.rfftfreq(shape[1])), coarsest)
    frequency[0, 0] = np.inf
    white = fft.rfft2(np.random.default_rng(seed).standard_normal(shape))
    field: FloatArray = fft.irfft2(np.where(frequency > finest, 0, white / frequency**slope), s=shape)
    return field / field.std()
