"""Figure of statistical power by number of subjects."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from focalgradient.plotting.figures import BLUE, COLOURS, ORANGE, REFERENCE, laid_out

__all__ = ["power_figure"]

BESIDE = 0.012
"""Distance of the tests' points at one number of subjects, as a share of the range of subjects."""


def power_figure(
    subjects: Sequence[int],
    shares: Mapping[str, Sequence[tuple[float, float, float]]],
    widths: Mapping[str, Sequence[float]],
    width_label: str,
    *,
    logs: bool,
    share_label: str = "power (%)",
) -> Figure:
    """Draw the power of experiments with simulated subjects, and their interval widths, by number of subjects.

    Parameters
    ----------
    subjects
        Numbers of subjects.
    shares
        Power of each test at each number, with its interval; by the meaning of the test, "all tests" for all together.
    widths, width_label
        Widths of intervals at each number, by their description; and what they are.
    logs
        True if widths are ratios, of at least 1.
    share_label
        What the shares are of.
    """
    with laid_out(150, 75) as figure:
        left, right = figure.subplots(1, 2)
        handles, looks = [], {}
        for number, (meaning, intervals) in enumerate(shares.items()):
            share, low, high = np.transpose(intervals)
            whole = meaning == "all tests"
            look = {"color": "black" if whole else COLOURS[number % len(COLOURS)], "linestyle": ":" if whole else "-"}
            looks[meaning] = look
            bars = np.maximum([share - low, high - share], 0)
            apart = (number - (len(shares) - 1) / 2) * BESIDE * max(np.ptp(subjects), 1)
            places = np.add(subjects, apart)
            left.errorbar(places, 100 * share, 100 * bars, marker="o", markersize=4, capsize=2, **look)
            handles.append(left.plot([], [], marker="o", markersize=4, label=_folded(meaning), **look)[0])
        left.axhline(80, **REFERENCE)
        left.set(ylim=(0, 103), ylabel=share_label)
        figure.legend(handles=handles, loc="outside lower center", fontsize=7, handlelength=1.6, ncols=2)
        for (label, drawn), colour, marker in zip(widths.items(), (BLUE, ORANGE), ("o", "s"), strict=False):
            if not all(map(math.isnan, drawn)):
                own = {"color": colour, "marker": marker, "label": _folded(label)}
                right.plot(subjects, drawn, markersize=4, **(looks[label] | {"marker": "o"} if label in looks else own))
        right.set(ylabel=_folded(width_label, 30))
        least = 1 if logs else 0
        right.set_ylim(least, least + 1.05 * (right.get_ylim()[1] - least))
        named = right.get_legend_handles_labels()[1]
        if len(named) == 1:  # a second legend would explain the colour of the tests otherwise
            right.set_title(*named, fontsize=8)
        elif named:
            right.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2, fontsize=7)
        for ax in (left, right):
            ax.set(xlabel="subjects", xticks=subjects)
        left.set_title("simulated subjects", fontsize=8)
    return figure


def _folded(label: str, room: int = 34) -> str:
    """Return a label wrapped to lines of `room` letters."""
    return textwrap.fill(label, room)
