"""Reading of video files frame by frame; undecodable frames are reported as `Skipped`, never dropped silently.

Frames are numbered from 0 by the file's clock.
"""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, Self, TypeVar

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.files import opened, printable
from focalgradient.srgb import srgb_to_linear
from focalgradient.view import LUMINANCE

__all__ = [
    "Frame",
    "Grey",
    "Skipped",
    "Source",
    "ahead",
    "check_frames",
    "check_name",
    "luminance",
    "quiet",
    "radiance_levels",
    "read_movie",
]

Grey = NDArray[np.uint8]

CONTAINERS = "mov,mp4,matroska,webm,avi,mpegts,mpeg,asf,flv,ogg,mxf,dv,nut,m4v,h264,hevc,yuv4mpegpipe"
"""Demuxers that FFmpeg may use: single-video files. Others are excluded, as playlists can open further files."""

FFMPEG_OPTIONS = "OPENCV_FFMPEG_CAPTURE_OPTIONS"
"""Environment variable with which OpenCV passes options to FFmpeg (key;value|key;value)."""

MAX_VIDEO_BYTES = 2**60
"""Maximum size of a video in bytes: practically unlimited, as it is read frame by frame."""

GREY_8, GREY_16 = int.from_bytes(b"Y800", "little"), int.from_bytes(b"Y1\x00\x10", "little")
"""FFmpeg's codes of grey pixel formats with 8 and with 16 bits."""

RADIANCE_LEVELS = 1 << 14
"""Number of radiance levels in which luminance is summed."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A frame as stored: luma, H x W, uint8, with its number from 0."""

    number: int
    image: Grey


@dataclass(frozen=True, slots=True)
class Skipped:
    """A range of frames without depth, and the reason."""

    first: int
    last: int
    reason: str

    def __str__(self) -> str:
        """Return the frames and the reason, as a clause.

        >>> str(Skipped(4, 5, "could not be decoded"))
        'frames 4 to 5 could not be decoded'
        """
        frames = f"frame {self.first}" if self.first == self.last else f"frames {self.first} to {self.last}"
        return f"{frames} {self.reason}"


class Source:
    """A video file, read frame by frame.

    Parameters
    ----------
    path
        A file with one video in one of the `CONTAINERS`, such as MP4, MOV, Matroska, AVI, WebM or MPEG.
    grey
        Function that converts blue, green and red (H x W x 3, uint8) to one stored value; by default luma, their
        weighted mean as stored.

    Raises
    ------
    InputError
        If the file cannot be opened as a video.
    """

    def __init__(self, path: Path, grey: Callable[[Grey], Grey] | None = None) -> None:
        self.path = path
        self._grey = grey or _luma
        check_name(path)
        with opened(path, "a video", MAX_VIDEO_BYTES):
            pass
        with quiet():
            self._capture = _opened(path)
        if not self._capture.isOpened():
            raise InputError(f"{printable(path)} cannot be read as a video: give a file that FFmpeg can decode.")
        fps = float(self._capture.get(cv2.CAP_PROP_FPS))
        self.fps = fps if math.isfinite(fps) and fps > 0 else 30.0
        # Estimate from the file's header; 0 if missing.
        self.declared = max(0, int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT)))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._capture.release()

    def frames(self) -> Iterator[Frame | Skipped]:
        """Yield every decodable frame in order, and `Skipped` ranges between them."""
        for number, image in self._decoded():
            yield image if isinstance(image, Skipped) else Frame(number, self._grey(np.asarray(image, np.uint8)))

    def stored(self) -> Iterator[NDArray[Any]]:
        """Yield every frame as stored: grey, H x W, uint8 or uint16, or red, green, blue, H x W x 3, uint8.

        Raises
        ------
        InputError
            At the first undecodable frame.
        """
        depth = int(self._capture.get(cv2.CAP_PROP_CODEC_PIXEL_FORMAT))
        if depth == GREY_16:
            with quiet():
                self._capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
        for _, image in self._decoded():
            if isinstance(image, Skipped):
                raise InputError(f"frame {image.first} of {printable(self.path)} {image.reason}: give an intact file.")
            if depth in (GREY_8, GREY_16):
                yield image if image.ndim == 2 else image[..., 0].copy()
            else:
                yield image[..., ::-1].copy()

    def _decoded(self) -> Iterator[tuple[int, NDArray[Any] | Skipped]]:
        """Yield number and image as decoded by OpenCV, or `Skipped` for undecodable ranges."""
        number, size = -1, None
        while True:
            decoded, image = self._capture.read()
            if not decoded:
                break
            # The clock reveals frames that the decoder skipped, in formats that store one.
            clock = round(float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) * self.fps / 1000)
            missing = max(0, clock - number - 1)
            if missing:
                yield number, Skipped(number + 1, number + missing, "could not be decoded")
            number += 1 + missing
            size = size or image.shape[:2]
            if image.shape[:2] != size:
                was, is_now = (f"{width} x {height}" for height, width in (size, image.shape[:2]))
                yield number, Skipped(number, number, f"is {is_now} pixels where the first was {was}")
                continue
            yield number, image
        if number + 1 < self.declared:
            lost = Skipped(number + 1, self.declared - 1, "could not be decoded, according to the file's frame count")
            yield number, lost


def read_movie(path: str | os.PathLike[str]) -> Iterator[NDArray[Any]]:
    """Yield the frames of a movie one at a time: exact, if `save_movie` wrote it losslessly.

    Parameters
    ----------
    path
        A file with one video.

    Yields
    ------
    ndarray
        A frame: grey, H x W, uint8 or uint16, or red, green and blue, H x W x 3, uint8, as stored.

    Raises
    ------
    InputError
        If the file cannot be opened as a video, or at the first undecodable frame.
    """
    with Source(Path(path)) as source:
        yield from source.stored()


def _luma(colours: Grey) -> Grey:
    return np.asarray(cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY), np.uint8)


def radiance_levels(encoding: Literal["srgb", "linear"]) -> NDArray[np.float32]:
    """Return the linear radiance, 0 to 1, of the 256 values that a video stores in this encoding.

    >>> [round(float(radiance_levels(encoding)[128]), 3) for encoding in ("linear", "srgb")]
    [0.502, 0.216]
    """
    shares = np.linspace(0, 1, 256, dtype=np.float32)
    return shares if encoding == "linear" else srgb_to_linear(np.arange(256) / 255).astype(np.float32)


def luminance(levels: NDArray[np.float32]) -> Callable[[Grey], Grey]:
    """Return a function that converts blue, green, red (H x W x 3) to the stored value nearest to their luminance.

    Linear radiance is weighted (as in Rec. 709) instead of stored values, which are decoded by `levels`, the linear
    radiance of the 256 values. Pixels with a saturated colour get the maximum value, as their luminance is unknown.

    >>> pixels = np.array([[[100, 100, 100], [0, 0, 200], [3, 255, 7]]], np.uint8)
    >>> luminance(np.linspace(0, 1, 256, dtype=np.float32) ** 2)(pixels).tolist()
    [[100, 92, 255]]
    """
    shares = (levels - levels[0]) / (levels[-1] - levels[0])
    scaled = np.rint(RADIANCE_LEVELS * np.outer(LUMINANCE[::-1], shares)).astype(np.int32)
    nearest = np.searchsorted((shares[1:] + shares[:-1]) / 2, np.arange(RADIANCE_LEVELS + 3) / RADIANCE_LEVELS).astype(
        np.uint8
    )

    def of(colours: Grey) -> Grey:
        stored = np.empty(colours.shape[:2], np.uint8)
        _luminance_rows(colours, scaled, nearest, stored)
        return stored

    return of


@njit(nogil=True, cache=True)
def _luminance_rows(colours, scaled, nearest, stored):  # type: ignore[no-untyped-def]
    for row in range(stored.shape[0]):
        for x in range(stored.shape[1]):
            blue, green, red = colours[row, x, 0], colours[row, x, 1], colours[row, x, 2]
            light = nearest[scaled[0, blue] + scaled[1, green] + scaled[2, red]]
            stored[row, x] = 255 if max(blue, green, red) == 255 else light


Item = TypeVar("Item")


def ahead(items: Iterable[Item], most: int = 3) -> Generator[Item, None, None]:
    """Yield `items`, computed in a separate thread, up to `most` ahead of their use.

    >>> list(ahead(range(5)))
    [0, 1, 2, 3, 4]
    """
    end: Final = object()
    iterator = iter(items)
    with ThreadPoolExecutor(1, thread_name_prefix="ahead") as pool:
        coming = deque(pool.submit(next, iterator, end) for _ in range(most))
        try:
            while (item := coming.popleft().result()) is not end:
                coming.append(pool.submit(next, iterator, end))
                yield item  # type: ignore[misc]
        finally:
            for one in coming:
                one.cancel()


def check_frames(path: Path, frames: int) -> None:
    """Raise `InputError` if a video lacks written frames (as on a full disk), which OpenCV does not report."""
    video = _opened(path)
    found = sum(1 for _ in takewhile(bool, (video.grab() for _ in range(frames))))
    video.release()
    if found < frames:
        raise InputError(f"{found} of {frames} frames of {printable(path.name)} could be written: free disk space.")


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress OpenCV's messages on standard error."""
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)


def _opened(path: Path) -> cv2.VideoCapture:
    """Open a video, restricted to the demuxers of `CONTAINERS`."""
    before = os.environ.get(FFMPEG_OPTIONS)
    os.environ[FFMPEG_OPTIONS] = f"protocol_whitelist;file|format_whitelist;{CONTAINERS}"
    try:
        return cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    finally:
        if before is None:
            del os.environ[FFMPEG_OPTIONS]
        else:
            os.environ[FFMPEG_OPTIONS] = before


def check_name(path: Path) -> None:
    """Raise `InputError` for a file name that OpenCV cannot handle."""
    try:
        if "\0" not in str(path).encode().decode():
            return
    except UnicodeEncodeError:
        pass
    raise InputError(f"{printable(path)} has a name that is not UTF-8, which video files need: rename it.")
