"""Discretised point spread functions for blur of any shape."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.psf import Psf
from focalgradient.render.kernels import (
    FREQUENCY_STEPS,
    MAX_FITTED_FREQUENCY,
    UNIFORMITY_WEIGHT,
    Kernels,
    kernels_of,
    lens_radius,
)

__all__ = ["shape_kernels", "shape_picture"]

MIN_INTERPOLATED_RADIUS = 8.0
"""Blur radius in pixels below which weights are fitted to the transfer. Linear interpolation between pixels reproduces
a pentagon's transfer up to 1/8 cycle per pixel to 0.004 from 9 pixels on, but only to 0.009 at 6."""

EXTENT_SD = 4.0
"""Extent of a tabulated shape in standard deviations: a triangle ends at 2.8; a Gaussian has 6e-5 outside."""

MIN_FRACTION = 1e-4
"""Fraction of the brightest pixel below which a pixel is set to 0."""

FINE_RADIUS_STEP_PX, MAX_FINE_COUNT = 1 / 32, 64
"""Spacing in pixels, and maximum number, of blur radii where only a few distinct ones occur; nearest neighbour: error
at most half a step."""

LENS_RADIUS_PX = 12.0
"""Radius in pixels at which a shape's extent relative to the disc is measured: to a twelfth of the radius."""

RADIUS_STEP_PX, RADIUS_GROWTH = 0.05, 0.02
"""Spacing of blur radii where many occur: in pixels, or as a fraction of the radius, whichever is larger."""


def shape_kernels(psf: Psf, blurs: NDArray[np.float32]) -> Kernels:
    """Return kernels of a shape for `blurs` in pixels, negative beyond focus, positive nearer; no weight is negative.

    Kernels of point-symmetric shapes depend on the absolute blur alone; others are rotated by 180 degrees nearer
    than focus.
    """
    signed = np.abs(blurs) if psf.symmetric else blurs
    steps: NDArray[Any] = FINE_RADIUS_STEP_PX * np.unique(np.rint(signed / FINE_RADIUS_STEP_PX).astype(np.int64))
    if len(steps) > MAX_FINE_COUNT:
        largest = float(np.abs(blurs).max())
        radii: NDArray[Any] = np.arange(
            0, min(largest, RADIUS_STEP_PX / RADIUS_GROWTH) + RADIUS_STEP_PX, RADIUS_STEP_PX
        )
        if largest > radii[-1]:
            count = math.ceil(math.log(largest / radii[-1]) / math.log1p(RADIUS_GROWTH))
            radii = np.concatenate([radii, radii[-1] * (1 + RADIUS_GROWTH) ** np.arange(1, count + 1)])
        steps = radii if psf.symmetric else np.concatenate([-radii[:0:-1], radii])
        steps = steps[
            (steps >= signed.min() - 2 * RADIUS_STEP_PX - RADIUS_GROWTH * largest)
            & (steps <= signed.max() + RADIUS_GROWTH * largest + 2 * RADIUS_STEP_PX)
        ]
    upright = {radius: shape_picture(psf, radius) for radius in dict.fromkeys(np.abs(steps).tolist())}
    turned = [
        upright[abs(step)][::-1, ::-1] if step > 0 and not psf.symmetric else upright[abs(step)]
        for step in steps.tolist()
    ]
    return kernels_of(steps, turned, lens_radius(shape_picture(psf, LENS_RADIUS_PX), LENS_RADIUS_PX))


def shape_picture(psf: Psf, radius: float) -> NDArray[np.float64]:
    """Return a shape of `radius` pixels, as seen beyond focus, as a square picture of odd size, non-negative, sum 1."""
    if radius < 0.01:
        return np.ones((1, 1))
    even = _interpolated(psf, radius)
    return _fitted(psf, radius, even) if radius < MIN_INTERPOLATED_RADIUS else even


def _interpolated(psf: Psf, radius: float) -> NDArray[np.float64]:
    """Return a shape by linear interpolation between pixels, reduced in size so that the second moment is exact."""
    # Linear interpolation adds a variance of 1/6 per axis.
    smaller = math.sqrt(max(radius**2 - 1 / 6 / psf.sd_per_radius**2, 1 / 4))
    reach = math.ceil(EXTENT_SD * psf.sd_per_radius * radius) + 2
    side = 2 * reach + 1
    # Frequencies beyond Nyquist are aliased, as by sampling.
    folds = np.arange(-2, 3) if radius < MIN_INTERPOLATED_RADIUS else np.arange(-1, 2)
    axis = (np.fft.fftfreq(side)[:, None] + folds).ravel()
    spectrum = psf.optical_transfer(axis[:, None], axis, smaller) * np.outer(np.sinc(axis), np.sinc(axis)) ** 2
    folded = spectrum.reshape(side, len(folds), side, len(folds)).sum(axis=(1, 3))
    picture = np.fft.fftshift(np.fft.ifft2(folded).real)
    seen = np.argwhere(picture > MIN_FRACTION * picture.max())
    cut = reach - int(np.abs(seen - reach).max())
    picture = np.where(picture > MIN_FRACTION * picture.max(), picture, 0.0)[cut : side - cut, cut : side - cut]
    return picture / picture.sum()


def _fitted(psf: Psf, radius: float, even: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return non-negative weights that fit the shape's transfer by least squares, close to uniform (see `kernels`)."""
    from scipy.optimize import nnls  # deferred: slow to import

    reach = len(even) // 2
    down, right = np.meshgrid(
        np.linspace(-MAX_FITTED_FREQUENCY, MAX_FITTED_FREQUENCY, 2 * FREQUENCY_STEPS + 1),
        np.linspace(0, MAX_FITTED_FREQUENCY, FREQUENCY_STEPS + 1),
        indexing="ij",
    )
    radial = np.hypot(down, right)
    order = np.argsort(radial, axis=None)
    order = order[radial.ravel()[order] <= MAX_FITTED_FREQUENCY]
    down, right, radial = (values.ravel()[order] for values in (down, right, radial))
    y, x = np.nonzero(even)
    waves = np.exp(-2j * np.pi * (down[:, None] * (y - reach) + right[:, None] * (x - reach)))
    weight = 1 / np.maximum(radial, radial[1])  # amplitude spectrum of natural images
    weight[0] = 100 * weight.sum()  # unit gain at frequency 0
    weight[1:] /= np.linalg.norm(weight[1:])
    wanted = weight * psf.optical_transfer(down, right, radius)
    level = UNIFORMITY_WEIGHT / even.max()
    fitted, _ = nnls(
        np.concatenate([weight[:, None] * waves.real, weight[1:, None] * waves.imag[1:], level * np.eye(len(y))]),
        np.concatenate([np.real(wanted), np.imag(wanted)[1:], level * even[y, x]]),
    )
    picture = np.zeros_like(even)
    picture[y, x] = fitted
    return picture
