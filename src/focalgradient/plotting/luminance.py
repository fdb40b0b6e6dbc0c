"""A photometer's measurements with the curves that fit them."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from focalgradient.luminance import DEVIATION, Luminance
from focalgradient.plotting.figures import GREY, new_figure, style

__all__ = ["luminance_figure"]

COLOURS = {"red": "#C8102E", "green": "#007A33", "blue": "#0050B5", "grey": "#444444"}


def luminance_figure(found: Luminance) -> Figure:
    """Luminance by level of each gun with its curve, and what is left, with the limit."""
    with style():
        figure = new_figure(180, 80, layout="constrained")
        left, right = figure.subplots(1, 2)
        fine = np.linspace(0, 1, 200)
        for gun, curve in found.curves.items():
            values, colour = found.measured[gun], COLOURS[gun]
            left.plot(found.shares, values, "o", color=colour, markersize=3.5)
            left.plot(fine, curve.at(fine), color=colour, linewidth=1, label=f"{gun}: γ = {curve.gamma:.2f}")
            rest = 100 * (values - curve.at(found.shares)) / (curve.white - curve.black)
            right.plot(found.shares, rest, "o-", color=colour, markersize=3.5, linewidth=0.8)
        left.set(xlabel="level, as a share of the greatest", ylabel="luminance (cd/m²)")
        left.set_title(f"White {found.grey.white:.1f}, black {found.grey.black:.2f} cd/m²")
        left.legend()
        for side in (-100 * DEVIATION, 100 * DEVIATION):
            right.axhline(side, color=GREY, linewidth=0.7, linestyle="--")
        right.set(xlabel="level, as a share of the greatest", ylabel="off the curve (% of white)")
        right.set_title("Dashed: limit")
    return figure
