"""Picture of the README: a scene, two views of it, the recovered depth, and human judgements.

Writes docs/picture.png.
"""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from PIL import Image
from scene import LENSES, SEED, WIDTH, views_and_truth
from scipy.spatial import cKDTree

from focalgradient import Lens, recover_depth
from focalgradient.plotting import BLUE, GREY, ORANGE, describe_optics, draw_distance, draw_view, new_figure, style
from focalgradient.render import cast
from focalgradient.scenes import Sphere, spheres

PICTURE = Path(__file__).parents[1] / "docs" / "picture.png"
SHAPE = (360, 480)
FARTHEST = 3.2  # m, right end of the drawing
JUDGED = (math.inf, 5.6)  # f-numbers of the judged pictures
FOCUS = 0.62  # m, on the nearest sphere, in the judged pictures


def make() -> Figure:
    views, _ = views_and_truth(samples=256)
    depth = recover_depth(views)
    found = np.where(depth.valid, depth.distance, np.nan)
    vergences = depth.vergence[depth.valid]
    limits = float(np.percentile(vergences, 1)), float(np.percentile(vergences, 99))
    wide, high, page = 56.0, 42.0, (190.0, 103.0)  # mm
    with style():
        figure = new_figure(*page)
        axes = [
            figure.add_axes((x / page[0], y / page[1], wide / page[0], high / page[1]))
            for y in (55.0, 3.0)
            for x in (1.0, 75.5, 133.0)  # the colour bar of the map is between the first two columns
        ]
        axes[0].set_position((1.0 / page[0], 55.0 / page[1], 70.0 / page[0], high / page[1]))
        _side(axes[0])
        for ax, view, colour in zip(axes[1:3], views, (BLUE, ORANGE), strict=True):
            draw_view(ax, view, describe_optics(view.optics))
            ax.spines[:].set(color=colour, linewidth=1.6, visible=True)
        draw_distance(axes[3], found, limits=limits, title="distance by blur (hatched: rejected)")
        for ax, number, title in zip(
            axes[4:], JUDGED, ("people judge: through a pinhole ...", "... and through f/5.6"), strict=True
        ):
            lens = Lens(LENSES[0].focal_length, number, FOCUS)
            seen = cast(spheres(SEED), lens, SHAPE, WIDTH / SHAPE[1] / lens.sensor_distance, samples=256)
            draw_view(ax, seen.view, title)
        figure.draw_without_rendering()
    return figure


def _side(ax: Axes) -> None:
    """Draw the scene from the side: the lens at the left, the spheres at their distances, and the two planes of focus.

    Heights are enlarged, but the spheres are drawn round.
    """
    top = 0.13  # m
    ax.set(xlim=(-0.15, FARTHEST), ylim=(-top, top), xticks=(0, 1, 2, 3), yticks=[])
    ax.set_xticklabels(["0", "1", "2", "3 m"])
    box = ax.get_window_extent()
    round_ = (FARTHEST + 0.15) / box.width / (2 * top / box.height)
    floor, wall = -0.0216, 3.0
    ax.plot([0.45, wall, wall], [floor, floor, top], color=GREY, linewidth=0.8)
    for thing in spheres(SEED).objects:
        if isinstance(thing, Sphere):
            size = 2 * thing.radius
            place = (thing.centre[2], -thing.centre[1])
            ax.add_patch(Ellipse(place, size * round_, size, facecolor="#c9c9c9", edgecolor=GREY, linewidth=0.6))
    for lens, colour in zip(LENSES, (BLUE, ORANGE), strict=True):
        ax.axvline(lens.focus_distance, 0, 0.86, color=colour, linewidth=1.2, linestyle=(0, (4, 3)))
        ax.text(lens.focus_distance, 0.9 * top, f"{lens.focus_distance:g} m", color=colour, ha="center")
    half = SHAPE[0] / SHAPE[1] * WIDTH / 2 / LENSES[0].sensor_distance
    for side in (-1, 1):
        ax.plot([0, FARTHEST], [0, side * half * FARTHEST], color=GREY, linewidth=0.5)
    ax.plot([0, 0], [-0.012, 0.012], color="black", linewidth=3, solid_capstyle="round")
    ax.text(0, -0.02, "lens", va="top", ha="center")
    ax.spines["left"].set_visible(False)
    ax.set_title("a scene, from the side")


def write(figure: Figure, path: Path) -> None:
    """Write `figure` as a PNG with 256 colours, greys and those of the map: a third of the size of full colour."""
    buffer = io.BytesIO()
    with style():
        figure.savefig(buffer, format="png", dpi=200)
    lines = np.array([to_rgb(colour) for colour in (BLUE, ORANGE)])
    maps = [colormaps["gray"](np.linspace(0, 1, 96))[:, :3], colormaps["viridis"](np.linspace(0, 1, 158))[:, :3], lines]
    colours = np.rint(255 * np.concatenate(maps)).astype(np.uint8)
    index = cKDTree(colours).query(np.asarray(Image.open(buffer).convert("RGB")))[1]
    picture = Image.fromarray(index.astype(np.uint8))
    picture.putpalette(colours.ravel().tolist())
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)


if __name__ == "__main__":
    write(make(), PICTURE)
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1000:.0f} kB")
