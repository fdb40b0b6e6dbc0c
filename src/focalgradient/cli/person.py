"""Options for an eye by prescription and age, shared by commands, and the eye that they describe."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

from focalgradient.cli.generate import Made, options_named

if TYPE_CHECKING:
    from focalgradient.eye import Eye, EyeDescription

__all__ = ["Person", "described_eye", "has_natural_pupil", "is_person", "person_eye", "person_options"]

Person = Annotated[Any, Made("focalgradient.eye:EyeDescription")]
"""A `focalgradient.eye.EyeDescription`."""

NAMES = ("refraction", "correction", "age", "luminance", "aberrations", "zones")
"""Parameters of the options."""

NAMED = {name: f"--{name}" for name in NAMES} | {
    "typical aberrations": "--aberrations typical",
    "smaller pupil_diameter": "smaller --pupil",
    "pupil_diameter and": "--pupil and",
    "the pupil's diameter instead": "--pupil as well",
}
"""Options by the library's parameter, for `options_named`."""


def described_eye(person: EyeDescription, pupil_mm: float | None, vergence: float) -> Eye:
    """Return a person's eye with a pupil (mm; None: its natural one) that looks at a `vergence` (D)."""
    with options_named(NAMED):
        return person.eye(vergence, None if pupil_mm is None else 1e-3 * pupil_mm)


def person_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options for a person's eye, from which `person_eye` makes an eye."""
    found = Person.__metadata__[0].parameters()
    options = [option for name in NAMES for option in found[name]]
    command.__dict__.setdefault("__click_params__", []).extend(reversed(options))
    return command


def _description(options: Mapping[str, Any]) -> EyeDescription:
    from focalgradient.eye import EyeDescription

    with options_named({"zones is": "--zones is"}):
        return EyeDescription(**{name: options[name] for name in NAMES})


def is_person(options: Mapping[str, Any]) -> bool:
    """Return whether any of these options is given."""
    return not _description(options).is_empty


def has_natural_pupil(options: Mapping[str, Any]) -> bool:
    """Return whether these options give the pupil of an eye without ``--pupil``."""
    return _description(options).has_natural_pupil


def person_eye(options: Mapping[str, Any], pupil_mm: float | None, vergence: float) -> Eye:
    """Return the eye of the options, as `described_eye`."""
    return described_eye(_description(options), pupil_mm, vergence)
