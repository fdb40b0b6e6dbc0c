"""User-defined factors: levels of pictures or participants in addition to aperture and fixation."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Annotated, Literal

from pydantic import Field, model_validator

from focalgradient.design.also import check_names
from focalgradient.tables import Table

__all__ = ["RESERVED", "Factor", "between", "check_factors", "crossed"]

LEVEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")

RESERVED = frozenset(
    {
        *("participant_id", "session", "simulated", "kind", "phase", "trial", "scene", "aperture", "aperture_mm"),
        *("fixation", "repetition", "catch", "break_before", "standard_before", "interval", "factors", "onset"),
        *("sitting_began", "mark_onset", "mask_onset", "question_onset"),
        *("rating", "response_time", "confidence", "dropped_frames", "stimulus", "sitting", "start", "answer", "event"),
    }
)
"""Names of existing columns of the tables."""


class Factor(Table):
    """Factor: its levels, and whether they vary within or between participants.

    Examples
    --------
    >>> Factor(levels=["dim", "bright"]).vary
    'within'
    """

    levels: Annotated[
        tuple[str, ...], Field(min_length=2, description="a list of two or more levels, as ['dim', 'bright']")
    ]
    vary: Literal["within", "between"] = "within"
    order: Literal["mixed", "blocked"] = "mixed"
    pictures: bool = True
    """Whether the levels are a column of the table of pictures; otherwise the pictures do not depend on them."""

    @model_validator(mode="after")
    def _check(self) -> Factor:
        for level in self.levels:
            if not LEVEL.fullmatch(level):
                raise ValueError(
                    f"levels names {level!r}, but a level must consist of letters (a to z, A to Z), digits and any of "
                    "_ . -: change it in the design and in the table of pictures."
                )
        if len(set(self.levels)) < len(self.levels):
            raise ValueError("levels names a level more than once: leave out the second.")
        if self.vary == "between" and self.order == "blocked":
            raise ValueError(
                "order is 'blocked', which requires a factor that varies within participants: leave it out."
            )
        return self


def check_factors(factors: Mapping[str, Factor]) -> None:
    """Raise `ValueError` for names that cannot be additional columns, and for more than one blocked factor."""
    check_names("factors", factors)
    for name in factors:
        if name in RESERVED:
            raise ValueError(f"factors names {name!r}, which is already a column of the tables: choose another name.")
    if sum(factor.order == "blocked" for factor in factors.values()) > 1:
        raise ValueError("factors has more than one 'blocked' factor: make the others 'mixed'.")


def crossed(factors: Mapping[str, Factor], names: Sequence[str]) -> list[dict[str, str]]:
    """List every combination of the levels of the named factors.

    >>> crossed({"light": Factor(levels=["dim", "bright"])}, ["light"])
    [{'light': 'dim'}, {'light': 'bright'}]
    """
    return [dict(zip(names, levels, strict=True)) for levels in product(*(factors[name].levels for name in names))]


def between(factors: Mapping[str, Factor], pair: int) -> dict[str, str]:
    """Return the levels of the between-participant factors for a pair of participants: all combinations in turn.

    >>> two = {"light": Factor(levels=["dim", "bright"], vary="between")}
    >>> [between(two, pair)["light"] for pair in (1, 2, 3)]
    ['dim', 'bright', 'dim']
    """
    combinations = crossed(factors, [name for name, factor in factors.items() if factor.vary == "between"])
    return combinations[(pair - 1) % len(combinations)]
