"""Errors of the simulated observer: its answers compared with the ground truth of the pictures."""

from __future__ import annotations

from typing import TypedDict

import numpy as np
from matplotlib.figure import Figure
from report import Progress, Shown, alone

from focalgradient.display import Display
from focalgradient.observers import (
    OBSERVERS,
    BlurDiscrimination,
    DepthExtent,
    DistanceOfFixated,
    RelativeLayout,
    Slant,
    blur_threshold,
    look,
)
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style
from focalgradient.stimuli import blurred_edge, slanted_plane, texture_border

DEFAULT = OBSERVERS["default"]
FINE = Display(distance=Display().distance * 60 / Display().pixels_per_degree)
"""Display with 60 pixels per degree."""

SIDE = 5.0  # degrees: width and height of the pictures
BLURS = (0.0, 0.5, 1.0, 2.0, 4.0)  # arcmin
SLOPES = (0.75, 1.0, 1.5)  # of the amplitude spectrum of textures, 1/f^slope
DISTANCES = (0.2, 0.3, 0.6, 1.2)  # metres
SLANTS = (0.0, 30.0, 50.0, 70.0, 80.0)  # degrees
PEDESTALS = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)  # arcmin

Values = dict[str, list[float]]


class Size(TypedDict):
    """Size of a picture and resolution of its display."""

    width_deg: float
    height_deg: float
    pixels_per_degree: float


SIZE = Size(width_deg=SIDE, height_deg=SIDE, pixels_per_degree=60.0)


def blur_all_over() -> Values:
    """Return the median estimated blur (arcmin) of uniformly blurred textures, by slope of the amplitude spectrum."""
    found: Values = {}
    for slope in SLOPES:
        found[f"1/f^{slope:g}"] = [
            float(
                np.nanmedian(
                    look(
                        texture_border(
                            left_blur_arcmin=blur, right_blur_arcmin=blur, slope=slope, seed=1, **SIZE
                        ).picture,
                        FINE,
                        (150.0, 150.0),
                        DEFAULT,
                    ).blur
                )
            )
            for blur in BLURS
        ]
    return found


def depth_of_halves() -> Values:
    """Return the perceived depth (D) of a flat layout with one half blurred, and with both, which is not deep."""
    return {
        name: [
            DEFAULT.look(
                texture_border(
                    left_blur_arcmin=share * blur, right_blur_arcmin=blur, border="straight", seed=1, **SIZE
                ).picture,
                FINE,
                DepthExtent(),
            ).median
            for blur in BLURS
        ]
        for name, share in (("one half blurred", 0.0), ("both halves blurred", 1.0))
    }


def distance_and_slant() -> tuple[list[float], list[float]]:
    """Return distances (m) of a plane slanted by 75 degrees, and slants (degrees) of planes at .3 m, by blur alone."""
    metres = []
    for distance in DISTANCES:
        drawn = slanted_plane(slant_deg=75, distance_m=distance, pupil_mm=4, **SIZE)
        middle = (drawn.shape[1] / 2, drawn.shape[0] / 2)
        metres.append(
            DEFAULT.look(drawn.picture, FINE, DistanceOfFixated(RelativeLayout(drawn.depth_m), middle)).median
        )
    degrees = [
        DEFAULT.look(
            slanted_plane(slant_deg=slant, distance_m=0.3, pupil_mm=4, **SIZE).picture,
            FINE,
            Slant(distance_m=0.3),
        ).median_deg
        for slant in SLANTS
    ]
    return metres, degrees


def right_at_threshold() -> Values:
    """Return the proportion correct at the rule's own thresholds, by pedestal: .75 without losses in the pixels."""

    def texture(blur: float) -> np.ndarray:
        return texture_border(left_blur_arcmin=blur, right_blur_arcmin=blur, seed=1, **SIZE).picture

    def edge(blur: float) -> np.ndarray:
        return blurred_edge(pedestal_arcmin=blur, **SIZE).picture

    return {
        name: [
            DEFAULT.look(
                draw(pedestal + blur_threshold(pedestal, DEFAULT)), FINE, BlurDiscrimination(draw(pedestal))
            ).probability["first"]
            for pedestal in PEDESTALS
        ]
        for name, draw in (("edge", edge), ("texture", texture))
    }


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    blur = blur_all_over()
    report(0.35)
    halves = depth_of_halves()
    report(0.55)
    metres, degrees = distance_and_slant()
    report(0.8)
    right = right_at_threshold()
    return Shown(
        title="What the simulated observer gets wrong",
        caption=(
            "Answers of the default simulated observer by looking at pictures of 5 degrees and 60 pixels per degree; "
            "dashed: right answers. Blur read: textures with uniform blur, whose amplitude is 1/f^slope; half a pixel, "
            "0.5 arcmin, is included. Depth seen: a flat layout; both halves blurred equally have no depth. Distance "
            "seen: a plane slanted by 75 degrees, by blur alone. Slant seen: planes at 0.3 m, by blur alone. Share "
            "right: at the thresholds that the observer’s rule predicts, 0.75 is expected; blur below half a pixel is "
            "lost in textures.",
        ),
        figure=_draw(blur, halves, metres, degrees, right),
        summary={
            "blur_read_of_a_1/f^1.5_texture_of_0_arcmin": blur["1/f^1.5"][0],
            "blur_read_of_a_1/f_texture_of_4_arcmin": blur["1/f^1"][-1],
            "depth_of_both_halves_at_4_arcmin_D": halves["both halves blurred"][-1],
            "depth_of_0_beside_4_arcmin_D": halves["one half blurred"][-1],
            "distance_seen_of_1.2_m": metres[-1],
            "slant_seen_of_50_degrees": degrees[2],
            "right_of_textures_at_the_threshold_without_a_pedestal": right["texture"][0],
        },
        plotted={
            "blur_arcmin": list(BLURS),
            "blur_read_arcmin": blur,
            "depth_D": halves,
            "distance_m": list(DISTANCES),
            "distance_seen_m": metres,
            "slant_deg": list(SLANTS),
            "slant_seen_deg": degrees,
            "pedestal_arcmin": list(PEDESTALS),
            "share_right": right,
        },
    )


def _draw(blur: Values, halves: Values, metres: list[float], degrees: list[float], right: Values) -> Figure:
    dashed = {"color": GREY, "linewidth": 0.6, "linestyle": (0, (4, 4))}
    with style():
        figure = new_figure(180, 115, layout="constrained")
        axes = figure.subplots(2, 3).ravel()
        for (name, values), colour in zip(blur.items(), (BLUE, GREY, ORANGE), strict=True):
            axes[0].plot(BLURS, values, "o-", color=colour, markersize=3, linewidth=0.8, label=name)
        axes[0].plot(BLURS, np.hypot(BLURS, 0.5), **dashed)
        axes[0].set(xlabel="Blur (arcmin)", title="Blur read (arcmin)")
        for (name, values), colour in zip(halves.items(), (BLUE, ORANGE), strict=True):
            axes[1].plot(BLURS, values, "o-", color=colour, markersize=3, linewidth=0.8, label=name)
        axes[1].axhline(0, **dashed)
        axes[1].set(xlabel="Blur (arcmin)", title="Depth seen (D)", ylim=(-0.005, 0.12))
        axes[2].plot(DISTANCES, metres, "o-", color=BLUE, markersize=3, linewidth=0.8)
        axes[2].plot(DISTANCES, DISTANCES, **dashed)
        axes[2].set(xscale="log", yscale="log", xlabel="Distance (m)", title="Distance seen (m)")
        axes[2].set_xticks([0.2, 0.5, 1], ["0.2", "0.5", "1"])
        axes[2].set_yticks([0.2, 1, 5, 20], ["0.2", "1", "5", "20"])
        axes[2].minorticks_off()
        axes[3].plot(SLANTS, degrees, "o-", color=BLUE, markersize=3, linewidth=0.8)
        axes[3].plot(SLANTS, SLANTS, **dashed)
        axes[3].set(xlabel="Slant (degrees)", title="Slant seen (degrees)", ylim=(0, 90))
        for (name, values), colour in zip(right.items(), (BLUE, ORANGE), strict=True):
            axes[4].plot(range(len(PEDESTALS)), values, "o-", color=colour, markersize=3, linewidth=0.8, label=name)
        axes[4].axhline(0.75, **dashed)
        axes[4].set(xlabel="Pedestal (arcmin)", title="Share right", ylim=(0.5, 1))
        axes[4].set_xticks(range(len(PEDESTALS)), ["0", "¼", "½", "1", "2", "4"])
        for ax in (axes[0], axes[1], axes[4]):
            ax.legend(fontsize=6, handlelength=1.2, loc="upper left" if ax is not axes[4] else "lower right")
        axes[5].set_axis_off()
        axes[5].text(0, 1, "Simulated observer,\nby looking at pictures.\nDashed: right answers.", va="top", color=GREY)
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("observers_wrong", make)
