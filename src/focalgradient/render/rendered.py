"""What comes out of rendering: a view with the truth about its scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.view import LUMINANCE, View

__all__ = ["LUMINANCE", "Rendered"]


@dataclass(frozen=True, slots=True, eq=False)
class Rendered:
    """A view with the truth about its scene.

    Parameters
    ----------
    view
        What the camera sees, as 32-bit radiance: of a coloured scene its luminance.
    distance
        True distance in metres along the axis, H x W, of the first surface through the pixel centres and the centre of
        the lens; ``inf`` where there is nothing.
    colour
        Radiance in red, green and blue, H x W x 3, of which the view is the `LUMINANCE`; None where the renderer sees
        grey only.
    residual
        Half the difference of two independent halves of the samples, H x W: the view is their mean, so this has just
        the view's own sampling noise. None where it was not measured.
    vergence
        Where a mirror is among the objects: vergence of what is *seen* in each pixel, H x W x 2 x 2, in dioptres. Light
        of one point, crossing the lens at (x, y), runs in the direction (tx, ty) - vergence (x, y), the directions
        being tangents; so a surface seen directly has 1/distance times the unit matrix, and a curved mirror shows an
        image that differs by meridian. NaN at the border of a surface; 0 where nothing is seen.
    """

    view: View
    distance: NDArray[np.float64]
    colour: NDArray[np.float32] | None = None
    residual: NDArray[np.float32] | None = None
    vergence: NDArray[np.float64] | None = None

    @property
    def noise(self) -> float:
        """Standard deviation of the view's sampling noise over the whole picture, in the image's unit.

        NaN if it was not measured. Views of one scene rendered with one seed share much of it.
        """
        return float("nan") if self.residual is None else float(np.sqrt(np.mean(np.square(self.residual, dtype=float))))
