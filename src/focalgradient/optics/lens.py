"""Thin lenses: distance, vergence, defocus and blur radius.

Distances are in metres in front of the lens, positive; vergence V = 1/distance in dioptres, 0 at infinity.
Defocus = (focus vergence) - V: **positive for a point beyond the plane of focus**. A blur disc has the angular
radius ``(aperture diameter / 2) x |defocus|``, in radians, seen from the lens: one equation for cameras and eyes, which
restates Eq. 12 to Eq. 16 of Pentland (1987) in vergence. It is exact for a thin lens with its stop at the lens. For the
equations in the paper's notation see `focalgradient.paper`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_tolerance
from focalgradient.plausibility import check_f_number, check_focal_length, check_focus
from focalgradient.quantities import Check, Range

__all__ = ["FIELD_TOLERANCE", "Aperture", "Lens", "Side", "defocus_at", "distance_of_blur"]

FIELD_TOLERANCE = 0.003
"""Standard deviation of the distance of the surface in focus from a plane, at the frame's corner, in focal lengths.

Eight published designs, traced (Cooke triplet, double Gauss, Heliar, reversed telephoto, telephoto, Tessar, Petzval and
US patent 8879901, as in Optiland 0.6), depart from the plane at their corner, midway between both foci of an oblique
pencil, by 0.0007 to 0.020 of the focal length, and two cameras measured here (35 mm, f/2.8; 50 mm, f/4) by 0.0015: the
median of 0.0022 is that of a normal distribution of this width.
"""

Side = Literal["beyond", "nearer"]
"""Side of the plane of focus on which a point lies."""


@dataclass(frozen=True, slots=True)
class Aperture:
    """Optics of geometric blur alone: an aperture's diameter (m), and the vergence (D, any sign) in focus."""

    aperture_diameter: float
    focus_vergence: float


TOLERANCE = Check(check_tolerance, named=True)
"""Bounds of a relative standard deviation."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A thin lens with a sensor behind it.

    Parameters
    ----------
    focal_length
        Focal length F in metres.
    f_number
        The photographer's f-number, F / (aperture *diameter*); ``inf`` for a pinhole.
    focus_distance
        Distance of the plane of focus in metres in front of the lens; may be ``inf``.
    residual_blur_variance
        Variance in rad^2 of the blur that remains in focus, beyond the pixel's own width: 0 unless the camera was
        calibrated; negative if the camera sharpens. The measured blur of an edge includes it.
    focus_tolerance, aperture_tolerance
        Relative standard deviations of the focus vergence and of the aperture diameter: the uncertainty of the lens's
        marks. The resulting error common to the whole frame is `focalgradient.DepthMap.common_sd`.
    field_tolerance
        Standard deviation by which the surface in focus may depart from a plane at the corner of the frame, on the
        sensor's side, as a fraction of the focal length: curvature and tilt of the field, part of ``common_sd`` there.
        The default is that of published designs (`FIELD_TOLERANCE`); 0 for an ideal lens, such as that of a simulation.

    Raises
    ------
    InputError
        If a length is not positive, the focus lies within the focal length, the focal length is below 0.1 mm or above
        10 m, or the f-number is below 0.02.

    Warns
    -----
    FocalGradientWarning
        If the focal length exceeds 2 m (it may be in millimetres), or the f-number is below 0.5 (it may be a diameter).

    Examples
    --------
    >>> lens = Lens(focal_length=0.050, f_number=2.0, focus_distance=1.0)
    >>> round(lens.aperture_diameter, 6), round(lens.sensor_distance, 6)
    (0.025, 0.052632)
    >>> float(lens.defocus(2.0))  # a point at 2 m lies 0.5 D beyond the plane of focus
    0.5
    """

    focal_length: Annotated[float, Range("metres", positive=True)]
    f_number: Annotated[float, Range("f-stops", positive=True, finite=False)]
    focus_distance: Annotated[float, Range("metres", positive=True, finite=False)]
    residual_blur_variance: Annotated[float, Range("rad^2")] = 0.0
    focus_tolerance: Annotated[float, TOLERANCE] = 0.0
    aperture_tolerance: Annotated[float, TOLERANCE] = 0.0
    field_tolerance: Annotated[float, TOLERANCE] = FIELD_TOLERANCE

    def __post_init__(self) -> None:
        check_fields(self)
        check_focal_length(self.focal_length)
        check_f_number(self.f_number, self.focal_length)
        check_focus(self.focus_distance, self.focal_length)

    @property
    def aperture_diameter(self) -> float:
        """Aperture diameter in metres, F/N; 0 for a pinhole."""
        return self.focal_length / self.f_number

    @property
    def focus_vergence(self) -> float:
        """Vergence V_f of the plane of focus in dioptres: 1/F - 1/(sensor distance)."""
        return 1.0 / self.focus_distance

    @property
    def field_sd(self) -> float:
        """Standard deviation of the focus at the corner of the frame in dioptres, for its curvature and for its tilt.

        >>> Lens(0.030, 2.0, 1.0).field_sd
        0.1
        """
        return self.field_tolerance / self.focal_length

    @property
    def sensor_distance(self) -> float:
        """Distance v0 from lens to sensor in metres, from the thin-lens equation 1/u + 1/v = 1/F: Eq. 12."""
        return 1.0 / (1.0 / self.focal_length - self.focus_vergence)

    def refocused(self, vergence: float) -> Lens:
        """Return the lens focused at another `vergence` (D, 0 for infinity), with the same aperture.

        >>> Lens(0.050, 2, 1.0).refocused(0.5).focus_distance
        2.0
        """
        if not vergence >= 0:
            raise InputError(f"vergence is {vergence!r} D, but must be 0 D (infinity) or more: give dioptres.")
        return replace(self, focus_distance=1 / vergence if vergence > 0 else float("inf"))

    def defocus(self, distance: ArrayLike) -> FloatArray:
        """Return the defocus in dioptres of points at `distance` (m, any shape); positive beyond the plane of focus.

        >>> Lens(0.025, 4, 0.5).defocus([0.25, 0.5, np.inf]).tolist()
        [-2.0, 0.0, 2.0]
        """
        return defocus_at(distance, self.focus_vergence)

    def blur_radius(self, distance: ArrayLike) -> FloatArray:
        """Return the angular radius in radians of the blur disc of points at `distance` (m, any shape).

        The counterpart in vergence of Eq. 15, which follows from similar triangles: r / v = sigma / (v0 - v), with lens
        radius r and disc radius sigma on the sensor. Multiply by `sensor_distance` for metres on the sensor; divide by
        a view's pixel angle for pixels.

        >>> float(Lens(0.050, 2, 1.0).blur_radius(2.0))  # (25 mm / 2) x 0.5 D
        0.00625
        """
        return np.abs(self.defocus(distance)) * (self.aperture_diameter / 2)

    def distance_from_blur(self, radius: ArrayLike, side: Side) -> FloatArray:
        """Return the distance in metres whose blur disc has the angular `radius` (rad, any shape) on one `side`.

        The inverse of `blur_radius`; a single blur radius does not determine the side. The blur radius of infinity
        gives ``inf``; a larger one beyond focus, which no real point has, gives ``nan``.

        >>> lens = Lens(0.050, 2, 1.0)
        >>> [round(lens.distance_from_blur(0.00625, side).item(), 4) for side in ("beyond", "nearer")]
        [2.0, 0.6667]
        """
        if self.aperture_diameter == 0:
            raise InputError("a pinhole has no blur, which cannot give a distance: use a finite f_number.")
        return distance_of_blur(radius, side, self.aperture_diameter, self.focus_vergence)


def defocus_at(distance: ArrayLike, focus_vergence: float) -> FloatArray:
    """Return the defocus (D) of points at `distance` (m); raise `InputError` unless all are positive or infinite."""
    values = np.asarray(distance, dtype=float)
    if not np.all(values > 0):
        raise InputError(
            "distance contains values that are not positive, but must be metres in front of the lens or eye: "
            "correct them."
        )
    return focus_vergence - 1.0 / values


def distance_of_blur(radius: ArrayLike, side: Side, aperture: float, focus_vergence: float) -> FloatArray:
    """Return the distance (m) on one `side` of focus whose blur has angular `radius` (rad) for an `aperture` (m)."""
    if side not in ("beyond", "nearer"):
        raise InputError(f"side is {side!r}, but must be 'beyond' or 'nearer' (than the plane of focus).")
    radius = np.asarray(radius, dtype=float)
    if not np.all(radius >= 0):
        raise InputError("radius contains negative or NaN values, but blur radii must be 0 or more: give radians.")
    step = radius / (aperture / 2)
    vergence = focus_vergence + (step if side == "nearer" else -step)
    # Tolerate rounding errors, so that the blur radius of infinity maps back to infinity.
    vergence = np.where(np.abs(vergence) < 8 * np.finfo(float).eps * step, 0.0, vergence)
    with np.errstate(divide="ignore"):
        return np.where(vergence >= 0, 1.0 / np.abs(vergence), np.nan)
