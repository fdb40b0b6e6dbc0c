"""Rendering: from a scene and optics to a view, with ground-truth distance at every pixel."""

from focalgradient.render.blurred import blur, blur_picture, blur_scene
from focalgradient.render.engines import Engine, render, render_bands, render_series
from focalgradient.render.raycast import cast
from focalgradient.render.rendered import Rendered
from focalgradient.render.sensor import noisy
from focalgradient.render.wireframe import necker_frame, necker_loop, wireframe

__all__ = [
    "Engine",
    "Rendered",
    "blur",
    "blur_picture",
    "blur_scene",
    "cast",
    "necker_frame",
    "necker_loop",
    "noisy",
    "render",
    "render_bands",
    "render_series",
    "wireframe",
]
