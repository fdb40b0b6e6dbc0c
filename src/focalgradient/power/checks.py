"""Checks that the models of simulated subjects share."""

from __future__ import annotations

from focalgradient.errors import InputError

__all__ = ["check_lapses", "check_spreads"]

MOST_SPREAD = 3.0
"""Of a logarithm: a factor of 20 between people, far beyond any published spread of ratings or durations."""


def check_spreads(model: object, *names: str) -> None:
    """Raise InputError where one of the named fields is no standard deviation of a logarithm.

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
    """Raise InputError where the share of lapses is none.

    Examples
    --------
    >>> check_lapses(0.01)
    """
    if not 0 <= lapses < 1:
        raise InputError(f"lapses is {lapses!r}, but must be a share of 0 or more, below 1.")
