"""The planes that distances are measured from: sensor, front of the lens, entrance pupil.

Blur's angle is the pupil's radius times a difference of vergence, seen from the entrance pupil, for any lens: vergence
counts from there. A tape measure starts at the sensor's mark on the camera or at the front of the lens, and the focus
scale of a photographic lens counts from the sensor. All three planes lie on one axis, so that one number converts each:
entrance pupil's distance = measured distance + offset.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from focalgradient.errors import InputError

__all__ = ["PLANES", "Body", "Plane", "plane_name"]

Plane = Literal["entrance_pupil", "sensor", "lens_front"]

PLANES: tuple[Plane, ...] = ("entrance_pupil", "sensor", "lens_front")

GUESS = 0.5
"""Standard deviation of the place of an entrance pupil that is not stated, in focal lengths: a choice. Photographic
lenses of 18 to 85 mm have it 40 to 140 mm before the sensor, 1 to 4 focal lengths."""

STATED_SD = 0.002
"""Standard deviation in metres of a place on the camera that is stated: as a ruler gives it."""

LEAST_SD = 0.02
"""Standard deviation in metres of a place that is not stated, at least: before a mirror, wide lenses sit far out."""


def plane_name(plane: str | None) -> str:
    """The plane in words.

    >>> plane_name("sensor"), plane_name(None)
    ('the sensor', 'the plane that the calibration was measured from')
    """
    if plane is None:
        return "the plane that the calibration was measured from"
    return {"sensor": "the sensor", "lens_front": "the front of the lens"}.get(plane, "the entrance pupil")


@dataclass(frozen=True, slots=True)
class Body:
    """Where the planes of a camera lie.

    Parameters
    ----------
    focal_length
        In metres.
    telecentric
        On the image side: the entrance pupil lies in the front focal plane.
    to_pupil, to_front
        From the sensor to the entrance pupil, and to the front of the lens, in metres. None: not stated; a thin lens
        with its stop at it (or in its front focal plane, where telecentric) then stands for the entrance pupil.

    Examples
    --------
    A lens of 50 mm whose scale says 1 m, counted from the sensor, is in focus 0.947 m before its entrance pupil:

    >>> round(Body(0.05).optical(1.0, "sensor"), 3)
    0.947
    """

    focal_length: float
    telecentric: bool = False
    to_pupil: float | None = None
    to_front: float | None = None

    def offset(self, plane: Plane, focus: float = math.inf) -> float:
        """Distance from the entrance pupil less distance from `plane`, in metres; `focus` (m) is from the pupil.

        Raises
        ------
        InputError
            If `plane` is the front of the lens and its place is not stated.
        """
        if plane == "entrance_pupil":
            return 0.0
        to_pupil = self._thin(focus) if self.to_pupil is None else self.to_pupil
        if plane == "sensor":
            return -to_pupil
        if self.to_front is None:
            raise InputError(
                "distances count from lens_front, but where it lies is not stated: give sensor_to_front_mm, the "
                "distance from the sensor's mark on the camera to the front of the lens."
            )
        return self.to_front - to_pupil

    def offset_sd(self, plane: Plane) -> float:
        """Standard deviation of `offset`, in metres."""
        if plane == "entrance_pupil" or self.to_pupil is not None:
            return STATED_SD
        return max(LEAST_SD, GUESS * self.focal_length)

    def optical(self, distance: float, plane: Plane) -> float:
        """Distance from the entrance pupil of what lies in focus at `distance` from `plane`, in metres.

        Raises
        ------
        InputError
            As `offset`, or if the distance lies behind the entrance pupil, or is less than a lens can focus at.
        """
        if plane == "entrance_pupil" or math.isinf(distance):
            return distance
        if self.to_pupil is not None or plane == "lens_front":
            found = distance + self.offset(plane, distance)
        else:
            # distance = u + v0 with 1/u + 1/v0 = 1/F; telecentric, the pupil lies F before the lens.
            length = self.focal_length
            square = distance**2 - 4 * distance * length
            found = (distance + math.sqrt(square)) / 2 - length * self.telecentric if square >= 0 else 0.0
        if not found > 0:
            raise InputError(
                f"a distance of {distance:g} m from {plane_name(plane)} lies behind the entrance pupil, or nearer than "
                "the lens can focus: check which plane it counts from (focus_from, distances_from)."
            )
        return found

    def _thin(self, focus: float) -> float:
        """From the sensor to the entrance pupil of a thin lens that is focused at `focus` (m)."""
        length = self.focal_length
        if self.telecentric:  # the pupil lies F before the lens; focus counts from it
            lens = focus + length
            return length + (length if math.isinf(lens) else 1 / (1 / length - 1 / lens))
        return length if math.isinf(focus) else 1 / (1 / length - 1 / max(focus, 1.001 * length))
