"""Sensor noise."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np

from focalgradient.errors import checked
from focalgradient.quantities import Range, Seed
from focalgradient.view import View

__all__ = ["noisy"]


@checked
def noisy(view: View, sd: Annotated[float, Range("the image's unit", 0)], seed: Seed) -> View:
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
    noise = sd * np.random.default_rng(seed).standard_normal(view.shape)
    return replace(view, image=(view.image + noise).astype(view.image.dtype))
