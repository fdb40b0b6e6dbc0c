"""Movies of the rotating Necker cube: frames for a display and a video, with and without a focal gradient.

All conditions show lines at the same positions with the same energy; only their blur differs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import read_bytes, read_json, staged
from focalgradient.parallel import in_order
from focalgradient.progress import Progress, part_of, silent
from focalgradient.quantities import MILLIMETRES, POSITIVE
from focalgradient.render.wireframe import Focus, Gradient, blur_at, necker_frame
from focalgradient.scenes.necker import SYMMETRY, NeckerCube, Reading, departure_from_rigid
from focalgradient.stimuli.folder import MANIFEST, Folder, versions_of
from focalgradient.stimuli.sets import display_json, png_of
from focalgradient.video import save_movie

__all__ = ["GRADIENTS", "make_necker", "read_necker"]

GRADIENTS: tuple[Gradient, ...] = ("none", "rigid", "nonrigid")
"""Focal-gradient conditions: no blur; blur by the depth of the cube; blur by the depth of the reversed shape, which
favours the nonrigid interpretation."""

LOOPS_PER_TURN = 4  # quarter rotations per video: one whole rotation
LIGHT_PERCENT = 0.5  # maximum difference of mean radiance between conditions (%)
BATCH_FRAMES = 30  # frames written between updates of the list
MARGIN_SD = 4.0  # margin in standard deviations of the largest blur


def make_necker(
    out: str | Path,
    cube: NeckerCube,
    *,
    gradients: Sequence[Gradient] = GRADIENTS,
    size: int = 640,
    frame_rate: Annotated[float, POSITIVE.between(1, 1000), "HZ"] = 60.0,
    aperture: Annotated[float, MILLIMETRES.si] = 0.012,
    focus: Focus = "near",
    display: Display | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Make the frames and videos, resume an interrupted set, or verify a finished one.

    Parameters
    ----------
    out
        Output folder.
    cube
        The cube: its size, perspective, direction, speed and line width.
    gradients
        Depth with which the blur is consistent: none; the cube's (rigid); that of its depth reversal, which favours the
        nonrigid percept. Repeatable.
    size
        Width and height of the frames in pixels, even.
    frame_rate
        Frames per second; a quarter turn must take a whole number of frames.
    aperture
        Strength of the gradient: the aperture of a lens half a metre from the cube.
    focus
        Which end of the cube is in focus.
    display
        Display for which the frames are made.
    executor
        Executor that draws batches of frames; the files do not depend on it. None: this process.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    The aperture is in metres.

    Returns
    -------
    dict
        The manifest.

    Raises
    ------
    InputError
        If a value is out of range, the cube does not fit the frame, the display cannot resolve the blur, or the folder
        contains something else or cannot be written.
    """
    out, display, say = Path(out), display or Display(), progress or silent
    if not gradients or not set(gradients) <= set(GRADIENTS):
        raise InputError(f"gradients is {list(gradients)!r}, but must be some of {', '.join(GRADIENTS)}.")
    gradients = [one for one in GRADIENTS if one in gradients]
    frames = cube.loop_frames(frame_rate)
    pixel_angle = math.radians(1 / display.pixels_per_degree)
    blurs = blur_at(cube, [cube.nearest, cube.farthest], aperture=aperture, focus=focus) / pixel_angle
    widest = float(np.abs(blurs).max())
    _check(cube, size, widest, pixel_angle, display)
    if gradients != ["none"]:
        display.check_steps([0.0, 4 * widest])  # a disc's diameter is four times the standard deviation of its light

    how: dict[str, Any] = {"shape": (size, size), "pixel_angle": pixel_angle, "aperture": aperture, "focus": focus}
    parameters = {
        "gradients": gradients,
        "frame_px": [size, size],
        "frames": frames,
        "frame_rate": frame_rate,
        "edge_deg": math.degrees(cube.size),
        "perspective": cube.perspective,
        "distance_m": cube.distance,
        "tilt_deg": math.degrees(cube.tilt),
        "direction": cube.direction,
        "turns_per_second": cube.speed,
        "line_width_arcmin": 60 * math.degrees(cube.line_width),
        "aperture_mm": 1e3 * aperture,
        "focus": focus,
    }
    settings = {"set": "necker", "parameters": parameters, "display": display_json(display)}
    folder = Folder(out, settings, versions_of("focalgradient", "numpy", "pillow", "numba", "opencv-python-headless"))
    if not folder.complete:
        white = max(float(necker_frame(cube, SYMMETRY * number / frames, **how).max()) for number in range(frames))
        conditions = folder.content.setdefault("conditions", {})
        for index, gradient in enumerate(gradients):
            share = part_of(say, index, len(gradients))
            draw = partial(necker_frame, cube, gradient=gradient, **how)
            widths = [0.0, 0.0] if gradient == "none" else sorted(np.abs(blurs).tolist())
            conditions[gradient] = {
                "frames": [f"{gradient}/{number:04}.png" for number in range(frames)],
                "video": f"{gradient}.mp4",
                "blur_sd_px": widths,
                "blur_sd_arcmin": [display.arcmin(sd) for sd in widths],
                **_make_loop(folder, draw, frames, display, gradient, white, frame_rate, executor, share),
            }
        folder.content |= {"white": white, "departure": _departure(cube, frames), "controls": _controls(conditions)}
        folder.finish()
    say(1.0, "finished")
    return read_necker(out)


def read_necker(folder: str | Path) -> dict[str, Any]:
    """Read the manifest of finished frames.

    Raises
    ------
    InputError
        If the manifest cannot be read.
    """
    made: dict[str, Any] = read_json(Path(folder) / MANIFEST)
    return made


@dataclass(frozen=True, slots=True)
class _Frame:
    """A frame: 8-bit values, PNG file or None, and mean radiance as computed and as displayed (white = 1)."""

    values: NDArray[np.uint8]
    png: bytes | None
    light: float
    shown: float
    clipped: float


def _made(
    draw: Callable[[float], NDArray[np.float32]],
    frames: int,
    display: Display,
    white: float,
    lacking: frozenset[int],
    numbers: range,
) -> list[_Frame]:
    """Return some of the `frames` of a loop; `lacking` are those whose files have to be written."""
    made = []
    for number in numbers:
        share = draw(SYMMETRY * number / frames) / white
        values = display.encode(share, number)
        light, shown = float(share.mean(dtype=float)), float(display.decode(values).mean())
        file = png_of(values) if number in lacking else None
        made.append(_Frame(values, file, light, shown, float(np.mean(share > 1))))
    return made


def _make_loop(
    folder: Folder,
    draw: Callable[[float], NDArray[np.float32]],
    count: int,
    display: Display,
    gradient: Gradient,
    white: float,
    frame_rate: float,
    executor: Executor | None,
    progress: Progress,
) -> dict[str, Any]:
    """Write the missing files of a condition; return the mean radiance of each frame, as computed and as displayed."""
    files = [f"{gradient}/{number:04}.png" for number in range(count)]
    lacking = frozenset(number for number, file in enumerate(files) if not folder.has(file))
    numbers = [range(first, min(first + BATCH_FRAMES, count)) for first in range(0, count, BATCH_FRAMES)]
    frames: list[_Frame] = []
    for made in in_order(executor, partial(_made, draw, count, display, white, lacking), numbers):
        written = {files[len(frames) + at]: one.png for at, one in enumerate(made) if one.png is not None}
        frames += [replace(one, png=None) for one in made]
        if written:
            folder.put(written)
        progress(0.9 * len(frames) / count, gradient)
    if not folder.has(f"{gradient}.mp4"):
        folder.put({f"{gradient}.mp4": _video(folder.path, [one.values for one in frames], frame_rate)})
    progress(1.0, gradient)
    return {
        "mean_light": [one.light for one in frames],
        "mean_light_shown": [one.shown for one in frames],
        "clipped": max(one.clipped for one in frames),
    }


def _video(folder: Path, pictures: Sequence[NDArray[np.uint8]], frame_rate: float) -> bytes:
    """Return a whole rotation as an MP4 file."""
    with staged(folder) as hidden:  # OpenCV only writes to a path
        path = save_movie([*pictures] * LOOPS_PER_TURN, hidden / "video.mp4", rate=frame_rate, lossless=False)
        return read_bytes(path, "a video")


def _departure(cube: NeckerCube, frames: int) -> dict[Reading, Any]:
    """Return the deformation of both interpretations over a rotation, and their directions of rotation."""
    turn = np.arange(LOOPS_PER_TURN * frames) / (LOOPS_PER_TURN * frames)
    stated: dict[Reading, Any] = {}
    readings: tuple[Reading, ...] = ("rigid", "nonrigid")
    for reading in readings:
        departure = departure_from_rigid(cube.seen(turn, reading))
        stated[reading] = {
            "direction": cube.direction_seen(reading),
            "whole": departure.whole,
            "by_frame": departure.by_frame[:frames].tolist(),
        }
    return stated


def _controls(conditions: dict[str, Any]) -> dict[str, Any]:
    """Return the differences in mean radiance between conditions, as computed and in 8 bits."""
    measured = {}
    for name in ("mean_light", "mean_light_shown"):
        light = np.array([condition[name] for condition in conditions.values()])
        worst = float(100 * (light.max(axis=0) / light.min(axis=0) - 1).max())
        measured[f"{name}_percent"] = {"worst": worst, "limit": LIGHT_PERCENT, "met": worst <= LIGHT_PERCENT}
    return measured


def _check(cube: NeckerCube, size: int, widest: float, pixel_angle: float, display: Display) -> None:
    """Validate the frame size: even, at most the display's, and large enough for the cube."""
    if not (isinstance(size, int) and size > 0 and size % 2 == 0):
        remedy = f": give {size + 1}" if isinstance(size, int) and size > 0 else ""
        raise InputError(f"size is {size!r}, but must be a positive even number of pixels{remedy}.")
    half = max(cube.extent) / pixel_angle + MARGIN_SD * max(widest, cube.line_width / pixel_angle / 2)
    needed = 2 * math.ceil(half)
    if needed > size:
        raise InputError(
            f"size is {size}, but the rotating cube with its blur fills {needed} pixels: use that size, or a "
            "smaller cube."
        )
    if size > min(display.size_px):
        width, height = display.size_px
        raise InputError(f"size is {size}, but the display has {width} x {height} pixels: use a smaller cube and size.")
