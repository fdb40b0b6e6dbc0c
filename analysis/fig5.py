"""Fig. 5: detail of a view through a small and a large aperture, and their ratio, the focal disparity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.depth.ratio import fine_noise_floor, focal_disparity
from focalgradient.plotting import draw_depth, draw_distance, draw_view, new_figure, style
from focalgradient.render import cast, noisy
from focalgradient.scenes import spheres

FOCUS = 0.55  # m, in front of everything
SMALL, LARGE = (Lens(focal_length=0.025, f_number=number, focus_distance=FOCUS) for number in (32, 11))
WIDTH = 320 * 8e-6  # m, of the sensor
NOISE = 0.003  # of the mean radiance; the finite number of rays adds about 0.1 %
SEED = 5
WINDOW = 8.0  # px
FAR = 4.0  # m


def views_and_truth(
    *, shape: tuple[int, int] = (360, 480), samples: int = 384, progress: Progress | None = None
) -> tuple[list[View], View, NDArray[np.float64]]:
    """Spheres on a floor through both apertures, a second view through the small one, and the true distance (m)."""
    pixel = WIDTH / shape[1] / SMALL.sensor_distance
    scene = spheres(SEED, field=shape[1] * pixel)
    casts = []
    for lens in (SMALL, LARGE):
        casts.append(cast(scene, lens, shape, pixel, samples=samples))
        if progress is not None:
            progress(len(casts) / 2)
    noise = NOISE * float(casts[0].view.image.mean())
    views = [noisy(one.view, noise, seed) for seed, one in enumerate(casts)]
    return views, noisy(casts[0].view, noise, 2), casts[0].distance


def content(view: View) -> NDArray[np.float32]:
    """Fig. 5a, b: root mean square Laplacian over local brightness, on the grid of 4 x 4 pixels.

    The disparity against a checkerboard of known content, so that it is the very thing that the ratio is made of.
    """
    board = 1 + 0.5 * (np.indices(view.shape).sum(axis=0) % 2 - 0.5)
    ratio, _ = focal_disparity(board.astype(np.float32), np.asarray(view.image, np.float32))
    return ratio * np.float32(4 * 0.5)  # its Laplacian is 4 x its contrast about a mean of 1


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    shape = (720, 960) if full else (360, 480)
    views, again, truth = views_and_truth(shape=shape, progress=lambda share: report(0.8 * share))
    # Rays are noise too: take it from the images.
    noise = [fine_noise_floor(view.image) for view in views]
    images = [np.asarray(view.image, np.float32) for view in (*views, again)]
    disparity, told = focal_disparity(images[0], images[1], noise=noise, window=WINDOW)
    control, control_told = focal_disparity(images[0], images[2], noise=noise, window=WINDOW)
    depth = recover_depth(views, method="ratio", near=FOCUS, far=FAR, window=WINDOW)
    # The control's second view is told to be the large aperture's, which it is not.
    flat = recover_depth([views[0], replace(again, optics=LARGE)], method="ratio", near=FOCUS, far=FAR, window=WINDOW)
    scored = depth.valid & np.isfinite(truth)
    error = depth.vergence[scored] - 1 / truth[scored]
    grid = truth[2::4, 2::4][: told.shape[0], : told.shape[1]]
    return Shown(
        title="Fig. 5: the focal disparity",
        caption=(
            f"Spheres on a floor before a wall, ray cast through f/{SMALL.f_number:g} and f/{LARGE.f_number:g} with "
            f"focus at {FOCUS:g} m, in front of them all, with {100 * NOISE:g} % noise. (a, b) Normalised "
            "high-frequency content: the root mean square Laplacian over 4 × 4 pixels, divided by the local "
            f"brightness. (c) The focal disparity, b over a, gathered in a Gaussian of {WINDOW:g} pixels: bright is "
            "near focus. Black: too little detail in the sharper view. The paper’s bottle and its reflections are not "
            "in this scene.",
            "(d) The control: both views through the small aperture. The disparity is one everywhere, and the depth "
            "that it would give is that of focus: what (c) shows came out of the blur.",
            "(e) Depth from all four bands by the table of the optics, against (f) the truth. Black: refused. Detail "
            "is gathered over a window, in which the sharper of two surfaces has most of the detail: near surfaces "
            "read wider than they are, and far ones next to them nearer. Where the defocus is large an error of a few "
            "per cent of it is many of the distance.",
        ),
        figure=_draw(views, images, disparity, told, depth, truth, control, control_told),
        summary={
            "median_error_of_valid_percent": 100 * float(np.median(np.abs(depth.distance[scored] / truth[scored] - 1))),
            "median_error_of_defocus_percent": 100 * float(np.median(np.abs(error) / (1 / FOCUS - 1 / truth[scored]))),
            "valid_percent": 100 * float(depth.valid.mean()),
            "within_2_vergence_sd_percent": 100 * float(np.mean(np.abs(error) <= 2 * depth.vergence_sd[scored])),
            "disparity_told_percent": 100 * float(told.mean()),
            "rank_correlation_of_disparity_and_vergence": _rank_correlation(disparity[told], 1 / grid[told]),
            "control_disparity_median": float(np.median(control[control_told])),
            "control_disparity_10th_and_90th_percentile": np.percentile(control[control_told], [10, 90]).tolist(),
            "control_depth_median_m": float(np.median(flat.distance[flat.valid])) if flat.valid.any() else float("nan"),
        },
        plotted={
            "across_the_middle": {
                "row_of_squares": disparity.shape[0] * 3 // 4,
                "true_m": grid[disparity.shape[0] * 3 // 4],
                "disparity": disparity[disparity.shape[0] * 3 // 4],
                "control": control[disparity.shape[0] * 3 // 4],
            },
        },
    )


def _rank_correlation(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    ranks = [np.argsort(np.argsort(values)).astype(float) for values in (one, other)]
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1])


def _draw(
    views: list[View],
    images: list[NDArray[np.float32]],
    disparity: NDArray[np.float32],
    told: NDArray[np.bool_],
    depth: DepthMap,
    truth: NDArray[np.float64],
    control: NDArray[np.float32],
    control_told: NDArray[np.bool_],
) -> Figure:
    contents = [content(view) for view in views]
    top = float(np.percentile(contents[0], 99))
    limits = 1 / FAR, 1 / FOCUS
    with style():
        figure = new_figure(180, 246)
        axes = [
            [figure.add_axes((left, 0.757 - 0.248 * row, 0.385, 0.211)) for left in (0.015, 0.515)] for row in range(4)
        ]
        for ax, view in zip(axes[0], views, strict=True):
            draw_view(ax, view, f"f/{view.optics.f_number:g}")  # type: ignore[attr-defined]
        _map(axes[1][0], contents[0], "a  content of the small aperture’s view", (0, top), "content")
        _map(axes[1][1], contents[1], "b  content of the large aperture’s view", (0, top), "content")
        _map(axes[2][0], np.where(told, disparity, 0), "c  focal disparity, b / a", (0, 1), "disparity")
        _map(
            axes[2][1],
            np.where(control_told, control, 0),
            "d  control: the small aperture twice",
            (0, 1.2),
            "disparity",
        )
        draw_depth(axes[3][0], depth, limits=limits, title="e  recovered depth")
        draw_distance(axes[3][1], truth, limits=limits, title="f  true depth")
        axes[3][0].patch.set(facecolor="black", hatch="")
        figure.draw_without_rendering()
    return figure


def _map(ax: Axes, values: NDArray[np.float32], title: str, limits: tuple[float, float], label: str) -> None:
    image = ax.imshow(values, cmap="gray", vmin=limits[0], vmax=limits[1])
    ax.set(xticks=[], yticks=[])
    ax.spines[:].set(visible=True, linewidth=0.4, color="#888888")
    ax.set_title(title, loc="left")
    bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0, 0.04, 1)))
    bar.set_label(label)
    bar.ax.spines["outline"].set_linewidth(0.4)


if __name__ == "__main__":
    alone("fig5", make)
