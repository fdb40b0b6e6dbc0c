"""Blurred steps on a pixel grid, integrated over every pixel by quadrature: what the edge fits never do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Profile = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def image_of(profile: Profile, angle: float, shape: tuple[int, int], *, noise: float = 0.01, seed: int = 0):
    """`profile` of the distance from the frame's middle along the normal at `angle`, with noise; 32 bits."""
    nodes, weights = np.polynomial.legendre.leggauss(5)
    row, column = (np.arange(n) - (n - 1) / 2 for n in shape)
    total = np.zeros(shape)
    for v, of_v in zip(nodes / 2, weights / 2, strict=True):
        for u, of_u in zip(nodes / 2, weights / 2, strict=True):
            total += of_v * of_u * profile((column + u) * np.cos(angle) + (row[:, None] + v) * np.sin(angle))
    return (total + noise * np.random.default_rng(seed).standard_normal(shape)).astype(np.float32)


def step(sigma: float, contrast: float = 0.5, at: float = 0.0) -> Profile:
    """A step about 0.5 blurred by a Gaussian."""
    return lambda x: 0.5 + contrast * (ndtr((x - at) / sigma) - 0.5)


def bar(sigma: float, width: float, contrast: float = 0.5) -> Profile:
    """A bright bar, blurred by a Gaussian."""
    return lambda x: 0.5 + contrast * (ndtr((x + width / 2) / sigma) - ndtr((x - width / 2) / sigma))
