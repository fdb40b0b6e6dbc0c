"""Figures of thresholds: each participant's psychometric function, and all thresholds with their intervals."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from focalgradient.plotting.figures import GREY, ORANGE, new_figure, person_colours, style
from focalgradient.plotting.subjects import SIMULATED
from focalgradient.statistics import Interval, SubjectThreshold, ThresholdFit, ThresholdResult

__all__ = ["draw_functions", "draw_interval", "draw_thresholds", "logarithmic", "threshold_figure"]

MOST_ROWS = 40
"""Maximum number of participant names on the axis; with more participants, every second, third, ... is named."""

STEPS = (1, 2, 5)
"""Ticks per decade of a logarithmic axis."""


def threshold_figure(result: ThresholdResult, *, simulated: bool) -> Figure:
    """Draw the psychometric functions and the thresholds of all participants."""
    with style():
        figure = new_figure(180, 90, layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.2, 1))
        draw_functions(left, result)
        draw_thresholds(right, result)
        if simulated:
            figure.suptitle(SIMULATED, fontsize=8, color=ORANGE, x=0.99, ha="right")
    return figure


def _fitted(result: ThresholdResult) -> list[tuple[SubjectThreshold, ThresholdFit]]:
    return [(one, one.fit) for one in result.subjects if isinstance(one.fit, ThresholdFit)]


def draw_functions(ax: Axes, result: ThresholdResult) -> Axes:
    """Draw each participant's function (thin), and proportions correct as discs, larger for more trials."""
    fitted = _fitted(result)
    levels = [level for _, fit in fitted for level in fit.levels]
    if levels:
        x = np.geomspace(min(levels) / 1.2, max(levels) * 1.2, 200)
        for (one, fit), colour in zip(fitted, person_colours(len(fitted)), strict=True):
            share = np.array(fit.right) / np.array(fit.shown)
            ax.scatter(fit.levels, share, s=3 * np.array(fit.shown), color=colour, alpha=0.25, linewidth=0)
            ax.plot(x, fit.correct(x), color=colour, linewidth=0.8, linestyle="-" if one.kept else ":")
    for height in {fit.correct_at_threshold for _, fit in fitted} or {0.75}:
        ax.axhline(height, color=GREY, linewidth=0.6, linestyle="--")
    ax.set(ylim=(-0.03, 1.03), xlabel=_axis(result), ylabel="proportion correct")
    ax.set_title("Psychometric functions")
    logarithmic(ax, levels)
    return ax


def draw_thresholds(ax: Axes, result: ThresholdResult) -> Axes:
    """Draw each threshold with its 95 % interval, the true value of simulated observers, and the mean in bold."""
    fitted = _fitted(result)
    values: list[float] = []
    for row, ((one, fit), colour) in enumerate(zip(fitted, person_colours(len(fitted)), strict=True)):
        ax.plot([fit.low, fit.high], [row, row], color=colour, linewidth=1, linestyle="-" if one.kept else ":")
        ax.plot(fit.threshold, row, "o", color=colour, markersize=4, markerfacecolor=colour if one.kept else "white")
        if one.known is not None:
            ax.plot(one.known, row, "|", color="black", markersize=9, label="true" if not row else None)
            values.append(one.known)
        values += [fit.low, fit.high]
    names = [f"{one.participant.removeprefix('sub-')} {one.session}".strip() for one, _ in fitted]
    every = math.ceil(len(fitted) / MOST_ROWS) if fitted else 1
    if isinstance(result.mean, Interval):
        low, high = result.mean.low, result.mean.high
        if low is not None and high is not None:
            ax.plot([low, high], [len(fitted)] * 2, color="black", linewidth=2.5)
            values += [low, high]
        ax.plot(result.mean.estimate, len(fitted), "D", color="black", markersize=5)
        names.append("mean")
    ax.set_yticks(range(0, len(names), every), names[::every])
    ax.set(ylim=(len(names) - 0.4, -0.6), xlabel=_axis(result))
    ax.set_title("Thresholds, 95 % intervals")
    logarithmic(ax, values)
    if any(one.known is not None for one, _ in fitted):
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), borderpad=0, handlelength=0.8)
    return ax


def draw_interval(
    ax: Axes, ends: tuple[float, float], height: float, limits: tuple[float, float], *, colour: str, width: float
) -> None:
    """Draw a horizontal interval, with an arrowhead at each end that is cut at the `limits` of the axis."""
    low, high = (min(max(end, limits[0]), limits[1]) for end in ends)
    ax.plot([low, high], [height, height], color=colour, linewidth=width)
    for end, shown, head in zip(ends, (low, high), "<>", strict=True):
        if shown != end:
            ax.plot(shown, height, head, color=colour, markersize=2 + 1.5 * width, clip_on=False)


def _axis(result: ThresholdResult) -> str:
    return "added defocus (D)" if result.unit == "D" else "added aperture (mm)"


def logarithmic(ax: Axes, values: list[float]) -> None:
    """Format a logarithmic axis with ticks at 1, 2 and 5 of each decade."""
    ax.set_xscale("log")
    if values:
        low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
        ticks = [step * 10.0**power for power in range(low, high + 1) for step in STEPS]
        ax.set_xlim(min(values) / 1.25, max(values) * 1.25)
        ax.xaxis.set_major_locator(FixedLocator(ticks))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, place: f"{value:g}"))
