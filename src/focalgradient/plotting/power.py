"""Figure of statistical power by number of subjects."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from focalgradient.plotting.figures import BLUE, COLOURS, ORANGE, REFERENCE, laid_out
from focalgradient.power import Power, Study, share_interval

__all__ = ["power_figure"]

BESIDE = 0.012
"""Distance of the tests' points at one number of subjects, as a share of the range of subjects."""


def power_figure(powers: Sequence[Power], study: Study) -> Figure:
    """Draw the power of experiments with simulated subjects, and their interval widths, by number of subjects."""
    with laid_out(150, 75) as figure:
        left, right = figure.subplots(1, 2)
        subjects = [power.subjects for power in powers]
        handles = []
        drawn = {meaning: [power.found[name] for power in powers] for name, meaning in study.tests.items()}
        if len(study.tests) > 1:
            drawn["all tests"] = [power.joint for power in powers]
        for number, (meaning, shares) in enumerate(drawn.items()):
            whole = meaning == "all tests"
            look = {"color": "black" if whole else COLOURS[number % len(COLOURS)], "linestyle": ":" if whole else "-"}
            ends = [share_interval(share, power.experiments) for share, power in zip(shares, powers, strict=True)]
            bars = [
                (max(share - low, 0), max(high - share, 0)) for share, (low, high) in zip(shares, ends, strict=True)
            ]
            apart = (number - (len(drawn) - 1) / 2) * BESIDE * max(np.ptp(subjects), 1)
            left.errorbar(
                np.add(subjects, apart),
                [100 * share for share in shares],
                100 * np.transpose(bars),
                marker="o",
                markersize=4,
                capsize=2,
                **look,
            )
            handles.append(left.plot([], [], marker="o", markersize=4, label=_folded(meaning), **look)[0])
        left.axhline(80, **REFERENCE)
        left.set(ylim=(0, 103), ylabel="power (%)")
        figure.legend(handles=handles, loc="outside lower center", fontsize=7, handlelength=1.6, ncols=2)
        for name, colour, marker, label in zip(
            ("width", "far_width"), (BLUE, ORANGE), ("o", "s"), study.widths, strict=True
        ):
            widths = [getattr(power, name) for power in powers]
            if not all(map(math.isnan, widths)):
                right.plot(subjects, widths, marker + "-", color=colour, markersize=4, label=_folded(label))
        right.set(ylabel=_folded(study.model.width_label, 30))
        least = 1 if study.model.logs else 0
        right.set_ylim(least, least + 1.05 * (right.get_ylim()[1] - least))
        right.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2, fontsize=7)
        for ax in (left, right):
            ax.set(xlabel="subjects", xticks=subjects)
        left.set_title("simulated subjects", fontsize=8)
    return figure


def _folded(label: str, room: int = 34) -> str:
    """Return a label wrapped to lines of `room` letters."""
    return textwrap.fill(label, room)
