"""Depth from dual-pixel halves, for `focalgradient.recover_depth`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from focalgradient.depth.dual_pixel.halves import POOL, half_radius
from focalgradient.depth.numerics import interpolate_nodes
from focalgradient.depth.recover import halves_of
from focalgradient.depth.search import Estimate, Problem
from focalgradient.depth.validity import blur_is_known
from focalgradient.optics import DualPixel

__all__ = ["MODEL_ERROR", "estimate"]

MODEL_ERROR = 0.05
"""Error of the radius beyond noise, relative to the radius: scatter of a photographed sheet about a smooth field."""

VARIES = 1.5
"""Standard deviation, in windows, of the Gaussian within which variation of the radius contributes to its error. Chosen
by hand."""

STEADY = 0.25
"""Maximum variation of the radius within the Gaussian of `VARIES`, relative to the radius, for valid depth. Chosen by
hand."""

LEAST_ERROR = 0.06
"""Minimum error of the radius beyond noise, in pixels, which dominates near focus. Chosen by hand."""


def estimate(problem: Problem) -> Estimate:
    """Return depth from the left and the right half of one lens' dual pixels; with the side of focus."""
    pair = halves_of(problem.views)
    assert pair is not None  # as the registry asks for
    optics = problem.views[pair[0]].optics
    assert isinstance(optics, DualPixel)
    search, settings, registered = problem.search, problem.settings, problem.registered
    settings.progress(0.2, "comparing the halves")
    slope = optics.aperture_diameter / 2 / problem.views[0].pixel_angle  # pixels of radius for a dioptre
    focus = optics.focus_vergence
    limits = (slope * (search.lowest - focus), slope * (search.highest - focus))
    radius, noise_sd, clear, noise = half_radius(
        registered.images[pair[0]],
        registered.images[pair[1]],
        optics.asymmetry * optics.over(registered.shape),
        limits,
        settings.window,
        registered.usable,
    )
    model = np.maximum(MODEL_ERROR * np.abs(radius), LEAST_ERROR)
    # Where a window reaches over an outline its depth is that of either side.
    varies = _local_spread(radius, VARIES * settings.window / POOL)
    sd = np.hypot(np.hypot(noise_sd, varies), model)
    valid = clear & blur_is_known(np.hypot(noise_sd, varies), radius, STEADY)
    shape = registered.shape
    vergence = focus + interpolate_nodes(radius.astype(float), None, POOL, shape) / slope
    return Estimate(
        np.clip(vergence, search.lowest, search.highest).astype(np.float32),
        (interpolate_nodes(sd, None, POOL, shape) / slope).astype(np.float32),
        (interpolate_nodes(valid.astype(float), None, POOL, shape) > 0.5) & registered.usable,
        noise=[noise * float(image.mean()) for image in registered.images],
        details={"halves": {"asymmetry": optics.asymmetry, "field": list(optics.field), "model_error": MODEL_ERROR}},
    )


def _local_spread(values: NDArray[np.floating], window: float) -> NDArray[np.float64]:
    """Return the standard deviation of values within a Gaussian window, in blocks."""
    middle = np.asarray(values, float) - float(np.median(values))
    square = gaussian_filter(middle**2, window) - gaussian_filter(middle, window) ** 2
    return np.asarray(np.sqrt(np.maximum(square, 0.0)), float)
