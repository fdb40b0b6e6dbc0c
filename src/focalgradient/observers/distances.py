"""Absolute distance from blur: other cues give the layout, and blur its scale (Held et al. 2010).

A point r times as far as the fixated one, which is at D metres, is out of focus by (1 - 1 / r) / D dioptres: for a
given relative layout, more blur indicates a nearer, and thus smaller, scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.errors import InputError, check_fields
from focalgradient.observers.front_end import block_means, blur_of, check_fixation, fixated_blur, seen_by
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import defocus
from focalgradient.quantities import Range

__all__ = ["DistanceOfFixated", "Magnitude", "RelativeLayout"]


DISTANCES = np.geomspace(0.02, 1000.0, 600)
"""Candidate distances in metres: from nearer than any eye focuses to where blur is negligible."""

INDEPENDENT = 24
"""Effective number of independent blur estimates: neighbouring ones share receptive fields and texture (our choice)."""


@dataclass(frozen=True, slots=True)
class Magnitude:
    """Log-normally distributed answer, a positive number.

    Parameters
    ----------
    median
        Median in the unit of the question.
    log_sd
        Root-mean-square deviation of the logarithm from that of the median.

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
    """Scene layout as given by other cues (perspective, familiar size).

    Parameters
    ----------
    distance
        Distance of the surface at each pixel, H x W, in arbitrary units, as only ratios matter; ``inf`` is allowed.
    expected_m
        Distance of the fixated point suggested by other cues, in metres.
    log_sd
        Standard deviation of its logarithm; large if other cues are uninformative.
    """

    distance: FloatArray
    expected_m: Annotated[float, Range("metres", positive=True)] = 1.0
    log_sd: Annotated[float, Range("natural logarithms", positive=True)] = 3.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "distance", np.asarray(self.distance, float))
        check_fields(self)
        if self.distance.ndim != 2 or not (self.distance > 0).all():
            raise InputError("distance of a layout must be an array of positive numbers, H x W: one for each pixel.")


@dataclass(frozen=True, slots=True, eq=False)
class DistanceOfFixated:
    """Question for the perceived distance of the fixated point, in metres.

    Parameters
    ----------
    layout
        Layout as given by other cues.
    fixation
        Fixated point in pixels from the upper left corner, right and down; it is in focus.
    """

    layout: RelativeLayout
    fixation: tuple[float, float]

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> Magnitude:
        """Return the product of the layout's prior and the likelihood of blur at all places.

        The blur at each place has an error of one Weber fraction, and an additional misfit of unknown variance, over
        which the likelihood is integrated: if the layout does not explain the variation of blur, blur has little
        influence (Held et al. 2010: blur inconsistent with the layout changes perceived size less). The Weber fraction
        is also the error of the scale of all blurs. With probability 1 - `defocus` the blur belongs to the texture and
        is uninformative.
        """
        (seen,), slope = seen_by([light], display, observer.pupil)
        distance = self.layout.distance
        if distance.shape != seen.shape:
            raise InputError(f"the layout has shape {distance.shape}, but must have that of the picture, {seen.shape}.")
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
        arcmin = np.abs(1 - nearness[known]) / defocus(np.array(1.0), observer)  # blur at a distance of one metre
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
