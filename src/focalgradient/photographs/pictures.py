"""Reading of colour pictures and depth maps, the inputs of `focalgradient.render.blur`."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from focalgradient.errors import FocalGradientWarning, InputError, check_installed
from focalgradient.files import printable, read_bytes
from focalgradient.photographs.encodings import FORMATS, Encoding, profile_name
from focalgradient.photographs.images import decoded, filled, read_pixels
from focalgradient.plausibility import named
from focalgradient.quantities import METRES, POSITIVE

__all__ = ["DepthUnit", "Distances", "Picture", "picture_of", "png_of", "read_distances", "read_picture"]

DepthUnit = Literal["m", "mm", "dioptres", "disparity"]
"""Quantity stored in a depth file: distance in metres or millimetres, vergence, or disparity in pixels."""

MIN_DISTANCE_M = 1e-6
"""Minimum plausible distance (m): about a wavelength of light."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Content of an image file, in colour.

    Parameters
    ----------
    light
        Linear radiance, 32 bits, H x W (grey) or H x W x 3 (red, green, blue); 1 is the maximum of an integer file.
    encoding
        ``"linear"`` or ``"srgb"``: encoding with which the values were decoded.
    pixel_type
        Pixel type of the file, such as ``"uint8"``.
    """

    light: NDArray[np.float32]
    encoding: Encoding
    pixel_type: str


@dataclass(frozen=True, slots=True, eq=False)
class Distances:
    """Distance of every pixel in metres, H x W, and the fraction of pixels that were filled, 0 to 1."""

    metres: NDArray[np.float64]
    filled: float


def read_picture(path: Path, encoding: Encoding | None = None) -> Picture:
    """Read a picture as linear radiance, in colour.

    Parameters
    ----------
    path
        An 8- or 16-bit PNG, TIFF (also 32- and 64-bit floating point) or JPEG file; EXR (with the extra ``exr``); a
        .npy file with an H x W or H x W x 3 array; or a camera raw file, of which only green is used.
    encoding
        Encoding of the picture.  [default: as stated in the file; else srgb for 8 bits, linear for more]

    Raises
    ------
    InputError
        If the file cannot be read, contains NaN or infinite pixels, or is transparent in places.

    Warns
    -----
    FocalGradientWarning
        If it is decoded as sRGB but has another colour profile, which is not applied.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "grey.npy"), np.full((4, 6), 0.5))
    ...     picture = read_picture(Path(folder, "grey.npy"))
    >>> picture.light.shape, float(picture.light[0, 0])
    ((4, 6), 0.5)
    """
    if path.suffix.lower() == ".exr":
        pixels, encoding = _read_exr(path), encoding or "linear"
    else:
        pixels, encoding, _ = read_pixels(path, encoding)
        _check_colours(path, encoding)
    stored = pixels.dtype.kind == "f" or pixels.dtype in (np.uint8, np.uint16)
    if not (stored and np.isfinite(pixels).all()):
        raise InputError(
            f"{printable(path)} contains pixels that are NaN, infinite or of type {pixels.dtype}, but must contain "
            "8- or "
            "16-bit unsigned integers or finite floating-point numbers: repair or convert it."
        )
    return picture_of(pixels, encoding)


def picture_of(pixels: NDArray[Any], encoding: Encoding) -> Picture:
    """Return the linear radiance of pixels as stored, H x W or H x W x 3 (red, green, blue).

    >>> float(picture_of(np.full((1, 1), 255, np.uint8), "srgb").light[0, 0])
    1.0
    """
    return Picture(decoded(pixels, encoding), encoding, pixels.dtype.name)


def read_distances(
    path: Path,
    unit: DepthUnit = "m",
    *,
    scale: Annotated[float | None, POSITIVE, "S"] = None,
    baseline: Annotated[float | None, METRES] = None,
    pixel_angle: float | None = None,
    offset: Annotated[float, "PX"] = 0.0,
    fill: bool = True,
) -> Distances:
    """Read the depth map of a picture.

    Parameters
    ----------
    path
        A single-channel .npy, EXR, PFM or floating-point TIFF file, or an 8- or 16-bit PNG or TIFF file.
    unit
        Unit of the depth values.
    scale
        Units per step of the depth values; required for integer files.
    baseline
        Baseline of the stereo pair in metres, for disparity in pixels.
    pixel_angle
        For disparity, visual angle of a pixel in radians. The distance is baseline / (pixel angle x (disparity +
        offset)).
    offset
        Offset added to each disparity, in pixels.
    fill
        Whether to fill holes; otherwise they are NaN.

    Returns
    -------
    Distances
        Holes (NaN, infinite, zero or negative values, except zero dioptres and infinite distance) are filled along rows
        from the farther of the two sides, since hidden surfaces mostly lie behind.

    Raises
    ------
    InputError
        If the file cannot be read, is not a depth map, or contains only holes; or if a parameter is missing.

    Warns
    -----
    FocalGradientWarning
        If holes were filled.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "depth.npy"), np.full((4, 6), 2500.0))
    ...     depth = read_distances(Path(folder, "depth.npy"), "mm")
    >>> float(depth.metres[0, 0])
    2.5
    """
    if unit != "disparity" and (baseline is not None or offset):
        raise InputError(
            f"{named('baseline')} and {named('offset')} are for disparity, but {printable(path)} contains {unit}: "
            "leave them out."
        )
    values = _depth_values(path, scale).astype(float) * (1.0 if scale is None else scale)
    if unit == "disparity":
        if baseline is None or pixel_angle is None:
            raise InputError(
                f"{printable(path)} contains disparity, which needs the {named('baseline')}: give it in metres."
            )
        values = (values + offset) * pixel_angle / baseline
    inverse = unit in ("dioptres", "disparity")
    with np.errstate(divide="ignore", invalid="ignore"):
        if inverse:
            is_valid = np.isfinite(values) & ((values >= 0) if unit == "dioptres" else (values > 0))
            metres = np.where(is_valid, 1 / np.where(values == 0, 0.0, values), np.nan)
        else:
            metres = np.where(values > 0, values * (1e-3 if unit == "mm" else 1.0), np.nan)
    holes = np.isnan(metres)
    if holes.all():
        raise InputError(
            f"{printable(path)} contains no valid distance: every value is zero, negative or not finite; give "
            "positive distances in front of the eye or camera."
        )
    if (nearest := np.nanmin(metres)) < MIN_DISTANCE_M:
        raise InputError(
            f"{printable(path)} contains distances of {nearest:.2g} m, but they must be {MIN_DISTANCE_M:g} m or more: "
            f"check the {named('unit')} and the {named('scale')}."
        )
    if holes.any() and fill:
        warnings.warn(
            f"{printable(path)}: {holes.mean():.2%} of the pixels have no depth and were filled from their neighbours.",
            FocalGradientWarning,
            stacklevel=2,
        )
        metres = _without_holes(metres)
    return Distances(metres, float(holes.mean()))


def png_of(values: NDArray[np.uint8]) -> bytes:
    """Return an 8-bit picture, H x W or H x W x 3 (red, green, blue), as a PNG file in bytes."""
    is_valid, data = cv2.imencode(".png", values[..., ::-1] if values.ndim == 3 else values)
    assert is_valid
    return bytes(data)


def _check_colours(path: Path, encoding: Encoding) -> None:
    """Raise `InputError` for a partly transparent picture; warn of a colour profile that is not applied."""
    try:
        with Image.open(path, formats=FORMATS) as image:
            hidden = image.has_transparency_data and image.convert("RGBA").getchannel("A").getextrema() != (255, 255)
            profile = image.info.get("icc_profile")
    except (OSError, ValueError, Image.DecompressionBombError):
        return  # format without transparency or profile
    if hidden:
        raise _transparent(path)
    if profile and encoding == "srgb" and "srgb" not in (name := profile_name(profile)).lower():
        warnings.warn(
            f"{printable(path)} has the colour profile {name}, but its colours are treated as sRGB: convert it to "
            "sRGB for "
            "exact colours.",
            FocalGradientWarning,
            stacklevel=3,
        )


def _transparent(path: Path) -> InputError:
    return InputError(f"{printable(path)} is transparent in places, but must be opaque: flatten it.")


def _depth_values(path: Path, scale: float | None) -> NDArray[Any]:
    suffix = path.suffix.lower()
    if suffix == ".exr":
        values = _read_exr(path)
    elif suffix == ".pfm":
        values = _read_pfm(path)
    else:
        values, *_ = read_pixels(path, "linear")
    if values.ndim == 3 and (values[..., :1] == values).all():
        values = values[..., 0]
    if values.ndim != 2:
        raise InputError(
            f"{printable(path)} has shape {values.shape}, but a depth map must be H x W, one number a pixel: give the "
            "picture first, then its depth."
        )
    if values.dtype.kind not in "fiu":
        raise InputError(f"{printable(path)} contains values of type {values.dtype}, but depth must be real numbers.")
    if values.dtype == np.uint8 and scale is None:
        raise InputError(
            f"{printable(path)} contains 8-bit integers, as a picture does: give the picture first, then its depth; or "
            f"for a depth map of 8 bits the {named('scale')}, such as 0.01 for centimetres read as metres."
        )
    if values.dtype.kind in "iu" and scale is None:
        raise InputError(
            f"{printable(path)} contains integers of type {values.dtype}, but not what one step is: "
            f"give the {named('scale')}, such as 0.001 for millimetres read as metres, or a file of floating-point "
            "numbers."
        )
    return values


def _read_pfm(path: Path) -> NDArray[np.float32]:
    """Read a portable float map: three text lines, then rows from bottom to top; negative scale: little-endian."""
    data = read_bytes(path, "a PFM file")
    try:
        kind, size, order, rest = data.split(b"\n", 3)
        width, height = (int(side) for side in size.split())
        channels = {b"Pf": 1, b"PF": 3}[kind.strip()]
        count = width * height * channels
        if not (0 < width < 1 << 16 and 0 < height < 1 << 16 and len(rest) >= 4 * count):
            raise ValueError
        pixels = np.frombuffer(rest, "<f4" if float(order) < 0 else ">f4", count)
    except (KeyError, ValueError) as error:
        raise InputError(f"{printable(path)} cannot be read: expected an intact PFM file.") from error
    shape = (height, width) if channels == 1 else (height, width, channels)
    return pixels.reshape(shape)[::-1].astype(np.float32)


def _read_exr(path: Path) -> NDArray[Any]:
    """Return the colours of an EXR file, H x W x 3, or its only channel, H x W."""
    check_installed(f"{printable(path)} is an EXR file: it", "exr", "OpenEXR")
    import OpenEXR

    read_bytes(path, "an EXR file")  # rejects irregular or too large files
    try:
        with OpenEXR.File(str(path)) as file:
            channels = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
    except Exception as error:  # the decoder raises various exceptions for invalid files
        raise InputError(f"{printable(path)} cannot be read: expected an intact EXR file.") from error
    if "RGBA" in channels and (channels["RGBA"][..., 3] < 1).any():
        raise _transparent(path)
    for name in ("RGB", "RGBA"):
        if name in channels:
            return channels[name][..., :3].astype(np.float32)
    if len(channels) != 1:
        raise InputError(
            f"{printable(path)} has the channels {', '.join(sorted(channels))}, but must have R, G and B, or only one."
        )
    return next(iter(channels.values())).astype(np.float32)


def _without_holes(metres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fill each row's holes from the farther of both sides; rows without any depth, from the nearest pixel."""
    is_valid = ~np.isnan(metres)
    place = np.arange(metres.shape[1])
    before = np.maximum.accumulate(np.where(is_valid, place, -1), axis=1)
    after = np.minimum.accumulate(np.where(is_valid, place, metres.shape[1])[:, ::-1], axis=1)[:, ::-1]
    left = np.where(before >= 0, np.take_along_axis(metres, np.maximum(before, 0), axis=1), -np.inf)
    inside = np.minimum(after, metres.shape[1] - 1)
    right = np.where(after < metres.shape[1], np.take_along_axis(metres, inside, axis=1), -np.inf)
    full = np.where(is_valid, metres, np.maximum(left, right))
    found = full > -np.inf
    return full if found.all() else filled(full, found)
