"""Views brought onto one pixel grid and one exposure."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from focalgradient.depth.align import Placement, measure_placement, resample
from focalgradient.depth.kernels import block_sum
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.view import View

__all__ = ["Placed"]

Image = NDArray[np.float32]

SHIFT_WARNING = 0.25
"""Displacement between views, in pixels, above which a user is warned."""


@dataclass(frozen=True, slots=True)
class Placed:
    """The views on the first one's grid, at one exposure, with what can be used of them."""

    images: list[Image]
    usable: NDArray[np.bool_]
    gains: list[float]
    found: list[Placement]

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.usable.shape
        return height, width

    @classmethod
    def of(cls, views: Sequence[View], align: bool) -> Placed:
        """Bring `views` to one magnification; measure what shift is left, and remove it if `align`."""
        images = [np.asarray(view.image, np.float32) for view in views]
        usable = ~_clipped(images[0])
        placed, found = [images[0]], [Placement()]
        for view, image in zip(views[1:], images[1:], strict=True):
            clipped = _clipped(image)
            placement = Placement(views[0].pixel_angle / view.pixel_angle)
            moved, covered = resample(image, placement)
            shift, error = measure_placement(images[0], moved)
            _judge(len(placed) + 1, shift, error, view.shape, align)
            if align:
                placement = placement.then(shift)
                moved, covered = resample(image, placement)
            if clipped.any():
                covered &= resample(clipped.astype(np.float32), placement)[0] < 0.05
            usable &= covered
            placed.append(moved)
            found.append(shift)
        if usable.mean() < 0.05:
            raise InputError(
                "hardly a pixel is both unsaturated and seen by every view, but all views must show the same scene: "
                "check that the views belong together and are rightly exposed."
            )
        gains = [1.0, *(_gain(placed[0], image, usable) for image in placed[1:])]
        return cls([image / np.float32(g) for image, g in zip(placed, gains, strict=True)], usable, gains, found)

    def busiest(self, side: int) -> Placed:
        """The part, at most `side` pixels in each direction, that shows most texture."""
        down, right = np.gradient(self.images[0])
        steep = down**2 + right**2
        # Texture all over, not a few hard outlines.
        steep = np.minimum(steep, np.quantile(steep[::3, ::3], 0.75)) * self.usable
        busy = uniform_filter(steep, [min(side, n) for n in self.shape], mode="constant")
        middle = np.unravel_index(np.argmax(busy), busy.shape)
        part = tuple(
            slice(start, start + side)
            for m, n in zip(middle, self.shape, strict=True)
            for start in [int(np.clip(m - side // 2, 0, max(0, n - side)))]
        )
        return Placed([image[part] for image in self.images], self.usable[part], self.gains, self.found)


def _judge(number: int, shift: Placement, error: float, shape: tuple[int, int], align: bool) -> None:
    """Warn of a displaced view; refuse to align one that fits nowhere. `error` is the displacement's sd in pixels."""
    displacement = shift.displacement(shape)
    if not (0.8 < shift.scale < 1.25 and displacement < max(shape) / 3):
        trouble = f"view {number} does not seem to show what view 1 shows, wherever it is laid"
        if align:
            raise InputError(f"{trouble}, but views can be aligned only if they show one scene: check the files.")
        warnings.warn(FocalGradientWarning(f"{trouble}: check that they show one scene."), stacklevel=5)
    elif not align and displacement > max(SHIFT_WARNING, 3 * error):
        warnings.warn(
            FocalGradientWarning(
                f"view {number} is displaced against view 1 by up to {displacement:.2f} pixels "
                f"({shift.right:+.2f} right, {shift.down:+.2f} down, scale {shift.scale:.5f}), which biases depth: "
                "align the views (align=True, --align)."
            ),
            stacklevel=5,
        )


def _clipped(image: Image) -> NDArray[np.bool_]:
    """Pixels at the image's ceiling, where a whole crowd of pixels shares the highest value."""
    top = image == image.max()
    return top if top.sum() > max(16, 2e-4 * image.size) else np.zeros_like(top)


def _gain(reference: Image, image: Image, usable: NDArray[np.bool_]) -> float:
    """Exposure of `image` over that of `reference`: the ratio of the light in both, where the ratio is the usual one.

    Blur moves light but keeps its sum. Places are never weighted by the brightness of one view: the brightest of the
    sharper view are darker in the other for their blur alone.
    """
    mask = usable.astype(np.float32)
    step = max(4, min(reference.shape) // 16)
    one, other = (block_sum(picture * mask, step).ravel() for picture in (reference, image))
    lit = one + other > 0.1 * (one + other).max()
    ratio = other[lit] / np.maximum(one[lit], np.finfo(np.float32).tiny)
    usual = np.abs(ratio - np.median(ratio))
    alike = usual <= 4 * np.median(usual) + 1e-6
    gain = float(other[lit][alike].sum() / one[lit][alike].sum())
    if not gain > 0:
        raise InputError("one view is dark where another is bright, but views may differ by a positive gain only.")
    return gain
