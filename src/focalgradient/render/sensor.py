"""Sensor noise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from focalgradient.errors import InputError, check_seed
from focalgradient.view import View

__all__ = ["noisy"]


def noisy(view: View, sd: float, seed: int) -> View:
    """Return the view with independent Gaussian noise added to every pixel.

    Parameters
    ----------
    view
        Any view, which is not modified.
    sd
        Standard deviation of the noise, in the image's unit.
    seed
        Random seed of the noise; use different seeds for two views of one scene.

    Raises
    ------
    InputError
        If `sd` is negative or not finite, or `seed` is not an integer of 0 or more.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> view = noisy(View(np.ones((100, 100)), Lens(0.025, 4, 1.0), 3e-4), sd=0.01, seed=0)
    >>> round(float(view.image.std()), 3)
    0.01
    """
    if not (sd >= 0 and math.isfinite(sd)):
        raise InputError(
            f"sd is {sd!r}, but must be a finite standard deviation of 0 or more: give it in the image's unit."
        )
    check_seed(seed)
    noise = sd * np.random.default_rng(seed).standard_normal(view.shape)
    return replace(view, image=(view.image + noise).astype(view.image.dtype))
