"""Stimuli of surfaces seen through a lens: slanted and corrugated planes, and scenes with miniature blur."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_arguments, check_finite, check_seed
from focalgradient.optics import Aperture, Optics, check_optics
from focalgradient.render import blur_picture
from focalgradient.render.blurred import checked_picture
from focalgradient.scenes.fractal import fractal
from focalgradient.stimuli.layers import CLIP, equalised, standard
from focalgradient.stimuli.stimulus import (
    ARCMIN,
    Amount,
    Angle,
    Contrast,
    Degrees,
    Drawing,
    Frame,
    Luminance,
    Metres,
    Millimetres,
    Resolution,
    Stimulus,
)
from focalgradient.stimuli.town import draw_town

__all__ = ["corrugated_plane", "miniature", "slanted_plane"]

Texturing = Literal["painted", "projected"]
"""Texture attached to the surface ("painted"), or projected from the eye, with equal angular scale everywhere."""

Distance = Callable[[FloatArray, FloatArray], FloatArray]
"""Function that returns a surface's distance in metres from the tangents down (H x 1) and right (1 x W)."""

COARSEST_DEG = 1.0
"""Angular wavelength (degrees) of the coarsest texture where the axis meets the surface (a design choice)."""

ROUGHNESS = 0.9
"""Amplitude ratio of successive octaves of texture: close to the 1/f of natural images."""

SAMPLES = 3
"""Samples per side of a pixel over which texture is averaged: supports foreshortening by this factor."""

FINEST_WAVELENGTH_PX = 2.0
"""Finest wavelength of a texture in pixels; finer ones would alias."""


def slanted_plane(
    *,
    slant_deg: Annotated[float, Amount("degrees", 0)] = 60.0,
    tilt_deg: Angle = 90.0,
    distance_m: Metres = 0.57,
    texture: Texturing = "projected",
    width_deg: Degrees = 12.0,
    height_deg: Degrees = 12.0,
    pixels_per_degree: Resolution = 32.0,
    mean: Luminance = 0.5,
    contrast: Contrast = 0.25,
    equalise: Sequence[str] = (),
    focus_m: Metres | None = None,
    pupil_mm: Millimetres = 6.0,
    optics: Optics | None = None,
    seed: int = 0,
) -> Stimulus:
    """Draw a slanted textured plane through a lens: its vergence, hence its blur, is linear in the picture.

    Watt et al. (2005) measured perceived slant of such planes, Vishwanath and Blaser (2010) perceived distance.

    Parameters
    ----------
    slant_deg
        Angle between the plane's normal and the line of sight; 0 is frontal.
    tilt_deg
        Direction in which distance increases: 0 to the right, 90 upwards, as on the ground.
    distance_m
        Distance at which the axis meets the plane.
    texture
        "projected", equally fine everywhere, so that only blur indicates slant; or "painted" on the plane.
    width_deg, height_deg, pixels_per_degree
        Size of the picture in degrees, and its resolution.
    mean, contrast
        Mean luminance as a fraction of white, and RMS contrast without blur.
    equalise
        Properties equalised to those without blur: "luminance" (mean), "contrast" (RMS), "spectrum" (amplitude
        spectrum; phases are kept).
    focus_m, pupil_mm
        Focus distance (None: `distance_m`), and pupil diameter.
    optics
        A `Lens` or an `Eye` instead of these two.
    seed
        Random seed of the texture, which does not depend on blur.

    Returns
    -------
    Stimulus
        Stimulus blurred by a disc, or by the optics' own blur; without masks.

    Raises
    ------
    InputError
        If a value is out of range, or the picture contains the plane's horizon.

    Examples
    --------
    >>> one = slanted_plane(slant_deg=60, distance_m=0.5, width_deg=4, height_deg=4)
    >>> one.depth_m[[0, -1], 64].round(3).tolist(), one.blur_arcmin[[0, -1], 64].round(3).tolist()
    ([0.532, 0.472], [0.619, 0.619])
    """
    drawing = Drawing.begin(slanted_plane, locals(), "watt2005", "vishwanath2010", peak=CLIP + 0.5)
    if slant_deg >= 90:
        raise InputError(f"slant_deg is {slant_deg:g}, but must be below 90: a plane of 90 degrees is seen edge-on.")
    slope, tilt = math.tan(math.radians(slant_deg)), math.radians(tilt_deg)

    def depth(down: FloatArray, right: FloatArray) -> FloatArray:
        rest = 1 - slope * (right * math.cos(tilt) - down * math.sin(tilt))
        if rest.min() <= 1e-6:
            raise InputError(
                f"slant_deg is {slant_deg:g}, with which the plane's horizon lies in the picture or its blur: give "
                "less slant, or a smaller picture."
            )
        return distance_m / rest

    return _surface(drawing, depth)


def corrugated_plane(
    *,
    amplitude_m: Annotated[float, Amount("metres", 0)] = 0.1,
    cycles_per_degree: Annotated[float, Amount("cycles per degree", positive=True)] = 0.25,
    orientation_deg: Angle = 0.0,
    phase_deg: Angle = 0.0,
    distance_m: Metres = 0.57,
    texture: Texturing = "projected",
    width_deg: Degrees = 8.0,
    height_deg: Degrees = 8.0,
    pixels_per_degree: Resolution = 32.0,
    mean: Luminance = 0.5,
    contrast: Contrast = 0.25,
    equalise: Sequence[str] = (),
    focus_m: Metres | None = None,
    pupil_mm: Millimetres = 6.0,
    optics: Optics | None = None,
    seed: int = 0,
) -> Stimulus:
    """Draw a frontal plane with sinusoidal corrugation in depth, through a lens; blur may be the only cue to relief.

    Distance is sinusoidal in the picture, as in the surfaces of Rogers and Graham (1982).

    Parameters
    ----------
    amplitude_m
        Amplitude of the corrugation: half the depth from crest to trough.
    cycles_per_degree
        Spatial frequency of the corrugation in the picture.
    orientation_deg
        Orientation of the ridges: 0 is horizontal, 90 vertical.
    phase_deg
        Phase at the centre of the picture; at 0, distance increases downwards (to the right, if vertical).
    distance_m
        Mean distance in metres.
    texture
        "projected", equally fine everywhere, so that only blur indicates relief; or "painted" on the surface.
    width_deg, height_deg, pixels_per_degree
        Size of the picture in degrees, and its resolution.
    mean, contrast
        Mean luminance as a fraction of white, and RMS contrast without blur.
    equalise
        Properties equalised to those without blur: "luminance" (mean), "contrast" (RMS), "spectrum" (amplitude
        spectrum; phases are kept).
    focus_m, pupil_mm
        Focus distance (None: `distance_m`), and pupil diameter.
    optics
        A `Lens` or an `Eye` instead of these two.
    seed
        Random seed of the texture, which does not depend on blur.

    Returns
    -------
    Stimulus
        Stimulus with the masks "near" and "far", relative to the mean distance.

    Raises
    ------
    InputError
        If a value is out of range.

    Examples
    --------
    >>> one = corrugated_plane(amplitude_m=0.1, distance_m=0.5, width_deg=4, height_deg=4, phase_deg=90)
    >>> round(float(one.depth_m.max()), 3)
    0.6
    """
    drawing = Drawing.begin(corrugated_plane, locals(), "rogers1982", peak=CLIP + 0.5)
    if amplitude_m >= 0.9 * distance_m:
        raise InputError(f"amplitude_m is {amplitude_m:g}, but must be below 0.9 of distance_m, {distance_m:g}.")
    turn = math.radians(orientation_deg)

    def depth(down: FloatArray, right: FloatArray) -> FloatArray:
        degrees = np.degrees(down * math.cos(turn) + right * math.sin(turn))
        wave = np.sin(2 * math.pi * cycles_per_degree * degrees + math.radians(phase_deg))
        return distance_m + amplitude_m * wave

    return _surface(drawing, depth, between=distance_m)


def _surface(drawing: Drawing, depth: Distance, between: float | None = None) -> Stimulus:
    """Return a textured surface, whose distance is a function of the tangents down and right, through the optics."""
    frame, parameters = drawing.frame, drawing.parameters
    mean, contrast, distance_m = (parameters[key] for key in ("mean", "contrast", "distance_m"))
    focus_m = distance_m if parameters["focus_m"] is None else parameters["focus_m"]
    optics = Aperture(parameters["pupil_mm"] / 1000, 1 / focus_m)
    if parameters["optics"] is not None:
        check_optics(optics := parameters["optics"])
    down, right = (frame.pixel_angle * axis for axis in frame.grid())
    metres = depth(down, right)
    widest = _widest(optics, metres, frame, "", "a smaller pupil, less depth, or a larger picture")
    rim = math.ceil(1.5 * widest) + 4  # margin whose pixels are blurred into the picture
    height, width = frame.shape
    down, right = (frame.pixel_angle * axis for axis in frame.grid(rim))
    metres = depth(down, right)
    inside = slice(rim, rim + height), slice(rim, rim + width)

    def wall(down: FloatArray, right: FloatArray) -> FloatArray:
        return np.full(np.broadcast(down, right).shape, distance_m)

    on = depth if parameters["texture"] == "painted" else wall
    light = _texture(on, down, right, frame.pixel_angle, distance_m, parameters["seed"])
    light = mean * (1 + contrast * np.clip(standard(light, inside), -CLIP, CLIP))
    sharp = light[inside]
    blurred = np.asarray(blur_picture(light, metres, optics, pixel_angle=frame.pixel_angle), float)[inside]
    shown = equalised(np.clip(blurred, 0, 1), sharp, drawing.equalised, mean)
    metres = metres[inside]
    masks = {} if between is None else {"near": metres < between, "far": metres >= between}
    blur = _blur_map(optics, metres)
    return drawing.stimulus(picture=shown, sharp=sharp, depth=metres, blur=blur, masks=masks)


def _blur_map(optics: Optics, metres: FloatArray) -> FloatArray:
    """Return the standard deviation of the blur in arcmin: half the disc's radius."""
    return optics.aperture_diameter / 4 * np.abs(optics.focus_vergence - 1 / metres) / ARCMIN


def _widest(optics: Optics, metres: FloatArray, frame: Frame, cause: str, remedy: str) -> float:
    """Return the largest blur radius in pixels; raise `InputError` if it exceeds a quarter of the picture."""
    widest = 2 * float(_blur_map(optics, metres).max()) * ARCMIN / frame.pixel_angle
    if widest > max(frame.shape) / 4:
        raise InputError(
            f"{cause}blur has a radius of {widest:.3g} pixels, but the picture {frame.shape[1]} x {frame.shape[0]}: "
            f"give {remedy}."
        )
    return widest


def _texture(
    depth: Distance, down: FloatArray, right: FloatArray, pixel: float, distance_m: float, seed: int
) -> FloatArray:
    """Return fractal texture of a surface with detail down to the pixel size, averaged over each pixel."""
    total = np.zeros(np.broadcast(down, right).shape)
    offsets = (np.arange(SAMPLES) - (SAMPLES - 1) / 2) * pixel / SAMPLES
    for dy in offsets:
        for dx in offsets:
            y, x = down + dy, right + dx
            metres = depth(y, x)
            points = np.stack([metres * x, metres * y, metres], axis=-1)
            steps = [np.linalg.norm(np.gradient(points, axis=axis), axis=-1) for axis in (0, 1)]
            finest = FINEST_WAVELENGTH_PX * np.maximum(np.minimum(*steps), np.maximum(*steps) / SAMPLES)
            coarsest = max(math.radians(COARSEST_DEG) * distance_m, float(finest.min()))
            total += fractal(points, seed, coarsest=coarsest, finest=finest, roughness=ROUGHNESS)
    return total


def miniature(
    *,
    simulated_distance_m: Metres = 0.15,
    true_distance_m: Metres = 100.0,
    gradient: Literal["consistent", "vertical", "horizontal"] = "consistent",
    picture: ArrayLike | None = None,
    depth_m: ArrayLike | None = None,
    width_deg: Degrees = 28.0,
    height_deg: Degrees = 20.0,
    pixels_per_degree: Resolution = 20.0,
    equalise: Sequence[str] = (),
    pupil_mm: Millimetres = 4.6,
    seed: int = 0,
) -> Stimulus:
    """Blur a large scene as an eye would blur a small model of it (Held et al. 2010; Vishwanath and Blaser 2010).

    A model that is s times smaller and nearer gives the same picture, but s times the depth in dioptres. In the control
    conditions a planar gradient has as much blur, but is inconsistent with the scene's depth.

    Parameters
    ----------
    simulated_distance_m
        Focus distance that the blur simulates.
    true_distance_m
        Distance of the scene's point in focus, at the centre of the picture.
    gradient
        "consistent": blur by the scene's depth. "vertical" or "horizontal": control with a plane whose vergence is
        linear down or across the picture, between the scene's extremes, in focus at the vergence of the scene's centre.
    picture, depth_m
        Custom scene: sharp linear luminance from 0 to 1, and distances in metres, H x W each, with even sides, for a
        picture of `width_deg`. None: a town, drawn from the seed, with its centre at `true_distance_m`.
    width_deg, height_deg, pixels_per_degree
        Size of the picture in degrees, and its resolution; for a custom scene only the width is used.
    equalise
        Properties equalised to those without blur: "luminance" (mean), "contrast" (RMS), "spectrum" (amplitude
        spectrum; phases are kept).
    pupil_mm
        Pupil diameter of the eye.
    seed
        Random seed of the town.

    Returns
    -------
    Stimulus
        `depth_m` is that of the true scene; `controlled` states the scale, the aperture that would blur the true scene
        equally (pupil x scale), and whether blur is consistent with depth.

    Raises
    ------
    InputError
        If a value is out of range.

    Examples
    --------
    >>> one = miniature(simulated_distance_m=0.2, width_deg=8, height_deg=6)
    >>> one.shape, round(one.controlled["aperture_m"], 2)
    ((120, 160), 2.3)
    """
    check_arguments(miniature, given := dict(locals()))
    check_seed(seed)
    if (picture is None) != (depth_m is None):
        raise InputError(
            "only one of picture and depth_m is given, but they must be given together: give both, or neither for a "
            "town."
        )
    if picture is None or depth_m is None:
        frame = Frame(width_deg, height_deg, pixels_per_degree)
        tangent = frame.shape[1] * frame.pixel_angle
        sharp, relative = draw_town(frame.shape, tangent, seed)
        metres = true_distance_m * relative / relative[frame.shape[0] // 2, frame.shape[1] // 2]
    else:
        sharp = check_finite("picture", picture, "shares of white")
        _, metres = checked_picture(sharp, depth_m, ("picture", "depth_m"))
        if sharp.ndim != 2 or sharp.shape[0] % 2 or sharp.shape[1] % 2 or sharp.min() < 0 or sharp.max() > 1:
            raise InputError(
                f"picture has shape {sharp.shape} and values from {sharp.min():g} to {sharp.max():g}, but must be "
                "H x W with even sides, and luminance from 0 to 1: crop or scale it."
            )
        frame = Frame(width_deg, width_deg * sharp.shape[0] / sharp.shape[1], sharp.shape[1] / width_deg)
    drawing = Drawing.begin(miniature, given, "held2010", "vishwanath2010", frame=frame)
    for name in ("picture", "depth_m"):
        del drawing.parameters[name]
    scale = true_distance_m / simulated_distance_m
    optics = Aperture(pupil_mm / 1000 * scale, 1 / true_distance_m)
    shown_at = metres
    if gradient != "consistent":
        vergence, axis = 1 / metres, 0 if gradient == "vertical" else 1
        along = vergence.mean(axis=1 - axis)
        first, last = sorted((float(vergence.min()), float(vergence.max())), reverse=bool(along[-1] < along[0]))
        plane = np.expand_dims(np.linspace(first, last, frame.shape[axis]), 1 - axis)
        shown_at = 1 / np.maximum(np.broadcast_to(plane, frame.shape), 1e-12)
    cause = f"simulated_distance_m is {simulated_distance_m:g}, with which "
    _widest(optics, shown_at, frame, cause, "a larger distance or a smaller pupil_mm")
    blurred = np.asarray(blur_picture(sharp, shown_at, optics, pixel_angle=frame.pixel_angle), float)
    return drawing.stimulus(
        picture=equalised(np.clip(blurred, 0, 1), sharp, drawing.equalised, float(sharp.mean())),
        sharp=sharp,
        depth=metres,
        blur=_blur_map(optics, shown_at),
        masks={},
        scale=scale,
        aperture_m=optics.aperture_diameter,
        blur_agrees_with_depth=gradient == "consistent",
    )
