"""The views of two eyes, what is true of each pixel, and the ways to show the two on a screen."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.files import write_whole
from focalgradient.optics import Optics
from focalgradient.view import LUMINANCE

__all__ = ["EyeView", "StereoPair"]

Light = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EyeView:
    """The view of one eye, with the truth of each pixel.

    Parameters
    ----------
    light
        Linear light, H x W or H x W x 3.
    optics
        The eye's.
    distance
        True distance in metres, along the straight-ahead direction, of what each pixel shows, H x W.
    disparity
        Disparity shown, as the tangent of an angle in radians, H x W: place in the left eye's view minus place in the
        right eye's, to the right. Positive (crossed) for what is nearer than the plane of zero disparity.
    blur
        Radius of blur shown, in radians, H x W: of a disc, by the eye's own pupil and focus.
    is_monocular
        True where the other eye does not see what this pixel shows: it is hidden from it, or beyond its frame.
    is_invented
        True where the picture did not show what this eye sees, so that it was completed; False all over where the view
        was ray cast.
    """

    light: Light
    optics: Optics
    distance: NDArray[np.float64]
    disparity: NDArray[np.float64]
    blur: NDArray[np.float64]
    is_monocular: NDArray[np.bool_]
    is_invented: NDArray[np.bool_]

    @property
    def vergence(self) -> NDArray[np.float64]:
        """True vergence of each pixel, H x W, in dioptres, which are metre angles."""
        return np.asarray(1 / self.distance)

    def write(self, path: Path) -> None:
        """Write the light and the truth of every pixel into an ``.npz`` file, in 32 bits."""
        names = ("light", "distance", "vergence", "disparity", "blur", "is_monocular", "is_invented")
        arrays: dict[str, Any] = {name: getattr(self, name) for name in names}
        np.savez_compressed(path, **{n: a.astype(np.float32) if a.dtype == float else a for n, a in arrays.items()})

    def __repr__(self) -> str:
        """Size, and the shares that one eye sees alone and that were completed."""
        height, width = self.distance.shape
        return (
            f"EyeView({width} x {height} pixels, {self.is_monocular.mean():.1%} seen by this eye alone, "
            f"{self.is_invented.mean():.1%} completed)"
        )


@dataclass(frozen=True, slots=True, eq=False)
class StereoPair:
    """The views of a left and a right eye.

    Parameters
    ----------
    left, right
        The views.
    pixel_angle
        Angle in radians that a pixel subtends.
    interocular
        Distance between the eyes in metres.
    vergence
        Vergence in dioptres of the plane of zero disparity.
    """

    left: EyeView
    right: EyeView
    pixel_angle: float
    interocular: float
    vergence: float

    def side_by_side(self, *, crossed: bool = False) -> Light:
        """Return the left view beside the right one, H x 2 W; `crossed` the other way round, for crossed eyes."""
        pair = [self.left.light, self.right.light]
        return np.concatenate(pair[::-1] if crossed else pair, axis=1)

    def over_under(self) -> Light:
        """Return the left view above the right one, 2 H x W."""
        return np.concatenate([self.left.light, self.right.light], axis=0)

    def anaglyph(self, kind: Literal["grey", "colour"] = "grey") -> Light:
        """Return the pair for glasses with a red filter before the left eye and a cyan one before the right.

        Parameters
        ----------
        kind
            ``"grey"``: the luminance of each view, without rivalry of colours. ``"colour"``: red of the left view,
            green and blue of the right one.

        Returns
        -------
        ndarray
            Linear light, H x W x 3.
        """
        if kind not in ("grey", "colour"):
            raise InputError(f"kind is {kind!r}, but must be 'grey' or 'colour'.")
        left, right = self.left.light, self.right.light
        if left.ndim == 2 or kind == "grey":
            dark = [one if one.ndim == 2 else one @ np.asarray(LUMINANCE, np.float32) for one in (left, right)]
            return np.stack([dark[0], dark[1], dark[1]], axis=-1)
        return np.concatenate([left[..., :1], right[..., 1:]], axis=-1)

    def interleaved(self, *, first: Literal["left", "right"] = "left") -> Light:
        """Return the rows of both views in turn, H x W, for screens with polarised rows; the top row is the `first`'s.

        Every other row of each view is left out.
        """
        if first not in ("left", "right"):
            raise InputError(f"first is {first!r}, but must be 'left' or 'right'.")
        top, bottom = (self.left.light, self.right.light)[:: 1 if first == "left" else -1]
        rows = top.copy()
        rows[1::2] = bottom[1::2]
        return rows

    def screens(self, *, mirrored: bool = True) -> tuple[Light, Light]:
        """Return a picture for each eye's screen; `mirrored` left to right, as each is seen by one mirror."""
        way = -1 if mirrored else 1
        return self.left.light[:, ::way], self.right.light[:, ::way]

    def halves(self, size_px: tuple[int, int], *, centres_px: float | None = None, mirrored: bool = False) -> Light:
        """Return both views on one screen, for a mirror stereoscope.

        Parameters
        ----------
        size_px
            Width and height of the screen in pixels.
        centres_px
            From the middle of the left view to that of the right one. None: half of the screen's width.
        mirrored
            Whether each view is turned left to right, as for a stereoscope with one mirror for each eye; with two,
            it is not.

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

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write ``left.npz`` and ``right.npz`` into a folder, each with the light and the truth of every pixel.

        Their arrays are those of `EyeView`, with ``vergence`` in dioptres.
        """
        where = Path(folder)
        where.mkdir(parents=True, exist_ok=True)
        for name, view in (("left", self.left), ("right", self.right)):
            write_whole(where / f"{name}.npz", view.write)
