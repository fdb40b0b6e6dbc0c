"""Ways to ask a simulated observer what people were asked: blur thresholds, order of depth at a border, focus."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from focalgradient.display import Display
from focalgradient.eye import Accommodation
from focalgradient.observers import DepthOrder, Observer, blur_threshold
from focalgradient.observers.perception import SD_PER_RADIUS
from focalgradient.published.following import LIGHTS, follow
from focalgradient.published.record import Prediction
from focalgradient.stimuli import replica

__all__ = [
    "blurred_nearer",
    "detection",
    "dip",
    "discrimination",
    "gain_ratio",
    "phase_difference",
    "successive_discrimination",
    "threshold_ratio",
    "weber_fraction",
]

PEDESTALS = np.linspace(0.0, 4.0, 161)
"""Pedestals of blur (arcmin) among which the dip is sought; the range is our choice."""

STEPS = 4
"""Successive just noticeable steps of defocus; our choice."""

SEEDS = range(4)
"""Textures by which the order of depth is asked; our choice."""

SIZE_DEG = 5.0
"""Width and height of the pictures in degrees; our choice."""

FINE = Display(distance=Display().distance * 60 / Display().pixels_per_degree)
"""Display of about 60 pixels per degree; our choice."""

SECONDS = 6.0
"""Duration of a trial of accommodation; our choice."""

TRIALS = 3
"""Pairs of trials in which the target moves the opposite ways; our choice."""


def weber_fraction(observer: Observer, pedestal: float) -> Prediction:
    """Just noticeable increment of blur over a pedestal (arcmin)."""
    return Prediction(blur_threshold(pedestal, observer) / pedestal)


def dip(observer: Observer) -> Prediction:
    """Smallest threshold of blur over the threshold without a pedestal."""
    return Prediction(min(blur_threshold(float(one), observer) for one in PEDESTALS) / blur_threshold(0.0, observer))


def _arcmin(dioptres: float, observer: Observer) -> float:
    """Blur (arcmin, standard deviation) of a defocus through the observer's pupil."""
    return math.degrees(dioptres * observer.pupil / 2 * SD_PER_RADIUS) * 60


def detection(observer: Observer) -> Prediction:
    """Just noticeable defocus (D) of a sharp target, through the observer's pupil."""
    return discrimination(observer, 0.0)


def discrimination(observer: Observer, pedestal: float) -> Prediction:
    """Just noticeable increment of defocus (D) upon a defocus (D), through the observer's pupil."""
    return Prediction(blur_threshold(_arcmin(pedestal, observer), observer) / _arcmin(1.0, observer))


def successive_discrimination(observer: Observer) -> Prediction:
    """Mean of the just noticeable steps of defocus (D) that follow the first, each upon all before it."""
    reached, steps = detection(observer).value, []
    for _ in range(STEPS):
        steps.append(discrimination(observer, reached).value)
        reached += steps[-1]
    return Prediction(float(np.mean(steps)))


def threshold_ratio(observer: Observer, pedestal: float, other: float) -> Prediction:
    """Just noticeable increment upon a defocus (D) over that upon another one (D)."""
    return Prediction(discrimination(observer, pedestal).value / discrimination(observer, other).value)


@lru_cache(maxsize=64)
def blurred_nearer(observer: Observer, paper: str, border: str) -> Prediction:
    """Share in which the blurred side of a paper's pictures looks nearer, with a "sharp" or a "blurred" border.

    Mean of the probability that the observer answers so, over both sides and `SEEDS`.
    """
    answers = []
    for sharp, blurred in (("left", "right"), ("right", "left")):
        for seed in SEEDS:
            drawn = replica(
                paper,
                f"{sharp} sharp, {border} border",
                pixels_per_degree=FINE.pixels_per_degree,
                width_deg=SIZE_DEG,
                height_deg=SIZE_DEG,
                seed=seed,
            )
            order = DepthOrder(first=drawn.masks[blurred], second=drawn.masks[sharp])
            answers.append(observer.look(drawn.picture, FINE, order).probability["first"])
    return _mean(answers)


@lru_cache(maxsize=64)
def _responses(pupil: float, light: str) -> tuple[complex, ...]:
    """Complex response of accommodation at the target's frequency in each pair of trials of opposite directions."""
    eye = Accommodation(pupil_diameter=pupil)
    return tuple(follow(eye, LIGHTS[light], SECONDS, seed).response for seed in range(TRIALS))


def gain_ratio(observer: Observer, light: str) -> Prediction:
    """Gain of accommodation in a light over that in white, through the observer's pupil."""
    pairs = zip(_responses(observer.pupil, light), _responses(observer.pupil, "white"), strict=True)
    return _mean([abs(one) / abs(white) for one, white in pairs])


def phase_difference(observer: Observer, light: str) -> Prediction:
    """Phase of accommodation in a light less that in white, in degrees; more lag is negative."""
    pairs = zip(_responses(observer.pupil, light), _responses(observer.pupil, "white"), strict=True)
    return _mean([math.degrees(float(np.angle(one / white))) for one, white in pairs])


def _mean(values: Sequence[float]) -> Prediction:
    """Mean and its standard error."""
    return Prediction(float(np.mean(values)), float(np.std(values, ddof=1)) / math.sqrt(len(values)))
