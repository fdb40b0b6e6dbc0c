"""Stereo pairs with ground truth per pixel, and their presentation formats."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray, Mask
from focalgradient.errors import InputError, check_one_of, checked
from focalgradient.files import write_whole
from focalgradient.optics import Optics
from focalgradient.view import LUMINANCE

__all__ = ["PRESENTATIONS", "EyeView", "Presentation", "StereoPair"]

Light = NDArray[np.float32]

Presentation = Literal[
    "side-by-side", "crossed", "over-under", "anaglyph", "colour-anaglyph", "rows", "halves", "screens"
]
"""Way to present both views, as by the methods of `StereoPair`."""

PRESENTATIONS: dict[Presentation, tuple[str, ...]] = {
    **{way: (way,) for way in get_args(Presentation)},
    "screens": ("left-screen", "right-screen"),
}
"""Names of the pictures of each way to present both views."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EyeView:
    """The view of one eye, with ground truth for each pixel.

    Parameters
    ----------
    light
        Linear radiance, H x W or H x W x 3.
    optics
        Optics of the eye.
    distance
        True distance in metres along the line of sight's axis, H x W.
    disparity
        Displayed disparity as the tangent of an angle (rad), H x W: rightward position in the left eye's view minus
        that in the right eye's. Positive (crossed) for points nearer than the plane of zero disparity.
    blur
        Displayed blur radius in radians, H x W: that of a disc, from the eye's pupil and focus.
    is_monocular
        True where the other eye cannot see what this pixel shows, because it is occluded or outside its frame.
    is_invented
        True where the source picture did not show what this eye sees, so that it was inpainted; False everywhere in
        ray-cast views.
    """

    light: Light
    optics: Optics
    distance: FloatArray
    disparity: FloatArray
    blur: FloatArray
    is_monocular: Mask
    is_invented: Mask

    @property
    def vergence(self) -> FloatArray:
        """True vergence of each pixel in dioptres (metre angles), H x W."""
        return np.asarray(1 / self.distance)

    def write(self, path: Path) -> None:
        """Write the radiance and the ground truth of every pixel to an ``.npz`` file, in 32-bit precision."""
        names = ("light", "distance", "vergence", "disparity", "blur", "is_monocular", "is_invented")
        arrays: dict[str, Any] = {name: getattr(self, name) for name in names}
        np.savez_compressed(path, **{n: a.astype(np.float32) if a.dtype == float else a for n, a in arrays.items()})

    def __repr__(self) -> str:
        """Return the size, and the fractions of monocular and inpainted pixels."""
        height, width = self.distance.shape
        return (
            f"EyeView({width} x {height} pixels, {self.is_monocular.mean():.1%} seen by this eye alone, "
            f"{self.is_invented.mean():.1%} completed)"
        )


@dataclass(frozen=True, slots=True, eq=False)
class StereoPair:
    """The views of the left and the right eye.

    Parameters
    ----------
    left, right
        The views.
    pixel_angle
        Angle in radians subtended by a pixel.
    interocular
        Interocular distance in metres.
    vergence
        Vergence in dioptres of the plane of zero disparity.
    """

    left: EyeView
    right: EyeView
    pixel_angle: float
    interocular: float
    vergence: float

    def side_by_side(self, *, crossed: bool = False) -> Light:
        """Return the views side by side, H x 2 W: left eye's on the left, or on the right if `crossed`."""
        pair = [self.left.light, self.right.light]
        return np.concatenate(pair[::-1] if crossed else pair, axis=1)

    def over_under(self) -> Light:
        """Return the left view above the right view, 2 H x W."""
        return np.concatenate([self.left.light, self.right.light], axis=0)

    @checked
    def anaglyph(self, kind: Literal["grey", "colour"] = "grey") -> Light:
        """Return an anaglyph for glasses with a red filter for the left eye and a cyan filter for the right.

        Parameters
        ----------
        kind
            ``"grey"``: the luminance of each view, which avoids colour rivalry. ``"colour"``: red of the left view,
            green and blue of the right view.

        Returns
        -------
        ndarray
            Linear radiance, H x W x 3.
        """
        left, right = self.left.light, self.right.light
        if left.ndim == 2 or kind == "grey":
            dark = [light if light.ndim == 2 else light @ np.asarray(LUMINANCE, np.float32) for light in (left, right)]
            return np.stack([dark[0], dark[1], dark[1]], axis=-1)
        return np.concatenate([left[..., :1], right[..., 1:]], axis=-1)

    @checked
    def interleaved(self, *, first: Literal["left", "right"] = "left") -> Light:
        """Return row-interleaved views, H x W, for line-polarised screens; the top row belongs to the `first` view.

        Alternate rows of each view are dropped.
        """
        top, bottom = (self.left.light, self.right.light)[:: 1 if first == "left" else -1]
        rows = top.copy()
        rows[1::2] = bottom[1::2]
        return rows

    def screens(self, *, mirrored: bool = True) -> tuple[Light, Light]:
        """Return one picture per screen, flipped horizontally if `mirrored`, as for viewing by one mirror per eye."""
        way = -1 if mirrored else 1
        return self.left.light[:, ::way], self.right.light[:, ::way]

    def halves(self, size_px: tuple[int, int], *, centres_px: float | None = None, mirrored: bool = False) -> Light:
        """Return both views side by side on one screen, for a mirror stereoscope.

        Parameters
        ----------
        size_px
            Width and height of the screen in pixels.
        centres_px
            Distance between the centres of the views in pixels. None: half the screen's width.
        mirrored
            Whether each view is flipped horizontally, as for a stereoscope with one mirror per eye; not with two.

        Raises
        ------
        InputError
            If the views overlap or do not fit.
        """
        left, right = self.screens(mirrored=mirrored)
        height, width = left.shape[:2]
        apart = size_px[0] / 2 if centres_px is None else centres_px
        begins = [round(size_px[0] / 2 + side * apart / 2 - width / 2) for side in (-1, 1)]
        top = (size_px[1] - height) // 2
        if begins[0] < 0 or begins[1] + width > size_px[0] or begins[0] + width > begins[1] or top < 0:
            raise InputError(
                f"two views of {width} x {height} pixels, {apart:g} pixels apart, do not fit on a screen of "
                f"{size_px[0]} x {size_px[1]}: make them smaller, or change centres_px."
            )
        screen = np.zeros((size_px[1], size_px[0], *left.shape[2:]), np.float32)
        for begin, light in zip(begins, (left, right), strict=True):
            screen[top : top + height, begin : begin + width] = light
        return screen

    def presented(self, way: Presentation, size_px: tuple[int, int] = (1920, 1080)) -> dict[str, Light]:
        """Return the pictures of one way to present both views, by name.

        Parameters
        ----------
        way
            One of `PRESENTATIONS`, which lists the names.
        size_px
            For ``"halves"``: width and height of the screen in pixels.

        Raises
        ------
        InputError
            If the way is unknown, or the views do not fit on the screen.
        """
        check_one_of("way", way, PRESENTATIONS)
        if way == "screens":
            return dict(zip(PRESENTATIONS[way], self.screens(), strict=True))
        make: dict[str, Callable[[], Light]] = {
            "side-by-side": self.side_by_side,
            "crossed": partial(self.side_by_side, crossed=True),
            "over-under": self.over_under,
            "anaglyph": self.anaglyph,
            "colour-anaglyph": partial(self.anaglyph, "colour"),
            "rows": self.interleaved,
            "halves": partial(self.halves, size_px),
        }
        return {way: make[way]()}

    def summary(self) -> dict[str, Any]:
        """Return pixel angle (arcmin), range of disparity (px), and fractions inpainted and monocular, as plain JSON.

        Fractions are those of the left and of the right view.
        """
        pixels = self.left.disparity / self.pixel_angle
        views = self.left, self.right
        return {
            "pixel_arcmin": 60 * math.degrees(self.pixel_angle),
            "disparity_px": [float(pixels.min()), float(pixels.max())],
            "share_completed": [float(view.is_invented.mean()) for view in views],
            "share_seen_by_one_eye": [float(view.is_monocular.mean()) for view in views],
        }

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write ``left.npz`` and ``right.npz``, with radiance and ground truth of every pixel, into a folder.

        The arrays are those of `EyeView`, with ``vergence`` in dioptres.
        """
        where = Path(folder)
        where.mkdir(parents=True, exist_ok=True)
        for name, view in (("left", self.left), ("right", self.right)):
            write_whole(where / f"{name}.npz", view.write)
