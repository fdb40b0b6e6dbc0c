"""Fig. 4: sharp edges of an indoor scene, sorted by depth from their blur in a single view and in two."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone
from scipy.ndimage import minimum_filter

from focalgradient import Lens, View, recover_depth
from focalgradient.depth.edges.measure import Edges, average_segments, measure_edges
from focalgradient.plotting import BLUE, GREY, ORANGE, draw_distance, draw_view, new_figure, style
from focalgradient.render import Rendered, render
from focalgradient.scenes import room

LENS = Lens(focal_length=0.05, f_number=8.0, focus_distance=0.6)
SMALL = replace(LENS, f_number=22.0)  # the aperture of the second view
PINHOLE = replace(LENS, f_number=np.inf)
FARTHEST = 8.0  # m, limit of the search with two views
FIELD = 0.45  # width of the frame, a tangent
SEED = 1
LEVELS = 8  # grey levels of 256 spanned by the lowest three bits
LENGTH = 16.0  # px, length of edge per estimate
BOUNDS = (1.8, 3.6)  # m, between small, medium and large depth: in the two gaps of the scene
CLASSES = ("small", "medium", "large")

FloatArray = NDArray[np.float64]


def photograph(lens: Lens, shape: tuple[int, int], samples: int, seed: int) -> Rendered:
    """Render the room through `lens` with `samples` rays per pixel."""
    return render(room(SEED), lens, shape, FIELD / shape[1], engine="shaded", samples=samples, seed=seed)


def noisy_bits(view: View, white: float, seed: int) -> View:
    """Quantise to 8 bits with `white` at 250; the lowest three bits are noise: uniform over 8 levels, SD 2.3 of 255."""
    levels = 250 * view.image / white
    noise = LEVELS * (np.random.default_rng(seed).random(view.shape) - 0.5)
    return replace(view, image=(np.clip(np.rint(levels + noise), 0, 255) / 255).astype(np.float32))


@dataclass(frozen=True)
class Sorted:
    """Segments of a view, with estimated and true vergence."""

    segment: NDArray[np.intp]  # indices of the estimated segments
    recovered: FloatArray  # vergence, D
    sd: FloatArray
    true: FloatArray

    @classmethod
    def by_blur(cls, points: Edges, pixel: float, truth: FloatArray) -> Sorted:
        """Estimate from the blur of the single view of `points`, as seen through `LENS`, beyond its focus."""
        whole = average_segments(points, LENGTH)
        dioptres = 2 * pixel / LENS.aperture_diameter  # per pixel of radius
        vergence = LENS.focus_vergence - dioptres * whole.radius
        return cls._of(whole, whole.valid, vergence, dioptres * whole.radius_sd, truth)

    @classmethod
    def by_comparison(cls, points: Edges, views: list[View], truth: FloatArray) -> Sorted:
        """Estimate by the default method from two views, for segments with a valid estimate at half of their points.

        Neighbouring points share pixels, so that the SD of a segment is that of its points.
        """
        depth = recover_depth(views, near=LENS.focus_distance, far=FARTHEST)
        where = np.rint(points.row).astype(int), np.rint(points.column).astype(int)
        known = depth.valid[where]
        segments = len(np.unique(points.segment))
        share = np.bincount(points.segment, known, segments) / np.bincount(points.segment, minlength=segments)
        valid = known & (share >= 0.5)[points.segment]
        return cls._of(points, valid, depth.vergence[where], depth.vergence_sd[where], truth)

    @classmethod
    def _of(
        cls, points: Edges, valid: NDArray[np.bool_], vergence: FloatArray, sd: FloatArray, truth: FloatArray
    ) -> Sorted:
        """Return means, and median SDs, over the valid points of each segment."""
        # an edge belongs to the nearer of the adjoining surfaces, and is displaced slightly by blur
        true = 1 / minimum_filter(truth, 15)[np.rint(points.row).astype(int), np.rint(points.column).astype(int)]
        chosen = np.unique(points.segment[valid])
        per = [np.flatnonzero(valid & (points.segment == number)) for number in chosen]
        return cls(
            chosen,
            np.array([vergence[p].mean() for p in per]),
            np.array([np.median(sd[p]) for p in per]),
            np.array([np.median(true[p]) for p in per]),
        )

    def depth_class(self, vergence: FloatArray) -> NDArray[np.intp]:
        """Return 0, 1 or 2 for small, medium and large depth."""
        return np.searchsorted(BOUNDS, 1 / np.maximum(vergence, 1e-9))

    def scores(self) -> dict[str, float]:
        """Return percentages of segments in the correct class, and of pairs at least 5 % apart in the correct order."""
        found, true = self.depth_class(self.recovered), self.depth_class(self.true)
        one, other = np.triu_indices(len(self.true), 1)
        differ = np.abs(np.log(self.true[one] / self.true[other])) > 0.05
        order = np.sign(self.recovered[one] - self.recovered[other]) * np.sign(self.true[one] - self.true[other])
        return {
            "segments": float(len(self.true)),
            "segments_in_the_right_class_percent": 100 * float((found == true).mean()),
            "pairs_in_the_right_order_percent": 100 * float((order[differ] + 1).mean() / 2),
        }


@dataclass(frozen=True)
class Room:
    """Noisy views of the room, segments of the first, and their order by each method."""

    view: View
    truth: FloatArray
    points: Edges
    blurred: Sorted
    sharp: Sorted  # by the blur of a pinhole view
    compared: Sorted
    same: Sorted  # by comparison of two pinhole views with the optics of the two apertures

    @classmethod
    def of(cls, shape: tuple[int, int], samples: int, seed: int = 1, progress: Progress | None = None) -> Room:
        """Render the room and sort its segments; all of it lies beyond the focus of `LENS`."""
        report = progress or (lambda share: None)
        lenses = ((LENS, samples), (SMALL, samples), (PINHOLE, samples // 4))
        rendered = []
        for number, (lens, rays) in enumerate(lenses):
            rendered.append(photograph(lens, shape, rays, seed + number))
            report(0.25 * (number + 1))
        white = max(float(one.view.image.max()) for one in rendered)
        large, small, pinhole = (noisy_bits(one.view, white, seed + n) for n, one in enumerate(rendered))
        again = replace(noisy_bits(rendered[2].view, white, seed + 3), optics=LENS)
        pixel, truth = FIELD / shape[1], rendered[0].distance
        points, sharp = (measure_edges(view.image, psf="disc", length=LENGTH) for view in (large, pinhole))
        return cls(
            large,
            truth,
            points,
            Sorted.by_blur(points, pixel, truth),
            Sorted.by_blur(sharp, pixel, truth),
            Sorted.by_comparison(points, [small, large], truth),
            Sorted.by_comparison(points, [replace(pinhole, optics=SMALL), again], truth),
        )

    @property
    def detected(self) -> int:
        """Number of detected segments, with or without an estimate."""
        return len(np.unique(self.points.segment))


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    shape, samples = ((960, 960), 256) if full else ((640, 640), 64)
    found = Room.of(shape, samples, progress=progress)
    blurred, compared = found.blurred, found.compared
    on, two = blurred.scores(), compared.scores()
    off, same = found.sharp.scores(), found.same.scores()
    error = np.abs(1 / blurred.recovered - 1 / blurred.true) * blurred.true
    within = np.abs(compared.recovered - compared.true) <= 2 * compared.sd
    return Shown(
        title="Fig. 4: sharp edges sorted by depth",
        caption=(
            f"A room with a sand castle, a refrigerator and a door, rendered through an f/{LENS.f_number:g} lens "
            f"focused at {LENS.focus_distance:g} m, nearer than everything in it; 8 bits a pixel, of which the lowest "
            "three are noise (uniform over 8 grey levels). All zero-crossings of the Laplacian of a Gaussian are cut "
            "at points of high curvature; a blurred step is fitted all along, and depth averaged over each segment.",
            f"{len(blurred.true)} of the {found.detected} segments are estimated from this one view. What the fit "
            "rejects is left out: corners, neighbours too close, too little contrast, grain and stains. "
            f"Second row: the segments beyond {BOUNDS[1]:g} m, between {BOUNDS[0]:g} and {BOUNDS[1]:g} m, and nearer, "
            "by their blur; how many, and how many of them wrongly (orange).",
            f"Third row: the same segments by a second view, through f/{SMALL.f_number:g}, which tells blur from soft "
            "texture (the default method, averaged over each segment). "
            f"{two['segments']:.0f} segments are estimated, {two['segments_in_the_right_class_percent']:.1f} % in the "
            f"right class and {two['pairs_in_the_right_order_percent']:.1f} % of the pairs in the right order; "
            f"{100 * within.mean():.0f} % lie within 2 sd. The rest are misread along outlines, where an edge is the "
            "nearer surface's and the texture beside it the farther one's.",
            "Bottom: every segment against the truth, in vergence (1 / distance); dashes part the classes. "
            "Crosses: the same scene through a pinhole, analysed as if seen through the lens. Everything then seems in "
            "focus, and the order is lost: "
            f"{off['pairs_in_the_right_order_percent']:.0f} % of the pairs from one view, and "
            f"{same['pairs_in_the_right_order_percent']:.0f} % from two, are in the right order.",
        ),
        figure=_draw(found),
        summary={
            "segments_detected": found.detected,
            **on,
            "points_good_percent": 100 * float(found.points.valid.mean()),
            "median_size_of_error_of_distance_percent": 100 * float(np.median(error)),
            **{f"pinhole_{name}": value for name, value in off.items()},
            **{f"two_views_{name}": value for name, value in two.items()},
            "two_views_within_2_sd_percent": 100 * float(within.mean()),
            **{f"two_views_pinhole_{name}": value for name, value in same.items()},
        },
        plotted={
            name: {"true_D": one.true, "recovered_D": one.recovered, "sd_D": one.sd}
            for name, one in (
                ("lens", blurred),
                ("pinhole", found.sharp),
                ("two_views", compared),
                ("two_views_pinhole", found.same),
            )
        },
    )


def _draw(found: Room) -> Figure:
    with style():
        figure = new_figure(180, 212)
        top, one, two = (
            [figure.add_axes(((1.5 + 55 * n) / 180, y / 212, 52 / 180, 39 / 212)) for n in range(3)]
            for y in (168, 122, 76)
        )
        draw_view(top[0], found.view, f"f/{LENS.f_number:g}, noise in 3 of 8 bits")
        _contours(top[1], found, {int(n): "black" for n in np.unique(found.points.segment)})
        top[1].set_title(f"all {found.detected} segments")
        draw_distance(top[2], found.truth, limits=(0.2, 1.65), title="true distance")
        _classes(one, found, found.blurred, "one view")
        _classes(two, found, found.compared, "two views")
        left, right = (figure.add_axes((x / 180, 11 / 212, 76 / 180, 54 / 212)) for x in (14, 102))
        _against_truth(left, found.blurred, found.sharp, "One view")
        _against_truth(right, found.compared, found.same, "Two views")
        left.set_ylabel("vergence from blur (D)")
        figure.legend(
            *left.get_legend_handles_labels(), loc="upper right", bbox_to_anchor=(178 / 180, 75.5 / 212), ncols=2
        )
        figure.draw_without_rendering()
    return figure


def _classes(axes: list[Axes], found: Room, result: Sorted, name: str) -> None:
    """Draw the segments of each class, the farthest first; misclassified ones in orange."""
    read, true = result.depth_class(result.recovered), result.depth_class(result.true)
    for ax, number in zip(axes, (2, 1, 0), strict=True):
        chosen = np.flatnonzero(read == number)
        wrong = int((true[chosen] != number).sum())
        _contours(ax, found, {int(result.segment[n]): "black" if true[n] == number else ORANGE for n in chosen})
        ax.set_title(f"{name}, {CLASSES[number]}: {len(chosen)}, {wrong} wrong")


def _against_truth(ax: Axes, on: Sorted, off: Sorted, name: str) -> None:
    """Draw every segment's estimate against the truth, through the lens and through a pinhole."""
    ax.plot([0.15, 1.7], [0.15, 1.7], color=GREY, linewidth=0.6, zorder=0)
    few = len(on.true) < 100
    ax.plot(off.true, off.recovered, "x", color=ORANGE, markersize=4.0 if few else 2.5, label="through a pinhole")
    ax.errorbar(
        *(on.true, on.recovered, 2 * on.sd),
        fmt="o", color=BLUE, markersize=3.5 if few else 2.0, elinewidth=0.7 if few else 0.4,
        label="through the lens, ± 2 sd",
    )  # fmt: skip
    for bound in BOUNDS:
        ax.axhline(1 / bound, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)), zorder=0)
        ax.axvline(1 / bound, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)), zorder=0)
    low, high = (on.recovered - 2 * on.sd).min(), (on.recovered + 2 * on.sd).max()
    ax.set(
        xlim=(0.15, 1.7), ylim=(min(low - 0.05, 0.1), max(high + 0.05, 1.75)), xlabel="true vergence (D)",
        title=f"{name}: {len(on.true)} segments",
    )  # fmt: skip


def _contours(ax: Axes, found: Room, colours: dict[int, str]) -> None:
    """Draw the segments named in `colours`."""
    points = found.points
    ends = np.flatnonzero(np.diff(points.segment)) + 1
    lines = np.split(np.column_stack([points.column, points.row]), ends)
    numbers = points.segment[np.concatenate([[0], ends])]
    shown = [(line, colours[number]) for line, number in zip(lines, numbers.tolist(), strict=True) if number in colours]
    ax.add_collection(LineCollection([line for line, _ in shown], colors=[c for _, c in shown], linewidths=0.8))
    height, width = found.view.shape
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", anchor="NW", xticks=[], yticks=[])
    ax.spines[:].set(visible=True, linewidth=0.4, color="#888888")


if __name__ == "__main__":
    alone("fig4", make)
