"""Figures for checking test assumptions: normal Q-Q plots of subjects' effects, and residuals."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from focalgradient.arrays import FloatArray
from focalgradient.plotting.figures import GREY, REFERENCE, laid_out
from focalgradient.plotting.subjects import fixation_looks
from focalgradient.statistics.residuals import Residuals

__all__ = ["draw_quantiles", "draw_residuals", "residual_figure"]

DRAWS = 2000
"""Number of normal samples that determine the 95 % band at each rank, whose limits are then accurate to 5 % of an
SD."""


def residual_figure(fixations: Sequence[Residuals], *, simulated: bool) -> Figure:
    """Draw, in one row per fixation, Q-Q plots of the subjects and of the residuals, and residuals by fitted value."""
    rows = len(fixations)
    columns = 3 if any(residuals.residual.size for residuals in fixations) else 1
    with laid_out(62 * columns + 8, 56 * rows + 6, simulated=simulated) as figure:
        axes = figure.subplots(rows, columns, squeeze=False)
        looks = fixation_looks(residuals.fixation for residuals in fixations)
        for line, residuals in zip(axes, fixations, strict=True):
            colour, _, label = looks[residuals.fixation]
            name = label.replace("\n", " ")
            draw_quantiles(line[0], residuals.subjects, colour).set_title(f"Subjects, {name}")
            line[0].set_ylabel(textwrap.fill(residuals.what, 26))
            if columns > 1 and residuals.residual.size:
                draw_quantiles(line[1], residuals.residual, colour).set_title("Residuals by subject and scene")
                draw_residuals(line[2], residuals, colour).set_title("Residuals by fitted value")
    return figure


def draw_quantiles(ax: Axes, values: FloatArray, colour: str) -> Axes:
    """Draw a normal Q-Q plot with its line and the band that contains 95 % of normal samples of that size."""
    count = len(values)
    at = stats.norm.ppf((np.arange(1, count + 1) - 0.375) / (count + 0.25))  # Blom's plotting positions
    ordered = np.sort(values)
    spread = float(ordered.std(ddof=1)) if count > 1 else 0.0
    if count > 2 and spread > 0:
        samples = np.sort(np.random.default_rng(1).normal(size=(DRAWS, count)), axis=1)
        samples = (samples - samples.mean(axis=1, keepdims=True)) / samples.std(axis=1, ddof=1, keepdims=True)
        low, high = (ordered.mean() + spread * end for end in np.quantile(samples, [0.025, 0.975], axis=0))
        ax.fill_between(at, low, high, color=GREY, alpha=0.18, linewidth=0)
        ax.plot(at, ordered.mean() + spread * at, color=GREY, linewidth=0.8)
    ax.plot(at, ordered, "o", color=colour, markersize=3.5 if count < 60 else 2)
    ax.set_xlabel("normal quantile")
    ax.locator_params(axis="x", nbins=4)
    return ax


def draw_residuals(ax: Axes, residuals: Residuals, colour: str) -> Axes:
    """Draw the residual of each subject and scene by fitted value."""
    ax.axhline(0, **REFERENCE)
    ax.plot(residuals.fitted, residuals.residual, "o", color=colour, markersize=2.5, alpha=0.7)
    ax.set(xlabel="fitted value", ylabel="residual")
    ax.locator_params(axis="x", nbins=4)
    return ax
