"""Dead leaves: ellipses of random size, place and luminance over one another, each with its own blur."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from focalgradient.errors import InputError, check_list
from focalgradient.optics import Side
from focalgradient.psf import Psf, PsfName
from focalgradient.render.shaped import shape_picture
from focalgradient.stimuli.layers import check_equalise, equalised, reach_of
from focalgradient.stimuli.stimulus import (
    Frame,
    Stimulus,
    check_amount,
    check_choice,
    check_light,
    check_shape,
    depth_of_blur,
    measured,
)

__all__ = ["dead_leaves"]

UNIFORM_PEAK = math.sqrt(3)
"""Largest value of a uniform distribution, in standard deviations."""

LEFT = 1e-3
"""Share of the light still to come through all leaves at which the picture is finished: a quarter of an 8-bit step."""

HIDDEN = 1e-4
"""Share of the light that comes through the leaves in front below which a leaf need not be drawn."""

SEEN = 0.01
"""Share of a pixel's light from which on a leaf counts as seen there."""

LOOK = 20
"""Leaves, at least, after which it is looked at what is still to be covered."""

FINE_PX, TIMES = 1.5, 6
"""Blur (px) below which the radius of a kernel is corrected, so many times, until its variance is right: a kernel of
0.05 pixels is too wide by 17 % at first, and by less than 0.1 % then."""

MOST = 400_000
"""Leaves after which what is left shows the mean luminance."""


@dataclass(frozen=True, slots=True)
class _Leaf:
    """Middle (y, x) and half axes in pixels, the angle of the first axis, and luminance."""

    y: float
    x: float
    long: float
    short: float
    angle: float
    light: float


def dead_leaves(
    *,
    blurs_arcmin: Sequence[float] = (0.0, 1.0, 2.0, 4.0),
    order: Literal["random", "depth"] = "random",
    smallest_deg: float = 0.25,
    largest_deg: float = 2.0,
    exponent: float = 3.0,
    aspect: float = 1.0,
    width_deg: float = 8.0,
    height_deg: float = 8.0,
    pixels_per_degree: float = 32.0,
    mean: float = 0.5,
    contrast: float = 0.5,
    equalise: Sequence[str] = (),
    psf: Psf | PsfName = "gaussian",
    focus_m: float = 0.57,
    pupil_mm: float = 4.0,
    side: Side = "beyond",
    seed: int = 0,
) -> Stimulus:
    """Draw dead leaves with a given number of blurs, each leaf with one of them (Taylor and Bex 2015).

    Each leaf hides, by its blurred coverage, what lies behind: light is composed leaf by leaf, from the front to the
    back, in linear luminance. Leaves of one blur hide each other before they are blurred, as things in one plane do.

    Parameters
    ----------
    blurs_arcmin
        The blurs: standard deviation along an axis, in arcmin; as many leaves have each.
    order
        What lies in front: "random", whatever its blur; or "depth", what is nearer by the depth of its blur, each
        depth taking about an equal share of the picture.
    smallest_deg, largest_deg, exponent
        Leaves' radii r lie between these, in degrees, and are distributed as 1 / r^exponent.
    aspect
        Long over short axis of the leaves, at most; each leaf's is drawn evenly between 1 and this. Areas stay.
    width_deg, height_deg, pixels_per_degree
        Size of the picture, and its pixels.
    mean, contrast
        Of the leaves' luminances, which are distributed evenly: mean in shares of white, standard deviation / mean.
    equalise
        What is made as in the same leaves without blur: "luminance" (mean), "contrast" (RMS) and "spectrum"
        (amplitude at each spatial frequency; phase stays).
    psf
        Shape of the blur, such as ``focalgradient.psf.Polygon(blades=5)``, or its name.
    focus_m, pupil_mm
        Of the eye by which blur is turned into depth.
    side
        Of the focus, on which that depth lies: "beyond", where blur has a limit, or "nearer".
    seed
        The same seed gives the same leaves, whatever their blur.

    Returns
    -------
    Stimulus
        With a mask for each blur, "0 arcmin" and so on: where a leaf of that blur gives most of the light.

    Raises
    ------
    InputError
        If a value is out of range.

    Examples
    --------
    >>> one = dead_leaves(blurs_arcmin=(0.0, 3.0), width_deg=3, height_deg=3)
    >>> sorted(one.masks), bool(0 <= one.picture.min() < one.picture.max() <= 1)
    (['0 arcmin', '3 arcmin'], True)
    """
    parameters = dict(locals())
    frame = Frame(width_deg, height_deg, pixels_per_degree)
    check_light(mean, contrast, seed, UNIFORM_PEAK)
    check_choice("order", order, ("random", "depth"))
    shape = check_shape(psf, parameters)
    check_choice("side", side, ("beyond", "nearer"))
    names = check_equalise(equalise)
    blurs = [
        float(one) if isinstance(one, int | float) else one for one in check_list("blurs_arcmin", blurs_arcmin, "")
    ]
    sds = [frame.blur("blurs_arcmin", one) for one in blurs]
    blurs = [float(one) for one in blurs]
    if not blurs or len(set(blurs)) < len(blurs):
        raise InputError(f"blurs_arcmin is {blurs!r}, but must be different blurs, one at least: give each once.")
    if order == "depth":
        nearest_first = side == "nearer"
        sds, blurs = sorted(sds, reverse=nearest_first), sorted(blurs, reverse=nearest_first)
    _check_sizes(smallest_deg, largest_deg, exponent, aspect, frame)
    depths = depth_of_blur(blurs, side, focus_m=focus_m, pupil_mm=pupil_mm)
    sizes = smallest_deg * pixels_per_degree, largest_deg * pixels_per_degree
    leaves = _leaves(frame.shape, sizes, exponent, aspect, max(sds), (mean, contrast), seed)
    picture, sharp, level, least = _composed(
        leaves, frame.shape, mean, [_Spread.of(sd, shape, side) for sd in sds], order, seed
    )
    shown = equalised(picture, sharp, names, mean)
    masks = {f"{blur:g} arcmin": level == number for number, blur in enumerate(blurs)}
    blur_map = np.asarray(blurs)[level]
    return Stimulus(
        "dead_leaves",
        shown,
        np.clip(sharp, 0, 1),
        depths[level],
        blur_map,
        masks,
        frame.pixel_angle,
        parameters,
        {
            "equalised": list(names),
            "share_of_picture": {name: float(mask.mean()) for name, mask in masks.items()},
            "occlusion_agrees_with_blur": order == "depth" or len(blurs) == 1,
            **measured(shown, sharp, least, masks, shape),
        },
        ("taylor2015",),
    )


def _check_sizes(smallest: Any, largest: Any, exponent: Any, aspect: Any, frame: Frame) -> None:
    check_amount("smallest_deg", smallest, "degrees", positive=True)
    check_amount("largest_deg", largest, "degrees", positive=True)
    check_amount("exponent", exponent, "powers of the radius", least=0)
    check_amount("aspect", aspect, "long axis / short axis", least=1)
    if aspect > 10:
        raise InputError(f"aspect is {aspect:g}, but must be 1 to 10.")
    if smallest > largest:
        raise InputError(f"smallest_deg is {smallest:g}, but largest_deg is {largest:g}: exchange them.")
    if smallest * frame.pixels_per_degree < 1 or largest * frame.pixels_per_degree > 2 * max(frame.shape):
        raise InputError(
            f"leaves of {smallest:g} to {largest:g} degrees have radii of {smallest * frame.pixels_per_degree:.2g} to "
            f"{largest * frame.pixels_per_degree:.4g} pixels, but must have 1 to twice the picture's larger side."
        )


def _leaves(
    shape: tuple[int, int],
    sizes: tuple[float, float],
    exponent: float,
    aspect: float,
    widest: float,
    light: tuple[float, float],
    seed: int,
) -> Iterator[_Leaf]:
    """Leaves from the front to the back, the same for a seed whatever the blur, unless it is wider than the leaves."""
    random = np.random.default_rng([seed, 0])
    low, high = sizes
    largest = high * math.sqrt(aspect)
    rim = 2 * largest * math.ceil((largest + reach_of(widest)) / (2 * largest)) + 2
    mean, contrast = light
    power = 1 - exponent
    for _ in range(MOST):
        size, y, x, angle, stretch, level = random.random(6).tolist()
        if abs(power) < 1e-9:
            radius = low * (high / low) ** size
        else:
            radius = (low**power + size * (high**power - low**power)) ** (1 / power)
        stretch = math.sqrt(1 + stretch * (aspect - 1))
        yield _Leaf(
            -rim + y * (shape[0] + 2 * rim),
            -rim + x * (shape[1] + 2 * rim),
            radius * stretch,
            radius / stretch,
            math.pi * angle,
            mean * (1 + UNIFORM_PEAK * contrast * (2 * level - 1)),
        )


def _variance(kernel: NDArray[np.float64]) -> float:
    """Variance along an axis in px^2."""
    place = np.arange(len(kernel)) - len(kernel) // 2
    return float(kernel.sum(axis=0) @ place**2)


@dataclass(frozen=True, slots=True)
class _Spread:
    """A blur: its standard deviation (px), how far it reaches (px), and its kernel, None for none."""

    sd: float
    reach: int
    kernel: NDArray[np.float64] | None

    @classmethod
    def of(cls, sd: float, psf: Psf, side: Side) -> _Spread:
        """Make the kernel: positive, and of the stated standard deviation."""
        if sd == 0:
            return cls(0.0, 1, None)
        radius = float(psf.radius_of(sd))
        kernel = shape_picture(psf, radius)
        for _ in range(TIMES if sd < FINE_PX else 0):
            radius *= sd / math.sqrt(max(_variance(kernel), 1e-6))
            kernel = shape_picture(psf, radius)
        if side == "nearer":
            kernel = kernel[::-1, ::-1]
        return cls(sd, len(kernel) // 2 + 1, kernel)

    def __call__(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Blur a part of a picture that is dark within the reach of its rim."""
        if self.kernel is None:
            return light
        spread: NDArray[np.float64] = fftconvolve(light, self.kernel, mode="same")
        return np.maximum(spread, 0)


class _Plane:
    """Leaves of one blur: the share of each pixel that they cover before they are blurred, and after."""

    def __init__(self, shape: tuple[int, int], spread: _Spread) -> None:
        self.spread = spread
        self.sharp = np.zeros(shape)
        self.blurred = np.zeros(shape)


Made = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int_], NDArray[np.float64]]
"""A picture, the same without blur, the number of the blur that gives most of its light, and the least blur (px) in it:
a sharp leaf may be seen through the blurred edge of another."""


def _composed(
    leaves: Iterator[_Leaf], shape: tuple[int, int], mean: float, spreads: Sequence[_Spread], order: str, seed: int
) -> Made:
    """Leaves over one another, from the front.

    A leaf shows what the leaves of its own blur in front of it leave of it, blurred, through what those of each other
    blur leave: light = leaf x (free part blurred) x product of (1 - coverage blurred).
    """
    pad = max(spread.reach for spread in spreads)
    canvas = shape[0] + 2 * pad, shape[1] + 2 * pad
    inside = slice(pad, pad + shape[0]), slice(pad, pad + shape[1])
    planes = [_Plane(canvas, spread) for spread in spreads]
    light, most, numbers = np.zeros(canvas), np.zeros(canvas), np.zeros(canvas, int)
    sharp, covered, least = np.zeros(canvas), np.zeros(canvas), np.full(canvas, np.inf)
    cycle, coming = np.random.default_rng([seed, 1]), list[int]()
    number = look = 0
    for count, leaf in enumerate(leaves):
        if count >= look:
            look = count + max(LOOK, count // (40 if order == "depth" else 8))
            left = np.prod([1 - plane.blurred[inside] for plane in planes], axis=0)
            if max(left.max(), 1 - covered[inside].min()) < LEFT:
                break
            share = 1 - float(left.mean())
        if order == "random":
            coming = coming or cycle.permutation(len(planes)).tolist()
            number = coming.pop()
        else:
            number = min(int(share * len(planes)), len(planes) - 1)
        plane = planes[number]
        part, cover = _cover(leaf, plane.spread.reach, pad, canvas)
        if part is None:
            continue
        sharp[part] += leaf.light * cover * (1 - covered[part])
        covered[part] += cover * (1 - covered[part])
        through = np.prod([1 - other.blurred[part] for other in planes if other is not plane], axis=0)
        if np.max(through * (1 - plane.blurred[part])) < HIDDEN:
            continue
        free = cover * (1 - plane.sharp[part])
        plane.sharp[part] += free
        spread = plane.spread(free)
        plane.blurred[part] += spread
        seen = spread * through
        light[part] += leaf.light * seen
        more = seen > most[part]
        most[part][more], numbers[part][more] = seen[more], number
        least[part] = np.where(seen > SEEN, np.minimum(least[part], plane.spread.sd), least[part])
    left = np.prod([np.clip(1 - plane.blurred, 0, 1) for plane in planes], axis=0)
    light, sharp = light + left * mean, sharp + (1 - covered) * mean
    return light[inside], sharp[inside], numbers[inside], least[inside]


def _cover(
    leaf: _Leaf, reach: int, pad: int, canvas: tuple[int, int]
) -> tuple[tuple[slice, slice], NDArray[np.float64]] | tuple[None, NDArray[np.float64]]:
    """The part of the canvas that a leaf may reach, and its coverage there, its edge smoothed over a pixel."""
    half = math.ceil(leaf.long) + reach + 1
    first = math.floor(leaf.y) + pad - half, math.floor(leaf.x) + pad - half
    rows, columns = (
        slice(max(start, 0), min(start + 2 * half + 2, side)) for start, side in zip(first, canvas, strict=True)
    )
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return None, np.zeros((0, 0))
    y = np.arange(rows.start, rows.stop)[:, None] - pad - leaf.y
    x = np.arange(columns.start, columns.stop)[None] - pad - leaf.x
    cos, sin = math.cos(leaf.angle), math.sin(leaf.angle)
    along, across = (x * cos + y * sin) / leaf.long, (y * cos - x * sin) / leaf.short
    radius = np.hypot(along, across)
    # Distance from the outline to first order: the ellipse's own function over its slope.
    slope = np.hypot(along / leaf.long, across / leaf.short) / np.maximum(radius, 1e-9)
    return (rows, columns), np.clip(0.5 + (1 - radius) / np.maximum(slope, 1 / leaf.long), 0, 1)
