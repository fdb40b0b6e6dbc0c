"""Binocular disparity between two pictures, estimated at grid points by correlation."""

from __future__ import annotations

import math

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers.front_end import DARK, block_means

__all__ = ["disparity_at_places"]


WIDEST = 120.0
"""Maximum disparity searched, in arcmin (our choice)."""

CORRELATION = 0.5
"""Minimum interocular correlation of a valid disparity (our choice)."""


def disparity_at_places(left: FloatArray, right: FloatArray, display: Display) -> FloatArray:
    """Estimate disparity in arcmin at grid points (rows x columns); NaN where the pictures do not match.

    The sign is position in the left eye minus position in the right eye, to the right: positive (crossed) for objects
    nearer than the display.

    Raises
    ------
    InputError
        If the pictures differ in shape.

    Examples
    --------
    >>> texture = np.random.default_rng(1).uniform(0.2, 0.8, (96, 160))
    >>> display = Display()
    >>> shifted = disparity_at_places(texture, np.roll(texture, -3, axis=1), display)
    >>> bool(abs(np.nanmedian(shifted) / display.arcmin(1.0) - 3) < 0.1)
    True
    """
    left_log, right_log = (np.log(np.maximum(np.asarray(light, float), 0) + DARK) for light in (left, right))
    if left_log.ndim != 2 or left_log.shape != right_log.shape:
        raise InputError(
            f"right has shape {right_log.shape}, but must have that of the left picture, {left_log.shape}."
        )
    reach = math.ceil(WIDEST / display.arcmin(1.0))
    shifts = np.arange(-reach, reach + 1)
    mean, square = block_means(left_log), block_means(left_log**2)
    scores = []
    for shift in shifts:
        moved = np.roll(right_log, shift, axis=1)
        average = block_means(moved)
        spread = (square - mean**2) * (block_means(moved**2) - average**2)
        scores.append((block_means(left_log * moved) - mean * average) / np.sqrt(np.maximum(spread, 1e-12)))
    score = np.array(scores)
    highest = score.argmax(0)
    best = np.clip(highest, 1, len(shifts) - 2)
    before, peak, after = (np.take_along_axis(score, best[None] + step, 0)[0] for step in (-1, 0, 1))
    curve = np.minimum(before - 2 * peak + after, -1e-9)
    shift = shifts[best] + np.clip(0.5 * (before - after) / curve, -0.5, 0.5)
    return np.where((score.max(0) > CORRELATION) & (highest == best), display.arcmin(1.0) * shift, np.nan)
