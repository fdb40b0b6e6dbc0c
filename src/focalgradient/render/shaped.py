"""Discretised point spread functions for blur of any shape."""

from __future__ import annotations

import math
from collections.abc import Hashable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.parallel import cores
from focalgradient.psf import Psf
from focalgradient.render.kernels import Kernels, few_blurs, kernels_of, lens_radius
from focalgradient.scenes.texture import NATURAL_SLOPE

__all__ = ["shape_kernels", "shape_picture"]

MIN_INTERPOLATED_RADIUS = 8.0
"""Blur radius in pixels below which weights are fitted to the transfer. Linear interpolation between pixels reproduces
a pentagon's transfer up to 1/8 cycle per pixel to 0.004 from 9 pixels on, but only to 0.009 at 6."""

MAX_FITTED_FREQUENCY, FREQUENCY_STEPS = 0.43, 14
"""Maximum frequency (cycles per pixel) up to which the transfer of smaller shapes is fitted, and number of frequency
steps. In a photograph blurred by about a pixel, distance is estimated with a bias of -1.0 % for 0.36 and -0.5 % for
0.43; for 0.5 it varies more."""

UNIFORMITY_WEIGHT = 0.005
"""Weight of a shape's uniformity relative to its transfer in the fit. 0 would give a few bright pixels; with 0.005,
pixels within a disc of radius 4 px differ by 6 %, and the transfer is accurate to 0.0025 up to 1/8 cycle per pixel."""

LENS_RADIUS_PX = 12.0
"""Radius in pixels at which a shape's extent relative to the disc is measured: to a twelfth of the radius."""

RADIUS_STEP_PX, RADIUS_GROWTH = 0.02, 0.01
"""Spacing of blur radii where many occur: in pixels, or as a fraction of the radius, whichever is larger; nearest
neighbour: error at most half a step."""


def shape_kernels(psf: Psf, blurs: NDArray[np.float32]) -> Kernels:
    """Return kernels of a shape for `blurs` in pixels, negative beyond focus, positive nearer; no weight is negative.

    Kernels of point-symmetric shapes depend on the absolute blur alone; others are rotated by 180 degrees nearer
    than focus.
    """
    signed = np.abs(blurs) if psf.symmetric else blurs
    steps = few_blurs(signed)
    if steps is None:
        radii = _radii(float(np.abs(blurs).max()))
        steps = radii if psf.symmetric else np.concatenate([-radii[:0:-1], radii])
        first, last = np.searchsorted(steps, [signed.min(), signed.max()])
        steps = steps[max(first - 1, 0) : last + 1]
    radii = np.unique(np.abs(steps))
    with ThreadPoolExecutor(cores()) as pool:
        upright = dict(zip(radii.tolist(), pool.map(partial(shape_picture, psf), radii.tolist()), strict=True))
    turned = [
        upright[abs(step)][::-1, ::-1] if step > 0 and not psf.symmetric else upright[abs(step)]
        for step in steps.tolist()
    ]
    lens = lens_radius(psf.picture(LENS_RADIUS_PX), LENS_RADIUS_PX)
    if psf.gives_edge_response:  # pixels widen a picture, but the lens ends where the shape does
        lens = min(lens, max(psf.edge_reach, 1.0))
    return kernels_of(steps, turned, lens)


def _radii(largest: float) -> FloatArray:
    """Return blur radii from 0 to at least `largest` pixels, `RADIUS_STEP_PX` or `RADIUS_GROWTH` apart."""
    even = RADIUS_STEP_PX * np.arange(1 + round(1 / RADIUS_GROWTH))
    count = max(0, math.ceil(math.log(max(largest, even[-1]) / even[-1]) / math.log1p(RADIUS_GROWTH)))
    return np.concatenate([even, even[-1] * (1 + RADIUS_GROWTH) ** np.arange(1, count + 1)])


def shape_picture(psf: Psf, radius: float) -> FloatArray:
    """Return a shape of `radius` pixels, as seen beyond focus, as a square picture of odd size, non-negative, sum 1."""
    if radius < 0.01:
        return np.ones((1, 1))
    if radius >= MIN_INTERPOLATED_RADIUS:
        return psf.picture(radius)
    return _fitted_once(psf, radius) if isinstance(psf, Hashable) else _fitted(psf, radius)


def _fitted(psf: Psf, radius: float) -> FloatArray:
    """Return non-negative weights that fit the shape's transfer by least squares, close to uniform.

    Exact interpolation at the fine detail that small shapes leave would need negative weights, which produce dark
    rings around bright points. Pixels that reflections of an isotropic shape exchange share a weight.
    """
    from scipy.optimize import nnls  # deferred: slow to import

    even = psf.picture(radius)
    right = np.linspace(0, MAX_FITTED_FREQUENCY, FREQUENCY_STEPS + 1)
    down, right = np.meshgrid(np.concatenate([-right[:0:-1], right]), right, indexing="ij")
    radial = np.hypot(down, right)
    kept = (radial <= MAX_FITTED_FREQUENCY) & (not psf.isotropic or (down >= 0) & (down <= right))
    order = np.argsort(radial[kept])
    down, right, radial = (values[kept][order] for values in (down, right, radial))
    y, x = np.argwhere(even).T - len(even) // 2
    alike = np.sort(np.abs([y, x]), axis=0) if psf.isotropic else np.stack([y, x])
    _, group, count = np.unique(alike, axis=1, return_inverse=True, return_counts=True)
    group = group.ravel()
    waves = np.exp(-2j * np.pi * (down[:, None] * y + right[:, None] * x)) @ np.eye(len(count))[group]
    weight = np.maximum(radial, radial[1]) ** -NATURAL_SLOPE
    weight[0] = 100 * weight.sum()  # unit gain at frequency 0
    weight[1:] /= np.linalg.norm(weight[1:])
    wanted = psf.optical_transfer(down, right, radius)
    level = UNIFORMITY_WEIGHT * np.sqrt(count) / even.max()
    uniform = np.bincount(group, even[even != 0]) / count
    parts = (np.real,) if psf.symmetric else (np.real, np.imag)
    fitted, _ = nnls(
        np.concatenate([*(weight[:, None] * part(waves) for part in parts), np.diag(level)]),
        np.concatenate([*(weight * part(wanted) for part in parts), level * uniform]),
    )
    picture = np.zeros_like(even)
    picture[even != 0] = fitted[group]
    return picture


_fitted_once = lru_cache(maxsize=1024)(_fitted)
