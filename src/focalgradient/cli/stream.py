"""``focalgradient stream``: depth video from a video whose frames alternate between two apertures."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

import click
import numpy as np

from focalgradient.cli.options import DIAMETER, GIVEN, NEAREST, OPENEST, focal_length_option, limit_options, positive
from focalgradient.cli.program import (
    announce,
    force_option,
    json_option,
    nothing_valid,
    placing,
    progress,
    show,
    summary_json,
    warnings_given,
    writable,
)
from focalgradient.cli.shapes import ShapeAsked, ShapedCommand, shape_options
from focalgradient.depth.recover import check_blur
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import printable, refuse_overwriting
from focalgradient.plausibility import check_focal_length, check_frame, check_pixel_pitch, given_as
from focalgradient.psf import Disc, Psf

if TYPE_CHECKING:
    from types import TracebackType

    from numpy.typing import NDArray

    from focalgradient.video import Frame, Scale, Skipped, Source, ValuesFile, VideoFile

__all__ = ["stream"]

FIRST = 24
"""Number of initial frames from which the sharper aperture is determined; the first four also give the noise."""

MOST_NAMED = 20
"""Maximum number of skipped frames named on standard error; the JSON file beside the video lists all."""

OPTICS = {
    "focal_length": "--focal-length",
    "f_numbers": "--f-number",
    "focus_distance": "--focus-distance",
    "pixel_pitch": "--pixel-pitch",
}

NO_DEPTH = (
    "the scene has too little texture, or its blur is impossible with the stated optics and limits: check "
    "--f-number, --focus-distance, --near and --far"
)
"""Most likely cause if no frame has depth."""

SECONDS = 0.034 / (1920 * 1080)
"""Processing time in s per frame and pixel on two cores, including decoding and encoding."""

SATURATED = 254
"""Stored value from which pixels count as saturated: the maximum, and the one below, which lossy coding may produce."""

ToGrid = Callable[["NDArray[np.uint8]", "NDArray[np.uint8]"], "tuple[NDArray[np.float32], NDArray[np.bool_]]"]


@click.command(cls=ShapedCommand, short_help="Estimate depth in a video that alternates two apertures.")
@click.argument("video", type=click.Path(path_type=Path), metavar="VIDEO")
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    metavar="DEPTH_VIDEO",
    help="Depth video to write: .mp4, .mov, .mkv, .avi or .webm.",
)
@click.option(
    "--values",
    type=click.Path(path_type=Path),
    metavar="FILE.npy",
    help="Also write the values: float32, frames x height/4 x width/4, NaN without an estimate.",
)
@focal_length_option
@click.option(
    "--f-number",
    "f_numbers",
    type=float,
    multiple=True,
    metavar="N",
    callback=positive(infinite=True, least=OPENEST, hint=DIAMETER),
    help="* f-number: give it twice, for frames 0, 2, 4, ... and for frames 1, 3, 5, ...",
)
@click.option(
    "--focus-distance",
    type=float,
    metavar="M",
    callback=positive(" of metres", infinite=True, least=NEAREST),
    help="* Distance of the plane in focus, in metres.",
)
@click.option(
    "--pixel-pitch",
    type=float,
    metavar="UM",
    callback=positive(" of micrometres"),
    help="* Pixel pitch of the video on the sensor, in micrometres.",
)
@limit_options
@shape_options("Shape of the blur.", Disc.name)
@click.option(
    "--encoding",
    type=click.Choice(["srgb", "linear"]),
    default="srgb",
    show_default=True,
    help="Encoding of light by the video's values.",
)
@click.option(
    "--window",
    type=float,
    default=8.0,
    show_default=True,
    metavar="PX",
    callback=positive(" of pixels", least=2, most=64),
    help="Standard deviation, in pixels, of the window over which detail is averaged: 2 to 64.",
)
@force_option
@json_option
def stream(
    video: Path,
    out: Path,
    values: Path | None,
    near: float | None,
    far: float | None,
    psf: ShapeAsked,
    encoding: Literal["srgb", "linear"],
    window: float,
    **optics: Any,
) -> None:
    """Recover depth, frame by frame, from a video that alternates between two apertures at one focus.

    Even frames (0, 2, ...) show one aperture, odd frames the other; every two successive frames give one frame of
    depth. With the options marked * the output is distance in metres; without them it is focal disparity, 1 in
    focus and falling to 0 with blur. Frames that cannot be decoded or paired are reported and skipped.

    Writes DEPTH_VIDEO, black without an estimate, with its scale at the side; beside it a .json file of the same name
    with the settings and the skipped frames; and FILE.npy. If interrupted, it writes nothing. Exit code 1: no frame has
    depth.

    Method: the ratio of detail ('ratio' of the command depth), with errors of a few per cent. A second of video with
    1920 x 1080 pixels at 30 frames takes about 2 s on two cores.

    \b
    Example:
      focalgradient stream demo/video.mkv --out depth.mp4 --focal-length 25 --f-number 16 --f-number 5.6 \\
        --focus-distance 0.85 --pixel-pitch 8 --near 0.85
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    start = time.perf_counter()
    _check(optics, near, far)
    blur = psf.shape()
    check_blur("ratio", blur)
    from focalgradient.depth.ratio import detail
    from focalgradient.video import Source, luminance

    places = _places(video, out, values)
    note = places[1]
    levels = np.linspace(0, 1, 256, dtype=np.float32) if encoding == "linear" else _srgb()
    content = partial(detail, levels=levels)
    grey = luminance(levels)
    with warnings_given() as given:
        with Source(video, grey) as source:
            step, noise, shape = _opening(source, content)
        with given_as(GIVEN):
            _check_pixels(optics, shape)
            to_grid, scale, settings = _reader(optics, near, far, blur, window, levels, noise, step)
        distance = bool(settings["optics"])
        with placing(places, note) as staged, Source(video, grey) as source:
            hidden = [staged[place] for place in places if place != note]
            with _Output(hidden[0], hidden[1] if values else None, source.fps, scale, distance) as output:
                counts = _recover(source, content, step, to_grid, output)
            if not counts.depth_frames:
                raise InputError(
                    f"{printable(video)} has no pair of successive frames that can be used: {_list(counts.skipped)}."
                )
            seconds = time.perf_counter() - start
            limits = {"near_m": near, "far_m": far}
            summary = {
                "video": printable(video.name),
                "settings": {
                    **settings,
                    **limits,
                    "psf": blur.name,
                    "psf_parameters": blur.stated(),
                    "encoding": encoding,
                    "window_px": window,
                },
                "scale": {"what": scale.title, "dark": scale.ticks[0][1], "bright": scale.ticks[-1][1]},
                "even_over_odd_detail": float(np.exp(step)),
                "noise_of_stored_values": noise,
                **counts.noted(),
                "fps_of_video": source.fps,
                "fps_of_processing": counts.depth_frames / seconds,
                "seconds": seconds,
                "warnings": list(given),
            }
            staged[note].write_bytes(summary_json(summary))
    counts.report(note)
    disparity = "No optics given: the output is focal disparity (1 in focus, less with blur), not distance."
    rate = counts.depth_frames / seconds
    show(
        summary | {"written": [printable(place) for place in places]},
        *(() if distance else (disparity,)),
        f"Depth frames: {counts.depth_frames} from {counts.frames} frames, {rate:.1f} per second",
        f"Written: {', '.join(printable(place) for place in places)}",
    )
    nothing_valid(None if counts.with_depth else NO_DEPTH, "No depth in any frame")


def _places(video: Path, out: Path, values: Path | None) -> list[Path]:
    """Return the files to write: depth video, its JSON file, and values if requested; none may be an input."""
    from focalgradient.video import check_ending

    check_ending(out)
    note = out.with_suffix(".json")
    places = [out, note] + ([values] if values else [])
    if len({os.path.realpath(place) for place in places}) < len(places):
        raise InputError(
            f"--values and --out name the same file (--out also writes {note.name}): give them different names."
        )
    refuse_overwriting([video], places)
    if values is not None and values.suffix.lower() != ".npy":
        raise InputError(
            f"--values is {printable(values)}, but values are written as .npy: give a name that ends in .npy."
        )
    for folder in {place.parent for place in places}:
        writable(folder, [place.name for place in places if place.parent == folder], [video])
    return places


def _check_pixels(optics: Mapping[str, Any], shape: Sequence[int]) -> None:
    """Raise `InputError` for an impossible pixel pitch or frame width, if optics are given."""
    if optics["f_numbers"]:
        pitch, focal_length = 1e-6 * optics["pixel_pitch"], 1e-3 * optics["focal_length"]
        check_focal_length(focal_length)
        check_pixel_pitch(pitch, pitch / focal_length)
        check_frame(pitch / focal_length, shape)


def _opening(source: Source, content: Callable[[NDArray[np.uint8]], float]) -> tuple[float, float, Sequence[int]]:
    """Return log ratio of detail of even to odd frames, noise, and frame shape, from the first frames."""
    from focalgradient.depth.noise import noise_floor
    from focalgradient.video import Frame, alternation

    first = list(islice(source.frames(), FIRST))
    step = alternation(first, content)
    images = [item.image for item in first if isinstance(item, Frame)][:4]
    announce(SECONDS * source.declared * images[0].size, f"{source.declared} frames")
    noise = min(noise_floor(image.astype(np.float32), usable=image < 255) for image in images)  # of 8 bits
    return step, noise, images[0].shape


@dataclass
class _Counts:
    """Numbers of frames read, estimated and skipped."""

    frames: int = 0
    depth_frames: int = 0
    with_depth: int = 0  # of the frames of depth, those in which any block is valid
    skipped: list[Skipped] = field(default_factory=list)

    def noted(self) -> dict[str, Any]:
        """Return the counts as stated in the JSON file."""
        places = [{"first": item.first, "last": item.last, "reason": item.reason} for item in self.skipped]
        return {
            "frames_read": self.frames,
            "depth_frames": self.depth_frames,
            "frames_with_depth": self.with_depth,
            "skipped": places,
        }

    def report(self, note: Path) -> None:
        """List skipped frames on standard error."""
        for item in self.skipped[:MOST_NAMED]:
            click.echo(f"Skipped: {_sentence(item)}.", err=True)
        if len(self.skipped) > MOST_NAMED:
            click.echo(f"Skipped: {len(self.skipped) - MOST_NAMED} more, listed in {note}.", err=True)


class _Output:
    """Depth video, and values if requested: opened at the first frame of depth, and written in one thread."""

    def __init__(self, picture: Path, values: Path | None, fps: float, scale: Scale, distance: bool) -> None:
        self._places, self._fps, self._scale, self._distance = (picture, values), fps, scale, distance
        self._open = ExitStack()
        self._written: Future[None] | None = None
        self._picture: VideoFile
        self._numbers: ValuesFile | None = None

    def __enter__(self) -> Self:
        self._writer = self._open.enter_context(ThreadPoolExecutor(1))
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            if self._written is not None and kind is None:
                self._written.result()
        finally:
            self._open.close()

    def write(self, grid: NDArray[np.float32], valid: NDArray[np.bool_]) -> None:
        """Submit one frame of depth; raise the error of the previous one, if any."""
        if self._written is None:
            self._begin((grid.shape[0], grid.shape[1]))
        else:
            self._written.result()
        self._written = self._writer.submit(self._write, grid, valid)

    def _begin(self, shape: tuple[int, int]) -> None:
        from focalgradient.video import ValuesFile, VideoFile

        picture, values = self._places
        self._picture = VideoFile(picture, self._fps, shape, self._scale)
        files: list[VideoFile | ValuesFile] = [self._picture]
        if values:
            self._numbers = ValuesFile(values, shape)
            files.append(self._numbers)
        # The thread ends before the files are closed.
        writer = self._open.pop_all()
        for file in files:
            self._open.callback(file.close)
        self._open.push(writer)

    def _write(self, grid: NDArray[np.float32], valid: NDArray[np.bool_]) -> None:
        self._picture.write(grid, valid)
        if self._numbers is not None:
            self._numbers.write(_in_metres(grid, valid, self._distance))


def _recover(
    source: Source, content: Callable[[NDArray[np.uint8]], float], step: float, to_grid: ToGrid, output: _Output
) -> _Counts:
    """Estimate depth from all pairs of a video; decoding and writing run in separate threads."""
    from focalgradient.video import Frame, Skipped, ahead, pairs

    counts = _Counts()
    with progress(source.declared) as say:

        def counted() -> Iterator[Frame | Skipped]:
            for item in ahead(source.frames()):
                if isinstance(item, Frame):
                    counts.frames += 1
                    say(f"frame {item.number}")
                yield item

        for pair in pairs(counted(), content, step):
            if isinstance(pair, Skipped):
                counts.skipped.append(pair)
            else:
                grid, valid = to_grid(pair.even, pair.odd)
                output.write(grid, valid)
                counts.depth_frames += 1
                counts.with_depth += bool(valid.any())
    return counts


def _reader(
    optics: Mapping[str, Any],
    near: float | None,
    far: float | None,
    psf: Psf,
    window: float,
    levels: NDArray[np.float32],
    noise: float,
    step: float,
) -> tuple[ToGrid, Scale, dict[str, Any]]:
    """Return the function that maps a pair to values on the grid, their colour scale, and a description.

    Values are vergences in dioptres, or focal disparity without optics.
    """
    from focalgradient import Lens
    from focalgradient.depth.ratio import focal_disparity, read_depth, table_for
    from focalgradient.depth.search import Search
    from focalgradient.video import PLAIN, Scale

    apart = abs(step) > PLAIN
    if not optics["f_numbers"]:
        if not apart:
            raise InputError(
                f"even and odd frames differ in detail by only {abs(np.expm1(step)):.1%}, which does not show which "
                "aperture is the larger: give a video that alternates between two apertures."
            )

        def disparity(even: NDArray[np.uint8], odd: NDArray[np.uint8]) -> Any:
            small, large = (even, odd) if step > 0 else (odd, even)
            usable = np.maximum(even, odd) < SATURATED
            return focal_disparity(small, large, noise=noise, window=window, levels=levels, usable=usable)

        return disparity, Scale.of_disparity(), {"optics": None, "sharper": "even" if step > 0 else "odd"}

    lenses = [Lens(optics["focal_length"] * 1e-3, number, optics["focus_distance"]) for number in optics["f_numbers"]]
    pixel_angle = optics["pixel_pitch"] * 1e-6 / lenses[0].sensor_distance
    search = Search.over(lenses, pixel_angle, near, far)
    table = table_for(search, psf)
    if not search.side_known:
        warnings.warn(FocalGradientWarning(search.side_text), stacklevel=2)
    even_sharper = lenses[0].f_number > lenses[1].f_number
    if apart and (step > 0) != even_sharper:
        raise InputError(
            f"{'odd' if even_sharper else 'even'} frames are sharper, but --f-number gives them the larger "
            "aperture: exchange the two --f-number; the first one is that of frame 0."
        )
    if not apart:
        warnings.warn(
            FocalGradientWarning("even and odd frames hardly differ in detail, so a lost frame cannot be detected."),
            stacklevel=2,
        )

    def vergence(even: NDArray[np.uint8], odd: NDArray[np.uint8]) -> Any:
        small, large = (even, odd) if even_sharper else (odd, even)
        usable = np.maximum(even, odd) < SATURATED
        found, _, valid = read_depth(
            small, large, table, search, noise=noise, window=window, levels=levels, usable=usable
        )
        return found, valid

    stated = {
        "focal_length_mm": optics["focal_length"],
        "f_numbers": optics["f_numbers"],
        "focus_distance_m": optics["focus_distance"],
        "pixel_pitch_um": optics["pixel_pitch"],
    }
    return vergence, Scale.of_distance(search.lowest, search.highest), {"optics": stated, "side": search.side_text}


def _check(optics: Mapping[str, Any], near: float | None, far: float | None) -> None:
    """Raise `InputError` for incomplete optics, and for limits that exclude each other."""
    given = [option for name, option in OPTICS.items() if optics[name]]
    if given and len(given) < len(OPTICS):
        missing = [option for option in OPTICS.values() if option not in given]
        verbs = ["is" if len(options) == 1 else "are" for options in (missing, given)]
        raise InputError(
            f"{' and '.join(missing)} {verbs[0]} missing, but {' and '.join(given)} {verbs[1]} given: give all optics, "
            "or none."
        )
    if given and len(optics["f_numbers"]) != 2:
        count = len(optics["f_numbers"])
        times = "once" if count == 1 else f"{count} times"
        raise InputError(f"--f-number is given {times}: give it twice, for even and for odd frames.")
    if not given and (near or far):
        raise InputError("--near and --far limit distance, which needs the optics: give the options marked * too.")
    if near is not None and far is not None and near >= far:
        raise InputError(f"--near {near:g} lies beyond or at --far {far:g}: give --near the smaller distance.")


def _srgb() -> NDArray[np.float32]:
    from focalgradient.photographs import srgb_to_linear

    return srgb_to_linear(np.arange(256) / 255).astype(np.float32)


def _in_metres(grid: NDArray[np.float32], valid: NDArray[np.bool_], distance: bool) -> NDArray[np.float32]:
    """Return the values of a frame: distance in m, or focal disparity; NaN where invalid."""
    with np.errstate(divide="ignore"):
        shown = 1 / np.maximum(grid, 0) if distance else grid
    return np.where(valid, shown, np.nan).astype(np.float32)


def _sentence(item: Skipped) -> str:
    frames = f"frame {item.first}" if item.first == item.last else f"frames {item.first} to {item.last}"
    return f"{frames} {item.reason}"


def _list(skipped: list[Skipped]) -> str:
    return "; ".join(_sentence(item) for item in skipped[:3]) or "it has fewer than two frames"
