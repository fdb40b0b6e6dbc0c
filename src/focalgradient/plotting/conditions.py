"""Figures of responses by one factor, for any task: each subject thin, the mean with its interval bold."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from focalgradient.plotting.figures import BLUE, draw_means, laid_out, round_ticks
from focalgradient.statistics import ConditionTest, Effect

__all__ = ["condition_figure", "draw_condition"]

COLUMNS = 3
"""Number of panels per row."""


def condition_figure(tests: Sequence[ConditionTest], *, units: Mapping[str, str], simulated: bool) -> Figure:
    """Draw the responses by the levels of one factor.

    Parameters
    ----------
    tests
        A test of the factor for each response.
    units
        Unit of each column that has one.
    simulated
        Whether the observers were simulated.
    """
    columns = min(len(tests), COLUMNS)
    rows = math.ceil(len(tests) / columns)
    with laid_out(30 + 60 * max(columns, 1), 70 * rows, simulated=simulated) as figure:
        axes = figure.subplots(rows, columns, squeeze=False).flat
        for ax, test in zip(axes, tests, strict=False):
            draw_condition(ax, test, units=units)
        for ax in list(axes)[len(tests) :]:
            ax.set_visible(False)
    return figure


def draw_condition(ax: Axes, test: ConditionTest, *, units: Mapping[str, str]) -> Axes:
    """Draw the points and means of a test by factor level: at numeric positions, or else equally spaced.

    Of a number that varies between subjects, the tested slope is drawn through the centroid instead of means.
    """
    points = pd.DataFrame() if test.points is None else test.points
    levels = [*points]
    numbers = len(levels) >= 3 and all(isinstance(level, int | float | np.number) for level in levels)
    places = [float(level) for level in levels] if numbers else [float(at) for at in range(len(levels))]
    if numbers:
        ax.xaxis.set_major_locator(round_ticks())
    back = np.exp if test.log else np.asarray
    geometric = ["geometric mean"] if test.log else []
    ax.set(xlabel=_named(test.factor, units), ylabel=_named(test.answer, units, *geometric))
    between = points.notna().sum(axis=1).max() == 1
    for heights in points.to_numpy(float):
        ax.plot(places, back(heights), "." if between else "-", color=BLUE, linewidth=0.5, alpha=0.5)
    if between and numbers:
        if isinstance(test.effect, Effect):
            subjects, at = np.nonzero(points.notna().to_numpy())
            x, heights = np.array(places), points.to_numpy(float)[subjects, at]
            line = heights.mean() + test.effect.estimate * (x - x[at].mean())
            ax.plot(places, back(line), color=BLUE, linewidth=2)
        return ax
    draw_means(ax, [*zip(places, test.means, strict=True)], BLUE, connected=not between)
    if not numbers:
        ax.set_xticks(places, [str(level) for level in levels])
        ax.set_xlim(-0.4, len(levels) - 0.6)
    return ax


def _named(column: str, units: Mapping[str, str], *more: str) -> str:
    """Return an axis label: column name with unit and further remarks.

    >>> _named("matched", {"matched": "D"}), _named("blur", {}), _named("seen", {"seen": "m"}, "geometric mean")
    ('matched (D)', 'blur', 'seen (m, geometric mean)')
    """
    about = [*filter(None, [units.get(column, "")]), *more]
    return f"{column} ({', '.join(about)})" if about else column
