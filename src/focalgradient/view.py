"""A view: an image together with the optics that formed it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_number, described
from focalgradient.optics import Optics, check_optics
from focalgradient.plausibility import PIXEL_ANGLE, check_frame, check_pixel_pitch

__all__ = ["LUMINANCE", "View", "check_mask", "check_pixel_angle", "check_shape", "from_centre"]

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Weights of linear red, green and blue light in luminance (Rec. ITU-R BT.709, the primaries of sRGB)."""

MAX_PIXEL_ANGLE = 0.5
"""Upper limit on the pixel angle (rad): two such pixels would fill a frame of 60 degrees."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class View:
    """An image together with the optics that formed it.

    Parameters
    ----------
    image
        *Linear* radiance in any unit, H x W, floating point. Display-encoded (sRGB) values must be decoded first.
    optics
        `Lens` or eye that formed the image.
    pixel_angle
        Angle in radians that one pixel subtends at the lens on the optical axis: pixel pitch / sensor distance.
    mask
        H x W, True where a pixel is valid, False where it is saturated or defective; None: all are valid. Masked pixels
        must be finite, too; best fill them with values close to their neighbours'.

    Raises
    ------
    InputError
        If the image is not an H x W array of finite floating-point numbers, `optics` does not implement `Optics`, the
        pixel angle is not positive and below 0.5 rad, corresponds to less than 0.05 um on the sensor of a `Lens`, or
        makes a frame of more than 160 degrees, or the mask is not an H x W array of booleans that is True somewhere.

    Warns
    -----
    FocalGradientWarning
        If the pixel angle corresponds to less than 0.48 um on the sensor of a `Lens`: a pixel pitch may have been
        given.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> lens = Lens(focal_length=0.025, f_number=4, focus_distance=1.0)
    >>> view = View(np.zeros((48, 64)), lens, pixel_angle=8e-6 / lens.sensor_distance)
    >>> view.shape, round(view.pixel_angle * 1e6, 1)
    ((48, 64), 312.0)
    """

    image: NDArray[np.floating]
    optics: Optics
    pixel_angle: float
    mask: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        image = self.image
        if not isinstance(image, np.ndarray) or not np.issubdtype(image.dtype, np.floating):
            kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
            raise InputError(
                f"image is of type {kind}, but must be an array of floating-point linear radiance: "
                "decode and convert it first."
            )
        if image.ndim != 2 or 0 in image.shape:
            raise InputError(f"image has shape {image.shape}, but must be H x W: turn colour into luminance first.")
        if not np.isfinite(image).all():
            count = np.size(image) - int(np.isfinite(image).sum())
            raise InputError(
                f"image contains {count} NaN or infinite pixels, but every pixel must be finite: repair or crop it, "
                "or fill them with np.nan_to_num(image) and give mask=np.isfinite(image)."
            )
        check_optics(self.optics)
        check_pixel_angle(self.pixel_angle, self.optics)
        check_frame(self.pixel_angle, image.shape)
        check_mask(self.mask, image.shape)

    def __repr__(self) -> str:
        """Return size, optics and pixel angle, without the pixels.

        >>> from focalgradient import Lens
        >>> View(np.ones((48, 64)), Lens(0.025, 4, 1.0), 3e-4)
        View(48 x 64 pixels of 0.0003 rad, 6.25 mm aperture, focus at 1 D)
        """
        height, width = self.shape
        aperture, focus = 1e3 * self.optics.aperture_diameter, self.optics.focus_vergence
        masked = "" if self.mask is None else f", {np.mean(~self.mask):.1%} masked"
        return (
            f"View({height} x {width} pixels of {self.pixel_angle:.3g} rad, {aperture:.3g} mm aperture, "
            f"focus at {focus:.4g} D{masked})"
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.image.shape
        return height, width


def check_pixel_angle(pixel_angle: float, optics: Optics) -> None:
    """Validate a pixel angle; warn of one too small for a sensor, which is probably a pixel pitch.

    Raises
    ------
    InputError
        If `pixel_angle`, in radians, is not positive, or exceeds that of any camera's pixel.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> lens = Lens(0.05, 2, 1.0)
    >>> check_pixel_angle(3e-4, lens)
    >>> check_pixel_angle(8.0, lens)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: pixel_angle is 8 rad, wider than a camera's pixel: ...
    """
    check_number("pixel_angle", pixel_angle, "radians", positive=True)
    if pixel_angle >= MAX_PIXEL_ANGLE:
        raise InputError(f"pixel_angle is {pixel_angle:g} rad, wider than a camera's pixel: {PIXEL_ANGLE}.")
    check_pixel_pitch(pixel_angle * getattr(optics, "sensor_distance", math.inf), pixel_angle)


def check_mask(mask: object, shape: tuple[int, ...]) -> None:
    """Validate a mask of valid pixels.

    Raises
    ------
    InputError
        If `mask` is neither None nor an array of booleans of that `shape` (H x W), or is False everywhere.

    Examples
    --------
    >>> check_mask(np.ones((2, 3), bool), (2, 3))
    >>> check_mask(np.zeros((2, 3), bool), (2, 3))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: mask is False everywhere...
    """
    if mask is None:
        return
    if not (isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == shape):
        what = f"a {mask.dtype} array of shape {mask.shape}" if isinstance(mask, np.ndarray) else type(mask).__name__
        raise InputError(
            f"mask is {what}, but must be an array of booleans of the image's shape {shape}: True where a pixel can be "
            "used."
        )
    if not mask.any():
        raise InputError("mask is False everywhere, but must be True where a pixel can be used: invert it.")


def check_shape(shape: Any) -> None:
    """Raise `InputError` unless `shape` is a positive height and width in pixels.

    >>> check_shape((480, 0))
    Traceback (most recent call last):
    focalgradient.errors.InputError: shape is (480, 0), but must be a positive height and width in pixels.
    """
    lengths = shape if isinstance(shape, Sequence) else ()
    if len(lengths) != 2 or not all(isinstance(length, int) and length >= 1 for length in lengths):
        raise InputError(f"shape is {described(shape)}, but must be a positive height and width in pixels.")


def from_centre(shape: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """Return how far the pixels of a frame lie to the right (1 x W) of its centre and below it (H x 1), in pixels.

    >>> right, down = from_centre((2, 3))
    >>> right.tolist(), down.tolist()
    ([[-1.0, 0.0, 1.0]], [[-0.5], [0.5]])
    """
    down, right = (np.arange(n, dtype=np.float64) - (n - 1) / 2 for n in shape)
    return right[None], down[:, None]
