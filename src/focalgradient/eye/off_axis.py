"""Off-axis refraction of the eye: mean values of people, or of a schematic eye traced by rays.

By default an eye off axis has the mean refraction of emmetropic people (`peripheral_refraction.EMMETROPES`), who are
myopic there. `SCHEMATIC` is the wide-angle eye of Escudero-Sanz & Navarro (1999, "Off-axis aberrations of a wide-angle
schematic eye model", J. Opt. Soc. Am. A 16, 1881): four conic surfaces of revolution and a spherical retina, in light
of 543 nm, relaxed. Its chief ray is traced, and the two foci along it follow from Coddington's equations. It is
hyperopic off axis, as few people's eyes are, but covers all meridians.

Neither includes differences between people, of a dioptre and more in the periphery, or the apparent narrowing of the
pupil; the schematic eye does not include the asymmetry of real eyes (the fovea lies some 5 degrees from the axis).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from focalgradient.errors import InputError, check_number, checked, described
from focalgradient.eye.peripheral_refraction import EMMETROPES, PeripheralRefraction
from focalgradient.eye.periphery import TOWARDS, Measured, Meridian, check_meridian
from focalgradient.eye.protocol import check_eye
from focalgradient.eye.ranges import Pupil

__all__ = ["SCHEMATIC", "SchematicPeriphery", "field_coma", "field_foci", "off_axis"]

Surface = tuple[float, float, float, float]
"""Position of the vertex and radius of curvature (m), conic constant, refractive index behind."""

SURFACES: tuple[Surface, ...] = (
    (0.0, 7.72e-3, -0.26, 1.3777),
    (0.55e-3, 6.5e-3, 0.0, 1.3391),
    (3.60e-3, 10.2e-3, -3.1316, 1.4222),
    (7.60e-3, -6.0e-3, -1.0, 1.3377),
)
"""Surfaces of cornea and lens of Escudero-Sanz & Navarro's eye, at 543 nm."""

RETINA: Surface = (23.9203e-3, -12e-3, 0.0, 1.3377)
STOP, BEFORE_STOP = 3.60e-3, 2
"""Position of the pupil (m), at the front of the lens; number of surfaces in front of it."""

FAN = 0.5e-3
"""Height (m) in the pupil of the marginal rays from which coma is computed: higher orders are small in a pupil of 1
mm."""


@checked
def field_foci(eccentricity_deg: Measured) -> tuple[float, float]:
    """Return the tangential and sagittal vergences in focus relative to the fovea, in dioptres.

    The tangential plane holds the axis and the point that is looked at from the side. Positive is nearer.

    >>> [round(one, 2) for one in field_foci(20.0)]
    [0.13, -0.71]
    """
    there, here = _foci(_slope(math.radians(eccentricity_deg))), _foci(0.0)
    return there[0] - here[0], there[1] - here[1]


@checked
def field_coma(eccentricity_deg: Measured, pupil_diameter: Pupil) -> float:
    """Return the schematic eye's coma over a pupil (m), in micrometres, along the direction towards the point fixated.

    Its Zernike coefficient of orders 3 and 1, by the curvature of the slope of the rays that leave a place on the
    retina over the pupil's tangential section (Seidel's coma: where the wavefront is W y^3, c = W a^3 / (6 sqrt 2)).

    >>> round(field_coma(20.0, 0.004), 3)
    -0.282
    """
    chief = _slope(math.radians(eccentricity_deg))
    heights = np.linspace(-FAN, FAN, 9)
    passed = [_through(float(height), chief) for height in heights]
    middle = passed[len(passed) // 2]
    cosine, sine = math.cos(middle.before), math.sin(middle.before)
    place, slope = [], []
    for one in passed:
        turn = one.before - middle.before
        z, y = one.z - middle.z, one.y - middle.y
        # Where the ray meets the plane across the middle ray, and its angle with that.
        place.append(y * cosine - z * sine - (z * cosine + y * sine) * math.tan(turn))
        slope.append(math.tan(turn))
    bend = float(np.polynomial.polynomial.polyfit(place, slope, 4)[2])
    # The wavefront's slope is that of the rays; the place at which one looks lies at negative heights.
    return -1e6 * bend * (pupil_diameter / 2) ** 3 / (18 * math.sqrt(2))


@dataclass(frozen=True, slots=True)
class SchematicPeriphery:
    """Off-axis refraction of the schematic eye, the same in all meridians."""

    @checked
    def foci(self, eccentricity_deg: float, meridian: Meridian = "temporal") -> tuple[float, float]:
        """Return the tangential and sagittal vergences in focus relative to the fovea (D): `field_foci`.

        >>> sum(SCHEMATIC.foci(30.0, "superior")) / 2 < 0  # hyperopic, where emmetropic people are myopic
        True
        """
        return field_foci(eccentricity_deg)


SCHEMATIC = SchematicPeriphery()
"""Off-axis refraction of Escudero-Sanz & Navarro's schematic eye."""


def off_axis(
    eye: Any,
    eccentricity_deg: float,
    meridian: Meridian = "temporal",
    *,
    foci: tuple[float, float] | PeripheralRefraction | SchematicPeriphery = EMMETROPES,
    coma: bool = False,
) -> Any:
    """Return the eye as it is away from the fovea, with the refraction and astigmatism there.

    Its focus moves by the mean of the two foci there, and it has the astigmatism between them. Pass `resolved_cpd`,
    the resolution of ganglion cells there, to its `Cones`.

    Parameters
    ----------
    eye
        The eye at the fovea: an `Eye`, or an `EyeModel` that has ``aberrated``.
    eccentricity_deg, meridian
        Location in the visual field, in degrees from the fovea.
    foci
        Refraction there: the mean of emmetropic people (`EMMETROPES`, the default) or of myopic ones (`MYOPES`), both
        along the horizontal meridian only; of the schematic eye in any meridian (`SCHEMATIC`); or that of a measured
        eye, in dioptres nearer than at the fovea, in the tangential and the sagittal plane.
    coma
        Whether the eye has the schematic eye's coma there (`field_coma`), as a right eye.

    Raises
    ------
    InputError
        If the eccentricity is out of range, the meridian unknown, or one in which the people were not measured.

    Examples
    --------
    Emmetropes are myopic off axis, more so in the nasal field; the schematic eye is hyperopic.

    >>> from focalgradient import Eye
    >>> eye = Eye(0.004, 1.0)
    >>> [round(off_axis(eye, 20.0, side).focus_vergence, 2) for side in ("temporal", "nasal")]
    [1.18, 1.65]
    >>> round(off_axis(eye, 20.0, foci=SCHEMATIC).focus_vergence, 2)
    0.71
    """
    check_meridian(meridian)
    check_eye("eye", eye, "aberrated")
    if isinstance(foci, PeripheralRefraction | SchematicPeriphery):
        foci = foci.foci(eccentricity_deg, meridian)
    tangential, sagittal = _pair(foci)
    for focus in (tangential, sagittal):
        check_number("foci", focus, "dioptres")
    right, down = TOWARDS[meridian]
    across = 1 if right else -1  # whether the tangential plane is horizontal
    # c (x^2 - y^2) sqrt(6) / a^2 is half the difference of the powers times (x^2 - y^2) / 2.
    um = across * (tangential - sagittal) * (1e3 * eye.aperture_diameter) ** 2 / (16 * math.sqrt(6))
    added = [(2, 2, um)]
    if coma:
        added.append((3, across, (right + down) * field_coma(eccentricity_deg, eye.aperture_diameter)))
    return eye.refocused(eye.focus_vergence + (tangential + sagittal) / 2).aberrated(added)


def _pair(foci: object) -> tuple[float, float]:
    """Validate foci given as two numbers."""
    if not (isinstance(foci, tuple | list) and len(foci) == 2):
        raise InputError(
            f"foci is {described(foci)}, but must be EMMETROPES, MYOPES, SCHEMATIC, or two focus changes: give the "
            "tangential and the sagittal one in dioptres."
        )
    return foci[0], foci[1]


def _through(height: float, chief: float) -> _Meeting:
    """Return where the ray at `height` (m) in the pupil meets the cornea, if it ends where the ray at `chief` does."""
    from scipy.optimize import brentq  # deferred: slow to import

    place = _end(_path(chief))
    angle = brentq(lambda one: _end(_path(one, height)) - place, chief - 0.5, chief + 0.5, xtol=1e-14)
    return _path(float(angle), height)[0]


def _end(path: list[_Meeting]) -> float:
    """Return the height (m) at which a ray meets the retina."""
    return _meet(RETINA, path[-1].y, path[-1].z, path[-1].behind)[0]


def _slope(field: float) -> float:
    """Return the angle (rad) between cornea and pupil of the chief ray from `field` (rad)."""
    from scipy.optimize import brentq  # deferred: slow to import

    return float(brentq(lambda angle: _path(angle)[0].before - field, 0.0, field)) if field else 0.0


@dataclass(frozen=True, slots=True)
class _Meeting:
    """Point where a ray meets a surface (m), and angles (rad) of the ray before and behind it and of the normal."""

    y: float
    z: float
    before: float
    behind: float
    normal: float


def _foci(angle: float) -> tuple[float, float]:
    """Return the tangential and sagittal vergences (D) in front of the eye that are in focus on the retina.

    Coddington's equations, from the retina outwards: n' cos^2 i' / t' - n cos^2 i / t = (n' cos i' - n cos i) / R_t,
    and the same without the squares of the cosines and with R_s.
    """
    path = _path(angle)
    y, z = _meet(RETINA, path[-1].y, path[-1].z, path[-1].behind)
    t = s = 0.0
    for number in range(len(SURFACES) - 1, -1, -1):
        here, (_, radius, conic, index), ahead = path[number], SURFACES[number], _ahead(number)
        length = math.hypot(here.y - y, here.z - z)
        t, s, y, z = t + length, s + length, here.y, here.z
        sagittal = math.copysign(math.sqrt(radius**2 - conic * y**2), radius)
        tangential = sagittal**3 / radius**2
        into, out = math.cos(here.before - here.normal), math.cos(here.behind - here.normal)
        power = index * out - ahead * into
        t = ahead * into**2 / (index * out**2 / t - power / tangential)
        s = ahead / (index / s - power / sagittal)
    return -1 / t, -1 / s


def _path(angle: float, height: float = 0.0) -> list[_Meeting]:
    """Trace the ray through the pupil at `angle` to the axis and a `height` (m), outwards and inwards.

    Off the middle it meets the front of the lens, whose vertex the pupil touches, a little behind the pupil.
    """
    found: list[_Meeting] = []
    for outwards, numbers in ((True, range(BEFORE_STOP - 1, -1, -1)), (False, range(BEFORE_STOP, len(SURFACES)))):
        y, z, here = height, STOP, angle
        for number in numbers:
            y, z = _meet(SURFACES[number], y, z, here)
            normal = _normal(SURFACES[number], y)
            ratio = _ahead(number) / SURFACES[number][3]
            there = normal + math.asin((1 / ratio if outwards else ratio) * math.sin(here - normal))
            found.append(_Meeting(y, z, *((there, here) if outwards else (here, there)), normal))
            here = there
        if outwards:
            found.reverse()
    return found


def _ahead(number: int) -> float:
    """Return the refractive index in front of a surface."""
    return SURFACES[number - 1][3] if number else 1.0


def _meet(surface: Surface, y: float, z: float, angle: float) -> tuple[float, float]:
    """Return the intersection of a ray with a surface: y^2 - 2 R h + (1 + Q) h^2 = 0, h from its vertex."""
    vertex, radius, conic, _ = surface
    rise = math.tan(angle)
    start = y + (vertex - z) * rise
    half = radius - start * rise
    root = math.copysign(math.sqrt(half**2 - (rise**2 + 1 + conic) * start**2), radius)
    height = start**2 / (half + root)
    return start + height * rise, vertex + height


def _normal(surface: Surface, y: float) -> float:
    """Return the angle (rad) of the normal with the axis at height y."""
    _, radius, conic, _ = surface
    return -math.atan(y / math.copysign(math.sqrt(radius**2 - (1 + conic) * y**2), radius))
