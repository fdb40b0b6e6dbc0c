"""Dead-leaves stimuli: overlapping ellipses of random size, position and luminance, each with its own blur."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.optics import Side
from focalgradient.psf import Psf
from focalgradient.render.shaped import shape_picture
from focalgradient.stimuli.layers import equalised, reach_of
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

__all__ = ["dead_leaves"]

UNIFORM_PEAK = math.sqrt(3)
"""Maximum of a uniform distribution in standard deviations."""

MIN_TRANSMISSION = 1e-3
"""Maximum transmission through all leaves at which the picture counts as finished: a quarter of an 8-bit step."""

HIDDEN_TRANSMISSION = 1e-4
"""Transmission through the leaves in front below which a leaf is not drawn."""

VISIBLE_FRACTION = 0.01
"""Fraction of a pixel's radiance from which a leaf counts as visible there."""

CHECK_INTERVAL = 20
"""Minimum number of leaves between checks of the remaining uncovered area."""

FINE_PX, ITERATIONS = 1.5, 6
"""Blur (px) below which a kernel's radius is corrected iteratively for its variance, and number of iterations: a kernel
of 0.05 px is too wide by 17 % initially, and by less than 0.1 % afterwards."""

MAX_LEAVES = 400_000
"""Maximum number of leaves; remaining gaps show the mean luminance."""


@dataclass(frozen=True, slots=True)
class _Leaf:
    """Centre (y, x) and semi-axes in pixels, angle of the first axis (rad), and luminance."""

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
    smallest_deg: Degrees = 0.25,
    largest_deg: Degrees = 2.0,
    exponent: Annotated[float, Amount("powers of the radius", 0)] = 3.0,
    aspect: Annotated[float, Amount("long axis / short axis", 1, 10)] = 1.0,
    width_deg: Degrees = 8.0,
    height_deg: Degrees = 8.0,
    pixels_per_degree: Resolution = 32.0,
    mean: Luminance = 0.5,
    contrast: Contrast = 0.5,
    equalise: Sequence[str] = (),
    psf: Shape = "gaussian",
    focus_m: Metres = 0.57,
    pupil_mm: Millimetres = 4.0,
    side: Side = "beyond",
    seed: int = 0,
) -> Stimulus:
    """Draw dead leaves with a given set of blurs, each leaf with one of them (Taylor and Bex 2015).

    Each leaf occludes what lies behind by its blurred coverage: the picture is composed leaf by leaf, from front to
    back, in linear luminance. Leaves with the same blur occlude each other before blurring, as objects in one plane do.

    Parameters
    ----------
    blurs_arcmin
        Blurs: standard deviation along an axis, in arcmin; each is assigned to equally many leaves.
    order
        Occlusion order: "random", independent of blur; or "depth", ordered by the depth that corresponds to the blur,
        with about equal areas per depth.
    smallest_deg, largest_deg, exponent
        Range of the leaves' radii r in degrees, and exponent of their distribution, 1 / r^exponent.
    aspect
        Maximum ratio of long to short axis; each leaf's is uniformly distributed between 1 and this, at constant area.
    width_deg, height_deg, pixels_per_degree
        Size of the picture in degrees, and its resolution.
    mean, contrast
        Mean (as a fraction of white) and standard deviation / mean of the leaves' uniformly distributed luminances.
    equalise
        Properties equalised to those of the same leaves without blur: "luminance" (mean), "contrast" (RMS), "spectrum"
        (amplitude spectrum; phases are kept).
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
        Stimulus with one mask per blur ("0 arcmin" etc.), which marks where leaves of that blur contribute most.

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
    drawing = Drawing.begin(dead_leaves, locals(), "taylor2015", peak=UNIFORM_PEAK)
    frame = drawing.frame
    blurs = [float(one) for one in blurs_arcmin]
    sds = [frame.blur("blurs_arcmin", one) for one in blurs]
    if not blurs or len(set(blurs)) < len(blurs):
        raise InputError(f"blurs_arcmin is {blurs!r}, but must be different blurs, one at least: give each once.")
    if order == "depth":
        nearest_first = side == "nearer"
        sds, blurs = sorted(sds, reverse=nearest_first), sorted(blurs, reverse=nearest_first)
    _check_sizes(smallest_deg, largest_deg, frame)
    depths = depth_of_blur(blurs, side, focus_m=focus_m, pupil_mm=pupil_mm)
    sizes = smallest_deg * pixels_per_degree, largest_deg * pixels_per_degree
    leaves = _leaves(frame.shape, sizes, exponent, aspect, max(sds), (mean, contrast), seed)
    picture, sharp, level, least = _composed(
        leaves, frame.shape, mean, [_Spread.of(sd, drawing.psf, side) for sd in sds], order, seed
    )
    masks = {f"{blur:g} arcmin": level == number for number, blur in enumerate(blurs)}
    return drawing.stimulus(
        picture=equalised(picture, sharp, drawing.equalised, mean),
        sharp=np.clip(sharp, 0, 1),
        depth=depths[level],
        blur=np.asarray(blurs)[level],
        masks=masks,
        allowed_px=least,
        share_of_picture={name: float(mask.mean()) for name, mask in masks.items()},
        occlusion_agrees_with_blur=order == "depth" or len(blurs) == 1,
    )


def _check_sizes(smallest: float, largest: float, frame: Frame) -> None:
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
    """Yield leaves from front to back, the same for a seed at any blur up to the size of the leaves."""
    random = np.random.default_rng([seed, 0])
    low, high = sizes
    largest = high * math.sqrt(aspect)
    rim = 2 * largest * math.ceil((largest + reach_of(widest)) / (2 * largest)) + 2
    mean, contrast = light
    power = 1 - exponent
    for _ in range(MAX_LEAVES):
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


def _variance(kernel: FloatArray) -> float:
    """Return the variance along an axis in px^2."""
    place = np.arange(len(kernel)) - len(kernel) // 2
    return float(kernel.sum(axis=0) @ place**2)


@dataclass(frozen=True, slots=True)
class _Spread:
    """A blur: standard deviation (px), extent (px), and kernel (None for no blur)."""

    sd: float
    reach: int
    kernel: FloatArray | None

    @classmethod
    def of(cls, sd: float, psf: Psf, side: Side) -> _Spread:
        """Return the blur with a non-negative kernel of the given standard deviation."""
        if sd == 0:
            return cls(0.0, 1, None)
        radius = float(psf.radius_of(sd))
        kernel = shape_picture(psf, radius)
        for _ in range(ITERATIONS if sd < FINE_PX else 0):
            radius *= sd / math.sqrt(max(_variance(kernel), 1e-6))
            kernel = shape_picture(psf, radius)
        if side == "nearer":
            kernel = kernel[::-1, ::-1]
        return cls(sd, len(kernel) // 2 + 1, kernel)

    def __call__(self, light: FloatArray) -> FloatArray:
        """Blur a part of a picture that is zero within the kernel's extent of its border."""
        if self.kernel is None:
            return light
        return np.maximum(fftconvolve(light, self.kernel, mode="same"), 0)


def _composed(
    leaves: Iterator[_Leaf], shape: tuple[int, int], mean: float, spreads: Sequence[_Spread], order: str, seed: int
) -> tuple[FloatArray, FloatArray, NDArray[np.int_], FloatArray]:
    """Compose overlapping leaves from front to back.

    Return the picture; the same without blur; and per pixel, the index of the blur that contributes most, and the
    smallest visible blur (px), since a sharp leaf may show through another's blurred edge.

    A leaf's visible part, after occlusion by leaves of the same blur, is blurred and attenuated by the leaves of
    every other blur in front: radiance = leaf x (visible part, blurred) x product of (1 - blurred coverage).
    """
    pad = max(spread.reach for spread in spreads)
    canvas = shape[0] + 2 * pad, shape[1] + 2 * pad
    inside = slice(pad, pad + shape[0]), slice(pad, pad + shape[1])
    # Fraction of each pixel that the leaves of each blur cover, before and after blurring.
    sharp_cover, covers = np.zeros((2, len(spreads), *canvas))
    light, most, numbers = np.zeros(canvas), np.zeros(canvas), np.zeros(canvas, int)
    sharp, covered, least = np.zeros(canvas), np.zeros(canvas), np.full(canvas, np.inf)
    cycle, coming = np.random.default_rng([seed, 1]), list[int]()
    number = look = 0
    for count, leaf in enumerate(leaves):
        if count >= look:
            look = count + max(CHECK_INTERVAL, count // (40 if order == "depth" else 8))
            left = np.prod([1 - cover[inside] for cover in covers], axis=0)
            if max(left.max(), 1 - covered[inside].min()) < MIN_TRANSMISSION:
                break
            share = 1 - float(left.mean())
        if order == "random":
            coming = coming or cycle.permutation(len(spreads)).tolist()
            number = coming.pop()
        else:
            number = min(int(share * len(spreads)), len(spreads) - 1)
        spread = spreads[number]
        part, cover = _cover(leaf, spread.reach, pad, canvas)
        if not cover.size:
            continue
        sharp[part] += leaf.light * cover * (1 - covered[part])
        covered[part] += cover * (1 - covered[part])
        through = np.prod([1 - other[part] for at, other in enumerate(covers) if at != number], axis=0)
        if np.max(through * (1 - covers[number][part])) < HIDDEN_TRANSMISSION:
            continue
        free = cover * (1 - sharp_cover[number][part])
        sharp_cover[number][part] += free
        blurred = spread(free)
        covers[number][part] += blurred
        seen = blurred * through
        light[part] += leaf.light * seen
        more = seen > most[part]
        most[part][more], numbers[part][more] = seen[more], number
        least[part] = np.where(seen > VISIBLE_FRACTION, np.minimum(least[part], spread.sd), least[part])
    left = np.prod([np.clip(1 - cover, 0, 1) for cover in covers], axis=0)
    light, sharp = light + left * mean, sharp + (1 - covered) * mean
    return light[inside], sharp[inside], numbers[inside], least[inside]


def _cover(leaf: _Leaf, reach: int, pad: int, canvas: tuple[int, int]) -> tuple[tuple[slice, slice], FloatArray]:
    """Return the part of the canvas within a leaf's reach, which may be empty, and its anti-aliased coverage there."""
    half = math.ceil(leaf.long) + reach + 1
    first = math.floor(leaf.y) + pad - half, math.floor(leaf.x) + pad - half
    rows, columns = (
        slice(max(start, 0), max(0, min(start + 2 * half + 2, side))) for start, side in zip(first, canvas, strict=True)
    )
    y = np.arange(rows.start, rows.stop)[:, None] - pad - leaf.y
    x = np.arange(columns.start, columns.stop)[None] - pad - leaf.x
    cos, sin = math.cos(leaf.angle), math.sin(leaf.angle)
    along, across = (x * cos + y * sin) / leaf.long, (y * cos - x * sin) / leaf.short
    radius = np.hypot(along, across)
    # First-order distance from the ellipse: its implicit function divided by its gradient.
    slope = np.hypot(along / leaf.long, across / leaf.short) / np.maximum(radius, 1e-9)
    return (rows, columns), np.clip(0.5 + (1 - radius) / np.maximum(slope, 1 / leaf.long), 0, 1)
