"""Measurement of the blur of a target's edges in one view."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from focalgradient.depth.edges import average_segments, measure_edges
from focalgradient.depth.numerics import weighted_median
from focalgradient.errors import InputError, warn
from focalgradient.view import View

__all__ = ["TargetBlur", "measure_target", "read_target"]

LEAST_POINTS = 8
"""Minimum number of points along edges: half of the band over which one measurement averages."""

MIN_RELATIVE_CONTRAST = 0.5
"""Minimum contrast of the target's own edges, relative to its strongest edge."""

MIN_STEP_LIKE = 0.25
"""Minimum fraction of edges that look like blurred steps; below it a warning names texture and the camera as causes."""


BAND = 16.0
"""Length in pixels of the bands over which depth by edges averages: twice the default window of `recover_depth`."""


class TargetBlur(NamedTuple):
    """Blur along the edges of a target in one view, in pixels."""

    width: float
    """Sigma of the fitted Gaussian."""
    width_sd: float
    """Standard error of the width, from differences between the edges of the view."""
    scatter: float
    """Scatter of single edge segments, as in depth by edges: half the width of the central 95 %."""


def read_target(view: View) -> tuple[float, float]:
    """Return the blur along the edges of a target that fills a view, sigma in pixels, and its standard error.

    Like `measure_target`, without the scatter of single segments.
    """
    return measure_target(view)[:2]


def measure_target(view: View) -> TargetBlur:
    """Measure the blur along the edges of a target that fills a view.

    The standard error is from differences between the edges of the view; errors common to the whole view are not
    included.

    Raises
    ------
    InputError
        If the view contains too few sharp edges.

    Warns
    -----
    FocalGradientWarning
        If few edges look like blurred steps, because of texture, a tone curve or sharpening; all edges are then used.
    """
    edges = measure_edges(view.image, mask=view.mask)
    contrast = np.where(np.isfinite(edges.radius), edges.high - edges.low, 0.0)
    strong = contrast > MIN_RELATIVE_CONTRAST * np.quantile(contrast, 0.99) if contrast.size else contrast > 0
    use = strong & edges.valid
    if use.sum() < MIN_STEP_LIKE * strong.sum():
        # the sheet is taken to consist of steps, so that the camera must have altered them
        warn(
            f"only {use.sum() / strong.sum():.0%} of a target's edges look like blurred steps: use another method for "
            "a target of texture (method='equalise'); give camera raw files or a linear export of sharp edges, as a "
            "tone curve or sharpening alters them."
        )
        use = strong
    if use.sum() < LEAST_POINTS:
        raise InputError(
            f"the view shows {int(use.sum())} usable points along edges, where a target must give {LEAST_POINTS}: "
            "photograph a flat sheet with straight black and white edges (printed squares, a checkerboard), facing the "
            "camera, in even light, without saturation."
        )
    # contours, not their points, are independent; half of them may be outliers
    radius, segment = edges.radius[use], edges.segment[use]
    names, counts = np.unique(segment, return_counts=True)
    each = np.array([np.median(radius[segment == name]) for name in names])
    width = weighted_median(each, counts.astype(float))
    scatter = 1.48 * float(np.median(np.abs(radius - width)))
    independent = min(len(names), counts.sum() / 16)
    whole = average_segments(edges, BAND)
    single = np.abs(whole.radius - width)[whole.valid & use]
    return TargetBlur(
        width,
        max(1.25 * scatter, float(np.median(edges.radius_sd[use]))) / math.sqrt(max(independent, 1.0)),
        float(np.quantile(single, 0.95)) / 2 if single.size >= LEAST_POINTS else 0.0,
    )
