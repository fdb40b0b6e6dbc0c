"""What the form asks of a participant, in a window and in a browser alike."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

from focalgradient.errors import InputError

__all__ = ["ABOUT", "LONGEST_ABOUT", "OLDEST", "check_about"]

ABOUT = r"^[\w ./-]+$"
"""What an answer is made of: letters of any language, digits, spaces and . - /."""

LONGEST_ABOUT = 20
"""Greatest number of characters of an answer."""

OLDEST = 130.0
"""Greatest age in years: nobody has become 123 (Jeanne Calment, 122)."""


def check_about(about: Mapping[str, str], ask: Collection[str]) -> None:
    """Refuse what the form does not ask for, and an age that is none.

    Parameters
    ----------
    about
        What was answered, by question.
    ask
        The questions of the design.

    Raises
    ------
    InputError
        If a question is none of the design's, or "age" is not a number of years.

    Examples
    --------
    >>> check_about({"age": "34", "sex": "f"}, ["age", "sex"])
    """
    if strange := sorted(set(about) - set(ask)):
        raise InputError(f"about names {strange[0]!r}, which the design does not ask for: leave it out.")
    age = about.get("age", "")
    try:
        years = float(age or 0)
    except ValueError:
        years = math.nan
    if not 0 <= years <= OLDEST:
        raise InputError(
            f"age is {age!r}, but must be a number of years from 0 to {OLDEST:g}: correct it or leave it empty."
        )
