"""Dead leaves: ellipses of random size, place and luminance over one another, each with its own blur."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from focalgradient.errors import InputError, check_list, check_number
from focalgradient.optics import Side
from focalgradient.stimuli.layers import check_equalise, coverage, equalised, fineness, reach_of
from focalgradient.stimuli.stimulus import (
    Frame,
    Shape,
    Stimulus,
    check_choice,
    check_light,
    depth_of_blur,
    measured,
    sharpness,
)

__all__ = ["dead_leaves"]

UNIFORM_PEAK = math.sqrt(3)
"""Largest value of a uniform distribution, in standard deviations."""

LEFT = 1e-3
"""Share of the light still to come through all leaves at which the picture is finished: a quarter of an 8-bit step."""

HIDDEN = 1e-4
"""Share of the light that comes through the leaves in front below which a leaf need not be drawn."""

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

    def on(self, factor: int, pad: int) -> _Leaf:
        """Give the same on a grid that is finer by `factor` and begins `pad` pixels before."""
        y, x = (factor * (place + pad + 0.5) - 0.5 for place in (self.y, self.x))
        return _Leaf(y, x, factor * self.long, factor * self.short, self.angle, self.light)


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
    psf: Shape = "gaussian",
    focus_m: float = 0.57,
    pupil_mm: float = 4.0,
    side: Side = "beyond",
    seed: int = 0,
) -> Stimulus:
    """Draw dead leaves with a given number of blurs, each leaf with one of them (Taylor and Bex 2015).

    Each leaf hides, by its blurred coverage, what lies behind: light is composed leaf by leaf, from the front to the
    back, in linear luminance. Leaves of one depth lie in one plane, whose light and coverage are blurred as a whole.

    Parameters
    ----------
    blurs_arcmin
        The blurs: standard deviation along an axis, in arcmin; as many leaves have each.
    order
        What lies in front: "random", whatever its blur; or "depth", what is nearer by the depth of its blur, each
        depth taking about an equal share of the picture. With "random", where the edges of several blurred leaves
        coincide, their blurs are taken as independent, and the picture may be sharper there than one edge, by up to
        22 % for two.
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
        Shape of the blur.
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
    check_choice("psf", psf, ("gaussian", "disc"))
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
    leaves = _leaves(frame.shape, sizes, exponent, aspect, (mean, contrast), seed)
    made = _in_planes if order == "depth" or len(sds) == 1 else _one_by_one
    picture, sharp, level = made(leaves, frame.shape, mean, sds, psf, seed)
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
            **measured(shown, masks),
            "sharpest": sharpness(shown, blur_map * frame.pixels(1.0), psf),
        },
        ("taylor2015",),
    )


def _check_sizes(smallest: Any, largest: Any, exponent: Any, aspect: Any, frame: Frame) -> None:
    check_number("smallest_deg", smallest, "degrees", positive=True)
    check_number("largest_deg", largest, "degrees", positive=True)
    check_number("exponent", exponent, "powers of the radius", least=0)
    check_number("aspect", aspect, "long axis / short axis", least=1)
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
    light: tuple[float, float],
    seed: int,
) -> Iterator[_Leaf]:
    """Leaves from the front to the back, the same for a seed whatever the blur."""
    random = np.random.default_rng([seed, 0])
    low, high = sizes
    rim = 2 * high * math.sqrt(aspect) + 2
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


Made = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int_]]
"""A picture, the same without blur, and the number of the blur that gives most of its light."""


def _one_by_one(
    leaves: Iterator[_Leaf], shape: tuple[int, int], mean: float, sds: Sequence[float], psf: Shape, seed: int
) -> Made:
    """Leaves of all blurs in random order."""
    picture, sharp = _Composition(shape, mean), _Composition(shape, mean)
    cycle = np.random.default_rng([seed, 1])
    coming: list[int] = []
    for leaf in leaves:
        coming = coming or cycle.permutation(len(sds)).tolist()
        level = coming.pop()
        picture.behind(leaf, sds[level], psf, level)
        sharp.behind(leaf, 0.0, psf, level)
        if picture.finished() and sharp.finished():
            break
    return picture.light(), sharp.light(), picture.level


def _in_planes(
    leaves: Iterator[_Leaf], shape: tuple[int, int], mean: float, sds: Sequence[float], psf: Shape, seed: int
) -> Made:
    """Leaves in planes, the first in front: each plane's light and coverage are blurred as a whole."""
    factor, pad = max(map(fineness, sds)), reach_of(max(sds))
    height, width = shape
    canvas = factor * (height + 2 * pad), factor * (width + 2 * pad)
    picture, sharp = np.zeros(shape), np.zeros(shape)
    through, plain, most = np.ones(shape), np.ones(shape), np.zeros(shape)
    numbers = np.zeros(shape, int)

    def shown(fine: NDArray[np.float64], sd: float) -> NDArray[np.float64]:
        return coverage(fine, factor, sd, psf)[pad : pad + height, pad : pad + width]

    for number, sd in enumerate(sds):
        plane = _Composition(canvas, mean)
        last = number == len(sds) - 1
        for leaf in leaves:
            plane.behind(leaf.on(factor, pad), 0.0, psf, number)
            if plane.finished() if last else plane.left() < 1 - 1 / (len(sds) - number):
                break
        light = plane.light() if last else plane.sum
        covered = np.ones(canvas) if last else 1 - plane.through
        share = shown(covered, sd)
        picture += through * shown(light, sd)
        sharp += plain * shown(light, 0.0)
        more = through * share > most
        numbers[more], most[more] = number, (through * share)[more]
        through *= 1 - share
        plain *= 1 - shown(covered, 0.0)
    return picture, sharp, numbers


class _Composition:
    """Light so far, from the front, and the share of what lies behind that still comes through."""

    def __init__(self, shape: tuple[int, int], mean: float) -> None:
        self.shape, self.mean = shape, mean
        self.sum = np.zeros(shape)
        self.through = np.ones(shape)
        self.most = np.zeros(shape)
        self.level = np.zeros(shape, int)
        self._look = 0

    def behind(self, leaf: _Leaf, sd: float, psf: Shape, level: int) -> None:
        """Put a leaf behind all others."""
        reach = math.ceil(leaf.long) + (reach_of(sd) if sd > 0 else 1)
        top, left = math.floor(leaf.y) - reach, math.floor(leaf.x) - reach
        rows = slice(max(top, 0), min(top + 2 * reach + 2, self.shape[0]))
        columns = slice(max(left, 0), min(left + 2 * reach + 2, self.shape[1]))
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return
        through = self.through[rows, columns]
        if through.max() < HIDDEN:
            return
        covered = _cover(leaf, sd, psf, reach)
        covered = covered[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
        share = through * covered
        self.sum[rows, columns] += leaf.light * share
        through *= 1 - covered
        most = self.most[rows, columns]
        more = share > most
        most[more] = share[more]
        self.level[rows, columns][more] = level

    def left(self) -> float:
        """Mean share of the light that comes from behind."""
        return float(self.through.mean())

    def finished(self) -> bool:
        """Whether hardly any light comes from behind; it is looked at now and then."""
        self._look += 1
        return self._look % 50 == 0 and float(self.through.max()) < LEFT

    def light(self) -> NDArray[np.float64]:
        """The picture, the mean behind it."""
        return self.sum + self.through * self.mean


def _cover(leaf: _Leaf, sd: float, psf: Shape, reach: int) -> NDArray[np.float64]:
    """Blurred coverage of a leaf around its middle, 2 reach + 2 pixels a side or more."""
    factor = fineness(sd)
    side = fft.next_fast_len(2 * reach + 2, real=True)
    place = (np.arange(side * factor) + 0.5) / factor - 0.5 - reach
    y, x = (place - (leaf.y - math.floor(leaf.y)))[:, None], (place - (leaf.x - math.floor(leaf.x)))[None]
    cos, sin = math.cos(leaf.angle), math.sin(leaf.angle)
    along, across = (x * cos + y * sin) / leaf.long, (y * cos - x * sin) / leaf.short
    radius = np.hypot(along, across)
    # Distance from the outline to first order: the ellipse's own function over its slope.
    slope = np.hypot(along / leaf.long, across / leaf.short) / np.maximum(radius, 1e-9)
    fine = np.clip(0.5 + factor * (1 - radius) / np.maximum(slope, 1 / leaf.long), 0, 1)
    return coverage(fine, factor, sd, psf) if sd > 0 else fine
