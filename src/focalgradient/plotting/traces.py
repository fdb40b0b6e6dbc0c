"""Traces of adaptive procedures: the level of each trial, one panel per participant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from focalgradient.plotting.figures import log_ticks, people_grid, person_colours

__all__ = ["trace_figure"]

MOST_PANELS = 24
"""Maximum number of participants drawn."""


def trace_figure(
    table: pd.DataFrame, level: str, factor: str | None, units: Mapping[str, str], *, ratio: bool, simulated: bool
) -> Figure:
    """Draw the levels that a procedure set, trial by trial; wrong answers are open where the table has `correct`.

    Parameters
    ----------
    table
        One row per trial in chronological order, with `participant_id` and the column `level`.
    level
        Name of the column of levels.
    factor
        Column whose levels have procedures of their own, drawn in different colours; None: one procedure.
    units
        Unit of each column that has one.
    ratio
        Whether the levels are ratios, whose axis is logarithmic.
    simulated
        Whether the observers were simulated.
    """
    people = [*dict.fromkeys(table["participant_id"])]
    shown = people[:MOST_PANELS]
    groups: dict[str | None, pd.DataFrame] = {None: table}
    if factor is not None:
        groups = {_labelled(factor, name): trials for name, trials in table.groupby(factor, observed=True)}
    names = [str(person_id).removeprefix("sub-") for person_id in shown]
    with people_grid(names, simulated=simulated) as (figure, panels):
        for panel, person in zip(panels, shown, strict=True):
            for (label, trials), colour in zip(groups.items(), person_colours(len(groups)), strict=True):
                own = trials[trials["participant_id"] == person]
                places, levels = np.arange(1, len(own) + 1), own[level].to_numpy()
                wrong = ~own["correct"].astype(bool).to_numpy() if "correct" in own else np.zeros(len(own), bool)
                panel.plot(places, levels, "-o", color=colour, linewidth=0.8, markersize=2.5, label=label)
                panel.plot(places[wrong], levels[wrong], "o", color=colour, markersize=2.5, markerfacecolor="white")
            if ratio:
                panel.set_yscale("log")
                log_ticks(panel.yaxis)
        if factor is not None:
            figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=4, handlelength=1.0)
        most = "" if len(shown) == len(people) else f" ({len(shown)} of {len(people)} participants shown)"
        figure.supxlabel(f"trial of the procedure{most}", fontsize=8)
        figure.supylabel(f"{level} ({units[level]})" if units.get(level) else level, fontsize=8)
    return figure


def _labelled(factor: str, level: Any) -> str:
    return f"{factor} {level:g}" if isinstance(level, float) else f"{factor} {level}"
