"""What people and simulated observers are asked of the replicas of a published experiment, one class a question."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from focalgradient.observers import BlurDiscrimination, DepthOrder, Observer, look
from focalgradient.observers.front_end import block_means
from focalgradient.published.distance import EXPECTED_M, NO_BLUR, displayed, distance_question
from focalgradient.scales import Control, Scale, Steps, Ways
from focalgradient.stimuli import PAPERS, Stimulus, replica

__all__ = ["ASKED", "Asked"]

FloatArray = NDArray[np.float64]

Text = Callable[[str], str]
"""Gives a text of the task by its name, in the participant's language."""

SIDES = ("left", "right")
QUADRANTS = ("upper right", "upper left", "lower left", "lower right")
LEAST_M, MOST_M = 0.05, 2000.0
"""Ends of the scale of distance in metres; our choice."""


class Asked(ABC):
    """A question about the replicas of one paper.

    Parameters
    ----------
    paper
        Key of `focalgradient.stimuli.PAPERS`.
    """

    name: ClassVar[str]
    """Beginning of the names of its texts."""
    places: ClassVar[tuple[Literal[1, 2], ...]] = (1,)
    """Intervals in which the picture of the condition comes."""
    is_ratio: ClassVar[bool] = False
    """Whether answers are analysed on their logarithm."""
    pixels_per_degree: ClassVar[float]
    """Of the pictures that simulated observers look at; our choice."""

    def __init__(self, paper: str) -> None:
        self.paper = paper

    @property
    def conditions(self) -> tuple[str, ...]:
        """Names of the conditions that are shown."""
        return tuple(PAPERS[self.paper].conditions)

    def drawn(self, condition: str, place: int, pixels_per_degree: float, seed: int) -> tuple[Stimulus, ...]:
        """Draw what a trial shows, one stimulus an interval."""
        return (replica(self.paper, condition, pixels_per_degree=pixels_per_degree, seed=seed),)

    @abstractmethod
    def control(self, text: Text) -> Control:
        """Describe what is answered on."""

    @abstractmethod
    def value(self, condition: str, place: int, given: float) -> float:
        """Return the answer that is recorded for what was given on the control."""

    @abstractmethod
    def simulate(
        self, observer: Observer, drawn: tuple[Stimulus, ...], condition: str, place: int, chance: np.random.Generator
    ) -> float:
        """Return what a simulated observer gives on the control, by looking at the pictures."""


class NearerSide(Asked):
    """Which of two textures is nearer; 1 where the blurred one was chosen, otherwise 0."""

    name = "order"
    pixels_per_degree = 60.0

    def drawn(self, condition: str, place: int, pixels_per_degree: float, seed: int) -> tuple[Stimulus, ...]:
        """Draw what a trial shows."""
        size = {"width_deg": 5.0, "height_deg": 5.0}
        return (replica(self.paper, condition, pixels_per_degree=pixels_per_degree, seed=seed, **size),)

    def control(self, text: Text) -> Control:
        """Describe what is answered on."""
        return Ways(text("order question"), (text("left"), text("right")))

    def value(self, condition: str, place: int, given: float) -> float:
        """Return the answer that is recorded."""
        side = PAPERS[self.paper].conditions[condition][f"{SIDES[int(given) - 1]}_blur_arcmin"]
        return float(side > 0)

    def simulate(
        self, observer: Observer, drawn: tuple[Stimulus, ...], condition: str, place: int, chance: np.random.Generator
    ) -> float:
        """Answer by looking."""
        (one,) = drawn
        order = DepthOrder(first=one.masks["left"], second=one.masks["right"])
        answer = observer.look(one.picture, displayed(one), order).simulate(chance)
        return 1.0 if answer == "first" else 2.0


class MoreBlurredInterval(Asked):
    """In which of two intervals an edge is more blurred; 1 where that is right, otherwise 0."""

    name = "intervals"
    places = (1, 2)
    pixels_per_degree = 60.0

    @property
    def conditions(self) -> tuple[str, ...]:
        """Those with an increment: without one no answer is right."""
        return tuple(name for name, given in PAPERS[self.paper].conditions.items() if given["increment_arcmin"] > 0)

    def drawn(self, condition: str, place: int, pixels_per_degree: float, seed: int) -> tuple[Stimulus, ...]:
        """Draw what a trial shows."""
        more = replica(self.paper, condition, pixels_per_degree=pixels_per_degree)
        standard = replica(self.paper, condition, pixels_per_degree=pixels_per_degree, increment_arcmin=0.0)
        return (more, standard) if place == 1 else (standard, more)

    def control(self, text: Text) -> Control:
        """Describe what is answered on."""
        return Ways(text("intervals question"), (text("first"), text("second")))

    def value(self, condition: str, place: int, given: float) -> float:
        """Return the answer that is recorded."""
        return float(int(given) == place)

    def simulate(
        self, observer: Observer, drawn: tuple[Stimulus, ...], condition: str, place: int, chance: np.random.Generator
    ) -> float:
        """Answer by looking."""
        first, second = drawn
        answer = observer.look(first.picture, displayed(first), BlurDiscrimination(second.picture)).simulate(chance)
        return 1.0 if answer == "first" else 2.0


class MoreBlurredQuadrant(Asked):
    """Which quadrant of an annulus is more blurred; 1 where that is right, otherwise 0."""

    name = "quadrant"
    pixels_per_degree = 32.0

    def control(self, text: Text) -> Control:
        """Describe what is answered on."""
        return Steps(text("quadrant question"), "", 1, len(QUADRANTS), [text(one) for one in QUADRANTS])

    def value(self, condition: str, place: int, given: float) -> float:
        """Return the answer that is recorded."""
        return float(QUADRANTS[int(given) - 1] == PAPERS[self.paper].conditions[condition]["quadrant"])

    def simulate(
        self, observer: Observer, drawn: tuple[Stimulus, ...], condition: str, place: int, chance: np.random.Generator
    ) -> float:
        """Choose the largest of the four log blurs, each with the error that a Weber fraction gives a pair of them."""
        (one,) = drawn
        height, width = one.shape
        seen = look(one.picture, displayed(one), (width / 2, height / 2), observer)
        blurs = [_region_blur(seen.blur, seen.blur_log_sd, region) for region in _quadrants(one.masks["annulus"])]
        pair_sd = math.log1p(observer.weber) / float(ndtri(0.75))
        logs = [
            math.log(math.hypot(blur, observer.intrinsic)) + chance.normal(0, math.hypot(pair_sd / math.sqrt(2), sd))
            for blur, sd in blurs
        ]
        looks = not observer.guesses and chance.random() >= observer.lapses
        return float(np.argmax(logs) + 1) if looks else float(chance.integers(1, len(QUADRANTS) + 1))


def _quadrants(annulus: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
    """Parts of a mask in the order of `QUADRANTS`."""
    down, right = (np.indices(annulus.shape).T - (np.array(annulus.shape) - 1) / 2).T
    signs = ((-1, 1), (-1, -1), (1, -1), (1, 1))
    return [annulus & (vertical * down > 0) & (horizontal * right > 0) for vertical, horizontal in signs]


def _region_blur(blur: FloatArray, log_sd: FloatArray, region: NDArray[np.bool_]) -> tuple[float, float]:
    """Blur (arcmin) of a region and the sd of its logarithm, of the places most within it, by their precision."""
    share = block_means(region)
    share = np.where(share >= share.max() / 2, share, 0.0)
    weight = np.where(np.isfinite(blur) & (blur > 0), share / np.maximum(log_sd, 1e-6) ** 2, 0.0)
    if not weight.sum() > 0:
        return 0.0, math.inf
    log = float((weight * np.log(np.where(weight > 0, blur, 1.0))).sum() / weight.sum())
    return math.exp(log), float(weight.sum() ** -0.5)


class DistanceInMetres(Asked):
    """How far away the middle of a picture looks, in metres, with each blur of the paper and without."""

    name = "distance"
    is_ratio = True
    pixels_per_degree = 20.0

    @property
    def conditions(self) -> tuple[str, ...]:
        """Those of the paper, and each gradient's picture without blur."""
        return (*super().conditions, *self._unblurred)

    @property
    def _unblurred(self) -> dict[str, str]:
        """The condition that is drawn without blur, by the name of that."""
        return {f"{name.split(',')[0]}, no blur": name for name in reversed(super().conditions)}

    def drawn(self, condition: str, place: int, pixels_per_degree: float, seed: int) -> tuple[Stimulus, ...]:
        """Draw a picture, through a pinhole where it has no blur."""
        drawn = self._unblurred.get(condition, condition)
        others: Mapping[str, float] = NO_BLUR if drawn != condition else {}
        return (replica(self.paper, drawn, pixels_per_degree=pixels_per_degree, seed=seed, **others),)

    def control(self, text: Text) -> Control:
        """Describe what is answered on."""
        ends = (text("near"), text("far"))
        return Scale(text("distance question"), "", LEAST_M, MOST_M, ratios=True, ends=ends)

    def value(self, condition: str, place: int, given: float) -> float:
        """Return the answer that is recorded."""
        return float(given)

    def simulate(
        self, observer: Observer, drawn: tuple[Stimulus, ...], condition: str, place: int, chance: np.random.Generator
    ) -> float:
        """Answer by looking."""
        (one,) = drawn
        question = distance_question(one.depth_m, EXPECTED_M[self.paper])
        answer = observer.look(one.picture, displayed(one), question).simulate(chance)
        return float(np.clip(answer, LEAST_M, MOST_M))


ASKED: Mapping[str, Asked] = {
    one.paper: one
    for one in (
        NearerSide("mather1996"),
        NearerSide("mather2002"),
        NearerSide("marshall1996"),
        MoreBlurredInterval("watson2011"),
        MoreBlurredQuadrant("maiello2017"),
        DistanceInMetres("held2010"),
        DistanceInMetres("vishwanath2010"),
    )
}
"""By the paper's key in the bibliography."""
