"""Figure of a Bayesian analysis: priors (dashed) and posteriors (solid)."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from focalgradient.plotting.figures import BLUE, GREEN, GREY, ORANGE, laid_out
from focalgradient.plotting.ratio_axis import ratio_ticks
from focalgradient.statistics.posteriors import BayesResult, Posterior

__all__ = ["draw_posterior_rises", "draw_posterior_spread", "posterior_figure"]

EFFECTS = {
    "nearest": (BLUE, "near in focus"),
    "farthest": (ORANGE, "far in focus"),
    "difference": (GREEN, "near / far"),
}
SD_LOOKS = {"subjects": (BLUE, "subjects"), "scenes": (ORANGE, "scenes"), "residual": (GREEN, "residual")}
DASHED = (0, (4, 3))


def posterior_figure(result: BayesResult, *, simulated: bool) -> Figure:
    """Draw priors and posteriors of the depth effects, with the bound shaded, and of the near effect's SDs."""
    with laid_out(180, 80, simulated=simulated) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
        draw_posterior_rises(left, result)
        draw_posterior_spread(right, result)
    return figure


def draw_posterior_rises(ax: Axes, result: BayesResult) -> Axes:
    """Draw the densities of the depth effects on a logarithmic ratio axis, with their prior and the bound."""
    posteriors = {name: posterior for name, posterior in result.posteriors.items() if isinstance(posterior, Posterior)}
    bound = math.log(result.bound)
    ends = [bound * 1.5, -bound * 1.5]
    for posterior in posteriors.values():
        ends += [float(np.quantile(posterior.draws, share)) for share in (0.001, 0.999)]
    at = np.linspace(min(ends), max(ends), 400)
    ax.axvspan(-bound, bound, color=GREY, alpha=0.12, linewidth=0)
    ax.axvline(0, color=GREY, linewidth=0.6, linestyle=DASHED)
    prior = result.priors["rise"]
    ax.plot(at, prior.density(at), color=GREY, linestyle=DASHED, linewidth=1.2, label=f"prior {prior}")
    for name, posterior in posteriors.items():
        colour, label = EFFECTS[name]
        density = stats.gaussian_kde(posterior.draws)(at)
        ax.fill_between(at, density, color=colour, alpha=0.15, linewidth=0)
        ax.plot(at, density, color=colour, label=label)
    ax.set_ylim(0, 1.3 * ax.get_ylim()[1])
    what, log = ("ratio to the pinhole", "log ratio") if result.analysis.ratios else ("odds ratio", "log odds ratio")
    ax.set(xlabel=f"depth effect at the largest aperture ({what})", ylabel=f"density (of the {log})", yticks=[])
    ticks = ratio_ticks(*np.exp([min(ends), max(ends)]).tolist())
    ax.set_xticks([math.log(tick) for tick in ticks], [f"{tick:g}" for tick in ticks])
    ax.set_xlim(at[0], at[-1])
    ax.legend(loc="upper right", fontsize=7, handlelength=1.6)
    return ax


def draw_posterior_spread(ax: Axes, result: BayesResult) -> Axes:
    """Draw the densities of the standard deviations of the first depth effect, with their priors."""
    first = next((posterior for posterior in result.posteriors.values() if isinstance(posterior, Posterior)), None)
    if first is None:
        return ax
    largest = 1.15 * max(float(np.quantile(draws, 0.995)) for draws in first.spread.values())
    at = np.linspace(0, largest, 300)
    for name, draws in first.spread.items():
        colour, label = SD_LOOKS[name]
        ax.plot(at, result.priors[name].density(at), color=colour, linestyle=DASHED, linewidth=0.9)
        law = stats.gaussian_kde(draws)
        ax.plot(at, law(at) + law(-at), color=colour, label=label)  # reflected at zero: no SD is negative
    ax.set_ylim(0, 1.25 * ax.get_ylim()[1])
    ax.set(xlim=(0, largest), yticks=[], xlabel="standard deviation (log odds)")
    if result.analysis.ratios:
        ax.set_xlabel("standard deviation (log ratio)")
    ax.set_title(f"SDs of the {EFFECTS[first.name][1].split()[0]} effect (dashed: priors)")
    ax.legend(loc="upper right", fontsize=7, handlelength=1.6)
    return ax
