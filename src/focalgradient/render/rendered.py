"""Result of rendering: a view with the ground truth of its scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.view import LUMINANCE, View

__all__ = ["LUMINANCE", "Rendered"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Rendered:
    """A view with the ground truth of its scene.

    Parameters
    ----------
    view
        The camera's view, as 32-bit radiance; luminance for a coloured scene.
    distance
        True distance in metres along the axis, H x W, of the first surface on rays through the pixel centres and the
        centre of the lens; ``inf`` where there is none.
    colour
        Radiance in red, green and blue, H x W x 3, whose `LUMINANCE` is the view; None if rendered in grey.
    residual
        Half the difference between the two independent halves of the samples, H x W. The view is their mean, so this
        has exactly the view's sampling noise. None if it was not estimated.
    vergence
        With a mirror among the objects: vergence of what each pixel *shows*, H x W x 2 x 2, in dioptres. Light from one
        point that crosses the lens at (x, y) travels in direction (tx, ty) - vergence (x, y), directions being
        tangents; so a surface seen directly has 1/distance times the unit matrix, and a curved mirror forms an
        astigmatic image. NaN at the border of a surface; 0 where no surface is seen.
    """

    view: View
    distance: FloatArray
    colour: NDArray[np.float32] | None = None
    residual: NDArray[np.float32] | None = None
    vergence: FloatArray | None = None

    def __repr__(self) -> str:
        """Return the view, and the range of distances in the scene."""
        near, far = self._range()
        return f"Rendered({self.view!r}, {near:.3g} to {far:.3g} m)"

    def summary(self) -> str:
        """Return a few lines on the view, the true distance and the noise.

        >>> from focalgradient import Lens
        >>> from focalgradient.render import cast
        >>> from focalgradient.scenes import plane
        >>> print(cast(plane(2.0), Lens(0.025, 4, 1.0), (48, 64), pixel_angle=3e-4, samples=4).summary())
        View(48 x 64 pixels of 0.0003 rad, 6.25 mm aperture, focus at 1 D)
        distance: 2 to 2 m, median 2 m (blur disc 5.21 pixels in radius); nothing in 0.0% of the pixels
        light: mean 0.404; noise not measured
        """
        near, far = self._range()
        there = self.distance[np.isfinite(self.distance)]
        middle = float(np.median(there)) if there.size else math.inf
        optics = self.view.optics
        blur = abs(optics.focus_vergence - 1 / middle) * optics.aperture_diameter / 2 / self.view.pixel_angle
        mean = float(self.view.image.mean(dtype=float))
        noise = "noise not measured" if self.residual is None else f"noise {self.noise / mean:.2%} of it"
        kinds = [name for name in ("colour", "vergence") if getattr(self, name) is not None]
        return "\n".join(
            [
                repr(self.view),
                f"distance: {near:.3g} to {far:.3g} m, median {middle:.3g} m (blur disc {blur:.3g} pixels in radius); "
                f"nothing in {1 - there.size / self.distance.size:.1%} of the pixels",
                f"light: mean {mean:.3g}; {noise}{''.join(f'; with {kind}' for kind in kinds)}",
            ]
        )

    def _range(self) -> tuple[float, float]:
        """Return the smallest and largest distance in metres in the frame; infinite if no surface is seen."""
        there = self.distance[np.isfinite(self.distance)]
        return (float(there.min()), float(there.max())) if there.size else (math.inf, math.inf)

    @property
    def noise(self) -> float:
        """Standard deviation of the view's sampling noise over the whole picture, in the image's unit.

        NaN if it was not estimated. Views of one scene rendered with the same seed share much of their noise.
        """
        return float("nan") if self.residual is None else float(np.sqrt(np.mean(np.square(self.residual, dtype=float))))
