"""The shape of a blur: what a new one gives, and what follows from that.

A shape is free of scale: only frequency times radius counts, so that radii may be in pixels, radians or metres, with
frequencies in cycles per the same unit. The radius is that of the geometric blur disc, (aperture diameter / 2) x
|defocus|. A shape that differs from its mirror image through the middle (a pentagon) is stated as pictures show it for
points beyond the plane of focus; points nearer than that plane show it turned by half a turn.
"""

from __future__ import annotations

import dataclasses
import math
from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, described, is_number

__all__ = ["Capability", "Parameter", "Psf", "parameter"]

FloatArray = NDArray[np.float64]

NEAR_ZERO = 1e-3
"""Cycles per radius at which the curvature of a transfer gives the variance: the next term is below 1e-5 of it."""


class Capability(Enum):
    """What a method may need of a blur; the value is what the method needs, in words."""

    BY_RADIUS = "blur that follows from its radius alone"
    ISOTROPIC = "blur that is alike in all directions"
    EDGE_RESPONSE = "the edge response"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number that a shape has beside its radius: what command lines and files ask for."""

    name: str
    help: str
    unit: str  # at the command line and in files, such as "deg"; empty for counts and ratios
    per_unit: float  # the attribute's value of one such unit
    least: float  # bounds, in that unit
    most: float
    exclusive: bool  # whether the bounds themselves are left out
    default: float  # in that unit

    @property
    def key(self) -> str:
        """Name in files, with the unit.

        >>> from focalgradient.psf import Polygon
        >>> [one.key for one in Polygon.parameters()]
        ['blades', 'rotation_deg']
        """
        return f"{self.name}_{self.unit}" if self.unit else self.name

    @property
    def whole(self) -> bool:
        """Whether it counts something."""
        return isinstance(self.default, int)

    def check(self, value: Any, name: str | None = None) -> None:
        """Raise `InputError` unless `value`, in `unit`, is within the bounds."""
        inside = is_number(value) and math.isfinite(value) and self.least <= value <= self.most
        if inside and self.exclusive:
            inside = self.least < value < self.most
        if not inside or (self.whole and value != int(value)):
            raise InputError(f"{name or self.name} is {described(value)}, but must be {self.wanted}.")

    @property
    def wanted(self) -> str:
        """What it must be, in words."""
        if self.least == 0 and self.exclusive and math.isinf(self.most):
            return f"a positive number{f' of {self.unit}' * bool(self.unit)}, {self.help}"
        kind, unit = "a whole number" if self.whole else "a number", f" {self.unit}" * bool(self.unit)
        if math.isinf(self.most):
            return f"{kind} {'above' if self.exclusive else 'of at least'} {self.least:g}{unit} ({self.help})"
        inside = "between" if self.exclusive else "from"
        return f"{kind} {inside} {self.least:g} {'and' if self.exclusive else 'to'} {self.most:g}{unit} ({self.help})"


def parameter(
    default: float,
    help: str,
    *,
    least: float,
    most: float = math.inf,
    exclusive: bool = False,
    unit: str = "",
    per_unit: float = 1.0,
) -> Any:
    """Return a dataclass field that is a parameter of a shape.

    Parameters
    ----------
    default, least, most
        Its default and bounds, in `unit`; a default of type int makes it a count.
    help
        What it is, in a few words.
    exclusive
        Whether the bounds themselves are left out.
    unit, per_unit
        Unit at the command line and in files, and the attribute's value of one such unit (pi / 180 for "deg").
    """
    bounds = {"least": least, "most": most, "exclusive": exclusive, "unit": unit, "per_unit": per_unit}
    value = default if per_unit == 1 else default * per_unit
    return dataclasses.field(default=value, metadata={"parameter": {"help": help, "default": default, **bounds}})


class Psf(ABC):
    """The shape of a blur. A subclass gives `transfer` (round blur) or `optical_transfer` (blur of any form).

    All else follows, and may be given where it is known better: `edge_response` makes the method "edges" work, and
    `sd_per_radius` is otherwise measured on the transfer. `focalgradient.psf.check_psf` tells whether a new shape is
    consistent.

    Notes
    -----
    A subclass may state:

    - ``name``, ``description``: the name that results, files and messages use (by default the class's), and a sentence;
    - ``isotropic``: whether blur is alike in all directions; by default where `transfer` is given;
    - ``symmetric``: whether the shape is its own mirror image through the middle, so that its transfer is real; by
      default where it is isotropic;
    - ``ends_sharply``: whether light ends at a rim, so that the transfer changes sign; detail beyond its second zero is
      then not compared;
    - ``absorbs_pixel``: whether the shape, averaged over a pixel, is the same shape, only wider: true of a Gaussian;
    - ``scale_parameter``: the parameter that is `sd_per_radius` itself, which a calibration along edges measures.

    Examples
    --------
    >>> class Cone(Psf):
    ...     def transfer(self, frequency, radius):
    ...         from focalgradient.psf import disc_transfer
    ...         return disc_transfer(frequency, np.asarray(radius) / 2) ** 2
    >>> cone = Cone()
    >>> cone.isotropic, round(cone.sd_per_radius, 4), sorted(one.name for one in cone.provides)
    (True, 0.3536, ['BY_RADIUS', 'ISOTROPIC'])
    """

    name: ClassVar[str]
    description: ClassVar[str]
    absorbs_pixel: ClassVar[bool] = False
    scale_parameter: ClassVar[str | None] = None

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.transfer is Psf.transfer and cls.optical_transfer is Psf.optical_transfer:
            raise TypeError(f"{cls.__name__} gives neither `transfer` (round blur) nor `optical_transfer` (any blur).")
        if "name" not in cls.__dict__:
            cls.name = cls.__name__
        if "description" not in cls.__dict__:
            cls.description = (cls.__doc__ or cls.__name__).strip().splitlines()[0]

    def __new__(cls, *args: Any, **kwargs: Any) -> Self:
        """Refuse `Psf` itself, which has no transfer."""
        if cls is Psf:
            raise TypeError("Psf is abstract: use one of its subclasses, such as focalgradient.psf.Disc.")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        """Check the parameters of a dataclass."""
        for one in self.parameters():
            value = getattr(self, one.name)
            one.check(value / one.per_unit if is_number(value) and one.per_unit != 1 else value)

    @property
    def isotropic(self) -> bool:
        """Whether blur is alike in all directions."""
        return type(self).transfer is not Psf.transfer

    @property
    def symmetric(self) -> bool:
        """Whether the shape is its own mirror image through the middle; otherwise it tells the side of focus."""
        return self.isotropic

    @property
    def ends_sharply(self) -> bool:
        """Whether light ends at a rim."""
        return True

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> FloatArray:
        """Return the transfer of round blur of `radius` at a radial `frequency` (cycles per its unit); broadcasts.

        Raises
        ------
        InputError
            If the blur is not alike in all directions.
        """
        if not self.isotropic:
            raise InputError(f"{self} is not alike in all directions: ask for its optical_transfer.")
        return np.real(self.optical_transfer(0.0, frequency, radius))

    def optical_transfer(self, frequency_y: ArrayLike, frequency_x: ArrayLike, radius: ArrayLike) -> NDArray[Any]:
        """Return the transfer at frequencies along y (down) and x (right), of points beyond focus; broadcasts.

        The Fourier transform, sum of psf(x) exp(-2 pi i f x), real or complex; its conjugate is that of points nearer
        than focus.
        """
        return self.transfer(np.hypot(frequency_y, frequency_x), radius)

    def edge_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the blurred image of a step from 0 to 1 at `position`, in the radius's unit from the step.

        Raises
        ------
        InputError
            If the shape does not give it.
        """
        raise InputError(f"{self} does not give its edge response.")

    def line_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the derivative of `edge_response` by `position`; by default from central differences."""
        step = 1e-4 * radius
        beside = (self.edge_response(np.asarray(position, float) + way * step, radius) for way in (1, -1))
        return np.asarray(np.subtract(*beside) / (2 * step), float)

    @property
    def edge_reach(self) -> float:
        """Radii from the step beyond which `edge_response` is 1 (to 1e-6)."""
        radii = np.concatenate([np.linspace(0, 4, 1001), np.geomspace(4, 400, 400)[1:]])
        below = np.flatnonzero(self.edge_response(radii, 1.0) < 1 - 1e-6)
        return float(radii[min(below[-1] + 1, len(radii) - 1)])

    @property
    def sd_per_radius(self) -> float:
        """Standard deviation along either axis over the blur radius; by default from the transfer's curvature at 0."""
        along = [self.optical_transfer(y, x, 1.0) for y, x in ((NEAR_ZERO, 0.0), (0.0, NEAR_ZERO))]
        variance = 1 - float(np.mean(np.real(along)))
        return math.sqrt(max(variance, 0.0) / 2) / (math.pi * NEAR_ZERO)

    def sd(self, radius: ArrayLike) -> FloatArray:
        """Return the standard deviation along either axis of blur of `radius`, in the radius's unit.

        >>> from focalgradient.psf import Disc
        >>> float(Disc().sd(4.0))
        2.0
        """
        return self.sd_per_radius * np.asarray(radius, float)

    def variance(self, radius: ArrayLike) -> FloatArray:
        """Return the variance along either axis of blur of `radius`, in the radius's unit squared."""
        return self.sd(radius) ** 2

    def radius_of(self, sd: ArrayLike) -> FloatArray:
        """Return the blur radius that has the standard deviation `sd` along either axis: the inverse of `sd`."""
        return np.asarray(sd, float) / self.sd_per_radius

    @property
    def gives_edge_response(self) -> bool:
        """Whether `edge_response` can be asked for."""
        return self.isotropic and type(self).edge_response is not Psf.edge_response

    @property
    def provides(self) -> frozenset[Capability]:
        """What methods can build on; see `focalgradient.depth.methods_for`."""
        given = {
            Capability.BY_RADIUS: True,
            Capability.ISOTROPIC: self.isotropic,
            Capability.EDGE_RESPONSE: self.gives_edge_response,
        }
        return frozenset(one for one, known in given.items() if known)

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """Return the parameters of the shape: the fields of a dataclass that are made by `parameter`."""
        fields: dict[str, dataclasses.Field[Any]] = getattr(cls, "__dataclass_fields__", {})
        return tuple(
            Parameter(name=one.name, **one.metadata["parameter"])
            for one in fields.values()
            if "parameter" in one.metadata
        )

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Psf:
        """Return the shape of these parameters, by their keys and in their units at doors; others as by default.

        >>> from focalgradient.psf import Polygon
        >>> Polygon.of({"blades": 5, "rotation_deg": 90.0}).rotation == np.pi / 2
        True

        Raises
        ------
        InputError
            If one is unknown or out of bounds.
        """
        known = {one.key: one for one in cls.parameters()}
        for key, value in values.items():
            if key not in known:
                some = f"has {', '.join(known)}" if known else "has no parameters"
                raise InputError(f"psf {cls.name!r} has no parameter {key!r}: it {some}.")
            known[key].check(value, key)
        given = {known[key]: value for key, value in values.items()}
        made: Any = cls  # a dataclass
        found: Psf = made(
            **{
                one.name: int(value) if one.whole else value if one.per_unit == 1 else value * one.per_unit
                for one, value in given.items()
            }
        )
        return found

    def stated(self) -> dict[str, float]:
        """Return the parameters by their keys, in their units at doors: the inverse of `of`.

        >>> from focalgradient.psf import Polygon
        >>> Polygon(blades=5).stated()
        {'blades': 5, 'rotation_deg': 0.0}
        """
        values = ((one, getattr(self, one.name)) for one in self.parameters())
        return {one.key: value if one.per_unit == 1 else float(f"{value / one.per_unit:.12g}") for one, value in values}

    def __str__(self) -> str:
        """Return the shape in words: "a disc", "a gaussian of k = 0.5"."""
        stated = self.stated()
        values = [f"{one.name} = {stated[one.key]:g}{f' {one.unit}' * bool(one.unit)}" for one in self.parameters()]
        article = {True: "an ", False: "a "}[self.name[:1] in "aeiou"] if self.name[:1].islower() else ""
        return f"{article}{self.name}" + (f" of {', '.join(values)}" if values else "")
