"""Encoding of the rotating cube (blur and depth of its lines), and the log odds of its two readings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import replace
from functools import lru_cache

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.design import Direction, Gradient, NeckerDesign, NeckerTrial
from focalgradient.observers.encoding import PUPIL, SHARP, EncodedStimulus
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import blur_amplitude, blur_depth, response
from focalgradient.observers.retinal_blur import LINE, estimate_blur, power_law, retinal_image
from focalgradient.parallel import in_order
from focalgradient.render import necker_frame
from focalgradient.scenes import NeckerCube, departure_from_rigid
from focalgradient.scenes.necker import EDGES, SYMMETRY

__all__ = ["Condition", "EncodedCubes", "cube_of", "encode_cube", "encoded_cubes", "log_odds"]

Condition = tuple[str, float, str]
"""Identifier of a condition: gradient, strength and direction."""

EncodedCubes = Mapping[Condition, EncodedStimulus]
"""Encoded stimulus of each condition."""

FRAMES = 3
"""Number of encoded frames within the quarter turn after which the picture repeats."""

PIXELS_PER_LINE = 1.6
"""Line width in pixels for the estimation of blur."""

SPACING = 24
"""Distance in pixels between the places at which blur is estimated."""

UNAMBIGUOUS = 4.0
"""Log odds of the correct reading in examples that are unambiguous."""


def encoded_cubes(design: NeckerDesign, executor: Executor | None = None) -> EncodedCubes:
    """Encode the cube of a design in all conditions, in parallel if there is an executor."""
    shown = {_condition(trial): trial for trial in design.trials("01") if trial.is_ambiguous}
    jobs = [(cube_of(design, trial.direction), trial.gradient, trial.strength) for trial in shown.values()]
    return dict(zip(shown, in_order(executor, _encode, jobs), strict=True))


def cube_of(design: NeckerDesign, direction: Direction) -> NeckerCube:
    """Return the cube of a design.

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


def _encode(job: tuple[NeckerCube, Gradient, float]) -> EncodedStimulus:
    return encode_cube(*job)


def encode_cube(cube: NeckerCube, gradient: Gradient, strength: float) -> EncodedStimulus:
    """Encode the rotating cube, blurred by an aperture of `strength` millimetres, at places on its lines.

    The depth is that of the rigid reading; in the nonrigid reading it is reversed.
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
        estimated = estimate_blur(seen, SPACING, law=power_law(LINE), edges=False)
        depth = _line_depth(cube, float(turn), pixel, estimated.log_blur.shape)
        valid = np.isfinite(depth) & np.isfinite(estimated.log_sd)
        blurs.append(np.degrees(60 * pixel) * np.exp(estimated.log_blur[valid]))
        depths.append(depth[valid])
    blur = np.concatenate(blurs)
    return EncodedStimulus(blur, float(np.percentile(blur, SHARP)), np.concatenate(depths))


def _line_depth(cube: NeckerCube, turn: float, pixel: float, shape: tuple[int, int]) -> FloatArray:
    """Return the mean depth of the true cube's lines at each place, in D beyond its centre; NaN without lines."""
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
    """Return the departure of the depth-reversed cube from rigidity over one turn."""
    return departure_from_rigid(cube.reversed(np.arange(360) / 360)).whole


def log_odds(design: NeckerDesign, trial: NeckerTrial, encoded: EncodedCubes, observer: Observer) -> float:
    """Return the log odds of the rigid reading, from the nonrigidity of the other reading and from depth order by blur.

    The depth of the lines is known except for its sign, which is the reading: amplitude A or -A. On the scale of
    `response`, where the error is 1, an amplitude b from blur has the log likelihood ratio 2 response(b) response(A).
    Nothing is discounted, as the layout specifies neither order. Errors at single places average out within a trial.
    """
    if not trial.is_ambiguous:
        return UNAMBIGUOUS if trial.shape == "rigid" else -UNAMBIGUOUS
    stimulus = encoded[_condition(trial)]
    along = blur_amplitude(blur_depth(stimulus, observer), stimulus.depth, replace(observer, discounting=0.0))
    blur = 2 * float(response(along, observer) * response(float(stimulus.depth.std()), observer))
    return observer.rigidity * _departure(cube_of(design, trial.direction)) + blur
