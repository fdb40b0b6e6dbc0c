"""Questions of the form about the participant, for window and browser."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

from focalgradient.errors import InputError

__all__ = ["ABOUT", "GIVEN", "LONGEST_ABOUT", "OLDEST", "USUAL", "check_about"]

USUAL = ("age", "sex", "handedness")
"""Questions that a design asks by default; skipped if the command line gives the participant's label."""

GIVEN = (*USUAL, "eye")
"""Participant data that the command line accepts."""

ABOUT = r"^[\w ./-]+$"
"""Pattern of valid answers: letters of any language, digits, spaces and . - /."""

LONGEST_ABOUT = 20
"""Maximum number of characters of an answer."""

AGE = re.compile(r"[0-9]{1,3}(\.[0-9]{1,3})?")

OLDEST = 130.0
"""Maximum age in years: the highest verified is 122 (Jeanne Calment)."""


def check_about(about: Mapping[str, str], ask: Collection[str]) -> None:
    """Raise `InputError` for questions that the design does not ask, and for an invalid age.

    Parameters
    ----------
    about
        Answers by question.
    ask
        Questions of the design.

    Raises
    ------
    InputError
        If a question is not one of the design's, or "age" is not a number of years.

    Examples
    --------
    >>> check_about({"age": "34", "sex": "f"}, ["age", "sex"])
    """
    if strange := sorted(set(about) - set(ask)):
        raise InputError(f"about names {strange[0]!r}, which the design does not ask for: leave it out.")
    age = about.get("age", "")
    if age and not (AGE.fullmatch(age) and float(age) <= OLDEST):
        raise InputError(
            f"age is {age!r}, but must be a number of years from 0 to {OLDEST:g}: correct it or leave it empty."
        )
