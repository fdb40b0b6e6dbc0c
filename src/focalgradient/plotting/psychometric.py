"""Figures of hierarchical psychometric functions: by participant, by condition, and thresholds with intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from focalgradient.plotting.figures import COLOURS, GREY, ORANGE, new_figure, people_grid, shortened, style
from focalgradient.plotting.subjects import SIMULATED
from focalgradient.plotting.thresholds import draw_interval, logarithmic
from focalgradient.statistics import SHAPES, Interval, PersonFunction, PsychometricGroups

__all__ = ["draw_condition", "draw_person_thresholds", "person_figure", "psychometric_figure"]

MOST_ROWS = 40
"""Maximum number of participant names on the axis; with more participants, every second, third, ... is named."""


def psychometric_figure(result: PsychometricGroups, *, simulated: bool = False) -> Figure:
    """Draw the functions of all participants (thin) and their mean (bold), and all thresholds with 95 % intervals."""
    with style():
        figure = new_figure(180, 95, layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.2, 1))
        for number, group in enumerate(result.groups):
            draw_condition(left, result, group.condition, COLOURS[number % len(COLOURS)])
        draw_person_thresholds(right, result)
        if len(result.groups) > 1:
            left.legend(loc="best", handlelength=1.2)
        if simulated:
            figure.suptitle(SIMULATED, fontsize=8, color=ORANGE, x=0.99, ha="right")
    return figure


def person_figure(result: PsychometricGroups, *, simulated: bool = False) -> Figure:
    """Draw one panel per participant: proportions (disc area by trials), fitted function, and threshold interval."""
    people = result.participants
    with style():
        figure, panels = people_grid(people)
        names = [group.condition for group in result.groups]
        for panel, person in zip(panels, people, strict=True):
            for one in result.people:
                if one.participant_id == person:
                    _draw_person(panel, result, one, COLOURS[names.index(one.condition) % len(COLOURS)])
        if len(names) > 1:
            figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=4, handlelength=1.0)
        figure.supxlabel(_level(result), fontsize=8)
        figure.supylabel(_share(result), fontsize=8)
        if simulated:
            figure.suptitle(SIMULATED, fontsize=8, color=ORANGE, x=0.99, ha="right")
    return figure


def draw_condition(ax: Axes, result: PsychometricGroups, condition: str, colour: str) -> Axes:
    """Draw the functions of one condition: participants thin, mean bold; discs are pooled proportions."""
    people = [one for one in result.people if one.condition == condition]
    group = next(one for one in result.groups if one.condition == condition)
    x = _grid(result)
    for one in people:
        ax.plot(x, one.correct(x), color=colour, linewidth=0.5, alpha=0.5)
    ax.plot(x, group.correct(x), color=colour, linewidth=2, label=condition or None)
    counted: dict[float, list[int]] = {}
    for one in people:
        for level, hits, trials in zip(one.levels, one.right, one.shown, strict=True):
            sums = counted.setdefault(level, [0, 0])
            sums[0], sums[1] = sums[0] + hits, sums[1] + trials
    right, shown = np.array(list(counted.values())).T
    ax.scatter(
        list(counted), right / shown, s=60 * shown / shown.max(), color=colour, alpha=0.3, linewidth=0, clip_on=False
    )
    ax.set(ylim=(-0.03, 1.03), xlabel=_level(result), ylabel=_share(result))
    ax.set_title("Psychometric functions")
    _scaled(ax, result, _levels(result))
    return ax


def _draw_person(ax: Axes, result: PsychometricGroups, one: PersonFunction, colour: str) -> None:
    x = _grid(result)
    shown = np.array(one.shown)
    ax.scatter(
        one.levels, np.array(one.right) / shown, s=2 + 2 * shown, color=colour, alpha=0.35, linewidth=0, clip_on=False
    )
    ax.plot(x, one.correct(x), color=colour, linewidth=1, label=one.condition or None)
    at = one.threshold
    if at.low is not None and at.high is not None:
        height = float(one.correct(at.estimate))
        draw_interval(ax, (at.low, at.high), height, (float(x[0]), float(x[-1])), colour=colour, width=2)
    ax.set_ylim(-0.03, 1.03)
    _scaled(ax, result, _grid(result))


def draw_person_thresholds(ax: Axes, result: PsychometricGroups) -> Axes:
    """Draw each participant's threshold with its 95 % interval, and the mean of each condition in bold."""
    people, names = result.participants, [group.condition for group in result.groups]
    values: list[float] = []
    limits = _limits(result)
    step = 0.6 / max(1, len(names))

    def interval(found: Interval, row: float, colour: str, marker: str, size: float, width: float) -> None:
        if found.low is not None and found.high is not None:
            draw_interval(ax, (found.low, found.high), row, limits, colour=colour, width=width)
            values.extend((found.low, found.high))
        if limits[0] <= found.estimate <= limits[1]:
            ax.plot(found.estimate, row, marker, color=colour, markersize=size)
        values.append(found.estimate)

    for one in result.people:
        place = names.index(one.condition)
        row = people.index(one.participant_id) + step * (place - (len(names) - 1) / 2)
        interval(one.threshold, row, COLOURS[place % len(COLOURS)], "o", 3, 0.8)
    for place, group in enumerate(result.groups):
        row = len(people) + step * (place - (len(names) - 1) / 2)
        interval(group.threshold, row, COLOURS[place % len(COLOURS)], "D", 5, 2.2)
    ax.axhline(len(people) - 0.5, color=GREY, linewidth=0.5)
    every = math.ceil(len(people) / MOST_ROWS)
    rows = [*range(0, len(people), every), len(people)]
    ax.set_yticks(rows, [*(shortened(people[row], 14) for row in rows[:-1]), "mean"])
    ax.set(ylim=(len(people) + 0.6, -0.6), xlabel=_level(result))
    ax.set_title("Thresholds, 95 % intervals")
    _scaled(ax, result, values)
    return ax


def _levels(result: PsychometricGroups) -> list[float]:
    return sorted({level for one in result.people for level in one.levels})


def _grid(result: PsychometricGroups) -> np.ndarray:
    levels = _levels(result)
    if SHAPES[result.shape].logarithmic:
        return np.geomspace(levels[0] / 1.2, levels[-1] * 1.2, 200)
    margin = 0.08 * (levels[-1] - levels[0])
    return np.linspace(levels[0] - margin, levels[-1] + margin, 200)


def _limits(result: PsychometricGroups) -> tuple[float, float]:
    """Return the limits beyond which intervals are cut: a factor of 2, or half of their range, beyond the levels."""
    levels = _levels(result)
    if SHAPES[result.shape].logarithmic:
        return levels[0] / 2, levels[-1] * 2
    return 1.5 * levels[0] - 0.5 * levels[-1], 1.5 * levels[-1] - 0.5 * levels[0]


def _scaled(ax: Axes, result: PsychometricGroups, values: Iterable[float]) -> None:
    """Use a logarithmic axis for logarithmic levels, with all `values` that lie within the limits."""
    if SHAPES[result.shape].logarithmic:
        logarithmic(ax, [*np.clip([*values], *_limits(result))])


def _level(result: PsychometricGroups) -> str:
    return f"level ({result.unit})" if result.unit else "level"


def _share(result: PsychometricGroups) -> str:
    return "proportion correct" if result.guess.low is None and result.guess.estimate > 0 else "proportion of responses"
