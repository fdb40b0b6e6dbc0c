"""``focalgradient stream``: depth video from video whose frames alternate between two apertures."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
import numpy as np

from focalgradient.cli.options import NEAREST, OPENEST, positive
from focalgradient.cli.program import progress, summary_json, warnings_told, writable
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import printable, replacing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from focalgradient.video import Frame, Scale, Skipped

__all__ = ["stream"]

FIRST = 24
"""Frames looked at beforehand for which aperture is the sharper; the first four of them for noise."""

OPTICS = {
    "focal_length": "--focal-length",
    "f_numbers": "--f-number",
    "focus_distance": "--focus-distance",
    "pixel_pitch": "--pixel-pitch",
}

SATURATED = 254
"""Stored value from which pixels are left out: the top, and the one below, where lossy coding puts it at times."""

ToGrid = Callable[["NDArray[np.uint8]", "NDArray[np.uint8]"], "tuple[NDArray[np.float32], NDArray[np.bool_]]"]


@click.command(short_help="Depth video from video that alternates between two apertures.")
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
    help="Also write the numbers: float32, frames x height/4 x width/4, NaN where there is no estimate.",
)
@click.option(
    "--focal-length",
    type=float,
    metavar="MM",
    callback=positive(" of millimetres"),
    help="* Focal length, in millimetres.",
)
@click.option(
    "--f-number",
    "f_numbers",
    type=float,
    multiple=True,
    metavar="N",
    callback=positive(infinite=True, least=OPENEST),
    help="* f-number: of frames 0, 2, 4, ..., and again for that of frames 1, 3, 5, ...",
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
    help="* Size of a pixel of the video, in micrometres on the sensor.",
)
@click.option(
    "--near",
    type=float,
    metavar="M",
    callback=positive(" of metres", least=NEAREST),
    help="Search from here, in metres.",
)
@click.option(
    "--far",
    type=float,
    metavar="M",
    callback=positive(" of metres", infinite=True, least=NEAREST),
    help="Search up to here, in metres.",
)
@click.option(
    "--psf", type=click.Choice(["disc", "gaussian"]), default="disc", show_default=True, help="Shape of the blur."
)
@click.option(
    "--encoding",
    type=click.Choice(["srgb", "linear"]),
    default="srgb",
    show_default=True,
    help="How the video's values encode light.",
)
@click.option(
    "--window",
    type=click.FloatRange(2, 64),
    default=8.0,
    show_default=True,
    metavar="PX",
    help="Standard deviation, in pixels, of the window in which detail is gathered.",
)
def stream(
    video: Path,
    out: Path,
    values: Path | None,
    near: float | None,
    far: float | None,
    psf: Literal["disc", "gaussian"],
    encoding: Literal["srgb", "linear"],
    window: float,
    **optics: Any,
) -> None:
    """Recover depth, frame by frame, from a video that alternates between two apertures at one focus.

    Even frames (0, 2, ...) show one aperture, odd frames the other; every two successive frames give one frame of
    depth. With the options marked * the output is distance in metres; without them it is the focal disparity, 1 in
    focus and falling to 0 with blur. Frames that cannot be decoded or paired are reported and skipped.

    Writes DEPTH_VIDEO, black where there is no estimate, with its scale at the side; beside it a file of the same
    name ending in .json with the settings and what was skipped; and FILE.npy. Interrupted, it writes nothing.

    \b
    Example:
      focalgradient stream scene.mp4 --out depth.mp4 --focal-length 25 --f-number 16 --f-number 5.6
        --focus-distance 0.85 --pixel-pitch 8 --near 0.85 --far 3
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    start = time.perf_counter()
    _check(optics, near, far)
    from focalgradient.depth.noise import noise_floor
    from focalgradient.depth.ratio import detail
    from focalgradient.video import (
        Frame,
        Skipped,
        Source,
        ValuesFile,
        VideoFile,
        ahead,
        alternation,
        check_ending,
        luminance,
        pairs,
    )  # fmt: skip

    check_ending(out)
    note = out.with_suffix(".json")
    places = [out, note] + ([values] if values else [])
    if len({place.resolve() for place in places}) < len(places):
        raise InputError(
            f"--values and --out name one file twice (--out brings {note.name} too): give each a name of its own."
        )
    for place in places:
        writable(place.parent, (place.name,), [video])

    levels = np.linspace(0, 1, 256, dtype=np.float32) if encoding == "linear" else _srgb()

    def content(image: NDArray[np.uint8]) -> float:
        return detail(image, levels)

    grey = luminance(levels)

    with warnings_told() as told:
        with Source(video, grey) as source:
            first = list(islice(source.frames(), FIRST))
        step = alternation(first, content)
        images = [item.image for item in first if isinstance(item, Frame)][:4]
        noise = min(noise_floor(image.astype(np.float32)) for image in images)
        del first, images
        to_grid, scale, said = _reader(optics, near, far, psf, window, levels, noise, step)

        skipped: list[Skipped] = []
        frames = pairs_found = 0
        with replacing(places, note) as staged, Source(video, grey) as source, ExitStack() as open_files:
            picture: VideoFile | None = None
            numbers: ValuesFile | None = None
            # Decoding and writing go on beside the computation, each in a thread of its own.
            written: Future[None] | None = None

            def write(grid: NDArray[np.float32], valid: NDArray[np.bool_]) -> None:
                assert picture is not None
                picture.write(grid, valid)
                if numbers is not None:
                    numbers.write(_as_told(grid, valid, bool(said["optics"])))

            def counted(say: Callable[[str], None]) -> Iterator[Frame | Skipped]:
                nonlocal frames
                for item in ahead(source.frames()):
                    if isinstance(item, Frame):
                        frames += 1
                        say(f"frame {item.number}")
                    yield item

            with progress(source.declared) as say:
                for pair in pairs(counted(say), content, step):
                    if isinstance(pair, Skipped):
                        skipped.append(pair)
                        continue
                    grid, valid = to_grid(pair.even, pair.odd)
                    if picture is None:
                        shape = grid.shape[0], grid.shape[1]
                        picture = VideoFile(staged[out], source.fps, shape, scale)
                        open_files.callback(picture.close)
                        if values:
                            numbers = ValuesFile(staged[values], shape)
                            open_files.callback(numbers.close)
                        writer = open_files.enter_context(ThreadPoolExecutor(1))
                    if written is not None:
                        written.result()
                    written = writer.submit(write, grid, valid)
                    pairs_found += 1
            if written is None:
                raise InputError(f"{printable(video)} has no two successive frames that make a pair: {_list(skipped)}.")
            written.result()
            open_files.close()
            seconds = time.perf_counter() - start
            summary = {
                "video": str(video),
                "settings": {
                    **said,
                    "near_m": near,
                    "far_m": far,
                    "psf": psf,
                    "encoding": encoding,
                    "window_px": window,
                },
                "scale": {"what": scale.title, "dark": scale.ticks[0][1], "bright": scale.ticks[-1][1]},
                "even_over_odd_detail": float(np.exp(step)),
                "noise_of_stored_values": noise,
                "frames_read": frames,
                "depth_frames": pairs_found,
                "skipped": [{"first": s.first, "last": s.last, "reason": s.reason} for s in skipped],
                "fps_of_video": source.fps,
                "fps_of_processing": pairs_found / seconds,
                "seconds": seconds,
                "warnings": list(told),
            }
            staged[note].write_bytes(summary_json(summary))
    for item in skipped[:20]:
        click.echo(f"Skipped: {_sentence(item)}.", err=True)
    if len(skipped) > 20:
        click.echo(f"Skipped: {len(skipped) - 20} more places, listed in {note}.", err=True)
    if not said["optics"]:
        click.echo("No optics given: the output is focal disparity (1 in focus, less with blur), not distance.")
    click.echo(f"Depth frames: {pairs_found} from {frames} frames, {pairs_found / seconds:.1f} a second")
    click.echo(f"Written: {', '.join(map(str, places))}")


def _reader(
    optics: Mapping[str, Any],
    near: float | None,
    far: float | None,
    psf: Literal["disc", "gaussian"],
    window: float,
    levels: NDArray[np.float32],
    noise: float,
    step: float,
) -> tuple[ToGrid, Scale, dict[str, Any]]:
    """What turns a pair into values on the grid, how these are coloured, and what to say of it.

    Values are vergences in dioptres, or focal disparity where no optics are given.
    """
    from focalgradient import Lens
    from focalgradient.depth.ratio import focal_disparity, read_depth, table_for
    from focalgradient.depth.search import Search
    from focalgradient.psf import DISC_K
    from focalgradient.video import PLAIN, Scale

    apart = abs(step) > PLAIN
    if not optics["f_numbers"]:
        if not apart:
            raise InputError(
                f"even and odd frames differ in detail by {abs(np.expm1(step)):.1%} only, so that nothing tells which "
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
    table = table_for(search, psf, DISC_K)
    if not search.side_known:
        warnings.warn(FocalGradientWarning(search.side_text), stacklevel=2)
    even_sharper = lenses[0].f_number > lenses[1].f_number
    if apart and (step > 0) != even_sharper:
        raise InputError(
            f"{'odd' if even_sharper else 'even'} frames are the sharper, though --f-number gives them the larger "
            "aperture: exchange the two --f-number, of which the first is that of frame 0."
        )
    if not apart:
        warnings.warn(
            FocalGradientWarning("even and odd frames hardly differ in detail, so that a lost frame goes unnoticed."),
            stacklevel=2,
        )

    def vergence(even: NDArray[np.uint8], odd: NDArray[np.uint8]) -> Any:
        small, large = (even, odd) if even_sharper else (odd, even)
        usable = np.maximum(even, odd) < SATURATED
        found, _, valid = read_depth(
            small, large, table, search, noise=noise, window=window, levels=levels, usable=usable
        )
        return found, valid

    said = {
        "focal_length_mm": optics["focal_length"],
        "f_numbers": optics["f_numbers"],
        "focus_distance_m": optics["focus_distance"],
        "pixel_pitch_um": optics["pixel_pitch"],
    }
    return vergence, Scale.of_distance(search.lowest, search.highest), {"optics": said, "side": search.side_text}


def _check(optics: Mapping[str, Any], near: float | None, far: float | None) -> None:
    """Refuse optics given in part, and limits that exclude each other."""
    given = [option for name, option in OPTICS.items() if optics[name]]
    if given and len(given) < len(OPTICS):
        missing = [option for option in OPTICS.values() if option not in given]
        raise InputError(f"{', '.join(missing)} is missing beside {', '.join(given)}: give all optics, or none.")
    if given and len(optics["f_numbers"]) != 2:
        raise InputError(
            f"--f-number is given {len(optics['f_numbers'])} times: give it for even, then for odd frames."
        )
    if not given and (near or far):
        raise InputError("--near and --far limit distance, which needs the optics: give the options marked * too.")
    if near is not None and far is not None and near >= far:
        raise InputError(f"--near {near:g} lies beyond or at --far {far:g}: give --near the smaller distance.")


def _srgb() -> NDArray[np.float32]:
    from focalgradient.photographs.images import srgb_to_linear

    return srgb_to_linear(np.arange(256) / 255).astype(np.float32)


def _as_told(grid: NDArray[np.float32], valid: NDArray[np.bool_], distance: bool) -> NDArray[np.float32]:
    """The numbers of a frame: distance in metres, or the disparity itself; NaN where nothing is told."""
    with np.errstate(divide="ignore"):
        shown = 1 / np.maximum(grid, 0) if distance else grid
    return np.where(valid, shown, np.nan).astype(np.float32)


def _sentence(item: Skipped) -> str:
    frames = f"frame {item.first}" if item.first == item.last else f"frames {item.first} to {item.last}"
    return f"{frames} {item.reason}"


def _list(skipped: list[Skipped]) -> str:
    return "; ".join(_sentence(item) for item in skipped[:3]) or "it has fewer than two frames"
