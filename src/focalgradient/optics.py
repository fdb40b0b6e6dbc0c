"""Lenses: distance, vergence, defocus and blur.

Distances are in metres in front of the lens, positive; vergence V = 1/distance in dioptres, 0 at infinity.
Defocus = (focus vergence) - V: **positive for a point beyond the plane of focus**. A blur disc has the angular
radius (aperture diameter / 2) x |defocus|, in radians, seen from the lens: one line for cameras and eyes alike
(Pentland 1987, Eqs. 12-16, in vergence). It is exact for a thin lens with its stop at the lens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError

__all__ = ["HasTransfer", "HasWaveband", "Lens", "Optics", "Side", "paper_distance"]

Side = Literal["beyond", "nearer"]
"""On which side of the plane of focus a point lies."""


class Optics(Protocol):
    """What the depth core asks of whatever formed an image: a lens, or an eye."""

    @property
    def aperture_diameter(self) -> float:
        """Diameter of the aperture (pupil) in metres; 0 for a pinhole."""

    @property
    def focus_vergence(self) -> float:
        """Vergence of the plane in exact focus, in dioptres."""


@runtime_checkable
class HasTransfer(Optics, Protocol):
    """Optics that know their blur better than by the disc of geometric optics, such as an eye with diffraction."""

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
        """Transfer of the blur of points at `vergence` (D) at `frequency` (cycles per radian); broadcasts.

        Real, as of round blur, and 1 at frequency 0. Where it is 0 nothing was seen.
        """


@runtime_checkable
class HasWaveband(Optics, Protocol):
    """Optics that see one part of the light, such as an eye's cones of one kind."""

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
    own_variance
        Variance in rad^2 of the blur that is there even in focus, on top of the pixel's own width: 0 unless the camera
        was calibrated; negative where it sharpens its pictures. An edge's blur has it in it.

    Raises
    ------
    InputError
        If a length is not positive, or the focus lies within the focal length.

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
    own_variance: float = 0.0

    def __post_init__(self) -> None:
        for name, finite in (("focal_length", True), ("f_number", False), ("focus_distance", False)):
            value = getattr(self, name)
            if not (value > 0 and (math.isfinite(value) or not finite)):
                raise InputError(
                    f"{name} is {value!r}, but must be a positive {'finite ' if finite else ''}number: "
                    f"give it in {'f-stops' if name == 'f_number' else 'metres'}."
                )
        if self.focus_distance <= self.focal_length:
            raise InputError(
                f"focus_distance {self.focus_distance:g} m lies within the focal length "
                f"{self.focal_length:g} m, where a lens forms no real image: focus farther than the focal length."
            )

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
        """Distance v0 from lens to sensor in metres (Eq. 12: 1/u + 1/v = 1/F)."""
        return 1.0 / (1.0 / self.focal_length - self.focus_vergence)

    def defocus(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Defocus in dioptres of points at `distance` (m, any shape): positive beyond the plane of focus.

        >>> Lens(0.025, 4, 0.5).defocus([0.25, 0.5, np.inf]).tolist()
        [-2.0, 0.0, 2.0]
        """
        return self.focus_vergence - 1.0 / _distances(distance)

    def blur_radius(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Angular radius in radians of the blur disc of points at `distance` (m, any shape).

        Multiply by `sensor_distance` for metres on the sensor; divide by a view's pixel angle for pixels.

        >>> float(Lens(0.050, 2, 1.0).blur_radius(2.0))  # (25 mm / 2) x 0.5 D
        0.00625
        """
        return np.abs(self.defocus(distance)) * (self.aperture_diameter / 2)

    def distance_from_blur(self, radius: ArrayLike, side: Side) -> NDArray[np.float64]:
        """Distance in metres at which the blur disc has the angular `radius` (rad, any shape) on one `side`.

        The inverse of `blur_radius`: nothing in a single blur tells the side. Blur that infinity just reaches
        gives ``inf``; more blur than that, beyond focus, comes from no real point: ``nan``.

        >>> lens = Lens(0.050, 2, 1.0)
        >>> [round(lens.distance_from_blur(0.00625, side).item(), 4) for side in ("beyond", "nearer")]
        [2.0, 0.6667]
        """
        if self.aperture_diameter == 0:
            raise InputError("a pinhole blurs nothing, so its blur gives no distance: use a finite f_number.")
        if side not in ("beyond", "nearer"):
            raise InputError(f"side is {side!r}, but must be 'beyond' or 'nearer' (than the plane of focus).")
        radius = np.asarray(radius, dtype=float)
        if not np.all(radius >= 0):
            raise InputError("radius holds negative or undefined values, but a blur radius is 0 or more, in radians.")
        step = radius / (self.aperture_diameter / 2)
        vergence = self.focus_vergence + (step if side == "nearer" else -step)
        # A few roundings' worth of slack, so that the blur of infinity gives back infinity.
        vergence = np.where(np.abs(vergence) <= 8 * np.finfo(float).eps * step, 0.0, vergence)
        with np.errstate(divide="ignore"):
            return np.where(vergence >= 0, 1.0 / np.abs(vergence), np.nan)


def paper_distance(
    sigma: ArrayLike, *, focal_length: float, sensor_distance: float, paper_f_number: float, side: Side
) -> NDArray[np.float64]:
    """Pentland's Eq. 1 in its own terms: D = F v0 / (v0 - F - sigma f), with + sigma f on the near side (Eq. 16).

    TRAP: the paper's appendix defines f = F / (lens *radius*), which is **twice** the photographer's f-number.
    With the photographer's number the blur comes out half as steep in vergence as it is.

    Parameters
    ----------
    sigma
        Radius of the blur circle *on the sensor*, in metres; any shape.
    focal_length, sensor_distance
        F and v0, in metres.
    paper_f_number
        F / (lens radius) = 2 x the photographer's f-number.
    side
        ``"beyond"`` or ``"nearer"`` than the plane of focus.

    Returns
    -------
    ndarray
        Distance in metres, of the shape of `sigma`; ``inf`` or negative where no real point blurs so much.

    Examples
    --------
    A 50 mm f/2 lens focused at 1 m: a blur circle of 0.329 mm radius on the sensor comes from 2 m.

    >>> lens = Lens(0.050, 2, 1.0)
    >>> round(float(paper_distance(0.00032895, focal_length=0.050, sensor_distance=lens.sensor_distance,
    ...                            paper_f_number=2 * lens.f_number, side="beyond")), 3)
    2.0
    """
    spread = np.asarray(sigma, dtype=float) * paper_f_number
    if side == "nearer":
        spread = -spread
    with np.errstate(divide="ignore"):
        return focal_length * sensor_distance / (sensor_distance - focal_length - spread)


def _distances(distance: ArrayLike) -> NDArray[np.float64]:
    """`distance` as an array, refused unless every value is positive (infinity included)."""
    values = np.asarray(distance, dtype=float)
    if not np.all(values > 0):
        raise InputError("distance holds values that are not positive, but distances are metres in front of the lens.")
    return values
