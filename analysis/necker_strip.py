"""The Necker cube with its three gradients, top views of its two readings, and nonrigidity of the second one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style
from focalgradient.render.wireframe import Gradient, blur_at, necker_frame
from focalgradient.scenes.necker import EDGES, NeckerCube, Reading, departure_from_rigid, edge_lengths

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CUBE = NeckerCube(size=0.4, perspective=0.4, distance=0.5, line_width=0.0075)  # with natural size
APERTURE = 0.025  # m, of a 50 mm lens at f/2
FIELD = 0.78  # rad, of a frame
MOMENTS = (0.0, 0.05, 0.1, 0.15, 0.2)  # turns; the picture repeats at 0.25
TURN = np.arange(720) / 720
PERSPECTIVES = np.linspace(0.02, 0.8, 27)
COLOUR: dict[Reading, str] = {"rigid": BLUE, "nonrigid": ORANGE}
ROWS: dict[Gradient, str] = {
    "none": "no gradient",
    "rigid": "blur of the\nrigid reading",
    "nonrigid": "blur of the\nnonrigid reading",
}


def frames(size: int) -> dict[Gradient, list[NDArray[np.float32]]]:
    """Render the frames of each gradient at the MOMENTS, `size` pixels square."""
    return {
        gradient: [
            necker_frame(CUBE, turn, shape=(size, size), pixel_angle=FIELD / size, gradient=gradient, aperture=APERTURE)
            for turn in MOMENTS
        ]
        for gradient in ROWS
    }


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    size = 640 if full else 320
    pictures = frames(size)
    report(0.5)
    shapes: dict[Reading, NDArray[np.float64]] = {reading: CUBE.seen(TURN, reading) for reading in COLOUR}
    departure = {reading: departure_from_rigid(shape) for reading, shape in shapes.items()}
    whole = np.array([departure_from_rigid(NeckerCube(perspective=p).reversed(TURN)).whole for p in PERSPECTIVES])
    lengths = edge_lengths(shapes["nonrigid"]) / CUBE.edge
    # depth range of the cube's edges, which is smaller than that of the whole turn
    sigma = [blur_at(CUBE, CUBE.seen(turn, reading)[:, 2], aperture=APERTURE) for turn in MOMENTS for reading in COLOUR]
    most = float(blur_at(CUBE, CUBE.farthest, aperture=APERTURE))
    light = {gradient: [float(picture.sum(dtype=float)) for picture in pictures[gradient]] for gradient in ROWS}
    unequal = max(
        abs(one / other - 1)
        for gradient in ("rigid", "nonrigid")
        for one, other in zip(light[gradient], light["none"], strict=True)
    )
    return Shown(
        title="A Necker cube with a focal gradient",
        caption=(
            f"A wireframe cube that turns {CUBE.direction}, in perspective (edge / distance {CUBE.perspective:g}), at "
            "five moments of a quarter turn, after which the picture repeats. The lines lie in the same places in all "
            "three rows and give off the same light; only their blur differs. Second row: near edges sharp, far edges "
            f"blurred as by a lens of {1e3 * APERTURE:g} mm aperture {CUBE.distance:g} m away, focused on the nearest "
            "point. Third row: blurred by the depth that each edge has when the cube is seen reversed.",
            "Fourth row: both readings from above, the viewer below. The true cube keeps its shape and turns "
            f"{CUBE.direction_seen('rigid')}; the depth-reversed shape, which has the very same picture, turns "
            f"{CUBE.direction_seen('nonrigid')} and cannot keep its shape. The dot is one vertex, the same in both.",
            "Below: how far each reading departs from a rigid shape, as the root mean square change of its edges’ "
            "lengths about their means. In weak perspective, seen level, it would be perspective / √2 (dashes): "
            "without perspective both readings would be rigid.",
        ),
        figure=_draw(pictures, departure["nonrigid"].by_frame, whole),
        summary={
            "departure_from_rigid_of_the_rigid_reading_percent": 100 * departure["rigid"].whole,
            "departure_from_rigid_of_the_nonrigid_reading_percent": 100 * departure["nonrigid"].whole,
            "its_least_and_largest_at_one_moment_percent": 100
            * np.array([departure["nonrigid"].by_frame.min(), departure["nonrigid"].by_frame.max()]),
            "shortest_and_longest_edge_of_the_nonrigid_reading_over_the_cubes": [lengths.min(), lengths.max()],
            "direction_of_the_rigid_reading": CUBE.direction_seen("rigid"),
            "direction_of_the_nonrigid_reading": CUBE.direction_seen("nonrigid"),
            "blur_sd_of_vertices_least_and_largest_px": [
                float(f(np.concatenate(sigma))) * size / FIELD for f in (np.min, np.max)
            ],
            "blur_sd_at_the_farthest_of_the_turn_px": most * size / FIELD,
            "blur_sd_at_the_farthest_of_the_turn_arcmin": math.degrees(most) * 60,
            "line_width_px": CUBE.line_width * size / FIELD,
            "largest_difference_of_light_between_gradients_percent": 100 * unequal,
        },
        plotted={
            "turn": TURN,
            "departure_by_frame": departure["nonrigid"].by_frame,
            "perspective": PERSPECTIVES,
            "departure_by_perspective": whole,
            "light": light,
        },
    )


def _draw(
    pictures: dict[Gradient, list[NDArray[np.float32]]], by_frame: NDArray[np.float64], whole: NDArray[np.float64]
) -> Figure:
    white = max(float(picture.max()) for row in pictures.values() for picture in row)
    with style():
        figure = new_figure(180, 190, layout="constrained")
        grid = figure.add_gridspec(2, 1, height_ratios=(4.15, 1.25))
        strip, curves = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
        panels = strip.subplots(4, len(MOMENTS))
        for row, (gradient, label) in zip(panels, ROWS.items(), strict=False):
            for ax, picture in zip(row, pictures[gradient], strict=True):
                # as on a display: grey values are the square root of light
                ax.imshow((picture / white) ** (1 / 2.2), cmap="gray", vmin=0, vmax=1, interpolation="lanczos")
                ax.set(xticks=[], yticks=[])
                ax.spines[:].set_visible(False)
            row[0].set_ylabel(label)
        for ax, turn in zip(panels[0], MOMENTS, strict=True):
            ax.set_title(f"{turn:g} turn")
        for ax, turn in zip(panels[3], MOMENTS, strict=True):
            _from_above(ax, turn)
        panels[3, 0].set_ylabel("from above")

        left, right = curves.subplots(1, 2)
        left.plot(TURN, 100 * by_frame, color=ORANGE)
        left.axhline(0, color=BLUE, clip_on=False)
        left.text(0.98, 2, "rigid reading", color=BLUE, ha="right", va="bottom")
        left.text(0.98, 1.05 * 100 * by_frame.max(), "nonrigid reading", color=ORANGE, ha="right", va="bottom")
        left.set(xlim=(0, 1), ylim=(0, 1.35 * 100 * by_frame.max()), xlabel="turn")
        left.set_ylabel("departure from rigid (%)")
        right.plot(PERSPECTIVES, 100 * PERSPECTIVES / math.sqrt(2), color=GREY, linewidth=0.9, linestyle=(0, (4, 3)))
        right.plot(PERSPECTIVES, 100 * whole, color=ORANGE)
        right.plot([CUBE.perspective], [100 * np.sqrt(np.mean(by_frame**2))], "o", color=ORANGE, markersize=4)
        right.text(0.45, 45, "perspective / √2", color=GREY, ha="right", va="bottom")
        right.set(xlim=(0, 0.82), ylim=(0, 60), xlabel="perspective: edge of the cube / distance")
        right.set_ylabel("over a whole turn (%)")
        figure.draw_without_rendering()
    return figure


def _from_above(ax: Axes, turn: float) -> Axes:
    """Draw both readings from above, in edge lengths relative to the cube's centre; the viewer is below."""
    marks: dict[str, Any] = {"marker": "o", "markersize": 3.5}
    for reading, colour in COLOUR.items():
        shape = (CUBE.seen(turn, reading) - [0, 0, CUBE.distance]) / CUBE.edge
        for ends in shape[EDGES]:
            ax.plot(ends[:, 0], ends[:, 2], color=colour, linewidth=0.9)
        ax.plot(*shape[0, [0, 2]], color=colour, **marks)
    ax.set(xlim=(-1.5, 1.5), ylim=(-1.25, 1.25), xticks=[], yticks=[], aspect="equal")
    ax.spines[:].set_visible(False)
    if turn == MOMENTS[0]:
        for reading, y in (("rigid", -1.2), ("nonrigid", 1.2)):
            ax.text(-1.45, y, reading, color=COLOUR[reading], ha="left", va="bottom" if y < 0 else "top")
    return ax


if __name__ == "__main__":
    alone("necker_strip", make)
