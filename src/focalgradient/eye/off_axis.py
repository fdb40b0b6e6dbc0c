"""The eye's focus away from the fovea: curvature of the field and oblique astigmatism of a schematic eye.

The wide-angle eye of Escudero-Sanz & Navarro (1999, "Off-axis aberrations of a wide-angle schematic eye model", J. Opt.
Soc. Am. A 16, 1881): four conic surfaces of revolution and a spherical retina, in light of 543 nm, relaxed. Its ray
through the middle of the pupil is traced, and the two foci along it follow from Coddington's equations.

What it leaves out: real eyes are not symmetric (the fovea lies some 5 degrees from the axis), differ from each other by
a dioptre and more in the periphery, and their pupil looks narrower from the side. Coma off axis is not given either.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from scipy.optimize import brentq

from focalgradient.errors import InputError, check_number
from focalgradient.eye.model_eye import Eye
from focalgradient.eye.periphery import Meridian, check_meridian

__all__ = ["field_foci", "off_axis"]

Surface = tuple[float, float, float, float]
"""Place of the vertex and radius of curvature (m), conic constant, refractive index behind."""

SURFACES: tuple[Surface, ...] = (
    (0.0, 7.72e-3, -0.26, 1.3777),
    (0.55e-3, 6.5e-3, 0.0, 1.3391),
    (3.60e-3, 10.2e-3, -3.1316, 1.4222),
    (7.60e-3, -6.0e-3, -1.0, 1.3377),
)
"""Cornea and lens of Escudero-Sanz & Navarro's eye, at 543 nm."""

RETINA: Surface = (23.9203e-3, -12e-3, 0.0, 1.3377)
STOP, BEFORE_STOP = 3.60e-3, 2
"""Place of the pupil (m), on the front of the lens; surfaces in front of it."""

FARTHEST = 40.0
"""Degrees: a choice. The model's astigmatism grows to 3.9 D there and ever faster beyond, more than most eyes have."""


def field_foci(eccentricity_deg: float) -> tuple[float, float]:
    """Vergences in focus, less that at the fovea, in the tangential and in the sagittal plane: dioptres.

    The tangential plane holds the axis and the point that is looked at from the side. Positive is nearer.

    >>> [round(one, 2) for one in field_foci(20.0)]
    [0.13, -0.71]
    """
    check_number("eccentricity_deg", eccentricity_deg, "degrees", least=0)
    if eccentricity_deg > FARTHEST:
        raise InputError(
            f"eccentricity_deg is {eccentricity_deg:g}, but must be from 0 to {FARTHEST:g}: farther out real eyes "
            "differ from the model."
        )
    there, here = _foci(_slope(math.radians(eccentricity_deg))), _foci(0.0)
    return there[0] - here[0], there[1] - here[1]


def off_axis(
    eye: Eye, eccentricity_deg: float, meridian: Meridian = "temporal", *, foci: tuple[float, float] | None = None
) -> Eye:
    """The same eye for what lies away from the fovea: refracted as there, and astigmatic.

    Its focus moves by the mean of the two foci there, and it has the astigmatism between them. Give its `Cones` what
    ganglion cells resolve there, `resolved_cpd`.

    Parameters
    ----------
    eye
        As it is at the fovea.
    eccentricity_deg, meridian
        Where in the visual field, in degrees from the fovea.
    foci
        Of a measured eye there, in place of the schematic eye's `field_foci`: dioptres nearer than at the fovea, in the
        tangential and the sagittal plane.

    Raises
    ------
    InputError
        If the eccentricity is out of range, or the meridian unknown.

    Examples
    --------
    >>> side = off_axis(Eye(0.004, 1.0), 20.0)
    >>> round(side.focus_vergence, 2), [(n, m, round(um, 2)) for n, m, um in side.aberrations]
    (0.71, [(2, 2, 0.34)])
    """
    check_meridian(meridian)
    tangential, sagittal = field_foci(eccentricity_deg) if foci is None else foci
    for focus in (tangential, sagittal):
        check_number("foci", focus, "dioptres")
    across = 1 if meridian in ("temporal", "nasal") else -1  # whether the tangential plane is horizontal
    # c (x^2 - y^2) sqrt(6) / a^2 is half the difference of the powers times (x^2 - y^2) / 2.
    um = across * (tangential - sagittal) * (1e3 * eye.pupil_diameter) ** 2 / (16 * math.sqrt(6))
    terms: dict[tuple[int, int], float] = {}
    for n, m, c in (*eye.aberrations, (2, 2, um)):
        terms[n, m] = terms.get((n, m), 0.0) + c
    return replace(
        eye,
        accommodation=eye.accommodation + (tangential + sagittal) / 2,
        aberrations=tuple((n, m, c) for (n, m), c in sorted(terms.items()) if c),
    )


def _slope(field: float) -> float:
    """Angle (rad) with the axis, between cornea and pupil, of the ray through the pupil's middle from `field` (rad)."""
    return float(brentq(lambda angle: _path(angle)[0].before - field, 0.0, field)) if field else 0.0


@dataclass(frozen=True, slots=True)
class _Meeting:
    """Where a ray meets a surface (m), its angles with the axis before and behind it, and that of the normal (rad)."""

    y: float
    z: float
    before: float
    behind: float
    normal: float


def _foci(angle: float) -> tuple[float, float]:
    """Vergences (D) in front of the eye that are in focus on the retina in the tangential and the sagittal plane.

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


def _path(angle: float) -> list[_Meeting]:
    """The ray that passes the middle of the pupil at `angle` to the axis, traced outwards and inwards from there."""
    found, y, z, behind = [], 0.0, STOP, angle
    for number in range(BEFORE_STOP - 1, -1, -1):
        y, z = _meet(SURFACES[number], y, z, behind)
        normal = _normal(SURFACES[number], y)
        before = normal + math.asin(SURFACES[number][3] / _ahead(number) * math.sin(behind - normal))
        found.append(_Meeting(y, z, before, behind, normal))
        behind = before
    found.reverse()
    y, z, before = 0.0, STOP, angle
    for number in range(BEFORE_STOP, len(SURFACES)):
        y, z = _meet(SURFACES[number], y, z, before)
        normal = _normal(SURFACES[number], y)
        behind = normal + math.asin(_ahead(number) / SURFACES[number][3] * math.sin(before - normal))
        found.append(_Meeting(y, z, before, behind, normal))
        before = behind
    return found


def _ahead(number: int) -> float:
    """Refractive index in front of a surface."""
    return SURFACES[number - 1][3] if number else 1.0


def _meet(surface: Surface, y: float, z: float, angle: float) -> tuple[float, float]:
    """Where the ray through (y, z) at `angle` meets a surface: y^2 - 2 R h + (1 + Q) h^2 = 0, h from its vertex on."""
    vertex, radius, conic, _ = surface
    rise = math.tan(angle)
    start = y + (vertex - z) * rise
    half = radius - start * rise
    root = math.copysign(math.sqrt(half**2 - (rise**2 + 1 + conic) * start**2), radius)
    height = start**2 / (half + root)
    return start + height * rise, vertex + height


def _normal(surface: Surface, y: float) -> float:
    """Angle of the normal with the axis at height y (rad)."""
    _, radius, conic, _ = surface
    return -math.atan(y / math.copysign(math.sqrt(radius**2 - (1 + conic) * y**2), radius))
