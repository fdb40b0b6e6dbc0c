"""What all figures share: their colours, their style and their canvas."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

__all__ = ["BLUE", "GREEN", "GREY", "MM", "ORANGE", "as_file", "as_files", "new_figure", "shortened", "style"]

MM = 1 / 25.4
"""A millimetre, in inches."""

BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"  # apart for colour-blind readers (Okabe & Ito)


@contextmanager
def style() -> Iterator[None]:
    """Draw what is created inside in the house style: 8 pt sans serif, thin lines, text that stays text in PDF."""
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
    """Return an empty figure of this size, 200 dots an inch, on a canvas of its own; `options` go to `Figure`."""
    figure = Figure(figsize=(width_mm * MM, height_mm * MM), dpi=200, **options)
    FigureCanvasAgg(figure)
    return figure


def shortened(name: str, room: int = 24) -> str:
    """A name in so many letters at most: its beginning and its end.

    >>> shortened("IMG_20240102_123456_kitchen", 14)
    'IMG_20…kitchen'
    """
    return name if len(name) <= room else f"{name[: room // 2 - 1]}…{name[-room // 2 :]}"


def as_file(figure: Figure, kind: Literal["png", "pdf"]) -> bytes:
    """A figure as the content of a file of this kind, the same bytes in every run."""
    stamp = {"png": "Software", "pdf": "CreationDate"}[kind]
    buffer = io.BytesIO()
    with style():
        figure.savefig(buffer, format=kind, dpi=200, metadata={stamp: None})
    return buffer.getvalue()


def as_files(figure: Figure) -> dict[str, bytes]:
    """A figure as the contents of a PNG and a PDF file."""
    return {"png": as_file(figure, "png"), "pdf": as_file(figure, "pdf")}
