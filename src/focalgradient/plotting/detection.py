"""Figure of signal detection: rates or ROC curves by condition, and d' of each participant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import special

from focalgradient.plotting.figures import COLOURS, GREY, MOST_NAMES, laid_out, shortened
from focalgradient.statistics.detection import DetectionGroup, RatingRoc

__all__ = ["detection_figure"]


def detection_figure(
    group: DetectionGroup, curves: Mapping[tuple[str, str], RatingRoc], *, simulated: bool = False
) -> Figure:
    """Draw hit and false-alarm rates of each participant (ROC with confidence ratings), and d' with 95 % intervals."""
    with laid_out(180, 90, simulated=simulated) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.1))
        for number, condition in enumerate(group.d_prime):
            colour = COLOURS[number % len(COLOURS)]
            _draw_rates(left, group, curves, condition, colour)
            _draw_sensitivity(right, group, condition, number, colour)
        left.plot([0, 1], [0, 1], color=GREY, linewidth=0.6)
        left.set(xlim=(0, 1), ylim=(0, 1), xlabel="False-alarm rate", ylabel="Hit rate", aspect="equal")
        left.set_title("ROC" if curves else "Rates")
        names = sorted({name for name, _ in group.people})
        few = len(names) <= MOST_NAMES
        right.set_yticks(
            *(range(len(names) + 1), [*map(shortened, names), "mean"]) if few else ([len(names)], ["mean"])
        )
        right.set(xlabel="d′", ylim=(len(names) + 0.8, -0.8))
        right.set_title("Sensitivity")
        if len(group.d_prime) > 1:
            left.legend(loc="lower right", handlelength=1.2)
    return figure


def _draw_rates(
    ax: Axes, group: DetectionGroup, curves: Mapping[tuple[str, str], RatingRoc], condition: str, colour: str
) -> None:
    """Draw each participant's curve or point, and the equal-variance curve for the mean d' (bold)."""
    for who, person in group.people.items():
        if who[1] != condition:
            continue
        if who in curves:
            alarms, hits = curves[who].false_alarm_rates, curves[who].hit_rates
            ax.plot([0, *alarms, 1], [0, *hits, 1], color=colour, linewidth=0.6, alpha=0.6)
        ax.scatter(person.false_alarm_rate, person.hit_rate, s=12, color=colour, alpha=0.6, linewidth=0)
    x = np.linspace(0.001, 0.999, 200)
    y = special.ndtr(special.ndtri(x) + group.d_prime[condition].estimate)
    ax.plot(x, y, color=colour, linewidth=2, label=condition or None)


def _draw_sensitivity(ax: Axes, group: DetectionGroup, condition: str, number: int, colour: str) -> None:
    names = sorted({name for name, _ in group.people})
    shift = 0.6 * (number + 0.5) / len(group.d_prime) - 0.3
    for (name, where), person in group.people.items():
        if where == condition:
            row, own = names.index(name) + shift, person.d_prime
            ax.errorbar(own.estimate, row, xerr=_reach(own), color=colour, fmt=".", lw=0.8)
    mean = group.d_prime[condition]
    ax.errorbar(mean.estimate, len(names) + shift, xerr=_reach(mean), color=colour, fmt="o", markersize=6)


def _reach(interval: object) -> list[list[float]] | None:
    low, high, middle = (getattr(interval, name) for name in ("low", "high", "estimate"))
    return None if low is None else [[middle - low], [high - middle]]
