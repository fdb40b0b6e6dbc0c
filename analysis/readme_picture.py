"""Picture of the README: two views of a natural scene, the distance estimated from them, and what people judge.

Writes docs/picture.png.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from focalgradient import Lens, recover_depth
from focalgradient.display import Display
from focalgradient.plotting import GREY, draw_distance, new_figure, style
from focalgradient.render import render_series
from focalgradient.scenes import naturalistic

PICTURE = Path(__file__).parents[1] / "docs" / "picture.png"
SEED = 5
FIELD = 0.35  # width of the frame as a tangent
SHAPE = (420, 560)
FOCAL_LENGTH = 0.05  # m
VIEWS = ((16.0, 0.6), (16.0, 2.5))  # f-number and distance in focus (m) of the two views
JUDGED = (math.inf, 16.0, 5.6)  # f-numbers of the judged pictures, focused on the nearest object
SAMPLES = 256
WHITE_PERCENT = 99.9  # percentile of the pinhole picture's light that the display shows as white
PAGE_MM = (190.0, 99.0)
PANEL_MM = (56.0, 42.0)
DOTS_PER_INCH = 160


def make() -> Figure:
    scene = naturalistic(SEED, field=FIELD)
    nearest = scene.mark("nearest").distance
    lenses = [Lens(FOCAL_LENGTH, number, focus) for number, focus in VIEWS]
    lenses += [Lens(FOCAL_LENGTH, number, nearest) for number in JUDGED]
    drawn = render_series(scene, lenses, SHAPE, FIELD / SHAPE[1], samples=SAMPLES)
    depth = recover_depth([rendered.view for rendered in drawn[: len(VIEWS)]])
    light = [np.asarray(rendered.colour) for rendered in drawn]
    white = np.percentile(light[len(VIEWS)], WHITE_PERCENT)
    distance = np.where(depth.valid, depth.distance, np.nan)
    limits = tuple(np.percentile(depth.vergence[depth.valid], (1, 99)))
    titles = [f"f/{number:g}, focus {focus:g} m" for number, focus in VIEWS]
    titles += ["people judge: pinhole", f"f/{JUDGED[1]:g}", f"f/{JUDGED[2]:g}"]
    with style():
        figure = new_figure(*PAGE_MM)
        for index, (colour, title) in enumerate(zip(light, titles, strict=True)):
            row, column = divmod(index, 2) if index < 2 else (1, index - 2)
            _draw_picture(_panel(figure, row, column), colour / white, title)
        draw_distance(_panel(figure, 0, 2), distance, limits=limits, title="distance by blur (hatched: rejected)")
        figure.draw_without_rendering()
    return figure


def _panel(figure: Figure, row: int, column: int) -> Axes:
    """Add the axes of a panel: rows and columns are flush."""
    wide, high = PANEL_MM
    left, bottom = 1.0 + column * (wide + 2.0), (50.5, 1.0)[row]
    page_wide, page_high = PAGE_MM
    return figure.add_axes((left / page_wide, bottom / page_high, wide / page_wide, high / page_high))


def _draw_picture(ax: Axes, light: np.ndarray, title: str) -> None:
    """Draw linear light in the colours of an sRGB display."""
    ax.imshow(Display().encode(np.clip(light, 0, 1)), interpolation="none", aspect="auto")
    ax.set(xticks=[], yticks=[], title=title)
    ax.spines[:].set(color=GREY, linewidth=0.5, visible=True)


def write(figure: Figure, path: Path) -> None:
    """Write `figure` as a PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with style():
        figure.savefig(path, dpi=DOTS_PER_INCH)


if __name__ == "__main__":
    write(make(), PICTURE)
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1000:.0f} kB")
