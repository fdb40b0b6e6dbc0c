"""Depth from blur with one or two images compared with autofocus with up to thirty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone
from scene import away_from_edges

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.plotting import BLUE, GREEN, GREY, ORANGE, new_figure, style
from focalgradient.render import cast, noisy
from focalgradient.scenes import Scene, slant, spheres

FOCAL_LENGTH, F_NUMBER, SMALL = 0.025, 5.6, 16  # m; aperture of all views, and of the small-aperture one
PITCH = 8e-6  # m
SHAPE = (192, 256)
FIELD = SHAPE[1] * PITCH / FOCAL_LENGTH
NOISE = 0.01  # relative to the mean radiance, in each image
SETTINGS = 30
MARGIN = 12  # pixels around depth discontinuities that are not scored
COUNTS = (3, 5, 10, 20, 30)


@dataclass(frozen=True, slots=True)
class Place:
    """Scene, and its range of vergence (D)."""

    name: str
    scene: Scene
    far: float
    near: float


PLACES = (
    Place("A slanted plane, 0.9 to 2.2 m", slant(0.9, 2.2, FIELD), 1 / 2.2, 1 / 0.9),
    Place("Spheres before a wall, 0.6 to 3 m", spheres(5, field=FIELD), 1 / 3.0, 1 / 0.6),
)


def lens(vergence: float, f_number: float = F_NUMBER) -> Lens:
    return Lens(FOCAL_LENGTH, f_number, 1 / vergence)


def stack_lenses(place: Place, count: int = SETTINGS) -> list[Lens]:
    """Return focus settings evenly spaced in vergence, slightly beyond the scene, to bracket peaks at its ends."""
    beyond = 0.03 * (place.near - place.far)
    return [lens(vergence) for vergence in np.linspace(place.far - beyond, place.near + beyond, count).tolist()]


def pairs_of_lenses(place: Place) -> dict[str, list[Lens]]:
    """Return the lenses of the two views for depth from blur."""
    quarter = (place.near - place.far) / 4
    nearest = 1.05 * place.near  # all surfaces lie beyond focus, so that the side of focus is known
    return {
        "two foci": [lens(place.near - quarter), lens(place.far + quarter)],
        "two apertures": [lens(nearest, SMALL), lens(nearest)],
    }


def render(scene: Scene, lenses: Sequence[Lens], samples: int) -> tuple[list[View], NDArray[np.float64]]:
    """Render noise-free views, each with the magnification of its focus; return them and the first one's distances."""
    rendered = [cast(scene, one, SHAPE, PITCH / one.sensor_distance, samples=samples) for one in lenses]
    return [one.view for one in rendered], rendered[0].distance


def score(depth: DepthMap, truth: NDArray[np.float64], where: NDArray[np.bool_]) -> dict[str, float]:
    """Return errors, and coverage of the stated SD, over the valid pixels of `where`."""
    usable = depth.valid & where
    error = depth.vergence[usable] - 1 / truth[usable]
    return {
        "median_error_percent": 100 * float(np.median(np.abs(depth.distance[usable] / truth[usable] - 1))),
        "rms_error_D": float(np.sqrt(np.mean(error**2))),
        "valid_percent": 100 * float(usable.sum() / where.sum()),
        "within_2_sd_percent": 100 * float(np.mean(np.abs(error) <= 2 * depth.vergence_sd[usable])),
    }


def measure(
    place: Place, *, counts: Sequence[int] = COUNTS, samples: int = 64, seed: int = 1, progress: Progress | None = None
) -> dict[str, dict[str, list[float]]]:
    """Score autofocus with each of `counts` settings, and depth from two views.

    Smaller stacks consist of the settings of the largest stack that are closest to an even spacing.

    Returns
    -------
    dict
        Results of `score` by method, each as lists by count: ``autofocus`` (each image with the same noise), ``same
        light`` (the light of two images divided among all, so that noise grows with the root of their number), ``two
        foci``, ``two apertures``.
    """
    report = progress or (lambda share: None)

    def scored(clean: Sequence[View], truth: NDArray[np.float64], noise: float, **options: object) -> dict[str, float]:
        sd = noise * float(clean[0].image.mean())
        views = [noisy(view, sd, 1000 * seed + number) for number, view in enumerate(clean)]
        depth = recover_depth(views, **options)  # type: ignore[arg-type]
        return score(depth, truth, away_from_edges(truth, MARGIN))

    results: dict[str, list[dict[str, float]]] = {}
    views, truth = render(place.scene, stack_lenses(place, max(counts)), samples)
    report(0.6)
    for name, light in (("autofocus", 1.0), ("same light", 0.5)):
        results[name] = []
        for count in counts:
            chosen = np.rint(np.linspace(0, len(views) - 1, count)).astype(int)
            noise = NOISE * (1.0 if light == 1.0 else math.sqrt(light * count))
            results[name].append(scored([views[i] for i in chosen], truth, noise, method="autofocus"))
        report(0.75 if name == "autofocus" else 0.9)
    for name, lenses in pairs_of_lenses(place).items():
        # two apertures do not determine the side of focus, which a user knows from the set-up
        near = 1 / lenses[0].focus_vergence if name == "two apertures" else None
        views, truth = render(place.scene, lenses, samples)
        results[name] = [scored(views, truth, NOISE, near=near)]
    report(1.0)
    return {name: {key: [row[key] for row in rows] for key in rows[0]} for name, rows in results.items()}


def images_needed(counts: Sequence[int], errors: Sequence[float], goal: float) -> float:
    """Return the number of images above which the error stays below `goal`, log-interpolated; infinity if none."""
    needed = math.inf
    for few, many, before, after in reversed(list(zip(counts, counts[1:], errors, errors[1:], strict=False))):
        if after > goal:
            return needed
        if before > goal:
            share = math.log(before / goal) / math.log(before / after)
            return math.exp((1 - share) * math.log(few) + share * math.log(many))
        needed = float(few)
    return needed


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    seeds = range(1, 4) if full else range(1, 2)
    runs: list[dict[str, dict[str, NDArray[np.float64]]]] = []
    for number, place in enumerate(PLACES):
        of_seeds = []
        for seed in seeds:
            done = (number * len(seeds) + seed - 1) / len(seeds)

            def step(share: float, done: float = done) -> None:
                report((done + share / len(seeds)) / len(PLACES))

            of_seeds.append(measure(place, samples=256 if full else 64, seed=seed, progress=step))
        runs.append(
            {
                name: {key: np.mean([run[name][key] for run in of_seeds], axis=0) for key in values}
                for name, values in of_seeds[0].items()
            }
        )
    summary: dict[str, object] = {}
    needs: list[float] = []  # number of images with which autofocus is as accurate as two views
    for word, run in zip(("plane", "spheres"), runs, strict=True):
        for name, values in run.items():
            summary[f"{word}_{name.replace(' ', '_')}_median_error_percent"] = values["median_error_percent"].tolist()
        for name in ("autofocus", "same light"):
            for pair in ("two foci", "two apertures"):
                key = f"{word}_images_{name.replace(' ', '_')}_needs_to_match_{pair.replace(' ', '_')}"
                goal = float(run[pair]["median_error_percent"][0])
                summary[key] = needed = images_needed(COUNTS, run[name]["median_error_percent"].tolist(), goal)
                if name == "autofocus":
                    needs.append(needed)
    return Shown(
        title="One or two images against thirty",
        caption=(
            f"Autofocus, which takes the sharpest of a stack of focus settings at each point, with {COUNTS[0]} to "
            f"{COUNTS[-1]} settings spread over the scene, beside depth from two views at once. Ray-cast views of "
            f"{SHAPE[1]} x {SHAPE[0]} pixels through the same f/{F_NUMBER:g}, and f/{SMALL:g} for the other of two "
            "apertures; every method has the same window.",
            f"Filled: every image has {100 * NOISE:g} % noise, so that a stack of thirty takes fifteen times the light "
            "of a pair. Open: the whole stack has the light of one pair, so noise grows with the number of images.",
            "Errors are those of valid pixels away from jumps in depth; the lowest row says how many pixels those are. "
            f"Autofocus needs {min(needs):.0f} to {max(needs):.0f} settings to be as exact as two views. With more it "
            "is the most exact of all, but needs that many more images. With the light of only two images it gains "
            "nothing from more than ten.",
        ),
        figure=_draw(runs),
        summary=summary,
        plotted={
            "settings": COUNTS,
            **{place.name: run for place, run in zip(PLACES, runs, strict=True)},
        },
    )


ROWS = (
    ("median_error_percent", "median error of\ndistance (%)"),
    ("rms_error_D", "r.m.s. error of\nvergence (D)"),
    ("valid_percent", "valid (%)"),
)


def _draw(runs: Sequence[dict[str, dict[str, NDArray[np.float64]]]]) -> Figure:
    with style():
        figure = new_figure(180, 150, layout="constrained")
        panels = figure.subplots(3, 2, sharex=True, sharey="row", gridspec_kw={"height_ratios": (3, 3, 2)})
        for column, (place, run) in enumerate(zip(PLACES, runs, strict=True)):
            panels[0, column].set_title(place.name)
            for ax, (key, label) in zip(panels[:, column], ROWS, strict=True):
                for name, colour, marker in (("two foci", ORANGE, "s"), ("two apertures", GREEN, "D")):
                    value = float(run[name][key][0])
                    ax.axhline(value, color=colour, linewidth=0.8, linestyle=(0, (4, 3)))
                    ax.plot(2, value, marker, color=colour, markersize=5.5, label=f"two images: {name}")
                ax.plot(COUNTS, run["autofocus"][key], "o-", color=BLUE, label="autofocus, 1 % noise each")
                shared = "autofocus, the light of two images"
                ax.plot(COUNTS, run["same light"][key], "o--", color=BLUE, fillstyle="none", linewidth=1, label=shared)
                ax.set(xscale="log", yscale="linear" if key == "valid_percent" else "log")
                if column == 0:
                    ax.set_ylabel(label)
            panels[2, column].set(xlabel="number of images", ylim=(0, 105))
            panels[2, column].set_xticks([2, *COUNTS], labels=[str(count) for count in (2, *COUNTS)])
            panels[2, column].minorticks_off()
        for ax in panels[:2].flat:
            ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        panels[0, 0].legend(loc="upper right")
        panels[2, 0].text(0.98, 0.08, "simulated views", transform=panels[2, 0].transAxes, ha="right", color=GREY)
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("autofocus", make)
