"""Thresholds of blur and defocus: detection, discrimination, the dipper function, and blur beside disparity."""

from __future__ import annotations

import math

import numpy as np

from focalgradient.observers import Observer, blur_threshold
from focalgradient.observers.perception import SD_PER_RADIUS
from focalgradient.published.record import Prediction

__all__ = [
    "blur_over_disparity",
    "blur_weight_change",
    "detection",
    "dip",
    "discrimination",
    "successive_discrimination",
    "threshold_ratio",
    "weber_fraction",
]

PEDESTALS = np.linspace(0.0, 4.0, 161)
"""Pedestals of blur (arcmin) searched for the minimum of the dipper (our choice)."""

STEPS = 4
"""Number of successive just noticeable increments of defocus (our choice)."""

NEAR_D, AWAY_D = 0.0, 2.0
"""Distances (D) from fixation that represent "near" and "away from" fixation (our choice)."""


def weber_fraction(observer: Observer, pedestal: float) -> Prediction:
    """Return the Weber fraction: just noticeable increment of blur divided by the pedestal (arcmin)."""
    return Prediction(blur_threshold(pedestal, observer) / pedestal)


def dip(observer: Observer) -> Prediction:
    """Return the ratio of the smallest blur threshold to the threshold without a pedestal."""
    return Prediction(
        min(blur_threshold(float(pedestal), observer) for pedestal in PEDESTALS) / blur_threshold(0.0, observer)
    )


def _arcmin(dioptres: float, observer: Observer) -> float:
    """Return the blur (SD, arcmin) of a defocus (D) for the observer's pupil."""
    return math.degrees(dioptres * observer.pupil / 2 * SD_PER_RADIUS) * 60


def detection(observer: Observer) -> Prediction:
    """Return the just noticeable defocus (D) of a sharp target, for the observer's pupil."""
    return discrimination(observer, 0.0)


def discrimination(observer: Observer, pedestal: float) -> Prediction:
    """Return the just noticeable increment of defocus (D) for a defocus pedestal (D), for the observer's pupil."""
    return Prediction(blur_threshold(_arcmin(pedestal, observer), observer) / _arcmin(1.0, observer))


def successive_discrimination(observer: Observer) -> Prediction:
    """Return the mean of the successive just noticeable increments of defocus (D) after the first."""
    reached, steps = detection(observer).value, []
    for _ in range(STEPS):
        steps.append(discrimination(observer, reached).value)
        reached += steps[-1]
    return Prediction(float(np.mean(steps)))


def threshold_ratio(observer: Observer, pedestal: float, other: float) -> Prediction:
    """Return the ratio of the just noticeable increments for two defocus pedestals (D)."""
    return Prediction(discrimination(observer, pedestal).value / discrimination(observer, other).value)


def blur_over_disparity(observer: Observer, away: float) -> Prediction:
    """Return the ratio of the depth thresholds (D) by blur and by disparity, at a distance (D) from fixation."""
    by_disparity = math.radians(observer.stereo / 60) / observer.interocular
    return Prediction(discrimination(observer, away).value / by_disparity)


def blur_weight_change(observer: Observer) -> Prediction:
    """Return the change in the weight of blur from near to away from fixation, with inverse-variance weights."""
    near, away = (1 / (1 + blur_over_disparity(observer, distance).value ** 2) for distance in (NEAR_D, AWAY_D))
    return Prediction(away - near)
