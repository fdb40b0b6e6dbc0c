"""Reading of colour pictures and depth maps, the inputs of `focalgradient.render.blur`."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_installed, warn
from focalgradient.files import printable, read_bytes
from focalgradient.photographs.encodings import Encoding, of_header, profile_name
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

    metres: FloatArray
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
        If it is decoded as sRGB but has another colour profile, which is not applied; or if it has 16 bits and does not
        state its encoding.

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
        pixels, encoding = _colours_of_exr(path), encoding or "linear"
    else:
        pixels, encoding, assumed = read_pixels(path, encoding)
        _check_colours(path, encoding)
        if assumed and pixels.dtype == np.uint16:
            warn(
                f"{printable(path)} does not state its encoding of light and is assumed to be linear, as its pixels "
                f"have 16 bits: state it if known (encoding)."
            )
    stored = pixels.dtype.kind == "f" or pixels.dtype in (np.uint8, np.uint16)
    if not (stored and np.isfinite(pixels).all()):
        raise InputError(
            f"{printable(path)} contains pixels that are NaN, infinite or of type {pixels.dtype}, but must contain 8- "
            "or 16-bit unsigned integers or finite floating-point numbers: repair or convert it."
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
        A single-channel .npy, PFM or floating-point TIFF file; an EXR file with one channel, or with one named Z or
        Depth; or an 8- or 16-bit PNG or TIFF file.
    unit
        Unit of the depth values.
    scale
        Units per step of the depth values; required for integer files, except in millimetres with a median of 0.1 to
        100 m: then 1.
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
        Holes (NaN, infinite, zero or negative values, except zero dioptres and infinite distance; and the largest value
        of the file where it marks them, such as 65535) are filled along rows from the farther of the two sides, since
        hidden surfaces mostly lie behind.

    Raises
    ------
    InputError
        If the file cannot be read, is not a depth map, or contains only holes; or if a parameter is missing.

    Warns
    -----
    FocalGradientWarning
        If holes were filled, or marked by the largest value.

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
    stored = _depth_values(path, scale, unit)
    marker = _marker(stored)
    marked = np.zeros(stored.shape, bool) if marker is None else stored == stored.dtype.type(marker)
    values = np.where(marked, np.nan, stored.astype(float)) * (1.0 if scale is None else scale)
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
    filled_in = " and were filled from their neighbours" if fill else ""
    by_value = "" if marker is None else f" ({marked.mean():.2%} by the value {marker:g}, which marks it)"
    if holes.any() and (fill or by_value):
        warn(f"{printable(path)}: {holes.mean():.2%} of the pixels have no depth{by_value}{filled_in}.")
    if holes.any() and fill:
        metres = _without_holes(metres)
    return Distances(metres, float(holes.mean()))


def png_of(values: NDArray[np.uint8]) -> bytes:
    """Return the PNG file of 8-bit values, H x W or H x W x 3 (red, green, blue)."""
    buffer = io.BytesIO()
    Image.fromarray(values).save(buffer, "PNG")
    return buffer.getvalue()


def _check_colours(path: Path, encoding: Encoding) -> None:
    """Raise `InputError` for a partly transparent picture; warn of a colour profile that is not applied."""
    nothing: tuple[bool, bytes | None] = False, None
    hidden, profile = of_header(path, _transparency_and_profile, nothing)
    if hidden:
        raise _transparent(path)
    if profile and encoding == "srgb" and "srgb" not in (name := profile_name(profile)).lower():
        warn(
            f"{printable(path)} has the colour profile {name}, but its colours are treated as sRGB: convert it to "
            "sRGB for exact colours."
        )


def _transparency_and_profile(image: Image.Image) -> tuple[bool, bytes | None]:
    hidden = image.has_transparency_data and image.convert("RGBA").getchannel("A").getextrema() != (255, 255)
    return hidden, image.info.get("icc_profile")


def _transparent(path: Path) -> InputError:
    return InputError(f"{printable(path)} is transparent in places, but must be opaque: flatten it.")


def _depth_values(path: Path, scale: float | None, unit: DepthUnit) -> NDArray[Any]:
    suffix = path.suffix.lower()
    if suffix == ".exr":
        values = _depth_of_exr(path)
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
    step = {"mm": "millimetre", "dioptres": "dioptre", "disparity": "pixel of disparity"}.get(unit)
    if values.dtype == np.uint8 and scale is None:
        example = f"1 if a step is one {step}" if step else "such as 0.01 for centimetres read as metres"
        raise InputError(
            f"{printable(path)} contains 8-bit integers, as a picture does: give the picture first, then its depth; or "
            f"for a depth map of 8 bits the {named('scale')}, {example}."
        )
    if values.dtype.kind in "iu" and scale is None:
        present = values[(values > 0) & (values < np.iinfo(values.dtype).max)]
        if unit == "mm" and present.size and PLAUSIBLE_MM[0] <= np.median(present) <= PLAUSIBLE_MM[1]:
            return values
        millimetres = f"{named('unit')} mm if it is a millimetre, the {named('scale')} in metres"
        remedy = f"the {named('scale')}, 1 if a step is one {step}" if step else millimetres
        raise InputError(
            f"{printable(path)} contains integers of type {values.dtype}, but not what one step is: give {remedy}, "
            "or a file of floating-point numbers."
        )
    return values


PLAUSIBLE_MM = 100.0, 1e5
"""Median distances in mm between which integers in millimetres need no scale."""

MARKERS = (
    *(255.0, 4095.0, 8191.0, 32767.0, 65504.0, 65535.0, 65.535, 655.35, 6553.5, 4294967295.0, 3.4028234663852886e38),
    *(999.0, 9999.0, 99999.0, 1e9, 1e10),
)
"""Values that mark pixels without depth, as cameras and programs write them."""

MIN_MARKER_RATIO = 2.0
"""Minimum ratio of a marker to the next value of the file, unless it is the largest number of 16 or more bits."""


def _marker(values: NDArray[Any]) -> float | None:
    """Return the value by which a depth file marks pixels without depth, if it has one.

    In files of integers of 16 or more bits it is the largest value of the type; otherwise one of `MARKERS`, where it
    is far above all other values.

    >>> _marker(np.array([[1200, 65535]], np.uint16)), _marker(np.array([[1.2, 65.0]]))
    (65535.0, None)
    """
    if values.dtype.kind in "iu" and values.dtype.itemsize > 1 and (values == np.iinfo(values.dtype).max).any():
        return float(np.iinfo(values.dtype).max)
    finite = values[np.isfinite(values)]
    if not finite.size:
        return None
    largest = finite.max()
    rest = finite[finite < largest]
    known = any(np.isclose(float(largest), marker, rtol=1e-6) for marker in MARKERS)
    apart = rest.size > 0 and float(largest) >= MIN_MARKER_RATIO * float(rest.max())
    return float(largest) if known and apart else None


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


COLOURS = frozenset(("", "combined", "rgb", "rgba", "color", "colour", "beauty", "composite", "image", "final"))
"""Names of layers that hold the picture, where several have colours."""

DEPTHS = ("z", "depth", "distance")
"""Names of channels and layers that hold depth."""


def _channels_of_exr(path: Path) -> dict[str, NDArray[Any]]:
    """Return the channels of all parts of an EXR file by their full name."""
    check_installed(f"{printable(path)} is an EXR file: it", "exr", "OpenEXR")
    import OpenEXR

    read_bytes(path, "an EXR file")  # rejects irregular or too large files
    channels: dict[str, NDArray[Any]] = {}
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            for number, part in enumerate(file.parts):
                for name, channel in part.channels.items():
                    within = "" if len(file.parts) == 1 or name in part.name() else f"{part.name() or number}."
                    whole = name if name.startswith(within) else f"{within}{name}"
                    channels[whole] = np.array(channel.pixels)
    except Exception as error:  # the decoder raises various exceptions for invalid files
        raise InputError(f"{printable(path)} cannot be read: expected an intact EXR file.") from error
    return channels


def _layers(channels: Mapping[str, NDArray[Any]]) -> dict[str, dict[str, NDArray[Any]]]:
    """Return the channels by layer, and within it by the last part of their name in upper case."""
    layers: dict[str, dict[str, NDArray[Any]]] = {}
    for name, pixels in channels.items():
        layer, _, last = name.rpartition(".")
        layers.setdefault(layer, {})[last.upper()] = pixels
    return layers


def _colours_of_exr(path: Path) -> NDArray[Any]:
    """Return the colours of an EXR file, H x W x 3, or its only channel, H x W."""
    channels = _channels_of_exr(path)
    layers = _layers(channels)
    coloured = [name for name, layer in layers.items() if {"R", "G", "B"} <= {*layer}]
    coloured = [name for name in coloured if _last(name) not in DEPTHS] or coloured
    if len(coloured) > 1:
        coloured = [name for name in coloured if _last(name) in COLOURS]
    if len(coloured) == 1:
        layer = layers[coloured[0]]
        if "A" in layer and (layer["A"] < 1).any():
            raise _transparent(path)
        return np.stack([layer[name] for name in "RGB"], axis=-1).astype(np.float32)
    if len(channels) == 1:
        return next(iter(channels.values())).astype(np.float32)
    raise InputError(
        f"{printable(path)} has the channels {', '.join(sorted(channels))}, but must have R, G and B of one layer, or "
        "only one: save the layer of the picture by itself."
    )


def _depth_of_exr(path: Path) -> NDArray[Any]:
    """Return the channel of depth of an EXR file, H x W: the only one, or the one named Z or Depth."""
    channels = _channels_of_exr(path)
    layers = _layers(channels)
    if len(channels) == 1:
        return next(iter(channels.values())).astype(np.float32)
    found: dict[str, NDArray[Any]] = {}
    for layer, own in layers.items():
        for last, pixels in own.items():
            named = last.lower() in DEPTHS and not {"X", "Y"} & {*own}  # the Z of a vector is not a depth
            if named or (_last(layer) in DEPTHS and (len(own) == 1 or last == "R")):
                found[f"{layer}.{last}".lstrip(".")] = pixels
    best = [name for name in found if "." not in name or _last(name.rpartition(".")[0]) in DEPTHS] or [*found]
    whole = next(iter(layers.values()))
    if not best and len(layers) == 1 and {"R", "G", "B"} <= {*whole}:  # depth saved as a grey picture
        return np.stack([whole[name] for name in "RGB"], axis=-1).astype(np.float32)
    if best and all(np.array_equal(found[best[0]], found[name]) for name in best):
        best = best[:1]
    if len(best) != 1:
        raise InputError(
            f"{printable(path)} has the channels {', '.join(sorted(channels))}, of which {len(best)} may be the depth: "
            "save the one that is by itself, or as the only one named Z."
        )
    return found[best[0]].astype(np.float32)


def _last(layer: str) -> str:
    return layer.rpartition(".")[2].strip().lower()


def _without_holes(metres: FloatArray) -> FloatArray:
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
