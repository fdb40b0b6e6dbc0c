"""Camera raw files: linear sensor counts, before any sharpening or tone curve.

Only green pixels are used; the two of each 2 x 2 cell of the colour filter are averaged into one pixel. No values are
interpolated (demosaicing changes blur, and differently along and across edges), and a single colour avoids the lens's
chromatic aberration. A pixel is then two sensor pixels wide.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError, check_installed

if TYPE_CHECKING:
    import rawpy

__all__ = ["CELL", "is_raw", "read_dual_pixel_raw", "read_raw"]

CELL = 2
"""Sensor pixels per image pixel in each direction."""

_KINDS = (
    *("3fr", "arw", "cr2", "cr3", "crw", "dcr", "dng", "erf", "kdc", "mef", "mos", "mrw", "nef", "nrw", "orf"),
    *("pef", "raf", "raw", "rw2", "sr2", "srf", "srw"),
)
"""Extensions of camera raw files."""

_QUARTER_TURNS = {0: 0, 3: 2, 5: 1, 6: 3}
"""Number of anticlockwise quarter turns to upright orientation, by LibRaw's orientation code."""


def is_raw(path: Path) -> bool:
    """Return whether a file name has the extension of a camera raw file.

    >>> is_raw(Path("IMG_0001.CR2")), is_raw(Path("IMG_0001.JPG"))
    (True, False)
    """
    return path.suffix.lower().removeprefix(".") in _KINDS


def read_raw(path: Path, data: bytes) -> NDArray[np.uint16]:
    """Return green radiance per 2 x 2 cell of the sensor, H/2 x W/2, upright: 0 is black, 65535 saturated.

    A cell is saturated if either green pixel is.

    Parameters
    ----------
    path, data
        File name, for messages, and content in bytes.

    Raises
    ------
    InputError
        If rawpy is not installed, the file is damaged, or its sensor has no 2 x 2 cells with two green pixels.
    """
    return _developed(
        path,
        io.BytesIO(data),
        "cannot be read as a camera raw file ({}): give an intact one of a known camera, or develop it into a linear "
        "16-bit TIFF.",
    )


def read_dual_pixel_raw(path: Path) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """Return the two halves of a dual-pixel raw file (Canon's "DPRAW"), left and right, in the format of `read_raw`.

    The file contains the sum of both halves, and one half, which is assumed to be the left one; the right one is the
    difference. If it is the right one, near and far are exchanged: exchange the halves.

    Raises
    ------
    InputError
        As for `read_raw`, or if the file contains only one picture.
    """
    refusal = (
        "is not a dual-pixel raw file that can be read ({}): set the camera to store dual-pixel raw, or give the "
        "halves as two pictures."
    )
    both, one = (_developed(path, str(path), refusal, shot) for shot in (0, 1))
    if one.shape != both.shape or np.array_equal(one, both):
        raise InputError(f"{path} contains one picture only, without halves: set the camera to store dual-pixel raw.")
    top = np.iinfo(np.uint16).max
    other = 2.0 * both - one  # `both` is the mean of the halves, as each ranges from black (0) to white
    return one, np.where(both == top, top, np.clip(other, 0, top)).astype(np.uint16)


def _developed(path: Path, source: str | io.BytesIO, refusal: str, shot: int = 0) -> NDArray[np.uint16]:
    """Return the green radiance of one shot of a raw file; refuse it with the reason within the `refusal`."""
    check_installed(f"{path} is a camera raw file: it", "raw", "rawpy")
    import rawpy

    try:
        with rawpy.imread(source, shot_select=shot) as raw:
            return _green(path, raw)
    except (rawpy.LibRawError, rawpy.NotSupportedError) as error:
        raise InputError(f"{path} {refusal.format(str(error).strip('. '))}") from error


def _green(path: Path, raw: rawpy.RawPy) -> NDArray[np.uint16]:
    pattern = raw.raw_pattern
    names = raw.color_desc.decode("ascii", "replace")
    sites: list[tuple[int, int, int]] = []  # row, column and channel of the green pixels
    if raw.raw_type.name == "Flat" and pattern is not None and pattern.shape == (CELL, CELL):
        sites = [(row, column, int(c)) for (row, column), c in np.ndenumerate(pattern) if names[c] == "G"]
    if len(sites) != 2:
        raise InputError(
            f"{path} comes from a sensor without the usual 2 x 2 cells of one red, two green and one blue pixel: "
            "develop it into a linear 16-bit TIFF."
        )
    counts = raw.raw_image_visible
    height, width = (n // CELL for n in counts.shape)
    mean = np.zeros((height, width))
    saturated = np.zeros((height, width), np.bool_)
    for row, column, channel in sites:
        black = raw.black_level_per_channel[channel]
        # The camera's own linearity limit, if stated.
        linear = (raw.camera_white_level_per_channel or [0] * 4)[channel]
        white = min(level for level in (raw.white_level, linear) if level > black)
        site = counts[row::CELL, column::CELL][:height, :width]
        mean += (site - float(black)) / (white - black) / len(sites)
        saturated |= site >= white
    mean[saturated] = 1.0
    top = np.iinfo(np.uint16).max
    return np.rot90(np.rint(top * np.clip(mean, 0, 1)).astype(np.uint16), _QUARTER_TURNS.get(raw.sizes.flip, 0))
