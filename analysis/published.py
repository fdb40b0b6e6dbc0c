"""Published experiments beside what a simulated observer predicts, scored by a rule that was stated beforehand.

The table is written as ``published.csv``, too, with what was read where and why an observer cannot be asked.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from matplotlib.figure import Figure
from report import Progress, Shown, alone

from focalgradient.observers import OBSERVERS
from focalgradient.plotting import GREY, ORANGE, new_figure, style
from focalgradient.published import (
    AGREES,
    CANNOT_BE_ASKED,
    DIFFERS,
    Row,
    csv_of,
    predicted_beside_published,
)

COLOURS = {AGREES: "black", DIFFERS: ORANGE, CANNOT_BE_ASKED: GREY}
PLACES = {"Experiment": 0.0, "Quantity": 0.215, "Published": 0.58, "Read from": 0.68, "Simulated": 0.77, "Score": 0.87}
LINE_MM = 4.6


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = None if progress is None else lambda share, words: progress(share)
    rows = predicted_beside_published(OBSERVERS["default"], progress=report)
    count = Counter(row.score for row in rows)
    return Shown(
        title="Published experiments, and what a simulated observer predicts",
        caption=(
            "Each finding was recorded with its range of agreement before any prediction was computed. A prediction "
            "agrees if it lies inside that range with 2 of its standard errors on either side: a printed range, 2 "
            "standard errors about a printed mean, or the printed side of no effect. Whatever was read from an "
            "abstract only, or is remembered, says so.",
            f"Of {len(rows)} findings the simulated default observer agrees with {count[AGREES]} and differs from "
            f"{count[DIFFERS]}; {count[CANNOT_BE_ASKED]} cannot be asked. Agreement with Mather, Mather and "
            "Smith, Marshall et al. and Watson and Ahumada is not independent: the observer's Weber fraction, "
            "intrinsic blur and rule of the border's owner were taken from them. Simulated; no people took part.",
        ),
        figure=_draw(rows),
        summary={score: count[score] for score in COLOURS},
        plotted={
            "quantity": [row.finding.quantity for row in rows],
            "predicted (simulated)": [row.predicted.value if row.predicted else None for row in rows],
            "score": [row.score for row in rows],
        },
        table=csv_of(rows),
    )


def _draw(rows: Sequence[Row]) -> Figure:
    with style():
        figure = new_figure(280, LINE_MM * (len(rows) + 3))
        ax = figure.add_axes((0.01, 0.01, 0.98, 0.98))
        ax.set_axis_off()
        ax.set(xlim=(0, 1), ylim=(len(rows) + 1.2, -1))
        for name, place in PLACES.items():
            ax.text(place, -0.4, name, weight="bold", va="center")
        ax.axhline(0.1, color=GREY, linewidth=0.8)
        last = ""
        for number, row in enumerate(rows):
            name = row.experiment.short
            one = row.finding
            units = "" if one.units == "1" else f" ({one.units})"
            cells = ("" if name == last else name, one.quantity + units, row.range, one.source, row.stated, row.score)
            for place, words in zip(PLACES.values(), cells, strict=True):
                colour = COLOURS[row.score] if place >= PLACES["Simulated"] else "black"
                ax.text(place, number + 0.7, words, va="center", fontsize=6.5, color=colour)
            last = name
        figure.text(0.99, 0.008, "a simulated observer", ha="right", va="bottom", fontsize=7)
    return figure


if __name__ == "__main__":
    alone("published", make)
