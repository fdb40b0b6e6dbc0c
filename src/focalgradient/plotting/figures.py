"""Common colours, style and canvas of all figures."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

if TYPE_CHECKING:
    from matplotlib.axis import Axis

    from focalgradient.statistics import Interval

__all__ = [
    "BLUE",
    "COLOURS",
    "GREEN",
    "GREY",
    "MM",
    "MOST_NAMES",
    "ORANGE",
    "REFERENCE",
    "SIMULATED",
    "add_axes_mm",
    "as_file",
    "as_files",
    "draw_means",
    "laid_out",
    "log_ticks",
    "new_figure",
    "people_grid",
    "person_colours",
    "round_ticks",
    "shortened",
    "style",
]

MM = 1 / 25.4
"""Length of a millimetre in inches."""

BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"  # colour-blind safe palette (Okabe & Ito)


COLOURS = (BLUE, ORANGE, GREEN, "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of conditions and of few people (Okabe & Ito)."""

REFERENCE: dict[str, Any] = {"color": GREY, "linewidth": 0.6, "linestyle": (0, (4, 4)), "zorder": 0}
"""Style of lines that mark a value without effect, or the moment of an event."""

MOST_NAMES = 24
"""Maximum number of participants whose names are shown on an axis."""

SIMULATED = "simulated observers"
"""Label in pictures of simulated observers."""


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
def laid_out(width_mm: float, height_mm: float, *, simulated: bool = False) -> Iterator[Figure]:
    """Yield a figure in the house style; its layout is computed once, at the end of the block, for all file formats.

    A figure of `simulated` observers says so at its upper right.
    """
    with style():
        figure = new_figure(width_mm, height_mm, layout="constrained")
        yield figure
        if simulated:
            figure.suptitle(SIMULATED, fontsize=8, color=ORANGE, x=0.99, ha="right")
        figure.draw_without_rendering()
        figure.set_layout_engine("none")


@contextmanager
def people_grid(people: Sequence[str], *, simulated: bool, row_mm: float = 36.0) -> Iterator[tuple[Figure, list[Axes]]]:
    """Yield a figure with one panel per person, four in a row, with shared axes; titles are the shortened names."""
    columns = min(4, max(len(people), 1))
    rows = -(-len(people) // columns)
    with laid_out(max(44.0 * columns + 10, 70), row_mm * rows + 14, simulated=simulated) as figure:
        panels = [*figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()]
        for panel, person in zip(panels, people, strict=False):
            panel.set_title(shortened(person))
        for hidden in range(len(people), len(panels)):
            panels[hidden].set_visible(False)
            panels[hidden - columns].tick_params(labelbottom=True)  # the last panel of its column
        yield figure, panels[: len(people)]


def add_axes_mm(figure: Figure, left: float, bottom: float, width: float, height: float, **options: Any) -> Axes:
    """Add axes whose lower left corner is at `left` and `bottom` mm from the figure's upper left corner."""
    wide, high = figure.get_size_inches() / MM
    return figure.add_axes((left / wide, 1 - bottom / high, width / wide, height / high), **options)


def round_ticks() -> MaxNLocator:
    """Return the locator of ticks at 1, 2 or 5 times a power of ten: 2.5 takes a digit more."""
    return MaxNLocator("auto", steps=[1, 2, 5, 10])


def log_ticks(axis: Axis, steps: Sequence[int] = (1, 2, 5)) -> None:
    """Label a logarithmic axis at these steps of each decade."""
    # A LogLocator would turn to other steps where less than a decade is shown.
    axis.set_major_locator(FixedLocator([step * 10.0**decade for decade in range(-9, 10) for step in steps]))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, place: f"{value:g}"))


def draw_means(
    ax: Axes,
    means: Sequence[tuple[float, Interval]],
    colour: str,
    marker: str = "o",
    scale: float = 1.0,
    *,
    connected: bool = True,
) -> None:
    """Draw means at their places with their intervals, all multiplied by `scale`; those of different people apart."""
    places, heights = [x for x, _ in means], [scale * mean.estimate for _, mean in means]
    if connected:
        ax.plot(places, heights, color=colour, linewidth=2, zorder=3)
    for x, mean in means:
        if mean.low is not None and mean.high is not None and mean.low < mean.high:
            bar = [[scale * (mean.estimate - mean.low)], [scale * (mean.high - mean.estimate)]]
            ax.errorbar(x, scale * mean.estimate, bar, color=colour, linewidth=2, capsize=3, capthick=1.6, zorder=3)
    ax.plot(places, heights, marker, color=colour, markersize=6, zorder=4)


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
