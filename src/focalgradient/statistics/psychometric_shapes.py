"""Sigmoids of psychometric functions, with derivatives; each equals 1/2 at the threshold."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import special

from focalgradient.errors import InputError, described

__all__ = ["SHAPES", "Shape", "shape_named"]

FloatArray = NDArray[np.float64]


class Shape(ABC):
    """Sigmoid F with F(0) = 1/2, as a function of the standardised level z = slope x (level - threshold)."""

    logarithmic: ClassVar[bool]
    """True for functions of the natural logarithm of the level: levels are positive, and thresholds are ratios."""
    words: ClassVar[str]

    @abstractmethod
    def values(self, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return F and its first and second derivatives."""


class Weibull(Shape):
    """Weibull function, 1 - 2^-(level / threshold)^slope."""

    logarithmic: ClassVar[bool] = True
    words: ClassVar[str] = "Weibull function"

    def values(self, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        rate = math.log(2) * np.exp(np.minimum(z, 40.0))
        missed = np.exp(-rate)
        return -np.expm1(-rate), rate * missed, rate * missed * (1 - rate)


class Logistic(Shape):
    """Logistic function 1 / (1 + exp(-z)) of the level."""

    logarithmic: ClassVar[bool] = False
    words: ClassVar[str] = "logistic function"

    def values(self, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        f = special.expit(z)
        return f, f * (1 - f), f * (1 - f) * (1 - 2 * f)


class Normal(Shape):
    """Cumulative normal function of the level."""

    logarithmic: ClassVar[bool] = False
    words: ClassVar[str] = "cumulative normal"

    def values(self, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        density = np.exp(-(z**2) / 2) / math.sqrt(2 * math.pi)
        return special.ndtr(z), density, -z * density


class LogNormal(Normal):
    """Cumulative normal function of the log level."""

    logarithmic: ClassVar[bool] = True
    words: ClassVar[str] = "cumulative normal of the logarithm"


SHAPES: dict[str, Shape] = {"weibull": Weibull(), "lognormal": LogNormal(), "logistic": Logistic(), "normal": Normal()}
"""Sigmoids by the name that `fit_psychometric_groups` accepts."""


def shape_named(shape: Shape | str) -> Shape:
    """Return the sigmoid with a name; a `Shape` of `SHAPES` is returned unchanged.

    Raises
    ------
    InputError
        If the name is unknown, or the `Shape` is not in `SHAPES`.

    Examples
    --------
    >>> shape_named("weibull").logarithmic
    True
    """
    if isinstance(shape, Shape):
        if not any(one is shape for one in SHAPES.values()):
            raise InputError(f"shape has the class {type(shape).__name__} and no name: add it, SHAPES['name'] = shape.")
        return shape
    if not (isinstance(shape, str) and shape in SHAPES):
        raise InputError(f"shape is {described(shape)}, but must be one of {', '.join(map(repr, SHAPES))}.")
    return SHAPES[shape]
