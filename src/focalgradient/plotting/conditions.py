"""Figures of responses by one factor, for any task: each subject thin, the mean with its interval bold."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from focalgradient.plotting.figures import BLUE, draw_means, laid_out
from focalgradient.statistics.means import t_interval

__all__ = ["condition_figure", "draw_condition"]

COLUMNS = 3
"""Number of panels per row."""


def condition_figure(
    table: pd.DataFrame, factor: str, answers: Sequence[tuple[str, bool]], *, units: Mapping[str, str], simulated: bool
) -> Figure:
    """Draw the responses by the levels of one factor.

    Parameters
    ----------
    table
        One row per trial, with `participant_id`, the factor and the responses; without catch trials.
    factor
        Name of the factor's column.
    answers
        Names of the response columns, each with whether it is a ratio, for which geometric means are used.
    units
        Unit of each column that has one.
    simulated
        Whether the observers were simulated.
    """
    columns = min(len(answers), COLUMNS)
    rows = math.ceil(len(answers) / columns)
    with laid_out(30 + 60 * max(columns, 1), 70 * rows, simulated=simulated) as figure:
        axes = figure.subplots(rows, columns, squeeze=False).flat
        for ax, (answer, ratio) in zip(axes, answers, strict=False):
            draw_condition(ax, table, factor, answer, ratio=ratio, units=units)
        for ax in list(axes)[len(answers) :]:
            ax.set_visible(False)
    return figure


def draw_condition(
    ax: Axes, table: pd.DataFrame, factor: str, answer: str, *, ratio: bool, units: Mapping[str, str]
) -> Axes:
    """Draw the means of one response by factor level: at numeric positions, or else equally spaced."""
    values = table[answer].astype(float)
    logs = pd.Series(np.log(values), values.index) if ratio else values
    own = logs.groupby([table["participant_id"], table[factor]]).mean().unstack(factor)
    levels = list(own.columns)
    numbers = len(levels) >= 3 and all(isinstance(one, int | float | np.number) for one in levels)
    places = [float(level) for level in levels] if numbers else [float(at) for at in range(len(levels))]
    back = np.exp if ratio else np.asarray
    ax.set(xlabel=_named(factor, units), ylabel=_named(answer, units, *(["geometric mean"] if ratio else [])))
    between = own.notna().sum(axis=1).max() == 1
    for heights in own.to_numpy(float):
        ax.plot(places, back(heights), "." if between else "-", color=BLUE, linewidth=0.5, alpha=0.5)
    if between and numbers:
        subjects, at = np.nonzero(own.notna().to_numpy())
        line = np.polyfit(np.array(places)[at], own.to_numpy(float)[subjects, at], 1)
        ax.plot(places, back(np.polyval(line, places)), color=BLUE, linewidth=2)
        return ax
    means = [t_interval(own[level].dropna()) for level in levels]
    draw_means(ax, [*zip(places, [mean.ratio if ratio else mean for mean in means], strict=True)], BLUE)
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
