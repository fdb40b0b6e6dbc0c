"""Evaluation of the internal consistency check: detection of wrong estimates from three views, by cause."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone
from scipy.stats import chi2

from focalgradient import FocalGradientWarning, Lens, View, recover_depth
from focalgradient.depth.spectra.check import check_views
from focalgradient.plotting import BLUE, GREEN, GREY, ORANGE, new_figure, style
from focalgradient.render import cast, noisy
from focalgradient.scenes import Plane, Scene, Texture, plane

PURPLE = "#CC79A7"  # from the same palette (Okabe & Ito)
FOCUS = 0.85  # m
LENSES = tuple(Lens(focal_length=0.025, f_number=number, focus_distance=FOCUS) for number in (16, 8, 5.6))
PIXEL = 8e-6 / LENSES[0].sensor_distance  # rad
NOISE = 0.003  # radiance; the mean of the walls is 0.35
FALSE_ALARM = 1e-3  # the default
WRONG = 3.0  # error in standard deviations above which an estimate is wrong
NEAR, FAR = 1.1, 1.6  # m: of walls, cards and reflections
SKIN = Texture(texel=0.3e-3, projected=True)

Views = tuple[list[View], NDArray[np.float64]]


def _cast(scene: Scene, shape: tuple[int, int], seed: int) -> Views:
    """Render the scene through each lens without noise; return views and true vergence."""
    rendered = [cast(scene, lens, shape, PIXEL, samples=256, seed=seed + n) for n, lens in enumerate(LENSES)]
    return [r.view for r in rendered], 1 / rendered[0].distance


def control(shape: tuple[int, int], seed: int) -> Views:
    """Render a textured wall."""
    return _cast(plane(FAR, seed=seed), shape, seed)


def too_little_texture(shape: tuple[int, int], seed: int) -> Views:
    """Render a wall with a contrast of 0.3 %, a third of the noise."""
    return _cast(plane(FAR, seed=seed, texture=replace(SKIN, contrast=0.003)), shape, seed)


def moving(shape: tuple[int, int], seed: int) -> Views:
    """Render a wall that moves by two pixels before the third view."""
    views, truth = control(shape, seed)
    return [*views[:2], replace(views[2], image=np.roll(views[2].image, 2, axis=1))], truth


def occlusion(shape: tuple[int, int], seed: int) -> Views:
    """Render upright cards before a wall, with edges one or two windows apart."""
    width = 40 * PIXEL * NEAR
    cards = [
        Plane((x * PIXEL * NEAR, 0.0, NEAR), (0, 0, -1), replace(SKIN, seed=seed + 9), (width, np.inf))
        for x in (-80, 0, 80)
    ]
    return _cast(Scene((*cards, *plane(FAR, seed=seed).objects)), shape, seed)


def reflection(shape: tuple[int, int], seed: int) -> Views:
    """Render a glossy wall: half of the light is its own texture, half the mirror image of a nearer one."""
    (wall, truth), (image, _) = (_cast(plane(z, seed=seed + n), shape, seed) for n, z in enumerate((FAR, NEAR)))
    return [replace(a, image=(a.image + b.image) / 2) for a, b in zip(wall, image, strict=True)], truth


def saturation(shape: tuple[int, int], seed: int) -> Views:
    """Render a wall whose brightest fifth saturates the sensor, with blooming."""
    views, truth = control(shape, seed)
    ceiling = float(np.quantile(views[0].image, 0.8))
    soft = [np.where(v.image > ceiling, ceiling + 0.1 * (v.image - ceiling), v.image) for v in views]
    return [replace(v, image=image.astype(np.float32)) for v, image in zip(views, soft, strict=True)], truth


KINDS: dict[str, tuple[Callable[[tuple[int, int], int], Views], str, str]] = {
    "too little texture": (too_little_texture, GREY, "-"),
    "moving object": (moving, BLUE, "-"),
    "occlusion edge": (occlusion, ORANGE, "-"),
    "reflection": (reflection, GREEN, "-"),
    "saturation": (saturation, PURPLE, "--"),
}


@dataclass(frozen=True)
class Examined:
    """Results in every block of 8 pixels, without those at the margin."""

    statistic: NDArray[np.float64]  # test statistic of the check
    wrong: NDArray[np.bool_]  # True if the joint estimate of the check is wrong
    default_wrong: NDArray[np.bool_]  # True if the estimate of the default method is wrong
    default_rejected: NDArray[np.bool_]

    @property
    def default_found(self) -> float:
        """Fraction of the default method's wrong estimates that it rejects itself."""
        return float(self.default_rejected[self.default_wrong].mean()) if self.default_wrong.any() else np.nan


def examine(make_views: Callable[[tuple[int, int], int], Views], shape: tuple[int, int], seeds: range) -> Examined:
    """Evaluate the check and the default method on the same views."""
    inner = np.s_[36:-36:8, 36:-36:8]
    found = []
    for seed in seeds:
        views, truth = make_views(shape, 10 * seed)
        views = [noisy(view, NOISE, 100 * seed + n) for n, view in enumerate(views)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FocalGradientWarning)  # displacement warnings for moving or blank scenes
            check = check_views(views, near=FOCUS, far=4.0, noise=NOISE)
            depth = recover_depth(views, near=FOCUS, far=4.0, noise=NOISE)
        off, default_off = (
            np.abs(vergence - truth) > WRONG * sd
            for vergence, sd in ((check.joint, check.joint_sd), (depth.vergence, depth.vergence_sd))
        )
        parts = (check.statistic.astype(float), off, default_off, ~depth.valid)
        found.append([part[inner].ravel() for part in parts])
    return Examined(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    shape, seeds = ((216, 264), range(6)) if full else ((152, 200), range(1))
    sound = examine(control, shape, seeds)
    agreeing = sound.statistic
    alarms = np.geomspace(1e-3, 1, 200)
    limits, operating = chi2.isf(alarms, 1), chi2.isf(FALSE_ALARM, 1)
    refused = np.array([(agreeing > limit).mean() for limit in limits])
    curves, points, areas, cases = {}, {}, {}, {}
    for number, (name, (kind, _, _)) in enumerate(KINDS.items(), 1):
        cases[name] = examine(kind, shape, seeds)
        report(number / (len(KINDS) + 1))
        seen = cases[name].statistic[cases[name].wrong]
        curves[name] = np.array([(seen > limit).mean() if seen.size else np.nan for limit in limits])
        points[name] = float((seen > operating).mean()) if seen.size else np.nan
        areas[name] = float((seen[:, None] > agreeing).mean()) if seen.size else np.nan
    found = {f"{rate:g}": float((agreeing > chi2.isf(rate, 1)).mean()) for rate in (0.1, 0.01, 0.001)}
    return Shown(
        title="The internal check: which wrong answers three views give away",
        caption=(
            f"Walls, cards and reflections at {NEAR:g} and {FAR:g} m, ray cast through f/16, f/8 and f/5.6 focused at "
            f"{FOCUS:g} m, with {100 * NOISE / 0.35:.1f} % noise. Each pair of views gives depth; where their "
            "estimates disagree by more than noise can explain (chi-square, the noise that pairs share taken into "
            "account) the answer is rejected.",
            f"An answer is wrong if it is off by more than {WRONG:g} standard deviations: those of noise in (a), those "
            "that the default method states in (b). (a) Each curve: the share of one kind’s wrong answers that is "
            "rejected, against the share of sound answers that the limit is to reject. Grey: the share of a sound "
            "wall’s that it does reject. Dots: the default, 1 in 1000.",
            f"At the default what moves is found in {100 * points['moving object']:.0f} %, what lies at two depths in "
            f"{100 * points['reflection']:.0f} %. Without texture all pairs are uncertain and hardly "
            "disagree; the stated uncertainty rejects such pixels. Highlights that the sensor compresses alike in all "
            f"views bias all pairs alike, and only {100 * points['saturation']:.0f} % are found; saturated pixels are "
            "left out before.",
            "(b) What the default method rejects of its own wrong answers from the same views, by all its reasons "
            "together (contradiction, too little texture, a secondary minimum). The joint answer of the check and that "
            "of the default method are two estimates from the same views: of each, another share is wrong.",
        ),
        figure=_draw(alarms, refused, curves, points, sound, cases),
        summary={
            **{f"false_alarms_asked_{rate}": value for rate, value in found.items()},
            "sound_wall_wrong_percent": 100 * float(sound.wrong.mean()),
            **{f"{name.replace(' ', '_')}_wrong_percent": 100 * float(cases[name].wrong.mean()) for name in KINDS},
            **{f"{name.replace(' ', '_')}_found_at_default_percent": 100 * points[name] for name in KINDS},
            **{f"{name.replace(' ', '_')}_area_under_curve": areas[name] for name in KINDS},
            "sound_wall_refused_by_default_method_percent": 100 * float(sound.default_rejected.mean()),
            **{
                f"{name.replace(' ', '_')}_wrong_by_default_method_percent": 100 * float(case.default_wrong.mean())
                for name, case in cases.items()
            },
            **{
                f"{name.replace(' ', '_')}_found_by_default_method_percent": 100 * case.default_found
                for name, case in cases.items()
            },
        },
        plotted={"false_alarm": alarms, "sound_refused": refused, "found": curves},
    )


def _draw(
    alarms: NDArray[np.float64],
    refused: NDArray[np.float64],
    curves: dict[str, NDArray[np.float64]],
    points: dict[str, float],
    sound: Examined,
    cases: dict[str, Examined],
) -> Figure:
    with style():
        figure = new_figure(180, 95, layout="constrained")
        ax, bars = figure.subplots(1, 2, width_ratios=(1.5, 1))
        ax.plot(alarms, refused, color="#bdbdbd", linewidth=0.8, label="sound wall")
        for name, (_, colour, dash) in KINDS.items():
            label = f"{name} ({100 * cases[name].wrong.mean():.0f} % wrong)"
            ax.plot(alarms, curves[name], dash, color=colour, label=label)
            ax.plot(FALSE_ALARM, points[name], "o", color=colour, markersize=4.5, clip_on=False, zorder=5)
        ax.set(xscale="log", xlim=(1e-3, 1), ylim=(0, 1.02))
        ax.set_xticks([1e-3, 1e-2, 1e-1, 1], labels=["0.001", "0.01", "0.1", "1"])
        ax.set(xlabel="false-alarm rate that is set", ylabel="share of wrong answers rejected")
        ax.set_title("(a) The check: its joint answers")
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
        shares = [float(sound.default_rejected.mean()), *(case.default_found for case in cases.values())]
        colours = ["#bdbdbd", *(colour for _, colour, _ in KINDS.values())]
        hatches = ["", *("" if dash == "-" else "////" for _, _, dash in KINDS.values())]
        labels = ["sound wall,\nall answers"]
        labels += [f"{name}\n({100 * case.default_wrong.mean():.0f} % wrong)" for name, case in cases.items()]
        drawn = bars.barh(labels, np.nan_to_num(shares), height=0.6, color=colours, hatch=hatches, edgecolor="white")
        bars.bar_label(
            drawn, [f"{100 * share:.0f} %" if np.isfinite(share) else "none wrong" for share in shares], padding=2
        )
        bars.set(xlim=(0, 1.15), xlabel="share of its wrong ones rejected")
        bars.set_xticks([0, 0.5, 1])
        bars.invert_yaxis()
        bars.set_title("(b) The default method")
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("check", make)
