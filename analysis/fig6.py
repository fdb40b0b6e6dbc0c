"""Fig. 6: geometry of image formation, drawn with the values of a lens."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from report import Progress, Shown, alone

from focalgradient import Lens, paper_distance
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

LENS = Lens(focal_length=0.050, f_number=2, focus_distance=0.150)
POINT = 0.300  # m, beyond the plane of focus
TALLER = 3  # ratio of vertical to horizontal scale


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    radius = LENS.aperture_diameter / 2
    behind = Lens(LENS.focal_length, LENS.f_number, POINT).sensor_distance  # sensor distance that focuses the far point
    sigma = float(LENS.blur_radius(POINT)) * LENS.sensor_distance
    traced = radius * (LENS.sensor_distance - behind) / behind  # similar triangles behind the lens (Eq. 15)
    recovered = paper_distance(
        sigma,
        focal_length=LENS.focal_length,
        sensor_distance=LENS.sensor_distance,
        paper_f_number=2 * LENS.f_number,
        side="beyond",
    )
    lengths = {
        "F": LENS.focal_length,
        "u0": LENS.focus_distance,
        "v0": LENS.sensor_distance,
        "u": POINT,
        "v": behind,
        "r": radius,
        "sigma": sigma,
    }
    mm = {name: 1e3 * length for name, length in lengths.items()}
    with style():
        figure = new_figure(180, 67)
        ax = figure.add_axes((0, 0, 1, 1))
        _draw(ax, mm)
        figure.draw_without_rendering()
    return Shown(
        title="Imaging geometry (the paper’s Fig. 6)",
        caption=(
            f"A {mm['F']:g} mm f/{LENS.f_number:g} lens, drawn to its numbers. The point at u0 is imaged sharply on "
            "the image plane. Light from the point farther away, at u, crosses at v, in front of the image plane, "
            "and spreads again to a circle of radius σ. In vergence the law is one line: the circle’s radius, seen "
            "from the lens, is r × |1/u0 − 1/u|.",
            "The paper’s caption puts the crossing at v > v0; its text, its equations and this drawing have v < v0. "
            "Its f is F divided by the lens radius, twice the photographer’s f-number.",
        ),
        figure=figure,
        summary={
            **{f"{name}_mm": value for name, value in mm.items()},
            "sigma_by_similar_triangles_mm": 1e3 * traced,
            "u_from_sigma_by_Eq_1_mm": 1e3 * float(recovered),
        },
        plotted={
            "ray_from_focus_mm": [[-mm["u0"], 0], [0, mm["r"]], [mm["v0"], 0]],
            "ray_from_beyond_mm": [[-mm["u"], 0], [0, mm["r"]], [mm["v"], 0], [mm["v0"], -1e3 * traced]],
            "vertical_exaggeration": TALLER,
        },
    )


def _draw(ax: Axes, mm: dict[str, float]) -> None:
    """Draw lens, rays and lengths; coordinates are millimetres, the lens at x = 0."""
    u, u0, v, v0, r, sigma = (mm[name] for name in ("u", "u0", "v", "v0", "r", "sigma"))
    ax.set(xlim=(-u - 12, v0 + 62), aspect=TALLER, anchor="C")
    ax.set_ylim(-29, 25)
    ax.set_axis_off()
    ax.plot([-u - 8, v0 + 14], [0, 0], color=GREY, linewidth=0.6, dashes=(12, 3, 2, 3))

    for colour, x in ((ORANGE, [-u, 0, v, v0]), (BLUE, [-u0, 0, v0])):
        y = np.array([0, r, 0, -sigma][: len(x)])
        ax.fill_between(x, y, -y, color=colour, alpha=0.10, linewidth=0)
        for half in (y, -y):
            ax.plot(x, half, color=colour, linewidth=1.1)
        ax.plot(x[0], 0, "o", color=colour, markersize=5)
    for place, label, colour in ((-u, "point beyond focus", ORANGE), (-u0, "point in focus", BLUE)):
        ax.text(place, 10.6, label, color=colour, ha="left" if place == -u else "center")
        ax.plot([place, place], [9.8, 1.6], color=colour, linewidth=0.5)

    height = np.linspace(-1, 1, 81)
    half = 4.5 * (1 - height**2)
    ax.fill_betweenx(1.06 * r * height, -half, half, facecolor="#dfeaf2", edgecolor="#50708a", linewidth=0.8, zorder=3)
    ax.text(0, 1.06 * r + 1.4, "lens", ha="center")
    _length(ax, (-14, 0), (-14, r), f"$r$ = {r:.4g} mm", (-17, 0.3 * r), "right")

    ax.plot([v0, v0], [-10, 10], color="black", linewidth=2, solid_capstyle="butt", zorder=4)
    ax.text(v0, 11.4, "image plane", ha="center")
    ax.plot([v0, v0], [-sigma, sigma], color=ORANGE, linewidth=4, solid_capstyle="butt", zorder=5)
    _length(ax, (v0 + 5, 0), (v0 + 5, sigma), f"$\\sigma$ = {sigma:.4g} mm", (v0 + 8, sigma / 2), "left")
    ax.text(v0 + 5, -sigma - 0.4, "blur circle", color=ORANGE, va="top")
    ax.plot([mm["F"]] * 2, [-0.8, 0.8], color="black", linewidth=1, zorder=5)

    faint: dict[str, Any] = {"color": GREY, "linewidth": 0.4, "linestyle": (0, (3, 3)), "zorder": 0}
    dimensions = (("u0", -u0, -17.0), ("u", -u, -22.0), ("F", mm["F"], -17.0), ("v", v, -22.0), ("v0", v0, -27.0))
    for name, end, level in dimensions:
        symbol = f"${name[0]}_0$" if name.endswith("0") else f"${name}$"
        ax.plot([end, end], [level, -10.8 if name == "v0" else -1.2], **faint)
        _length(ax, (0, level), (end, level), f"{symbol} = {abs(end):g} mm", (end / 2, level + 0.6), "center", "bottom")
    ax.plot([0, 0], [-27.5, -1.06 * r], **faint)

    ax.text(
        -u - 8,
        24,
        f"A real lens: $F$ = {mm['F']:g} mm, f/{LENS.f_number:g}, focused at {u0:g} mm\n"
        r"$\sigma = r\,(v_0 - v)\,/\,v$"
        f" = {r:g} × ({v0:g} − {v:g}) / {v:g} = {sigma:g} mm",
        va="top",
        linespacing=1.7,
    )
    ax.text(v0 + 58, 24, f"vertical scale {TALLER} × the horizontal", color=GREY, ha="right", va="top", linespacing=1.7)


def _length(
    ax: Axes,
    start: tuple[float, float],
    end: tuple[float, float],
    label: str,
    place: tuple[float, float],
    ha: str,
    va: str = "center",
) -> None:
    """Draw a dimension line with arrowheads at both ends, and its label at `place`."""
    arrow = {"arrowstyle": "<|-|>", "shrinkA": 0, "shrinkB": 0, "linewidth": 0.7, "color": "black", "mutation_scale": 6}
    ax.annotate("", end, start, arrowprops=arrow)
    ax.text(*place, label, ha=ha, va=va)


if __name__ == "__main__":
    alone("fig6", make)
