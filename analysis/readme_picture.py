"""The picture of the README: two views of one scene, and the depth that they give. Writes docs/picture.png."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from PIL import Image
from scene import views_and_truth
from scipy.spatial import cKDTree

from focalgradient import recover_depth
from focalgradient.plotting import describe_optics, draw_depth, draw_view, new_figure, style

PICTURE = Path(__file__).parents[1] / "docs" / "picture.png"


def make() -> Figure:
    views, _ = views_and_truth(samples=256)
    depth = recover_depth(views)
    wide, high, page = 56.0, 42.0, (190.0, 49.0)  # mm
    with style():
        figure = new_figure(*page)
        one, two, three = (
            figure.add_axes((x / page[0], 1 / page[1], wide / page[0], high / page[1])) for x in (1.0, 58.5, 116.0)
        )
        for ax, view in zip((one, two), views, strict=True):
            draw_view(ax, view, describe_optics(view.optics))
        draw_depth(three, depth, title="recovered distance (hatched: refused)")
        figure.draw_without_rendering()
    return figure


def write(figure: Figure, path: Path) -> None:
    """Write `figure` as a PNG of 256 colours, greys and the map's own: a third of the size of one of all colours."""
    buffer = io.BytesIO()
    with style():
        figure.savefig(buffer, format="png", dpi=200)
    colours = np.concatenate([colormaps["gray"](np.linspace(0, 1, 96)), colormaps["viridis"](np.linspace(0, 1, 160))])
    colours = np.rint(255 * colours[:, :3]).astype(np.uint8)
    index = cKDTree(colours).query(np.asarray(Image.open(buffer).convert("RGB")))[1]
    picture = Image.fromarray(index.astype(np.uint8))
    picture.putpalette(colours.ravel().tolist())
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)


if __name__ == "__main__":
    write(make(), PICTURE)
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1000:.0f} kB")
