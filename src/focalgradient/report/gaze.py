"""Section of the report on gaze: how often it left the fixated object, and the results without those trials."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from focalgradient.report.analysed import Ratings
from focalgradient.report.document import Block, Heading, Paragraph
from focalgradient.report.provenance import listed
from focalgradient.report.tables import EFFECTS, Sheet
from focalgradient.statistics import NotComputed

__all__ = ["findings", "gaze_part"]


def findings(part: Ratings) -> Iterator[str]:
    """Yield the results of an analysis in sentences, for any scale."""
    if isinstance(part.main, NotComputed):
        yield part.main.reason
    else:
        yield from part.main.answers.sentences(*EFFECTS)


def gaze_part(part: Ratings, sheets: list[Sheet]) -> Iterator[Block]:
    """Yield a count of trials in which gaze left the fixated object, and the findings without them, given gaze data."""
    if part.data is None or part.fixated is None:
        return
    designs = [sidecar["Design"] for sidecar in part.data.sidecars.values()]
    degrees = float(designs[0].get("gaze_within_deg", 0.0))
    rows = part.table[~part.table["catch"]]
    left = int(rows["gaze_left"].sum())
    yield Heading("Gaze", 3)
    yield Paragraph(
        f"In {left:,} of {len(rows):,} trials a fixation of the eyes was more than {degrees:g} degrees away from the "
        "fixated object while pictures were shown, or the eyes were not found (column gaze_left). The results above "
        "are of all trials."
    )
    sheet = _by_subject(rows)
    sheets.append(sheet)
    if sheet.table:
        yield sheet.table
    if isinstance(part.fixated, NotComputed):
        yield Paragraph(part.fixated.reason)
    else:
        for number, sentence in enumerate(findings(part.fixated)):
            yield Paragraph(f"Without those trials: {sentence}" if number == 0 else sentence)


def _by_subject(rows: pd.DataFrame) -> Sheet:
    cells = []
    for name, own in rows.groupby("participant_id"):
        away = own["gaze_away"].dropna()
        middle = "" if away.empty else f"{away.median():.2f}"
        cells.append([str(name), str(len(own)), str(int(own["gaze_left"].sum())), str(len(own) - len(away)), middle])
    caption = "Gaze: trials that left the fixated object, and how far fixations were from it at most (median)"
    head = ["subject", "trials", "left", "not known", "farthest (deg)"]
    return listed("gaze.csv", caption, head, cells)
