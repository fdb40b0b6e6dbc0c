"""Stimuli: a border between two textures, and an edge between two luminances, with given blur."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Literal

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.optics import Side
from focalgradient.psf import Psf
from focalgradient.psf.profile import edge_profile
from focalgradient.quantities import Range
from focalgradient.stimuli.layers import (
    blurred,
    coverage,
    fineness,
    noise,
    reach_of,
    same_spectrum,
)
from focalgradient.stimuli.stimulus import (
    Amount,
    Angle,
    Contrast,
    Degrees,
    Drawing,
    Luminance,
    Metres,
    Millimetres,
    Region,
    Resolution,
    Shape,
    Stimulus,
    depth_of_blur,
)

__all__ = ["blurred_edge", "texture_border"]

MAX_TEXTURE_SD = 5.0
"""Maximum value of a texture in standard deviations: sharp textures are clipped at 3, equalised ones may exceed
that."""

BORDER_PAPERS = "mather1996", "marshall1996", "mather2002"

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
"""Gauss-Legendre nodes (-1 to 1) and weights for averaging radiance over a pixel."""

MIN_COVERAGE = 1e-3
"""Coverage below which a surface's radiance is taken from the unblurred whole texture, as its weight is negligible."""


def texture_border(
    *,
    left_blur_arcmin: float = 0.0,
    right_blur_arcmin: float = 2.0,
    border_blur_arcmin: float | None = None,
    border: Literal["straight", "sinusoidal"] = "sinusoidal",
    near: Literal["left", "right"] | None = None,
    amplitude_deg: Degrees = 0.5,
    period_deg: Degrees = 2.0,
    phase_deg: Angle = 0.0,
    width_deg: Degrees = 8.0,
    height_deg: Degrees = 8.0,
    pixels_per_degree: Resolution = 32.0,
    mean: Luminance = 0.5,
    contrast: Contrast = 0.2,
    slope: Annotated[float, Amount("powers of spatial frequency", 0)] = 1.0,
    equalise: Sequence[str] = (),
    psf: Shape = "gaussian",
    focus_m: Metres = 0.57,
    pupil_mm: Millimetres = 4.0,
    seed: int = 0,
) -> Stimulus:
    """Draw a vertical border between two random textures; the blur of each side and of the border are parameters.

    The near side ends at the border; the far side continues behind it. Optically, the border has the blur of the near
    side, so it is a cue to depth order (Mather 1996; Marshall et al. 1996; Mather and Smith 2002).

    Parameters
    ----------
    left_blur_arcmin, right_blur_arcmin
        Blur of each texture: standard deviation along an axis, in arcmin.
    border_blur_arcmin
        Blur of the border; None: that of the near side, as optics predicts.
    border
        Shape of the border.
    near
        Near side; None: the side whose blur is closer to the border's, or left if the border's is not given.
    amplitude_deg, period_deg, phase_deg
        Sinusoidal border: half its peak-to-peak width and its period in degrees of visual angle, and its phase in
        degrees of its cycle.
    width_deg, height_deg, pixels_per_degree
        Size of the picture in degrees, and its resolution.
    mean, contrast
        Mean luminance as a fraction of white, and RMS contrast of the sharp textures.
    slope
        Exponent of the textures' amplitude spectrum, 1/f^slope.
    equalise
        Properties equalised between the sides: "luminance" (mean), "contrast" (RMS, to that of the sharp texture),
        "spectrum" (both textures get the amplitude spectrum of the more blurred one, so that only the border differs).
    psf
        Blur shape, such as ``focalgradient.psf.Polygon(blades=5)``, or its name.
    focus_m, pupil_mm
        Focus distance and pupil diameter of the eye, which relate blur to depth: near side nearer than focus, far side
        beyond.
    seed
        Random seed of the textures, which do not depend on blur.

    Returns
    -------
    Stimulus
        Stimulus with the masks "left" and "right".

    Raises
    ------
    InputError
        If a value is out of range.

    Examples
    --------
    >>> one = texture_border(right_blur_arcmin=4.0, border_blur_arcmin=0.0, width_deg=4, height_deg=4)
    >>> one.shape, one.controlled["near"], one.depth_m[0, [0, -1]].round(3).tolist()
    ((128, 128), 'left', [0.57, 1.693])
    """
    drawing = Drawing.begin(texture_border, locals(), *BORDER_PAPERS, peak=MAX_TEXTURE_SD)
    frame, shape, names = drawing.frame, drawing.psf, drawing.equalised
    sides = {"left": left_blur_arcmin, "right": right_blur_arcmin}
    blur = {side: frame.blur(f"{side}_blur_arcmin", arcmin) for side, arcmin in sides.items()}
    edge = None if border_blur_arcmin is None else frame.blur("border_blur_arcmin", border_blur_arcmin)
    if near is None:
        closer = edge is not None and abs(blur["right"] - edge) < abs(blur["left"] - edge)
        near = "right" if closer else "left"
    far = "left" if near == "right" else "right"
    if "spectrum" in names:
        sides = dict.fromkeys(sides, max(sides.values()))
    own_edge = edge is None
    edge = blur[near] if edge is None else edge

    pad = reach_of(max(blur[near], edge))
    height, width = frame.shape
    canvas, rim = (height + 2 * pad, width + 2 * pad), ((pad, pad), (pad, pad))
    inside = slice(pad, pad + height), slice(pad, pad + width)
    bend = amplitude_deg * pixels_per_degree if border == "sinusoidal" else 0.0
    angle = 2 * math.pi / (period_deg * pixels_per_degree) if bend else 0.0
    factor = fineness(edge)
    left = _left_of(canvas, factor, bend, angle, math.radians(phase_deg))
    whole = left.reshape(canvas[0], factor, canvas[1], factor).mean(axis=(1, 3))
    masks = {"left": whole[inside] >= 0.5, "right": whole[inside] < 0.5}
    kinds: dict[str, tuple[Psf, Side]] = {near: (shape, "nearer"), far: (shape, "beyond")}
    textures = {side: noise(frame.shape, [seed, number], slope) for number, side in enumerate(masks)}
    lights = {
        side: mean * (1 + contrast * _texture(texture, blur[side], max(blur.values()), kinds[side], names, masks[side]))
        for side, texture in textures.items()
    }
    covered = coverage(left if near == "left" else 1 - left, factor, edge, shape, "nearer")
    light = np.pad(lights[near], rim, mode="wrap")
    if own_edge and edge > 0 and not names:
        whole_near = np.pad(mean * (1 + contrast * textures[near]), rim, mode="wrap")
        light = _ending(whole_near, light, whole if near == "left" else 1 - whole, edge, shape)
    covered, whole = covered[inside], whole[inside]
    picture = np.clip(covered * light[inside] + (1 - covered) * lights[far], 0, 1)

    flat = {side: mean * (1 + contrast * texture) for side, texture in textures.items()}
    sharp = np.clip(whole * flat["left"] + (1 - whole) * flat["right"], 0, 1)
    depth = {side: depth_of_blur(sides[side], kinds[side][1], focus_m=focus_m, pupil_mm=pupil_mm) for side in sides}
    blur_map = np.where(masks["left"], sides["left"], sides["right"]).astype(float)
    at_border = maximum_filter(covered, 3) - minimum_filter(covered, 3) > 1e-4
    # Through the near side's blurred border shows the far side, at its own blur.
    allowed = np.where(at_border, min(edge, *blur.values()), blur_map * frame.pixels(1.0))
    return drawing.stimulus(
        picture=picture,
        sharp=sharp,
        depth=np.where(masks["left"], depth["left"], depth["right"]),
        blur=blur_map,
        masks=masks,
        allowed_px=allowed,
        near=near,
        occlusion_agrees_with_blur=edge == (max(blur.values()) if "spectrum" in names else blur[near]),
    )


def _texture(
    texture: FloatArray,
    sd: float,
    most: float,
    shape: tuple[Psf, Side],
    equalise: tuple[str, ...],
    own: Region,
) -> FloatArray:
    """Return a blurred texture in standard deviations of the sharp one, equalised over its own side as requested."""
    light = blurred(texture, sd, *shape)
    if "spectrum" in equalise:
        light = same_spectrum(light, blurred(texture, most, *shape))
    part = light[own]
    if "contrast" in equalise and part.std() > 0:
        light = part.mean() + (light - part.mean()) * (1.0 / part.std())
    if "luminance" in equalise:
        light = light - light[own].mean()
    if np.abs(light).max() > MAX_TEXTURE_SD:
        raise InputError(
            f"equalise takes the blurred texture to {np.abs(light).max():.3g} standard deviations of the sharp one, "
            f"but it may reach {MAX_TEXTURE_SD:g}: give less blur, or a larger picture."
        )
    return light


def _left_of(canvas: tuple[int, int], factor: int, bend: float, angle: float, phase: float) -> FloatArray:
    """Return the coverage left of the border, on a grid finer than the pixels by `factor`, exact along rows."""
    rows, columns = canvas
    y = (np.arange(rows * factor)[:, None] + 0.5 + NODES / 2) / factor - rows / 2
    place = bend * np.sin(angle * y + phase) + columns / 2
    x = np.arange(columns * factor)
    covered = np.zeros((rows * factor, columns * factor))
    for node, weight in enumerate(WEIGHTS / 2):
        covered += weight * np.clip(place[:, node, None] * factor - x, 0, 1)
    return covered


def _ending(texture: FloatArray, light: FloatArray, mask: FloatArray, sd: float, psf: Psf) -> FloatArray:
    """Return the near surface's radiance divided by its blurred coverage, as the surface ends at the border."""
    share = blurred(mask, sd, psf, "nearer")
    own = blurred(texture * mask, sd, psf, "nearer") / np.maximum(share, MIN_COVERAGE)
    return np.where(share > MIN_COVERAGE, np.clip(own, texture.min(), texture.max()), light)


def blurred_edge(
    *,
    pedestal_arcmin: float = 1.0,
    increment_arcmin: Annotated[float, Range("arcmin")] = 0.0,
    orientation_deg: Angle = 0.0,
    polarity: Literal["bright left", "bright right"] = "bright right",
    width_deg: Degrees = 4.0,
    height_deg: Degrees = 4.0,
    pixels_per_degree: Resolution = 60.0,
    mean: Luminance = 0.5,
    contrast: Contrast = 0.5,
    psf: Shape = "gaussian",
    focus_m: Metres = 0.57,
    pupil_mm: Millimetres = 4.0,
    side: Side = "beyond",
) -> Stimulus:
    """Draw a straight edge between two luminances with a pedestal blur and an increment (Watson and Ahumada 2011).

    The edge is analytic: the edge spread function of the blur, averaged over each pixel.

    Parameters
    ----------
    pedestal_arcmin, increment_arcmin
        The blur is pedestal + increment: standard deviation along an axis, in arcmin. The increment may be negative,
        down to minus the pedestal.
    orientation_deg
        Orientation of the edge from the vertical, clockwise.
    polarity
        Side that is bright.
    width_deg, height_deg, pixels_per_degree
        Size of the picture in degrees, and its resolution.
    mean, contrast
        Mean of the two luminances as a fraction of white, and their Michelson contrast.
    psf
        Blur shape, such as ``focalgradient.psf.Polygon(blades=5)``, or its name.
    focus_m, pupil_mm
        Focus distance and pupil diameter of the eye, which relate blur to depth.
    side
        Side of focus on which that depth lies: "beyond", where blur has an upper limit, or "nearer".

    Returns
    -------
    Stimulus
        Stimulus with the masks "bright" and "dark".

    Raises
    ------
    InputError
        If a value is out of range.

    Examples
    --------
    The steepest step as a fraction of the whole: 1 / (sd sqrt(2 pi)).

    >>> edge = blurred_edge(pedestal_arcmin=4, increment_arcmin=1, contrast=0.4)
    >>> round(float(np.diff(edge.picture[0]).max() / 0.4 * 5 * np.sqrt(2 * np.pi)), 3)
    0.997
    """
    drawing = Drawing.begin(blurred_edge, locals(), "watson2011", peak=1.0)
    frame, shape = drawing.frame, drawing.psf
    frame.blur("pedestal_arcmin", pedestal_arcmin)
    if increment_arcmin < -pedestal_arcmin:
        raise InputError(
            f"increment_arcmin is {increment_arcmin:g}, but the pedestal is {pedestal_arcmin:g}: give an increment of "
            f"{-pedestal_arcmin:g} or more."
        )
    arcmin = pedestal_arcmin + increment_arcmin
    sd = frame.blur("pedestal_arcmin + increment_arcmin", arcmin)
    turned = math.radians(orientation_deg)
    normal = math.cos(turned), math.sin(turned)
    sign = 1 if polarity == "bright right" else -1
    # Nearer than focus, the shape is rotated by 180 degrees.
    rising = turned + math.pi * ((sign < 0) != (side == "nearer"))
    profile = edge_profile(shape, rising)
    rows, columns = frame.grid()
    place = sign * (columns * normal[0] + rows * normal[1])
    share, sharp = (
        _edge(place, (sign * normal[1], sign * normal[0]), radius, profile)
        for radius in (float(shape.radius_of(sd)), 0.0)
    )
    low, high = mean * (1 - contrast), mean * (1 + contrast)
    picture, sharp = (low + (high - low) * part for part in (share, sharp))
    return drawing.stimulus(
        picture=picture,
        sharp=sharp,
        depth=np.full(frame.shape, depth_of_blur(arcmin, side, focus_m=focus_m, pupil_mm=pupil_mm)),
        blur=np.full(frame.shape, arcmin, float),
        masks={"bright": place > 0, "dark": place <= 0},
        blur_arcmin=arcmin,
    )


def _edge(
    place: FloatArray,
    normal: tuple[float, float],
    radius: float,
    profile: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Return the bright fraction of each pixel, centred `place` px beyond an edge with unit `normal` (y, x)."""
    share = np.zeros(place.shape)
    for dy, wy in zip(NODES / 2, WEIGHTS / 2, strict=True):
        if radius == 0:  # exact along a row: its length beyond the edge
            along = abs(normal[1])
            at = place + dy * normal[0]
            share += wy * (np.clip(at / along + 0.5, 0, 1) if along > 1e-9 else (at > 0) + 0.5 * (at == 0))
            continue
        for dx, wx in zip(NODES / 2, WEIGHTS / 2, strict=True):
            share += wy * wx * profile((place + dy * normal[0] + dx * normal[1]) / radius)
    return share
