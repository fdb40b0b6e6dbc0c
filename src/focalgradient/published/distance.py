"""Perceived absolute distance from the blur of pictures (Held et al. 2010; Vishwanath and Blaser 2010)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from math import inf

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.observers import DistanceOfFixated, Observer, RelativeLayout
from focalgradient.published.record import Finding, Prediction, Published, ratio_of
from focalgradient.stimuli import PAPERS, Stimulus, replica

__all__ = ["RECORDS", "displayed", "distance_question", "judged_over"]

SEEDS = range(3)
"""Seeds of the towns and textures whose distance is judged (our choice)."""

NO_BLUR = {"pupil_mm": 0.0}

EXPECTED_M = {"held2010": 783.0, "vishwanath2010": 1.0}
"""Distance (m) of the centre suggested by other cues, in all pictures of a paper: that of the town's scene; for planes,
our choice.
"""

OWN_MODEL = "that blur gives a known layout its scale (the model of Held et al.)"
PLANES = "3 textures and both gradients; the layout is the plane's own up to its scale, at a metre in all pictures."
ACROSS = "3 textures; the layout is a plane that is slanted at right angles to the gradient of blur."

Turn = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def displayed(drawn: Stimulus) -> Display:
    """Return a display with the picture's own pixels per degree."""
    usual = Display()
    return replace(usual, distance=usual.distance / (math.degrees(drawn.pixel_angle) * usual.pixels_per_degree))


def distance_question(depth: NDArray[np.float64], expected_m: float) -> DistanceOfFixated:
    """Return the question for the distance of a picture's centre, given a relative layout and an expected distance."""
    height, width = depth.shape
    return DistanceOfFixated(RelativeLayout(depth, expected_m=expected_m), (width / 2, height / 2))


def _kept(depth: NDArray[np.float64]) -> NDArray[np.float64]:
    return depth


@lru_cache(maxsize=256)
def _log_distance(
    observer: Observer, paper: str, condition: str, seed: int, is_blurred: bool = True, layout: Turn = _kept
) -> float:
    """Return the log judged distance (m) of the centre of a replica, with or without blur."""
    drawn = replica(paper, condition, seed=seed, **({} if is_blurred else NO_BLUR))
    question = distance_question(layout(drawn.depth_m), EXPECTED_M[paper])
    return math.log(observer.look(drawn.picture, displayed(drawn), question).median)


def _unblurred(paper: str, condition: str) -> str:
    """Return the first condition with the same gradient, whose unblurred picture is identical."""
    return next(one for one in PAPERS[paper].conditions if one.split()[0] == condition.split()[0])


def judged_over(
    observer: Observer,
    paper: str,
    conditions: tuple[str, ...],
    other: tuple[str, ...] | None = None,
    layout: Turn = _kept,
) -> Prediction:
    """Return the ratio of judged distances to those of other conditions, or without blur: geometric mean."""
    logs = []
    for number, condition in enumerate(conditions):
        for seed in SEEDS:
            own = _log_distance(observer, paper, condition, seed, layout=layout)
            beside = _unblurred(paper, condition) if other is None else other[number]
            logs.append(own - _log_distance(observer, paper, beside, seed, other is not None, layout))
    return ratio_of(logs)


GRADIENTS = tuple(PAPERS["vishwanath2010"].conditions)

RECORDS = (
    Published(
        key="held2010",
        citation="Held, Cooper, O'Brien and Banks 2010, ACM Trans. Graphics 29(2), 19",
        doi="10.1145/1731047.1731057",
        design="People judged the distance of a city in pictures with blur that is consistent with a simulated "
        "distance, a planar gradient along or across it, or none.",
        conditions=tuple(PAPERS["held2010"].conditions),
        settings={"task": "published", "experiment": "held2010"},
        findings=(),
    ),
    Published(
        key="vishwanath2010",
        citation="Vishwanath and Blaser 2010, J. Vision 10(10), 26",
        doi="",
        design="People judged the distance of surfaces with and without a vertical or a horizontal gradient of blur.",
        conditions=tuple(PAPERS["vishwanath2010"].conditions),
        settings={"task": "published", "experiment": "vishwanath2010"},
        findings=(
            Finding(
                quantity="judged distance with the gradient of blur over that without",
                units="1",
                printed="surfaces with blur gradients were judged as significantly closer",
                low=-inf,
                high=1.0,
                source="abstract",
                taken=OWN_MODEL,
                ask=partial(judged_over, paper="vishwanath2010", conditions=GRADIENTS),
                remark=PLANES,
            ),
            Finding(
                quantity="judged distance with the gradient of 0.28 m over that with the gradient of 1.14 m",
                units="1",
                printed="the size of the effect modulated by the degree of blur",
                low=-inf,
                high=1.0,
                source="abstract",
                taken=OWN_MODEL,
                ask=partial(
                    judged_over,
                    paper="vishwanath2010",
                    conditions=tuple(one for one in GRADIENTS if "0.28" in one),
                    other=tuple(one for one in GRADIENTS if "1.14" in one),
                ),
                remark=PLANES,
            ),
            Finding(
                quantity="judged distance with the gradient across the slant over that without",
                units="1",
                printed="substantial changes in perceived distance regardless of relative depth relations of the "
                "surfaces indicated by other cues",
                low=-inf,
                high=1.0,
                source="abstract",
                ask=partial(judged_over, paper="vishwanath2010", conditions=GRADIENTS, layout=np.transpose),
                remark=ACROSS,
            ),
        ),
    ),
)
