"""Writing of movies, lossless by default."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError, described
from focalgradient.files import printable, write_whole
from focalgradient.progress import Progress, silent
from focalgradient.quantities import Range
from focalgradient.video.reading import Grey, check_frames, check_name, quiet

__all__ = ["CODECS", "check_ending", "save_movie", "write_frames"]

CODECS = {".mp4": "mp4v", ".mov": "mp4v", ".mkv": "mp4v", ".avi": "MJPG", ".webm": "VP80"}
"""Codec of each file format: supported by OpenCV's FFmpeg on all platforms and by common players."""

ROUNDING_TOLERANCE = 1e-6
"""Tolerance for radiance outside 0 to 1 due to 32-bit rounding."""

LOSSLESS = (".mkv", ".avi", ".mov")
"""File formats that support FFV1, a lossless codec."""

MAX_RATE = 1e4
"""Maximum frame rate (Hz) in a file; displays reach some 500."""


def save_movie(
    frames: Iterable[NDArray[Any]],
    path: str | Path,
    *,
    rate: float,
    lossless: bool = True,
    display: Display | None = None,
    count: int | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write frames to a video file one at a time; the file appears under its name when complete.

    `read_movie` is the inverse.

    Parameters
    ----------
    frames
        Frames in order, from any iterable; one is held in memory at a time. Stored values: uint8 or, for grey, uint16,
        H x W, or uint8, H x W x 3 (red, green, blue). Or linear radiance as a fraction of the display's white, floats
        from 0 to 1, which are encoded for the `display`. All must have one shape and type, with even width and height.
    path
        Output path ending in .mkv, .avi or .mov; compressed also in .mp4 or .webm.
    rate
        Frames per second.
    lossless
        Whether pixels are stored exactly (FFV1); otherwise compressed for common players, with mean errors of 0.3 to
        1.6 8-bit steps, up to 15 at thin lines, and colour at half resolution.
    display
        Display for which radiance is encoded, by default with sRGB.
    count
        Number of frames, if known, for `progress`.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    InputError
        If there is no frame, a frame differs in type from the first, the extension does not fit, or the file cannot be
        written; no file of that name is then created.

    Examples
    --------
    >>> import tempfile
    >>> from focalgradient.video import read_movie
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = save_movie((np.full((4, 6), n, np.uint8) for n in range(3)), f"{folder}/ramp.mkv", rate=60)
    ...     [int(frame[0, 0]) for frame in read_movie(path)]
    [0, 1, 2]
    """
    path = Path(path)
    check_ending(path)
    Range("frames per second", most=MAX_RATE, positive=True).check("rate", rate)
    if lossless and path.suffix.lower() not in LOSSLESS:
        raise InputError(
            f"{printable(path)} ends in {path.suffix}, which is always compressed: choose one of "
            f"{', '.join(LOSSLESS)}, or set lossless=False."
        )
    say = progress or silent
    encode = (display or Display()).encode

    def write(hidden: Path) -> None:
        writer, first, number = None, None, 0
        try:
            for number, frame in enumerate(frames, 1):
                stored = _stored(frame, number - 1, encode)
                kind = stored.shape, stored.dtype
                if writer is None:
                    first = kind
                    writer = _writer(hidden, path.name, stored, rate, lossless)
                elif kind != first:
                    raise InputError(
                        f"frame {number - 1} is an array of shape {stored.shape}, {stored.dtype}, but the first was of "
                        f"{first[0]}, {first[1]}: give frames of one shape and type."  # type: ignore[index]
                    )
                if stored.ndim == 3:
                    stored = stored[..., ::-1]
                elif not lossless:
                    stored = np.repeat(stored[..., None], 3, axis=2)
                writer.write(np.ascontiguousarray(stored))
                say(min(number / count, 1.0) if count else 0.0, f"frame {number}")
        finally:
            if writer is not None:
                writer.release()
        if writer is None:
            raise InputError("frames is empty, but a movie needs at least one frame: give one.")
        check_frames(hidden, number)

    write_whole(path, write)
    say(1.0, "finished")
    return path


def _stored(frame: Any, number: int, encode: Callable[[NDArray[Any]], Grey]) -> NDArray[Any]:
    """Return the stored values of a frame; raise `InputError` unless it is a picture."""
    values = np.asarray(frame)
    if values.dtype.kind == "f":
        if (
            not np.isfinite(values).all()
            or values.min(initial=0) < -ROUNDING_TOLERANCE
            or values.max(initial=0) > 1 + ROUNDING_TOLERANCE
        ):
            raise InputError(
                f"frame {number} contains radiance outside 0 to 1 (fractions of the display's white): scale it, so "
                "that its brightest pixel is 1."
            )
        values = encode(values)
    picture = (values.ndim == 2 and values.dtype in (np.uint8, np.uint16)) or (
        values.ndim == 3 and values.shape[2] == 3 and values.dtype == np.uint8
    )
    if not picture or not values.size:
        raise InputError(
            f"frame {number} is {described(values)} of {values.dtype}, but must be H x W (uint8 or uint16), H x W x 3 "
            "(uint8), or radiance as floats from 0 to 1: convert it."
        )
    height, width = values.shape[:2]
    if height % 2 or width % 2:
        raise InputError(
            f"frame {number} has {width} x {height} pixels, but video needs even sides: add or cut a row or a column."
        )
    return values


def _writer(hidden: Path, name: str, first: NDArray[Any], rate: float, lossless: bool) -> cv2.VideoWriter:
    """Open the encoder for frames of the type of the first."""
    if first.dtype == np.uint16 and not lossless:
        raise InputError("frames have 16 bits, which only lossless files support: set lossless=True, or give 8 bits.")
    depth = cv2.CV_16U if first.dtype == np.uint16 else cv2.CV_8U
    colours = first.ndim == 3 or not lossless
    settings = [cv2.VIDEOWRITER_PROP_IS_COLOR, int(colours), cv2.VIDEOWRITER_PROP_DEPTH, depth]
    return encoder(hidden, name, "FFV1" if lossless else "", rate, first.shape[:2], settings)


def encoder(
    path: Path, name: str, codec: str, rate: float, shape: tuple[int, ...], settings: Sequence[int] = ()
) -> cv2.VideoWriter:
    """Return the encoder of a video; the file is called `name` in messages, and "" is the codec of its extension."""
    code = cv2.VideoWriter.fourcc(*(codec or CODECS[path.suffix.lower()]))
    with quiet():
        writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, rate, shape[::-1], settings)
    if not writer.isOpened():
        raise InputError(
            f"{printable(name)} cannot be written as a video of {shape[1]} x {shape[0]} pixels at {rate:g} frames per "
            "second: choose a name in .mkv, .avi or .mp4, or another rate."
        )
    return writer


def write_frames(path: Path, frames: Sequence[Grey], fps: float) -> None:
    """Write frames at `fps` frames per second by `save_movie`, lossless except for names that end in .mp4."""
    save_movie(frames, path, rate=fps, lossless=path.suffix.lower() != ".mp4")


def check_ending(path: Path) -> None:
    """Raise `InputError` unless a file name has a supported video extension."""
    check_name(path)
    if path.suffix.lower() not in CODECS:
        raise InputError(f"{printable(path)} has no supported video extension: use one of {', '.join(CODECS)}.")
