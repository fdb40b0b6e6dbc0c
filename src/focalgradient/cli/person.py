"""Options for an eye by prescription and age, shared by commands, and the eye that they describe."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import click

from focalgradient.cli.options import added, options_named, positive
from focalgradient.errors import InputError

if TYPE_CHECKING:
    from focalgradient.eye import Eye, ZonedLens

__all__ = ["eye_off_axis", "has_natural_pupil", "is_person", "person_eye", "person_options"]

CORRECTIONS = ("none", "spectacles", "contact-lens")
"""Names of `focalgradient.eye.CORRECTIONS`, without importing it."""

OLDEST = 120.0
"""Maximum age in years, as `focalgradient.eye.ranges.OLDEST`, without importing it."""

MYOPIA = -0.5
"""Mean sphere in dioptres from which an eye is myopic (International Myopia Institute: Flitcroft et al. 2019, Invest.
Ophthalmol. Vis. Sci. 60, M20)."""

_PERSON = [
    click.option(
        "--refraction",
        metavar="RX",
        help='Prescription of the eye, such as "-2.00 -0.75 x 180" (sphere, cylinder, axis).',
    ),
    click.option(
        "--correction",
        type=click.Choice(CORRECTIONS),
        help="Correction worn by the eye of --refraction; both lenses correct it fully.  [default: none]",
    ),
    click.option(
        "--age",
        type=float,
        metavar="YEARS",
        callback=positive(" of years", least=1, most=OLDEST),
        help="Age: sets the amplitude of accommodation, the density of the lens and, without --pupil, the pupil.",
    ),
    click.option(
        "--luminance",
        type=float,
        metavar="CD",
        callback=positive(" of cd/m^2"),
        help="Instead of --pupil: luminance (cd/m^2) of a field of 20 degrees, which with --age sets the pupil.  "
        "[default with --refraction or --age: 100]",
    ),
    click.option(
        "--aberrations",
        type=click.Choice(["typical"]),
        help="Coma, trefoil and spherical aberration, each with its mean magnitude in healthy eyes.  [default: none]",
    ),
    click.option(
        "--zones",
        metavar="MM:D,...",
        callback=lambda context, option, given: _zones(given),
        help="Multifocal lens: outer diameter (mm) and added power (D) of each zone, centre outwards, as 2:2,8:0.",
    ),
]
"""Options that describe a person's eye."""


def person_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options for a person's eye, from which `person_eye` makes an eye."""
    return added(command, _PERSON)


def is_person(options: dict[str, Any]) -> bool:
    """Return whether any of these options is given."""
    names = ("refraction", "correction", "age", "luminance", "aberrations", "zones")
    return any(options[name] is not None for name in names)


def has_natural_pupil(options: dict[str, Any]) -> bool:
    """Return whether these options give the pupil of an eye without ``--pupil``."""
    return any(options[name] is not None for name in ("refraction", "age", "luminance"))


def _zones(given: str | None) -> str | None:
    """Validate the zones of a lens."""
    if given is not None:
        _lens(given)
    return given


def _lens(zones: str) -> ZonedLens:
    from focalgradient.eye import ZonedLens

    try:
        pairs = [(float(mm), float(power)) for mm, power in (zone.split(":") for zone in zones.split(","))]
    except ValueError:
        raise InputError(
            f"--zones is {zones!r}, but must be outer diameters in millimetres and added powers in dioptres, from the "
            "centre outwards, such as 2:2,8:0."
        ) from None
    try:
        return ZonedLens(tuple(1e-3 * mm for mm, _ in pairs), tuple(power for _, power in pairs))
    except InputError:
        raise InputError(
            f"--zones is {zones!r}, but diameters must be positive and increase up to 20 mm, and powers must be "
            "within 10 D."
        ) from None


def eye_off_axis(eye: Eye, options: dict[str, Any], eccentricity: float, meridian: Literal["temporal", "nasal"]) -> Eye:
    """Return an eye as it is off axis: with the mean refraction there of the group its ``--refraction`` belongs to."""
    from focalgradient.eye import EMMETROPES, MYOPES, Refraction, off_axis

    given = options["refraction"]
    is_myopic = given is not None and Refraction.parse(given).power_vector[0] <= MYOPIA
    return off_axis(eye, eccentricity, meridian, foci=MYOPES if is_myopic else EMMETROPES, coma=True)


def person_eye(options: dict[str, Any], pupil_mm: float | None, vergence: float) -> Eye:
    """Return the eye of the options with a pupil (mm; None: its natural one) that looks at a `vergence` (D)."""
    from focalgradient.eye import Eye, typical_aberrations
    from focalgradient.eye.ranges import check_pupil, warn_if_artificial
    from focalgradient.eye.typical import MEASURED as LARGEST_TYPICAL

    if options["correction"] is not None and options["refraction"] is None:
        raise InputError("--correction corrects the eye of --refraction: give --refraction as well.")
    if pupil_mm is not None:
        check_pupil(1e-3 * pupil_mm)
        warn_if_artificial(1e-3 * pupil_mm)
        if options["luminance"] is not None:
            raise InputError("--pupil and --luminance both give the pupil: give one of them.")
    if not is_person(options) and pupil_mm is not None:
        return Eye(1e-3 * pupil_mm, vergence)
    named = {
        "refraction is": "--refraction is",
        "age is": "--age is",
        "the pupil's diameter instead": "--pupil as well",
    }
    with options_named(named):
        eye = Eye(
            None if pupil_mm is None else 1e-3 * pupil_mm,
            lens=None if options["zones"] is None else _lens(options["zones"]),
            refraction="plano" if options["refraction"] is None else options["refraction"],
            age=options["age"],
            looking_at=vergence,
            correction=options["correction"],
            luminance=options["luminance"],
        )
    if options["aberrations"] is not None:
        if eye.pupil_diameter > LARGEST_TYPICAL:
            raise InputError(
                f"--aberrations typical are known for pupils up to {1e3 * LARGEST_TYPICAL:g} mm, but this one has "
                f"{1e3 * eye.pupil_diameter:.3g}: give a smaller --pupil."
            )
        eye = replace(eye, aberrations=(*eye.aberrations, *typical_aberrations(eye.pupil_diameter)))
    return eye
