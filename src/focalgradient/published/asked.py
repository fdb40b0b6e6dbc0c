"""Questions on replicas of the stimuli of published experiments, for people and simulated observers."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from focalgradient.arrays import FloatArray
from focalgradient.observers import BlurDiscrimination, DepthOrder, Observer, look
from focalgradient.observers.front_end import block_means
from focalgradient.published.distance import EXPECTED_M, NO_BLUR, displayed, distance_question
from focalgradient.scales import Control, Scale, Steps, Ways
from focalgradient.stimuli import PAPERS, Stimulus, replica

__all__ = ["ASKED", "Asked"]


Text = Callable[[str], str]
"""Function that returns a text of the task by name, in the participant's language."""

SIDES = ("left", "right")
QUADRANTS = ("upper right", "upper left", "lower left", "lower right")
LEAST_M, MOST_M = 0.05, 2000.0
"""Ends of the distance scale, in metres (our choice)."""


class Asked(ABC):
    """Question about the replicas of one paper.

    Parameters
    ----------
    paper
        Key in `focalgradient.stimuli.PAPERS`.
    """

    name: ClassVar[str]
    """Prefix of the names of its texts."""
    places: ClassVar[tuple[Literal[1, 2], ...]] = (1,)
    """Intervals that may contain the picture of the condition."""
    is_ratio: ClassVar[bool] = False
    """True if answers are analysed on their logarithm."""
    pixels_per_degree: ClassVar[float]
    """Resolution of the pictures shown to simulated observers (our choice)."""

    def __init__(self, paper: str) -> None:
        self.paper = paper

    @property
    def conditions(self) -> tuple[str, ...]:
        """Names of the conditions shown."""
        return tuple(PAPERS[self.paper].conditions)

    def drawn(self, condition: str, place: int, pixels_per_degree: float, seed: int) -> tuple[Stimulus, ...]:
        """Draw the stimuli of a trial, one per interval."""
        return (replica(self.paper, condition, pixels_per_degree=pixels_per_degree, seed=seed),)

    @abstractmethod
    def control(self, text: Text) -> Control:
        """Return the description of the response control."""

    @abstractmethod
    def value(self, condition: str, place: int, given: float) -> float:
        """Convert the response given on the control to the recorded answer."""

    @abstractmethod
    def simulate(self, observer: Observer, drawn: tuple[Stimulus, ...], chance: np.random.Generator) -> float:
        """Return the response of a simulated observer who looks at the pictures."""


class NearerSide(Asked):
    """Nearer of two textures; the answer is 1 if the blurred one is chosen, else 0."""

    name = "order"
    pixels_per_degree = 60.0

    def drawn(self, condition: str, place: int, pixels_per_degree: float, seed: int) -> tuple[Stimulus, ...]:
        """Draw the stimulus of a trial."""
        size = {"width_deg": 5.0, "height_deg": 5.0}
        return (replica(self.paper, condition, pixels_per_degree=pixels_per_degree, seed=seed, **size),)

    def control(self, text: Text) -> Control:
        """Return the description of the response control."""
        return Ways(text("order question"), (text("left"), text("right")))

    def value(self, condition: str, place: int, given: float) -> float:
        """Convert the response to the recorded answer."""
        side = PAPERS[self.paper].conditions[condition][f"{SIDES[int(given) - 1]}_blur_arcmin"]
        return float(side > 0)

    def simulate(self, observer: Observer, drawn: tuple[Stimulus, ...], chance: np.random.Generator) -> float:
        """Return the response of a simulated observer."""
        (stimulus,) = drawn
        order = DepthOrder(first=stimulus.masks["left"], second=stimulus.masks["right"])
        answer = observer.look(stimulus.picture, displayed(stimulus), order).simulate(chance)
        return 1.0 if answer == "first" else 2.0


class MoreBlurredInterval(Asked):
    """Interval with the more blurred edge; the answer is 1 if correct, else 0."""

    name = "intervals"
    places = (1, 2)
    pixels_per_degree = 60.0

    @property
    def conditions(self) -> tuple[str, ...]:
        """Names of the conditions with an increment, as no answer is correct without one."""
        return tuple(name for name, given in PAPERS[self.paper].conditions.items() if given["increment_arcmin"] > 0)

    def drawn(self, condition: str, place: int, pixels_per_degree: float, seed: int) -> tuple[Stimulus, ...]:
        """Draw the stimuli of a trial."""
        more = replica(self.paper, condition, pixels_per_degree=pixels_per_degree)
        standard = replica(self.paper, condition, pixels_per_degree=pixels_per_degree, increment_arcmin=0.0)
        return (more, standard) if place == 1 else (standard, more)

    def control(self, text: Text) -> Control:
        """Return the description of the response control."""
        return Ways(text("intervals question"), (text("first"), text("second")))

    def value(self, condition: str, place: int, given: float) -> float:
        """Convert the response to the recorded answer."""
        return float(int(given) == place)

    def simulate(self, observer: Observer, drawn: tuple[Stimulus, ...], chance: np.random.Generator) -> float:
        """Return the response of a simulated observer."""
        first, second = drawn
        answer = observer.look(first.picture, displayed(first), BlurDiscrimination(second.picture)).simulate(chance)
        return 1.0 if answer == "first" else 2.0


class MoreBlurredQuadrant(Asked):
    """More blurred quadrant of an annulus; the answer is 1 if correct, else 0."""

    name = "quadrant"
    pixels_per_degree = 32.0

    def control(self, text: Text) -> Control:
        """Return the description of the response control."""
        return Steps(text("quadrant question"), "", 1, len(QUADRANTS), [text(name) for name in QUADRANTS])

    def value(self, condition: str, place: int, given: float) -> float:
        """Convert the response to the recorded answer."""
        return float(QUADRANTS[int(given) - 1] == PAPERS[self.paper].conditions[condition]["quadrant"])

    def simulate(self, observer: Observer, drawn: tuple[Stimulus, ...], chance: np.random.Generator) -> float:
        """Choose the largest of four log blurs, with errors according to the Weber fraction of pairwise comparison."""
        (stimulus,) = drawn
        height, width = stimulus.shape
        seen = look(stimulus.picture, displayed(stimulus), (width / 2, height / 2), observer)
        blurs = [_region_blur(seen.blur, seen.blur_log_sd, region) for region in _quadrants(stimulus.masks["annulus"])]
        pair_sd = math.log1p(observer.weber) / float(ndtri(0.75))
        logs = [
            math.log(math.hypot(blur, observer.intrinsic)) + chance.normal(0, math.hypot(pair_sd / math.sqrt(2), sd))
            for blur, sd in blurs
        ]
        looks = not observer.guesses and chance.random() >= observer.lapses
        return float(np.argmax(logs) + 1) if looks else float(chance.integers(1, len(QUADRANTS) + 1))


def _quadrants(annulus: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
    """Divide a mask into the parts named in `QUADRANTS`."""
    down, right = (np.indices(annulus.shape).T - (np.array(annulus.shape) - 1) / 2).T
    signs = ((-1, 1), (-1, -1), (1, -1), (1, 1))
    return [annulus & (vertical * down > 0) & (horizontal * right > 0) for vertical, horizontal in signs]


def _region_blur(blur: FloatArray, log_sd: FloatArray, region: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the blur (arcmin) of a region and the SD of its logarithm, precision-weighted over its interior places."""
    share = block_means(region)
    share = np.where(share >= share.max() / 2, share, 0.0)
    weight = np.where(np.isfinite(blur) & (blur > 0), share / np.maximum(log_sd, 1e-6) ** 2, 0.0)
    if not weight.sum() > 0:
        return 0.0, math.inf
    log = float((weight * np.log(np.where(weight > 0, blur, 1.0))).sum() / weight.sum())
    return math.exp(log), float(weight.sum() ** -0.5)


class DistanceInMetres(Asked):
    """Perceived distance of the picture's centre in metres, with each blur of the paper and without blur."""

    name = "distance"
    is_ratio = True
    pixels_per_degree = 20.0

    @property
    def conditions(self) -> tuple[str, ...]:
        """Names of the paper's conditions, and of each gradient's picture without blur."""
        return (*super().conditions, *self._unblurred)

    @property
    def _unblurred(self) -> dict[str, str]:
        """Condition whose picture is drawn without blur, by the name of the unblurred condition."""
        return {f"{name.split(',')[0]}, no blur": name for name in reversed(super().conditions)}

    def drawn(self, condition: str, place: int, pixels_per_degree: float, seed: int) -> tuple[Stimulus, ...]:
        """Draw a picture, through a pinhole in conditions without blur."""
        drawn = self._unblurred.get(condition, condition)
        others: Mapping[str, float] = NO_BLUR if drawn != condition else {}
        return (replica(self.paper, drawn, pixels_per_degree=pixels_per_degree, seed=seed, **others),)

    def control(self, text: Text) -> Control:
        """Return the description of the response control."""
        ends = (text("near"), text("far"))
        return Scale(text("distance question"), "", LEAST_M, MOST_M, ratios=True, ends=ends)

    def value(self, condition: str, place: int, given: float) -> float:
        """Convert the response to the recorded answer."""
        return float(given)

    def simulate(self, observer: Observer, drawn: tuple[Stimulus, ...], chance: np.random.Generator) -> float:
        """Return the response of a simulated observer."""
        (stimulus,) = drawn
        question = distance_question(stimulus.depth_m, EXPECTED_M[self.paper])
        answer = observer.look(stimulus.picture, displayed(stimulus), question).simulate(chance)
        return float(np.clip(answer, LEAST_M, MOST_M))


ASKED: Mapping[str, Asked] = {
    asked.paper: asked
    for asked in (
        NearerSide("mather1996"),
        NearerSide("mather2002"),
        NearerSide("marshall1996"),
        MoreBlurredInterval("watson2011"),
        MoreBlurredQuadrant("maiello2017"),
        DistanceInMetres("held2010"),
        DistanceInMetres("vishwanath2010"),
    )
}
"""Questions by the paper's key in the bibliography."""
