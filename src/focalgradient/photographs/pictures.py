"""Pictures in colour and their depth, from files: what `focalgradient.render.blur` is made of."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from focalgradient.errors import FocalGradientWarning, InputError, check_installed
from focalgradient.files import printable, read_bytes
from focalgradient.photographs.encodings import FORMATS, Encoding, profile_name
from focalgradient.photographs.images import decoded, filled, read_pixels

__all__ = ["DepthUnit", "Distances", "Picture", "picture_of", "png_of", "read_distances", "read_picture"]

DepthUnit = Literal["m", "mm", "dioptres", "disparity"]
"""What the values of a depth file are: distances in metres or millimetres, vergence, or disparity in pixels."""

NEAREST_M = 1e-6
"""The least distance (m) that is a picture's: about a wavelength of light."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """What an image file shows.

    Parameters
    ----------
    light
        Linear radiance, 32 bits, H x W in grey or H x W x 3 (red, green, blue); 1 is the maximum of an integer file.
    encoding
        ``"linear"`` or ``"srgb"``: how the file's values were read.
    pixel_type
        The file's own pixel type, such as ``"uint8"``.
    """

    light: NDArray[np.float32]
    encoding: Encoding
    pixel_type: str


@dataclass(frozen=True, slots=True, eq=False)
class Distances:
    """The distance of every pixel, in metres, H x W, and the share of them that was filled in, 0 to 1."""

    metres: NDArray[np.float64]
    filled: float


def read_picture(path: Path, encoding: Encoding | None = None) -> Picture:
    """Read a picture as linear light, its colours kept.

    Parameters
    ----------
    path
        An 8- or 16-bit PNG, TIFF (also 32- and 64-bit floating point) or JPEG; EXR (with the extra ``exr``); a .npy
        file with an H x W or H x W x 3 array; or a camera raw file, of which the green light is read.
    encoding
        ``"linear"`` or ``"srgb"``. None: as the file says, or else sRGB for 8-bit image files, linear for all others.

    Raises
    ------
    InputError
        If the file cannot be read, holds NaN or infinite pixels, or is transparent in places.

    Warns
    -----
    FocalGradientWarning
        If it is read as sRGB but has another colour profile, which is not applied.

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
        _look_at_colours(path, encoding)
    stored = pixels.dtype.kind == "f" or pixels.dtype in (np.uint8, np.uint16)
    if not (stored and np.isfinite(pixels).all()):
        raise InputError(
            f"{printable(path)} holds pixels that are NaN, infinite or of type {pixels.dtype}, but must hold 8- or "
            "16-bit unsigned integers or finite floating-point numbers: repair or convert it."
        )
    return picture_of(pixels, encoding)


def picture_of(pixels: NDArray[Any], encoding: Encoding) -> Picture:
    """Give the light of pixels as stored, H x W or H x W x 3 (red, green, blue).

    >>> float(picture_of(np.full((1, 1), 255, np.uint8), "srgb").light[0, 0])
    1.0
    """
    return Picture(decoded(pixels, encoding), encoding, pixels.dtype.name)


def read_distances(
    path: Path,
    unit: DepthUnit = "m",
    *,
    scale: float | None = None,
    baseline: float | None = None,
    pixel_angle: float | None = None,
    offset: float = 0.0,
    fill: bool = True,
) -> Distances:
    """Read the depth of a picture.

    Parameters
    ----------
    path
        A .npy, EXR, PFM or floating-point TIFF file of one channel, or an 8- or 16-bit PNG or TIFF.
    unit
        What its values are, times `scale`.
    scale
        Units in a step of the file: 1 by default, and to be given for files of integers.
    baseline, pixel_angle, offset
        For disparity: metres between the cameras, radians of a pixel, and pixels to add to each disparity. The
        distance is baseline / (pixel angle x (disparity + offset)).
    fill
        Fill holes; if not, they are NaN.

    Returns
    -------
    Distances
        Holes (NaN, infinite, zero or negative values; zero dioptres and an infinite distance are none) are filled from
        beside them in their row, from the farther of the two sides: what is not seen mostly lies behind.

    Raises
    ------
    InputError
        If the file cannot be read, is no map of depth, or holds holes only; or if a parameter is missing.

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
        raise InputError(f"baseline and offset are for disparity, but {printable(path)} holds {unit}: leave them out.")
    values = _depth_values(path, scale).astype(float) * (1.0 if scale is None else scale)
    if unit == "disparity":
        if baseline is None or pixel_angle is None:
            raise InputError(f"{printable(path)} holds disparity, which needs the baseline: give it in metres.")
        values = (values + offset) * pixel_angle / baseline
    inverse = unit in ("dioptres", "disparity")
    with np.errstate(divide="ignore", invalid="ignore"):
        if inverse:
            good = np.isfinite(values) & ((values >= 0) if unit == "dioptres" else (values > 0))
            metres = np.where(good, 1 / np.where(values == 0, 0.0, values), np.nan)
        else:
            metres = np.where(values > 0, values * (1e-3 if unit == "mm" else 1.0), np.nan)
    holes = np.isnan(metres)
    if holes.all():
        raise InputError(f"{printable(path)} holds no distance at all: every value is zero, negative or not finite.")
    if (nearest := np.nanmin(metres)) < NEAREST_M:
        raise InputError(
            f"{printable(path)} holds distances of {nearest:.2g} m, but they must be {NEAREST_M:g} m or more: "
            "look at the unit and the scale."
        )
    if holes.any() and fill:
        warnings.warn(
            f"{printable(path)}: {holes.mean():.2%} of the pixels have no depth; they were filled in from beside them.",
            FocalGradientWarning,
            stacklevel=2,
        )
        metres = _without_holes(metres)
    return Distances(metres, float(holes.mean()))


def png_of(values: NDArray[np.uint8]) -> bytes:
    """A picture of 8 bits, H x W or H x W x 3 (red, green, blue), as the bytes of a PNG file."""
    good, data = cv2.imencode(".png", values[..., ::-1] if values.ndim == 3 else values)
    assert good
    return bytes(data)


def _look_at_colours(path: Path, encoding: Encoding) -> None:
    """Refuse a picture whose alpha channel hides a part of it, as what is behind it is not known; warn of a profile."""
    try:
        with Image.open(path, formats=FORMATS) as image:
            hidden = image.has_transparency_data and image.convert("RGBA").getchannel("A").getextrema() != (255, 255)
            profile = image.info.get("icc_profile")
    except (OSError, ValueError, Image.DecompressionBombError):
        return  # no kind of picture that has either
    if hidden:
        raise _transparent(path)
    if profile and encoding == "srgb" and "srgb" not in (name := profile_name(profile)).lower():
        warnings.warn(
            f"{printable(path)} has the colour profile {name}, but its colours are read as sRGB: convert it to sRGB if "
            "they are to be exact.",
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
        raise InputError(f"{printable(path)} has shape {values.shape}, but a map of depth must be H x W.")
    if values.dtype.kind not in "fiu":
        raise InputError(f"{printable(path)} holds values of type {values.dtype}, but depth must be real numbers.")
    if values.dtype.kind in "iu" and scale is None:
        raise InputError(
            f"{printable(path)} holds integers of type {values.dtype}, whose step is not known: "
            "give the scale, such as 0.001 for millimetres read as metres, or a file of floating-point numbers."
        )
    return values


def _read_pfm(path: Path) -> NDArray[np.float32]:
    """A portable float map: three lines of text, then rows from the bottom up; a negative scale means little-endian."""
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
    """The colours of an EXR file, H x W x 3, or its one channel, H x W."""
    check_installed(f"{printable(path)} is an EXR file: it", "exr", "OpenEXR")
    import OpenEXR

    read_bytes(path, "an EXR file")  # refuses what is no regular file, or too large
    try:
        with OpenEXR.File(str(path)) as file:
            channels = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
    except Exception as error:  # the decoder fails in many ways on what is not its own
        raise InputError(f"{printable(path)} cannot be read: expected an intact EXR file.") from error
    if "RGBA" in channels and (channels["RGBA"][..., 3] < 1).any():
        raise _transparent(path)
    for name in ("RGB", "RGBA"):
        if name in channels:
            return channels[name][..., :3].astype(np.float32)
    if len(channels) != 1:
        raise InputError(
            f"{printable(path)} has the channels {', '.join(sorted(channels))}, but must have R, G and B, or one alone."
        )
    return next(iter(channels.values())).astype(np.float32)


def _without_holes(metres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fill each row's holes from the farther of both sides; rows without any depth, from the nearest pixel."""
    good = ~np.isnan(metres)
    place = np.arange(metres.shape[1])
    before = np.maximum.accumulate(np.where(good, place, -1), axis=1)
    after = np.minimum.accumulate(np.where(good, place, metres.shape[1])[:, ::-1], axis=1)[:, ::-1]
    left = np.where(before >= 0, np.take_along_axis(metres, np.maximum(before, 0), axis=1), -np.inf)
    inside = np.minimum(after, metres.shape[1] - 1)
    right = np.where(after < metres.shape[1], np.take_along_axis(metres, inside, axis=1), -np.inf)
    full = np.where(good, metres, np.maximum(left, right))
    found = full > -np.inf
    return full if found.all() else filled(full, found)
