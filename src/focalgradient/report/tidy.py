"""All numbers of a report as one tidy table, one row per estimate."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd

from focalgradient.report.tables import Sheet

__all__ = ["tidy_results"]

PARTS = (
    *("estimate", "low", "high", "standard_error", "statistic", "df", "p", "p_holm", "dz", "dz_low", "dz_high"),
    *("subjects", "method", "reason"),
)
"""Columns that belong to one estimate."""

CONDITIONS = ("aperture_mm", "strength")
"""Numeric columns that name a condition."""

TRACE = ("_design.csv", "versions.csv", "data_set.csv", "files.csv", "_draws.csv")
"""Suffixes of the tables without results."""


def tidy_results(sheets: Iterable[Sheet]) -> pd.DataFrame:
    """Return every number of the tables of a report, one row each.

    Parameters
    ----------
    sheets
        Tables of the report.

    Returns
    -------
    DataFrame
        Columns: `table`, the name of the source file without extension; identifying columns such as `fixation`, empty
        if not applicable; `measure`; then `estimate` with its interval, error and test, empty if not available, and the
        `reason` if not computed.

    Examples
    --------
    >>> digits = pd.DataFrame([{"fixation": "nearest", "rise.estimate": 0.2, "rise.p": 0.03, "scenes": 12}])
    >>> tidy_results([Sheet("a.csv", None, digits)])[["table", "fixation", "measure", "estimate", "p"]].values.tolist()
    [['a', 'nearest', 'rise', 0.2, 0.03], ['a', 'nearest', 'scenes', 12.0, nan]]
    """
    rows = [row for sheet in sheets if not sheet.file.endswith(TRACE) for row in _rows(sheet)]
    names = dict.fromkeys(name for row in rows for name in row if name not in (*PARTS, "measure", "table"))
    return pd.DataFrame(rows, columns=["table", *names, "measure", *PARTS])


def _rows(sheet: Sheet) -> Iterable[dict[str, object]]:
    digits = sheet.digits
    columns = [str(name) for name in digits]
    prefixes = [name.removesuffix("estimate") for name in columns if name == "estimate" or name.endswith(".estimate")]
    parts = {f"{prefix}{part}": (prefix, part) for prefix in prefixes for part in PARTS}
    numbers = {name for name in columns if digits[name].dtype.kind in "iuf" and name not in CONDITIONS}
    named = [name for name in columns if name not in parts and name not in numbers and digits[name].notna().any()]
    labels = [name for name in named if digits[name].map(_plain).all()]
    single = [name for name in columns if name in numbers and name not in parts]
    for record in digits.to_dict("records"):
        label = {"table": sheet.file.removesuffix(".csv")} | {name: record[name] for name in labels}
        for prefix in prefixes:
            found = {part: record[full] for full, (own, part) in parts.items() if own == prefix and full in record}
            yield label | {"measure": prefix.removesuffix(".") or "effect"} | found
        for name in single:
            yield label | {"measure": name, "estimate": float(record[name])}


def _plain(value: object) -> bool:
    """Return whether a cell is text, a number, a truth value or empty."""
    return value is None or isinstance(value, str | int | float | bool)
