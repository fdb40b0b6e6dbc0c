"""Lenses: distance, vergence, defocus and blur.

Distances are in metres in front of the lens, positive; vergence V = 1/distance in dioptres, 0 at infinity.
Defocus = (focus vergence) - V: **positive for a point beyond the plane of focus**. A blur disc has the angular
radius ``(aperture diameter / 2) x |defocus|``, in radians, seen from the lens: one line for cameras and eyes alike,
which is Eq. 12 to Eq. 16 of Pentland (1987) in vergence. It is exact for a thin lens with its stop at the lens. The
paper's equations in its own terms stand in `focalgradient.paper`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_number, described
from focalgradient.plausibility import check_f_number, check_focal_length, check_focus

__all__ = [
    "HasWaveband",
    "Lens",
    "Optics",
    "OwnBlur",
    "Side",
    "check_optics",
    "own_blur",
    "refocused",
]

Side = Literal["beyond", "nearer"]
"""On which side of the plane of focus a point lies."""

Transfer = NDArray[np.float64] | NDArray[np.complex128]
"""Real where blur is round, and complex where it need not be."""

FORMS = ("through_focus", "optical_transfer", "transfer")
"""Methods by which optics may offer a blur of their own: of many vergences at once, of one, and of round blur."""

BLUR_ERROR = 5e-3
"""Error up to which an optics' own transfer is 1 at frequency 0, and alike in all directions (`eye.Cones`: 1e-3)."""


class Optics(Protocol):
    """What the depth core asks of whatever formed an image: a lens, or an eye."""

    @property
    def aperture_diameter(self) -> float:
        """Diameter of the aperture (pupil) in metres; 0 for a pinhole."""

    @property
    def focus_vergence(self) -> float:
        """Vergence of the plane in exact focus, in dioptres."""


@runtime_checkable
class HasWaveband(Optics, Protocol):
    """Optics that see one part of the light, such as an eye's cones of one class."""

    @property
    def light(self) -> str:
        """Name of the light: surfaces look alike, but for their blur, in views of one name only."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A thin lens with a sensor behind it.

    Parameters
    ----------
    focal_length
        Focal length F in metres.
    f_number
        The photographer's f-number, F / (aperture *diameter*); ``inf`` is a pinhole.
    focus_distance
        Distance of the plane in exact focus, in metres in front of the lens; may be ``inf``.
    residual_blur_variance
        Variance in rad^2 of the blur that is there even in focus, on top of the pixel's own width: 0 unless the camera
        was calibrated; negative where it sharpens its pictures. An edge's blur has it in it.

    Raises
    ------
    InputError
        If a length is not positive, or the focus lies within the focal length, or the focal length is below 0.1 mm or
        over 10 m, or the f-number below 0.02.

    Warns
    -----
    FocalGradientWarning
        If the focal length is over 2 m, or the f-number below 0.5: millimetres, or a diameter, may have been given.

    Examples
    --------
    >>> lens = Lens(focal_length=0.050, f_number=2.0, focus_distance=1.0)
    >>> round(lens.aperture_diameter, 6), round(lens.sensor_distance, 6)
    (0.025, 0.052632)
    >>> float(lens.defocus(2.0))  # a point at 2 m is half a dioptre beyond the plane of focus
    0.5
    """

    focal_length: float
    f_number: float
    focus_distance: float
    residual_blur_variance: float = 0.0

    def __post_init__(self) -> None:
        check_number("focal_length", self.focal_length, "metres", positive=True)
        check_number("f_number", self.f_number, "f-stops", positive=True, finite=False)
        check_number("focus_distance", self.focus_distance, "metres", positive=True, finite=False)
        check_number("residual_blur_variance", self.residual_blur_variance, "rad^2")
        check_focal_length(self.focal_length)
        check_f_number(self.f_number, self.focal_length)
        check_focus(self.focus_distance, self.focal_length)

    @property
    def aperture_diameter(self) -> float:
        """Diameter of the aperture in metres, F/N; 0 for a pinhole."""
        return self.focal_length / self.f_number

    @property
    def focus_vergence(self) -> float:
        """Vergence V_f of the plane in exact focus, in dioptres: 1/F - 1/(sensor distance)."""
        return 1.0 / self.focus_distance

    @property
    def sensor_distance(self) -> float:
        """Distance v0 from lens to sensor in metres, by the thin lens's law 1/u + 1/v = 1/F: Eq. 12."""
        return 1.0 / (1.0 / self.focal_length - self.focus_vergence)

    def refocused(self, vergence: float) -> Lens:
        """Return the same lens focused at another `vergence` (D, 0 for infinity), its aperture unchanged.

        >>> Lens(0.050, 2, 1.0).refocused(0.5).focus_distance
        2.0
        """
        if not vergence >= 0:
            raise InputError(f"vergence is {vergence!r} D, but a lens focuses from 0 D, infinity, upwards.")
        return replace(self, focus_distance=1 / vergence if vergence > 0 else float("inf"))

    def defocus(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Defocus in dioptres of points at `distance` (m, any shape): positive beyond the plane of focus.

        >>> Lens(0.025, 4, 0.5).defocus([0.25, 0.5, np.inf]).tolist()
        [-2.0, 0.0, 2.0]
        """
        return defocus_at(distance, self.focus_vergence)

    def blur_radius(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Angular radius in radians of the blur disc of points at `distance` (m, any shape).

        In vergence what Eq. 15 is by similar triangles: r / v = sigma / (v0 - v), with r the lens's radius and sigma
        the disc's radius on the sensor. Multiply by `sensor_distance` for metres on the sensor; divide by a view's
        pixel angle for pixels.

        >>> float(Lens(0.050, 2, 1.0).blur_radius(2.0))  # (25 mm / 2) x 0.5 D
        0.00625
        """
        return np.abs(self.defocus(distance)) * (self.aperture_diameter / 2)

    def distance_from_blur(self, radius: ArrayLike, side: Side) -> NDArray[np.float64]:
        """Distance in metres at which the blur disc has the angular `radius` (rad, any shape) on one `side`.

        The inverse of `blur_radius`: a single blur does not give the side. Blur that infinity just reaches
        gives ``inf``; more blur than that, beyond focus, comes from no real point: ``nan``.

        >>> lens = Lens(0.050, 2, 1.0)
        >>> [round(lens.distance_from_blur(0.00625, side).item(), 4) for side in ("beyond", "nearer")]
        [2.0, 0.6667]
        """
        if self.aperture_diameter == 0:
            raise InputError("a pinhole blurs nothing, so its blur gives no distance: use a finite f_number.")
        return distance_of_blur(radius, side, self.aperture_diameter, self.focus_vergence)


@dataclass(frozen=True, slots=True)
class OwnBlur:
    """The blur that optics offer themselves, in every form whichever of them the optics have (see `own_blur`)."""

    optics: Any
    isotropic: bool
    """Whether blur is alike in all directions, its transfer real and a function of the radial frequency."""

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
        """Return the transfer of round blur of points at `vergence` (D) at `frequency` (cycles per radian); broadcasts.

        Raises
        ------
        InputError
            If the blur is not round, or what the optics return is not a transfer.
        """
        if not self.isotropic:
            raise InputError(f"the blur of {self.name} is not round, but only round blur can be used here.")
        radial, level = np.abs(np.asarray(frequency, float)), np.asarray(vergence, float)
        if self._offers("transfer"):
            shape = np.broadcast_shapes(radial.shape, level.shape)
            return np.asarray(self._checked(self.optics.transfer(radial, level), shape).real, float)
        radii, place = np.unique(radial, return_inverse=True)
        levels, number = np.unique(level, return_inverse=True)
        table = self.through_focus(np.zeros_like(radii), radii, levels).real
        return np.asarray(table[number.reshape(level.shape), place.reshape(radial.shape)], float)

    def optical_transfer(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float) -> Transfer:
        """Return the transfer of points at one `vergence` (D) at frequencies in cycles per radian; broadcasts."""
        if not self._offers("optical_transfer"):
            return self.through_focus(frequency_y, frequency_x, [vergence])[0]
        down, right = np.asarray(frequency_y, float), np.asarray(frequency_x, float)
        shape = np.broadcast_shapes(down.shape, right.shape)
        return self._checked(self.optics.optical_transfer(down, right, vergence), shape)

    def through_focus(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike) -> Transfer:
        """Return the same for each of the `vergences` (D): L x the frequencies' shape."""
        down, right = np.asarray(frequency_y, float), np.asarray(frequency_x, float)
        levels = np.atleast_1d(np.asarray(vergences, float))
        shape = np.broadcast_shapes(down.shape, right.shape)
        if self._offers("through_focus"):
            return self._checked(self.optics.through_focus(down, right, levels), (len(levels), *shape))
        if self._offers("optical_transfer"):
            each: Any = [self.optical_transfer(down, right, level) for level in levels.tolist()]
            return np.asarray(each)
        return self.transfer(np.hypot(down, right), levels.reshape(-1, *(1,) * len(shape)))

    def check(self, vergence: float, frequency: float) -> None:
        """Raise `InputError` unless the blur of points at `vergence` (D) keeps light, and is round if said to be.

        It is compared along two directions up to `frequency` (cycles per radian).
        """
        some = np.linspace(0, frequency, 9)
        right, down = (self.through_focus(y, x, [vergence])[0] for y, x in ((0 * some, some), (some, 0 * some)))
        if not abs(right[0] - 1) <= BLUR_ERROR:
            raise InputError(
                f"the transfer of {self.name} is {right[0]:.3g} at frequency 0, but must be 1: blur keeps the light."
            )
        uneven = max(float(np.abs(right - down).max()), float(np.abs(np.imag(right)).max()))
        if self.isotropic and uneven > BLUR_ERROR:
            raise InputError(
                f"the blur of {self.name} is said to be round (isotropic), but its transfer differs by {uneven:.2g} "
                "between directions: state isotropic = False."
            )

    @property
    def name(self) -> str:
        """Name of the optics' class, for messages."""
        return type(self.optics).__name__

    @property
    def forms_views(self) -> bool:
        """Whether views are taken to be blurred so unless said otherwise: not where the optics say `by_rays`."""
        return not getattr(self.optics, "by_rays", False)

    def _offers(self, form: str) -> bool:
        return callable(getattr(self.optics, form, None))

    def _checked(self, found: ArrayLike, shape: tuple[int, ...]) -> Transfer:
        """What the optics return, refused unless it is finite and of the `shape` asked for."""
        values: Transfer = np.asarray(found)
        if values.shape != shape or values.dtype.kind not in "fc" or not np.isfinite(values).all():
            raise InputError(
                f"the transfer of {self.name} has shape {values.shape} and type {values.dtype}, but must be finite "
                f"numbers of shape {shape}."
            )
        return values


def own_blur(optics: Any) -> OwnBlur | None:
    """Return the blur that `optics` offer themselves, or None where they have an aperture and a focus only.

    Optics offer it by one or more of these methods, at frequencies in cycles per radian and vergences in dioptres:

    - ``transfer(frequency, vergence)``: of round blur, by radial frequency; broadcasts;
    - ``optical_transfer(frequency_y, frequency_x, vergence)``: at one vergence, complex where blur is not symmetric;
    - ``through_focus(frequency_y, frequency_x, vergences)``: the same for a list of vergences, L x the frequencies'
      shape.

    ``isotropic`` states whether the blur is round. Where it is absent, blur is taken to be round if ``transfer`` alone
    is offered, and may depend on direction else. ``by_rays = True`` states that their views are blurred by geometric
    optics, by a disc, unless ``psf="optics"`` is asked for.

    Raises
    ------
    InputError
        If ``isotropic`` is not a truth value, or is False though only ``transfer`` is offered.

    Examples
    --------
    >>> own_blur(Lens(0.05, 2, 1.0)) is None
    True
    >>> from focalgradient.eye import Cones, Eye
    >>> coma = Cones.of(Eye(0.004, 1.0, aberrations=((3, 1, 0.2),)), "L+M")
    >>> own_blur(coma).isotropic
    False
    """
    offered = [form for form in FORMS if callable(getattr(optics, form, None))]
    if not offered:
        return None
    stated = getattr(optics, "isotropic", None)
    if stated is None:
        stated = offered == ["transfer"]
    if not isinstance(stated, bool | np.bool_):
        raise InputError(f"isotropic of {type(optics).__name__} is {described(stated)}, but must be True or False.")
    if not stated and offered == ["transfer"]:
        raise InputError(
            f"{type(optics).__name__} has blur that is not round (isotropic is False), but offers only `transfer`, "
            "which is of round blur: add `through_focus` or `optical_transfer`."
        )
    return OwnBlur(optics, bool(stated))


def refocused(optics: Any, vergence: float) -> Any:
    """Return the same optics focused at another `vergence` (D), by their own method ``refocused(vergence)``.

    Raises
    ------
    InputError
        If they have no such method, or cannot focus there.

    Examples
    --------
    >>> refocused(Lens(0.05, 2, 1.0), 4.0).focus_distance
    0.25
    """
    if not callable(getattr(optics, "refocused", None)):
        raise InputError(
            f"optics is {described(optics)}, which cannot be focused elsewhere: give it a method refocused(vergence)."
        )
    return optics.refocused(vergence)


def check_optics(optics: Any) -> None:
    """Refuse what is no optics: `Optics` have a finite aperture diameter of 0 or more, and a finite focus vergence.

    Raises
    ------
    InputError
        If one of the two is missing or out of range.

    Examples
    --------
    >>> check_optics(Lens(0.05, 2, 1.0))
    >>> check_optics(None)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: optics is None, but must be a Lens, an Eye or ...
    """
    aperture, focus = (getattr(optics, name, None) for name in ("aperture_diameter", "focus_vergence"))
    if isinstance(optics, type) or aperture is None or focus is None:
        raise InputError(
            f"optics is {described(optics)}, but must be a Lens, an Eye or whatever else has an aperture_diameter "
            "(m) and a focus_vergence (D)."
        )
    for value in (aperture, focus):
        if not (np.ndim(value) == 0 and np.isfinite(value) and aperture >= 0):
            raise InputError(
                f"optics has an aperture of {aperture!r} m and a focus vergence of {focus!r} D, "
                "but both must be finite and the aperture 0 or more."
            )


def defocus_at(distance: ArrayLike, focus_vergence: float) -> NDArray[np.float64]:
    """Defocus (D) of points at `distance` (m), refused unless every value is positive (infinity included)."""
    values = np.asarray(distance, dtype=float)
    if not np.all(values > 0):
        raise InputError(
            "distance holds values that are not positive, but distances are metres in front of the lens or eye."
        )
    return focus_vergence - 1.0 / values


def distance_of_blur(radius: ArrayLike, side: Side, aperture: float, focus_vergence: float) -> NDArray[np.float64]:
    """Distance (m) on one `side` of focus at which an aperture (m) blurs by a disc of angular `radius` (rad)."""
    if side not in ("beyond", "nearer"):
        raise InputError(f"side is {side!r}, but must be 'beyond' or 'nearer' (than the plane of focus).")
    radius = np.asarray(radius, dtype=float)
    if not np.all(radius >= 0):
        raise InputError("radius holds negative or undefined values, but a blur radius is 0 or more, in radians.")
    step = radius / (aperture / 2)
    vergence = focus_vergence + (step if side == "nearer" else -step)
    # A few roundings' worth of slack, so that the blur of infinity gives back infinity.
    vergence = np.where(np.abs(vergence) <= 8 * np.finfo(float).eps * step, 0.0, vergence)
    with np.errstate(divide="ignore"):
        return np.where(vergence >= 0, 1.0 / np.abs(vergence), np.nan)
