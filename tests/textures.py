"""Textures like those of natural scenes: their amplitude falls as 1/frequency."""

import numpy as np
from numpy.typing import NDArray


def natural_spectrum(
    shape: tuple[int, int], random: np.random.Generator, contrast: float = 0.2
) -> NDArray[np.complex128]:
    """Return the `rfft2` of a texture of mean 0 with this standard deviation."""
    radius = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1]))
    radius[0, 0] = np.inf
    spectrum = np.fft.rfft2(random.standard_normal(shape)) / radius
    return spectrum * (contrast / np.fft.irfft2(spectrum, shape).std())


def natural(shape: tuple[int, int], seed: int = 0) -> NDArray[np.float64]:
    """Return a texture of mean 1 and contrast 0.2."""
    return 1 + np.fft.irfft2(natural_spectrum(shape, np.random.default_rng(seed)), shape)
