"""Experiment 1: effect of blur on rated depth, with the nearest or the farthest object in focus.

Ratings are ratios to a standard and are analysed on their logarithm; results are reported as ratios. The main test has
random subjects and scenes, so that it generalises over both; a test for these scenes only is reported next to it.
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
from focalgradient.statistics.bootstrap import BootstrapT, bootstrap_t
from focalgradient.statistics.cells import Cells, cells, slope_weights
from focalgradient.statistics.crossed import Components, components, crossed_effect, over_subjects, own_means
from focalgradient.statistics.hypotheses import Equivalence, check_bound, equivalence
from focalgradient.statistics.means import by_role, t_interval, within_half_widths
from focalgradient.statistics.ordinal import OrdinalResult, ordinal_rating
from focalgradient.statistics.records import Effect, Interval, NotComputed, line
from focalgradient.statistics.tables import FIXATIONS, check_steps, fixations_of, rating_table

__all__ = ["DepthRatingResult", "FixationResult", "RatingMean", "Scale", "SceneMean", "SubjectMean", "depth_rating"]

FloatArray = NDArray[np.float64]

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
        Geometric mean of the answers.
    ratio
        Ratio to the subject's own mean at the pinhole; None without pinhole answers.
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
        Geometric means of each subject.
    scene_means
        Ratios to the pinhole of each scene (ratio scale only).
    means
        Means over subjects (ratio scale only).
    fixations
        Results of each fixation in the data.
    interaction
        Depth effect with the nearest object in focus minus that with the farthest, without other fixations.
    interaction_these_scenes
        The same test over subjects only, for these scenes.
    differences
        With other fixations: difference of the depth effects of each pair, by their names, over subjects and scenes,
        and for these scenes only.
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
        """Return a one-line description; `summary` gives the results."""
        return f"<DepthRatingResult: {len(self.participants)} subjects, {self.trials} ratings, scale {self.scale!r}>"

    def summary(self) -> str:
        """Return the depth effects and their difference as text, one per line."""
        lines = [f"{len(self.participants)} subjects, {self.trials} ratings, {len(self.scenes)} scenes"]
        tests = [(f"log depth effect, {each.fixation} in focus", each.rise) for each in self.fixations]
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
    progress: Progress | None = None,
) -> DepthRatingResult:
    """Analyse depth ratings.

    Parameters
    ----------
    table
        One row per trial: see `focalgradient.statistics.tables.rating_table`. Catch trials are excluded.
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
    found = [_fixation(name, of[name], equivalence_bound, analysis, remarks, name == present[0]) for name in present]
    pairs = [FIXATIONS] if set(present) <= {*FIXATIONS} else list(combinations(present, 2))
    against = [_difference(of, one, other, analysis) for one, other in pairs]
    means = _means(table, of, found, remarks) if analysis.ratios else ()
    between = [mean for mean in means if mean.aperture_mm < of[mean.fixation].amounts[-1]]
    rises, apart, secondary = by_role(
        [each.rise for each in found],
        [test for test, _ in against],
        [*(mean.against_pinhole for mean in between), *(each.slope for each in found)],
    )
    slopes = secondary[len(between) :]
    tests = {(mean.fixation, mean.aperture_mm): test for mean, test in zip(between, secondary, strict=False)}
    tests |= {(name, float(of[name].amounts[-1])): rise for name, rise in zip(present, rises, strict=True)}
    differences = {pair: (test, here) for pair, test, (_, here) in zip(pairs, apart, against, strict=True)}
    interaction = differences.get(FIXATIONS, (MORE, MORE)) if len(pairs) == 1 else (MORE, MORE)
    return DepthRatingResult(
        participants=tuple(sorted(set(table["participant_id"]))),
        trials=len(table),
        analysis=analysis,
        scenes=tuple(sorted(set(table["scene"].astype(str)))),
        largest_mm=float(table["aperture_mm"].max()),
        subject_means=_subject_means(table),
        scene_means=_scene_means(table, of) if analysis.ratios else (),
        means=tuple(replace(mean, against_pinhole=tests[mean.fixation, mean.aperture_mm]) for mean in means),
        fixations=tuple(
            replace(each, rise=rise, slope=slope) for each, rise, slope in zip(found, rises, slopes, strict=True)
        ),
        interaction=interaction[0],
        interaction_these_scenes=interaction[1],
        ordinal=RATIO if analysis.ratios else ordinal_rating(table, remarks, progress),
        remarks=tuple(dict.fromkeys(remarks)),
        differences={} if set(present) <= {*FIXATIONS} else differences,
    )


MORE = NotComputed("There are other fixations than the nearest and the farthest: each pair is compared.")


ORDINAL = NotComputed("The scale is ordinal: its steps have no ratios.")
SECONDARY = NotComputed("Only the primary depth effect has a sensitivity analysis.")
RATIO = NotComputed("The ratings are ratios: the ordinal analysis is for answers in steps.")


def _fixation(
    fixation: str, own: Cells, bound: float, analysis: Analysis, remarks: list[str], primary: bool
) -> FixationResult:
    if not analysis.ratios:
        return FixationResult(fixation, *[ORDINAL] * 6)
    if not own.scenes:
        remarks.append("Scenes and apertures are confounded: nothing is corrected for scenes.")
    missing = _no_ratio(own, fixation)
    rise: Effect | NotComputed = missing
    fixed: Effect | NotComputed = missing
    equal: Equivalence | NotComputed = missing
    parts: Components | NotComputed = missing
    bootstrap: BootstrapT | NotComputed = missing if primary else SECONDARY
    if not missing.reason:
        rises = own.against_smallest(-1)
        rise = crossed_effect(rises)
        fixed, parts = over_subjects(rises), components(rises, "log_ratio")
        if primary:
            bootstrap = fixed if isinstance(fixed, NotComputed) else bootstrap_t(own_means(rises))
        equal = equivalence(rise, math.log(bound)) if isinstance(rise, Effect) else rise
        if isinstance(rise, Effect) and rise.subjects < len(own.subjects):
            left = _names(np.array(own.subjects)[~np.isfinite(rises).any(axis=1)])
            remarks.append(
                f"The depth effect ({fixation}) excludes {left}: no answers to the largest aperture or the pinhole."
            )
    weights = slope_weights(own.amounts)
    slope = weights if isinstance(weights, NotComputed) else crossed_effect(own.contrast(weights))
    return FixationResult(fixation, rise, fixed, slope, equal, parts, bootstrap)


def _no_ratio(own: Cells, fixation: str) -> NotComputed:
    """Return the reason why there is no ratio to the pinhole; an empty reason if there is one."""
    if own.amounts[0] != 0:
        return NotComputed(f"The {fixation} object is fixated in no pinhole trial: there is no ratio to the pinhole.")
    return NotComputed("The pinhole is the only aperture." if len(own.amounts) < 2 else "")


def _difference(
    of: Mapping[str, Cells], one: str, other: str, analysis: Analysis
) -> tuple[Effect | NotComputed, Effect | NotComputed]:
    """Test the difference of two depth effects within subject and scene: over both, and for these scenes."""
    if not analysis.ratios:
        return ORDINAL, ORDINAL
    rises = []
    for fixation in (one, other):
        if fixation not in of:
            missing = NotComputed(f"The {fixation} object is fixated in no trial: nothing can be compared.")
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
    return crossed_effect(difference), over_subjects(difference)


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


def _means(
    table: pd.DataFrame, of: Mapping[str, Cells], found: Iterable[FixationResult], remarks: list[str]
) -> tuple[RatingMean, ...]:
    """Return the means of all conditions, with uncorrected tests; at the largest aperture that of the depth effect."""
    largest = {each.fixation: each for each in found}
    logs = table.pivot_table(
        index="participant_id", columns=["fixation", "aperture_mm"], values="answer", aggfunc="mean"
    )
    aperture = table.drop_duplicates("aperture_mm").set_index("aperture_mm")["aperture"].sort_index()
    keys = [(fixation, float(mm)) for fixation in of for mm in aperture.index if (fixation, mm) in logs]
    whole = logs.dropna()
    if len(whole) < len(logs):
        left = _names(logs.index.difference(whole.index))
        remarks.append(f"The within-subject intervals exclude {left}: no answers to some aperture.")
    widths = within_half_widths(whole[keys]) if len(whole) else np.full(len(keys), np.nan)
    means = []
    for (fixation, mm), width in zip(keys, widths, strict=True):
        level, own = float(logs[fixation, mm].mean()), of[fixation]
        ends = (level - width, level + width) if math.isfinite(width) else (None, None)
        test: Effect | NotComputed
        fixed: Effect | NotComputed
        ratio: Interval | NotComputed
        if mm == 0:
            test = fixed = NotComputed("The pinhole is the reference of the comparisons.")
            ratio = Interval(1.0, 1.0, 1.0)
        elif (missing := _no_ratio(own, fixation)).reason:
            ratio = test = fixed = missing
        else:
            rises = own.against_smallest(int(np.searchsorted(own.amounts, mm)))
            if mm == own.amounts[-1]:
                test, fixed = largest[fixation].rise, largest[fixation].rise_these_scenes
            else:
                test, fixed = crossed_effect(rises), over_subjects(rises)
            ratio = test.ratio if isinstance(test, Effect) else _untested(rises, str(aperture[mm]))
        rating = Interval(level, *ends).ratio
        subjects = int(logs[fixation, mm].notna().sum())
        means.append(RatingMean(fixation, str(aperture[mm]), mm, subjects, rating, ratio, test, fixed))
    return tuple(means)


def _untested(rises: FloatArray, aperture: str) -> Interval | NotComputed:
    """Return the mean ratio if it cannot be tested: with one subject, or identical subjects."""
    own = np.array([row[np.isfinite(row)].mean() for row in rises if np.isfinite(row).any()])
    if not len(own):
        return NotComputed(f"No subject has both {aperture} and pinhole trials.")
    return t_interval(own).ratio


def _names(index: Iterable[object]) -> str:
    return ", ".join(map(str, index))
