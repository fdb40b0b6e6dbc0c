"""Options for an eye by prescription and age, or by a file, shared by commands, and the eye that they describe."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from focalgradient.cli.generate import Made, options_named

if TYPE_CHECKING:
    from focalgradient.eye import Eye, EyeDescription

__all__ = ["PERSON", "Person", "eye_of"]

PERSON = Made("focalgradient.eye:EyeDescription")
"""Options that describe a person's eye."""

Person = Annotated[Any, PERSON]
"""A `focalgradient.eye.EyeDescription`."""

NAMED = {
    "typical aberrations": "--aberrations typical",
    "smaller pupil_diameter": "smaller --pupil",
    "pupil_diameter and": "--pupil and",
    "the pupil's diameter instead": "--pupil as well",
}
"""Options by the library's parameter, for `options_named`, beside those of `PERSON`."""


def eye_of(person: EyeDescription, eye_file: Path | None, pupil_mm: float | None, vergence: float) -> Eye:
    """Return the eye of a file, or a person's with a pupil (mm; None: the natural one), focused at a vergence (D)."""
    from focalgradient.eye import read_eye

    if eye_file is not None:
        return read_eye(eye_file, vergence)
    with options_named(NAMED | {field.name: f"--{field.name}" for field in fields(person)}):
        return person.eye(vergence, None if pupil_mm is None else 1e-3 * pupil_mm)
