"""Range checks shared by the models of simulated subjects."""

from __future__ import annotations

from focalgradient.errors import InputError

__all__ = ["check_lapses", "check_spreads"]

MOST_SPREAD = 3.0
"""Maximum standard deviation of a natural logarithm: a factor of 20 between people, far above any published variation
of ratings or durations.
"""


def check_spreads(model: object, *names: str) -> None:
    """Raise `InputError` if a named field is not a plausible standard deviation of a natural logarithm.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> check_spreads(SimpleNamespace(between=0.3), "between")
    """
    for name in names:
        value = getattr(model, name)
        if not 0 <= value <= MOST_SPREAD:
            raise InputError(
                f"{name} is {value!r}, but must be a standard deviation of a logarithm, from 0 to {MOST_SPREAD:g}."
            )


def check_lapses(lapses: float) -> None:
    """Raise `InputError` for a lapse rate outside [0, 1).

    Examples
    --------
    >>> check_lapses(0.01)
    """
    if not 0 <= lapses < 1:
        raise InputError(f"lapses is {lapses!r}, but must be a proportion of at least 0 and below 1.")
