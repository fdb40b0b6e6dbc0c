"""Distance in metres by blur: other cues give the layout, and blur its scale (Held et al. 2010).

A place r times as far as the fixated one, which is D metres away, is out of focus by (1 - 1 / r) / D dioptres: a layout
that is known up to its scale has more blur the nearer, and so the smaller, it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers.front_end import block_means, blur_of, check_fixation, fixated_blur, seen_by
from focalgradient.observers.looking import defocus
from focalgradient.observers.observer import Observer

__all__ = ["DistanceOfFixated", "Magnitude", "RelativeLayout"]

FloatArray = NDArray[np.float64]

DISTANCES = np.geomspace(0.02, 1000.0, 600)
"""Metres among which a distance is: from nearer than any eye focuses to where blur has no part."""

INDEPENDENT = 24
"""Places whose blurs err independently: neighbours are looked at through the same fields, and share textures; ours."""


@dataclass(frozen=True, slots=True)
class Magnitude:
    """An answer that is a positive number, log-normally distributed.

    Parameters
    ----------
    median
        In the question's unit.
    log_sd
        Root mean square departure of its logarithm from that of the median.

    Examples
    --------
    >>> round(Magnitude(2.0, 0.1).simulate(np.random.default_rng(1)), 2)
    2.07
    """

    median: float
    log_sd: float

    def simulate(self, random: np.random.Generator) -> float:
        """Draw one answer."""
        return self.median * math.exp(self.log_sd * random.standard_normal())


@dataclass(frozen=True, slots=True, eq=False)
class RelativeLayout:
    """What other cues (perspective, known size) give of a scene.

    Parameters
    ----------
    distance
        Of what each pixel shows, H x W, in any unit: only ratios count; ``inf`` is allowed.
    expected_m
        Distance of the fixated point that the cues suggest, in metres.
    log_sd
        How surely: standard deviation of its logarithm; large where they leave it open.
    """

    distance: FloatArray
    expected_m: float = 1.0
    log_sd: float = 3.0

    def __post_init__(self) -> None:
        distance = np.asarray(self.distance, float)
        if distance.ndim != 2 or not (distance > 0).all():
            raise InputError("distance of a layout must be an array of positive numbers, H x W: one for each pixel.")
        for name in ("expected_m", "log_sd"):
            value = getattr(self, name)
            if not (value > 0 and math.isfinite(value)):
                raise InputError(f"{name} of a layout is {value!r}, but must be a positive finite number.")


@dataclass(frozen=True, slots=True, eq=False)
class DistanceOfFixated:
    """How far away the fixated point looks, in metres; sizes go with it.

    Parameters
    ----------
    layout
        What other cues give.
    fixation
        Pixels from the upper left corner, right and down; what lies there is in focus.
    """

    layout: RelativeLayout
    fixation: tuple[float, float]

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> Magnitude:
        """Answer by the product of what the layout suggests and the likelihood of blur at all places.

        Places err by Weber's fraction and by a misfit of unknown variance, over which the likelihood is integrated:
        where the layout does not explain how blur differs over the picture, blur says little (Held et al. 2010: blur at
        odds with the layout changes perceived size less). Weber's error is once more that of all places, as the scale
        of blur is an observer's own. With 1 - defocus blur is the texture's and tells nothing.
        """
        (seen,), slope = seen_by([light], display, observer.pupil)
        distance = np.asarray(self.layout.distance, float)
        if distance.shape != seen.shape:
            raise InputError(
                f"the layout is of shape {distance.shape}, but the picture of {seen.shape}: give one of it."
            )
        check_fixation(self.fixation, seen.shape)
        right, down = (math.floor(at) for at in self.fixation)
        estimated = blur_of(seen, slope, display, observer.pupil)
        nearness = block_means(distance[down, right] / distance)
        known = np.isfinite(estimated.log_sd)
        minute = display.arcmin(1.0)
        focused = math.hypot(
            fixated_blur(estimated, self.fixation, display.pixels_per_degree) * minute, observer.intrinsic
        )
        blur = np.hypot(minute * np.exp(estimated.log_blur[known]), observer.intrinsic)
        arcmin = np.abs(1 - nearness[known]) / defocus(np.array(1.0), observer)  # of blur, at one metre
        expected = np.hypot(arcmin / DISTANCES[:, None], focused)
        each = np.hypot(estimated.log_sd[known], observer.weber)
        weight = each**-2.0 / (each**-2.0).sum()
        misfit = observer.weber**2 + np.log(blur / expected) ** 2 @ weight
        cost = min(INDEPENDENT, each.size) * np.log(misfit)
        log = np.log(DISTANCES)
        fits = np.exp(-(cost - cost.min()) / 2)
        spread = np.exp(-(((log[:, None] - log) / observer.weber) ** 2) / 2) @ (fits / fits.sum())
        prior = np.exp(-(((log - math.log(self.layout.expected_m)) / self.layout.log_sd) ** 2) / 2)
        with_blur, without = prior * spread, prior / prior.sum()
        posterior = observer.defocus * with_blur / with_blur.sum() + (1 - observer.defocus) * without
        middle = float(np.interp(0.5, np.cumsum(posterior), log))
        return Magnitude(math.exp(middle), math.sqrt(float(posterior @ (log - middle) ** 2)))
