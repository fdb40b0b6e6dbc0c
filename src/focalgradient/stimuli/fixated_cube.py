"""The Necker cube as seen by an eye that fixates one of its vertices or its centre."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Annotated, Literal

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.psf import DISC_K, Gaussian
from focalgradient.render import necker_frame
from focalgradient.render.wireframe import WIDTH, Gradient, blur_at
from focalgradient.scenes import NeckerCube
from focalgradient.scenes.necker import EDGES, Direction
from focalgradient.stimuli.stimulus import (
    ARCMIN,
    Amount,
    Angle,
    Degrees,
    Drawing,
    Frame,
    Luminance,
    Metres,
    Millimetres,
    Resolution,
    Stimulus,
)

__all__ = ["fixated_cube"]

MARK_DEG = 0.15
"""Radius in degrees of the mask around the fixation point."""


def fixated_cube(
    *,
    fixation: Literal["nearest", "farthest", "centre"] = "nearest",
    gradient: Gradient = "rigid",
    turn: Annotated[float, Amount("turns")] = 0.08,
    edge_deg: Degrees = 8.0,
    perspective: Annotated[float, Amount("edge length / distance", positive=True)] = 0.4,
    distance_m: Metres = 0.5,
    tilt_deg: Angle = 20.0,
    direction: Direction = "right",
    line_arcmin: Annotated[float, Amount("arcmin", positive=True)] = 4.0,
    line_light: Luminance = 0.45,
    width_deg: Degrees = 16.0,
    height_deg: Degrees = 16.0,
    pixels_per_degree: Resolution = 30.0,
    pupil_mm: Millimetres = 12.0,
) -> Stimulus:
    """Draw one frame of the rotating Necker cube, in focus at the fixation point.

    Lines have the same positions and the same energy for every gradient and fixation.

    Parameters
    ----------
    fixation
        Point in focus: the nearest or farthest vertex in the interpretation that the gradient supports, or the distance
        of the cube's centre.
    gradient
        Shape whose depth determines the blur: "rigid", the cube; "nonrigid", the depth-reversed shape; or "none".
    turn
        Rotation angle in turns.
    edge_deg, perspective, distance_m, tilt_deg, direction, line_arcmin
        Parameters of the cube: angle of an edge, edge / distance, distance of its centre, tilt of its axis, direction
        in which its near side moves, and full width at half maximum of a sharp line.
    line_light
        Radiance of a sharp line as a fraction of white; where lines meet it adds.
    width_deg, height_deg, pixels_per_degree
        Size of the picture in degrees, and its resolution.
    pupil_mm
        Strength of the gradient: diameter of a pupil at the viewer's position.

    Returns
    -------
    Stimulus
        `depth_m` is the depth of the interpretation that the gradient supports (the cube's for "none") on the lines,
        NaN elsewhere; with the masks "lines" and "fixation".

    Raises
    ------
    InputError
        If a value is out of range, or the cube does not fit into the picture.

    Examples
    --------
    >>> one = fixated_cube(fixation="farthest")
    >>> round(float(one.blur_arcmin[one.masks["fixation"] & one.masks["lines"]].min()), 1)
    0.0
    """
    drawing = replace(Drawing.begin(fixated_cube, locals(), "pastukhov"), psf=Gaussian(), equalised=("luminance",))
    frame = drawing.frame
    cube = NeckerCube(
        size=math.radians(edge_deg),
        perspective=perspective,
        distance=distance_m,
        tilt=math.radians(tilt_deg),
        direction=direction,
        line_width=math.radians(line_arcmin / 60),
    )
    reading = cube.seen(turn, "nonrigid" if gradient == "nonrigid" else "rigid")[:, 2]
    at = {"nearest": int(reading.argmin()), "farthest": int(reading.argmax())}.get(fixation)
    focus_m = distance_m if at is None else float(reading[at])
    pixel = frame.pixel_angle
    size = np.array(frame.shape[::-1])
    vertices = cube.project(cube.vertices(turn)) / pixel + (size - 1) / 2
    if (vertices < 0).any() or (vertices > size - 1).any():
        raise InputError(
            f"edge_deg is {edge_deg:g}, with which the cube leaves the picture: give a smaller one, or a larger "
            "width_deg and height_deg."
        )
    draw = partial(necker_frame, cube, turn, shape=frame.shape, pixel_angle=pixel)
    sharp = line_light * draw().astype(float)
    picture = line_light * draw(gradient=gradient, aperture=pupil_mm / 1000, focus=1 / focus_m).astype(float)
    if sharp.max() > 1:
        raise InputError(
            f"line_light is {line_light:g}, with which radiance reaches {sharp.max():.3g} where lines meet, but white "
            f"is 1: give at most {math.floor(100 * line_light / sharp.max()) / 100:g}."
        )
    away, depth = _nearest_line(vertices, reading, frame)
    blur = np.abs(blur_at(cube, depth, aperture=pupil_mm / 1000, focus=1 / focus_m, k=DISC_K)) / ARCMIN
    blur = np.zeros(frame.shape) if gradient == "none" else blur
    lines = away <= max(1.0, frame.pixels(line_arcmin) / 2)
    down, right = frame.grid()
    # The centre of the cube lies on the axis, which the mean of its projected vertices misses.
    middle = np.zeros(2) if at is None else vertices[at] - (size - 1) / 2
    mark = np.hypot(right - middle[0], down - middle[1]) <= MARK_DEG * pixels_per_degree
    line_sd = frame.pixels(line_arcmin) / WIDTH  # standard deviation of a sharp line
    return drawing.stimulus(
        picture=picture,
        sharp=sharp,
        depth=np.where(lines, depth, np.nan),
        blur=blur,
        masks={"lines": lines, "fixation": mark},
        allowed_px=np.hypot(frame.pixels(1.0) * blur, line_sd),
        lines=True,
        light_percent=100 * (float(picture.sum() / sharp.sum()) - 1),
        focus_m=focus_m,
        fixation_px=[float(place) for place in middle + size / 2],
        blur_agrees_with_depth=gradient == "rigid",
    )


def _nearest_line(vertices: FloatArray, depth: FloatArray, frame: Frame) -> tuple[FloatArray, FloatArray]:
    """Return, per pixel, the distance to the nearest line (px) and that line's depth; the nearer line at crossings."""
    rows, columns = frame.shape
    y, x = np.arange(rows)[:, None], np.arange(columns)[None]
    away, found = np.full(frame.shape, np.inf), np.zeros(frame.shape)
    order = np.argsort([-depth[edge].mean() for edge in EDGES])  # farthest first
    for start, end in EDGES[order]:
        first, way = vertices[start], vertices[end] - vertices[start]
        part = np.clip(((x - first[0]) * way[0] + (y - first[1]) * way[1]) / max(float(way @ way), 1e-12), 0, 1)
        distance = np.hypot(x - first[0] - part * way[0], y - first[1] - part * way[1])
        # In perspective the vergence of a straight edge is linear along its image.
        metres = 1 / (1 / depth[start] + part * (1 / depth[end] - 1 / depth[start]))
        closer = distance < away + 0.5
        away, found = np.where(closer, np.minimum(distance, away), away), np.where(closer, metres, found)
    return away, found
