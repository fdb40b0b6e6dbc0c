"""From a scene and optics to a view, with the true distance at every pixel."""

from focalgradient.render.raycast import Rendered, cast
from focalgradient.render.sensor import noisy

__all__ = ["Rendered", "cast", "noisy"]
