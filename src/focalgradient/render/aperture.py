"""Sampling of an aperture for ray casting, in blur radii, for blur of any shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focalgradient.psf import Disc, Psf
from focalgradient.render.shaped import shape_picture

__all__ = ["aperture_points"]

PICTURE_RADIUS_PX = 96.0
"""Blur radius in pixels of the picture from which shapes other than the disc are sampled: positions are accurate to 1 %
of the radius."""


def aperture_points(psf: Psf, square: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (x, y) in blur radii, distributed like the radiance of a blur of shape `psf`.

    Parameters
    ----------
    psf
        Blur shape.
    square
        Points of the unit square centred on 0, shape ... x 2, from -1/2 to 1/2. The mapping preserves uniformity.

    Examples
    --------
    >>> from focalgradient.psf import Polygon
    >>> square = np.random.default_rng(0).uniform(-0.5, 0.5, (100_000, 2))
    >>> points = aperture_points(Polygon(blades=4), square)
    >>> points.std(axis=0).round(2).tolist(), bool(np.abs(points).max() < 1.27)  # corners at 1.253
    ([0.51, 0.51], True)
    """
    if isinstance(psf, Disc):
        return _disc(square)
    return _sampled(shape_picture(psf, PICTURE_RADIUS_PX), square) / PICTURE_RADIUS_PX


def _disc(square: NDArray[np.float64]) -> NDArray[np.float64]:
    """Map the unit square to the unit disc with an equal-area map (Shirley and Chiu 1997)."""
    a, b = 2 * square[..., 0], 2 * square[..., 1]
    wide = np.abs(a) > np.abs(b)
    radius, across = np.where(wide, a, b), np.where(wide, b, a)
    angle = np.pi / 4 * across / radius
    angle = np.where(wide, angle, np.pi / 2 - angle)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)


def _sampled(picture: NDArray[np.float64], square: NDArray[np.float64]) -> NDArray[np.float64]:
    """Map the unit square to a picture's radiance by inverse distribution functions: first rows, then columns."""
    side = len(picture)
    rows = np.concatenate([[0.0], np.cumsum(picture.sum(axis=1))])
    y = np.interp((square[..., 1] + 0.5) * rows[-1], rows, np.arange(side + 1))
    row = np.minimum(y.astype(np.intp), side - 1)
    # The concatenated distribution functions of the rows form one increasing function: row + fraction within the row.
    within = np.cumsum(picture, axis=1) / np.maximum(picture.sum(axis=1, keepdims=True), 1e-300)
    ends = np.concatenate([np.zeros((side, 1)), within], axis=1)
    at = np.arange(side)[:, None] + np.minimum(ends, 1 - 1e-12)
    column = np.interp(row + square[..., 0] + 0.5, at.ravel(), np.tile(np.arange(side + 1), side))
    return np.stack([column, y], -1) - side / 2
