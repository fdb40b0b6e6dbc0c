"""Units and bounds of parameters, stated once beside their types: ``Annotated[float, MILLIMETRES]``.

Functions compute in SI units. A parameter annotated with ``MILLIMETRES.si`` is in metres, and users of the command line
give it in millimetres; one annotated with ``MILLIMETRES`` is in millimetres itself, as its name then says.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_finite, check_number, check_seed, described, is_number

__all__ = [
    "APERTURE_RATIO",
    "ARCMIN",
    "BODY",
    "CENTIMETRES",
    "DEGREES",
    "DIOPTRES",
    "FOCUS",
    "LIMIT",
    "LUMINANCE",
    "METRES",
    "MICROMETRES",
    "MILLIMETRES",
    "PIXELS",
    "POSITIVE",
    "Check",
    "Quantity",
    "Range",
    "Seed",
    "Values",
    "Whole",
]


@dataclass(frozen=True)
class Quantity:
    """A positive quantity as users state it.

    Parameters
    ----------
    symbol
        Symbol of the unit; empty for a pure number.
    words
        Name of the unit in messages.
    scale
        Value of one unit in the parameter.
    least, most
        Bounds, in the unit. By default those within which derived quantities stay within double precision.
    infinite
        Whether infinity is allowed.
    hint
        Remedy that messages add for a value out of bounds.
    in_si, parts
        The unit is a `parts`-th of `in_si` in SI units; divided first, 3 arcmin are exactly 3 / 60 degrees.

    Examples
    --------
    >>> MILLIMETRES.si.value(50.0, "--focal-length")
    0.05
    >>> LIMIT.value(1e-4, "--near")
    Traceback (most recent call last):
    focalgradient.errors.InputError: --near is 0.0001, but must be a number of metres from 0.001 to 1e+09.
    """

    symbol: str = ""
    words: str = ""
    scale: float = 1.0
    least: float = 1e-6
    most: float = 1e9
    infinite: bool = False
    hint: str = ""
    in_si: float = 1.0
    parts: int = 1

    @property
    def si(self) -> Quantity:
        """The same quantity, for a parameter in SI units."""
        return replace(self, scale=self.in_si)

    def between(self, least: float, most: float, hint: str = "") -> Quantity:
        """Return the same quantity with other bounds, in its unit."""
        return replace(self, least=least, most=most, hint=hint)

    def value(self, given: float, name: str) -> float:
        """Return the parameter's value for a number `given` in the unit; `name` is that of the parameter in messages.

        Raises
        ------
        InputError
            If the number is not positive, not finite unless allowed, or out of bounds.
        """
        unit = f" of {self.words}" if self.words else ""
        if not (given > 0 and (self.infinite or math.isfinite(given))):
            raise InputError(f"{name} is {given:g}, but must be a positive number{unit}.")
        if not self.least <= given <= self.most and given != math.inf:
            raise InputError(
                f"{name} is {given:g}, but must be a number{unit} from {self.least:g} to {self.most:g}{self.hint}."
            )
        return given if self.scale == 1 else given / self.parts * self.scale


@dataclass(frozen=True, slots=True)
class Range:
    """Range of a number in the unit `words`, from `least` to `most`: `errors.check_fields` checks it beside a type.

    `remedy` ends the message for a number out of bounds, instead of the unit.

    >>> Range("degrees", 0, 180).check("axis", 200)
    Traceback (most recent call last):
    focalgradient.errors.InputError: axis is 200, but must be from 0 to 180: give it in degrees.
    """

    words: str
    least: float = -math.inf
    most: float = math.inf
    positive: bool = False
    finite: bool = True
    remedy: str = ""

    def check(self, name: str, value: Any) -> None:
        """Raise `InputError` unless `value`, that of the parameter `name`, is a number within the range."""
        if math.isinf(self.most) or not is_number(value):
            check_number(name, value, self.words, least=self.least, positive=self.positive, finite=self.finite)
        elif not self.least <= value <= self.most or (self.positive and value <= 0):
            raise self._wrong(name, f"is {described(value)}")

    def _wrong(self, name: str, stated: str) -> InputError:
        within = f"{'above 0 and at most' if self.positive else f'from {self.least:g} to'} {self.most:g}"
        if math.isinf(self.most):
            within = f"{self.least:g} or more"
        return InputError(f"{name} {stated}, but must be {within}: {self.remedy or f'give it in {self.words}'}.")


@dataclass(frozen=True, slots=True)
class Values(Range):
    """Range of every number of an array.

    >>> Values("degrees", 0, 60).of("eccentricity_deg", [5, 70])
    Traceback (most recent call last):
    focalgradient.errors.InputError: eccentricity_deg goes from 5 to 70, but must be from 0 to 60: give it in degrees.
    """

    def check(self, name: str, value: Any) -> None:
        """Raise `InputError` unless all numbers of `value`, that of the parameter `name`, are within the range."""
        self.of(name, value)

    def of(self, name: str, value: ArrayLike) -> NDArray[np.float64]:
        """Return a parameter's numbers after validation, any shape."""
        values = check_finite(name, value, self.words)
        if values.size and not (self.least <= values.min() and values.max() <= self.most):
            ends = f"goes from {values.min():g} to {values.max():g}" if values.ndim else f"is {described(value)}"
            raise self._wrong(name, ends)
        return values


@dataclass(frozen=True, slots=True)
class Whole:
    """Range of a whole number, from `least` to `most`; `remedy`, if any, ends the message.

    >>> Whole(1, 81).check("wavelengths", 0)
    Traceback (most recent call last):
    focalgradient.errors.InputError: wavelengths is 0, but must be a whole number from 1 to 81.
    """

    least: int
    most: float = math.inf
    remedy: str = ""

    def check(self, name: str, value: Any) -> None:
        """Raise `InputError` unless `value`, that of the parameter `name`, is a whole number within the range."""
        if not (isinstance(value, int | np.integer) and self.least <= value <= self.most):
            bounds = f"of {self.least} or more" if math.isinf(self.most) else f"from {self.least} to {self.most}"
            end = f": {self.remedy}" if self.remedy else ""
            raise InputError(f"{name} is {described(value)}, but must be a whole number {bounds}{end}.")


@dataclass(frozen=True, slots=True)
class Check:
    """Bounds beside a type that a function of the value, or of name and value if `named`, raises `InputError` for."""

    function: Callable[..., object]
    named: bool = False

    def check(self, name: str, value: Any) -> None:
        """Raise `InputError` unless the function accepts `value`, that of the parameter `name`."""
        self.function(*((name, value) if self.named else (value,)))


Seed = Annotated[int, Check(check_seed)]
"""A random seed."""

POSITIVE = Quantity()
METRES = Quantity("m", "metres")
CENTIMETRES = Quantity("cm", "centimetres", in_si=1e-2)
MILLIMETRES = Quantity("mm", "millimetres", in_si=1e-3)
MICROMETRES = Quantity("um", "micrometres", in_si=1e-6)
DEGREES = Quantity("deg", "degrees", in_si=math.radians(1))
ARCMIN = Quantity("arcmin", "arcmin", in_si=math.radians(1), parts=60)
DIOPTRES = Quantity("D", "dioptres")
PIXELS = Quantity("px", "pixels")
LUMINANCE = Quantity("cd_m2", "cd/m^2")

LIMIT = replace(METRES, least=1e-3)
"""Distance of a lens from its object; nearer than a millimetre, it blurs by more than any picture's width."""

FOCUS = replace(LIMIT, infinite=True)
"""Distance in focus, which may be infinite."""

APERTURE_RATIO = Quantity(
    least=0.1, infinite=True, hint=": if it is the aperture's diameter, give focal length / diameter"
)
"""f-number, infinite for a pinhole; no lens in air is below 0.5."""

BODY = MILLIMETRES.between(1.0, 1e4, ": check its unit")
"""Distance from the sensor to a part of a lens: 3 to 5 mm in phones, 2 m in the longest lens."""
