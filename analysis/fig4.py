"""Fig. 4: the sharp edges of an indoor scene, sorted by depth from their blur in a single view."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone
from scipy.ndimage import minimum_filter

from focalgradient import Lens, View
from focalgradient.depth.edges.measure import Edges, average_segments, measure_edges
from focalgradient.plotting import BLUE, GREY, ORANGE, draw_distance, draw_view, new_figure, style
from focalgradient.render import render
from focalgradient.scenes import room

LENS = Lens(focal_length=0.05, f_number=5.6, focus_distance=0.75)
FIELD = 0.45  # width of the frame, a tangent
SEED = 1
LEVELS = 8  # grey levels of 256 that the lowest three bits span
LENGTH = 16.0  # px, of the band from which a point is estimated
BOUNDS = (1.8, 3.6)  # m, between small and medium and between medium and large depth: in the scene's two gaps
CLASSES = ("small", "medium", "large")


def noisy_bits(view: View, seed: int) -> View:
    """The view in 8 bits, white at 255, the lowest three of them noise: uniform over 8 levels, sd 2.3 of 255."""
    levels = 250 * view.image / view.image.max()
    noise = LEVELS * (np.random.default_rng(seed).random(view.shape) - 0.5)
    return replace(view, image=(np.clip(np.rint(levels + noise), 0, 255) / 255).astype(np.float32))


@dataclass(frozen=True)
class Sorted:
    """Segments of a view: their points, and by segment the estimate and the truth."""

    view: View
    truth: NDArray[np.float64]
    points: Edges
    whole: Edges
    segment: NDArray[np.intp]  # numbers of the good segments
    recovered: NDArray[np.float64]  # vergence, D
    sd: NDArray[np.float64]
    true: NDArray[np.float64]

    @classmethod
    def of(cls, lens: Lens, shape: tuple[int, int], samples: int, seed: int = 1) -> Sorted:
        """Render the room through `lens`, and analyse its edges as if it were `LENS`, everything beyond its focus."""
        pixel = FIELD / shape[1]
        rendered = render(room(SEED), lens, shape, pixel, engine="shaded", samples=samples, seed=seed)
        view = noisy_bits(rendered.view, seed)
        points = measure_edges(view.image, psf="disc", length=LENGTH)
        whole = average_segments(points, LENGTH)
        # An edge belongs to the nearer of the surfaces that meet there, and blur displaces it a little.
        nearest = minimum_filter(rendered.distance, 15)
        true = 1 / nearest[np.rint(whole.row).astype(int), np.rint(whole.column).astype(int)]
        dioptres = 2 * pixel / LENS.aperture_diameter  # per pixel of radius
        vergence = LENS.focus_vergence - dioptres * whole.radius
        chosen, first = np.unique(whole.segment[whole.valid], return_index=True)
        per = [np.flatnonzero(whole.segment == number) for number in chosen]
        return cls(
            view,
            rendered.distance,
            points,
            whole,
            chosen,
            np.array([vergence[p].mean() for p in per]),
            dioptres * whole.radius_sd[whole.valid][first],
            np.array([np.median(true[p]) for p in per]),
        )

    @property
    def detected(self) -> int:
        """Number of segments, estimated or not."""
        return len(np.unique(self.points.segment))

    def depth_class(self, vergence: NDArray[np.float64]) -> NDArray[np.intp]:
        """0, 1, 2 for small, medium and large depth."""
        return np.searchsorted(BOUNDS, 1 / np.maximum(vergence, 1e-9))

    def scores(self) -> dict[str, float]:
        """Shares in percent: segments in the right class, and pairs, of those 5 % or more apart, in the right order."""
        found, true = self.depth_class(self.recovered), self.depth_class(self.true)
        one, other = np.triu_indices(len(self.true), 1)
        differ = np.abs(np.log(self.true[one] / self.true[other])) > 0.05
        order = np.sign(self.recovered[one] - self.recovered[other]) * np.sign(self.true[one] - self.true[other])
        return {
            "segments": float(len(self.true)),
            "points_good_percent": 100 * float(self.points.valid.mean()),
            "segments_in_the_right_class_percent": 100 * float((found == true).mean()),
            "pairs_in_the_right_order_percent": 100 * float((order[differ] + 1).mean() / 2),
        }


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    shape, samples = ((960, 960), 256) if full else ((640, 640), 64)
    blurred = Sorted.of(LENS, shape, samples)
    report(0.5)
    sharp = Sorted.of(replace(LENS, f_number=np.inf), shape, samples // 4)
    report(0.9)
    on, off = blurred.scores(), sharp.scores()
    error = np.abs(1 / blurred.recovered - 1 / blurred.true) * blurred.true
    return Shown(
        title="Fig. 4: sharp edges sorted by depth, from one view",
        caption=(
            f"A room with a sand castle, a refrigerator and a door, rendered through an f/{LENS.f_number:g} lens "
            f"focused at {LENS.focus_distance:g} m, nearer than everything in it; 8 bits a pixel, of which the lowest "
            "three are noise (uniform over 8 grey levels). All zero-crossings of the Laplacian of a Gaussian are cut "
            "at points of high curvature; a blurred step is fitted all along, and depth averaged over each segment.",
            f"{len(blurred.true)} of the {blurred.detected} segments are estimated. What the fit rejects is left out: "
            "corners, neighbours too close, too little contrast, grain and stains. "
            f"Middle: the segments beyond {BOUNDS[1]:g} m, between {BOUNDS[0]:g} and {BOUNDS[1]:g} m, and nearer, by "
            "their blur; how many, and how many of them wrongly (orange).",
            "Bottom: every segment against the truth, in vergence (1 / distance). Crosses: the same scene through a "
            "pinhole, analysed as if seen through the lens. Everything then seems in focus, and the order is lost.",
        ),
        figure=_draw(blurred, sharp),
        summary={
            "segments_detected": blurred.detected,
            **on,
            "median_size_of_error_of_distance_percent": 100 * float(np.median(error)),
            **{f"pinhole_{name}": value for name, value in off.items()},
        },
        plotted={
            "lens": {"true_D": blurred.true, "recovered_D": blurred.recovered, "sd_D": blurred.sd},
            "pinhole": {"true_D": sharp.true, "recovered_D": sharp.recovered, "sd_D": sharp.sd},
        },
    )


def _draw(blurred: Sorted, sharp: Sorted) -> Figure:
    with style():
        figure = new_figure(180, 165)
        top, middle = (
            [figure.add_axes(((1.5 + 55 * n) / 180, y / 165, 52 / 180, 39 / 165)) for n in range(3)] for y in (121, 75)
        )
        draw_view(top[0], blurred.view, f"f/{LENS.f_number:g}, noise in 3 of 8 bits")
        _contours(top[1], blurred, {int(n): "black" for n in np.unique(blurred.points.segment)})
        top[1].set_title(f"all {blurred.detected} segments")
        draw_distance(top[2], blurred.truth, limits=(0.2, 1.3), title="true distance")

        found, true = blurred.depth_class(blurred.recovered), blurred.depth_class(blurred.true)
        for ax, number in zip(middle, (2, 1, 0), strict=True):
            chosen = np.flatnonzero(found == number)
            wrong = int((true[chosen] != number).sum())
            colours = {int(blurred.segment[n]): "black" if true[n] == number else ORANGE for n in chosen}
            _contours(ax, blurred, colours)
            ax.set_title(f"{CLASSES[number]} depth: {len(chosen)}, {wrong} wrong")
        ax = figure.add_axes((14 / 180, 11 / 165, 164 / 180, 54 / 165))
        ax.plot([0.15, 1.45], [0.15, 1.45], color=GREY, linewidth=0.6, zorder=0)
        ax.errorbar(
            *(blurred.true, blurred.recovered, 2 * blurred.sd),
            fmt="o", color=BLUE, markersize=3.5, elinewidth=0.7, label="through the lens, ± 2 sd",
        )  # fmt: skip
        ax.plot(sharp.true, sharp.recovered, "x", color=ORANGE, markersize=4.5, label="through a pinhole")
        for bound in BOUNDS:
            ax.axhline(1 / bound, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)), zorder=0)
            ax.axvline(1 / bound, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)), zorder=0)
        ax.set(
            xlim=(0.15, 1.45), ylim=(0.1, 1.5), xlabel="true vergence (D)", ylabel="vergence from blur (D)",
            title=f"The {len(blurred.true)} of {blurred.detected} segments that are estimated, against the truth; "
            "dashes part the classes",
        )  # fmt: skip
        ax.legend(loc="lower right")
        figure.draw_without_rendering()
    return figure


def _contours(ax: Axes, result: Sorted, colours: dict[int, str]) -> None:
    """Draw the segments named in `colours`."""
    points = result.points
    ends = np.flatnonzero(np.diff(points.segment)) + 1
    lines = np.split(np.column_stack([points.column, points.row]), ends)
    numbers = points.segment[np.concatenate([[0], ends])]
    shown = [(line, colours[number]) for line, number in zip(lines, numbers.tolist(), strict=True) if number in colours]
    ax.add_collection(LineCollection([line for line, _ in shown], colors=[c for _, c in shown], linewidths=0.8))
    height, width = result.view.shape
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", anchor="NW", xticks=[], yticks=[])
    ax.spines[:].set(visible=True, linewidth=0.4, color="#888888")


if __name__ == "__main__":
    alone("fig4", make)
