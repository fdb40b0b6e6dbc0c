"""Answers that compare two pictures: steps from flatter to deeper, or which of the two is deeper.

Each subject gives one number for each fixation and aperture: the mean step, or the share of choices for the picture.
Steps are analysed by a straight line on the aperture within each subject, and t over subjects; choices by a marginal
logistic model (GEE) with standard errors between subjects.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.statistics.marginal import marginal_slope
from focalgradient.statistics.means import family, only_difference, paired_effect, t_interval
from focalgradient.statistics.records import Effect, Interval, NotComputed
from focalgradient.statistics.tables import fixations_of, rating_table

__all__ = ["ComparisonMean", "ComparisonResult", "compare_pictures"]

Kind = Literal["bipolar", "choice"]


@dataclass(frozen=True, slots=True)
class ComparisonMean:
    """One aperture with one fixation: mean over subjects of their mean steps, or of their shares of choices."""

    fixation: str
    aperture: str
    aperture_mm: float
    subjects: int
    mean: Interval


@dataclass(frozen=True, slots=True)
class ComparisonResult:
    """Comparisons, analysed.

    Parameters
    ----------
    scale
        "bipolar" or "choice".
    participants, trials
        Who, and how many answers; catch trials are not counted.
    means
        By fixation and aperture.
    fixations
        Those present, nearest first.
    slopes
        Of each: steps for a millimetre of aperture; of choices, log odds for a millimetre.
    against_reference
        Of each, at the largest aperture: mean step against 0; share of choices against one half.
    interaction
        The slope with the nearest object in focus less that with the farthest, of each subject: of steps only, and
        where there are two fixations.
    differences
        Of more than two fixations: the difference of the slopes of each pair, by their names.

    Notes
    -----
    Slopes with their difference are one family for Holm's correction, the comparisons with the reference another.
    """

    scale: Kind
    participants: tuple[str, ...]
    trials: int
    means: tuple[ComparisonMean, ...]
    fixations: tuple[str, ...]
    slopes: tuple[Effect | NotComputed, ...]
    against_reference: tuple[Effect | NotComputed, ...]
    interaction: Effect | NotComputed
    differences: Mapping[tuple[str, str], Effect | NotComputed]


def compare_pictures(table: pd.DataFrame, scale: Kind) -> ComparisonResult:
    """Analyse answers of the scales "bipolar" and "choice".

    Parameters
    ----------
    table
        As for `focalgradient.statistics.tables.rating_table`; `rating` is a step (0: alike), or 1 where the picture was
        judged deeper than the reference and 0 where not. Catch trials are left out.
    scale
        Which.

    Raises
    ------
    InputError
        If the table cannot be read without guessing, or there are only catch trials.

    Examples
    --------
    >>> rows = [
    ...     {"participant_id": who, "trial": trial, "scene": "room", "aperture": name, "aperture_mm": mm,
    ...      "fixation": "nearest", "rating": round((0.2 + 0.05 * who) * mm), "catch": False}
    ...     for who in range(4) for trial, (name, mm) in enumerate([("pinhole", 0.0), ("f/11", 4.5), ("f/5.6", 8.9)])
    ... ]
    >>> found = compare_pictures(pd.DataFrame(rows), "bipolar")
    >>> round(found.slopes[0].estimate, 2), round(found.means[-1].mean.estimate, 1)
    (0.28, 2.5)
    """
    table = rating_table(table, scale)
    table = table[~table["catch"]]
    if table.empty:
        raise InputError("All trials are catch trials: there are no answers to analyse.")
    present = fixations_of(table)
    of = {name: table[table["fixation"] == name] for name in present}
    lines = {name: _lines(rows) for name, rows in of.items()}
    differences: dict[tuple[str, str], Effect | NotComputed] = {}
    if scale == "choice":
        slopes: list[Effect | NotComputed] = [_odds(rows) for rows in of.values()]
    else:
        slopes = [
            paired_effect(line.to_numpy(), "subjects' own straight lines, t over subjects") for line in lines.values()
        ]
        for one, other in combinations(present, 2):
            both = (lines[one] - lines[other]).dropna()
            differences[one, other] = paired_effect(
                both.to_numpy(), "subjects' own straight lines, paired t over subjects"
            )
    tests = family([*slopes, *differences.values()])
    differences = dict(zip(differences, tests[len(slopes) :], strict=True))
    return ComparisonResult(
        scale,
        tuple(sorted(set(table["participant_id"]))),
        len(table),
        _means(table),
        present,
        tuple(tests[: len(slopes)]),
        tuple(family(_largest(rows, scale) for rows in of.values())),
        only_difference(differences) if scale == "bipolar" else CHOICES,
        differences if len(present) > 2 else {},
    )


CHOICES = NotComputed("Slopes of choices are compared for steps only.")


def _lines(rows: pd.DataFrame) -> pd.Series[float]:
    """Least-squares slope of each subject's answers on the aperture in millimetres."""

    def slope(own: pd.DataFrame) -> float:
        amount, answer = own["aperture_mm"].to_numpy(float), own["rating"].to_numpy(float)
        away = amount - amount.mean()
        return float(away @ answer / (away @ away)) if np.ptp(amount) else math.nan

    found = {name: slope(own) for name, own in rows.groupby("participant_id")}
    return pd.Series(found, dtype=float).dropna()


def _odds(rows: pd.DataFrame) -> Effect | NotComputed:
    subject: NDArray[np.int_] = pd.factorize(rows["participant_id"], sort=True)[0]
    return marginal_slope(rows["rating"].to_numpy(float), rows["aperture_mm"].to_numpy(float), subject)


def _largest(rows: pd.DataFrame, scale: Kind) -> Effect | NotComputed:
    own = rows[rows["aperture_mm"] == rows["aperture_mm"].max()].groupby("participant_id")["rating"].mean().to_numpy()
    return paired_effect(own - (0.5 if scale == "choice" else 0.0), "one-sample t over subjects")


def _means(table: pd.DataFrame) -> tuple[ComparisonMean, ...]:
    found = []
    for fixation in fixations_of(table):
        rows = table[table["fixation"] == fixation]
        names = rows.drop_duplicates("aperture_mm").sort_values("aperture_mm")
        for mm, name in zip(names["aperture_mm"], names["aperture"], strict=True):
            cell = rows[rows["aperture_mm"] == mm]
            own = cell.groupby("participant_id")["rating"].mean().to_numpy(float)
            found.append(ComparisonMean(fixation, str(name), float(mm), len(own), t_interval(own)))
    return tuple(found)
