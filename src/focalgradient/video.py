"""Video whose frames alternate between two apertures: reading pairs of views, and writing depth as video.

Frames are numbered from 0 as the file's clock counts them: even frames show one aperture, odd frames the other. Each
two successive frames make a pair, so that n frames give n - 1 maps of depth; two frames are held at a time. What
cannot be used is passed on as `Skipped`, never dropped silently.
"""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice, takewhile
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.files import opened, printable
from focalgradient.view import LUMINANCE

# What FFmpeg finds wrong with a file is reported as skipped frames, not on standard error; it reads this once.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

import cv2

__all__ = [
    "Frame",
    "Pair",
    "Scale",
    "Skipped",
    "Source",
    "ValuesFile",
    "VideoFile",
    "ahead",
    "alternation",
    "check_frames",
    "luminance",
    "pairs",
    "write_frames",
]

Grey = NDArray[np.uint8]

CODECS = {".mp4": "mp4v", ".mov": "mp4v", ".mkv": "mp4v", ".avi": "MJPG", ".webm": "VP80"}
"""How each kind of file is encoded: what OpenCV's own FFmpeg writes everywhere and common players show."""

CONTAINERS = "mov,mp4,matroska,webm,avi,mpegts,mpeg,asf,flv,ogg,mxf,dv,nut,m4v,h264,hevc,yuv4mpegpipe"
"""Demuxers that FFmpeg may use: files of one video. Its others include lists, which open other files."""

FFMPEG_OPTIONS = "OPENCV_FFMPEG_CAPTURE_OPTIONS"
"""Environment variable from which OpenCV takes FFmpeg's options, as key;value|key;value."""

LARGEST_VIDEO = 2**60
"""Bytes of a video: any number, as it is read frame by frame."""

PLAIN = 0.1
"""Change of the logarithm of detail from frame to frame below which the two apertures cannot be distinguished."""

LIGHTS = 1 << 14
"""Steps of light in which luminance is summed."""

BLACK = 40
"""Colours of the map left out at its dark end, so that none looks like the black of no estimate."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A frame as stored: luma, H x W, uint8, with its number from 0."""

    number: int
    image: Grey


@dataclass(frozen=True, slots=True)
class Skipped:
    """Frames, first to last, that gave no depth, and why."""

    first: int
    last: int
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Two successive frames: the one through the aperture of even frames, and the one through that of odd frames.

    `number` is the later one's.
    """

    number: int
    even: Grey
    odd: Grey


class Source:
    """A video file, read frame by frame.

    Parameters
    ----------
    path
        A file of one video in one of the `CONTAINERS`, as MP4, MOV, Matroska, AVI, WebM or MPEG.
    grey
        Makes one stored value of a pixel's blue, green and red (H x W x 3, uint8): by default luma, their weighted mean
        as stored.

    Raises
    ------
    InputError
        If the file cannot be opened as a video.
    """

    def __init__(self, path: Path, grey: Callable[[Grey], Grey] | None = None) -> None:
        self.path = path
        self._grey = grey or _luma
        _check_name(path)
        with opened(path, "a video", LARGEST_VIDEO):
            pass
        before = cv2.utils.logging.getLogLevel()
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
        try:
            self._capture = _opened(path)
        finally:
            cv2.utils.logging.setLogLevel(before)
        if not self._capture.isOpened():
            raise InputError(f"{printable(path)} cannot be read as a video: give a file that FFmpeg can decode.")
        fps = float(self._capture.get(cv2.CAP_PROP_FPS))
        self.fps = fps if math.isfinite(fps) and fps > 0 else 30.0
        # An estimate from the file's header; 0 where it has none.
        self.declared = max(0, int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT)))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._capture.release()

    def frames(self) -> Iterator[Frame | Skipped]:
        """Every frame that can be decoded, in order, and what lies between where some cannot."""
        number, size = -1, None
        while True:
            decoded, image = self._capture.read()
            if not decoded:
                break
            # The clock jumps over frames that the decoder passed over; not every kind of file keeps one.
            clock = round(float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) * self.fps / 1000)
            missing = max(0, clock - number - 1)
            if missing:
                yield Skipped(number + 1, number + missing, "could not be decoded")
            number += 1 + missing
            size = size or image.shape[:2]
            if image.shape[:2] != size:
                was, is_now = (f"{width} x {height}" for height, width in (size, image.shape[:2]))
                yield Skipped(number, number, f"is {is_now} pixels where the first was {was}")
                continue
            yield Frame(number, self._grey(np.asarray(image, np.uint8)))
        if number + 1 < self.declared:
            yield Skipped(number + 1, self.declared - 1, "could not be decoded, by the file's own count")


def _luma(colours: Grey) -> Grey:
    return np.asarray(cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY), np.uint8)


def luminance(levels: NDArray[np.float32]) -> Callable[[Grey], Grey]:
    """What makes the stored value nearest to their luminance of pixels stored as blue, green and red (H x W x 3).

    Light is weighted (as Rec. 709 does), not stored values: these are decoded by `levels`, the linear radiance of the
    256. A pixel with a colour at the top is given the top value, as its light is not known.

    >>> pixels = np.array([[[100, 100, 100], [0, 0, 200], [3, 255, 7]]], np.uint8)
    >>> luminance(np.linspace(0, 1, 256, dtype=np.float32) ** 2)(pixels).tolist()
    [[100, 92, 255]]
    """
    shares = (levels - levels[0]) / (levels[-1] - levels[0])
    scaled = np.rint(LIGHTS * np.outer(LUMINANCE[::-1], shares)).astype(np.int32)
    nearest = np.searchsorted((shares[1:] + shares[:-1]) / 2, np.arange(LIGHTS + 3) / LIGHTS).astype(np.uint8)

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
    """`items`, worked out in a thread of their own, up to `most` before they are asked for.

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


def alternation(frames: Iterable[Frame | Skipped], detail: Callable[[Grey], float], most: int = 24) -> float:
    """Logarithm of the detail of even over that of odd frames: the median over the first `most` successive frames.

    `detail` measures a frame's high-frequency content. Positive: even frames are the sharper, by this much.

    >>> import itertools
    >>> frames = (Frame(n, np.full((1, 1), 20 if n % 2 else 40, np.uint8)) for n in itertools.count())
    >>> round(alternation(frames, lambda image: float(image.mean())), 3)
    0.693
    """
    steps = []
    before: tuple[int, float] | None = None
    for item in islice(frames, most):
        if isinstance(item, Frame):
            level = math.log(max(detail(item.image), 1e-12))
            if before is not None and item.number == before[0] + 1:
                steps.append((level - before[1]) * (1 if item.number % 2 == 0 else -1))
            before = item.number, level
    if not steps:
        raise InputError("the video has no two successive frames that can be decoded: give one with more frames.")
    return float(np.median(steps))


def pairs(frames: Iterable[Frame | Skipped], detail: Callable[[Grey], float], step: float) -> Iterator[Pair | Skipped]:
    """Each two successive frames of either aperture; what breaks the alternation is reported, and pairing goes on.

    Parameters
    ----------
    frames
        As `Source.frames` gives them.
    detail
        Measures a frame's high-frequency content.
    step
        What `alternation` found. Two successive frames whose detail differs by less than half of it show one aperture:
        a frame between them was lost without trace. Where it changes the wrong way round, one was lost before. Below
        10 % neither can be detected, and frames are taken as they come.

    Yields
    ------
    Pair or Skipped
        In the frames' order. A frame without a partner, before or after it, is reported too.
    """
    # Parity of the frames' numbers, once those lost without trace are counted too.
    lost = 0
    before: Frame | None = None
    before_level = 0.0
    paired = True
    for item in frames:
        if isinstance(item, Skipped):
            if before is not None and not paired:
                yield Skipped(before.number, before.number, _ALONE)
            before, paired = None, True
            yield item
            continue
        level = math.log(max(detail(item.image), 1e-12))
        if before is None:
            before, before_level, paired = item, level, False
            continue
        change = (level - before_level) * (1 if (item.number + lost) % 2 == 0 else -1)
        wrong = None
        if abs(step) > PLAIN and abs(change) < abs(step) / 2:
            wrong = "show one aperture, so that a frame between them was lost"
        elif abs(step) > PLAIN and change * step < 0:
            wrong = "alternate the wrong way round, as after a loss or a cut"
        if wrong is not None:
            if not paired:
                yield Skipped(before.number, before.number, _ALONE)
            yield Skipped(before.number, item.number, wrong)
            lost += 1
            paired = False
        else:
            step += 0.1 * (float(np.clip(change, -2 * abs(step), 2 * abs(step))) - step)
            even, odd = (item, before) if (item.number + lost) % 2 == 0 else (before, item)
            yield Pair(item.number, even.image, odd.image)
            paired = True
        before, before_level = item, level
    if before is not None and not paired:
        yield Skipped(before.number, before.number, _ALONE)


_ALONE = "has no neighbour through the other aperture"


@dataclass(frozen=True, slots=True)
class Scale:
    """How values become colours: linear from `dark` to `bright`, with `ticks` of (value, label) and a `title`."""

    dark: float
    bright: float
    ticks: tuple[tuple[float, str], ...]
    title: str

    @classmethod
    def of_distance(cls, far: float, near: float) -> Scale:
        """Linear in vergence, between `far` and `near` in dioptres: near is bright; labels are in metres.

        >>> [label for _, label in Scale.of_distance(0.5, 1.0).ticks]
        ['2', '1.6', '1.33', '1.14', '1']
        """
        values = np.linspace(far, near, 5)
        labels = ["inf" if value <= 0 else f"{1 / value:.3g}" for value in values]
        return cls(far, near, tuple(zip(values.tolist(), labels, strict=True)), "distance, m")

    @classmethod
    def of_disparity(cls) -> Scale:
        """Focal disparity from 0 (dark: blurred) to 1 (bright: in focus)."""
        return cls(0.0, 1.0, tuple((value / 4, f"{value / 4:.2f}") for value in range(5)), "focal disparity")


class VideoFile:
    """Maps on the grid of 4 x 4 pixels, written as colour video; black where there is no value.

    Parameters
    ----------
    path
        Where to write; the name's ending chooses the kind of file.
    fps
        Frames a second.
    shape
        Height and width of the grid; a value fills 4 x 4 pixels.
    scale
        How values become colours. It is drawn to the right of every frame.

    Raises
    ------
    InputError
        If the name's ending is none that can be written, or the encoder refuses.
    """

    def __init__(self, path: Path, fps: float, shape: tuple[int, int], scale: Scale) -> None:
        check_ending(path)
        colours = cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_VIRIDIS)[:, 0]
        places = np.rint(np.linspace(BLACK, 255, 255)).astype(int)
        self._colours = np.concatenate([np.zeros((1, 3), np.uint8), colours[places]])
        self._scale = scale
        height, width = (4 * n for n in shape)
        panel = _panel(height + height % 2, scale, self._colours)
        self._picture = np.zeros((panel.shape[0], width + panel.shape[1], 3), np.uint8)
        self._picture[:, width:] = panel
        self._part = self._picture[:height, :width]
        size = self._picture.shape[1], self._picture.shape[0]
        code = cv2.VideoWriter.fourcc(*CODECS[path.suffix.lower()])
        self._path, self._frames = path, 0
        self._writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, fps, size)
        if not self._writer.isOpened():
            raise InputError(
                f"a video of {size[0]} x {size[1]} pixels at {fps:g} frames a second cannot be written as "
                f"{path.suffix}: choose another ending, of {', '.join(CODECS)}."
            )

    def write(self, values: NDArray[np.floating], valid: NDArray[np.bool_]) -> None:
        """Add a frame: `values` on the grid, drawn where `valid`."""
        share = (values - self._scale.dark) / (self._scale.bright - self._scale.dark)
        place = np.where(valid, 1 + 254 * np.clip(share, 0, 1), 0).astype(np.uint8)
        colours = cv2.applyColorMap(place, self._colours[:, None])
        self._part[:] = cv2.resize(colours, self._part.shape[1::-1], interpolation=cv2.INTER_NEAREST)
        self._writer.write(self._picture)
        self._frames += 1

    def close(self) -> None:
        """Finish the file, and check it: see `check_frames`."""
        self._writer.release()
        check_frames(self._path, self._frames)


def write_frames(path: Path, frames: Sequence[Grey], fps: float) -> None:
    """Write frames, uint8, grey (H x W) or red, green and blue (H x W x 3), as a video at `fps` frames a second.

    Without loss (FFV1), but for names that end in .mp4, which common players show.

    Raises
    ------
    InputError
        If the encoder refuses, or frames were lost.
    """
    height, width = frames[0].shape[:2]
    code = cv2.VideoWriter.fourcc(*(CODECS[".mp4"] if path.suffix.lower() == ".mp4" else "FFV1"))
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, fps, (width, height))
    if not writer.isOpened():
        raise InputError(f"{printable(path)} cannot be written as a video: choose a name in .mkv, .avi or .mp4.")
    try:
        for frame in frames:
            writer.write(np.repeat(frame[..., None], 3, axis=2) if frame.ndim == 2 else frame[..., ::-1].copy())
    finally:
        writer.release()
    check_frames(path, len(frames))


def check_frames(path: Path, frames: int) -> None:
    """Refuse, as an InputError, a video that lacks frames it was given, as on a full disk: OpenCV says nothing."""
    video = _opened(path)
    found = sum(1 for _ in takewhile(bool, (video.grab() for _ in range(frames))))
    video.release()
    if found < frames:
        raise InputError(
            f"{found} of {frames} frames of {printable(path.name)} could be written: make room on the disk."
        )


def _opened(path: Path) -> cv2.VideoCapture:
    """Open a video by the demuxers of `CONTAINERS` alone."""
    before = os.environ.get(FFMPEG_OPTIONS)
    os.environ[FFMPEG_OPTIONS] = f"protocol_whitelist;file|format_whitelist;{CONTAINERS}"
    try:
        return cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    finally:
        if before is None:
            del os.environ[FFMPEG_OPTIONS]
        else:
            os.environ[FFMPEG_OPTIONS] = before


def check_ending(path: Path) -> None:
    """Refuse a name whose ending is no kind of video that can be written."""
    _check_name(path)
    if path.suffix.lower() not in CODECS:
        raise InputError(
            f"{printable(path)} has no ending of a video that can be written: use one of {', '.join(CODECS)}."
        )


def _check_name(path: Path) -> None:
    """Refuse a name that OpenCV cannot be given."""
    try:
        if "\0" not in str(path).encode().decode():
            return
    except UnicodeEncodeError:
        pass
    raise InputError(f"{printable(path)} has a name that is not UTF-8, which video files need: rename it.")


class ValuesFile:
    """Frames of numbers appended to a ``.npy`` file, whose header is set right when it is closed: float32, n x h x w.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = ValuesFile(Path(folder, "values.npy"), (2, 3))
    ...     file.write(np.ones((2, 3)))
    ...     file.close()
    ...     np.load(Path(folder, "values.npy")).shape
    (1, 2, 3)
    """

    def __init__(self, path: Path, shape: tuple[int, int]) -> None:
        self._file = path.open("wb")
        self._shape = shape
        self._frames = 0
        self._write_header()

    def _write_header(self) -> None:
        # NumPy pads headers so that the number of frames may grow in place.
        shape = (self._frames, *self._shape)
        header: dict[str, Any] = {"descr": "<f4", "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(self._file, header)  # type: ignore[no-untyped-call]

    def write(self, values: NDArray[np.floating]) -> None:
        """Append one frame, of the file's shape."""
        self._file.write(np.ascontiguousarray(values, "<f4").tobytes())
        self._frames += 1

    def close(self) -> None:
        """Set the number of frames, and finish the file."""
        self._file.seek(0)
        self._write_header()
        self._file.close()


def _panel(height: int, scale: Scale, colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The scale with its numbers, white on dark grey, as tall as the picture; without numbers where that is low."""
    size = float(np.clip(height / 720, 0.35, 1.5))
    thick = max(1, round(1.5 * size))
    font = cv2.FONT_HERSHEY_SIMPLEX
    title = scale.title.split(" ")  # a word a line, as the panel is narrow
    texts = [*title, *(label for _, label in scale.ticks)]
    wide = max(cv2.getTextSize(text, font, size, thick)[0][0] for text in texts)
    line = round(34 * size)
    bar, gap = round(28 * size), round(10 * size)
    width = bar + 3 * gap + wide
    width += width % 2
    panel = np.full((height, width, 3), 40, np.uint8)
    top, bottom = round((len(title) + 0.8) * line), height - line
    if bottom - top < line:  # no room for words
        panel[:, gap : gap + bar] = colours[np.linspace(255, 1, height).round().astype(int)][:, None]
        return panel
    for number, text in enumerate(title, 1):
        cv2.putText(panel, text, (gap, number * line), font, size, (255, 255, 255), thick, cv2.LINE_AA)
    panel[top:bottom, gap : gap + bar] = colours[np.linspace(255, 1, bottom - top).round().astype(int)][:, None]
    for value, label in scale.ticks:
        share = (value - scale.dark) / (scale.bright - scale.dark)
        y = round(top + (1 - share) * (bottom - top - 1))
        cv2.line(panel, (gap + bar, y), (gap + bar + gap // 2, y), (255, 255, 255), thick)
        place = gap + bar + gap, y + round(9 * size)
        cv2.putText(panel, label, place, font, size, (255, 255, 255), thick, cv2.LINE_AA)
    return panel
