"""Views of a scene in the light, at the place in the visual field and with the scatter that an eye sees it with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Unpack

from focalgradient.errors import check_fields
from focalgradient.eye.accommodation import Cue
from focalgradient.eye.age import aged_light
from focalgradient.eye.cones import S_FINEST_CPD, Cones
from focalgradient.eye.fluctuation import Oscillation
from focalgradient.eye.light import Band, Light, band_light
from focalgradient.eye.model_eye import Eye, TimeCourse
from focalgradient.eye.off_axis import off_axis
from focalgradient.eye.peripheral_refraction import EMMETROPES, PeripheralRefraction
from focalgradient.eye.periphery import Meridian, resolved_cpd
from focalgradient.eye.scatter import Scatter
from focalgradient.eye.views import FormingBands, SceneInput, eye_views
from focalgradient.render import Rendered

__all__ = ["EXTREMES_S", "ViewingConditions", "compared_views"]

EXTREMES_S = (0.125, 0.375)
"""Times in seconds of the extremes of an oscillation at 2 Hz, 250 ms apart."""


@dataclass(frozen=True, slots=True)
class ViewingConditions:
    """Conditions under which an eye sees.

    Parameters
    ----------
    illuminant
        Light of the scene: see `focalgradient.eye.illuminant`.
    age
        Age in years of the eye's lens, which filters the light; None: that of the cone fundamentals.
    scatter
        Whether light is scattered in the eye (`Scatter`), at `age` or at 25 years.
    eccentricity_deg, meridian
        Place in the visual field, in degrees from the fovea; None: the fovea.

    Examples
    --------
    >>> old = ViewingConditions(age=70, eccentricity_deg=10.0)
    >>> round(old.cones(Eye(0.004, 1.0), "L+M").finest_cpd, 1), round(old.off_axis(Eye(0.004, 1.0)).focus_vergence, 2)
    (8.0, 0.98)
    """

    illuminant: str = "D65"
    age: float | None = None
    scatter: bool = False
    eccentricity_deg: float | None = None
    meridian: Meridian = "temporal"

    def __post_init__(self) -> None:
        check_fields(self)

    def light(self, band: Band) -> Light:
        """Return the light that the cones of a `band` catch."""
        caught = band_light(band, self.illuminant)
        return caught if self.age is None else aged_light(caught, self.age)

    def off_axis(self, eye: Eye, people: PeripheralRefraction = EMMETROPES) -> Eye:
        """Return the eye as it is at the place in its visual field: with refraction and coma of `people` there."""
        if self.eccentricity_deg is None:
            return eye
        return off_axis(eye, self.eccentricity_deg, self.meridian, foci=people, coma=True)

    def cones(self, eye: Eye, band: Band) -> Cones:
        """Return the cones of a `band`, with the resolution at the place; of "luminance" the optics alone."""
        finest = S_FINEST_CPD if band == "S" else math.inf
        if self.eccentricity_deg is not None and band != "luminance":
            finest = min(finest, float(resolved_cpd(self.eccentricity_deg, self.meridian)))
        cones = Cones.in_light(eye, band, self.light(band), finest_cpd=finest)
        if not self.scatter:
            return cones
        return replace(cones, scatter=Scatter() if self.age is None else Scatter(self.age))


def compared_views(
    scene: SceneInput,
    eye: Eye,
    cue: Cue,
    shape: tuple[int, int],
    pixel_angle: float,
    *,
    conditions: ViewingConditions | None = None,
    course: TimeCourse | None = None,
    times: Sequence[float] = EXTREMES_S,
    **forming: Unpack[FormingBands],
) -> dict[str, Rendered]:
    """Return the views from which an eye could estimate depth, by band and moment.

    Parameters
    ----------
    scene, shape, pixel_angle, forming
        As for `eye_views`, with a `correlation` of 0.95 and `noise` of 0.01 by default.
    eye
        The eye at the mean of the course, at its place in the visual field (`ViewingConditions.off_axis`).
    cue
        "bands": L and M cones together and S cones at one moment; "moments": L and M cones at `times`; or "both".
    conditions
        By default the fovea in daylight.
    course, times
        Course of accommodation, by default `Oscillation`, and the moments (s) seen of it.

    Returns
    -------
    dict
        The views by their name, such as "L+M at 125 ms".

    Examples
    --------
    >>> seen = compared_views(0.5, Eye(0.004, 1.0), "both", (64, 64), math.radians(1 / 60))
    >>> [*seen]
    ['L+M at 125 ms', 'S at 125 ms', 'L+M at 375 ms', 'S at 375 ms']
    """
    conditions, moments = conditions or ViewingConditions(), {"": eye}
    if cue != "bands":
        eyes = eye.through(times, course or Oscillation())
        moments = {f" at {1e3 * time:.0f} ms": one for time, one in zip(times, eyes, strict=True)}
    bands: tuple[Band, ...] = ("L+M",) if cue == "moments" else ("L+M", "S")
    cones = {f"{band}{moment}": conditions.cones(one, band) for moment, one in moments.items() for band in bands}
    assumed = FormingBands(correlation=0.95, noise=0.01)
    views = eye_views(scene, [*cones.values()], shape, pixel_angle, **(assumed | forming))
    return dict(zip(cones, views, strict=True))
