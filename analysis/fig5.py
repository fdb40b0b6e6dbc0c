"""Fig. 5: detail of a view through a small and a large aperture, and their ratio, the focal disparity."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import DepthMap, FocalGradientWarning, Lens, View, recover_depth
from focalgradient.depth.noise import noise_floor
from focalgradient.depth.ratio import focal_disparity
from focalgradient.plotting import BLUE, GREY, ORANGE, draw_distance, draw_uncertainty, draw_view, new_figure, style
from focalgradient.render import Rendered, noisy, render, render_series
from focalgradient.scenes import bottle
from focalgradient.scenes.bottle import BODY_RADIUS

SEED = 2
FOCUS = 1 - BODY_RADIUS  # m, the front of the bottle
SMALL, LARGE = (Lens(focal_length=0.05, f_number=number, focus_distance=FOCUS) for number in (22, 5.6))
FIELD = 0.34  # height of the frame, a tangent
NOISE = 0.003  # relative to the mean radiance, in addition to that of the rays
WINDOW = 8.0  # px
FAR = 4.0  # m
MIRRORED = 0.02  # minimum distance (D) of the source behind the surface that counts as a reflection


def views_and_truth(
    *, shape: tuple[int, int] = (400, 300), samples: int = 128, progress: Progress | None = None
) -> tuple[list[View], View, Rendered]:
    """Render the bottle through both apertures, and again through the small one; return views and the first's truth."""
    report = progress or (lambda share: None)
    pixel = FIELD / shape[0]
    scene = bottle(SEED)
    pair = render_series(
        *(scene, [SMALL, LARGE], shape, pixel),
        engine="shaded",
        samples=samples,
        progress=lambda share, what: report(0.67 * share),
    )
    again = render(scene, SMALL, shape, pixel, engine="shaded", samples=samples, seed=1)
    report(1.0)
    noise = NOISE * float(pair[0].view.image.mean())
    views = [noisy(one.view, noise, seed) for seed, one in enumerate(pair)]
    return views, noisy(again.view, noise, 2), pair[0]


def content(view: View) -> NDArray[np.float32]:
    """Return Fig. 5a, b: root mean square Laplacian divided by local brightness, on the grid of 4 x 4 pixels.

    It is computed as the disparity relative to a checkerboard of known content, and is thus the quantity in the ratio.
    """
    board = 1 + 0.5 * (np.indices(view.shape).sum(axis=0) % 2 - 0.5)
    ratio, _ = focal_disparity(board.astype(np.float32), np.asarray(view.image, np.float32))
    return ratio * np.float32(4 * 0.5)  # the Laplacian of the checkerboard is 4 x its contrast, with mean 1


@dataclass(frozen=True)
class Read:
    """Depth from both views, with masks of reflections and of directly visible surfaces."""

    depth: DepthMap
    mirrored: NDArray[np.bool_]
    direct: NDArray[np.bool_]
    error: NDArray[np.float64]  # D

    @classmethod
    def of(cls, depth: DepthMap, seen: NDArray[np.float64], surface: NDArray[np.float64]) -> Read:
        """Classify pixels by the vergence (D) of the light's source via the mirror, `seen`, and of the `surface`."""
        scored = depth.valid & np.isfinite(seen)
        behind = np.where(scored, surface - seen, 0)
        return cls(depth, behind > MIRRORED, scored & (np.abs(behind) < 1e-3), depth.vergence - seen)

    def scores(self, seen: NDArray[np.float64], surface: NDArray[np.float64]) -> dict[str, float]:
        """Return medians in dioptres, and percentages."""
        at, vergence = self.mirrored, self.depth.vergence
        within = np.abs(self.error) < 2 * self.depth.vergence_sd
        return {
            "surface_where_a_reflection_is_read_D": float(np.median(surface[at])),
            "reflection_traced_D": float(np.median(seen[at])),
            "reflection_read_D": float(np.median(vergence[at])),
            "reflections_read_behind_their_surface_percent": 100 * float(np.mean(vergence[at] < surface[at])),
            "median_error_of_reflections_D": float(np.median(np.abs(self.error[at]))),
            "median_error_of_the_rest_D": float(np.median(np.abs(self.error[self.direct]))),
            "reflections_within_2_sd_percent": 100 * float(within[at].mean()),
            "rest_within_2_sd_percent": 100 * float(within[self.direct].mean()),
            "valid_percent": 100 * float(self.depth.valid.mean()),
        }


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    shape = (800, 600) if full else (400, 300)
    views, again, truth = views_and_truth(shape=shape, progress=lambda share: report(0.85 * share))
    assert truth.vergence is not None
    # blur indicates the source of the light: for a curved mirror, the mean of two meridians
    seen = (truth.vergence[..., 0, 0] + truth.vergence[..., 1, 1]) / 2
    surface = 1 / truth.distance
    # the rays are a source of noise: estimate it from the images
    noise = [noise_floor(view.image) for view in views]
    images = [np.asarray(view.image, np.float32) for view in (*views, again)]
    disparity, valid = focal_disparity(images[0], images[1], noise=noise, window=WINDOW)
    control, control_valid = focal_disparity(images[0], images[2], noise=noise, window=WINDOW)
    depth = recover_depth(views, method="ratio", near=FOCUS, far=FAR, window=WINDOW)
    # control: the second view is stated to be that of the large aperture, which is wrong
    flat = recover_depth([views[0], replace(again, optics=LARGE)], method="ratio", near=FOCUS, far=FAR, window=WINDOW)
    report(0.9)
    ratio = Read.of(depth, seen, surface)
    with warnings.catch_warnings():  # the mirror image has no single distance, which the caption states
        warnings.simplefilter("ignore", FocalGradientWarning)
        default = Read.of(recover_depth(views, near=FOCUS, far=FAR), seen, surface)
    differ = float(default.depth.details["split_band"]["tau"])
    on, better = ratio.scores(seen, surface), default.scores(seen, surface)
    grid = seen[2::4, 2::4][: valid.shape[0], : valid.shape[1]]
    known = valid & np.isfinite(grid)
    return Shown(
        title="Fig. 5: the focal disparity",
        caption=_caption(on, better, differ),
        figure=_draw(views, (disparity, valid), (control, control_valid), ratio, default, seen),
        summary={
            **on,
            "disparity_valid_percent": 100 * float(valid.mean()),
            "rank_correlation_of_disparity_and_vergence": _rank_correlation(disparity[known], grid[known]),
            "control_disparity_median": float(np.median(control[control_valid])),
            "control_disparity_10th_and_90th_percentile": np.percentile(control[control_valid], [10, 90]).tolist(),
            "control_depth_median_m": float(np.median(flat.distance[flat.valid])) if flat.valid.any() else float("nan"),
            **{f"default_method_{name}": value for name, value in better.items()},
            "default_method_coarse_and_fine_detail_differ_percent_of_blur": 100 * differ,
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


def _caption(on: dict[str, float], better: dict[str, float], differ: float) -> tuple[str, ...]:
    return (
        f"The mirrored bottle on a checkered plane, rendered through f/{SMALL.f_number:g} and f/{LARGE.f_number:g} "
        f"with focus on the bottle's front, at {FOCUS:.3g} m, with {100 * NOISE:g} % noise. (a, b) Normalised "
        "high-frequency content: the root mean square Laplacian over 4 × 4 pixels, divided by the local "
        f"brightness. (c) The focal disparity, b over a, gathered in a Gaussian of {WINDOW:g} pixels: bright is "
        "near focus. Black: too little detail in the sharper view.",
        "The reflections in the bottle are estimated to lie farther than the surface. Where a reflection is "
        f"estimated, the surface lies at {on['surface_where_a_reflection_is_read_D']:.3g} D, the reflected thing at "
        f"{on['reflection_traced_D']:.3g} D by traced rays, and its estimate is {on['reflection_read_D']:.3g} D "
        "(medians).",
        "(d) The control: both views through the small aperture, with different rays. The disparity is about one, "
        "and the depth that it would give is that of focus. So (c) shows the effect of blur.",
        "(e) Depth from all four bands of the ratio by the table of the optics, against (f) the distance of what a "
        "ray meets, through the mirror. Rejected pixels are hatched. Detail is gathered over a window, in "
        "which the sharper of two surfaces has most of the detail. So near surfaces come out wider than they are.",
        "(g) Depth from the same two views by the default method, which equalises their blur, and (h) its stated "
        f"standard deviation: {better['valid_percent']:.0f} % of the pixels are valid (by the ratio "
        f"{on['valid_percent']:.0f} %), the median error outside the mirror is "
        f"{better['median_error_of_the_rest_D']:.3f} D ({on['median_error_of_the_rest_D']:.3f} D), and "
        f"{better['rest_within_2_sd_percent']:.0f} % of it lies within two standard deviations. (i) Estimated "
        f"against traced: {better['reflections_read_behind_their_surface_percent']:.0f} % of the reflections come out "
        f"behind their surface, but only {better['reflections_within_2_sd_percent']:.0f} % of them within two standard "
        "deviations. A curved mirror has two image distances, one for each meridian, and they change within a window. "
        f"The method warns of this: depth from coarse and from fine detail differ by {differ:.0%} of the blur. The "
        "checkered plane is rejected: its detail is so strong that the residual exceeds the noise.",
    )


DISPARITIES = (0.0, 1.1)
"""Common colour scale of the disparity and its control: 1 means unchanged blur; noise slightly exceeds it."""


def _rank_correlation(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    ranks = [np.argsort(np.argsort(values)).astype(float) for values in (one, other)]
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1])


def _draw(
    views: list[View],
    disparity: tuple[NDArray[np.float32], NDArray[np.bool_]],
    control: tuple[NDArray[np.float32], NDArray[np.bool_]],
    ratio: Read,
    default: Read,
    seen: NDArray[np.float64],
) -> Figure:
    contents = [content(view) for view in views]
    top = float(np.percentile(contents[0], 99))
    limits = 1 / FAR, 1 / FOCUS
    with style():
        figure = new_figure(180, 157)
        axes = [
            [figure.add_axes(((2 + 45 * column) / 180, y / 157, 27.5 / 180, 36.7 / 157)) for column in range(4)]
            for y in (110, 57)
        ]
        last = [figure.add_axes(((2 + 45 * column) / 180, 4 / 157, 27.5 / 180, 36.7 / 157)) for column in range(2)]
        for ax, view in zip(axes[0], views, strict=False):
            draw_view(ax, view, f"f/{view.optics.f_number:g}")  # type: ignore[attr-defined]
        _map(axes[0][2], contents[0], "(a) content,\nf/22", (0, top))
        _map(axes[0][3], contents[1], "(b) content,\nf/5.6", (0, top))
        _map(axes[1][0], np.where(disparity[1], disparity[0], 0), "(c) disparity,\nb / a", DISPARITIES)
        _map(axes[1][1], np.where(control[1], control[0], 0), "(d) control,\nf/22 twice", DISPARITIES)
        traced = np.clip(1 / np.where(seen > 0, seen, np.nan), FOCUS, FAR)
        draw_distance(axes[1][2], _distance(ratio), limits=limits, title="(e) depth by\nthe ratio")
        draw_distance(axes[1][3], traced, limits=limits, title="(f) true depth,\nmirrored too")
        draw_distance(last[0], _distance(default), limits=limits, title="(g) depth by the\ndefault method")
        draw_uncertainty(last[1], default.depth, "(h) its standard\ndeviation")
        _scatter(figure.add_axes((112 / 180, 12 / 157, 64 / 180, 28 / 157)), default, seen)
        figure.draw_without_rendering()
    return figure


def _distance(read: Read) -> NDArray[np.float64]:
    return np.where(read.depth.valid, read.depth.distance, np.nan)


def _scatter(ax: Axes, read: Read, seen: NDArray[np.float64]) -> None:
    """Draw estimated against traced vergence for every 25th pixel."""
    ax.plot([1 / FAR, 1 / FOCUS], [1 / FAR, 1 / FOCUS], color=GREY, linewidth=0.6, zorder=3)
    low, high, beyond = 0.2, 1.1, 0
    for chosen, colour, name in ((read.direct, BLUE, "seen directly"), (read.mirrored, ORANGE, "reflections")):
        some = np.flatnonzero(chosen)[::25]
        points = np.array([seen.flat[some], read.depth.vergence.flat[some]])
        shown = ((points >= low) & (points <= high)).all(axis=0)
        beyond += int((~shown).sum())
        ax.plot(*points[:, shown], ".", color=colour, markersize=2, label=name)
    ax.set(xlim=(low, high), ylim=(low, high), xlabel="traced (D)", ylabel="estimated (D)")
    ax.text(0.98, 0.04, f"{beyond} points lie beyond", transform=ax.transAxes, ha="right", color=GREY)
    ax.set_title("(i) default method against traced", loc="left", pad=17)
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0, ncols=2, handlelength=1, markerscale=3)


def _map(ax: Axes, values: NDArray[np.float32], title: str, limits: tuple[float, float]) -> None:
    image = ax.imshow(values, cmap="gray", vmin=limits[0], vmax=limits[1])
    ax.set(xticks=[], yticks=[])
    ax.spines[:].set(visible=True, linewidth=0.4, color="#888888")
    ax.set_title(title, loc="left")
    bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0, 0.04, 1)))
    bar.ax.spines["outline"].set_linewidth(0.4)


if __name__ == "__main__":
    alone("fig5", make)
