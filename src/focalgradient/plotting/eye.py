"""Figures of a simulated eye: its focus over time, its image through focus, its accommodation, and its depth."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.plotting.figures import BLUE, GREEN, GREY, ORANGE, REFERENCE, laid_out
from focalgradient.plotting.maps import depth_figure

if TYPE_CHECKING:
    from focalgradient.depth import DepthMap
    from focalgradient.eye import Course, ThroughFocus
    from focalgradient.view import View

__all__ = ["accommodation_figure", "eye_depth_figure", "focus_figure", "through_focus_figure"]

COLOURS = {"L+M": ORANGE, "S": BLUE}

DRAWN_S = 0.01
"""Interval in seconds at which a target is drawn: on paper below the width of its line."""

LONGEST = 90
"""Maximum length of a line of a title, in characters."""


def eye_depth_figure(views: Mapping[str, View], depth: DepthMap, truth: NDArray[np.floating]) -> Figure:
    """Draw the views of a simulated eye by name, true (m) and recovered depth, and the error."""
    figure = depth_figure([*views.values()], depth, names=[*views], truth=np.where(np.isfinite(truth), truth, np.nan))
    figure.text(0.99, 0.005, "a simulated eye", ha="right", va="bottom", fontsize=8)
    return figure


def focus_figure(times: FloatArray, focus: Mapping[str, FloatArray], moments: Sequence[float] = ()) -> Figure:
    """Draw the vergence in focus (D) of each band over `times` (s), and the `moments` (s) of views."""
    with laid_out(120, 62) as figure:
        ax = figure.subplots()
        for band, values in focus.items():
            ax.plot(1e3 * times, values, color=COLOURS[band])
            ax.text(1e3 * times[-1] + 10, values[-1], f"{band} cones", color=COLOURS[band], va="center")
        for moment in moments:
            ax.axvline(1e3 * moment, **REFERENCE)
        if moments:
            between = float(np.mean([*focus.values()]))
            ax.text(1e3 * moments[-1] + 12, between, "the views’ moments", color=GREY, va="center")
        ax.set(xlim=(1e3 * times[0], 1e3 * times[-1]), xlabel="time (ms)", ylabel="vergence in focus (D)")
        ax.set_title("Focus of a simulated eye")
    return figure


def accommodation_figure(course: Course, target: Callable[[float], float], title: str) -> Figure:
    """Draw the `target` (D, at a time in s), its estimate with two standard deviations, and focus over time."""
    with laid_out(150, 80) as figure:
        ax = figure.subplots()
        low, high = (course.estimate + way * 2 * course.estimate_sd for way in (-1, 1))
        ax.fill_between(course.times, low, high, color=BLUE, alpha=0.2, linewidth=0)
        # Between the eye's moments, too: a smooth target is smooth, and a step is where it happens.
        fine = np.arange(0, float(course.times[-1]) + DRAWN_S, DRAWN_S)
        ax.plot(fine, [target(float(t)) for t in fine], color=GREY, linewidth=1.2, label="target")
        ax.plot(course.times, course.estimate, color=BLUE, linewidth=0.9, label="estimate of its vergence, ± 2 sd")
        ax.plot(course.times, course.accommodation, color=ORANGE, linewidth=1.4, label="accommodation")
        every = np.concatenate([course.target, course.accommodation])
        margin = 0.25 * max(1.0, float(np.ptp(every)))
        ax.set(xlabel="time (s)", ylabel="vergence (D)", xlim=(0, float(course.times[-1])))
        ax.set_ylim(float(every.min()) - margin, float(every.max()) + 1.6 * margin)
        ax.set_title(f"A simulated eye that focuses by its own estimate of depth: {title}")
        ax.legend(loc="upper left", ncols=3)
    return figure


def through_focus_figure(
    quality: ThroughFocus,
    images: Mapping[float, FloatArray],
    pixel_angle: float,
    stated: Sequence[str] = (),
) -> Figure:
    """Draw images of a point by distance from the best focus (D), and below them quality against vergence.

    Parameters
    ----------
    quality
        Image quality through focus at three frequencies.
    images, pixel_angle
        Images of a point (`focalgradient.eye.point_images`), and the visual angle in radians of a pixel.
    stated
        What the title states about the eye, such as "pupil 4.0 mm".
    """
    with laid_out(200, 120) as figure:
        above, below = figure.subfigures(2, 1, height_ratios=(1, 1.5), squeeze=False)[:, 0]
        for column, (change, image) in enumerate(images.items()):
            half = len(image) * math.degrees(pixel_angle) * 60 / 2
            ax = above.add_subplot(1, len(images), column + 1)
            ax.imshow(np.sqrt(np.clip(image / image.max(), 0, 1)), cmap="gray", extent=(-half, half, half, -half))
            where = f"{abs(change):g} D {'nearer' if change > 0 else 'farther'}"
            best = f"{round(quality.best, 2) + 0:g}".replace("-", "−")
            ax.set_title(where if change else f"best focus, {best} D")
            ax.set(xticks=[-10, 0, 10], yticks=[-10, 0, 10] if not column else [])
            if not column:
                ax.set_ylabel("image of a point")
        mtf, strehl = below.subplots(1, 2, width_ratios=(3, 2))
        for f, values, colour in zip(quality.frequency_cpd, quality.mtf.T, (BLUE, GREEN, ORANGE), strict=True):
            mtf.plot(quality.vergences, values, color=colour, label=f"{f:g} c/deg")
        mtf.set(ylabel="modulation transfer", ylim=(0, 1))
        mtf.legend(loc="upper right")
        strehl.plot(quality.vergences, quality.visual_strehl, color="black")
        strehl.set(ylabel="visual Strehl ratio", ylim=(0, 1.05 * max(0.1, float(quality.visual_strehl.max()))))
        for ax in (mtf, strehl):
            ax.axvline(quality.best, **REFERENCE)
            ax.set(
                xlabel="vergence of the target (D, infinity at 0)", xlim=(quality.vergences[0], quality.vergences[-1])
            )
        figure.suptitle("\n".join(["Image of a simulated eye through focus", *_lines(stated)]))
        seen = "arcmin as the person sees the image, y downwards"
        above.supxlabel(f"{seen}; square root of the light, each picture with its own maximum", fontsize="small")
    return figure


def _lines(phrases: Sequence[str]) -> list[str]:
    """Return phrases in lines of about equal length, none of them broken.

    >>> _lines(["a" * 60, "b" * 50]) == ["a" * 60 + ",", "b" * 50]
    True
    """
    whole = len(", ".join(phrases))
    even = whole / max(1, math.ceil(whole / LONGEST))
    lines = [*phrases[:1]]
    for phrase in phrases[1:]:
        if len(lines[-1]) + len(phrase) / 2 > even:
            lines[-1] += ","
            lines.append(phrase)
        else:
            lines[-1] += f", {phrase}"
    return lines
