"""Figures of the experiments: individual subjects thin, the mean over subjects with its interval bold.

Pictures of simulated observers are labelled as such.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from scipy import stats

from focalgradient.plotting.figures import (
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    ORANGE,
    REFERENCE,
    SIMULATED,
    draw_means,
    laid_out,
)
from focalgradient.plotting.ratio_axis import ratio_axis
from focalgradient.statistics import DepthRatingResult, DurationFit, Effect, Interval, NeckerResult, OrdinalResult

__all__ = [
    "blur_figure",
    "depth_rating_figure",
    "draw_depth_rating",
    "draw_durations",
    "draw_latent",
    "draw_nonrigid_share",
    "draw_scene_rises",
    "draw_scenes",
    "draw_shares",
    "draw_steps",
    "necker_figure",
    "ordinal_figure",
    "scenes_figure",
]

FIXATION = {"nearest": (BLUE, "o", "near object\nin focus"), "farthest": (ORANGE, "s", "far object\nin focus")}
OTHERS = [*zip(COLOURS[2:], "^DvP", strict=True)]
"""Colours and markers of user-defined fixations."""

Look = tuple[str, str, str]
"""Colour, marker and label of a fixation."""


def fixation_looks(names: Iterable[str]) -> dict[str, Look]:
    r"""Return the look of each fixation; if only nearest or farthest occur, of both.

    >>> [*fixation_looks(["middle", "nearest"])], [*fixation_looks(["nearest"])]
    (['nearest', 'middle'], ['nearest', 'farthest'])
    """
    there = {*names}
    others = sorted(there - {*FIXATION})
    if not others:
        return FIXATION
    known = {name: look for name, look in FIXATION.items() if name in there}
    return known | {name: (*OTHERS[at % len(OTHERS)], f"{name}\nin focus") for at, name in enumerate(others)}


PERCEPT_COLOURS = {"rigid": BLUE, "nonrigid": ORANGE, "both": GREEN, "none": "#BBBBBB"}
OUTLINE = [withStroke(linewidth=3, foreground="white")]
OFFSET = 0.06
"""Horizontal offset of two curves, as a fraction of an axis step, so that their error bars do not overlap."""


def _sides(count: int) -> list[float]:
    """Return the horizontal offsets of the curves of `count` fixations."""
    return [OFFSET * (2 * number / max(count - 1, 1) - 1) for number in range(count)]


def depth_rating_figure(result: DepthRatingResult, *, simulated: bool) -> Figure:
    """Draw Fig. 3: perceived depth relative to the pinhole, by aperture, for both fixations."""
    with laid_out(120, 90) as figure:
        ax = draw_depth_rating(figure.add_subplot(), result, simulated=simulated)
        subjects, scenes = len(result.participants), len(result.scenes)
        who = "simulated observer" if simulated else "subject"
        ax.set_title(f"{_count(subjects, who)}, {_count(scenes, 'scene')}")
    return figure


def blur_figure(result: DepthRatingResult, blur: Mapping[str, tuple[float, float]], *, simulated: bool) -> Figure:
    """Draw Fig. 3 by retinal blur: geometric means over subjects, with error bars in both directions.

    Parameters
    ----------
    result
        Result with ratios to the pinhole.
    blur
        Retinal blur in minutes of arc, and its standard deviation, by aperture name.
    simulated
        Whether the observers were simulated.
    """
    with laid_out(120, 90) as figure:
        ax = figure.add_subplot()
        names = {mean.aperture_mm: mean.aperture for mean in result.subject_means}
        labels = []
        for fixation, (colour, marker, label) in FIXATION.items():
            means = [
                (*blur[names[mean.aperture_mm]], mean.ratio)
                for mean in result.means
                if mean.fixation == fixation and isinstance(mean.ratio, Interval) and names[mean.aperture_mm] in blur
            ]
            if not means:
                continue
            for x, sd, mean in means:
                ax.errorbar(x, mean.estimate, xerr=sd, color=colour, linewidth=1, capsize=2, alpha=0.7, zorder=2)
            draw_means(ax, [(x, mean) for x, _, mean in means], colour, marker)
            labels.append((means[-1][2].estimate, label, colour))
        ax.axhline(1, **REFERENCE)
        ratio_axis(ax, "y")
        ax.set(xlabel="maximum retinal blur (arcmin)", ylabel="perceived depth (ratio to the pinhole)")
        _labels(ax, labels, 0.15)
        _label_simulated(ax, simulated)
    return figure


def scenes_figure(result: DepthRatingResult, *, simulated: bool) -> Figure:
    """Draw the ratios to the pinhole by scene: curves of all scenes, and each scene's depth effect."""
    with laid_out(180, 90) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.2))
        draw_scenes(left, result, simulated=simulated)
        draw_scene_rises(right, result)
    return figure


def ordinal_figure(result: DepthRatingResult, *, simulated: bool) -> Figure:
    """Draw ordinal responses: proportions by aperture for each fixation, and the latent scale with its thresholds."""
    shown = result.ordinal.fixations if isinstance(result.ordinal, OrdinalResult) else ()
    looks = [fixation for fixation in fixation_looks(shown) if fixation in shown]
    with laid_out(180 + 45 * max(len(looks) - 2, 0), 80) as figure:
        axes = figure.subplots(1, len(looks) + 1, width_ratios=(*[1] * len(looks), 1.2))
        if isinstance(result.ordinal, OrdinalResult):
            for ax, fixation in zip(axes, looks, strict=False):
                draw_steps(ax, result.ordinal, fixation)
            draw_latent(axes[-1], result.ordinal, result.largest_mm)
        if simulated:
            low, high = axes[-1].get_ylim()
            axes[-1].set_ylim(low, high + 0.1 * (high - low))  # above the thresholds' labels
        _label_simulated(axes[-1], simulated)
    return figure


def necker_figure(result: NeckerResult, *, simulated: bool) -> Figure:
    """Draw the percepts of the rotating cube by focal gradient: proportions of time, and durations."""
    with laid_out(180, 82) as figure:
        left, middle, right = figure.subplots(1, 3)
        draw_nonrigid_share(left, result, simulated=simulated)
        draw_shares(middle, result)
        draw_durations(right, result)
    return figure


def draw_depth_rating(ax: Axes, result: DepthRatingResult, *, simulated: bool) -> Axes:
    """Draw ratings as ratios to the pinhole: each subject, and the geometric mean with its interval.

    Without pinhole trials, the ratings themselves are drawn, with within-subject intervals; on an ordinal scale only
    those of each subject.
    """
    ratio = any(mean.ratio is not None for mean in result.subject_means)
    subjects = [
        (mean.fixation, mean.participant_id, mean.aperture_mm, mean.aperture, mean.ratio if ratio else mean.rating)
        for mean in result.subject_means
    ]
    strength = 0.35 if len(result.participants) > 8 else 0.55
    return _draw_ratings(ax, result, subjects, ratio=ratio, strength=strength, simulated=simulated)


def draw_scenes(ax: Axes, result: DepthRatingResult, *, simulated: bool) -> Axes:
    """Draw each scene's ratios to the pinhole, averaged over subjects (thin), and the mean of all scenes (bold)."""
    scenes = [
        (mean.fixation, mean.scene, mean.aperture_mm, mean.aperture, mean.ratio.estimate) for mean in result.scene_means
    ]
    return _draw_ratings(ax, result, scenes, ratio=True, strength=0.6, simulated=simulated)


def _draw_ratings(
    ax: Axes,
    result: DepthRatingResult,
    curves: Sequence[tuple[str, str, float, str, float | None]],
    *,
    ratio: bool,
    strength: float,
    simulated: bool,
) -> Axes:
    """Draw thin curves of subjects or scenes: fixation, name, aperture (mm, name) and height; and the means (bold)."""
    sizes = sorted({(mm, aperture) for _, _, mm, aperture, _ in curves})
    apart, labels = _apart(sizes), []
    looks = fixation_looks(fixation for fixation, *_ in curves)
    for side, (fixation, (colour, marker, label)) in zip(_sides(len(looks)), looks.items(), strict=True):
        points = [(name, mm + side * apart, y) for end, name, mm, _, y in curves if end == fixation and y is not None]
        for curve in dict.fromkeys(name for name, _, _ in points):
            places = [(x, y) for name, x, y in points if name == curve]
            ax.plot(*zip(*places, strict=True), color=colour, linewidth=0.5, alpha=strength, zorder=1)
        intervals = (
            (mean.aperture_mm + side * apart, mean.ratio if ratio else mean.rating)
            for mean in result.means
            if mean.fixation == fixation
        )
        means = [(x, mean) for x, mean in intervals if isinstance(mean, Interval)]
        if means:
            draw_means(ax, means, colour, marker)
            labels.append((means[-1][1].estimate, label, colour))
        elif points:
            labels.append((points[-1][2], label, colour))
    ax.margins(y=0.04)
    _apertures(ax, sizes)
    if ratio:
        ax.set_ylabel("perceived depth (ratio to the pinhole)")
        ax.axhline(1, **REFERENCE)
        ratio_axis(ax, "y")
    else:
        ax.set_ylabel("rating (geometric mean)")
    _labels(ax, labels, 0.15)
    _label_simulated(ax, simulated)
    return ax


def draw_scene_rises(ax: Axes, result: DepthRatingResult) -> Axes:
    """Draw each scene's depth effect at the largest aperture with its interval, sorted by the near effect."""
    rises = {
        (mean.scene, mean.fixation): mean.ratio
        for mean in result.scene_means
        if mean.aperture_mm == result.largest_mm and mean.aperture_mm
    }
    looks = fixation_looks(fixation for _, fixation in rises)
    order = sorted(
        {scene for scene, _ in rises},
        key=lambda scene: next(rises[scene, name].estimate for name in looks if (scene, name) in rises),
    )
    for side, (fixation, (colour, marker, _)) in zip(reversed(_sides(len(looks))), looks.items(), strict=True):
        for y, scene in enumerate(order):
            rise = rises.get((scene, fixation))
            if rise is None:
                continue
            if rise.low is not None and rise.high is not None:
                ax.plot([rise.low, rise.high], [y + 2 * side] * 2, color=colour, linewidth=1.2)
            ax.plot(rise.estimate, y + 2 * side, marker, color=colour, markersize=4)
    ax.axvline(1, **REFERENCE)
    small = max(4.0, min(8.0, 130 / max(len(order), 1)))
    ax.set_yticks(range(len(order)), order, fontsize=small)
    ax.set_xlabel("depth effect at the largest aperture\n(ratio to the pinhole)")
    ratio_axis(ax, "x")
    return ax


def draw_steps(ax: Axes, result: OrdinalResult, fixation: str) -> Axes:
    """Draw the mean proportions of the response steps of one fixation by aperture, stacked, highest step on top."""
    proportions = [proportion for proportion in result.shares if proportion.fixation == fixation]
    sizes = sorted({(proportion.aperture_mm, proportion.aperture) for proportion in proportions})
    steps = sorted({proportion.step for proportion in result.shares})
    share = {(proportion.aperture_mm, proportion.step): 100 * proportion.share for proportion in proportions}
    base = np.zeros(len(sizes))
    colour, _, label = fixation_looks(result.fixations)[fixation]
    for number, step in enumerate(steps):
        heights = np.array([share.get((mm, step), 0.0) for mm, _ in sizes])
        strength = 0.15 + 0.85 * number / max(len(steps) - 1, 1)
        ax.bar(range(len(sizes)), heights, 0.8, base, color=colour, alpha=strength, edgecolor="white", linewidth=0.5)
        for x, (bottom, height) in enumerate(zip(base, heights, strict=True)):
            if height > 6:
                ink = "white" if strength > 0.55 else "black"
                ax.text(x, bottom + height / 2, str(step), ha="center", va="center", color=ink, fontsize=6.5)
        base += heights
    names = [name for _, name in sizes]
    ax.set_xticks(range(len(sizes)), names, rotation=45, ha="right", rotation_mode="anchor")
    ax.set(ylim=(0, 100), xlabel="aperture", ylabel="responses (%)", title=label.replace("\n", " "))
    return ax


def draw_latent(ax: Axes, result: OrdinalResult, largest_mm: float) -> Axes:
    """Draw the latent scale: each fixation's regression line with its 95 % interval, and the thresholds."""
    mm = np.linspace(0, largest_mm, 30)
    labels = []
    for fixation, slope in zip(result.fixations, result.slopes, strict=True):
        if isinstance(slope, Effect):
            colour, _, label = fixation_looks(result.fixations)[fixation]
            ax.fill_between(mm, slope.low * mm, slope.high * mm, color=colour, alpha=0.2, linewidth=0)
            ax.plot(mm, slope.estimate * mm, color=colour, linewidth=2)
            labels.append((slope.estimate * largest_mm, label, colour))
    for threshold in result.thresholds:
        ax.axhline(threshold.place.estimate, **REFERENCE)
        ax.text(
            0, threshold.place.estimate, f" {threshold.below} | {threshold.above}", color=GREY, fontsize=6, va="top"
        )
    ax.set(xlabel="aperture (mm)", ylabel="latent perceived depth (log odds)", title="Latent scale")
    _labels(ax, labels, 0.15)
    return ax


def draw_nonrigid_share(ax: Axes, result: NeckerResult, *, simulated: bool) -> Axes:
    """Draw the nonrigid percept's proportion of both readings' time: each subject, mean and 95 % interval."""
    conditions = _conditions(result)
    for participant in result.participants:
        shares = {
            (share.gradient, share.strength): 100 * share.nonrigid
            for share in result.subject_shares
            if share.participant_id == participant and share.nonrigid is not None
        }
        points = [(x, shares[condition]) for x, condition in enumerate(conditions) if condition in shares]
        ax.plot(*zip(*points, strict=True) if points else ((), ()), color=ORANGE, linewidth=0.5, alpha=0.4, zorder=1)
    of = {(share.gradient, share.strength): share.of_readings for share in result.shares if share.percept == "nonrigid"}
    means = [(x, mean) for x, mean in enumerate(map(of.get, conditions)) if isinstance(mean, Interval)]
    draw_means(ax, means, ORANGE, scale=100)
    ax.axhline(50, **REFERENCE)
    ax.set(ylim=(-2, 102), ylabel="nonrigid percept (% of the time)", title="Nonrigid percept")
    _gradients(ax, conditions)
    _label_simulated(ax, simulated)
    return ax


def draw_shares(ax: Axes, result: NeckerResult) -> Axes:
    """Draw the mean proportions of time of all four reports, stacked."""
    conditions = _conditions(result)
    time = {(share.gradient, share.strength, share.percept): 100 * share.time.estimate for share in result.shares}
    base = np.zeros(len(conditions))
    labels = []
    for percept, colour in PERCEPT_COLOURS.items():
        heights = np.array([time.get((*condition, percept), 0.0) for condition in conditions])
        ax.bar(range(len(conditions)), heights, 0.75, base, color=colour, edgecolor="white", linewidth=0.4)
        base += heights
        if heights.any():
            labels.append((float(base[-1] - heights[-1] / 2), percept, GREY if percept == "none" else colour))
    ax.set(ylim=(0, 100), ylabel="proportion of time (%)", title="Reported percepts")
    _gradients(ax, conditions)
    _labels(ax, labels, 0.06)
    return ax


def draw_durations(ax: Axes, result: NeckerResult) -> Axes:
    """Draw the durations of each percept: median and quartiles of the better-fitting distribution."""
    conditions = _conditions(result)
    labels = []
    for side, percept in ((-OFFSET, "rigid"), (OFFSET, "nonrigid")):
        colour = PERCEPT_COLOURS[percept]
        places, medians = [], []
        for dominance in result.dominance:
            fit = dominance.lognormal if dominance.better == "lognormal" else dominance.gamma
            if dominance.percept != percept or not isinstance(fit, DurationFit):
                continue
            law = (stats.lognorm if fit.family == "lognormal" else stats.gamma)(fit.shape, scale=fit.scale)
            low, median, high = law.ppf([0.25, 0.5, 0.75])
            x = conditions.index((dominance.gradient, dominance.strength)) + side
            ax.plot([x, x], [low, high], color=colour, linewidth=1.4)
            places.append(x)
            medians.append(median)
        order = np.argsort(places)
        ax.plot(np.array(places)[order], np.array(medians)[order], "o-", color=colour, markersize=5)
        if medians:
            labels.append((float(medians[int(order[-1])]), percept, colour))
    ax.set(ylabel="duration (s): median and quartiles", title="Percept durations")
    ax.set_ylim(0, None)
    _gradients(ax, conditions)
    _labels(ax, labels, 0.06)
    return ax


def _apart(sizes: Sequence[tuple[float, str]]) -> float:
    """Return the mean distance between apertures on the axis (mm)."""
    return (sizes[-1][0] - sizes[0][0]) / max(len(sizes) - 1, 1) or 1.0


def _apertures(ax: Axes, sizes: Sequence[tuple[float, str]]) -> None:
    """Label apertures at their diameters; rotate the labels where apertures lie close together."""
    first, last = sizes[0][0], sizes[-1][0]
    room = 0.3 * _apart(sizes)
    ax.set_xlim(first - room, last + room)
    close = any(larger - smaller < 0.11 * (last - first) for (smaller, _), (larger, _) in pairwise(sizes))
    labels = [f"{name}\n{mm:.3g}" if not close else f"{name} ({mm:.3g})" for mm, name in sizes]
    ax.set_xticks([mm for mm, _ in sizes], labels)
    if close:
        for label in ax.get_xticklabels():
            label.set(rotation=45, ha="right", rotation_mode="anchor")
    ax.set_xlabel("aperture (diameter in mm)")


def _conditions(result: NeckerResult) -> list[tuple[str, float]]:
    """Return the conditions, from the strongest rigid gradient through none to the strongest nonrigid one."""
    sign = {"rigid": -1.0, "none": 0.0, "nonrigid": 1.0}
    conditions = {(share.gradient, share.strength) for share in result.shares}
    return sorted(conditions, key=lambda condition: sign[condition[0]] * condition[1])


def _gradients(ax: Axes, conditions: Sequence[tuple[str, float]]) -> None:
    ax.set_xticks(range(len(conditions)), [f"{strength:g}" for _, strength in conditions])
    ax.set_xlim(-0.6, len(conditions) - 0.4)
    ax.set_xlabel("aperture (mm)\nrigid  ←  blur  →  nonrigid")


def _labels(ax: Axes, labels: list[tuple[float, str, str]], apart: float) -> None:
    """Label curves at their end heights, right of the axes, with labels at least `apart` (axes fraction) apart."""
    scale = ax.yaxis.get_transform()  # linear or logarithmic
    low, high = scale.transform(np.array(ax.get_ylim()))
    places: list[float] = []
    for y, _, _ in sorted(labels):
        height = (float(scale.transform(np.array([y]))[0]) - low) / (high - low)
        places.append(max(height, places[-1] + apart if places else -np.inf))
    top = 1 - apart / 2
    for index in reversed(range(len(places))):  # move labels beyond the top down again
        places[index] = top = min(places[index], top)
        top -= apart
    beside = ax.get_yaxis_transform()  # at a height in data, which axes that share their limits may still change
    for place, (_, label, colour) in zip(places, sorted(labels), strict=True):
        y = float(scale.inverted().transform(np.array([low + place * (high - low)]))[0])
        ax.text(1.02, y, label, transform=beside, ha="left", va="center", color=colour, fontweight="bold")


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def _label_simulated(ax: Axes, simulated: bool) -> None:
    if simulated:
        ax.text(0.03, 0.97, SIMULATED, transform=ax.transAxes, va="top", color="black", path_effects=OUTLINE, zorder=6)
