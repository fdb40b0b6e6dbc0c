"""Wide-field dead leaves with blur in an annulus at one eccentricity, increased in one quadrant."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_arguments
from focalgradient.optics import Side
from focalgradient.stimuli.layers import blurred, reach_of
from focalgradient.stimuli.leaves import dead_leaves
from focalgradient.stimuli.stimulus import (
    Amount,
    Contrast,
    Degrees,
    Drawing,
    Frame,
    Luminance,
    Metres,
    Millimetres,
    Resolution,
    Shape,
    Stimulus,
    depth_of_blur,
)

__all__ = ["wide_field"]

Quadrant = Literal["upper right", "upper left", "lower left", "lower right"]
QUADRANTS = {"upper right": (-1, 1), "upper left": (-1, -1), "lower left": (1, -1), "lower right": (1, 1)}
"""Signs of the quadrant's directions: down and right."""

ANNULUS_DEG = 4.0
"""Default width of the annulus: annuli at 0, 4, 8 and 12 degrees then adjoin (a design choice)."""


def wide_field(
    *,
    eccentricity_deg: Annotated[float, Amount("degrees", 0)] = 8.0,
    pedestal_arcmin: float = 4.0,
    increment_arcmin: float = 4.0,
    quadrant: Quadrant = "upper right",
    annulus_deg: Degrees = ANNULUS_DEG,
    transition_deg: Degrees = 0.5,
    window_deg: Annotated[float, Amount("degrees on a flat screen", most=120, positive=True)] = 46.0,
    smallest_deg: Degrees = 0.4,
    largest_deg: Degrees = 4.0,
    pixels_per_degree: Resolution = 16.0,
    mean: Luminance = 0.5,
    contrast: Contrast = 0.5,
    psf: Shape = "gaussian",
    focus_m: Metres = 0.4,
    pupil_mm: Millimetres = 6.0,
    side: Side = "beyond",
    seed: int = 0,
) -> Stimulus:
    """Draw a wide field of dead leaves, blurred in an annulus, with an increment in one quadrant (Maiello et al. 2017).

    The picture is for a flat screen: eccentricity is the arc tangent of the distance from its centre, and blur is
    specified in visual angle at the annulus, where a pixel subtends less than at the centre.

    Parameters
    ----------
    eccentricity_deg
        Radius of the centre line of the annulus, 0 to 12 degrees in the paper; 0 gives a disc.
    pedestal_arcmin, increment_arcmin
        Blur of the annulus, and its increment in one quadrant: standard deviation along an axis, in arcmin.
    quadrant
        Quadrant with the increment.
    annulus_deg
        Width of the annulus, or diameter of the disc.
    transition_deg
        Width of the raised-cosine transition between blurs, which avoids visible borders.
    window_deg
        Diameter of the circular window; the picture is uniform outside.
    smallest_deg, largest_deg
        Range of the leaves' radii r, distributed as 1 / r^3.
    pixels_per_degree
        Resolution at the centre of the picture.
    mean, contrast
        Mean (as a fraction of white) and standard deviation / mean of the leaves' luminances.
    psf
        Blur shape, such as ``focalgradient.psf.Polygon(blades=5)``, or its name.
    focus_m, pupil_mm
        Focus distance and pupil diameter of the eye, which relate blur to depth.
    side
        Side of focus on which that depth lies: "beyond", where blur has an upper limit, or "nearer".
    seed
        Random seed of the leaves, which do not depend on blur.

    Returns
    -------
    Stimulus
        Stimulus with the masks "window", "annulus" and "target" (the quadrant of the annulus with the increment).

    Raises
    ------
    InputError
        If a value is out of range.

    Examples
    --------
    >>> one = wide_field(eccentricity_deg=4, window_deg=14, pixels_per_degree=12)
    >>> one.shape, round(float(one.masks["target"].sum() / one.masks["annulus"].sum()), 2)
    ((168, 168), 0.25)
    """
    check_arguments(wide_field, given := dict(locals()))
    flat = 2 * math.degrees(math.tan(math.radians(window_deg / 2)))  # in degrees at the central resolution
    frame = Frame(flat, flat, pixels_per_degree)
    drawing = Drawing.begin(wide_field, given, "maiello2017", frame=frame)
    if eccentricity_deg + annulus_deg / 2 + transition_deg > window_deg / 2:
        raise InputError(
            f"eccentricity_deg is {eccentricity_deg:g}, with which the annulus leaves the window of {window_deg:g} "
            "degrees: give a smaller one, or a larger window_deg."
        )
    frame.blur("pedestal_arcmin", pedestal_arcmin)
    cosine = math.cos(math.radians(eccentricity_deg))
    stretch = cosine**-1.5  # relative to the centre, a pixel subtends cos^2 radially and cos tangentially
    blurs = [float(pedestal_arcmin), float(pedestal_arcmin) + float(increment_arcmin)]
    frame.blur("increment_arcmin", increment_arcmin)
    sds = [stretch * frame.blur("pedestal_arcmin + increment_arcmin", blur) for blur in blurs]
    depths = depth_of_blur([0.0, *blurs], side, focus_m=focus_m, pupil_mm=pupil_mm)
    shared = ("smallest_deg", "largest_deg", "pixels_per_degree", "mean", "contrast", "focus_m", "pupil_mm", "seed")
    look: dict[str, Any] = {name: given[name] for name in shared}
    leaves = dead_leaves(blurs_arcmin=(0.0,), width_deg=flat, height_deg=flat, **look).picture
    down, right = frame.grid()
    scale = frame.pixel_angle
    far = np.degrees(np.arctan(np.hypot(down, right) * scale))
    window = _ramp(window_deg / 2 - transition_deg / 2 - far, transition_deg)
    outer = _ramp(eccentricity_deg + annulus_deg / 2 - far, transition_deg)
    inner = _ramp(far - (eccentricity_deg - annulus_deg / 2), transition_deg) if eccentricity_deg > 0 else 1.0
    annulus = outer * inner
    signs = QUADRANTS[quadrant]
    quarter = _ramp(signs[0] * np.degrees(np.arctan(down * scale)), transition_deg) * _ramp(
        signs[1] * np.degrees(np.arctan(right * scale)), transition_deg
    )
    pad = reach_of(max(sds))
    wide = np.pad(leaves, pad, mode="symmetric")
    inside = slice(pad, pad + frame.shape[0]), slice(pad, pad + frame.shape[1])
    low, high = (blurred(wide, sd, drawing.psf, side)[inside] for sd in sds)
    mixed = (1 - annulus) * leaves + annulus * ((1 - quarter) * low + quarter * high)
    picture = np.clip(mean + window * (mixed - mean), 0, 1)
    ring = annulus >= 0.5
    target = ring & (quarter >= 0.5)
    number = ring.astype(int) + target
    # Where two blurs are mixed, the sharper one limits the gradient.
    least = np.where(annulus > 1 - 1e-9, np.where(quarter > 1 - 1e-9, sds[1], sds[0]), 0.0)
    return drawing.stimulus(
        picture=picture,
        sharp=np.clip(mean + window * (leaves - mean), 0, 1),
        depth=depths[number],
        blur=np.array([0.0, *blurs])[number],
        masks={"window": window >= 0.5, "annulus": ring, "target": target},
        allowed_px=least,
        pixels_per_degree_at_annulus=pixels_per_degree * stretch,
    )


def _ramp(inside: FloatArray, width: float) -> FloatArray:
    """Return a raised cosine of this width: 0.5 at 0, 1 inside."""
    return 0.5 + 0.5 * np.sin(math.pi * np.clip(inside / width, -0.5, 0.5))
