"""How an image file says that its values encode light: by a colour profile, a PNG's own word, or EXIF."""

from __future__ import annotations

import io
import warnings
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms

from focalgradient.errors import FocalGradientWarning
from focalgradient.files import printable
from focalgradient.srgb import linear_to_srgb

__all__ = ["Encoding", "profile_name", "stated_encoding"]

Encoding = Literal["linear", "srgb"]

CLOSE = 0.02
"""Mean difference of two tone curves, as sRGB values from 0 to 1, up to which they count as one: gamma 2.2 lies within
0.01 of sRGB, gamma 1.8 at 0.05."""

FORMATS = ("PNG", "TIFF", "JPEG")
"""Formats that Pillow may open: its others have decoders that nobody here needs, and that a file could reach."""

EXIF, COLOUR_SPACE, SRGB = 0x8769, 0xA001, 1


def stated_encoding(data: bytes, name: Any) -> Encoding | None:
    """What an image file says of how its values encode light; None where it says nothing.

    Parameters
    ----------
    data
        The bytes of a PNG, TIFF or JPEG file.
    name
        Its name, for the warning.

    Warns
    -----
    FocalGradientWarning
        If it states a tone curve that is neither: the nearer one is returned.

    Examples
    --------
    >>> from PIL.PngImagePlugin import PngInfo
    >>> word, file = PngInfo(), io.BytesIO()
    >>> word.add(b"gAMA", (100000).to_bytes(4))
    >>> Image.new("L", (2, 2)).save(file, "PNG", pnginfo=word)
    >>> stated_encoding(file.getvalue(), "view.png")
    'linear'
    """
    try:
        with Image.open(io.BytesIO(data), formats=FORMATS) as image:
            profile, gamma, said = (image.info.get(key) for key in ("icc_profile", "gamma", "srgb"))
            exif = image.getexif().get_ifd(EXIF).get(COLOUR_SPACE)
    except Exception:  # what is damaged, or no kind of image that says it, is for the decoder to judge
        return None
    values = np.arange(256) / 255
    if profile and (curve := _curve(profile)) is not None:
        return _nearer(curve, f"the colour profile {profile_name(profile)}", name)
    if said is not None or exif == SRGB:
        return "srgb"
    return _nearer(linear_to_srgb(values ** (1 / gamma)), f"gamma {gamma:g}", name) if gamma else None


def profile_name(profile: bytes) -> str:
    """The name of a colour profile."""
    try:
        return printable(ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(io.BytesIO(profile))).strip())
    except (ImageCms.PyCMSError, ImportError, OSError):
        return "of an unknown kind"


def _curve(profile: bytes) -> NDArray[np.floating] | None:
    """The sRGB values (0 to 1) of the greys of 256 values by a colour profile; None where it cannot be read."""
    try:
        found = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        grey = Image.fromarray(np.arange(256, dtype=np.uint8)[None])
        if found.profile.xcolor_space.strip() != "GRAY":
            grey = Image.merge("RGB", [grey] * 3)
        shown = ImageCms.profileToProfile(grey, found, ImageCms.createProfile("sRGB"), outputMode="RGB")
    except (ImageCms.PyCMSError, ImportError, OSError, ValueError):
        return None
    return None if shown is None else np.asarray(shown)[0, :, 1] / 255


def _nearer(curve: NDArray[np.floating], what: str, name: Any) -> Encoding:
    """Of the two encodings that which shows `curve` (256 sRGB values) best, with a warning if it is neither."""
    values = np.arange(256) / 255
    known: dict[Encoding, float] = {
        "srgb": float(np.abs(curve - values).mean()),
        "linear": float(np.abs(curve - linear_to_srgb(values)).mean()),
    }
    encoding = min(known, key=lambda one: known[one])
    if known[encoding] > CLOSE:
        warnings.warn(
            f"{printable(name)} states {what}, whose tone curve is neither sRGB nor linear; it is read as {encoding}: "
            "convert it to one of them if depth or light is to be exact.",
            FocalGradientWarning,
            stacklevel=2,
        )
    return encoding
