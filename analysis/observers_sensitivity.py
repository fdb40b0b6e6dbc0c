"""Sensitivity of the simulated observers' results: other rules, and every constant over its range."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from report import Progress, Shown, alone
from simulated import natural_pictures

from focalgradient.observers import OBSERVERS, EncodedStimulus, Observer, encoded_stimuli, relief
from focalgradient.parallel import processes
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

__all__ = ["CONSTANTS", "RULES", "Row", "make", "rows"]

APERTURES = ("pinhole", "f/22", "f/11", "f/5.6")
FIXATIONS = ("nearest", "farthest")
TIMES = 3  # number of simulated fixations per picture, over which errors are averaged

Encoded = Mapping[tuple[str, str, str], EncodedStimulus]

RULES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("as shipped", {}),
    ("trust: all blur counts if its order agrees", {"sign": "trust"}),
    ("sign from layout: blur gives the amount only", {"sign": "layout"}),
    ("no discounting", {"discounting": 0.0}),
    ("no prior (blur-blind)", {"prior": 0.0}),
    ("opposite prior", {"prior": -0.8}),
    ("layout leaves nothing open", {"layout_error": 0.0, "layout_noise": 0.0}),
    ("layout by height in the picture", {}),
)

CONSTANTS: tuple[tuple[str, float, float, str], ...] = (
    ("weber", 0.28, 0.56, "Mather & Smith 2002"),
    ("pupil", 0.002, 0.008, "Watson & Yellott 2012"),
    ("intrinsic", 0.25, 1.0, "half to double; ours"),
    ("flatness", 0.085, 0.34, "half to double; ours"),
    ("layout_spread", 0.4, 1.6, "half to double; ours"),
    ("layout_gain", 0.5, 2.0, "half to double; ours"),
    ("layout_noise", 0.0, 0.5, "ours"),
    ("layout_error", 0.05, 0.2, "half to double; ours"),
    ("defocus", 0.7, 1.0, "ours"),
    ("prior", 0.4, 1.0, "ours"),
    ("discounting", 0.7, 1.0, "ours"),
)


@dataclass(frozen=True, slots=True)
class Row:
    """Effect of the aperture on one observer's perceived depth, as ratios: geometric means over scenes.

    `smallest_step` is the smallest ratio between successive apertures with the nearest object in focus.
    """

    name: str
    source: str
    near: float
    far: float
    smallest_step: float


def by_height(stimulus: EncodedStimulus) -> EncodedStimulus:
    """Replace the layout by height in the picture (higher is farther) with unchanged amplitude."""
    columns = round(np.sqrt(stimulus.depth.size))  # pictures are square
    height = -(np.arange(stimulus.depth.size) // columns).astype(float)
    return replace(stimulus, depth=(height - height.mean()) / height.std() * stimulus.depth.std())


def rises(encoded: Encoded, observer: Observer) -> tuple[float, float, float]:
    """Return near and far effect at the largest aperture, and the smallest step between apertures with near focus."""
    scenes = sorted({scene for scene, _, _ in encoded})
    logs = np.log(
        [
            [
                [
                    [relief(encoded[scene, f, end], observer, np.random.default_rng(n)) for n in range(TIMES)]
                    for f in APERTURES
                ]
                for scene in scenes
            ]
            for end in FIXATIONS
        ]
    ).mean(axis=(1, 3))
    near, far = np.exp(logs[:, -1] - logs[:, 0])
    return float(near), float(far), float(np.exp(np.diff(logs[0]).min()))


def rows(encoded: Encoded) -> tuple[list[Row], list[Row]]:
    """Return one row per rule, and two per constant: with its smallest and its largest value."""
    default = OBSERVERS["default"]
    rules = []
    for name, other in RULES:
        seen = {key: by_height(one) for key, one in encoded.items()} if "height" in name else encoded
        rules.append(Row(name, "", *rises(seen, replace(default, **other))))
    constants = []
    for name, least, most, source in CONSTANTS:
        for value in (least, most):
            label = f"pupil {1e3 * value:g} mm" if name == "pupil" else f"{name.replace('_', ' ')} {value:g}"
            change: dict[str, Any] = {name: value}
            constants.append(Row(label, source, *rises(encoded, replace(default, **change))))
    return rules, constants


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    pictures = natural_pictures(lambda share, what: report(0.4 * share), full=full)
    with processes(os.cpu_count() or 1) as pool:
        found = encoded_stimuli(pictures, pool, lambda share, what: report(0.4 + 0.3 * share))
    rules, constants = rows({key: stimulus for key, (_, stimulus) in found.items()})
    steps = min(row.smallest_step for row in constants)
    return Shown(
        title="On what the simulated observers’ result hangs",
        caption=(
            "Depth at f/5.6 over the pinhole’s, with the nearest (blue) and the farthest object in focus (orange), "
            f"geometric mean over {len(pictures.scenes)} scenes; simulated observers without the noise of answers. "
            "Left: the default observer under other rules. Right: with each constant at the ends of its range.",
            "The rise with the nearest object in focus needs a prior by which blurred is farther. That there is none "
            "with the farthest in focus depends on two assumptions: the layout does not reverse the sign that the "
            "prior gives blur (else depth rises there, too), and blur that contradicts the layout is discounted (else "
            "it falls). No constant within its range makes it rise; the size of the rise with "
            "the nearest in focus depends on most of them.",
        ),
        figure=_draw(rules, constants),
        summary={"smallest_step_with_the_nearest_in_focus_over_all_constants": steps}
        | {f"{row.name}, {end}": getattr(row, end) for row in rules for end in ("near", "far")},
        plotted={
            kind: {
                "name": [row.name for row in each],
                "source": [row.source for row in each],
                "near": [row.near for row in each],
                "far": [row.far for row in each],
                "smallest_step": [row.smallest_step for row in each],
            }
            for kind, each in (("rules", rules), ("constants", constants))
        },
    )


def _draw(rules: list[Row], constants: list[Row]) -> Figure:
    with style():
        figure = new_figure(180, 92, layout="constrained")
        left, right = figure.subplots(1, 2)
        most = 1.08 * max(row.near for row in [*rules, *constants])
        for ax, each, title in ((left, rules, "Rules"), (right, constants, "Constants")):
            ax.axvline(1, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)))
            for place, row in enumerate(each):
                ax.plot([row.far, row.near], [place, place], color=GREY, linewidth=0.6, zorder=1)
            ax.plot(
                [row.near for row in each], range(len(each)), "o", color=BLUE, markersize=4, label="nearest in focus"
            )
            ax.plot(
                *([row.far for row in each], range(len(each)), "o"),
                color=ORANGE,
                fillstyle="none",
                markersize=4,
                label="farthest in focus",
            )
            ax.set(yticks=range(len(each)), xscale="log", xlim=(0.55, max(most, 2.0)), ylim=(len(each) - 0.5, -0.7))
            ax.set_yticklabels([row.name.replace(": ", ":\n") for row in each])
            ax.set_xticks([0.6, 0.8, 1, 1.5, 2], ["0.6", "0.8", "1", "1.5", "2"])
            ax.minorticks_off()
            ax.set_xlabel("Depth, f/5.6 over pinhole")
            ax.set_title(title)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=7)
        right.set_title("simulated observers", loc="right", color=GREY)
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("observers_sensitivity", make)
