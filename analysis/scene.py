"""Rendered scene: views, true depth, recovered depth, and error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.plotting import depth_figure
from focalgradient.render import cast, noisy
from focalgradient.scenes import spheres

LENSES = tuple(Lens(0.025, 8, focus_distance=distance, field_tolerance=0) for distance in (0.8, 1.6))
WIDTH = 320 * 8e-6  # m, of the sensor
NOISE = 0.01  # relative to the mean radiance
SEED = 5
EDGE = 0.0375  # relative to the width: 18 of 480 pixels, about two windows


def views_and_truth(
    *, shape: tuple[int, int] = (360, 480), samples: int = 64, progress: Progress | None = None
) -> tuple[list[View], NDArray[np.float64]]:
    """Render spheres on a floor before a wall at both focus settings; return views and true distance in metres (H x W).

    Focusing moves the lens, so that the views differ slightly in magnification, as with a camera; the truth refers to
    the pixels of the first view.
    """
    scene = spheres(SEED)
    rendered = []
    for lens in LENSES:
        rendered.append(cast(scene, lens, shape, WIDTH / shape[1] / lens.sensor_distance, samples=samples))
        if progress is not None:
            progress(len(rendered) / len(LENSES))
    noise = NOISE * float(rendered[0].view.image.mean())
    return [noisy(r.view, noise, seed) for seed, r in enumerate(rendered)], rendered[0].distance


def away_from_edges(truth: NDArray[np.float64], pixels: int) -> NDArray[np.bool_]:
    """Return a mask where the true distance (H x W) varies by less than a tenth within `pixels`."""
    from scipy.ndimage import maximum_filter, minimum_filter

    size = 2 * pixels + 1
    near: NDArray[np.bool_] = maximum_filter(truth, size) < 1.1 * minimum_filter(truth, size)
    return near


def score(depth: DepthMap, truth: NDArray[np.float64], where: NDArray[np.bool_]) -> dict[str, float]:
    """Return errors of distance in percent, and coverage, over the valid pixels of `where`."""
    usable = depth.valid & where
    percent = 100 * (depth.distance[usable] / truth[usable] - 1)
    within = np.abs(depth.vergence[usable] - 1 / truth[usable]) <= 2 * depth.vergence_sd[usable]
    return {
        "valid_percent": 100 * float(usable.sum() / where.sum()),
        "median_size_of_error_percent": float(np.median(np.abs(percent))),
        "90th_percentile_of_error_percent": float(np.percentile(np.abs(percent), 90)),
        "bias_percent": float(np.median(percent)),
        "within_2_vergence_sd_percent": 100 * float(within.mean()),
    }


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    shape, samples = (720, 960) if full else (360, 480), 256
    views, truth = views_and_truth(shape=shape, samples=samples, progress=lambda share: report(0.6 * share))
    depth = recover_depth(views)
    margin = round(EDGE * shape[1])
    everywhere = score(depth, truth, np.isfinite(truth))
    inside = score(depth, truth, away_from_edges(truth, margin))
    return Shown(
        title="A rendered scene",
        caption=(
            "Six spheres on a floor before a wall, 0.6 to 3 m away, ray cast through an f/8 lens focused at 0.8 and "
            f"at 1.6 m, with {100 * NOISE:g} % noise; depth recovered from these two views alone. Their difference in "
            "focus gives on which side of focus every surface lies.",
            "Hatched: rejected. At the outline of a near surface the window of comparison holds two depths, and the "
            "near surface’s blur covers the far one. Each surface is continued up to the outline where either is "
            "known beside it; about small jumps, and where outlines lie close together, distances are less certain.",
            f"The table scores all valid pixels, and those at least {margin} pixels from a jump in depth.",
        ),
        figure=depth_figure(views, depth, truth=truth),
        summary={
            **{f"all_{name}": value for name, value in everywhere.items()},
            **{f"away_from_jumps_{name}": value for name, value in inside.items()},
        },
        plotted={
            "across_the_middle": {
                "row": shape[0] // 2,
                "true_m": truth[shape[0] // 2],
                "recovered_m": depth.distance[shape[0] // 2],
                "sd_m": depth.distance_sd[shape[0] // 2],
                "valid": depth.valid[shape[0] // 2],
            },
        },
    )


if __name__ == "__main__":
    alone("scene", make)
