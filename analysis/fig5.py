"""Fig. 5: detail of a view through a small and a large aperture, and their ratio, the focal disparity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.depth.noise import noise_floor
from focalgradient.depth.ratio import focal_disparity
from focalgradient.plotting import draw_distance, draw_view, new_figure, style
from focalgradient.render import Rendered, noisy, render, render_series
from focalgradient.scenes import bottle
from focalgradient.scenes.bottle import BODY_RADIUS

SEED = 2
FOCUS = 1 - BODY_RADIUS  # m, the front of the bottle
SMALL, LARGE = (Lens(focal_length=0.05, f_number=number, focus_distance=FOCUS) for number in (22, 5.6))
FIELD = 0.34  # height of the frame, a tangent
NOISE = 0.003  # of the mean radiance, beside that of the rays
WINDOW = 8.0  # px
FAR = 4.0  # m
MIRRORED = 0.02  # D by which what is seen lies behind the surface, where it is a reflection


def views_and_truth(
    *, shape: tuple[int, int] = (400, 300), samples: int = 128, progress: Progress | None = None
) -> tuple[list[View], View, Rendered]:
    """The bottle through both apertures, a second view through the small one, and the truth (in the first of all)."""
    report = progress or (lambda share: None)
    pixel = FIELD / shape[0]
    scene = bottle(SEED)
    pair = render_series(
        *(scene, [SMALL, LARGE], shape, pixel),
        engine="shaded",
        samples=samples,
        progress=lambda share: report(0.67 * share),
    )
    again = render(scene, SMALL, shape, pixel, engine="shaded", samples=samples, seed=1)
    report(1.0)
    noise = NOISE * float(pair[0].view.image.mean())
    views = [noisy(one.view, noise, seed) for seed, one in enumerate(pair)]
    return views, noisy(again.view, noise, 2), pair[0]


def content(view: View) -> NDArray[np.float32]:
    """Fig. 5a, b: root mean square Laplacian over local brightness, on the grid of 4 x 4 pixels.

    The disparity against a checkerboard of known content, so that it is the very thing that the ratio is made of.
    """
    board = 1 + 0.5 * (np.indices(view.shape).sum(axis=0) % 2 - 0.5)
    ratio, _ = focal_disparity(board.astype(np.float32), np.asarray(view.image, np.float32))
    return ratio * np.float32(4 * 0.5)  # its Laplacian is 4 x its contrast about a mean of 1


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    shape = (800, 600) if full else (400, 300)
    views, again, truth = views_and_truth(shape=shape, progress=lambda share: report(0.9 * share))
    assert truth.vergence is not None
    # What a blur tells is where the light comes from: of a curved mirror, by two meridians, the mean.
    seen = (truth.vergence[..., 0, 0] + truth.vergence[..., 1, 1]) / 2
    surface = 1 / truth.distance
    # Rays are noise too: take it from the images.
    noise = [noise_floor(view.image) for view in views]
    images = [np.asarray(view.image, np.float32) for view in (*views, again)]
    disparity, valid = focal_disparity(images[0], images[1], noise=noise, window=WINDOW)
    control, control_valid = focal_disparity(images[0], images[2], noise=noise, window=WINDOW)
    depth = recover_depth(views, method="ratio", near=FOCUS, far=FAR, window=WINDOW)
    # The control's second view is told to be the large aperture's, which it is not.
    flat = recover_depth([views[0], replace(again, optics=LARGE)], method="ratio", near=FOCUS, far=FAR, window=WINDOW)
    scored = depth.valid & np.isfinite(seen)
    mirrored = scored & (surface - seen > MIRRORED)
    direct = scored & (np.abs(surface - seen) < 1e-3)
    error = depth.vergence - seen
    grid = seen[2::4, 2::4][: valid.shape[0], : valid.shape[1]]
    known = valid & np.isfinite(grid)
    return Shown(
        title="Fig. 5: the focal disparity",
        caption=(
            f"The mirrored bottle on a checkered plane, rendered through f/{SMALL.f_number:g} and f/{LARGE.f_number:g} "
            f"with focus on the bottle's front, at {FOCUS:.3g} m, with {100 * NOISE:g} % noise. (a, b) Normalised "
            "high-frequency content: the root mean square Laplacian over 4 × 4 pixels, divided by the local "
            f"brightness. (c) The focal disparity, b over a, gathered in a Gaussian of {WINDOW:g} pixels: bright is "
            "near focus. Black: too little detail in the sharper view.",
            "The reflections in the bottle read farther than the surface that they are seen in: where a reflection is "
            f"read, the surface lies at {np.median(surface[mirrored]):.3g} D, traced rays put what is seen in it at "
            f"{np.median(seen[mirrored]):.3g} D, and the blur says {np.median(depth.vergence[mirrored]):.3g} D "
            "(medians).",
            "(d) The control: both views through the small aperture, with different rays. The disparity is about one, "
            "and the depth that it would give is that of focus: what (c) shows came out of the blur.",
            "(e) Depth from all four bands by the table of the optics, against (f) the distance of what is seen, "
            "through the mirror, by traced rays. Refused: hatched. Detail is gathered over a window, in which the "
            "sharper of two surfaces has most of the detail: near surfaces read wider than they are.",
        ),
        figure=_draw(views, disparity, valid, depth, 1 / np.where(seen > 0, seen, np.nan), control, control_valid),
        summary={
            "surface_where_a_reflection_is_read_D": float(np.median(surface[mirrored])),
            "reflection_traced_D": float(np.median(seen[mirrored])),
            "reflection_read_D": float(np.median(depth.vergence[mirrored])),
            "reflections_read_behind_their_surface_percent": 100
            * float(np.mean(depth.vergence[mirrored] < surface[mirrored])),
            "median_error_of_reflections_D": float(np.median(np.abs(error[mirrored]))),
            "median_error_of_the_rest_D": float(np.median(np.abs(error[direct]))),
            "valid_percent": 100 * float(depth.valid.mean()),
            "disparity_told_percent": 100 * float(valid.mean()),
            "rank_correlation_of_disparity_and_vergence": _rank_correlation(disparity[known], grid[known]),
            "control_disparity_median": float(np.median(control[control_valid])),
            "control_disparity_10th_and_90th_percentile": np.percentile(control[control_valid], [10, 90]).tolist(),
            "control_depth_median_m": float(np.median(flat.distance[flat.valid])) if flat.valid.any() else float("nan"),
        },
        plotted={
            "down_the_middle": {
                "column_of_squares": disparity.shape[1] // 2,
                "traced_D": grid[:, disparity.shape[1] // 2],
                "disparity": disparity[:, disparity.shape[1] // 2],
                "control": control[:, disparity.shape[1] // 2],
            },
        },
    )


DISPARITIES = (0.0, 1.1)
"""One scale for the disparity and its control: 1 is no change of blur, and noise goes a little beyond."""


def _rank_correlation(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    ranks = [np.argsort(np.argsort(values)).astype(float) for values in (one, other)]
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1])


def _draw(
    views: list[View],
    disparity: NDArray[np.float32],
    valid: NDArray[np.bool_],
    depth: DepthMap,
    truth: NDArray[np.float64],
    control: NDArray[np.float32],
    control_valid: NDArray[np.bool_],
) -> Figure:
    contents = [content(view) for view in views]
    top = float(np.percentile(contents[0], 99))
    limits = 1 / FAR, 1 / FOCUS
    with style():
        figure = new_figure(180, 104)
        axes = [
            [figure.add_axes(((2 + 45 * column) / 180, y / 104, 27.5 / 180, 36.7 / 104)) for column in range(4)]
            for y in (57, 4)
        ]
        for ax, view in zip(axes[0], views, strict=False):
            draw_view(ax, view, f"f/{view.optics.f_number:g}")  # type: ignore[attr-defined]
        _map(axes[0][2], contents[0], "(a) content,\nf/22", (0, top))
        _map(axes[0][3], contents[1], "(b) content,\nf/5.6", (0, top))
        _map(axes[1][0], np.where(valid, disparity, 0), "(c) disparity,\nb / a", DISPARITIES)
        _map(axes[1][1], np.where(control_valid, control, 0), "(d) control,\nf/22 twice", DISPARITIES)
        found = np.where(depth.valid, depth.distance, np.nan)
        draw_distance(axes[1][2], found, limits=limits, title="(e) recovered\ndepth")
        draw_distance(axes[1][3], np.clip(truth, FOCUS, FAR), limits=limits, title="(f) true depth,\nmirrored too")
        figure.draw_without_rendering()
    return figure


def _map(ax: Axes, values: NDArray[np.float32], title: str, limits: tuple[float, float]) -> None:
    image = ax.imshow(values, cmap="gray", vmin=limits[0], vmax=limits[1])
    ax.set(xticks=[], yticks=[])
    ax.spines[:].set(visible=True, linewidth=0.4, color="#888888")
    ax.set_title(title, loc="left")
    bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0, 0.04, 1)))
    bar.ax.spines["outline"].set_linewidth(0.4)


if __name__ == "__main__":
    alone("fig5", make)
