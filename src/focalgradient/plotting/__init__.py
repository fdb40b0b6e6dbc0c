"""Figures of views and depth maps (`maps`), stimuli and results, in one style (`figures`).

Figures carry their own canvas, so that neither a display nor `pyplot` is needed.
"""

from focalgradient.plotting.figures import BLUE, GREEN, GREY, ORANGE, new_figure, style
from focalgradient.plotting.maps import (
    REFUSED,
    depth_figure,
    describe_optics,
    draw_depth,
    draw_distance,
    draw_error,
    draw_uncertainty,
    draw_view,
)
from focalgradient.plotting.sheet import PAPERS, calibration_sheet

__all__ = [
    "BLUE",
    "GREEN",
    "GREY",
    "ORANGE",
    "PAPERS",
    "REFUSED",
    "calibration_sheet",
    "depth_figure",
    "describe_optics",
    "draw_depth",
    "draw_distance",
    "draw_error",
    "draw_uncertainty",
    "draw_view",
    "new_figure",
    "style",
]
