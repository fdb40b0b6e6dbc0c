"""What the text of one cell says: a number, a date, or a heading with its unit."""

from __future__ import annotations

import re
from collections.abc import Iterable

__all__ = ["NUMBER", "SUFFIXES", "as_number", "codes_of", "is_date", "is_in_words", "name_and_unit"]

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?", re.IGNORECASE)
"""Number with a decimal point."""

_MONTHS = (
    "jan|feb|mar|mär|mrz|apr|may|mai|jun|jul|aug|sep|oct|okt|oct|nov|dec|dez|déc|fév|avr|juin|juil|août|ene|abr|ago|dic"
)
DATE = re.compile(
    rf"\d{{4}}-\d\d?-\d\d?(?:[ T].*)?|\d\d?([./-])\d\d?\1(?:\d{{4}}|\d\d)(?: .*)?|"
    rf"\d\d?[.\- ]{{1,2}}(?:{_MONTHS})[a-zé]*\.?(?:[\- ]\d+)?|(?:{_MONTHS})[a-zé]*[.\- ]{{1,2}}\d+",
    re.IGNORECASE,
)
"""Dates as spreadsheet programs and their CSV files write them."""

CODE = re.compile(
    r"-?9{2,}(?:[.]9+)?|-9|-?8{2,}|-?7{2,}|-?(?:32767|32768|65535|2147483647|2147483648|4294967295)|"
    r"-?(?:3[.]402823|9[.]96920|9[.]96921|1[.]797693)\d*e[+]?\d+",
    re.IGNORECASE,
)
"""Codes of missing values: 99, 999, -9, 88, 77, and the largest numbers of 16 and 32 bits and of floating point."""

MIN_CODE_RATIO = 7.5
"""Minimum ratio of a positive code to all other numbers: 999 among answers up to 100 is one, 99 among those up to 98 is
an answer.
"""

SIGNED_CODE_RATIO = 1.25
"""Magnitude above which a negative code marks a missing value among negative numbers, over the largest of them."""

UNIT = re.compile(r"\s*[(\[]\s*([^()\[\]]*?)\s*[)\]]\s*$")

SUFFIXES = (
    *("nm", "um", "µm", "mm", "cm", "km", "m", "in", "inch", "ft"),
    *("ms", "us", "µs", "s", "msec", "sec", "secs", "seconds", "milliseconds", "min"),
    *("d", "diopters", "dioptres", "diopter", "dioptre", "db", "deg", "arcmin", "arcsec"),
    *("px", "pixel", "pixels", "cpd", "waves", "percent", "pct"),
)
"""Units that end a name behind an underscore or a space."""


def as_number(cell: str) -> float | None:
    """Return a finite number written with a decimal point; None for anything else.

    >>> as_number(" 1.5e-2 "), as_number("1,5"), as_number("nan"), as_number("1e999"), as_number("1_0")
    (0.015, None, None, None, None)
    """
    text = cell.strip().replace("−", "-")
    value = float(text) if text.isascii() and NUMBER.fullmatch(text) else float("inf")
    return value if abs(value) < float("inf") else None


def codes_of(cells: Iterable[str], *, signed: bool = False) -> frozenset[str]:
    """Return the cells that mark missing values: codes far beyond all other numbers, or negative ones.

    Negative codes are numbers where `signed`, or where others are negative and these about as far from 0 (-8 and -9).

    >>> sorted(codes_of(["1.2", "0.9", "999", "-99.0", "65535"])), sorted(codes_of(["88", "99", "-99"], signed=True))
    (['-99.0', '65535', '999'], [])
    >>> sorted(codes_of(["0", "100", "999"])), sorted(codes_of(["12", "98", "99"]))
    (['999'], [])
    >>> sorted(codes_of(["1", "7", "77", "88"])), sorted(codes_of(["1", "10", "77", "99"]))
    (['77', '88'], ['77', '99'])
    >>> sorted(codes_of(["-3", "2", "-9"])), sorted(codes_of(["-8", "2", "-9"]))
    (['-9'], [])
    """
    values = {cell: value for cell in cells if (value := as_number(cell)) is not None}
    codes = {cell for cell in values if CODE.fullmatch(re.sub(r"[.]0+$", "", cell.strip()))}
    plain = [value for cell, value in values.items() if cell not in codes]
    most = max(map(abs, plain), default=float("inf"))
    least = most * SIGNED_CODE_RATIO if min(plain, default=0) < 0 else 0
    return frozenset(
        cell for cell in codes if (values[cell] < -least and not signed) or abs(values[cell]) > MIN_CODE_RATIO * most
    )


def is_date(cell: str) -> bool:
    """Return whether a cell is a date, as spreadsheet programs make of numbers like 5.6.

    >>> is_date("2026-06-05"), is_date("05. Jun"), is_date("5.6.2026"), is_date("5.6"), is_date("f/5.6")
    (True, True, True, False, False)
    """
    return bool(DATE.fullmatch(cell.strip()))


def is_in_words(cell: str) -> bool:
    """Return whether a cell is an answer in words, which may begin with its number.

    >>> [is_in_words(cell) for cell in ("very deep", "7 (very)", "7", "109 %", "05. Jun", '{"Q0": "a"}')]
    [True, True, False, False, False, False]
    """
    text = cell.strip()
    return bool(re.fullmatch(r"(?:\d+\W*)?[^\W\d_][^\d{}=]*", text)) and not is_date(text)


def name_and_unit(header: str) -> tuple[str, str]:
    """Split a heading into name and unit, both in lower case: the unit is in brackets or at the end.

    >>> name_and_unit("Level (dB)"), name_and_unit("rt_ms"), name_and_unit("distance [m]"), name_and_unit("rating")
    (('level', 'db'), ('rt', 'ms'), ('distance', 'm'), ('rating', ''))
    """
    text = " ".join(header.replace("μ", "µ").split()).casefold().replace("μ", "µ")
    match = UNIT.search(text)
    if match:
        return text[: match.start()].strip(), match[1]
    name, _, last = text.replace(" ", "_").replace(",", "_").rpartition("_")
    return (name.strip("_"), last) if name and last in SUFFIXES else (text, "")
