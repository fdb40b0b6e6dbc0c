"""A photometer's table: luminance of each gun and of grey by level, and the curves that fit it.

The table is a CSV file with the columns level, red, green, blue and grey: levels from 0 to 255 (or as shares, 0 to 1),
luminance in cd/m2. Each curve is L = black + (white - black) v^gamma, v being the share of the greatest level.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.files import LARGEST_LIST, read_text

__all__ = ["ADDITIVE", "DEVIATION", "GUNS", "UNEQUAL", "Curve", "Luminance", "fit_luminance", "read_luminance"]

GUNS = ("red", "green", "blue", "grey")

LEAST_LEVELS = 5
"""That a curve of three numbers is fitted to."""

DEVIATION = 0.02
"""Share of the white by which a measurement may lie off its curve: twice what a photometer repeats to (1 %)."""

UNEQUAL = 0.1
"""By which the guns' gammas may differ: at half luminance a tenth is 3 % of light in one colour against another."""

ADDITIVE = 0.05
"""Share by which the guns together may differ from grey: above it they are no three independent guns."""

BOUNDS = (0.5, 4.0)
"""Of gamma, while it is fitted."""


@dataclass(frozen=True, slots=True)
class Curve:
    """The curve of one gun, or of grey.

    Parameters
    ----------
    gamma
        Its exponent.
    black, white
        Luminance at level 0 and at the greatest, cd/m2.
    deviation
        Largest distance of a measurement from the curve, as a share of white - black.
    """

    gamma: float
    black: float
    white: float
    deviation: float

    def at(self, shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Luminance in cd/m2 at shares of the greatest level.

        >>> Curve(2.0, 0.0, 100.0, 0.0).at(np.array([0.0, 0.5, 1.0])).tolist()
        [0.0, 25.0, 100.0]
        """
        return np.asarray(self.black + (self.white - self.black) * shares**self.gamma, float)


@dataclass(frozen=True, slots=True, eq=False)
class Luminance:
    """A table with its curves.

    Parameters
    ----------
    shares
        Levels as shares of the greatest, N.
    measured
        Luminance in cd/m2 by gun, N each; NaN where none was measured.
    curves
        The curve of each gun that was measured.
    """

    shares: NDArray[np.float64]
    measured: Mapping[str, NDArray[np.float64]]
    curves: Mapping[str, Curve]

    @property
    def grey(self) -> Curve:
        """The curve of grey."""
        return self.curves["grey"]

    @property
    def unequal(self) -> float:
        """By how much the gammas of the guns differ, the greatest less the least; 0 where fewer than two are known."""
        gammas = [curve.gamma for gun, curve in self.curves.items() if gun != "grey"]
        return max(gammas) - min(gammas) if len(gammas) > 1 else 0.0

    @property
    def additivity(self) -> float | None:
        """Red, green and blue together over grey at the greatest level, less 1; None where one was not measured."""
        if len(self.curves) < len(GUNS):
            return None
        guns = sum(self.curves[gun].white - self.curves[gun].black for gun in GUNS if gun != "grey")
        return guns / (self.grey.white - self.grey.black) - 1


def read_luminance(path: str | os.PathLike[str]) -> Luminance:
    """Read a photometer's table, and fit its curves.

    Raises
    ------
    InputError
        If it cannot be read, lacks the columns level and grey, or has cells that are no luminance: file and row named.
    """
    text = read_text(path, "a table of luminances", LARGEST_LIST)
    try:
        rows = list(csv.DictReader(io.StringIO(text), strict=True))
    except csv.Error as error:
        raise InputError(
            f"{path} is no CSV file ({error}): give a table with level, red, green, blue, grey."
        ) from error
    names = {name.strip().lower(): name for name in (rows[0] if rows else {}) if isinstance(name, str)}
    for name in ("level", "grey"):
        if name not in names:
            raise InputError(f"{path} has no column {name}: give the columns level, red, green, blue and grey.")
    columns: dict[str, list[float]] = {name: [] for name in ("level", *GUNS)}
    for number, row in enumerate(rows, start=2):
        for name, values in columns.items():
            cell = (row.get(names[name]) or "").strip() if name in names else ""
            if not cell and name != "level":
                values.append(math.nan)
                continue
            try:
                value = float(cell)
            except ValueError:
                value = math.nan
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"{path}, row {number}: {name} is {cell!r}, but must be a number of 0 or more.")
            values.append(value)
    try:
        return fit_luminance(np.array(columns["level"]), {gun: np.array(columns[gun]) for gun in GUNS})
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def fit_luminance(levels: NDArray[np.float64], measured: Mapping[str, NDArray[np.float64]]) -> Luminance:
    """Fit the curve of each gun.

    Parameters
    ----------
    levels
        From 0 to 255; or to 1, where none is greater.
    measured
        Luminance in cd/m2 of "grey" and of any of "red", "green", "blue"; NaN where there is none.

    Raises
    ------
    InputError
        If levels are off that range or do not pair with luminances, or a gun has fewer than five, not 0 and the
        greatest among them, or gets darker.

    Examples
    --------
    >>> levels = np.arange(0, 256, 51.0)
    >>> found = fit_luminance(levels, {"grey": 0.2 + 99.8 * (levels / 255) ** 2.2})
    >>> round(found.grey.gamma, 4), round(found.grey.white, 3), round(found.grey.black, 3)
    (2.2, 100.0, 0.2)
    """
    greatest = 1.0 if levels.size and levels.max() <= 1 else 255.0
    if not (levels.size and levels.min() == 0 and levels.max() == greatest):
        raise InputError("levels must go from 0 to 255, or from 0 to 1, and hold both ends: measure those, too.")
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


def _curve(gun: str, shares: NDArray[np.float64], values: NDArray[np.float64]) -> Curve:
    if len(np.unique(shares)) < LEAST_LEVELS or shares.min() > 0 or shares.max() < 1:
        raise InputError(
            f"{gun} has {len(np.unique(shares))} levels, but must have {LEAST_LEVELS} or more, the least and the "
            "greatest among them: measure more."
        )
    black, white = float(values[shares == 0].mean()), float(values[shares == 1].mean())
    if white <= black:
        raise InputError(f"{gun} is no brighter at the greatest level than at 0: see that the columns are right.")
    from scipy.optimize import least_squares

    def off(found: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((found[0] + (found[1] - found[0]) * shares ** found[2] - values) / (white - black))

    start = [black, white, 2.2]
    found = least_squares(
        off, start, bounds=([0, 0, BOUNDS[0]], [np.inf, np.inf, BOUNDS[1]]), x_scale=[white, white, 1]
    )
    return Curve(float(found.x[2]), float(found.x[0]), float(found.x[1]), float(np.abs(off(found.x)).max()))
