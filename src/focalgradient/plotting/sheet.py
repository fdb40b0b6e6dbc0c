"""Printable calibration target: fine texture of all scales, with a ruler."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from focalgradient.errors import check_one_of
from focalgradient.plotting.figures import new_figure, style

__all__ = ["PAPERS", "calibration_sheet"]

PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "letter": (279.4, 215.9)}
"""Width and height in mm, landscape (ISO 216; ANSI A)."""

PIXEL_MM = 0.254
"""Side of a texture pixel in mm: 100 dots per inch, which any printer resolves."""

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
        ax = figure.add_axes(
            (MARGIN_MM / width, (MARGIN_MM + RULER_MM) / height, columns * PIXEL_MM / width, rows * PIXEL_MM / height),
            frameon=False,
        )
        ax.imshow(_texture(rows, columns), cmap="gray", vmin=0, vmax=1, interpolation="nearest", aspect="auto")
        ax.set(xticks=[], yticks=[])
        ruler = figure.add_axes((MARGIN_MM / width, MARGIN_MM / height, 100 / width, 4 / height))
        ruler.set(xlim=(0, 100), ylim=(0, 1), yticks=[], xticks=range(0, 101, 10))
        ruler.bar(np.arange(0, 100, 10) + 5, 1, width=10, color=["black", "white"] * 5)
        ruler.tick_params(length=0, pad=1, labelsize=6)
        figure.text(
            (MARGIN_MM + 106) / width,
            (MARGIN_MM + 2) / height,
            "focalgradient calibration sheet. Print at 100 %: the ruler is 100 mm long. Mount it flat, facing the "
            "camera, "
            "filling the frame;\nlight it evenly. Use a tripod, raw or linear files and fixed focus; two or three "
            "distances, "
            "each at all f-numbers to be used.",
            fontsize=5.5,
            va="center",
        )
    return figure


def _texture(rows: int, columns: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return grey levels from 0.05 to 0.95, identical on every sheet."""
    frequency = np.hypot(np.fft.fftfreq(rows)[:, None], np.fft.rfftfreq(columns))
    white = np.fft.rfft2(np.random.default_rng(1987).standard_normal((rows, columns)))
    # The lowest frequencies have constant amplitude, which leaves more contrast for fine detail.
    spectrum = np.where(frequency > 0, white / np.maximum(frequency, 0.02), 0)
    field = np.fft.irfft2(spectrum, (rows, columns))
    return np.asarray(np.clip(0.5 + 0.2 * field / field.std(), 0.05, 0.95))
