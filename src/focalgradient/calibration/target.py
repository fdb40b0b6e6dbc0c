"""How blurred the edges of a target are, in one view."""

from __future__ import annotations

import math
import warnings
from typing import NamedTuple

import numpy as np

from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.view import View

__all__ = ["TargetBlur", "measure_target", "read_target"]

LEAST_POINTS = 8
"""Points along edges that a target must give, at least: half of the band that one measurement takes."""

STRONG = 0.5
"""Contrast of an edge, as a share of the target's strongest, from which it is taken for the target's own."""

STEP_LIKE = 0.25
"""Share of the target's edges that must look like blurred steps; below it the camera is named as the cause."""


BAND = 16.0
"""Length in pixels of the bands that depth by edges averages over: twice the default window of `recover_depth`."""


class TargetBlur(NamedTuple):
    """Blur along the edges of a target in one view, in pixels."""

    width: float
    """Sigma of the Gaussian that fits."""
    width_sd: float
    """Its standard deviation: what the edges of the one view differ by."""
    scatter: float
    """What single segments of edges scatter by about it, as depth by edges would read them: half of what holds 95 %."""


def read_target(view: View) -> tuple[float, float]:
    """Blur along the edges of a target that fills a view: sigma of the Gaussian that fits, in pixels, and its sd.

    As `measure_target`, without the scatter of single segments.
    """
    return measure_target(view)[:2]


def measure_target(view: View) -> TargetBlur:
    """Blur along the edges of a target that fills a view.

    The sd is what the edges of the one view differ by; a view has an error of its own beside.

    Raises
    ------
    InputError
        If the view shows too few sharp edges.

    Warns
    -----
    FocalGradientWarning
        If few of them look like blurred steps, as tone curves and sharpening make it; all are read then.
    """
    from focalgradient.depth.edges import average_segments, measure_edges

    edges = measure_edges(view.image, mask=view.mask)
    contrast = np.where(np.isfinite(edges.radius), edges.high - edges.low, 0.0)
    strong = contrast > STRONG * np.quantile(contrast, 0.99) if contrast.size else contrast > 0
    use = strong & edges.valid
    if use.sum() < STEP_LIKE * strong.sum():
        # The sheet is known to be made of steps, so that it is the camera that draws them otherwise.
        warnings.warn(
            f"only {use.sum() / strong.sum():.0%} of a target's edges look like blurred steps: the camera's tone curve "
            "or sharpening shows; camera raw files or a linear export would not have it.",
            FocalGradientWarning,
            stacklevel=2,
        )
        use = strong
    if use.sum() < LEAST_POINTS:
        raise InputError(
            f"the view shows {int(use.sum())} usable points along edges, where a target must give {LEAST_POINTS}: "
            "photograph a flat sheet with straight black and white edges (printed squares, a checkerboard), facing the "
            "camera, in even light, without saturation."
        )
    # Contours are the independent things, not their points; half of them may be odd.
    radius, segment = edges.radius[use], edges.segment[use]
    names, counts = np.unique(segment, return_counts=True)
    each = np.array([np.median(radius[segment == name]) for name in names])
    order = np.argsort(each)
    share = np.cumsum(counts[order]) / counts.sum()
    width = float(each[order][np.searchsorted(share, 0.5)])
    scatter = 1.48 * float(np.median(np.abs(radius - width)))
    independent = min(len(names), counts.sum() / 16)
    whole = average_segments(edges, BAND)
    single = np.abs(whole.radius - width)[whole.valid & use]
    return TargetBlur(
        width,
        max(1.25 * scatter, float(np.median(edges.radius_sd[use]))) / math.sqrt(max(independent, 1.0)),
        float(np.quantile(single, 0.95)) / 2 if single.size >= LEAST_POINTS else 0.0,
    )
