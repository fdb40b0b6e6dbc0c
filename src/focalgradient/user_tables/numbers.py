"""Numbers in the user's own table, in the units that headings state."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import name_and_unit
from focalgradient.user_tables.names import clean, few, invalid
from focalgradient.user_tables.schema import UNITS

__all__ = ["check_magnitudes", "factor_of", "others"]

FOREIGN = ("log", "db", "decibel", "decibels", "in", "inch", "inches", "ft", "deg", "hz", "log10", "ln", "px")
"""Units that the heading of a column with units may not state."""


def factor_of(role: str, units: Mapping[str, float], header: str) -> float:
    """Return the factor from the unit that a heading states to the package's unit.

    >>> from focalgradient.user_tables.schema import LENGTHS, TIMES
    >>> factor_of("response_time", TIMES, "rt (ms)"), factor_of("aperture_mm", LENGTHS, "pupil_cm")
    (0.001, 10)
    """
    unit = name_and_unit(header)[1]
    first = re.split(r"[^a-z0-9]+", clean(header).casefold())[0]
    stated = unit if unit in FOREIGN else first if first in ("log", "log10", "ln", "db") else ""
    remedy = "convert the column and its heading"
    if not stated and unit in UNITS - {*units}:  # another quantity
        stated, remedy = unit, f'name another column with columns={{"{role}": "NAME"}}, or correct the heading'
    if units and stated:
        raise InputError(
            f"the heading {printable(header)!r} states the unit {stated}, but {role} must be in "
            f"{' or '.join(name for name in units if name)}: {remedy}."
        )
    return units.get(unit, 1)


DAYS = (30000, 60000)
"""Numbers of days from 1982 to 2064 in Excel, which stores 1.4 as 45383 where it takes it for 1 April."""


def check_magnitudes(table: pd.DataFrame, role: str) -> None:
    """Raise `InputError` if few values are a thousand times the others, as 1.050 read as 1,050, or 118 for 1.18."""
    values = table[role]
    days = values.between(*DAYS) & (values % 1 == 0)
    if days.any() and (rest := values[~days].dropna()).size and rest.abs().max() < DAYS[0] / 100:
        why = "a spreadsheet program may have made a date of it; enter the number again as text"
        raise invalid(table, role, days, f"but the others go from {rest.min():g} to {rest.max():g}: {why}")
    for scale in (1000, 100) if role == "rating" else (1000,):
        large = (values >= scale) & (values % 1 == 0) & ((scale == 1000) | (values % 100 != 0))
        rest = values[~large].dropna()
        if not large.any() or large.mean() > 0.3 or rest.empty or rest.max() >= scale / 50 or not (rest % 1).any():
            continue
        likely = values[large] / scale
        if likely.between(rest.min() / 2, rest.max() * 2).all():
            value = values[large].iloc[0]
            why = (
                f"a spreadsheet program may have taken {value / 1000:.3f} for {value:,.0f}"
                if scale == 1000
                else f"{likely.iloc[0]:.2f} may have lost its decimal mark"
            )
            expected = f"but the others go from {rest.min():g} to {rest.max():g}: {why}; correct it"
            raise invalid(table, role, large, expected)


def others(cells: pd.Series[str]) -> str:
    """Return a parenthetical list of further invalid cells, to follow a sentence on the first."""
    more = [repr(printable(cell)) for cell in cells.unique()[1:]]
    return f" (and so are {few(more)}, {len(cells):,} cells)" if more else ""
