"""Figure of a photometer's measurements with fitted gamma curves."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from focalgradient.luminance import DEVIATION, Luminance
from focalgradient.plotting.figures import GREY, laid_out

__all__ = ["luminance_figure"]

COLOURS = {"red": "#C8102E", "green": "#007A33", "blue": "#0050B5", "grey": "#444444"}


def luminance_figure(luminance: Luminance) -> Figure:
    """Draw luminance by level with the fitted curve of each gun, and the residuals with their limits."""
    with laid_out(180, 80) as figure:
        left, right = figure.subplots(1, 2)
        fine = np.linspace(0, 1, 200)
        for gun, curve in luminance.curves.items():
            values, colour = luminance.measured[gun], COLOURS[gun]
            left.plot(luminance.shares, values, "o", color=colour, markersize=3.5)
            left.plot(fine, curve.at(fine), color=colour, linewidth=1, label=f"{gun}: γ = {curve.gamma:.2f}")
            rest = 100 * (values - curve.at(luminance.shares)) / (curve.white - curve.black)
            right.plot(luminance.shares, rest, "o-", color=colour, markersize=3.5, linewidth=0.8)
        left.set(xlabel="level / maximum level", ylabel="luminance (cd/m²)")
        left.set_title(f"White {luminance.grey.white:.1f}, black {luminance.grey.black:.2f} cd/m²")
        left.legend()
        for side in (-100 * DEVIATION, 100 * DEVIATION):
            right.axhline(side, color=GREY, linewidth=0.7, linestyle="--")
        right.set(xlabel="level / maximum level", ylabel="residual (% of white − black)")
        right.set_title("Residuals (dashed: limit)")
    return figure
