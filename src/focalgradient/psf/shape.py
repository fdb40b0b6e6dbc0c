"""Base class of blur shapes, and their parameters.

Shapes are scale-invariant: the transfer depends only on frequency times radius, so radii may be in pixels, radians or
metres, with frequencies in cycles per the same unit. The radius is that of the geometric blur disc, (aperture diameter
/ 2) x |defocus|. A shape without point symmetry (a pentagon) is defined as pictures show it for points beyond the plane
of focus; nearer points show it rotated by 180 degrees.
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

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, described, is_number

__all__ = ["Capability", "Geometric", "Parameter", "Psf", "parameter"]


EXTENT_SD = 4.0
"""Extent of a shape's picture in standard deviations: a triangle ends at 2.8; a Gaussian has 6e-5 outside."""

MIN_FRACTION = 1e-4
"""Fraction of the brightest pixel of a picture below which a pixel is set to 0."""

FOLDED_TWICE_PX = 8.0
"""Radius in pixels below which a picture's spectrum is folded at twice the sampling frequency, too."""

POINTS_RADIUS_PX = 96.0
"""Blur radius in pixels of the picture from which points of the aperture are drawn: accurate to 1 % of the radius."""

NEAR_ZERO = 1e-3
"""Frequency (cycles per radius) at which the transfer's curvature gives the variance; the relative error is 1e-5."""


class Capability(Enum):
    """Property of a blur that a depth method may require; the value describes it in messages."""

    BY_RADIUS = "blur determined by its radius alone"
    ISOTROPIC = "isotropic blur"
    EDGE_RESPONSE = "the edge response"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a shape beside its radius, as command lines and files accept it."""

    name: str
    help: str
    unit: str  # on the command line and in files, such as "deg"; empty for counts and ratios
    per_unit: float  # attribute's value per unit
    least: float  # bounds, in `unit`
    most: float
    exclusive: bool  # whether the bounds are exclusive
    default: float  # in `unit`

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
        """Whether the parameter is an integer count."""
        return isinstance(self.default, int)

    def value(self, given: float) -> float:
        """Return the attribute's value for one `given` in `unit`."""
        return int(given) if self.whole else given if self.per_unit == 1 else given * self.per_unit

    def check(self, value: Any, name: str | None = None) -> None:
        """Raise `InputError` unless `value`, in `unit`, is within the bounds."""
        inside = is_number(value) and math.isfinite(value) and self.least <= value <= self.most
        if inside and self.exclusive:
            inside = self.least < value < self.most
        if not inside or (self.whole and value != int(value)):
            raise InputError(f"{name or self.name} is {described(value)}, but must be {self.wanted}.")

    @property
    def wanted(self) -> str:
        """Description of valid values, for messages."""
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
    """Return a dataclass field that declares a shape parameter.

    Parameters
    ----------
    default, least, most
        Default and bounds, in `unit`; a default of type int makes the parameter a count.
    help
        Short description.
    exclusive
        Whether the bounds are exclusive.
    unit, per_unit
        Unit on the command line and in files, and the attribute's value per unit (pi / 180 for "deg").
    """
    known = Parameter("", help, unit, per_unit, least, most, exclusive, default)
    return dataclasses.field(default=known.value(default), metadata={"parameter": known})


class Psf(ABC):
    """Base class of blur shapes; subclasses define `transfer` (isotropic) or `optical_transfer` (general).

    All other methods have defaults and may be overridden with exact expressions: `edge_response` enables the depth
    method "edges", and `sd_per_radius` is otherwise computed from the transfer. `focalgradient.psf.check_psf` validates
    a new shape.

    Notes
    -----
    A subclass may declare:

    - ``name``, ``description``: name in results, files and messages (default: the class's), and a one-sentence
      description;
    - ``isotropic``: whether the blur is isotropic; by default if `transfer` is defined;
    - ``symmetric``: whether the shape is point-symmetric, so that its transfer is real; by default if it is isotropic;
    - ``ends_sharply``: whether the shape has a sharp rim, so that the transfer changes sign; frequencies beyond its
      second zero are then not compared;
    - ``absorbs_pixel``: whether convolution with the pixel aperture gives the same shape, only wider (true of a
      Gaussian);
    - ``scale_parameter``: the parameter equal to `sd_per_radius`, which calibration along edges estimates.

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
        """Raise TypeError for `Psf` itself, which is abstract."""
        if cls is Psf:
            raise TypeError("Psf is abstract: use one of its subclasses, such as focalgradient.psf.Disc.")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        """Validate the parameters of a dataclass."""
        for parameter in self.parameters():
            value = getattr(self, parameter.name)
            parameter.check(value / parameter.per_unit if is_number(value) and parameter.per_unit != 1 else value)

    @property
    def isotropic(self) -> bool:
        """Whether the blur is isotropic."""
        return type(self).transfer is not Psf.transfer

    @property
    def symmetric(self) -> bool:
        """Whether the shape is point-symmetric; otherwise it reveals the side of focus."""
        return self.isotropic

    @property
    def ends_sharply(self) -> bool:
        """Whether the shape has a sharp rim."""
        return True

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> FloatArray:
        """Return the transfer of isotropic blur of `radius` at a radial `frequency` (cycles per its unit); broadcasts.

        Raises
        ------
        InputError
            If the blur is not isotropic.
        """
        if not self.isotropic:
            raise InputError(f"{self} is not isotropic: use its optical_transfer.")
        return np.real(self.optical_transfer(0.0, frequency, radius))

    def optical_transfer(self, frequency_y: ArrayLike, frequency_x: ArrayLike, radius: ArrayLike) -> NDArray[Any]:
        """Return the OTF for points beyond focus, at frequencies along y (down) and x (right); broadcasts.

        The Fourier transform, sum of psf(x) exp(-2 pi i f x), real or complex; for points nearer than focus it is the
        complex conjugate.
        """
        return self.transfer(np.hypot(frequency_y, frequency_x), radius)

    def edge_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the blurred image of a unit step at `position`, measured from the step in the unit of `radius`.

        Raises
        ------
        InputError
            If the shape does not define it.
        """
        raise InputError(f"{self} does not define its edge response: use another shape.")

    def line_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the derivative of `edge_response` by `position`, by default from central differences."""
        step = 1e-4 * radius
        beside = (self.edge_response(np.asarray(position, float) + way * step, radius) for way in (1, -1))
        return np.asarray(np.subtract(*beside) / (2 * step), float)

    @property
    def edge_reach(self) -> float:
        """Distance from the step, in blur radii, beyond which `edge_response` is 1 (to 1e-6)."""
        radii = np.concatenate([np.linspace(0, 4, 1001), np.geomspace(4, 400, 400)[1:]])
        below = np.flatnonzero(self.edge_response(radii, 1.0) < 1 - 1e-6)
        return float(radii[min(below[-1] + 1, len(radii) - 1)])

    @property
    def sd_per_radius(self) -> float:
        """Standard deviation along either axis per blur radius, by default from the transfer's curvature at 0."""
        along = [self.optical_transfer(y, x, 1.0) for y, x in ((NEAR_ZERO, 0.0), (0.0, NEAR_ZERO))]
        variance = 1 - float(np.mean(np.real(along)))
        return math.sqrt(max(variance, 0.0) / 2) / (math.pi * NEAR_ZERO)

    def sd(self, radius: ArrayLike) -> FloatArray:
        """Return the standard deviation along either axis of blur of `radius`, in the unit of `radius`.

        >>> from focalgradient.psf import Disc
        >>> float(Disc().sd(4.0))
        2.0
        """
        return self.sd_per_radius * np.asarray(radius, float)

    def variance(self, radius: ArrayLike) -> FloatArray:
        """Return the variance along either axis of blur of `radius`, in the unit of `radius` squared."""
        return self.sd(radius) ** 2

    def radius_of(self, sd: ArrayLike) -> FloatArray:
        """Return the blur radius whose standard deviation along either axis is `sd`: the inverse of `sd`."""
        return np.asarray(sd, float) / self.sd_per_radius

    def narrowed(self, radius: float) -> float:
        """Return the radius in pixels that linear interpolation between pixels, which adds 1/6 px^2, makes `radius`."""
        return math.sqrt(max(radius**2 - 1 / 6 / self.sd_per_radius**2, 1 / 4))

    def picture(self, radius: float) -> FloatArray:
        """Return the shape of `radius` pixels, beyond focus, as a square picture of odd size with sum 1.

        It is interpolated linearly between pixels, and narrowed before, so that its second moment is the shape's.

        >>> from focalgradient.psf import Gaussian
        >>> profile = Gaussian().picture(8.0).sum(axis=0)
        >>> round(float(profile @ (np.arange(len(profile)) - len(profile) // 2) ** 2), 1)  # (radius / 2)**2
        16.0
        """
        reach = math.ceil(EXTENT_SD * self.sd_per_radius * radius) + 2
        side = 2 * reach + 1
        # Frequencies beyond Nyquist are aliased, as by sampling.
        folds = np.arange(-2, 3) if radius < FOLDED_TWICE_PX else np.arange(-1, 2)
        down, right = ((axis[:, None] + folds).ravel() for axis in (np.fft.fftfreq(side), np.fft.rfftfreq(side)))
        spectrum = self.optical_transfer(down[:, None], right, self.narrowed(radius))
        spectrum = spectrum * np.outer(np.sinc(down), np.sinc(right)) ** 2
        folded = spectrum.reshape(side, len(folds), -1, len(folds)).sum(axis=(1, 3))
        picture = np.fft.fftshift(np.fft.irfft2(folded, (side, side)))
        picture = np.where(picture > MIN_FRACTION * picture.max(), picture, 0.0)
        cut = reach - int(np.abs(np.argwhere(picture) - reach).max())
        picture = picture[cut : side - cut, cut : side - cut]
        return picture / picture.sum()

    def points(self, square: FloatArray) -> FloatArray:
        """Return points (x, y) of the aperture in blur radii, distributed like the shape's radiance.

        `square` are points of the unit square centred on 0, ... x 2; uniform ones remain so.

        >>> from focalgradient.psf import Polygon
        >>> points = Polygon(blades=4).points(np.random.default_rng(0).uniform(-0.5, 0.5, (100_000, 2)))
        >>> points.std(axis=0).round(2).tolist(), bool(np.abs(points).max() < 1.27)  # corners at 1.253
        ([0.51, 0.51], True)
        """
        # Inverse distribution functions: first of rows, then of columns.
        picture = self.picture(POINTS_RADIUS_PX)
        side = len(picture)
        rows = np.concatenate([[0.0], np.cumsum(picture.sum(axis=1))])
        y = np.interp((square[..., 1] + 0.5) * rows[-1], rows, np.arange(side + 1))
        row = np.minimum(y.astype(np.intp), side - 1)
        # The concatenated distribution functions of the rows form one increasing function: row + fraction within it.
        within = np.cumsum(picture, axis=1) / np.maximum(picture.sum(axis=1, keepdims=True), 1e-300)
        ends = np.concatenate([np.zeros((side, 1)), within], axis=1)
        at = np.arange(side)[:, None] + np.minimum(ends, 1 - 1e-12)
        column = np.interp(row + square[..., 0] + 0.5, at.ravel(), np.tile(np.arange(side + 1), side))
        return (np.stack([column, y], -1) - side / 2) / POINTS_RADIUS_PX

    @property
    def gives_edge_response(self) -> bool:
        """Whether `edge_response` is defined."""
        return self.isotropic and type(self).edge_response is not Psf.edge_response

    @property
    def provides(self) -> frozenset[Capability]:
        """Properties that depth methods may require; see `focalgradient.depth.methods_for`."""
        optional = {Capability.ISOTROPIC: self.isotropic, Capability.EDGE_RESPONSE: self.gives_edge_response}
        return frozenset({Capability.BY_RADIUS, *(one for one, given in optional.items() if given)})

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """Return the parameters of the shape: the dataclass fields made by `parameter`."""
        fields: dict[str, dataclasses.Field[Any]] = getattr(cls, "__dataclass_fields__", {})
        known = {name: field.metadata.get("parameter") for name, field in fields.items()}
        return tuple(
            dataclasses.replace(parameter, name=name) for name, parameter in known.items() if parameter is not None
        )

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Psf:
        """Return the shape with the given parameters, by key and in their external units; others have defaults.

        >>> from focalgradient.psf import Polygon
        >>> Polygon.of({"blades": 5, "rotation_deg": 90.0}).rotation == np.pi / 2
        True

        Raises
        ------
        InputError
            If a parameter is unknown or out of bounds.
        """
        known = {parameter.key: parameter for parameter in cls.parameters()}
        for key, value in values.items():
            if key not in known:
                some = f"has {', '.join(known)}" if known else "has no parameters"
                raise InputError(f"psf {cls.name!r} has no parameter {key!r}: it {some}.")
            known[key].check(value, key)
        made: Any = cls  # a dataclass
        shape: Psf = made(**{known[key].name: known[key].value(given) for key, given in values.items()})
        return shape

    def stated(self) -> dict[str, float]:
        """Return the parameters by key, in their external units: the inverse of `of`.

        >>> from focalgradient.psf import Polygon
        >>> Polygon(blades=5).stated()
        {'blades': 5, 'rotation_deg': 0.0}
        """
        values = ((parameter, getattr(self, parameter.name)) for parameter in self.parameters())
        return {
            parameter.key: value if parameter.per_unit == 1 else float(f"{value / parameter.per_unit:.12g}")
            for parameter, value in values
        }

    def __str__(self) -> str:
        """Return the shape in words, such as "a disc" or "a gaussian of k = 0.5"."""
        stated = self.stated()
        values = [
            f"{parameter.name} = {stated[parameter.key]:g}{f' {parameter.unit}' * bool(parameter.unit)}"
            for parameter in self.parameters()
        ]
        article = {True: "an ", False: "a "}[self.name[:1] in "aeiou"] if self.name[:1].islower() else ""
        return f"{article}{self.name}" + (f" of {', '.join(values)}" if values else "")


@dataclass(frozen=True, slots=True)
class Geometric:
    """Optics whose blur has a shape, of the radius (aperture / 2) x the absolute defocus.

    Nearer than focus it is turned by half a turn.

    >>> from focalgradient.psf import Gaussian
    >>> through = Geometric(Gaussian(), 0.004, 1.0).through_focus(0.0, 200.0, [0.5, 1.0, 1.5])
    >>> through.round(3).tolist()
    [0.821, 1.0, 0.821]
    """

    psf: Psf
    aperture_diameter: float
    focus_vergence: float

    @property
    def name(self) -> str:
        """The shape in words."""
        return str(self.psf)

    @property
    def isotropic(self) -> bool:
        """Whether blur is rotationally symmetric."""
        return self.psf.isotropic

    @property
    def tells_side(self) -> bool:
        """Whether the shape is seen turned nearer than focus."""
        return not self.psf.symmetric

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> FloatArray:
        """Return the transfer of isotropic blur of points at `vergence` (D); broadcasts."""
        return self.psf.transfer(frequency, self._radius(vergence))

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> FloatArray | NDArray[np.complex128]:
        """Return the OTF at each of the L `vergences` (D): L x the frequencies' shape (cycles per radian)."""
        levels = np.atleast_1d(np.asarray(vergences, float))
        if self.isotropic:
            radial = np.hypot(frequency_y, frequency_x)
            return self.transfer(radial, levels.reshape(-1, *(1,) * np.ndim(radial)))
        upright = [self.psf.optical_transfer(frequency_y, frequency_x, radius) for radius in self._radius(levels)]
        nearer = levels > self.focus_vergence
        return np.stack([np.conj(otf) if turned else otf for otf, turned in zip(upright, nearer, strict=True)])

    def _radius(self, vergence: ArrayLike) -> FloatArray:
        return np.asarray(np.abs(self.focus_vergence - np.asarray(vergence, float)) * self.aperture_diameter / 2)
