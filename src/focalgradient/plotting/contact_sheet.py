"""Contact sheet of a set of pictures: all conditions of all scenes side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from focalgradient.plotting.figures import add_axes_mm, new_figure, style

__all__ = ["contact_sheet", "draw_picture"]

COLUMN = 25.0  # width of a picture (mm)
GAP = 0.6
LETTER = 1.5  # width of a letter of the note (mm): DejaVu Sans at 8 points has 1.45 on average


def draw_picture(
    ax: Axes, values: NDArray[np.uint8], fixated: Sequence[tuple[float, float]] = (), *, ring: float = 0.075
) -> Axes:
    """Draw a picture as displayed, with rings around the `fixated` points.

    Parameters
    ----------
    ax
        Axes to draw into.
    values
        8-bit values, H x W x 3.
    fixated
        Positions in pixels from the upper left corner, to the right and down.
    ring
        Radius of the rings as a fraction of the picture's width.
    """
    height, width = values.shape[:2]
    ax.imshow(values, extent=(0, width, height, 0), interpolation="antialiased")
    angle = np.linspace(0, 2 * np.pi, 61)
    for x, y in fixated:
        # A mark at the picture's edge ends there.
        around = (
            np.clip(x + ring * width * np.cos(angle), 0, width),
            np.clip(y + ring * width * np.sin(angle), 0, height),
        )
        for colour, thick in (("black", 1.4), ("white", 0.7)):
            ax.plot(*around, color=colour, linewidth=thick)
    ax.set(xlim=(0, width), ylim=(height, 0), xticks=[], yticks=[])
    ax.spines[:].set_visible(False)
    return ax


def contact_sheet(
    rows: Mapping[str, Sequence[tuple[NDArray[np.uint8], Sequence[tuple[float, float]]]]],
    columns: Sequence[str],
    groups: Sequence[tuple[str, int]],
    note: str,
) -> Figure:
    """Return a contact sheet with all pictures of a set.

    Parameters
    ----------
    rows
        For each scene's caption, its pictures in order, each with its fixated points, as for `draw_picture`.
    columns
        Headings of the columns.
    groups
        Headings that span several columns: text, and number of columns.
    note
        Caption below the pictures.

    Returns
    -------
    Figure
        Figure whose width depends on the number of columns or a longer note, and whose height on the number of rows.
    """
    left, top, bottom = 24.0, 10.0, 6.0 + 3.6 * note.count("\n")
    step = COLUMN + GAP
    longest = max(map(len, note.splitlines()), default=0)
    width = max(left + step * len(columns), 3.0 + LETTER * longest)
    height = top + step * len(rows) + bottom
    with style():
        figure = new_figure(width, height)

        def write(x: float, y: float, text: str, **how: str) -> None:
            """Place text, in mm from the upper left corner."""
            figure.text(x / width, 1 - y / height, text, **how)  # type: ignore[arg-type]

        first = 0
        for text, count in groups:
            write(left + step * first, 3.2, text, va="center")
            first += count
        for index, text in enumerate(columns):
            write(left + step * index, 7.4, text, va="center")
        for row, (text, pictures) in enumerate(rows.items()):
            write(1.5, top + step * row + COLUMN / 2, text, va="center")
            for column, (values, fixated) in enumerate(pictures):
                place = left + step * column, top + step * row + COLUMN
                draw_picture(add_axes_mm(figure, *place, COLUMN, COLUMN), values, fixated)
        write(1.5, height - 1.8, note, va="bottom")
    return figure
