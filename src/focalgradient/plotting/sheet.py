"""Printable calibration target: fine texture of all scales, with a ruler."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from focalgradient.errors import check_one_of
from focalgradient.plotting.figures import add_axes_mm, new_figure, style
from focalgradient.scenes.texture import random_field

__all__ = ["PAPERS", "calibration_sheet"]

PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "letter": (279.4, 215.9)}
"""Width and height in mm, landscape (ISO 216; ANSI A)."""

PIXEL_MM = 0.254
"""Side of a texture pixel in mm: 100 dots per inch, which any printer resolves."""

SEED = 1987
"""Random seed of the texture, which is identical on every sheet."""

MARGIN_MM, RULER_MM = 8.0, 14.0
"""Blank margin left by printers, and height of the ruler below the texture, in mm."""


def calibration_sheet(paper: str = "A4") -> Figure:
    """Return a page of texture with the 1/f amplitude spectrum of natural surfaces, and a 100 mm ruler.

    Parameters
    ----------
    paper
        Paper size, a key of `PAPERS`.

    Examples
    --------
    >>> calibration_sheet("A4").get_size_inches().round(2).tolist()
    [11.69, 8.27]
    """
    check_one_of("paper", paper, PAPERS)
    width, height = PAPERS[paper]
    columns, rows = (round(side / PIXEL_MM) for side in (width - 2 * MARGIN_MM, height - 2 * MARGIN_MM - RULER_MM))
    with style():
        figure = new_figure(width, height)
        bottom = height - MARGIN_MM - RULER_MM
        ax = add_axes_mm(figure, MARGIN_MM, bottom, columns * PIXEL_MM, rows * PIXEL_MM, frameon=False)
        # The lowest frequencies have constant amplitude, which leaves more contrast for fine detail.
        texture = 0.5 + 0.2 * random_field((rows, columns), SEED, coarsest=0.02)
        ax.imshow(np.clip(texture, 0.05, 0.95), cmap="gray", vmin=0, vmax=1, interpolation="nearest", aspect="auto")
        ax.set(xticks=[], yticks=[])
        ruler = add_axes_mm(figure, MARGIN_MM, height - MARGIN_MM, 100, 4)
        ruler.set(xlim=(0, 100), ylim=(0, 1), yticks=[], xticks=range(0, 101, 10))
        ruler.bar(np.arange(0, 100, 10) + 5, 1, width=10, color=["black", "white"] * 5)
        ruler.tick_params(length=0, pad=1, labelsize=6)
        figure.text(
            (MARGIN_MM + 106) / width,
            (MARGIN_MM + 2) / height,
            "focalgradient calibration sheet. Print at 100 %: the ruler is 100 mm long. Mount it flat, facing the "
            "camera, filling the frame;\nlight it evenly. Use a tripod, raw or linear files and fixed focus; two or "
            "three distances, each at all f-numbers to be used.",
            fontsize=5.5,
            va="center",
        )
    return figure
