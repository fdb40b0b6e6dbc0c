"""Import of yes/no detection data, with optional confidence ratings, from the user's own table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.user_tables.files import Paths
from focalgradient.user_tables.imported import ImportedAnswers
from focalgradient.user_tables.names import few
from focalgradient.user_tables.schema import DETECTION
from focalgradient.user_tables.source import Source, Where, columns_like, completed
from focalgradient.user_tables.trials import note_order

__all__ = ["OwnDetection", "read_detection"]

MOST_STEPS = 10
"""Maximum number of confidence steps: with more, each would be used too rarely for an ROC."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnDetection(ImportedAnswers):
    """Imported detection data, in the form that `focalgradient.statistics.detection_by_person` accepts.

    The columns are participant_id, session, condition, signal, answer, catch, kind, and optionally confidence from 1
    (lowest) to `steps`.

    Parameters
    ----------
    steps
        Number of confidence steps; 0 without confidence.
    """

    steps: int = 0


def read_detection(
    path: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    where: Where | None = None,
    order: Sequence[str] = (),
) -> OwnDetection:
    r"""Read detection data from a CSV, TSV or XLSX file with one row per trial.

    Parameters
    ----------
    path
        CSV, TSV, XLSX or JSON file, or several of one data set.
    columns
        Name in the file of each column: participant, signal (1 if present, else 0), response (1 for "yes", 0 for "no");
        optionally confidence (integers or ordered steps, at most 10), condition, session, catch. In the place of
        response and confidence, rating: whole numbers from the surest no to the surest yes, an even number of steps.
    conditions
        Meanings of the file's own words in signal, response and catch: {"links": "1", "keine Antwort": "NA"}.
    where
        Values by column: only rows that have one of them are read.
    order
        Words of the confidence, from the least to the most.

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid; the message names it.

    Examples
    --------
    >>> from focalgradient.user_tables.files import text_table
    >>> answers = read_detection(text_table("subject,signal,response,confidence\nA,1,yes,4\nA,0,no,2\n"))
    >>> answers.table[["participant_id", "signal", "answer", "confidence"]].values.tolist(), answers.steps
    ([['A', True, True, 2], ['A', False, False, 1]], 2)
    >>> rated = read_detection(text_table("subject,signal,rating\nA,1,4\nA,0,1\nA,0,2\n"))
    >>> rated.table[["answer", "confidence"]].values.tolist(), rated.steps
    ([[True, 2], [False, 2], [False, 1]], 2)
    """
    source = Source.read(path, DETECTION, columns, where, conditions)
    source.require()
    table = source.without_pasted(source.rows(), ("condition", "signal"), ("response", "confidence", "rating"))
    is_rated = "response" not in table
    table = source.answers(table, "rating" if is_rated else "response", order if is_rated else ())
    table = table.assign(signal=source.truths(table, "signal"))
    if is_rated:
        table, steps = _of_ratings(source, table)
    else:
        table, steps = _in_steps(source, table.assign(answer=source.truths(table, "response")), order)
    if table["signal"].nunique() < 2:
        shown = "signals" if table["signal"].all() else "noise"
        raise InputError(f"{source.name} has trials with {shown} only: give trials with signal and trials without.")
    table = completed(source.with_catch(table), "session", "condition", "kind")
    note_order(table[["participant_id", "session", "condition"]], ["condition"], source.notices)
    kept = ["participant_id", "session", "condition", "signal", "answer", "catch", "kind"]
    kept += ["confidence"] * bool(steps)
    return OwnDetection.of(source, table[kept].copy(), steps=steps)


def _of_ratings(source: Source, table: pd.DataFrame) -> tuple[pd.DataFrame, int]:
    """Return answers and confidence by ratings from the surest no to the surest yes, and the steps of confidence.

    Raises
    ------
    InputError
        If ratings are not from 1 to an even number of `2 * MOST_STEPS` at most, or lack one of the ends.
    """
    least, most = table["rating"].min(), table["rating"].max()
    if least != 1 or most % 2 or not 2 < most <= 2 * MOST_STEPS or (table["rating"] % 1).any():
        raise InputError(
            f"{source.name}: ratings of signal and noise are from {least:g} to {most:g}, but must be whole numbers "
            f"from 1 (surest no) to an even number up to {2 * MOST_STEPS} (surest yes): give response and confidence."
        )
    steps = int(most) // 2
    source.notices.append(f"Ratings from {steps + 1} to {2 * steps} were taken for yes, the others for no.")
    is_yes = table["rating"] > steps
    sure = (table["rating"] - steps).where(is_yes, steps + 1 - table["rating"]).astype(int)
    return table.assign(answer=is_yes, confidence=sure), steps


def _in_steps(source: Source, table: pd.DataFrame, order: Sequence[str]) -> tuple[pd.DataFrame, int]:
    """Recode confidence as 1, 2, ... in ascending order; return the table and the number of steps."""
    if "confidence" not in table:
        return table, 0
    table = source.answers(table, "confidence", order)
    levels = sorted(set(table["confidence"]))
    if len(levels) > MOST_STEPS:
        raise InputError(
            f"{source.name} has {len(levels)} values of confidence, but may have {MOST_STEPS} at most: give it in "
            f"steps, or leave it out ({columns_like('confidence')} names another column)."
        )
    if len(levels) < 2:
        source.notes.append("Confidence is the same in all trials: it is not analysed.")
        return table.drop(columns="confidence"), 0
    if levels != list(range(1, len(levels) + 1)):
        source.notes.append(f"Steps of confidence, from the least: {few([f'{level:g}' for level in levels])}.")
    steps = {level: step for step, level in enumerate(levels, start=1)}
    return table.assign(confidence=table["confidence"].map(steps)), len(levels)
