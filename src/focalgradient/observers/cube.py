"""What the frames of the rotating cube tell: how blurred its lines are, and where they are in the rigid reading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from focalgradient.design import Direction, Gradient, NeckerDesign, NeckerTrial
from focalgradient.observers.blur import LINE, read_blur, retinal_image
from focalgradient.observers.look import PUPIL, Look
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import agreement, blur_depth, certainty
from focalgradient.render import necker_frame
from focalgradient.scenes import NeckerCube, departure_from_rigid
from focalgradient.scenes.necker import EDGES, SYMMETRY

__all__ = ["Condition", "Cubes", "cube_of", "cubes", "log_odds", "look_at_cube"]

Condition = tuple[str, float, str]
"""Gradient, strength and direction."""

Cubes = Mapping[Condition, Look]
"""What is to be seen in each condition."""

FRAMES = 3
"""Moments looked at, of the quarter turn after which the picture repeats."""

PIXELS_PER_LINE = 1.6
"""Pixels to a line's width, which blur is read from."""

SPACING = 24
"""Pixels between the places at which blur is read."""

SHARP = 10
"""Percentile of the blur of all places that the eye takes for being in focus, wherever it looks."""

BEYOND_DOUBT = 4.0
"""Log odds for the one reading that an example has which can be seen in one way only."""


def cubes(design: NeckerDesign, executor: Executor | None = None) -> Cubes:
    """Look at the cube of a design in all its conditions, several at once where there is an executor."""
    shown = {_condition(trial): trial for trial in design.trials("01") if trial.shape == "ambiguous"}
    jobs = [(cube_of(design, trial.direction), trial.gradient, trial.strength) for trial in shown.values()]
    looked = map(_look, jobs) if executor is None else executor.map(_look, jobs)
    return dict(zip(shown, looked, strict=True))


def cube_of(design: NeckerDesign, direction: Direction) -> NeckerCube:
    """The cube of a design.

    >>> cube_of(NeckerDesign(), "left").distance
    0.5
    """
    return NeckerCube(
        size=math.radians(design.size_deg),
        perspective=design.perspective,
        distance=design.distance_m,
        tilt=math.radians(design.tilt_deg),
        direction=direction,
        speed=design.turns_per_s,
        line_width=math.radians(design.line_width_deg),
    )


def _condition(trial: NeckerTrial) -> Condition:
    return (trial.gradient, trial.strength, trial.direction)


def _look(job: tuple[NeckerCube, Gradient, float]) -> Look:
    return look_at_cube(*job)


def look_at_cube(cube: NeckerCube, gradient: Gradient, strength: float) -> Look:
    """Look at the turning cube, its lines blurred by an aperture of `strength` millimetres: places on its lines.

    The depth is that of the rigid reading; in the other it is the opposite.
    """
    pixel = cube.line_width / PIXELS_PER_LINE
    height, width = (2 * SPACING * math.ceil(1.05 * half / pixel / SPACING) for half in reversed(cube.extent))
    blurs, depths = [], []
    for turn in SYMMETRY * np.arange(FRAMES) / FRAMES:
        frame = necker_frame(
            cube,
            float(turn),
            shape=(height, width),
            pixel_angle=pixel,
            gradient=gradient,
            aperture=1e-3 * strength,
        )
        seen = retinal_image(frame, math.radians(1) / pixel, PUPIL)
        reading = read_blur(seen, SPACING, power=LINE, edges=False)
        depth = _line_depth(cube, float(turn), pixel, reading.log_blur.shape)
        told = np.isfinite(depth) & np.isfinite(reading.log_sd)
        blurs.append(np.degrees(60 * pixel) * np.exp(reading.log_blur[told]))
        depths.append(depth[told])
    blur = np.concatenate(blurs)
    return Look(blur, float(np.percentile(blur, SHARP)), np.concatenate(depths))


def _line_depth(cube: NeckerCube, turn: float, pixel: float, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Mean depth, in dioptres beyond the cube's centre, of the true cube's lines in each place; NaN without lines."""
    ends = cube.vertices(turn)[EDGES]
    share = np.linspace(0, 1, 200)[:, None, None]
    points = (ends[:, 0] + share * (ends[:, 1] - ends[:, 0])).reshape(-1, 3)
    middle = SPACING * np.array(shape[::-1]) / 2
    column, row = np.floor((cube.project(points) / pixel + middle) / SPACING).astype(np.intp).T
    place, count = row * shape[1] + column, shape[0] * shape[1]
    lines = np.bincount(place, minlength=count)
    total = np.bincount(place, 1 / cube.distance - 1 / points[:, 2], count)
    return np.where(lines > 0, total / np.maximum(lines, 1), np.nan).reshape(shape)


@lru_cache(maxsize=8)
def _departure(cube: NeckerCube) -> float:
    """How far the depth-reversed cube departs from rigid over a turn."""
    return departure_from_rigid(cube.reversed(np.arange(360) / 360)).whole


def log_odds(design: NeckerDesign, trial: NeckerTrial, seen: Cubes, observer: Observer) -> float:
    """Log odds of the rigid reading: what the other departs from rigid, and what blur says of the order in depth.

    In the depth-reversed reading all orders are reversed, so that what speaks for one speaks against the other. How
    loudly, is by how many standard deviations the depth by blur differs from none. A trial is long, and its lines are
    all alike: errors at single places average out.
    """
    if trial.shape != "ambiguous":
        return BEYOND_DOUBT if trial.shape == "rigid" else -BEYOND_DOUBT
    look = seen[_condition(trial)]
    blur = blur_depth(look, observer)
    rigidity = observer.rigidity * _departure(cube_of(design, trial.direction))
    return rigidity + agreement(blur, look.depth) * certainty(blur, observer)
