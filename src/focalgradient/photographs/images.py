"""Reading of image files as linear luminance.

Values are decoded first, then colour is converted: luminance is a weighted sum of *linear* red, green and blue.
"""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

# The same pixel limit for compressed TIFF files as Pillow's for other formats; OpenCV reads it once.
os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", "178956970")

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageOps, ImageSequence
from scipy.ndimage import distance_transform_edt

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, warn
from focalgradient.files import opened, printable, read_array, read_bytes
from focalgradient.memory import require
from focalgradient.photographs.cropping import cropped
from focalgradient.photographs.encodings import FORMATS, Encoding, of_header, stated_encoding
from focalgradient.photographs.photograph import Photograph
from focalgradient.photographs.raw import CELL, is_raw, read_raw
from focalgradient.srgb import srgb_to_linear
from focalgradient.view import LUMINANCE

__all__ = ["read_photograph", "read_photographs"]

_MAX_INVALID_FRACTION = 0.5
"""Maximum fraction of pixels that are saturated, NaN, infinite or transparent."""

_PILED_UP, _VALUES_BELOW, _LEAST_SATURATED = 5.0, 16, 2e-4
"""Ratio of the pixels at the highest value to those at any of this many values below it, and their minimum proportion,
above which a 16-bit image is saturated there (our choice)."""

_SATURATED_WARNING_FRACTION = 1e-3
"""Fraction of pixels at the type's maximum above which a warning is issued."""

_BYTES_KEPT, _BYTES_MADE = 5, 40
"""Bytes per pixel that a photograph occupies (luminance and mask), and additionally while it is decoded."""

_MIN_JPEG_QUALITY = 89
"""JPEG quality below which compression errors are not covered by the stated uncertainty: at 90 they mostly are, at 85
and 75 not (`benchmarks/stored_photographs.py`)."""

_STEP_OF_QUALITY_50 = 57.625
"""Mean luminance quantisation step at quality 50: example table of the JPEG standard (T.81, Annex K)."""

_MEMORY_REMEDY = "crop or reduce the images, or give fewer of them"

_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG"
_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
"""Signatures of the decoded formats; the last two are TIFF files of more than 4 GB."""

_ARRAY = "an array of an image"

_MAX_VALUE = 1e9
"""Maximum absolute value of floating-point pixels; the brightest pixel must exceed its inverse. Beyond these limits
fourth powers leave the range of single precision."""

_MIN_FLAT_BRIGHTNESS = 0.05
"""Minimum brightness of a flat field as a fraction of its maximum."""


def read_photograph(
    path: str | os.PathLike[str], encoding: Encoding | None = None, flat: str | os.PathLike[str] | None = None
) -> Photograph:
    """Read an image file as linear luminance.

    Parameters
    ----------
    path
        An 8- or 16-bit PNG, TIFF (also 32- and 64-bit floating point) or JPEG file, grey or colour; a .npy file with an
        H x W or H x W x 3 (red, green, blue) array; or a camera raw file, of which only green is used (see
        `focalgradient.photographs.raw`). The orientation tag is applied.
    encoding
        Encoding of the values, ``"linear"`` or ``"srgb"``. None: as stated by the file (`stated_encoding`), otherwise
        sRGB for 8-bit pixels and linear for all others. Camera raw files are always linear.
    flat
        Flat field: picture of a uniformly lit, blank surface with the same lens, aperture and focus, sharp or not,
        which corrects vignetting. Its smooth fall-off relative to its mean is used, not its noise.

    Raises
    ------
    InputError
        If the file is missing, unreadable or not an image; if more than half its pixels are saturated (at the maximum
        of an integer type), NaN, infinite or transparent; if it is black (no pixel above 2 levels and 0.1 % of that
        maximum; for floating point, none above 0) or uniform; or if the flat field differs in size, is saturated, or is
        dark somewhere.

    Warns
    -----
    FocalGradientWarning
        If more than 0.1 % of the pixels are saturated, or any is NaN, infinite or transparent, which `Photograph.mask`
        excludes; and if it is a JPEG below about quality 90.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "ramp.npy"), np.linspace(0.1, 0.9, 24).reshape(4, 6))
    ...     photograph = read_photograph(Path(folder, "ramp.npy"))
    >>> photograph.luminance.shape, round(float(photograph.luminance[-1, -1]), 3)
    ((4, 6), 0.9)
    """
    path = Path(path)
    pixels, encoding, assumed = read_pixels(path, encoding)
    mask, saturated = _valid_pixels(path, pixels)
    _warn_of_low_quality(path)
    mask &= _opaque(path, mask.shape)
    if not mask.all() and np.issubdtype(pixels.dtype, np.floating):
        pixels = filled(pixels, mask)
    luminance = _luminance(pixels, encoding)
    if flat is not None:
        luminance = _flattened(path, luminance, pixels, Path(flat), encoding)
    return Photograph(
        *(path, luminance, encoding, pixels.dtype.name, saturated, CELL if is_raw(path) else 1),
        mask=None if mask.all() else mask,
        assumed=assumed,
    )


def read_photographs(
    paths: Sequence[str | os.PathLike[str]],
    encoding: Encoding | None = None,
    flats: Sequence[str | os.PathLike[str] | None] | None = None,
    *,
    crop: bool = False,
) -> list[Photograph]:
    """Read image files of equal size by `read_photograph`, each with its flat field if any.

    With `crop`, images of unequal size but equal scale are cropped to their common field.

    Raises
    ------
    InputError
        As for `read_photograph`, and if the sizes differ.

    Warns
    -----
    FocalGradientWarning
        As for `read_photograph`, and if encodings differ, at least one of them assumed.
    """
    sizes = [_size(Path(path)) or 0 for path in paths]
    needed = _BYTES_KEPT * sum(sizes) + _BYTES_MADE * max(sizes, default=0)
    require(needed, f"reading {len(paths)} images of {max(sizes, default=0) / 1e6:.3g} million pixels", _MEMORY_REMEDY)
    each = zip(paths, flats or [None] * len(paths), strict=True)
    photographs = [read_photograph(path, encoding, flat) for path, flat in each]
    _warn_of_mixed_encodings(photographs)
    if crop and len({photograph.luminance.shape for photograph in photographs}) > 1:
        photographs = cropped(photographs)
    for number, other in enumerate(photographs[1:], 1):
        for one in photographs[:number]:
            if np.array_equal(one.luminance, other.luminance):
                raise InputError(
                    f"{printable(one.path)} and {printable(other.path)} contain the same picture, pixel for pixel, but "
                    "depth needs differences in blur: give photographs with different aperture or focus."
                )
        (h0, w0), (h, w) = photographs[0].luminance.shape, other.luminance.shape
        if (h0, w0) != (h, w):
            raise InputError(
                f"{photographs[0].path} is {w0} x {h0} pixels but {other.path} is {w} x {h}: views of one scene must "
                "have the same size and orientation, so export them with the same settings, or crop them "
                "to their common field (crop=True)."
            )
    return photographs


def _warn_of_mixed_encodings(photographs: Sequence[Photograph]) -> None:
    """Warn if photographs are decoded by different encodings, at least one of them assumed."""
    by_encoding = {photograph.encoding: photograph for photograph in photographs}
    if len(by_encoding) > 1 and any(photograph.assumed for photograph in photographs):
        texts = [
            f"{printable(photograph.path)} ({photograph.pixel_type}) is "
            f"{'assumed to be ' if photograph.assumed else ''}{encoding.replace('srgb', 'sRGB')}"
            for encoding, photograph in by_encoding.items()
        ]
        warn(
            f"{', but '.join(texts)}: export all photographs with the same encoding and bit depth, or state the "
            "encoding that all have (encoding, or encoding under [camera])."
        )


def read_pixels(path: Path, encoding: Encoding | None) -> tuple[NDArray[Any], Encoding, bool]:
    """Return the file's pixels, their encoding, and whether the encoding is only assumed."""
    if is_raw(path):
        return read_raw(path, read_image_bytes(path)), "linear", False
    if path.suffix.lower() == ".npy":
        array = _read_array(path)
        return array, encoding or ("srgb" if array.dtype == np.uint8 else "linear"), array.dtype == np.uint8
    data = read_image_bytes(path)
    pixels = _decode(path, data)
    if data.startswith(_TIFF):
        _name_page(path, data)
    found = encoding or stated_encoding(data, path)
    return pixels, found or ("srgb" if pixels.dtype == np.uint8 else "linear"), found is None


def _name_page(path: Path, data: bytes) -> None:
    """Warn that the first page of a TIFF file with several pages is used; smaller previews do not count."""
    sizes: list[tuple[int, int]] = of_header(
        data, lambda image: [page.size for page in ImageSequence.Iterator(image)], []
    )
    pages = sum(size[0] * size[1] >= sizes[0][0] * sizes[0][1] for size in sizes)
    if pages > 1:
        warn(f"{printable(path)} has {pages} pages, of which page 1 was read: save the page that you mean as a file.")


def _flattened(
    path: Path, luminance: NDArray[np.float32], pixels: NDArray[Any], flat: Path, encoding: Encoding
) -> NDArray[np.float32]:
    """Return `luminance` divided by the smooth fall-off of the flat field; saturated pixels keep a common maximum."""
    even = read_photograph(flat, encoding)
    shape, size = even.luminance.shape, luminance.shape
    if shape != size:
        raise InputError(
            f"flat field {flat} is {shape[1]} x {shape[0]} pixels but {path} is {size[1]} x {size[0]}: record and "
            "export both with the same settings."
        )
    if even.saturated > _SATURATED_WARNING_FRACTION:
        raise InputError(f"flat field {flat} is saturated ({even.saturated:.1%} of its pixels): expose it less.")
    smooth = _smooth(even.luminance)
    if smooth.min() < _MIN_FLAT_BRIGHTNESS * smooth.max():
        raise InputError(
            f"flat field {flat} is dark in places ({smooth.min() / smooth.max():.1%} of its brightest): photograph a "
            "blank surface that fills the frame, evenly lit."
        )
    result = luminance * (smooth.mean() / smooth)
    if np.issubdtype(pixels.dtype, np.integer):
        top = pixels == np.iinfo(pixels.dtype).max
        top = top.all(axis=2) if top.ndim == 3 else top
        result[top] = result.max()
    return result


def _smooth(flat: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the flat field's fall-off, a polynomial of degree 6 along both axes, without noise and texture."""

    def powers(count: int) -> FloatArray:
        return np.asarray(np.polynomial.chebyshev.chebvander((2 * np.arange(count) + 1) / count - 1, 6), float)

    small = cv2.resize(flat, tuple(min(n, 128) for n in flat.shape[::-1]), interpolation=cv2.INTER_AREA)
    down, across = (np.linalg.pinv(powers(n)) for n in small.shape)
    smooth = powers(flat.shape[0]) @ (down @ small @ across.T) @ powers(flat.shape[1]).T
    return smooth.astype(np.float32)


def _decode(path: Path, data: bytes) -> NDArray[Any]:
    """Return an image file's pixels, H x W grey or H x W x 3 RGB, in upright orientation."""
    try:
        with _quiet():
            if data.startswith(_JPEG):
                # Unlike OpenCV, Pillow never writes to standard error and always rejects a truncated JPEG.
                return _read_jpeg(data)
            if not data.startswith((_PNG, *_TIFF)):  # otherwise OpenCV would try its other decoders
                raise _not_an_image(path)
            if data.startswith(_PNG):
                with Image.open(io.BytesIO(data), formats=FORMATS) as image:
                    image.verify()  # the decoder below writes to standard error for a damaged PNG
            pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
    except MemoryError:
        raise
    except Image.DecompressionBombError as error:
        raise _too_large(path) from error
    except Exception as error:  # decoders raise various exceptions for invalid files
        if isinstance(error, cv2.error) and error.code == cv2.Error.StsNoMem:
            raise MemoryError from error
        raise _not_an_image(path) from error
    if pixels is None or pixels.shape[2:] not in ((), (3,)):
        raise _not_an_image(path)
    if data.startswith(_TIFF):
        pixels = _checked_layout(path, data, pixels)
    return pixels[..., ::-1] if pixels.ndim == 3 else pixels


def _checked_layout(path: Path, data: bytes, pixels: NDArray[Any]) -> NDArray[Any]:
    """Return a TIFF file's decoded pixels, black at 0; raise `InputError` for layouts that OpenCV decodes wrongly."""
    tags = Image.Exif()
    with suppress(Exception):  # as for files of more than 4 GB
        tags.load(b"Exif\0\0" + data)
    bits = int(np.max(tags.get(ExifTags.Base.BitsPerSample, 8)))
    planes = tags.get(ExifTags.Base.PlanarConfiguration) == 2 and pixels.ndim == 3
    if bits > 8 and (planes or pixels.dtype == np.uint8):
        raise InputError(
            f"{printable(path)} has {bits} bits per channel in separate planes or with a grey channel's alpha, which "
            "cannot be read: save it with interleaved channels and without alpha."
        )
    is_inverted = tags.get(ExifTags.Base.PhotometricInterpretation) == 0 and pixels.dtype == np.uint16
    return np.iinfo(np.uint16).max - pixels if is_inverted else pixels


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress the decoders' messages and warnings."""
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _read_jpeg(data: bytes) -> NDArray[np.uint8]:
    with Image.open(io.BytesIO(data), formats=FORMATS) as image:
        upright = ImageOps.exif_transpose(image)
        return np.asarray(upright if upright.mode == "L" else upright.convert("RGB"))


def _warn_of_low_quality(path: Path) -> None:
    """Warn of JPEG compression that is too strong for depth; `path` is a readable image."""
    if is_raw(path):
        return
    tables: dict[int, list[int]] = of_header(path, lambda image: getattr(image, "quantization", {}), {})
    step = float(np.mean(tables[0])) / _STEP_OF_QUALITY_50 if 0 in tables else 0.0
    quality = 100 - 50 * step if step <= 1 else 50 / step
    if quality < _MIN_JPEG_QUALITY:
        warn(
            f"{printable(path)} is a JPEG of about quality {quality:.0f}: compression removed fine detail that depth "
            "depends on, and the stated uncertainty includes this from quality 90 only: use camera raw files, or "
            "quality 95."
        )


def _opaque(path: Path, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return H x W, False where an image file is transparent, as outside of a cut-out object; warn if it is."""
    alpha = None if is_raw(path) else of_header(path, _alpha, None)
    # Some programs leave the whole channel at 0.
    opaque = np.ones(shape, np.bool_) if alpha is None else (alpha > 0) | (alpha.max() == 0)
    if (hidden := 1 - opaque.mean()) > _MAX_INVALID_FRACTION:
        raise InputError(
            f"{printable(path)} is transparent over {hidden:.0%} of its pixels, but may be over half: crop it."
        )
    if hidden:
        warn(f"{printable(path)}: {hidden:.1%} of the pixels are transparent and are excluded.")
    return opaque


def _alpha(image: Image.Image) -> NDArray[np.uint8] | None:
    if not image.has_transparency_data:
        return None
    return np.asarray(ImageOps.exif_transpose(image).convert("RGBA").getchannel("A"))


def _read_array(path: Path) -> NDArray[Any]:
    try:
        pixels = read_array(path, _ARRAY)
    except InputError as error:
        if _ARRAY in str(error) and "damaged" in str(error):
            raise _not_an_image(path, "an array that numpy.save wrote") from error
        raise
    if 0 in pixels.shape or pixels.shape[2:] not in ((), (3,)) or pixels.ndim < 2:
        raise InputError(f"{path}: its shape is {pixels.shape}, but must be H x W or H x W x 3 (red, green, blue).")
    return pixels.astype(pixels.dtype.newbyteorder("="), copy=False)


def read_image_bytes(path: Path) -> bytes:
    """Return the content of a non-empty image file in bytes."""
    data = read_bytes(path, "an image file")
    if not data:
        raise InputError(f"{printable(path)} is empty: give an image file.")
    return data


def _size(path: Path) -> int | None:
    """Return the number of pixels given in an image file's header; None if it does not give it."""
    array = path.suffix.lower() == ".npy"
    if array or is_raw(path):
        with opened(path, "an image file") as file:
            return os.fstat(file.fileno()).st_size // (8 if array else 2)
    try:
        with opened(path, "an image file") as file, _quiet(), Image.open(file, formats=FORMATS) as image:
            return int(image.width * image.height)
    except InputError:
        raise
    except Image.DecompressionBombError as error:
        raise _too_large(path) from error
    except Exception:  # not readable by Pillow, or damaged: reported by the decoder
        return None


def _too_large(path: Path) -> InputError:
    most = 2 * (Image.MAX_IMAGE_PIXELS or 0) / 1e6
    return InputError(f"{printable(path)} has more than {most:.0f} million pixels: reduce or crop it.")


def _not_an_image(path: Path, expected: str = "an intact PNG, TIFF, JPEG or .npy file") -> InputError:
    return InputError(f"{printable(path)} cannot be read as an image: expected {expected}.")


def _valid_pixels(path: Path, pixels: NDArray[Any]) -> tuple[NDArray[np.bool_], float]:
    """Return where pixels are valid, and the fraction of saturated pixels.

    A pixel is valid if every channel is finite and below the maximum of an integer type.

    Raises
    ------
    InputError
        If the pixels cannot show blur.
    """
    if pixels.dtype not in (np.uint8, np.uint16) and not np.issubdtype(pixels.dtype, np.floating):
        raise InputError(
            f"{path} contains pixels of type {pixels.dtype}, but must contain 8- or 16-bit unsigned integers or "
            "floating-point numbers: convert it first."
        )
    integer = np.issubdtype(pixels.dtype, np.integer)
    top = _ceiling(pixels) if integer else 0
    usable = pixels < top if integer else np.isfinite(pixels)
    mask = np.asarray(usable.all(axis=2) if usable.ndim == 3 else usable, np.bool_)
    bad = 1 - float(mask.mean())
    if bad > _MAX_INVALID_FRACTION:
        trouble = (
            f"is saturated: {bad:.0%} of its pixels lie at the maximum, {top}, where at most half may: expose it less."
            if integer
            else f"contains {np.sum(~mask)} pixels that are NaN or infinite ({bad:.0%}), but at most half may be: "
            "crop it."
        )
        raise InputError(f"{path} {trouble}")
    good = pixels[mask]
    darkest, brightest = float(good.min()), float(pixels.max() if integer else good.max())
    if brightest <= max(2.0, 1e-3 * top) * integer:
        raise InputError(f"{path} is black: its brightest value is {brightest:g}: expose it more.")
    if not integer and (max(brightest, -darkest) > _MAX_VALUE or brightest < 1 / _MAX_VALUE):
        raise InputError(
            f"{path} contains values from {darkest:g} to {brightest:g}, but the brightest must lie between "
            f"{1 / _MAX_VALUE:g} and {_MAX_VALUE:g}: multiply all images by the same constant."
        )
    if darkest == brightest:
        raise InputError(f"{path} is uniform ({brightest:g}), so it shows no blur: give one with texture.")
    if integer and bad > _SATURATED_WARNING_FRACTION:
        warn(f"{path}: {bad:.1%} of the pixels are saturated; depth on and around them is unreliable.")
    elif not integer and bad:
        count = int(np.sum(~mask))
        pixels_are, are = ("1 pixel is", "is") if count == 1 else (f"{count} pixels are", "are")
        warn(f"{path}: {pixels_are} NaN or infinite and {are} excluded.")
    return mask, bad if integer else 0.0


def _ceiling(pixels: NDArray[Any]) -> int:
    """Return the value from which integer pixels are saturated: their type's maximum, or a lower one in 16 bits.

    Sensors of 10 to 15 bits saturate below it. There far more pixels share the highest value than any of those below.

    >>> ramp = np.minimum(np.arange(8000), 4095).astype(np.uint16)
    >>> _ceiling(ramp), _ceiling(np.arange(8000).astype(np.uint16))
    (4095, 65535)
    """
    most = int(np.iinfo(pixels.dtype).max)
    if pixels.dtype != np.uint16 or (top := int(pixels.max())) == most:
        return most
    count = np.bincount(pixels.ravel(), minlength=most + 1)
    below = count[:top][count[:top] > 0][-_VALUES_BELOW:]
    is_shared = count[top] > _PILED_UP * max(_LEAST_SATURATED * pixels.size, below.max(initial=0))
    return top if is_shared and count[top] <= _MAX_INVALID_FRACTION * pixels.size else most


def filled(pixels: NDArray[Any], mask: NDArray[np.bool_]) -> NDArray[Any]:
    """Return `pixels` with each pixel outside the mask replaced by the nearest one inside."""
    row, column = distance_transform_edt(~mask, return_distances=False, return_indices=True)
    return pixels[row, column]


def decoded(pixels: NDArray[Any], encoding: Encoding) -> NDArray[np.float32]:
    """Return the linear radiance of a file's pixels, any shape; 1 is the maximum of an integer type."""
    linear = srgb_to_linear if encoding == "srgb" else np.asarray
    if np.issubdtype(pixels.dtype, np.integer):
        # Decode the 256 or 65536 levels once, then use them as a lookup table.
        return linear(np.linspace(0, 1, np.iinfo(pixels.dtype).max + 1)).astype(np.float32)[pixels]
    return linear(pixels).astype(np.float32)


def _luminance(pixels: NDArray[Any], encoding: Encoding) -> NDArray[np.float32]:
    if pixels.ndim == 2:
        return decoded(pixels, encoding)
    luminance = np.zeros(pixels.shape[:2], np.float32)
    for weight, channel in zip(LUMINANCE, np.moveaxis(pixels, 2, 0), strict=True):
        luminance += np.float32(weight) * decoded(channel, encoding)
    return luminance
