"""Depth of a live or recorded stream whose frames alternate between two apertures at one focus.

Every two successive frames give one frame of depth, by the ratio of their detail (`focalgradient.depth.ratio`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.noise import noise_floor
from focalgradient.depth.ratio import detail, focal_disparity, read_depth, table_for
from focalgradient.depth.search import Search
from focalgradient.depth.settings import check_blur
from focalgradient.errors import InputError, check_number, warn
from focalgradient.optics import Lens
from focalgradient.plausibility import check_frame, check_pixel_pitch
from focalgradient.progress import Progress, silent
from focalgradient.psf import Psf
from focalgradient.psf.registry import psf_of
from focalgradient.quantities import FOCUS, LIMIT, PIXELS
from focalgradient.video.depth_video import Scale, ValuesFile, VideoFile
from focalgradient.video.pairing import PLAIN, Pair, alternation, pairs
from focalgradient.video.reading import Frame, Skipped, ahead, radiance_levels

__all__ = ["DepthFrame", "DepthStream", "StreamCounts", "write_depth"]

FIRST_FRAMES, NOISE_FRAMES = 24, 4
"""Number of initial frames that determine the sharper aperture, and of those that determine the noise."""

SATURATED = 254
"""Stored value from which pixels count as saturated: the maximum, and the one below, which lossy coding may produce."""


@dataclass(frozen=True, slots=True, eq=False)
class DepthFrame:
    """Depth of two successive frames, on a grid of 4 x 4 pixels.

    Parameters
    ----------
    number
        Number of the later frame.
    values
        Vergence in dioptres, or focal disparity (1 in focus, falling to 0 with blur): floor(H/4) x floor(W/4), float32.
    is_valid
        Whether there is an estimate, of the same shape.
    """

    number: int
    values: NDArray[np.float32]
    is_valid: NDArray[np.bool_]


class DepthStream:
    """Estimator of depth for each two successive frames of a stream.

    Parameters
    ----------
    first
        First frames of the stream, of which up to 24 are taken: they determine which aperture is the smaller one, and
        the noise.
    lenses
        Lens of even frames (0, 2, ...) and lens of odd frames, which differ in f-number alone. None: the values are
        focal disparity, not vergence.
    pixel_angle
        Angle that a pixel subtends, pixel pitch / sensor distance, in radians; required with `lenses`.
    near
        Nearest distance of the search, in metres.  [default: where blur is 16 pixels]
    far
        Farthest distance of the search, in metres.  [default: where blur is 16 pixels]
    psf
        Shape of the blur.
    encoding
        Encoding of light by the video's values.
    window
        Standard deviation, in pixels, of the window over which detail is averaged: 2 to 64.

    Attributes
    ----------
    psf
        Shape of the blur.
    step
        Log ratio of the detail of even frames to that of odd frames.
    noise
        Standard deviation of a pixel's noise, in stored values.
    even_is_sharper
        Whether even frames were taken through the smaller aperture.
    shape
        Height and width of the frames, in pixels.
    scale
        Colour scale of the values.
    search
        Range of vergence that is searched; None without lenses.

    Raises
    ------
    InputError
        If the frames contradict the lenses or show one aperture only, or the lenses cannot give depth.

    Warns
    -----
    FocalGradientWarning
        If the side of focus remains open, or the frames differ too little for a lost frame to be detected.

    Examples
    --------
    A checkerboard beside a plain wall, with twice the contrast in odd frames.

    >>> board = (np.indices((64, 256)).sum(axis=0) % 2 - 0.5) * (np.arange(256) < 128)
    >>> frames = [Frame(n, (100 + (20, 40)[n % 2] * board).astype(np.uint8)) for n in range(3)]
    >>> stream = DepthStream(frames, encoding="linear")
    >>> stream.even_is_sharper, [round(float(one.values[8, 8]), 2) for one in stream.frames(frames)]
    (False, [0.5, 0.5])
    """

    def __init__(
        self,
        first: Iterable[Frame | Skipped],
        lenses: Sequence[Lens] | None = None,
        pixel_angle: float | None = None,
        *,
        near: Annotated[float | None, LIMIT] = None,
        far: Annotated[float | None, FOCUS] = None,
        psf: Psf | str = "disc",
        encoding: Literal["srgb", "linear"] = "srgb",
        window: Annotated[float, PIXELS.between(2, 64)] = 8.0,
    ) -> None:
        if lenses is None and (near or far):
            raise InputError("near and far limit distance, which needs the optics: give lenses too.")
        if near is not None and far is not None and near >= far:
            raise InputError(f"near {near:g} lies beyond or at far {far:g}: give near the smaller distance.")
        self.psf = psf_of(psf)
        check_blur("ratio", self.psf)
        self._levels, self._window = radiance_levels(encoding), window
        self._detail = partial(detail, levels=self._levels)
        begun = list(islice(first, FIRST_FRAMES))
        self.step = alternation(begun, self._detail)
        images = [item.image for item in begun if isinstance(item, Frame)][:NOISE_FRAMES]
        self.noise = min(noise_floor(image.astype(np.float32), usable=image < 255) for image in images)
        self.shape = images[0].shape
        self.search: Search | None = None
        self.scale, self.even_is_sharper = Scale.of_disparity(), self.step > 0
        apart = abs(self.step) > PLAIN
        if lenses is not None:
            self._search(lenses, pixel_angle, near, far)
            if apart and (self.step > 0) != self.even_is_sharper:
                raise InputError(
                    f"{'odd' if self.even_is_sharper else 'even'} frames are sharper, but f_number gives them the "
                    "larger aperture: exchange the two f_number; the first one is that of frame 0."
                )
            if not apart:
                text = "even and odd frames hardly differ in detail, so a lost frame cannot be detected."
                warn(text)
        elif not apart:
            raise InputError(
                f"even and odd frames differ in detail by only {abs(np.expm1(self.step)):.1%}, which does not show "
                "which aperture is the larger: give a video that alternates between two apertures."
            )

    def _search(self, lenses: Sequence[Lens], pixel_angle: float | None, near: float | None, far: float | None) -> None:
        check_number("pixel_angle", pixel_angle, "radians", positive=True)
        assert pixel_angle is not None
        check_pixel_pitch(pixel_angle * lenses[0].sensor_distance, pixel_angle)
        check_frame(pixel_angle, self.shape)
        self.search = search = Search.over(lenses, pixel_angle, near, far)
        self._table = table_for(search, self.psf)
        if not search.side_known:
            warn(search.side_text)
        self.scale = Scale.of_distance(search.lowest, search.highest)
        self.even_is_sharper = lenses[0].f_number > lenses[1].f_number

    def frames(self, items: Iterable[Frame | Skipped]) -> Iterator[DepthFrame | Skipped]:
        """Yield the depth of each two successive frames, and the frames that are skipped, as `pairs` pairs them."""
        for pair in pairs(items, self._detail, self.step):
            yield self._depth(pair) if isinstance(pair, Pair) else pair

    def _depth(self, pair: Pair) -> DepthFrame:
        small, large = (pair.even, pair.odd) if self.even_is_sharper else (pair.odd, pair.even)
        usable = np.maximum(small, large) < SATURATED
        how: dict[str, Any] = {"noise": self.noise, "window": self._window, "levels": self._levels, "usable": usable}
        if self.search is None:
            return DepthFrame(pair.number, *focal_disparity(small, large, **how))
        vergence, _, is_valid = read_depth(small, large, self._table, self.search, **how)
        return DepthFrame(pair.number, vergence, is_valid)

    def summary(self) -> dict[str, Any]:
        """Return the colour scale, the ratio of detail and the noise, for a record of the result."""
        return {
            "scale": {"what": self.scale.title, "dark": self.scale.ticks[0][1], "bright": self.scale.ticks[-1][1]},
            "even_over_odd_detail": float(np.exp(self.step)),
            "noise_of_stored_values": self.noise,
        }

    def shown(self, frame: DepthFrame) -> NDArray[np.float32]:
        """Return the values of a frame as distance in metres, or as focal disparity; NaN where not valid."""
        with np.errstate(divide="ignore"):
            values = frame.values if self.search is None else 1 / np.maximum(frame.values, 0)
        return np.where(frame.is_valid, values, np.nan).astype(np.float32)


@dataclass
class StreamCounts:
    """Numbers of frames read, of frames of depth, and of those with any estimate; and the frames skipped."""

    frames_read: int = 0
    depth_frames: int = 0
    frames_with_depth: int = 0
    skipped: list[Skipped] = field(default_factory=list)


def write_depth(
    stream: DepthStream,
    items: Iterable[Frame | Skipped],
    out: Path,
    values: Path | None = None,
    *,
    fps: float,
    count: int = 0,
    progress: Progress | None = None,
) -> StreamCounts:
    """Write the depth of a stream as colour video, and as numbers; frames are decoded and estimated ahead, in threads.

    If it fails, the files are incomplete.

    Parameters
    ----------
    stream
        Estimator, made from the first frames.
    items
        All frames, from the first.
    out
        Depth video, black without an estimate, with its scale at the side (`VideoFile`).
    values
        ``.npy`` file of the values (float32, n x H/4 x W/4), as given by `DepthStream.shown`; None: not written.
    fps
        Frames per second of the video.
    count
        Number of frames, if known, for `progress`.
    progress
        Called at each frame with the fraction done, 0 to 1, and the frame.

    Returns
    -------
    StreamCounts
        Frames read, written and skipped.

    Raises
    ------
    InputError
        If the files cannot be written.
    """
    counts, say = StreamCounts(), progress or silent

    def counted() -> Iterator[Frame | Skipped]:
        for item in ahead(items):
            if isinstance(item, Frame):
                counts.frames_read += 1
                say(min(counts.frames_read / count, 1.0) if count else 0.0, f"frame {item.number}")
            yield item

    with ExitStack() as files:
        picture: VideoFile | None = None
        numbers: ValuesFile | None = None
        for item in ahead(stream.frames(counted())):
            if isinstance(item, Skipped):
                counts.skipped.append(item)
                continue
            if picture is None:
                height, width = item.values.shape
                picture = VideoFile(out, fps, (height, width), stream.scale)
                files.callback(picture.close)
                if values is not None:
                    numbers = ValuesFile(values, (height, width))
                    files.callback(numbers.close)
            picture.write(item.values, item.is_valid)
            if numbers is not None:
                numbers.write(stream.shown(item))
            counts.depth_frames += 1
            counts.frames_with_depth += bool(item.is_valid.any())
    return counts
