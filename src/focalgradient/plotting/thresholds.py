"""Figures of thresholds: each participant's psychometric function, and all thresholds with their intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from focalgradient.arrays import FloatArray
from focalgradient.plotting.figures import (
    COLOURS,
    GREY,
    MOST_NAMES,
    laid_out,
    log_ticks,
    people_grid,
    person_colours,
    shortened,
)
from focalgradient.statistics import Interval, SubjectThreshold, ThresholdFit, ThresholdResult

__all__ = ["draw_functions", "draw_interval", "draw_thresholds", "logarithmic", "person_figure", "threshold_figure"]


MOST_RANGE = 30
"""Ratio of levels above which a panel has no room for ticks at 1, 2 and 5 of each decade."""


MOST_DISCS = 10
"""Maximum number of proportions drawn of each participant. Chosen by hand."""


def threshold_figure(conditions: Mapping[str, ThresholdResult], *, simulated: bool, level: str | None = None) -> Figure:
    """Draw psychometric functions and thresholds of all participants; several conditions, by name, differ in colour.

    `level` is the label of the axis of levels; by default it follows from the unit.
    """
    with laid_out(180, 90, simulated=simulated) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.2, 1))
        for name, result in conditions.items():
            draw_functions(left, result, colour=_colour(conditions, name), label=name)
        draw_thresholds(right, conditions)
        if len(conditions) > 1:
            figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=4, handlelength=1.2)
            logarithmic(left, [value for result in conditions.values() for value in _levels(result)])
        if level is not None:
            for ax in (left, right):
                ax.set_xlabel(level)
    return figure


def person_figure(conditions: Mapping[str, ThresholdResult], *, simulated: bool, level: str | None = None) -> Figure:
    """Draw one panel per participant: shares of right answers, and the fitted function of each condition."""
    people = _names(conditions)
    with people_grid(people, simulated=simulated) as (figure, panels):
        for panel, person in zip(panels, people, strict=True):
            for name, result in conditions.items():
                subjects = tuple(subject for subject in result.subjects if _name(subject) == person)
                only = replace(result, subjects=subjects)
                draw_functions(panel, only, colour=_colour(conditions, name) or COLOURS[0], label=name)
            panel.set(xlabel="", ylabel="", title=shortened(person))
        levels = [value for result in conditions.values() for value in _levels(result)]
        logarithmic(panels[0], levels)
        if levels and max(levels) > MOST_RANGE * min(levels):
            log_ticks(panels[0].xaxis, (1, 3))
        if len(conditions) > 1:
            # Each panel has the conditions of its person.
            handles = {
                name: handle
                for panel in panels
                for handle, name in zip(*panel.get_legend_handles_labels(), strict=True)
            }
            shown = {name: handles[name] for name in conditions if name in handles}
            figure.legend(shown.values(), shown, loc="outside upper left", ncols=4, handlelength=1.0)
        figure.supxlabel(level or _axis(next(iter(conditions.values()))), fontsize=8)
        figure.supylabel("proportion correct", fontsize=8)
    return figure


def _colour(conditions: Mapping[str, ThresholdResult], name: str) -> str | None:
    """Return the colour of a condition; None for a single one, in which people differ in colour."""
    return COLOURS[[*conditions].index(name) % len(COLOURS)] if len(conditions) > 1 else None


def _name(subject: SubjectThreshold) -> str:
    return subject.name.removeprefix("sub-")


def _names(conditions: Mapping[str, ThresholdResult]) -> list[str]:
    return [*dict.fromkeys(_name(subject) for result in conditions.values() for subject, _ in _fitted(result))]


def _levels(result: ThresholdResult) -> list[float]:
    return [level for _, fit in _fitted(result) for level in fit.levels]


def _fitted(result: ThresholdResult) -> list[tuple[SubjectThreshold, ThresholdFit]]:
    return [(subject, subject.fit) for subject in result.subjects if isinstance(subject.fit, ThresholdFit)]


def _proportions(fit: ThresholdFit) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return levels, proportions correct and numbers of trials; of many levels, those of neighbouring ones together."""
    order = np.argsort(fit.levels)
    level, right, shown = (np.asarray(values, float)[order] for values in (fit.levels, fit.right, fit.shown))
    together = np.arange(len(level))
    if len(level) > MOST_DISCS:
        together = (MOST_DISCS * (np.cumsum(shown) - shown / 2) / shown.sum()).astype(int)
    sums = np.array([np.bincount(together, values) for values in (shown * np.log(level), right, shown)])
    logs, right, shown = sums[:, sums[2] > 0]
    return np.exp(logs / shown), right / shown, shown


def draw_functions(ax: Axes, result: ThresholdResult, *, colour: str | None = None, label: str = "") -> Axes:
    """Draw each participant's function (thin), and proportions correct as discs, larger for more trials.

    Participants differ in colour, unless one `colour` is given for all; `label` is their name in a legend.
    """
    fitted = _fitted(result)
    levels = _levels(result)
    if levels:
        x = np.geomspace(min(levels) / 1.2, max(levels) * 1.2, 200)
        colours = person_colours(len(fitted)) if colour is None else [colour] * len(fitted)
        for number, ((subject, fit), shade) in enumerate(zip(fitted, colours, strict=True)):
            places, share, shown = _proportions(fit)
            ax.scatter(places, share, s=3 * shown, color=shade, alpha=0.25, linewidth=0, clip_on=False)
            named = label if label and not number else None
            line = "-" if subject.kept else ":"
            ax.plot(x, fit.correct(x), color=shade, linewidth=0.8, linestyle=line, label=named)
    for height in {fit.correct_at_threshold for _, fit in fitted} or {0.75}:
        ax.axhline(height, color=GREY, linewidth=0.6, linestyle="--")
    ax.set(ylim=(-0.03, 1.03), xlabel=_axis(result), ylabel="proportion correct")
    ax.set_title("Psychometric functions")
    logarithmic(ax, levels)
    return ax


def draw_thresholds(ax: Axes, conditions: Mapping[str, ThresholdResult]) -> Axes:
    """Draw each threshold with its 95 % interval, the true value of simulated observers, and the means in bold."""
    names = _names(conditions)
    levels = [level for result in conditions.values() for level in _levels(result)]
    values: list[float] = []
    is_known = False
    for place, (name, result) in enumerate(conditions.items()):
        offset = 0.6 / len(conditions) * (place - (len(conditions) - 1) / 2)
        condition_colour = _colour(conditions, name)
        people = [condition_colour] * len(names) if condition_colour else person_colours(len(names))
        for subject, fit in _fitted(result):
            row, colour = names.index(_name(subject)) + offset, people[names.index(_name(subject))]
            ax.plot([fit.low, fit.high], [row, row], color=colour, linewidth=1, linestyle="-" if subject.kept else ":")
            face = colour if subject.kept else "white"
            ax.plot(fit.threshold, row, "o", color=colour, markersize=4, markerfacecolor=face)
            values += [fit.low, fit.high]
            if subject.known is not None:
                ax.plot(subject.known, row, "|", color="black", markersize=9, label=None if is_known else "true")
                values.append(subject.known)
                is_known = True
        mean = result.mean
        if isinstance(mean, Interval):
            row, colour = len(names) + offset, condition_colour or "black"
            if mean.low is not None and mean.high is not None:
                limits = min(levels) / 2, max(levels) * 2
                draw_interval(ax, (mean.low, mean.high), row, limits, colour=colour, width=2.5)
                values += np.clip([mean.low, mean.high], *limits).tolist()
            ax.plot(mean.estimate, row, "D", color=colour, markersize=5)
    every = math.ceil(len(names) / MOST_NAMES) if names else 1
    ax.set_yticks([*range(0, len(names), every), len(names)], [*(shortened(who, 20) for who in names[::every]), "mean"])
    ax.set(ylim=(len(names) + 0.6, -0.6), xlabel=_axis(next(iter(conditions.values()))))
    ax.set_title("Thresholds, 95 % intervals")
    logarithmic(ax, values)
    if is_known:
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
    log_ticks(ax.xaxis)
    if values:
        ax.set_xlim(min(values) / 1.25, max(values) * 1.25)
