"""Experiment 1: whether a scene looks deeper with more blur, the nearest object in focus or the farthest.

Ratings are ratios to a standard, so everything is done on their logarithm and given as ratios. Results are meant to
hold for other subjects and other scenes: both are random in the headline test; one for these scenes stands beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.progress import Progress
from focalgradient.scales import Analysis, OrdinalSteps, Ratios, analysis_named
from focalgradient.statistics.cells import Cells, cells, curvature_weights, slope_weights
from focalgradient.statistics.crossed import Components, components, crossed_effect, over_subjects
from focalgradient.statistics.hypotheses import Equivalence, check_bound, equivalence, robust_decides
from focalgradient.statistics.means import family, t_interval, within_half_widths
from focalgradient.statistics.ordinal import OrdinalResult, ordinal_rating
from focalgradient.statistics.records import Effect, Interval, NotComputed, line
from focalgradient.statistics.tables import FIXATIONS, check_steps, fixations_of, rating_table

__all__ = ["DepthRatingResult", "FixationResult", "RatingMean", "Scale", "SceneMean", "SubjectMean", "depth_rating"]

FloatArray = NDArray[np.float64]

Scale = Literal["ratio", "ordinal"]
"""Names of the analyses of `depth_rating`."""
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
        Geometric mean of the subjects' own ratios to the pinhole, with the interval of `against_pinhole`.
    against_pinhole
        The logarithm of that ratio over subjects and scenes, corrected by Holm over all apertures and fixations.
    these_scenes
        The same over subjects, for these scenes only.
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
    """One scene with one aperture and fixation: geometric mean of the ratios to the pinhole, interval by t."""

    scene: str
    fixation: str
    aperture: str
    aperture_mm: float
    ratio: Interval


@dataclass(frozen=True, slots=True)
class FixationResult:
    """How ratings change with blur, with one object in focus.

    Parameters
    ----------
    fixation
        The object in focus.
    rise
        Log ratio of the rating at the largest aperture to that at the pinhole, as each subject gave it for each scene;
        subjects and scenes random (`Effect.ratio` is the ratio).
    rise_these_scenes
        The same over subjects, for these scenes only.
    slope
        Trend: the logarithm of the rating for a millimetre of aperture, least squares within each subject and scene.
    curvature
        Lack of fit of that straight line: the parabola at half the largest aperture, less the line.
    equivalence
        Whether the rise is equivalent to zero, within the bound stated in advance.
    components
        Variance components of the rise, and a check of its residuals.

    Notes
    -----
    Slopes are corrected by Holm as one family, lack of fit as another.
    """

    fixation: str
    rise: Effect | NotComputed
    rise_these_scenes: Effect | NotComputed
    slope: Effect | NotComputed
    curvature: Effect | NotComputed
    equivalence: Equivalence | NotComputed
    components: Components | NotComputed


@dataclass(frozen=True, slots=True, repr=False)
class DepthRatingResult:
    """Results of the depth ratings.

    Parameters
    ----------
    participants
        Who gave them, in order.
    trials
        How many ratings were analysed; catch trials are not.
    analysis
        Statistic of the ratings: `focalgradient.scales.Ratios` or `OrdinalSteps`.
    scenes
        Their names.
    largest_mm
        The largest aperture.
    subject_means
        Every subject's geometric means.
    scene_means
        Every scene's ratios to the pinhole: on the ratio scale only.
    means
        Those over subjects: on the ratio scale only.
    fixations
        The results of each fixation present.
    interaction
        The rise with the nearest object in focus less that with the farthest, where there are no others.
    interaction_these_scenes
        The same over subjects, for these scenes only.
    differences
        Where there are other fixations: the difference of the rises of each pair, by their names, over subjects and
        scenes, and for these scenes only.
    ordinal
        The analysis of answers in steps, where the scale is ordinal.
    remarks
        What was left out of which result and why, a sentence each.

    Notes
    -----
    Each of these families is corrected by Holm: the rises with their difference (subjects and scenes random; and again
    for these scenes), the comparisons of the other apertures with the pinhole, the slopes, the tests of lack of fit.
    At the largest aperture the comparison with the pinhole is the rise, in its family. Each equivalence test is one
    question of its own and is not corrected.
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
    interaction_these_scenes: Effect | NotComputed
    ordinal: OrdinalResult | NotComputed
    remarks: tuple[str, ...]
    differences: Mapping[tuple[str, str], tuple[Effect | NotComputed, Effect | NotComputed]] = field(
        default_factory=dict
    )

    @property
    def scale(self) -> str:
        """Name of the analysis: "ratio" or "ordinal"."""
        return self.analysis.name

    def __repr__(self) -> str:
        """In short; `summary` has the results."""
        return f"<DepthRatingResult: {len(self.participants)} subjects, {self.trials} ratings, scale {self.scale!r}>"

    def summary(self) -> str:
        """The rises and their difference, a line each."""
        lines = [f"{len(self.participants)} subjects, {self.trials} ratings, {len(self.scenes)} scenes"]
        tests = [(f"log rise, {each.fixation} in focus", each.rise) for each in self.fixations]
        differences = {pair: test for pair, (test, _) in self.differences.items()}
        interaction = self.interaction
        if isinstance(self.ordinal, OrdinalResult):
            names = (f"log odds, {name} in focus" for name in self.ordinal.fixations)
            tests = list(zip(names, self.ordinal.rises, strict=True))
            differences, interaction = dict(self.ordinal.differences), self.ordinal.interaction
        pairs = [(f"difference, {one} less {other}", test) for (one, other), test in differences.items()]
        for name, test in [*tests, *(pairs or [("difference", interaction)])]:
            lines.append(line(name, test))
        return "\n".join(lines)


def depth_rating(
    table: pd.DataFrame,
    *,
    equivalence_bound: float,
    scale: Analysis | Scale = "ratio",
    deciding_test: str = "robust",
    progress: Progress | None = None,
) -> DepthRatingResult:
    """Analyse depth ratings.

    Parameters
    ----------
    table
        One row a trial: see `focalgradient.statistics.tables.rating_table`. Catch trials are left out.
    equivalence_bound
        The smallest increase at the largest aperture that would matter, as a ratio above 1 and stated before the data
        were seen: at 1.2, a rise between 1 / 1.2 and 1.2 is equivalent to none.
    scale
        "ordinal" for answers in steps: then ratios mean nothing, and the cumulative-link model is the analysis.
    deciding_test
        Of ratios, the test that decides, stated before the data were seen: "robust" to skewed subjects, or Student's
        "t"; the other stands beside it.
    progress
        Called with the share done, while the cumulative-link model is fitted.

    Returns
    -------
    DepthRatingResult
        Where something could not be computed, a `NotComputed` says why.

    Raises
    ------
    InputError
        If the table cannot be read without guessing, naming the row, or the bound is not above 1 and at most 10, or
        `deciding_test` is another.

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
    decides = robust_decides(deciding_test)
    analysis = analysis_named(scale)
    if not isinstance(analysis, Ratios | OrdinalSteps):
        raise InputError(f"scale is {analysis.name!r}, but must be 'ratio' or 'ordinal': take compare_pictures.")
    table = rating_table(table)
    table = table[~table["catch"]]
    if table.empty:
        raise InputError("All trials are catch trials: there are no ratings to analyse.")
    if analysis.whole:
        check_steps(table)
    table = table.assign(answer=np.log(table["rating"]), aperture=table["aperture"].astype(str))
    remarks: list[str] = []
    present = fixations_of(table)
    of = {fixation: cells(table[table["fixation"] == fixation]) for fixation in present}
    found = [_fixation(name, of[name], equivalence_bound, analysis, remarks, decides) for name in present]
    pairs = [FIXATIONS] if set(present) <= {*FIXATIONS} else list(combinations(present, 2))
    against = [_difference(of, one, other, analysis, decides) for one, other in pairs]
    rises = family([*(each.rise for each in found), *(test for test, _ in against)])
    here = family([*(each.rise_these_scenes for each in found), *(test for _, test in against)])
    differences = dict(zip(pairs, zip(rises[len(found) :], here[len(found) :], strict=True), strict=True))
    interaction = differences.get(FIXATIONS, (MORE, MORE)) if len(pairs) == 1 else (MORE, MORE)
    slopes, curves = family(each.slope for each in found), family(each.curvature for each in found)
    return DepthRatingResult(
        participants=tuple(sorted(set(table["participant_id"]))),
        trials=len(table),
        analysis=analysis,
        scenes=tuple(sorted(set(table["scene"].astype(str)))),
        largest_mm=float(table["aperture_mm"].max()),
        subject_means=_subject_means(table),
        scene_means=_scene_means(table, of) if analysis.ratios else (),
        means=_means(table, of, dict(zip(present, zip(rises, here, strict=False), strict=False)), remarks, decides)
        if analysis.ratios
        else (),
        fixations=tuple(
            replace(each, rise=rise, rise_these_scenes=fixed, slope=slope, curvature=curve)
            for each, rise, fixed, slope, curve in zip(found, rises, here, slopes, curves, strict=False)
        ),
        interaction=interaction[0],
        interaction_these_scenes=interaction[1],
        ordinal=RATIO if analysis.ratios else ordinal_rating(table, remarks, progress),
        remarks=tuple(dict.fromkeys(remarks)),
        differences={} if set(present) <= {*FIXATIONS} else differences,
    )


MORE = NotComputed("There are other fixations than the nearest and the farthest: each pair is compared.")


ORDINAL = NotComputed("The scale is ordinal: its steps have no ratios.")
RATIO = NotComputed("The ratings are ratios: the ordinal analysis is for answers in steps.")


def _fixation(
    fixation: str, own: Cells, bound: float, analysis: Analysis, remarks: list[str], decides: bool
) -> FixationResult:
    if not analysis.ratios:
        return FixationResult(fixation, ORDINAL, ORDINAL, ORDINAL, ORDINAL, ORDINAL, ORDINAL)
    if not own.scenes:
        remarks.append("Scenes and apertures cannot be separated: nothing is corrected for scenes.")
    missing = _no_ratio(own, fixation)
    rise: Effect | NotComputed = missing
    fixed: Effect | NotComputed = missing
    equal: Equivalence | NotComputed = missing
    parts: Components | NotComputed = missing
    if not missing.reason:
        rises = own.against_smallest(-1)
        rise = crossed_effect(rises, robust_decides=decides)
        fixed, parts = over_subjects(rises, robust_decides=decides), components(rises, "log_ratio")
        equal = equivalence(rise, math.log(bound)) if isinstance(rise, Effect) else rise
        if isinstance(rise, Effect) and rise.subjects < len(own.subjects):
            left = _names(np.array(own.subjects)[~np.isfinite(rises).any(axis=1)])
            remarks.append(
                f"The rise ({fixation}) leaves out {left}: no answers to the largest aperture or the pinhole."
            )
    trends = [
        weights if isinstance(weights, NotComputed) else crossed_effect(own.contrast(weights), robust_decides=decides)
        for weights in (slope_weights(own.amounts), curvature_weights(own.amounts))
    ]
    return FixationResult(fixation, rise, fixed, trends[0], trends[1], equal, parts)


def _no_ratio(own: Cells, fixation: str) -> NotComputed:
    """Why there is no ratio to the pinhole; no reason where there is one."""
    if own.amounts[0] != 0:
        return NotComputed(f"No pinhole trials have the {fixation} object fixated: there is no ratio to them.")
    return NotComputed("There is the pinhole only: there is no larger aperture." if len(own.amounts) < 2 else "")


def _difference(
    of: Mapping[str, Cells], one: str, other: str, analysis: Analysis, decides: bool
) -> tuple[Effect | NotComputed, Effect | NotComputed]:
    """The difference of two rises of each subject and scene, over both; and for these scenes."""
    if not analysis.ratios:
        return ORDINAL, ORDINAL
    rises = []
    for fixation in (one, other):
        if fixation not in of:
            missing = NotComputed(f"No trials have the {fixation} object fixated: there is nothing to compare.")
            return missing, missing
        if (missing := _no_ratio(of[fixation], fixation)).reason:
            return missing, missing
        own = of[fixation]
        names = list(own.scenes) or [""]
        rises.append(pd.DataFrame(own.against_smallest(-1), index=list(own.subjects), columns=names))
    near, far = rises
    if near.columns[0] == "" or far.columns[0] == "":
        near, far = near.mean(axis=1).to_frame(), far.mean(axis=1).to_frame()
    difference = (near - far).to_numpy()
    if not np.isfinite(difference).any():
        difference = (near.mean(axis=1) - far.mean(axis=1)).to_frame().to_numpy()
    return crossed_effect(difference, robust_decides=decides), over_subjects(difference, robust_decides=decides)


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
    order = fixations_of(table)
    return tuple(sorted(means, key=lambda mean: (mean.participant_id, order.index(mean.fixation), mean.aperture_mm)))


def _scene_means(table: pd.DataFrame, of: Mapping[str, Cells]) -> tuple[SceneMean, ...]:
    names = table.drop_duplicates("aperture_mm").set_index("aperture_mm")["aperture"]
    means = []
    for fixation, own in of.items():
        if own.amounts[0] != 0:
            continue
        for column, scene in enumerate(own.scenes):
            for number, mm in enumerate(own.amounts):
                logs = own.against_smallest(number)[:, column]
                logs = logs[np.isfinite(logs)]
                if len(logs):
                    ratio = t_interval(logs).ratio
                    means.append(SceneMean(scene, fixation, str(names[mm]), float(mm), ratio))
    return tuple(means)


Test = Effect | NotComputed


def _means(
    table: pd.DataFrame,
    of: Mapping[str, Cells],
    primary: Mapping[str, tuple[Test, Test]],
    remarks: list[str],
    decides: bool,
) -> tuple[RatingMean, ...]:
    """Means of all conditions; at the largest aperture the test is that of the rise, in its family."""
    logs = table.pivot_table(
        index="participant_id", columns=["fixation", "aperture_mm"], values="answer", aggfunc="mean"
    )
    aperture = table.drop_duplicates("aperture_mm").set_index("aperture_mm")["aperture"].sort_index()
    keys = [(fixation, float(mm)) for fixation in of for mm in aperture.index if (fixation, mm) in logs]
    whole = logs.dropna()
    if len(whole) < len(logs):
        left = _names(logs.index.difference(whole.index))
        remarks.append(f"The within-subject intervals leave out {left}: no answers to some aperture.")
    widths = within_half_widths(whole[keys]) if len(whole) else np.full(len(keys), np.nan)
    means = []
    for (fixation, mm), width in zip(keys, widths, strict=True):
        level, own = float(logs[fixation, mm].mean()), of[fixation]
        ends = (level - width, level + width) if math.isfinite(width) else (None, None)
        test: Effect | NotComputed
        fixed: Effect | NotComputed
        ratio: Interval | NotComputed
        if mm == 0:
            test = fixed = NotComputed("The pinhole is what the others are compared with.")
            ratio = Interval(1.0, 1.0, 1.0)
        elif (missing := _no_ratio(own, fixation)).reason:
            ratio = test = fixed = missing
        else:
            rises = own.against_smallest(int(np.searchsorted(own.amounts, mm)))
            test = crossed_effect(rises, robust_decides=decides)
            fixed = over_subjects(rises, robust_decides=decides)
            ratio = test.ratio if isinstance(test, Effect) else _untested(rises, str(aperture[mm]))
        rating = Interval(level, *ends).ratio
        subjects = int(logs[fixation, mm].notna().sum())
        means.append(RatingMean(fixation, str(aperture[mm]), mm, subjects, rating, ratio, test, fixed))
    largest = {fixation: own.amounts[-1] for fixation, own in of.items()}
    others = [mean for mean in means if mean.aperture_mm < largest[mean.fixation]]
    tests = family(mean.against_pinhole for mean in others), family(mean.these_scenes for mean in others)
    corrected = {(mean.fixation, mean.aperture_mm): pair for mean, *pair in zip(others, *tests, strict=True)}
    pairs = [corrected.get((mean.fixation, mean.aperture_mm), primary[mean.fixation]) for mean in means]
    return tuple(
        replace(mean, against_pinhole=test, these_scenes=fixed)
        for mean, (test, fixed) in zip(means, pairs, strict=True)
    )


def _untested(rises: FloatArray, aperture: str) -> Interval | NotComputed:
    """The mean ratio where there is no test of it: one subject, or subjects who are all alike."""
    own = np.array([row[np.isfinite(row)].mean() for row in rises if np.isfinite(row).any()])
    if not len(own):
        return NotComputed(f"No subject has both {aperture} and pinhole trials.")
    return t_interval(own).ratio


def _names(index: Iterable[object]) -> str:
    return ", ".join(map(str, index))
