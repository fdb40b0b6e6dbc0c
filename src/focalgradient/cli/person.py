"""Options for an eye by prescription and age, shared by commands, and the eye that they describe."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from focalgradient.cli.options import added, options_named, positive

if TYPE_CHECKING:
    from focalgradient.eye import Eye, EyeDescription

__all__ = ["description_of", "has_natural_pupil", "is_person", "person_eye", "person_options"]

CORRECTIONS = ("none", "spectacles", "contact-lens")
"""Names of `focalgradient.eye.CORRECTIONS`, without importing it."""

OLDEST = 120.0
"""Maximum age in years, as `focalgradient.eye.ranges.OLDEST`, without importing it."""

PERSON = ("refraction", "correction", "age", "luminance", "aberrations", "zones")
"""Parameters of the options."""

NAMED = {name: f"--{name}" for name in PERSON} | {
    "typical aberrations": "--aberrations typical",
    "smaller pupil_diameter": "smaller --pupil",
    "pupil_diameter and": "--pupil and",
    "the pupil's diameter instead": "--pupil as well",
}
"""Options by the library's parameter, for `options_named`."""

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
        help="Multifocal lens: outer diameter (mm) and added power (D) of each zone, centre outwards, as 2:2,8:0.",
    ),
]
"""Options that describe a person's eye."""


def person_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options for a person's eye, from which `person_eye` makes an eye."""
    return added(command, _PERSON)


def is_person(options: dict[str, Any]) -> bool:
    """Return whether any of these options is given."""
    return any(options[name] is not None for name in PERSON)


def has_natural_pupil(options: dict[str, Any]) -> bool:
    """Return whether these options give the pupil of an eye without ``--pupil``."""
    return any(options[name] is not None for name in ("refraction", "age", "luminance"))


def description_of(options: dict[str, Any]) -> EyeDescription:
    """Return the description of the eye by the options of `person_options`."""
    from focalgradient.eye import EyeDescription, ZonedLens

    with options_named(NAMED):
        lens = None if options["zones"] is None else ZonedLens.parse(options["zones"])
    return EyeDescription(**{name: options[name] for name in PERSON if name != "zones"}, lens=lens)


def person_eye(options: dict[str, Any], pupil_mm: float | None, vergence: float) -> Eye:
    """Return the eye of the options with a pupil (mm; None: its natural one) that looks at a `vergence` (D)."""
    described = description_of(options)
    with options_named(NAMED):
        return described.eye(vergence, None if pupil_mm is None else 1e-3 * pupil_mm)
