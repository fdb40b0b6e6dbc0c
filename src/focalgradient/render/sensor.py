"""What a sensor adds to a view."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from focalgradient.errors import InputError, check_seed
from focalgradient.view import View

__all__ = ["noisy"]


def noisy(view: View, sd: float, seed: int) -> View:
    """The view with independent Gaussian noise added to every pixel.

    Parameters
    ----------
    view
        Any view; it is left as it is.
    sd
        Standard deviation of the noise, in the image's own unit.
    seed
        Seed of the noise: give two views of one scene different ones.

    Raises
    ------
    InputError
        If `sd` is negative or not finite, or `seed` no whole number of 0 or more.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> view = noisy(View(np.ones((100, 100)), Lens(0.025, 4, 1.0), 3e-4), sd=0.01, seed=0)
    >>> round(float(view.image.std()), 3)
    0.01
    """
    if not (sd >= 0 and math.isfinite(sd)):
        raise InputError(f"sd is {sd!r}, but must be a noise of 0 or more in the image's unit.")
    check_seed(seed)
    noise = sd * np.random.default_rng(seed).standard_normal(view.shape)
    return replace(view, image=(view.image + noise).astype(view.image.dtype))
