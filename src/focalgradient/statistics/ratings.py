"""Experiment 1: effect of blur on rated depth, with the nearest or the farthest object in focus.

Ratings are ratios to a standard and are analysed on their logarithm; results are reported as ratios. The main test has
random subjects and scenes, so that it generalises over both; a test for these scenes only is reported next to it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal

import numpy as np
import pandas as pd

from focalgradient.analyses import Analysis, OrdinalSteps, Ratios, analysis_named
from focalgradient.errors import InputError
from focalgradient.progress import Progress
from focalgradient.statistics.bootstrap import BootstrapT
from focalgradient.statistics.cells import Cells, cells_of, less, rises
from focalgradient.statistics.crossed import Components, components
from focalgradient.statistics.hypotheses import Equivalence, check_bound
from focalgradient.statistics.means import t_interval, within_half_widths
from focalgradient.statistics.ordinal import OrdinalResult, ordinal_rating
from focalgradient.statistics.questions import HERE, NO_ANSWERS, Answers, stated
from focalgradient.statistics.rating_questions import (
    BOOTSTRAP,
    DIFFERENCE,
    EFFECT,
    EQUIVALENT,
    PINHOLE,
    SLOPE,
    rating_questions,
)
from focalgradient.statistics.records import Effect, Interval, NotComputed, summed
from focalgradient.user_tables.tidy import FIXATIONS, fixations_of, main_trials

__all__ = ["DepthRatingResult", "FixationResult", "RatingMean", "Scale", "SceneMean", "SubjectMean", "depth_rating"]


Scale = Literal["ratio", "ordinal"]
"""Names of the analyses of `depth_rating`: ratios to the standard, or ordinal steps (integers)."""


@dataclass(frozen=True, slots=True)
class SubjectMean:
    """Answers of one subject at one aperture and fixation.

    Parameters
    ----------
    participant_id, fixation, aperture, aperture_mm
        Subject and condition.
    trials
        Number of answers.
    rating
        Geometric mean of the answers; mean of answers in steps.
    ratio
        Ratio to the subject's own mean at the pinhole; None without pinhole answers, and for answers in steps.
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
    """Mean over subjects at one aperture and fixation.

    Parameters
    ----------
    fixation, aperture, aperture_mm
        Condition.
    subjects
        Number of subjects with answers.
    rating
        Geometric mean over subjects, with a within-subject interval (Cousineau-Morey).
    ratio
        Geometric mean of the within-subject ratios to the pinhole, with the interval of `against_pinhole`.
    against_pinhole
        Test of the log ratio over subjects and scenes, in the family of secondary comparisons; at the largest aperture
        it is the test of the depth effect.
    these_scenes
        The same test over subjects only, for these scenes.
    """

    fixation: str
    aperture: str
    aperture_mm: float
    subjects: int
    rating: Interval
    ratio: Interval | NotComputed
    against_pinhole: Effect | NotComputed
    these_scenes: Effect | NotComputed


@dataclass(frozen=True, slots=True)
class SceneMean:
    """Geometric mean of the ratios to the pinhole for one scene, aperture and fixation, with an interval by t."""

    scene: str
    fixation: str
    aperture: str
    aperture_mm: float
    ratio: Interval


@dataclass(frozen=True, slots=True)
class FixationResult:
    """Effect of blur on the ratings at one fixation.

    Parameters
    ----------
    fixation
        Object in focus.
    rise
        Depth effect: log ratio of the ratings at the largest aperture to those at the pinhole within subject and scene;
        subjects and scenes are random (`Effect.ratio` is the ratio).
    rise_these_scenes
        The same effect over subjects only, for these scenes.
    slope
        Linear trend of the log rating per millimetre of aperture, by least squares within subject and scene.
    equivalence
        Equivalence test of the depth effect, with the bound stated in advance.
    components
        Variance components of the depth effect, with a check of the residuals.

    bootstrap
        Sensitivity analysis of the primary effect, over subjects, for these scenes; not done for other fixations.
    """

    fixation: str
    rise: Effect | NotComputed
    rise_these_scenes: Effect | NotComputed
    slope: Effect | NotComputed
    equivalence: Equivalence | NotComputed
    components: Components | NotComputed
    bootstrap: BootstrapT | NotComputed


@dataclass(frozen=True, slots=True, repr=False)
class DepthRatingResult:
    """Results of the depth ratings.

    Parameters
    ----------
    participants
        Participant names, sorted.
    trials
        Number of ratings analysed, without catch trials.
    analysis
        Analysis of the ratings: `focalgradient.scales.Ratios` or `OrdinalSteps`.
    scenes
        Scene names.
    largest_mm
        Diameter of the largest aperture in mm.
    subject_means
        Mean answers of each subject.
    scene_means
        Ratios to the pinhole of each scene (ratio scale only).
    means
        Means over subjects (ratio scale only).
    fixations
        Results of each fixation in the data.
    interaction
        Depth effect with the nearest object in focus minus that with the farthest, without other fixations.
    differences
        With other fixations: difference of the depth effects of each pair, by their names, over subjects and scenes,
        and for these scenes only.
    answers
        All effects, by question and level.
    ordinal
        Analysis of ordinal answers, on an ordinal scale.
    remarks
        Omissions and their reasons, one sentence each.

    Notes
    -----
    The depth effect at the first fixation is primary: its p is not corrected, nor are those of the equivalence tests
    and of a single difference of two depth effects (several are corrected by Holm). The other depth effects, the
    comparisons of the other apertures with the pinhole, and the slopes are secondary and one family by Holm. Tests for
    these scenes repeat a test over subjects only, and are not corrected.
    """

    participants: tuple[str, ...]
    trials: int
    analysis: Analysis
    scenes: tuple[str, ...]
    largest_mm: float
    subject_means: tuple[SubjectMean, ...]
    scene_means: tuple[SceneMean, ...]
    means: tuple[RatingMean, ...]
    fixations: tuple[FixationResult, ...]
    interaction: Effect | NotComputed
    ordinal: OrdinalResult | NotComputed
    remarks: tuple[str, ...]
    differences: Mapping[tuple[str, str], tuple[Effect | NotComputed, Effect | NotComputed]] = field(
        default_factory=dict
    )
    answers: Answers = NO_ANSWERS

    @property
    def scale(self) -> str:
        """Name of the analysis: "ratio" or "ordinal"."""
        return self.analysis.name

    def __repr__(self) -> str:
        """Return a one-line description; `summary` gives the results."""
        return f"<DepthRatingResult: {len(self.participants)} subjects, {self.trials} ratings, scale {self.scale!r}>"

    def summary(self) -> str:
        """Return the depth effects and their difference as text, one per line."""
        lines = [f"{len(self.participants)} subjects, {self.trials} ratings, {len(self.scenes)} scenes"]
        if isinstance(self.ordinal, OrdinalResult):
            return "\n".join([*lines, *self.ordinal.lines()])
        tests = [(f"log depth effect, {each.fixation} in focus", each.rise) for each in self.fixations]
        differences = {pair: test for pair, (test, _) in self.differences.items()}
        return "\n".join([*lines, *summed(tests, differences, self.interaction)])


def depth_rating(
    table: pd.DataFrame,
    *,
    equivalence_bound: float,
    scale: Analysis | Scale = "ratio",
    progress: Progress | None = None,
) -> DepthRatingResult:
    """Analyse depth ratings.

    Parameters
    ----------
    table
        One row per trial: see `focalgradient.user_tables.tidy.rating_table`. Catch trials are excluded.
    equivalence_bound
        Smallest increase at the largest aperture that matters, as a ratio above 1, stated before the data are seen:
        with 1.2, an effect between 1 / 1.2 and 1.2 is equivalent to none.
    scale
        "ordinal" for ordinal steps, which have no ratios and are analysed by the cumulative-link model.
    progress
        Function called with the completed fraction of the fit of the cumulative-link model.

    Returns
    -------
    DepthRatingResult
        Results that cannot be computed are `NotComputed`, with the reason.

    Raises
    ------
    InputError
        If the table is invalid (the message states the row), or the bound is not above 1 and at most 10.

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
    check_bound("equivalence_bound", equivalence_bound)
    analysis = analysis_named(scale)
    if not isinstance(analysis, Ratios | OrdinalSteps):
        raise InputError(f"scale is {analysis.name!r}, but must be 'ratio' or 'ordinal': use compare_pictures instead.")
    table = main_trials(table, analysis)
    table = table.assign(aperture=table["aperture"].astype(str))
    remarks: list[str] = []
    present = fixations_of(table)
    ordinal = RATIO if analysis.ratios else ordinal_rating(table, remarks, progress)
    data = cells_of(table)
    asked = rating_questions(present, equivalence_bound, table["scene"].nunique())
    answers = asked.answers(data) if analysis.ratios else Answers()
    fixations = [_fixation(name, data[name], answers, remarks) for name in present] if analysis.ratios else []
    means = _means(table, data, answers, remarks) if analysis.ratios else ()
    usual = set(present) <= {*FIXATIONS}
    apart, here = (answers.to(f"{DIFFERENCE}{end}") for end in ("", HERE))
    missing = MORE if analysis.ratios else ORDINAL
    if analysis.ratios and usual and len(present) == 1:
        [other] = {*FIXATIONS} - {*present}
        missing = NotComputed(f"The {other} object is fixated in no trial: nothing can be compared.")
    pair = less(*FIXATIONS)
    described = [
        stated("mean rating", f"{mean.fixation}, {mean.aperture}", mean.rating, "description", n=mean.subjects)
        for mean in means
    ]
    return DepthRatingResult(
        participants=tuple(sorted(set(table["participant_id"]))),
        trials=len(table),
        analysis=analysis,
        scenes=tuple(sorted(set(table["scene"].astype(str)))),
        largest_mm=float(table["aperture_mm"].max()),
        subject_means=_subject_means(table, ratios=analysis.ratios),
        scene_means=_scene_means(data) if analysis.ratios else (),
        means=means,
        fixations=tuple(fixations) or tuple(FixationResult(name, *[ORDINAL] * 6) for name in present),
        interaction=apart.get(pair, missing),
        ordinal=ordinal,
        remarks=tuple(dict.fromkeys(remarks)),
        differences={}
        if usual or not analysis.ratios
        else {both: (apart[less(*both)], here[less(*both)]) for both in combinations(present, 2)},
        answers=Answers((*answers, *described)) if isinstance(ordinal, NotComputed) else ordinal.answers,
    )


MORE = NotComputed("There are other fixations than the nearest and the farthest: each pair is compared.")
ORDINAL = NotComputed("The scale is ordinal: its steps have no ratios.")
SECONDARY = NotComputed("Only the primary depth effect has a sensitivity analysis.")
RATIO = NotComputed("The ratings are ratios: the ordinal analysis is for answers in steps.")


def _fixation(fixation: str, own: Cells, answers: Answers, remarks: list[str]) -> FixationResult:
    """Collect the answers on one fixation."""
    if not own.scenes:
        remarks.append("Scenes and apertures are confounded: nothing is corrected for scenes.")
    names = (EFFECT, EFFECT + HERE, SLOPE, EQUIVALENT)
    rise, fixed, slope, equal = (answers.to(name)[fixation] for name in names)
    values = rises(fixation, own)
    parts = values if isinstance(values, NotComputed) else components(values, "log_ratio")
    if isinstance(rise, Effect) and rise.subjects < len(own.subjects):
        left = _names(np.array(own.subjects)[~np.isfinite(own.against_smallest(-1)).any(axis=1)])
        remarks.append(
            f"The depth effect ({fixation}) excludes {left}: "
            "no scene with answers to the largest aperture and the pinhole."
        )
    bootstrap = values if isinstance(values, NotComputed) else answers.to(BOOTSTRAP).get(fixation, SECONDARY)
    return FixationResult(fixation, rise, fixed, slope, equal, parts, bootstrap)


def _subject_means(table: pd.DataFrame, *, ratios: bool) -> tuple[SubjectMean, ...]:
    cells = table.groupby(["participant_id", "fixation", "aperture_mm", "aperture"])["answer"].agg(["size", "mean"])
    rows = [(*key, size, mean) for key, size, mean in cells.itertuples()]
    sharp = {(participant, fixation): mean for participant, fixation, mm, _, _, mean in rows if mm == 0}

    means = []
    for who, fixation, mm, name, size, mean in rows:
        ratio = math.exp(mean - sharp[who, fixation]) if ratios and (who, fixation) in sharp else None
        rating = math.exp(mean) if ratios else mean
        means.append(SubjectMean(who, fixation, name, float(mm), int(size), rating, ratio))
    order = fixations_of(table)
    return tuple(sorted(means, key=lambda mean: (mean.participant_id, order.index(mean.fixation), mean.aperture_mm)))


def _scene_means(data: Mapping[str, Cells]) -> tuple[SceneMean, ...]:
    means = []
    for fixation, own in data.items():
        for column, scene in enumerate(own.scenes if own.amounts[0] == 0 else ()):
            for number, (aperture, mm) in enumerate(zip(own.apertures, own.amounts, strict=True)):
                logs = own.against_smallest(number)[:, column]
                if len(logs := logs[np.isfinite(logs)]):
                    means.append(SceneMean(scene, fixation, aperture, float(mm), t_interval(logs).ratio))
    return tuple(means)


def _means(
    table: pd.DataFrame, data: Mapping[str, Cells], answers: Answers, remarks: list[str]
) -> tuple[RatingMean, ...]:
    """Return the means of all conditions, each with its test against the pinhole."""
    logs = table.pivot_table(
        index="participant_id", columns=["fixation", "aperture_mm"], values="answer", aggfunc="mean"
    )
    keys = [(name, mm) for name, own in data.items() for mm in own.amounts]
    whole = logs.dropna()
    if len(whole) < len(logs):
        left = _names(logs.index.difference(whole.index))
        remarks.append(f"The within-subject intervals exclude {left}: no answers to some aperture.")
    widths = within_half_widths(whole[keys]) if len(whole) else np.full(len(keys), np.nan)
    means = []
    for (fixation, mm), width in zip(keys, widths, strict=True):
        level, own = float(logs[fixation, mm].mean()), data[fixation]
        number = int(np.searchsorted(own.amounts, mm))
        aperture, ratios = own.apertures[number], rises(fixation, own, number)
        ends = (level - width, level + width) if math.isfinite(width) else (None, None)
        test: Effect | NotComputed
        fixed: Effect | NotComputed
        ratio: Interval | NotComputed
        if mm == 0:
            test = fixed = NotComputed("The pinhole is the reference of the comparisons.")
            ratio = Interval(1.0, 1.0, 1.0)
        elif isinstance(ratios, NotComputed):
            ratio = test = fixed = ratios
        else:
            name, place = (EFFECT, fixation) if mm == own.amounts[-1] else (PINHOLE, f"{fixation}, {aperture}")
            test, fixed = (answers.to(name + end)[place] for end in ("", HERE))
            ratio = test.ratio if isinstance(test, Effect) else _untested(ratios, aperture)
        rating = Interval(level, *ends).ratio
        subjects = int(logs[fixation, mm].notna().sum())
        means.append(RatingMean(fixation, aperture, mm, subjects, rating, ratio, test, fixed))
    return tuple(means)


def _untested(ratios: pd.DataFrame, aperture: str) -> Interval | NotComputed:
    """Return the mean ratio if it cannot be tested: with one subject, or identical subjects."""
    own = ratios.mean(axis=1).dropna()
    return NotComputed(f"No subject has both {aperture} and pinhole trials.") if own.empty else t_interval(own).ratio


def _names(index: Iterable[object]) -> str:
    return ", ".join(map(str, index))
