"""Common colours, style and canvas of all figures."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

__all__ = [
    "BLUE",
    "COLOURS",
    "GREEN",
    "GREY",
    "MM",
    "ORANGE",
    "as_file",
    "as_files",
    "laid_out",
    "new_figure",
    "people_grid",
    "person_colours",
    "shortened",
    "style",
]

MM = 1 / 25.4
"""Length of a millimetre in inches."""

BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"  # colour-blind safe palette (Okabe & Ito)


COLOURS = (BLUE, ORANGE, GREEN, "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of conditions and of few people (Okabe & Ito)."""


def person_colours(count: int) -> list[str]:
    """Return a different colour for each of `count` people.

    >>> person_colours(2)
    ['#0072B2', '#D55E00']
    """
    if count <= len(COLOURS):
        return [*COLOURS[:count]]
    return [to_hex(colour) for colour in colormaps["viridis"](np.linspace(0, 0.9, count))]


@contextmanager
def style() -> Iterator[None]:
    """Apply the house style inside the block: 8 pt sans serif, thin lines, text stored as text in PDF."""
    settings: dict[str, Any] = {
        "font.family": "DejaVu Sans",
        "font.size": 8,
        "axes.labelsize": 8,
        "axes.linewidth": 0.6,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlelocation": "left",
        "axes.titlepad": 4,
        "axes.titlesize": 8.5,
        "hatch.linewidth": 0.5,
        "legend.fontsize": 8,
        "legend.frameon": False,
        "lines.linewidth": 1.4,
        "pdf.fonttype": 42,
        "xtick.labelsize": 8,
        "xtick.major.width": 0.6,
        "ytick.labelsize": 8,
        "ytick.major.width": 0.6,
    }
    with matplotlib.rc_context(settings):  # type: ignore[arg-type]
        yield


def new_figure(width_mm: float = 180.0, height_mm: float = 90.0, **options: Any) -> Figure:
    """Return an empty figure of this size at 200 dots per inch, with its own canvas; `options` go to `Figure`."""
    figure = Figure(figsize=(width_mm * MM, height_mm * MM), dpi=200, **options)
    FigureCanvasAgg(figure)
    return figure


@contextmanager
def laid_out(width_mm: float, height_mm: float) -> Iterator[Figure]:
    """Yield a figure in the house style; its layout is computed once, at the end of the block, for all file formats."""
    with style():
        figure = new_figure(width_mm, height_mm, layout="constrained")
        yield figure
        figure.draw_without_rendering()
        figure.set_layout_engine("none")


def people_grid(people: Sequence[str], row_mm: float = 36.0) -> tuple[Figure, list[Axes]]:
    """Return a figure with one panel per person, four in a row, with shared axes; titles are the shortened names."""
    columns = min(4, max(len(people), 1))
    rows = -(-len(people) // columns)
    figure = new_figure(max(44.0 * columns + 10, 70), row_mm * rows + 14, layout="constrained")
    panels = [*figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()]
    for panel, person in zip(panels, people, strict=False):
        panel.set_title(shortened(person))
    for hidden in range(len(people), len(panels)):
        panels[hidden].set_visible(False)
        panels[hidden - columns].tick_params(labelbottom=True)  # the last panel of its column
    return figure, panels[: len(people)]


def shortened(name: str, room: int = 24) -> str:
    """Return a name shortened to `room` letters, keeping its beginning and end.

    >>> shortened("IMG_20240102_123456_kitchen", 14)
    'IMG_20…kitchen'
    """
    return name if len(name) <= room else f"{name[: room // 2 - 1]}…{name[-room // 2 :]}"


def as_file(figure: Figure, kind: Literal["png", "pdf"]) -> bytes:
    """Return a figure as the content of a PNG or PDF file, reproducible byte by byte."""
    stamp = {"png": "Software", "pdf": "CreationDate"}[kind]
    buffer = io.BytesIO()
    with style():
        figure.savefig(buffer, format=kind, dpi=200, metadata={stamp: None})
    return buffer.getvalue()


def as_files(figure: Figure) -> dict[str, bytes]:
    """Return a figure as the contents of a PNG and a PDF file."""
    return {"png": as_file(figure, "png"), "pdf": as_file(figure, "pdf")}
