"""Photometer calibration of a display: luminance of each gun and of grey by level, with fitted gamma curves.

The table is a CSV file with the columns level, red, green, blue and grey: levels from 0 to 255 (or 0 to 1), luminance
in cd/m2. Each curve is L = black + (white - black) v^gamma, where v is the level divided by the maximum level.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, located
from focalgradient.files import LARGEST_LIST, printable, read_bytes
from focalgradient.files.cells import name_and_unit
from focalgradient.files.tables import TextTable, parse_table

__all__ = [
    "ADDITIVE",
    "DEVIATION",
    "GUNS",
    "UNEQUAL",
    "Curve",
    "Luminance",
    "fit_luminance",
    "parse_luminance",
    "read_luminance",
]

GUNS = ("red", "green", "blue", "grey")

MIN_LEVELS = 5
"""Minimum number of levels to which the three parameters of a gamma curve are fitted."""

DEVIATION = 0.02
"""Maximum deviation of a measurement from its fitted curve, as a fraction of white: twice a photometer's repeatability
(1 %)."""

UNEQUAL = 0.1
"""Maximum difference between the guns' gammas: 0.1 changes the relative luminance of two colours by 3 % at half
luminance."""

ADDITIVE = 0.05
"""Maximum relative difference between the summed luminance of the guns and that of grey; above it the guns are not
independent."""

GAMMA_BOUNDS = (0.5, 4.0)
"""Lower and upper bound of the fitted gamma."""


UNITS = ("cd/m2", "cd/m^2", "cd/m²", "cd m-2", "nits", "nit", "cd", "8 bit", "0-255", "0-1")
"""Units that a heading may state."""

WHAT = "a table of luminances (level, red, green, blue, grey)"


@dataclass(frozen=True, slots=True)
class Curve:
    """Fitted gamma curve of one gun, or of grey.

    Parameters
    ----------
    gamma
        Exponent.
    black, white
        Luminance in cd/m2 at level 0 and at the maximum level.
    deviation
        Maximum absolute residual of the fit, as a fraction of white - black.
    """

    gamma: float
    black: float
    white: float
    deviation: float

    def at(self, shares: FloatArray) -> FloatArray:
        """Return the luminance in cd/m2 at levels given as fractions of the maximum level.

        >>> Curve(2.0, 0.0, 100.0, 0.0).at(np.array([0.0, 0.5, 1.0])).tolist()
        [0.0, 25.0, 100.0]
        """
        return np.asarray(self.black + (self.white - self.black) * shares**self.gamma, float)


@dataclass(frozen=True, slots=True, eq=False)
class Luminance:
    """A photometer's table with its fitted curves.

    Parameters
    ----------
    shares
        Levels as fractions of the maximum level, shape (N,).
    measured
        Luminance in cd/m2 by gun, shape (N,) each; NaN where not measured.
    curves
        Fitted curve of each measured gun.
    """

    shares: FloatArray
    measured: Mapping[str, FloatArray]
    curves: Mapping[str, Curve]

    @property
    def grey(self) -> Curve:
        """The fitted curve of grey."""
        return self.curves["grey"]

    @property
    def unequal(self) -> float:
        """Difference between the largest and the smallest gamma of the guns; 0 if fewer than two were measured."""
        gammas = [curve.gamma for gun, curve in self.curves.items() if gun != "grey"]
        return max(gammas) - min(gammas) if len(gammas) > 1 else 0.0

    @property
    def additivity(self) -> float | None:
        """Relative deviation of the guns' summed luminance from that of grey; None if one was not measured."""
        if len(self.curves) < len(GUNS):
            return None
        guns = sum(self.curves[gun].white - self.curves[gun].black for gun in GUNS if gun != "grey")
        return guns / (self.grey.white - self.grey.black) - 1


def read_luminance(path: str | os.PathLike[str]) -> Luminance:
    """Read a photometer's table and fit its curves.

    Raises
    ------
    InputError
        If the file cannot be read, lacks the columns level and grey, or has invalid cells (file and row are named).
    """
    return _fitted(parse_table(read_bytes(path, WHAT, LARGEST_LIST), printable(path), WHAT))


def parse_luminance(text: str, name: str) -> Luminance:
    r"""Parse a photometer's table, given as CSV, and fit its curves; messages call it `name`.

    Raises
    ------
    InputError
        As for `read_luminance`.

    Examples
    --------
    >>> rows = "".join(f"{level},{level / 2.55}\n" for level in range(0, 256, 51))
    >>> round(parse_luminance("level,grey\n" + rows, "table").grey.gamma, 3)
    1.0
    """
    return _fitted(parse_table(text.encode(), name, WHAT))


def _fitted(table: TextTable) -> Luminance:
    """Check a photometer's table and fit its curves."""
    name = table.name
    names, units = zip(*map(name_and_unit, table.header), strict=True) if table.header else ((), ())
    for line in table.comments:
        if foreign := re.search(r"\b(fl|ft-?l|foot-?lamberts?|lux|lx|mcd|normali[sz]ed|relative)\b", line.casefold()):
            raise InputError(
                f"{name} says {line[:60]!r}, but luminance must be in cd/m2: convert it, not {foreign[0]}."
            )
    names = tuple({"gray": "grey"}.get(found, found) for found in names)
    for column in ("level", "grey"):
        if column not in names:
            raise InputError(f"{name} has no column {column}: give the columns level, red, green, blue and grey.")
    for column, unit in zip(names, units, strict=True):
        if names.count(column) > 1 and column in ("level", *GUNS):
            raise InputError(f"{name} has the column {column} twice: remove one.")
        if unit and unit not in UNITS and column in ("level", *GUNS):
            raise InputError(f"{name}: {column} is in {unit}, but must be in cd/m2 (levels without unit): convert it.")
    used = [column for column in ("level", *GUNS) if column in names]
    points = table.with_points([names.index(column) for column in used])
    columns = {
        column: np.array(
            points.numbers(names.index(column), "a number of 0 or more", lowest=0, empty=column != "level")
        )
        for column in used
    }
    with located(name):
        return fit_luminance(columns.pop("level"), columns)


def fit_luminance(levels: FloatArray, measured: Mapping[str, FloatArray]) -> Luminance:
    """Fit a gamma curve to each measured gun.

    Parameters
    ----------
    levels
        Levels from 0 to 255, or from 0 to 1.
    measured
        Luminance in cd/m2 of "grey" and of any of "red", "green", "blue"; NaN where not measured.

    Raises
    ------
    InputError
        If the levels do not span that range or do not match the luminances in number, or a gun has fewer than five
        levels, lacks level 0 or the maximum, or is darker at the maximum than at 0.

    Examples
    --------
    >>> levels = np.arange(0, 256, 51.0)
    >>> found = fit_luminance(levels, {"grey": 0.2 + 99.8 * (levels / 255) ** 2.2})
    >>> round(found.grey.gamma, 4), round(found.grey.white, 3), round(found.grey.black, 3)
    (2.2, 100.0, 0.2)
    """
    greatest = 1.0 if levels.size and levels.max() <= 1 else 255.0
    if not (levels.size and levels.min() == 0 and levels.max() == greatest):
        raise InputError("levels must span 0 to 255, or 0 to 1, with both ends included: measure those, too.")
    shares = levels / greatest
    curves = {}
    for gun in GUNS:
        values = measured.get(gun, np.full(levels.shape, math.nan))
        if values.shape != levels.shape:
            raise InputError(
                f"{gun} has {values.size} luminances, but there are {levels.size} levels: give one for each."
            )
        there = np.isfinite(values)
        if there.any() or gun == "grey":
            curves[gun] = _curve(gun, shares[there], values[there])
    return Luminance(shares, dict(measured), curves)


def _curve(gun: str, shares: FloatArray, values: FloatArray) -> Curve:
    if len(np.unique(shares)) < MIN_LEVELS or shares.min() > 0 or shares.max() < 1:
        raise InputError(
            f"{gun} has {len(np.unique(shares))} levels, but must have {MIN_LEVELS} or more, level 0 and the "
            "maximum among them: measure more."
        )
    black, white = float(values[shares == 0].mean()), float(values[shares == 1].mean())
    if white <= black:
        raise InputError(f"{gun} is not brighter at the maximum level than at 0: check the columns.")
    from scipy.optimize import least_squares

    def off(found: FloatArray) -> FloatArray:
        return np.asarray((found[0] + (found[1] - found[0]) * shares ** found[2] - values) / (white - black))

    start = [black, white, 2.2]
    found = least_squares(
        off, start, bounds=([0, 0, GAMMA_BOUNDS[0]], [np.inf, np.inf, GAMMA_BOUNDS[1]]), x_scale=[white, white, 1]
    )
    return Curve(float(found.x[2]), float(found.x[0]), float(found.x[1]), float(np.abs(off(found.x)).max()))
