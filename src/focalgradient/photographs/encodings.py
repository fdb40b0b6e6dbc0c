"""Detection of the encoding stated in an image file: colour profile, PNG chunks or EXIF."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms

from focalgradient.errors import warn
from focalgradient.files import opened, printable
from focalgradient.srgb import linear_to_srgb

__all__ = ["Encoding", "of_header", "profile_name", "stated_encoding"]

Encoding = Literal["linear", "srgb"]
Read = TypeVar("Read")

MAX_CURVE_DIFFERENCE = 0.02
"""Maximum mean difference of two tone curves that count as equal, in sRGB values from 0 to 1: gamma 2.2 is within 0.01
of sRGB, gamma 1.8 differs by 0.05."""

FORMATS = ("PNG", "TIFF", "JPEG")
"""Formats that Pillow may open: the decoders of all others are excluded for safety."""

EXIF, COLOUR_SPACE, SRGB = 0x8769, 0xA001, 1


def stated_encoding(data: bytes, name: Any) -> Encoding | None:
    """Return the encoding that an image file states, or None if it states none.

    Parameters
    ----------
    data
        Content of a PNG, TIFF or JPEG file, in bytes.
    name
        File name, for the warning.

    Warns
    -----
    FocalGradientWarning
        If the stated tone curve is neither sRGB nor linear; the closer one is returned.

    Examples
    --------
    >>> from PIL.PngImagePlugin import PngInfo
    >>> word, file = PngInfo(), io.BytesIO()
    >>> word.add(b"gAMA", (100000).to_bytes(4))
    >>> Image.new("L", (2, 2)).save(file, "PNG", pnginfo=word)
    >>> stated_encoding(file.getvalue(), "view.png")
    'linear'
    """
    nothing: tuple[Any, ...] = (None,) * 4
    profile, gamma, said, exif = of_header(data, _statements, nothing)
    values = np.arange(256) / 255
    if profile and (curve := _curve(profile)) is not None:
        return _closest_encoding(curve, f"the colour profile {profile_name(profile)}", name)
    if said is not None or exif == SRGB:
        return "srgb"
    return _closest_encoding(linear_to_srgb(values ** (1 / gamma)), f"gamma {gamma:g}", name) if gamma else None


def _statements(image: Image.Image) -> tuple[Any, ...]:
    stated = (image.info.get(key) for key in ("icc_profile", "gamma", "srgb"))
    return *stated, image.getexif().get_ifd(EXIF).get(COLOUR_SPACE)


def of_header(source: bytes | Path, read: Callable[[Image.Image], Read], default: Read) -> Read:
    """Return what `read` finds in an image file; `default` if Pillow cannot read it (the decoder reports damage)."""
    try:
        with warnings.catch_warnings(), ExitStack() as open_files:
            warnings.simplefilter("ignore")
            file = io.BytesIO(source) if isinstance(source, bytes) else open_files.enter_context(opened(source))
            with Image.open(file, formats=FORMATS) as image:
                return read(image)
    except Exception:
        return default


def profile_name(profile: bytes) -> str:
    """Return the description of a colour profile."""
    try:
        return printable(ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(io.BytesIO(profile))).strip())
    except (ImageCms.PyCMSError, ImportError, OSError):
        return "of an unknown kind"


def _curve(profile: bytes) -> NDArray[np.floating] | None:
    """Return the sRGB values (0 to 1) of 256 grey levels under a colour profile; None if it cannot be read."""
    try:
        found = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        grey = Image.fromarray(np.arange(256, dtype=np.uint8)[None])
        if found.profile.xcolor_space.strip() != "GRAY":
            grey = Image.merge("RGB", [grey] * 3)
        shown = ImageCms.profileToProfile(grey, found, ImageCms.createProfile("sRGB"), outputMode="RGB")
    except (ImageCms.PyCMSError, ImportError, OSError, ValueError):
        return None
    return None if shown is None else np.asarray(shown)[0, :, 1] / 255


def _closest_encoding(curve: NDArray[np.floating], what: str, name: Any) -> Encoding:
    """Return the encoding closer to `curve` (256 sRGB values); warn if it matches neither."""
    values = np.arange(256) / 255
    known: dict[Encoding, float] = {
        "srgb": float(np.abs(curve - values).mean()),
        "linear": float(np.abs(curve - linear_to_srgb(values)).mean()),
    }
    encoding = min(known, key=lambda one: known[one])
    if known[encoding] > MAX_CURVE_DIFFERENCE:
        warn(
            f"{printable(name)} states {what}, whose tone curve is neither sRGB nor linear; it is treated as "
            f"{encoding}: convert it to one of them for exact results."
        )
    return encoding
