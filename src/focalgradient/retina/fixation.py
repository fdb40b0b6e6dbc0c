"""Fixational eye movements: slow drift and microsaccades.

Drift is a random walk whose mean square displacement is 4 D t, D its diffusion constant. Microsaccades occur at random
times with a minimum interval, directed partly back to the starting direction of gaze.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import shift

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_finite, check_number
from focalgradient.eye.ranges import ordered_times
from focalgradient.quantities import Range, Seed

__all__ = ["FixationalMovements"]

STEP = 0.001
"""Time step of the path in seconds."""

PAUSE = 0.1
"""Minimum interval between microsaccades in seconds: a choice, below the shortest intervals that are usual."""

FASTEST = 9.0
"""Maximum rate of microsaccades per second: with `PAUSE` none above 10 is possible."""

RETURN = 0.5
"""Share of a microsaccade's direction that points back to the starting direction of gaze; the rest is random: a
choice."""


@dataclass(frozen=True, slots=True)
class FixationalMovements:
    """Direction of gaze over time, one path for each seed; microsaccades are instantaneous (within 1 ms).

    Parameters
    ----------
    diffusion
        Diffusion constant of drift in minutes of arc squared per second: about 10 to 40 in people (Kuang, Poletti,
        Victor & Rucci 2012; Aytekin, Victor & Rucci 2014; the range is from memory).
    rate
        Microsaccades per second, at most 9: about 1 to 2 in steady fixation (Martinez-Conde, Macknik & Hubel 2004).
    amplitude
        Median amplitude of microsaccades in minutes of arc; its logarithm has a standard deviation of 0.5: most are
        below half a degree. Values are our choice within the usual range.
    seed
        Random seed of the path.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> path = FixationalMovements(seed=2).at(np.arange(0, 1, 0.25))
    >>> path.shape, bool(60 * np.degrees(np.abs(path)).max() < 90)
    ((4, 2), True)
    """

    diffusion: Annotated[float, Range("minutes of arc squared per second", 0)] = 20.0
    rate: Annotated[float, Range("microsaccades per second", 0, FASTEST)] = 1.5
    amplitude: Annotated[float, Range("minutes of arc", 0)] = 15.0
    seed: Seed = 0

    def __post_init__(self) -> None:
        check_fields(self)

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the direction of gaze in radians, x to the right and y down, at `times` (s, 0 or more): n x 2."""
        moments = np.atleast_1d(ordered_times(times))
        check_number("the first time", float(moments[0]), "seconds", least=0)
        count = math.ceil(float(moments[-1]) / STEP) + 2
        drift, saccades = (np.random.default_rng([self.seed, part]) for part in range(2))
        steps = math.sqrt(2 * self.diffusion * STEP) * drift.standard_normal((count, 2))
        steps[0] = 0
        place = np.cumsum(steps, axis=0)
        time = 0.0
        while self.rate > 0:
            time += PAUSE + saccades.exponential(1 / self.rate - PAUSE)  # 1 / rate on average
            start = math.ceil(time / STEP)
            size = self.amplitude * math.exp(0.5 * saccades.standard_normal())
            turn = saccades.uniform(0, 2 * math.pi)
            if start >= count:
                break
            here = place[start]
            back = -here / max(float(np.hypot(*here)), 1e-9)
            way = RETURN * back + (1 - RETURN) * np.array([math.cos(turn), math.sin(turn)])
            place[start:] += size * way / max(float(np.hypot(*way)), 1e-9)
        grid = STEP * np.arange(count)
        path = np.column_stack([np.interp(moments, grid, column) for column in place.T])
        return np.radians(path / 60)

    def moved(self, image: ArrayLike, times: ArrayLike, *, pixel_angle: float) -> FloatArray:
        """Return an image as it lies on the retina at `times` (s), in coordinates fixed to the retina.

        Gaze to the right moves it to the left. Interpolated by cubic splines; beyond its rim the rim is repeated.

        Parameters
        ----------
        image
            Image, H x W or H x W x channels: blurred, as blur moves with gaze; of a size that contains the path.
        times
            n times in seconds, increasing from 0 or later.
        pixel_angle
            Angle of a pixel in radians.

        Returns
        -------
        ndarray
            n x H x W or n x H x W x channels.

        Raises
        ------
        InputError
            If the image has no two dimensions, or a number is out of range.

        Examples
        --------
        >>> movements, image = FixationalMovements(rate=0.0, seed=1), np.random.default_rng(0).uniform(size=(32, 32))
        >>> on_retina = movements.moved(image, [0.0, 0.5], pixel_angle=np.radians(1 / 60))
        >>> on_retina.shape, bool(np.allclose(on_retina[0], image)), bool(np.allclose(on_retina[1], image))
        ((2, 32, 32), True, False)
        """
        light = check_finite("image", image, "linear light")
        check_number("pixel_angle", pixel_angle, "radians", positive=True)
        if light.ndim not in (2, 3):
            raise InputError(f"image has shape {light.shape}, but must be H x W or H x W x channels.")
        still = (0.0,) * (light.ndim - 2)
        pixels = self.at(times) / pixel_angle
        return np.stack([shift(light, (-down, -right, *still), mode="nearest") for right, down in pixels.tolist()])
