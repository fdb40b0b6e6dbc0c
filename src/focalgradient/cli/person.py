"""Options for an eye by prescription and age, or by a file, shared by commands, and the eye that they describe."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.generate import Made, options_named
from focalgradient.errors import FocalGradientWarning

if TYPE_CHECKING:
    from focalgradient.eye import Eye, EyeDescription

__all__ = ["PERSON", "Person", "eye_notes", "eye_of", "eye_state", "focus_words", "is_astigmatic"]

PERSON = Made("focalgradient.eye:EyeDescription")
"""Options that describe a person's eye."""

Person = Annotated[Any, PERSON]
"""A `focalgradient.eye.EyeDescription`."""

OUT_OF_REACH = 0.05
"""Difference in dioptres between the vergence looked at and that in focus above which the former is out of reach: the
least change of blur that people notice (Campbell & Westheimer 1958)."""

NAMED = {
    "typical aberrations": "--aberrations typical",
    "smaller pupil_diameter": "smaller --pupil",
    "pupil_diameter and": "--pupil and",
    "the pupil's diameter instead": "--pupil as well",
}
"""Options by the library's parameter, for `options_named`, beside those of `PERSON`."""


def eye_of(person: EyeDescription, eye_file: Path | None, pupil_mm: float | None, vergence: float) -> Eye:
    """Return the eye of a file, or a person's with a pupil (mm; None: the natural one), that looks at a vergence (D).

    Warns
    -----
    FocalGradientWarning
        If the person cannot focus there.
    """
    if eye_file is not None:
        return fg.eye.read_eye(eye_file, vergence)
    with options_named(NAMED | {field.name: f"--{field.name}" for field in fields(person)}):
        eye = person.eye(vergence, None if pupil_mm is None else 1e-3 * pupil_mm)
    if not eye_state(person, eye, vergence)["in_reach"]:
        source = click.get_current_context().get_parameter_source("accommodation")
        by_default = ", the default --accommodation" if source is click.core.ParameterSource.DEFAULT else ""
        warnings.warn(
            f"this eye cannot focus on {focus_words(vergence)}{by_default}: it is focused at "
            f"{_focused_words(eye_state(person, eye, vergence))}, as its refraction, correction and age allow.",
            FocalGradientWarning,
            stacklevel=2,
        )
    return eye


def eye_state(person: EyeDescription, eye: Eye, vergence: float) -> dict[str, Any]:
    """Return the state, for a summary, of an eye that looks at a vergence (D): what follows from its description."""
    focus = eye.focus_vergence
    return {
        "looking_at_D": vergence,
        "focus_D": focus,
        "focus_m": 1 / focus if focus > 0 else None,
        "meridians_D": eye.meridian_vergences,
        "in_reach": abs(focus - vergence) <= OUT_OF_REACH,
        "accommodation_D": person.response(vergence),
        "pupil_mm": 1e3 * eye.pupil_diameter,
    }


def eye_notes(states: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return a line for the terminal about each state of an eye (`eye_state`)."""
    return [
        f"Eye: looks at {focus_words(state['looking_at_D'])}, focused at {_focused_words(state)}, accommodates "
        f"by {state['accommodation_D']:.2f} D, pupil {state['pupil_mm']:.2f} mm"
        for state in states
    ]


def is_astigmatic(state: Mapping[str, Any]) -> bool:
    """Return whether an eye of this state (`eye_state`) has two foci."""
    low, high = state["meridians_D"]
    return bool(high - low > OUT_OF_REACH)


def _focused_words(state: Mapping[str, Any]) -> str:
    """Return the plane of focus of an eye's state, and those of its meridians if it is astigmatic."""
    low, high = state["meridians_D"]
    meridians = f" (its meridians at {low:.2f} and {high:.2f} D)" if is_astigmatic(state) else ""
    return f"{focus_words(state['focus_D'])}{meridians}"


def focus_words(vergence: float) -> str:
    """Return a plane of focus at a vergence (D) as its distance, or, behind the eye, as its vergence.

    >>> focus_words(2.0), focus_words(0.0), focus_words(-0.5)
    ('0.5 m', 'infinity', '-0.5 D (beyond infinity)')
    """
    if abs(vergence) < 1e-9:
        return "infinity"
    return f"{1 / vergence:.3g} m" if vergence > 0 else f"{vergence:.3g} D (beyond infinity)"
