"""Vignetting correction: corners darken with aperture, and a darker copy of a texture resembles a blurred one.

A flat field, if given, is divided out (`focalgradient.photographs.images`). Remaining smooth differences in brightness
over the frame between views of one scene are also attributed to vignetting, because blur redistributes radiance only
over pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.calibration.robust import fit_terms
from focalgradient.depth.registration import at_ceiling
from focalgradient.view import View

__all__ = ["even_out"]

BLOCK_COUNT = 24
"""Number of blocks along the frame's shorter side in which the views' brightness is compared."""

MIN_SIDE_PX = 32
"""Minimum shorter side in pixels: in smaller frames, brightness reflects the scene instead of the lens."""

FIT_ITERATIONS = 8
"""Number of iterations of the robust fit, which downweights blocks that differ for other reasons."""


def even_out(views: Sequence[View]) -> list[View]:
    """Return the views with the vignetting of the view with the smallest aperture.

    Parameters
    ----------
    views
        Views of one scene, of one size.

    Examples
    --------
    A view that is 30 % darker in its corners and 10 % brighter overall is corrected to 1 %:

    >>> from focalgradient import Lens
    >>> sharp, wide = (Lens(0.025, n, 1.0) for n in (16, 4))
    >>> scene = np.random.default_rng(0).uniform(0.4, 0.6, (96, 128))
    >>> rows, columns = np.mgrid[-1:1:96j, -1:1:128j]
    >>> dim = 1.1 * scene * (1 - 0.15 * (rows**2 + columns**2))
    >>> even = even_out([View(scene, sharp, 3e-4), View(dim, wide, 3e-4)])[1].image / scene
    >>> round(float(np.ptp(even) / even.mean()), 2)
    0.01
    """
    least = min(views, key=lambda view: view.optics.aperture_diameter)
    return [view if view is least else _evened(view, least) for view in views]


def _evened(view: View, reference: View) -> View:
    height, width = view.shape
    if min(height, width) < MIN_SIDE_PX:
        return view
    side = max(1, min(height, width) // BLOCK_COUNT)
    size = (max(1, width // side), max(1, height // side))
    clipped = [at_ceiling(v.image) if v.mask is None else ~v.mask for v in (reference, view)]
    scale = view.pixel_angle / reference.pixel_angle  # another focus magnifies the scene's own gradients

    def blocks(image: NDArray[Any], scale: float = 1.0, outside: float = 0.0) -> NDArray[np.float32]:
        pixels = _magnified(image.astype(np.float32), scale, outside)
        return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.float32)

    is_used = np.maximum(blocks(clipped[0], scale, outside=1.0), blocks(clipped[1])) == 0
    one, other = blocks(reference.image, scale), blocks(view.image)
    if is_used.any():
        is_used &= (one > 0.05 * one[is_used].max()) & (other > 0.05 * other[is_used].max())
    if is_used.sum() < 64:
        return view
    ratio = np.log(other[is_used] / one[is_used])
    terms = np.stack([np.broadcast_to(term, is_used.shape)[is_used] for term in _terms(*is_used.shape)], axis=1)
    fit, _ = fit_terms(terms, ratio, np.ones_like(ratio), FIT_ITERATIONS)
    gain = np.zeros(view.shape)
    for factor, term in zip(fit[1:], _terms(height, width)[1:], strict=True):  # without the constant, the exposure
        gain += factor * term
    image = (view.image / np.exp(gain)).astype(view.image.dtype)
    image[clipped[1]] = image.max()  # saturated pixels keep a common maximum
    return replace(view, image=image)


def _magnified(image: NDArray[np.float32], scale: float, outside: float) -> NDArray[np.float32]:
    """Return `image` at pixels `scale` times as large about its centre; beyond its border, the value `outside`."""
    if scale == 1:
        return image
    height, width = image.shape
    x, y = ((1 - scale) * (n - 1) / 2 for n in (width, height))
    matrix = np.array([[scale, 0, x], [0, scale, y]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(image, matrix, (width, height), flags=flags, borderValue=outside), np.float32)


def _terms(height: int, width: int) -> list[FloatArray]:
    """Return the terms of the vignetting model, each broadcast to H x W: constant, linear, quadratic, radial fourth."""
    reach = max(height, width)
    down = ((2 * np.arange(height) + 1 - height) / reach)[:, None]
    across = ((2 * np.arange(width) + 1 - width) / reach)[None]
    fourth = (down**2 + across**2) ** 2
    return [np.ones((1, 1)), down, across, down**2, down * across, across**2, fourth]
