"""Published experiments with predictions of a simulated observer, scored by a rule stated beforehand.

The table is also written as ``published.csv``, with sources and the reasons why an observer cannot be asked.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from report import Progress, Shown, alone

from focalgradient.observers import OBSERVERS
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style
from focalgradient.published import (
    AGREES,
    CANNOT_BE_ASKED,
    DIFFERS,
    EXPERIMENTS,
    UNDECIDED,
    Row,
    csv_of,
    kruger1993,
    predicted_beside_published,
)
from focalgradient.published.following import PAIRS as ALL_PAIRS

COLOURS = {AGREES: "black", DIFFERS: ORANGE, UNDECIDED: BLUE, CANNOT_BE_ASKED: GREY}
PLACES = {
    "Experiment": 0.0,
    "Quantity": 0.235,
    "Published": 0.612,
    "Read from": 0.687,
    "Simulated": 0.757,
    "Score": 0.845,
    "Independent": 0.925,
}
LINE_MM = 4.6


PAIRS = 3  # pairs of accommodation trials without --full or --pairs


def make(
    *, full: bool = False, pairs: int | None = None, kept: Path | None = None, progress: Progress | None = None
) -> Shown:
    """Make the table; `pairs` of accommodation trials (24 with `full`) are cached in a folder."""
    report = None if progress is None else lambda share, words: progress(share)
    count_pairs = pairs or (ALL_PAIRS if full else PAIRS)
    accommodation = kruger1993(count_pairs, kept)
    experiments = {**EXPERIMENTS, accommodation.key: accommodation}
    rows = predicted_beside_published(OBSERVERS["default"], [*experiments.values()], report)
    count = Counter(row.score for row in rows)
    independent = sum(row.score == AGREES and not row.finding.taken for row in rows)
    return Shown(
        title="Published experiments, and what a simulated observer predicts",
        caption=(
            "Each finding was recorded with its range of agreement before any prediction was computed. A prediction "
            "agrees if it lies inside that range with 2 of its standard errors on either side: a printed range, 2 "
            "standard errors about a printed mean, or the printed side of no effect; it is undecided if an end of the "
            "range lies among them. Results read from an abstract only are marked.",
            f"Of {len(rows)} findings the simulated default observer agrees with {count[AGREES]} and differs from "
            f"{count[DIFFERS]}; {count[UNDECIDED]} are undecided and {count[CANNOT_BE_ASKED]} cannot be asked. "
            f"Of those that agree {independent} are independent: of the others something of the observer was taken "
            f"from the finding or its like, as the table says. Accommodation: {count_pairs} pairs of trials. "
            "Simulated; no people took part.",
        ),
        figure=_draw(rows),
        summary={score: count[score] for score in COLOURS} | {"agree and are independent": independent},
        plotted={
            "quantity": [row.finding.quantity for row in rows],
            "predicted (simulated)": [row.predicted.value if row.predicted else None for row in rows],
            "score": [row.score for row in rows],
        },
        table=csv_of(rows),
    )


def _independent(row: Row) -> str:
    if row.predicted is None:
        return ""
    return "no" if row.finding.taken else "yes"


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
            cells = (
                "" if name == last else name,
                one.quantity + units,
                row.range,
                one.source,
                row.stated,
                row.score,
                _independent(row),
            )
            for place, words in zip(PLACES.values(), cells, strict=True):
                colour = COLOURS[row.score] if place >= PLACES["Simulated"] else "black"
                ax.text(place, number + 0.7, words, va="center", fontsize=6.5, color=colour)
            last = name
        figure.text(0.99, 0.008, "a simulated observer", ha="right", va="bottom", fontsize=7)
    return figure


if __name__ == "__main__":
    alone(
        "published",
        make,
        pairs=(
            int,
            f"pairs of trials of accommodation, about 10 s each (default: {PAIRS}, or {ALL_PAIRS} with --full)",
        ),
        kept=(Path, "folder for these: a run that was cut off goes on from there; empty it for another model"),
    )
