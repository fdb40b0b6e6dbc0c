"""Numbers in the user's own table, in the units that headings state."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number, is_date, name_and_unit
from focalgradient.statistics.own_names import ABSENT, clean, few, place

if TYPE_CHECKING:
    from focalgradient.statistics.own_tables import Source

__all__ = ["LENGTHS", "factor_of", "numbers", "others"]

LENGTHS = {"mm": 1, "cm": 10, "m": 1000, "um": 0.001, "µm": 0.001}
"""Factor to millimetres of each unit of length."""

TIMES = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"), 0.001),
    **dict.fromkeys(("us", "µs"), 1e-6),
    "min": 60,
}
UNITS: dict[str, Mapping[str, float]] = {
    "aperture_mm": LENGTHS,
    "strength": LENGTHS,
    **dict.fromkeys(("response_time", "duration", "onset", "end", "trial_duration"), TIMES),
    "rating": {"": 1, "%": 0.01, "percent": 0.01, "ratio": 1, "x": 1},
}
"""Units that headings of numbers may state, by role, with the factor to the package's unit."""

FOREIGN = ("log", "db", "decibel", "decibels", "in", "inch", "inches", "ft", "deg", "hz", "log10", "ln", "px")
"""Units that a heading of a role in `UNITS` may not state."""


def factor_of(role: str, header: str) -> float:
    """Return the factor from the unit that a heading states to the package's unit.

    >>> factor_of("response_time", "rt (ms)"), factor_of("aperture_mm", "pupil_cm"), factor_of("rating", "answer")
    (0.001, 10, 1)
    """
    known, (_, unit) = UNITS.get(role, {}), name_and_unit(header)
    first = re.split(r"[^a-z0-9]+", clean(header).casefold())[0]
    stated = unit if unit in FOREIGN else first if first in ("log", "log10", "ln", "db") else ""
    if known and (stated or (unit and unit not in known and any(unit in units for units in UNITS.values()))):
        raise InputError(
            f"the heading {printable(header)!r} states the unit {stated or unit}, but {role} must be in "
            f"{' or '.join(name for name in known if name)}: convert the column and its heading."
        )
    return known.get(unit, 1)


def numbers(
    table: pd.DataFrame, role: str, texts: pd.Series[str], *, empty: bool = False, own: Source | None = None
) -> pd.Series[float]:
    """Parse finite numbers with a decimal point; empty cells become NaN if `empty` is True, else an error."""
    absent = texts.str.strip().str.lower().isin(ABSENT)
    parsed = {cell: as_number(cell) for cell in texts.unique()}
    values = texts.map(parsed).astype(float)
    wrong = values.isna()
    if empty:
        wrong &= ~absent
    if wrong.any():
        text = texts[wrong].iloc[0]
        damaged = (
            ": it is a date, which a spreadsheet program may have made of a number: enter the number again as text"
            if is_date(text)
            else ": save the data as JSON, whose parts are read as columns"
            if text.startswith("{")
            else ", as the file holds a formula without its value: open and save it with a spreadsheet program"
            if text.startswith("=")
            else others(texts[wrong])
        )
        if role in ("rating", "confidence") and not texts[~absent].str.contains(r"\d").any():
            damaged += ': state the order of answers in words, from the least, with order=["WORD,WORD,..."]'
        where = "" if own is None else own.apart(table.index, wrong, ": choose the other rows with {}")
        raise InputError(
            f"{place(table, wrong)}: {role} is {printable(text)!r}, but must be a number, like 1.4{damaged}{where}."
        )
    if own is not None:
        header = own.columns.get(role, "")
        is_jspsych = header == "rt" and {"trial_type", "time_elapsed"} <= {*own.cells}
        factor = TIMES["ms"] if is_jspsych else factor_of(role, header)
        if factor != 1:
            states = "jsPsych writes" if is_jspsych else "it states"
            own.notices.append(f"The column {header} was multiplied by {factor:g}, for the unit that {states}.")
            values = values * factor
        _check_thousands(table, role, values)
    return values


DAYS = (30000, 60000)
"""Numbers of days from 1982 to 2064 in Excel, which stores 1.4 as 45383 where it takes it for 1 April."""


def _check_thousands(table: pd.DataFrame, role: str, values: pd.Series[float]) -> None:
    """Raise `InputError` if few values are a thousand times the others, as 1.050 read as 1,050, or 118 for 1.18."""
    days = values.between(*DAYS) & (values % 1 == 0)
    if days.any() and (rest := values[~days].dropna()).size and rest.abs().max() < DAYS[0] / 100:
        raise InputError(
            f"{place(table, days)}: {role} is {values[days].iloc[0]:g}, but the others go from {rest.min():g} to "
            f"{rest.max():g}: a spreadsheet program may have made a date of it; enter the number again as text."
        )
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
            raise InputError(
                f"{place(table, large)}: {role} is {value:g}, but the others go from {rest.min():g} to {rest.max():g}: "
                f"{why}; correct it."
            )


def others(cells: pd.Series[str]) -> str:
    """Return a parenthetical list of further invalid cells, to follow a sentence on the first."""
    more = [repr(printable(one)) for one in cells.unique()[1:]]
    return f" (and so are {few(more)}, {len(cells):,} cells)" if more else ""
