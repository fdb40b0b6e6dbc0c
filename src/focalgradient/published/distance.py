"""Perceived absolute distance from the blur of pictures (Held et al. 2010; Vishwanath and Blaser 2010)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.observers import DistanceOfFixated, Observer, RelativeLayout
from focalgradient.published.record import Prediction, ratio_of
from focalgradient.stimuli import PAPERS, Stimulus, replica

__all__ = ["displayed", "distance_question", "judged_over"]

SEEDS = range(3)
"""Seeds of the towns and textures whose distance is judged (our choice)."""

NO_BLUR = {"pupil_mm": 0.0}

EXPECTED_M = {"held2010": 783.0, "vishwanath2010": 1.0}
"""Distance (m) of the centre suggested by other cues, in all pictures of a paper: that of the town's scene; for planes,
our choice.
"""


def displayed(drawn: Stimulus) -> Display:
    """Return a display with the picture's own pixels per degree."""
    usual = Display()
    return replace(usual, distance=usual.distance / (math.degrees(drawn.pixel_angle) * usual.pixels_per_degree))


def distance_question(depth: FloatArray, expected_m: float) -> DistanceOfFixated:
    """Return the question for the distance of a picture's centre, given a relative layout and an expected distance."""
    height, width = depth.shape
    return DistanceOfFixated(RelativeLayout(depth, expected_m=expected_m), (width / 2, height / 2))


@lru_cache(maxsize=256)
def _log_distance(
    observer: Observer, paper: str, condition: str, seed: int, is_blurred: bool = True, turned: bool = False
) -> float:
    """Return the log judged distance (m) of the centre of a replica, without blur or with the layout transposed."""
    drawn = replica(paper, condition, seed=seed, **({} if is_blurred else NO_BLUR))
    question = distance_question(drawn.depth_m.T if turned else drawn.depth_m, EXPECTED_M[paper])
    return math.log(observer.look(drawn.picture, displayed(drawn), question).median)


def _unblurred(paper: str, condition: str) -> str:
    """Return the first condition with the same gradient, whose unblurred picture is identical."""
    return next(name for name in PAPERS[paper].conditions if name.split()[0] == condition.split()[0])


def judged_over(
    observer: Observer,
    paper: str,
    conditions: Sequence[str],
    other: Sequence[str] | None = None,
    turned: bool = False,
) -> Prediction:
    """Return the ratio of judged distances to those of other conditions, or without blur: geometric mean."""
    logs = []
    for number, condition in enumerate(conditions):
        for seed in SEEDS:
            log_distance = _log_distance(observer, paper, condition, seed, turned=turned)
            beside = _unblurred(paper, condition) if other is None else other[number]
            logs.append(log_distance - _log_distance(observer, paper, beside, seed, other is not None, turned))
    return ratio_of(logs)
