"""Questions for the perceived depth of a picture, and for its rating relative to another one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers.distances import Magnitude, RelativeLayout
from focalgradient.observers.encoding import encode_light
from focalgradient.observers.front_end import check_fixation
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import relief

__all__ = ["DepthExtent", "DepthRating"]


FIXATIONS = 20
"""Number of simulated fixations per answer, which determine its median and spread."""

SEED = 1987
"""Random seed of the errors within fixations, common to all pictures so that equal pictures look equally deep."""

GUESSES = math.log(4) / math.sqrt(3)
"""SD of the log of a rating without looking, log-uniform from 1/4 to 4."""


@dataclass(frozen=True, slots=True, eq=False)
class DepthExtent:
    """Question for the perceived depth of a picture: SD of perceived depth over its places, in dioptres.

    Parameters
    ----------
    layout
        Layout given by other cues, with relief (1 - nearness) / expected_m. None: a flat layout.
    fixation
        Fixated point in pixels from the upper left corner, right and down, which is in focus. None: the sharpest point.

    Examples
    --------
    Two halves of a texture on a flat layout, blurred by 1 and 4 arcmin: the perceived depth is due to blur.

    >>> from focalgradient.observers import OBSERVERS
    >>> from focalgradient.stimuli import texture_border
    >>> display = Display()
    >>> size = {"pixels_per_degree": display.pixels_per_degree, "width_deg": 8, "height_deg": 8}
    >>> drawn = texture_border(left_blur_arcmin=1, right_blur_arcmin=4, border="straight", **size)
    >>> for name in ("default", "blur-blind"):
    ...     print(name, OBSERVERS[name].look(drawn.picture, display, DepthExtent()).median > 0.03)
    default True
    blur-blind False
    """

    layout: RelativeLayout | None = None
    fixation: tuple[float, float] | None = None

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> Magnitude:
        """Answer by the percepts of `FIXATIONS` fixations, with the same inference as ratings in an experiment.

        Raises
        ------
        InputError
            If the layout differs in shape from the picture, or the fixation is missing or outside the picture.
        """
        shape = np.shape(light)
        if self.fixation is not None and len(shape) == 2:
            check_fixation(self.fixation, shape)
        distance = None
        if self.layout is not None:
            ratio = self.layout.distance
            if self.fixation is None or ratio.shape != shape:
                raise InputError(
                    f"the layout has shape {ratio.shape} and the fixation {self.fixation}, but it must have the "
                    f"picture's shape, {shape}, and a fixation: give both."
                )
            right, down = (math.floor(at) for at in self.fixation)
            distance = ratio * (self.layout.expected_m / ratio[down, right])
        (stimulus,) = encode_light(light, display, [self.fixation], distance, observer.pupil)
        random = np.random.default_rng(SEED)
        log = np.log([relief(stimulus, observer, random) for _ in range(FIXATIONS)])
        return Magnitude(float(np.exp(np.median(log))), float(log.std()))


@dataclass(frozen=True, slots=True, eq=False)
class DepthRating:
    """Question for the perceived depth of a picture relative to a standard, as a ratio.

    Parameters
    ----------
    standard
        Standard picture, relative to white.
    depth
        Layout and fixation of both pictures.
    standard_depth
        Layout and fixation of the standard; None: those of the picture.

    Examples
    --------
    >>> from focalgradient.observers import OBSERVERS
    >>> from focalgradient.stimuli import texture_border
    >>> display = Display()
    >>> size = {"pixels_per_degree": display.pixels_per_degree, "width_deg": 8, "height_deg": 8, "border": "straight"}
    >>> sharp, blurred = (texture_border(right_blur_arcmin=blur, **size).picture for blur in (0, 4))
    >>> OBSERVERS["default"].look(blurred, display, DepthRating(sharp)).median > 2
    True
    """

    standard: FloatArray
    depth: DepthExtent = field(default_factory=DepthExtent)
    standard_depth: DepthExtent | None = None

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> Magnitude:
        """Answer by the ratio of the depths to the power `scale`, with the scatter of repeated ratings."""
        if observer.guesses:
            return Magnitude(1.0, GUESSES)
        shown = self.depth.answer(light, display, observer)
        other = (self.standard_depth or self.depth).answer(self.standard, display, observer)
        ratio = (shown.median / other.median) ** observer.scale
        return Magnitude(ratio, math.hypot(observer.scale * math.hypot(shown.log_sd, other.log_sd), observer.scatter))
