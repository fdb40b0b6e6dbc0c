"""Fig. 2: theoretical error of distance from the focal gradient and from stereopsis."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from report import Progress, Shown, alone

from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

ERROR = 0.02  # relative error in sigma that the paper assumes for people
FOCUS = 2.0  # m
STEREO = 0.001  # per metre: 1 mm at 1 m
PAPER_TOP = 0.4  # m, where the paper's vertical axis ends


def focal_gradient_error(distance: ArrayLike, error: float = ERROR, focus: float = FOCUS) -> NDArray[np.float64]:
    """Return the error in distance (m) at `distance` (m) due to the relative `error` in sigma: e D |D/u0 - 1|.

    With D = 1/V and sigma ~ |V - 1/u0|: dV = e |V - 1/u0|, and dD = D^2 dV. The constants of the lens cancel.
    """
    distance = np.asarray(distance, dtype=float)
    result: NDArray[np.float64] = error * distance * np.abs(distance / focus - 1)
    return result


def stereo_error(distance: ArrayLike) -> NDArray[np.float64]:
    """Return the error in distance (m) at `distance` (m) from stereopsis, proportional to its square: 1 mm at 1 m."""
    return STEREO * np.asarray(distance, dtype=float) ** 2


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    distance = np.linspace(0, 10, 401)
    focal, stereo = focal_gradient_error(distance), stereo_error(distance)
    # e D |D/u0 - 1| = s D^2 on either side of focus
    equal = [1 / (1 / FOCUS + STEREO / ERROR), 1 / (1 / FOCUS - STEREO / ERROR)]
    leaves = float(distance[np.argmax((focal > PAPER_TOP) & (distance > FOCUS))])
    with style():
        figure = new_figure(180, 76, layout="constrained")
        axes = figure.subplots(1, 2, sharex=True, sharey=True)
        for ax, mine, colour, other in zip(axes, (focal, stereo), (BLUE, ORANGE), (stereo, focal), strict=True):
            ax.axhline(PAPER_TOP, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)))
            ax.plot(distance, other, color="#c9c9c9", linewidth=1)
            ax.plot(distance, mine, color=colour, linewidth=2)
            ax.set(xlim=(0, 10), ylim=(0, 0.82), xlabel="distance $D$ (m)", xticks=range(0, 11, 2))
        axes[0].set_ylabel("error of distance (m)")
        axes[0].set_title(r"(a) Focal gradient: $e\,D\,|D/u_0 - 1|$, $e$ = 2 %, $u_0$ = 2 m")
        axes[1].set_title(r"(b) Stereopsis: $0.001\,D^2$, 1 mm at 1 m")
        axes[0].text(0.15, PAPER_TOP + 0.012, "top of the paper’s axis", color=GREY)
        axes[0].annotate(
            "in focus",
            (FOCUS, 0),
            (FOCUS, 0.10),
            ha="center",
            color=BLUE,
            arrowprops={"arrowstyle": "-", "color": BLUE},
        )
        axes[0].text(9.9, 0.125, "stereopsis", color=GREY, ha="right")
        axes[1].text(7.7, 0.52, "focal\ngradient", color=GREY, ha="right")
        figure.draw_without_rendering()
    return Shown(
        title="Fig. 2: error of distance, from theory",
        caption=(
            "The error of distance that follows from an error of 2 % in the size of the blur, with focus at 2 m, and "
            "the error of stereopsis that can just discriminate one millimetre at one metre. Each panel repeats the "
            "other’s curve in grey.",
            "The two are comparable out to several metres, as the paper says. With its numbers the focal gradient is "
            f"the better of the two only from {equal[0]:.2f} to {equal[1]:.2f} m, close to the plane of focus, where "
            "its predicted error goes to zero. That zero assumes that the relative error of blur stays the same "
            "however small the blur: the measured curve shows what happens instead.",
        ),
        figure=figure,
        summary={
            "focal_gradient_error_at_1_m_m": float(focal_gradient_error(1)),
            "focal_gradient_error_at_4_m_m": float(focal_gradient_error(4)),
            "focal_gradient_error_at_10_m_m": float(focal_gradient_error(10)),
            "stereo_error_at_1_m_m": float(stereo_error(1)),
            "stereo_error_at_4_m_m": float(stereo_error(4)),
            "stereo_error_at_10_m_m": float(stereo_error(10)),
            "distances_where_both_are_equal_m": equal,
            "distance_where_focal_gradient_leaves_the_axis_of_the_paper_m": leaves,
        },
        plotted={"distance_m": distance, "focal_gradient_error_m": focal, "stereo_error_m": stereo},
    )


if __name__ == "__main__":
    alone("fig2", make)
