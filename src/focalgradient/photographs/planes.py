"""Reference planes of distances: sensor, front of the lens, entrance pupil.

For any lens, the blur angle is the pupil radius times a difference of vergence, both measured from the entrance pupil.
A tape measure starts at the camera's sensor mark or at the front of the lens, and the focus scale of a photographic
lens refers to the sensor. All three planes lie on one axis, so a single offset converts each: distance from the
entrance pupil = measured distance + offset.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from focalgradient.errors import InputError

__all__ = ["Body", "Plane", "plane_name"]

Plane = Literal["entrance_pupil", "sensor", "lens_front"]

UNSTATED_SD_FOCAL_LENGTHS = 0.5
"""Standard deviation of an unstated entrance-pupil position, in focal lengths (a design choice). In photographic lenses
of 18 to 85 mm it lies 40 to 140 mm in front of the sensor, 1 to 4 focal lengths."""

STATED_SD_M = 0.002
"""Standard deviation in metres of a stated plane position, as measured with a ruler."""

MIN_UNSTATED_SD_M = 0.02
"""Minimum standard deviation in metres of an unstated position: retrofocus lenses have it far in front."""


def plane_name(plane: str | None) -> str:
    """Return the plane's name in words.

    >>> plane_name("sensor"), plane_name(None)
    ('the sensor', 'the plane that the calibration was measured from')
    """
    if plane is None:
        return "the plane that the calibration was measured from"
    return {"sensor": "the sensor", "lens_front": "the front of the lens"}.get(plane, "the entrance pupil")


@dataclass(frozen=True, slots=True)
class Body:
    """Positions of the reference planes of a camera.

    Parameters
    ----------
    focal_length
        Focal length in metres.
    telecentric
        Whether the lens is image-space telecentric: the entrance pupil lies in the front focal plane.
    to_pupil, to_front
        Distances from the sensor to the entrance pupil, and to the front of the lens, in metres. None: unknown; the
        entrance pupil is then that of a thin lens with its stop at the lens (or in its front focal plane, if
        telecentric).

    Examples
    --------
    A 50 mm lens set to 1 m on a scale that refers to the sensor is focused 0.947 m in front of its entrance pupil:

    >>> round(Body(0.05).optical(1.0, "sensor"), 3)
    0.947
    """

    focal_length: float
    telecentric: bool = False
    to_pupil: float | None = None
    to_front: float | None = None

    def offset(self, plane: Plane, focus: float = math.inf) -> float:
        """Return distance from the entrance pupil minus distance from `plane` (m); `focus` (m) is from the pupil.

        Raises
        ------
        InputError
            If `plane` is the front of the lens and its position is unknown.
        """
        if plane == "entrance_pupil":
            return 0.0
        to_pupil = self._thin(focus) if self.to_pupil is None else self.to_pupil
        if plane == "sensor":
            return -to_pupil
        if self.to_front is None:
            raise InputError(
                "distances refer to lens_front, but its position is unknown: give sensor_to_front_mm, the "
                "distance from the sensor's mark on the camera to the front of the lens."
            )
        return self.to_front - to_pupil

    def offset_sd(self, plane: Plane) -> float:
        """Return the standard deviation of `offset` in metres."""
        if plane == "entrance_pupil" or self.to_pupil is not None:
            return STATED_SD_M
        return max(MIN_UNSTATED_SD_M, UNSTATED_SD_FOCAL_LENGTHS * self.focal_length)

    def optical(self, distance: float, plane: Plane) -> float:
        """Return the distance from the entrance pupil of an object in focus at `distance` from `plane`, in metres.

        Raises
        ------
        InputError
            As for `offset`, or if the distance lies behind the entrance pupil or is closer than the lens can focus.
        """
        if plane == "entrance_pupil" or math.isinf(distance):
            return distance
        if self.to_pupil is not None or plane == "lens_front":
            found = distance + self.offset(plane, distance)
        else:
            # distance = u + v0 with 1/u + 1/v0 = 1/F; if telecentric, the pupil lies F in front of the lens.
            length = self.focal_length
            square = distance**2 - 4 * distance * length
            found = (distance + math.sqrt(square)) / 2 - length * self.telecentric if square >= 0 else 0.0
        if not found > 0:
            raise InputError(
                f"a distance of {distance:g} m from {plane_name(plane)} lies behind the entrance pupil, or closer than "
                "the lens can focus: check its reference plane (focus_from, distances_from)."
            )
        return found

    def _thin(self, focus: float) -> float:
        """Return the distance from the sensor to the entrance pupil of a thin lens focused at `focus` (m)."""
        length = self.focal_length
        if self.telecentric:  # the pupil lies F in front of the lens; focus is relative to it
            lens = focus + length
            return length + (length if math.isinf(lens) else 1 / (1 / length - 1 / lens))
        return length if math.isinf(focus) else 1 / (1 / length - 1 / max(focus, 1.001 * length))
