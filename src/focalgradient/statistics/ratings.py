"""Experiment 1: whether a scene looks deeper with more blur, the nearest object in focus or the farthest.

Ratings are ratios to a standard, so everything is done on their logarithm, and said as ratios. Subjects are what the
results are meant to hold beyond: every interval and test is over subjects.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.statistics.hypotheses import Equivalence, Trend, equivalence, trend
from focalgradient.statistics.means import bootstrap_interval, family, paired_effect, within_half_widths
from focalgradient.statistics.ordinal import ordinal_slope
from focalgradient.statistics.records import Effect, Interval, NotComputed
from focalgradient.statistics.slopes import design_matrix, mixed_slope, own_slopes, two_stage_slope
from focalgradient.statistics.tables import FIXATIONS, rating_table

__all__ = ["DepthRatingResult", "FixationResult", "RatingMean", "Scale", "SubjectMean", "depth_rating"]

Scale = Literal["ratio", "ordinal"]
"""What the ratings are: ratios to the standard, or steps in order (whole numbers)."""


@dataclass(frozen=True, slots=True)
class SubjectMean:
    """One subject's answers to one aperture with one fixation.

    Parameters
    ----------
    participant_id, fixation, aperture, aperture_mm
        Whose and which.
    trials
        How many answers.
    rating
        Their geometric mean.
    ratio
        Over the subject's own with the pinhole; None where there is none.
    """

    participant_id: str
    fixation: str
    aperture: str
    aperture_mm: float
    trials: int
    rating: float
    ratio: float | None


@dataclass(frozen=True, slots=True)
class RatingMean:
    """One aperture with one fixation, over subjects.

    Parameters
    ----------
    fixation, aperture, aperture_mm
        Which.
    subjects
        With answers to it.
    rating
        Geometric mean over subjects, with the within-subject interval (Cousineau and Morey).
    ratio
        Geometric mean of the subjects' ratios to the pinhole, with the bootstrap interval over subjects (BCa).
    against_pinhole
        Test of the logarithm of that ratio, corrected by Holm over all apertures and fixations.
    """

    fixation: str
    aperture: str
    aperture_mm: float
    subjects: int
    rating: Interval
    ratio: Interval | NotComputed
    against_pinhole: Effect | NotComputed


@dataclass(frozen=True, slots=True)
class FixationResult:
    """How ratings change with blur, with one object in focus.

    Parameters
    ----------
    fixation
        The object in focus.
    slope
        Change of the logarithm of the rating for a millimetre of aperture (mixed model).
    two_stage
        The same from the subjects' own slopes: a check, with more power where subjects hardly differ.
    rise
        What that makes at the largest aperture, as a ratio to no blur.
    trend
        Whether ratings rise in the order of the apertures: Page's test, and one over subjects.
    equivalence
        Whether the logarithm of the rise is as good as none, within the bound stated in advance.
    ordinal
        Change of the log odds of a higher answer for a millimetre of aperture, where the scale was ordinal.
    """

    fixation: str
    slope: Effect | NotComputed
    two_stage: Effect | NotComputed
    rise: Interval | NotComputed
    trend: Trend | NotComputed
    equivalence: Equivalence | NotComputed
    ordinal: Effect | NotComputed


@dataclass(frozen=True, slots=True)
class DepthRatingResult:
    """What the depth ratings say.

    Parameters
    ----------
    participants
        Who gave them, in order.
    trials
        How many ratings were analysed; catch trials are not.
    scale
        What the ratings are.
    largest_mm
        The largest aperture.
    subject_means
        Every subject's geometric means.
    means
        Those over subjects: on the ratio scale only.
    fixations
        The results of each fixation present.
    interaction
        Mean over subjects of the slope with the nearest object in focus less that with the farthest.
    remarks
        What was left out of which result and why, a sentence each.

    Notes
    -----
    Two families are corrected by Holm: the slopes with their interaction, and the comparisons with the pinhole. The
    equivalence test asks its own question.
    """

    participants: tuple[str, ...]
    trials: int
    scale: Scale
    largest_mm: float
    subject_means: tuple[SubjectMean, ...]
    means: tuple[RatingMean, ...]
    fixations: tuple[FixationResult, ...]
    interaction: Effect | NotComputed
    remarks: tuple[str, ...]


def depth_rating(table: pd.DataFrame, *, equivalence_bound: float, scale: Scale = "ratio") -> DepthRatingResult:
    """Analyse depth ratings.

    Parameters
    ----------
    table
        One row a trial: see `focalgradient.statistics.tables.rating_table`. Catch trials are left out.
    equivalence_bound
        The smallest increase at the largest aperture that would matter, as a ratio above 1 and stated before the data
        were seen: at 1.2, a rise between 1 / 1.2 and 1.2 is as good as none.
    scale
        "ordinal" for answers in steps: then ratios mean nothing, and order and the cumulative-link model remain.

    Returns
    -------
    DepthRatingResult
        Where something could not be computed, a `NotComputed` says why.

    Raises
    ------
    InputError
        If the table cannot be read without guessing, naming the row, or the bound is not above 1.

    Examples
    --------
    >>> rows = [
    ...     {"participant_id": who, "trial": trial, "scene": "room", "aperture": name, "aperture_mm": mm,
    ...      "fixation": "nearest", "rating": 1 + (0.1 + 0.02 * who) * mm, "catch": False}
    ...     for who in range(4) for trial, (name, mm) in enumerate([("pinhole", 0.0), ("f/11", 4.5), ("f/5.6", 8.9)])
    ... ]
    >>> result = depth_rating(pd.DataFrame(rows), equivalence_bound=1.2)
    >>> round(result.means[-1].ratio.estimate, 2), result.fixations[0].equivalence.equivalent
    (2.15, False)
    """
    if not (isinstance(equivalence_bound, int | float) and 1 < equivalence_bound < math.inf):
        raise InputError(
            f"equivalence_bound is {equivalence_bound!r}, but must be a ratio above 1: the smallest increase "
            "that matters."
        )
    table = rating_table(table)
    table = table[~table["catch"]]
    if table.empty:
        raise InputError("All trials are catch trials: there are no ratings to analyse.")
    if scale == "ordinal" and (table["rating"] % 1 != 0).any():
        raise InputError(
            'With scale="ordinal" ratings must be whole numbers, the steps of the scale, and some are not.'
        )
    table = table.assign(answer=np.log(table["rating"]), aperture=table["aperture"].astype(str))
    remarks: list[str] = []
    present = [fixation for fixation in FIXATIONS if (table["fixation"] == fixation).any()]
    fixations = [_fixation(table, fixation, equivalence_bound, scale, remarks) for fixation in present]
    interaction = _interaction(table, scale)
    slopes = family([*(result.slope for result in fixations), interaction])
    return DepthRatingResult(
        participants=tuple(sorted(set(table["participant_id"]))),
        trials=len(table),
        scale=scale,
        largest_mm=float(table["aperture_mm"].max()),
        subject_means=_subject_means(table),
        means=_means(table, remarks) if scale == "ratio" else (),
        fixations=tuple(replace(result, slope=slope) for result, slope in zip(fixations, slopes, strict=False)),
        interaction=slopes[-1],
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _fixation(table: pd.DataFrame, fixation: str, bound: float, scale: Scale, remarks: list[str]) -> FixationResult:
    rows = table[table["fixation"] == fixation]
    subject, design = pd.factorize(rows["participant_id"], sort=True)[0], _design(rows, remarks)
    largest = float(rows["aperture_mm"].max())
    slope: Effect | NotComputed
    two_stage: Effect | NotComputed
    rise: Interval | NotComputed
    equal: Equivalence | NotComputed
    ordinal: Effect | NotComputed
    if scale == "ratio":
        slope, two_stage = (fit(rows["answer"].to_numpy(), design, subject) for fit in (mixed_slope, two_stage_slope))
        ordinal = NotComputed("The ratings are ratios: the ordinal analysis is for answers in steps.")
    else:
        slope = two_stage = NotComputed("The scale is ordinal: its steps have no ratios.")
        ordinal = ordinal_slope(rows["rating"].to_numpy().astype(int), design, subject)
    if isinstance(slope, NotComputed):
        rise = equal = slope
    else:
        rise = _exponential(Interval(largest * slope.estimate, largest * slope.low, largest * slope.high))
        equal = equivalence(largest * slope.estimate, largest * slope.standard_error, slope.subjects, math.log(bound))
    cells = rows.pivot_table(index="participant_id", columns="aperture_mm", values="answer", aggfunc="mean")
    whole = cells.dropna()
    if len(whole) < len(cells):
        left = _names(cells.index.difference(whole.index))
        remarks.append(f"Page's test ({fixation}) leaves out {left}: no answers to some aperture.")
    return FixationResult(fixation, slope, two_stage, rise, trend(whole), equal, ordinal)


def _design(rows: pd.DataFrame, remarks: list[str]) -> np.ndarray:
    """Blur and scenes; without the scenes where each was shown with one aperture only, so that they cannot be told."""
    amount = rows["aperture_mm"].to_numpy()
    design = design_matrix(amount, rows["scene"].to_numpy(dtype=object))
    if np.linalg.matrix_rank(design[:, 1:] - design[:, 1:].mean(axis=0)) == design.shape[1] - 1 or np.ptp(amount) == 0:
        return design
    remarks.append("Scenes and apertures cannot be told apart: the slopes are not corrected for scenes.")
    return design[:, :2]


def _interaction(table: pd.DataFrame, scale: Scale) -> Effect | NotComputed:
    """The subjects' own differences of slopes.

    A mixed model of the interaction has ten variances and covariances, more than a few subjects can tell; in a balanced
    design its test is this one.
    """
    if scale == "ordinal":
        return NotComputed("The scale is ordinal: its steps have no ratios.")
    slopes = {}
    for fixation in FIXATIONS:
        rows = table[table["fixation"] == fixation]
        if rows.empty:
            return NotComputed(f"No trials have the {fixation} object fixated: there is nothing to compare.")
        subject, names = pd.factorize(rows["participant_id"], sort=True)
        own = own_slopes(rows["answer"].to_numpy(), _design(rows, []), subject)
        slopes[fixation] = pd.Series(own, index=names)
    near, far = (slopes[fixation] for fixation in FIXATIONS)
    return paired_effect(
        (near - far).dropna().to_numpy(),
        "least-squares slopes of each subject's own, nearest less farthest in focus, t-test of their mean",
    )


def _subject_means(table: pd.DataFrame) -> tuple[SubjectMean, ...]:
    cells = table.groupby(["participant_id", "fixation", "aperture_mm", "aperture"])["answer"].agg(["size", "mean"])
    rows = [(*key, size, mean) for key, size, mean in cells.itertuples()]
    sharp = {(participant, fixation): mean for participant, fixation, mm, _, _, mean in rows if mm == 0}

    def ratio(participant: str, fixation: str, mean: float) -> float | None:
        reference = sharp.get((participant, fixation))
        return None if reference is None else math.exp(mean - reference)

    means = [
        SubjectMean(who, fixation, name, float(mm), int(size), math.exp(mean), ratio(who, fixation, mean))
        for who, fixation, mm, name, size, mean in rows
    ]
    return tuple(
        sorted(means, key=lambda mean: (mean.participant_id, FIXATIONS.index(mean.fixation), mean.aperture_mm))
    )


def _means(table: pd.DataFrame, remarks: list[str]) -> tuple[RatingMean, ...]:
    cells = table.pivot_table(
        index="participant_id", columns=["fixation", "aperture_mm"], values="answer", aggfunc="mean"
    )
    aperture = table.drop_duplicates("aperture_mm").set_index("aperture_mm")["aperture"].sort_index()
    keys = [(fixation, float(mm)) for fixation in FIXATIONS for mm in aperture.index if (fixation, mm) in cells]
    whole = cells.dropna()
    if len(whole) < len(cells):
        left = _names(cells.index.difference(whole.index))
        remarks.append(f"The within-subject intervals leave out {left}: no answers to some aperture.")
    widths = within_half_widths(whole[keys]) if len(whole) else np.full(len(keys), np.nan)
    means, tests = [], []
    for (fixation, mm), width in zip(keys, widths, strict=True):
        level = float(cells[fixation, mm].mean())
        ends = (level - width, level + width) if math.isfinite(width) else (None, None)
        ratio: Interval | NotComputed
        test: Effect | NotComputed
        if mm == 0:
            ratio, test = Interval(1.0, 1.0, 1.0), NotComputed("The pinhole is what the others are compared with.")
        elif (fixation, 0.0) not in cells:
            ratio = test = NotComputed(
                f"No pinhole trials have the {fixation} object fixated: there is no ratio to them."
            )
        elif (logs := (cells[fixation, mm] - cells[fixation, 0.0]).dropna()).empty:
            ratio = test = NotComputed(f"No subject has both {aperture[mm]} and pinhole trials.")
        else:
            ratio = _exponential(bootstrap_interval(logs))
            test = paired_effect(logs, "paired t-test of the logarithms")
        tests.append(test)
        subjects = int(cells[fixation, mm].notna().sum())
        rating = _exponential(Interval(level, *ends))
        means.append(RatingMean(fixation, str(aperture[mm]), mm, subjects, rating, ratio, test))
    return tuple(replace(mean, against_pinhole=test) for mean, test in zip(means, family(tests), strict=True))


def _exponential(logs: Interval) -> Interval:
    low, high = (None if end is None else math.exp(end) for end in (logs.low, logs.high))
    return Interval(math.exp(logs.estimate), low, high)


def _names(index: pd.Index) -> str:
    return ", ".join(map(str, index))
