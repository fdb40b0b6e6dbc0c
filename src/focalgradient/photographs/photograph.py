"""Content of one photograph."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from focalgradient.photographs.encodings import Encoding

__all__ = ["Photograph"]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Photograph:
    """Content of one image file.

    Parameters
    ----------
    path
        Path of the file.
    luminance
        Linear luminance, H x W, float32; integer files are scaled to a maximum (255, 65535) of 1.
    encoding
        ``"linear"`` or ``"srgb"``: encoding with which the values were decoded.
    pixel_type
        Pixel type of the file, such as ``"uint8"``.
    saturated
        Fraction of pixels with a channel at the maximum of an integer `pixel_type`, 0 to 1.
    binning
        Sensor pixels per pixel in each direction: 2 for a camera raw file, otherwise 1.
    mask
        H x W, True where a pixel is valid: it is opaque, no channel is at the maximum of an integer `pixel_type`, and
        all are finite. None if all are valid.
    assumed
        True if neither the caller nor the file states the encoding.
    """

    path: Path
    luminance: NDArray[np.float32]
    encoding: Encoding
    pixel_type: str
    saturated: float
    binning: int = 1
    mask: NDArray[np.bool_] | None = None
    assumed: bool = False

    def __repr__(self) -> str:
        """Return name, size and encoding, without the pixels."""
        height, width = self.luminance.shape
        return (
            f"Photograph({self.path.name}: {height} x {width} pixels, {self.pixel_type}, {self.encoding}, "
            f"{self.saturated:.1%} saturated)"
        )
