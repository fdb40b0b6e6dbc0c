"""Figure of difference scales: scale values of each participant with 95 % intervals, by stimulus."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure
from numpy import asarray, float64
from numpy.typing import ArrayLike, NDArray

from focalgradient.plotting.figures import BLUE, ORANGE, new_figure, style
from focalgradient.plotting.subjects import SIMULATED
from focalgradient.statistics import DifferenceScale

__all__ = ["difference_scale_figure"]


def difference_scale_figure(
    stimuli: ArrayLike, scales: Mapping[str, DifferenceScale], *, simulated: bool = False
) -> Figure:
    """Draw each participant's difference scale by stimulus magnitude."""
    at: NDArray[float64] = asarray(stimuli, float)
    with style():
        figure = new_figure(110, 80, layout="constrained")
        ax = figure.subplots()
        for scale in scales.values():
            spread = (scale.values - scale.low, scale.high - scale.values)
            ax.errorbar(at, scale.values, yerr=spread, fmt="o-", color=BLUE, markersize=3, linewidth=0.9, alpha=0.7)
        ax.set(xlabel="stimulus", ylabel="difference scale (SD of the judgement noise)")
        if simulated:
            figure.suptitle(SIMULATED, fontsize=8, color=ORANGE, x=0.99, ha="right")
    return figure
