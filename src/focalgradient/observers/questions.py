"""Questions that an observer answers from the pixels of a picture, one small class each, asked by `Observer.look`.

Common assumptions: the blur of a place is due to defocus with probability `defocus`, and otherwise to the texture
itself; the sharper of two regions is in focus, and the more blurred one lies beyond it with probability (1 + prior) /
2; a border has the blur of the occluding (nearer) side. Two blurs, including intrinsic blur, whose ratio is 1 + weber
are discriminated with 75 % correct with two alternatives.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.special import ndtr, ndtri

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers.borders import border_blur, share_border
from focalgradient.observers.disparities import disparity_at_places
from focalgradient.observers.front_end import SPACING, blur_of, own_blur, seen_by
from focalgradient.observers.observer import Observer
from focalgradient.observers.retinal_blur import SAMPLING_BLUR, BlurEstimate

__all__ = ["BlurDiscrimination", "Choice", "DepthOrder", "FigureGround", "Question", "more_blurred"]

Region = NDArray[np.bool_]

Answered = TypeVar("Answered", covariant=True)
"""Type of a question's answer: `Choice` or `Magnitude`."""

FIRST, SECOND = "first", "second"

BLURS = 100.0
"""Ratio of the largest to the smallest blur of a border that belongs to neither side (our choice)."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Answer among alternatives, with the probability of each.

    Examples
    --------
    >>> choice = Choice({"first": 0.75, "second": 0.25})
    >>> choice.likeliest, choice.simulate(np.random.default_rng(1))
    ('first', 'first')
    """

    probability: Mapping[str, float]

    @property
    def likeliest(self) -> str:
        """Most probable alternative."""
        return max(self.probability, key=lambda name: self.probability[name])

    def simulate(self, random: np.random.Generator) -> str:
        """Draw one answer."""
        names = list(self.probability)
        return names[int(random.choice(len(names), p=list(self.probability.values())))]


class Question(Protocol[Answered]):
    """Question about a picture."""

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> Answered:
        """Answer from the pixels (H x W, relative to white) and the display alone."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class DepthOrder:
    """Question for the nearer of two regions: ``"first"`` or ``"second"``.

    The cues are which region is more blurred, by the observer's prior; for adjacent regions, to which one the blur of
    the border belongs; and with two eyes, which one has more crossed disparity.

    Parameters
    ----------
    first, second
        Masks with the shape of the picture, each containing a square of about 64 pixels.
    right
        Picture of the right eye; the picture that is looked at is then that of the left eye.
    """

    first: Region
    second: Region
    right: FloatArray | None = None

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> Choice:
        """Answer by the product of the odds of the cues."""
        regions = _checked(light, self.first, self.second)
        (seen,), slope = seen_by([light], display, observer.pupil)
        estimated = blur_of(seen, slope, display, observer.pupil)
        blurs = [_region_blur(estimated, display, region) for region in regions]
        farther = (1 + observer.defocus * observer.prior) / 2
        more = more_blurred(blurs[1], blurs[0], observer)
        near = more * farther + (1 - more) * (1 - farther)
        if share_border(*regions):
            own = own_blur(display.pixels_per_degree, observer.pupil)
            border = _seen(*border_blur(seen, self.first, self.second, own), display)
            first, second = (_belongs(border, blur, observer) for blur in blurs)
            near = near * first / (near * first + (1 - near) * second)
        if self.right is not None:
            disparity = disparity_at_places(np.asarray(light, float), self.right, display)
            crossed = [_region_disparity(disparity, region) for region in regions]
            by_eyes = float(ndtr((crossed[0] - crossed[1]) / (observer.stereo / float(ndtri(0.75)))))
            near = near * by_eyes / max(near * by_eyes + (1 - near) * (1 - by_eyes), 1e-300)
        return _answered(near, observer)


@dataclass(frozen=True, slots=True, eq=False)
class FigureGround:
    """Question for the figure, which owns the border, out of two adjacent regions: ``"first"`` or ``"second"``.

    The nearer region owns the border, so that the answer is that of `DepthOrder`. Regions that are not adjacent raise
    `InputError`.
    """

    first: Region
    second: Region

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> Choice:
        """Answer by the depth order of the regions."""
        if not share_border(*_checked(light, self.first, self.second)):
            raise InputError("first and second do not meet: figure and ground need a border of 16 pixels or more.")
        return DepthOrder(self.first, self.second).answer(light, display, observer)


@dataclass(frozen=True, slots=True, eq=False)
class BlurDiscrimination:
    """Question for the more blurred of two pictures: ``"first"``, the one that is looked at, or ``"second"``.

    Parameters
    ----------
    second
        Other picture, relative to white.
    region
        Region of the comparison; None: the whole picture.
    """

    second: FloatArray
    region: Region | None = field(default=None)

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> Choice:
        """Answer by the ratio of the blurs, including intrinsic blur."""
        seen, slope = seen_by([light, self.second], display, observer.pupil)
        blurs = []
        for image in seen:
            region = np.ones(image.shape, np.bool_) if self.region is None else self.region
            (one,) = _checked(image, region)
            blurs.append(_region_blur(blur_of(image, slope, display, observer.pupil), display, one))
        return _answered(more_blurred(blurs[0], blurs[1], observer), observer)


def _answered(first: float, observer: Observer) -> Choice:
    """Return the choice of the first alternative, including lapses."""
    lapses = 1.0 if observer.guesses else observer.lapses
    share = lapses / 2 + (1 - lapses) * first
    return Choice({FIRST: share, SECOND: 1 - share})


def _checked(light: FloatArray, *regions: Region) -> tuple[Region, ...]:
    for region in regions:
        if np.shape(region) != np.shape(light) or np.asarray(region).dtype != np.bool_:
            raise InputError(
                f"a region is a mask of shape {np.shape(region)} and type {np.asarray(region).dtype}, but must contain "
                f"booleans and have the picture's shape, {np.shape(light)}."
            )
    return regions


def _region_blur(estimated: BlurEstimate, display: Display, region: Region) -> tuple[float, float]:
    """Return the blur of a region (arcmin) and the SD of its logarithm, precision-weighted over its interior places."""
    rows, columns = estimated.log_sd.shape
    middle = SPACING * (np.arange(max(rows, columns)) + 0.5)
    inside = np.asarray(distance_transform_edt(region), float)
    depth = inside[np.ix_(middle[:rows].astype(int), middle[:columns].astype(int))]
    known = np.isfinite(estimated.log_sd)
    for room in (SPACING, SPACING / 2):  # margin to the border, reduced if necessary
        chosen = known & (depth >= room)
        if chosen.any():
            break
    else:
        raise InputError(
            f"a region has no place with texture or edges {SPACING} pixels across, so that its blur cannot be "
            "estimated: give a larger one."
        )
    weight = estimated.log_sd[chosen] ** -2.0
    log = float(weight @ estimated.log_blur[chosen] / weight.sum())
    return _seen(log, float(weight.sum() ** -0.5), display)


def _region_disparity(disparity: FloatArray, region: Region) -> float:
    """Return the median disparity (arcmin) of the places whose centre lies within a region."""
    rows, columns = (SPACING * np.arange(count) + SPACING // 2 for count in disparity.shape)
    inside = disparity[np.asarray(region)[np.ix_(rows, columns)]]
    if not np.isfinite(inside).any():
        raise InputError("a region's disparity cannot be estimated: both eyes' pictures agree at none of its places.")
    return float(np.nanmedian(inside))


def _seen(log: float, log_sd: float, display: Display) -> tuple[float, float]:
    """Return blur in arcmin without sampling blur, and the SD of the log estimate."""
    return display.arcmin(1.0) * math.sqrt(max(math.exp(2 * log) - SAMPLING_BLUR**2, 0.0)), log_sd


def more_blurred(one: tuple[float, float], other: tuple[float, float], observer: Observer) -> float:
    """Return the probability that `one` looks more blurred, limited by Weber's law and the errors of the estimates."""
    ratio = math.log(math.hypot(one[0], observer.intrinsic) / math.hypot(other[0], observer.intrinsic))
    return float(ndtr(ratio / math.hypot(_weber_sd(observer), one[1], other[1])))


def _weber_sd(observer: Observer) -> float:
    """Return the SD of the log ratio of two blurs at which a ratio of 1 + weber is judged with 75 % correct."""
    return math.log1p(observer.weber) / float(ndtri(0.75))


def _belongs(border: tuple[float, float], side: tuple[float, float], observer: Observer) -> float:
    """Return the likelihood of the border's blur if it belongs to a side; uniform if blur is of the texture itself."""
    ratio = math.log(math.hypot(border[0], observer.intrinsic) / math.hypot(side[0], observer.intrinsic))
    sd = math.hypot(_weber_sd(observer), border[1], side[1])
    density = math.exp(-((ratio / sd) ** 2) / 2) / (sd * math.sqrt(2 * math.pi))
    return observer.defocus * density + (1 - observer.defocus) / math.log(BLURS)
