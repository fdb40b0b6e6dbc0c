"""Analysis of paired comparisons (signed steps, or two-interval choices) and of visual-analogue ratings.

The answers are regressed on aperture within each subject and scene, and the slopes are tested over subjects and scenes.
For choices (0 or 1) this is the slope of the proportion: its test keeps its nominal level and has more power than the
Wald test of a marginal logistic slope, whose standard error grows with the slope.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.scales import Analysis, Choices, Slopes, analysis_named
from focalgradient.statistics.cells import Cells, cells, slope_weights
from focalgradient.statistics.crossed import crossed_effect, over_subjects
from focalgradient.statistics.means import by_role, only_difference, share_interval, t_interval
from focalgradient.statistics.records import Effect, Interval, NotComputed, line
from focalgradient.statistics.tables import fixations_of, rating_table

__all__ = ["ComparisonMean", "ComparisonResult", "ComparisonTests", "compare_pictures", "own_slopes", "slope_unit"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ComparisonMean:
    """Mean answer, or proportion of choices, at one aperture and fixation, averaged over subjects."""

    fixation: str
    aperture: str
    aperture_mm: float
    subjects: int
    mean: Interval


@dataclass(frozen=True, slots=True)
class ComparisonTests:
    """Uncorrected tests over one kind of units; fields as in `ComparisonResult`."""

    slopes: tuple[Effect | NotComputed, ...]
    against_reference: tuple[Effect | NotComputed, ...]
    interaction: Effect | NotComputed
    differences: Mapping[tuple[str, str], Effect | NotComputed]


@dataclass(frozen=True, slots=True, repr=False)
class ComparisonResult:
    """Results of the analysis of paired comparisons.

    Parameters
    ----------
    analysis
        Analysis: `focalgradient.scales.Slopes` or `Choices`.
    participants, trials
        Participant names, and number of answers without catch trials.
    means
        Means by fixation and aperture; intervals of shares by t on their log odds, within 0 and 1.
    fixations
        Fixations in the data, nearest first.
    slopes
        Slope for each fixation: steps per millimetre of aperture (with five or more scenes, both subjects and scenes
        are random), or proportion of choices per millimetre (over subjects, for these scenes).
    against_reference
        Test at the largest aperture for each fixation: mean step against 0, or proportion of choices against one half.
        Not computed if the scale has no answer that means "identical".
    interaction
        Slope with the nearest object in focus minus slope with the farthest, within subject and scene. Only for steps,
        and with two fixations.
    differences
        With more than two fixations: difference of the slopes of each pair, by their names.
    these_scenes
        The same four tests over subjects only, for these scenes.
    scenes_random
        The same four tests over subjects and scenes, both random with five or more scenes.

    Notes
    -----
    The first slope is primary: its p is not corrected, nor is that of a single difference (several are corrected by
    Holm). The other slopes and the comparisons with the reference are secondary, one family by Holm. The tests in
    `these_scenes` and `scenes_random` are not corrected. Choices are tested over subjects, because the test over
    subjects and scenes finds fewer effects of six subjects and six scenes (.215 instead of .256).
    """

    analysis: Slopes | Choices
    participants: tuple[str, ...]
    trials: int
    means: tuple[ComparisonMean, ...]
    fixations: tuple[str, ...]
    slopes: tuple[Effect | NotComputed, ...]
    against_reference: tuple[Effect | NotComputed, ...]
    interaction: Effect | NotComputed
    differences: Mapping[tuple[str, str], Effect | NotComputed]
    these_scenes: ComparisonTests
    scenes_random: ComparisonTests

    @property
    def scale(self) -> str:
        """Name of the analysis: "bipolar", "choice", or that of a custom scale."""
        return self.analysis.name

    def __repr__(self) -> str:
        """Return a one-line description; `summary` gives the results."""
        return f"<ComparisonResult: {len(self.participants)} subjects, {self.trials} answers, scale {self.scale!r}>"

    def summary(self) -> str:
        """Return slopes, their differences and comparisons with the reference as text, one per line."""
        lines = [f"{len(self.participants)} subjects, {self.trials} answers"]
        slope = f"{slope_unit(self.analysis)} per mm"
        both = zip(self.fixations, self.slopes, self.against_reference, strict=True)
        for name, change, compared in both:
            lines.append(line(f"{slope}, {name} in focus", change))
            if self.analysis.alike is not None:
                lines.append(line(f"largest aperture against the reference, {name} in focus", compared))
        pairs = [(f"difference, {one} less {other}", test) for (one, other), test in self.differences.items()]
        return "\n".join([*lines, *(line(*one) for one in pairs or [("difference", self.interaction)])])


def slope_unit(analysis: Slopes | Choices) -> str:
    """Return the unit of the slopes, per millimetre of aperture.

    >>> slope_unit(Choices())
    'share of choices'
    """
    return analysis.unit


def compare_pictures(table: pd.DataFrame, scale: Analysis | str) -> ComparisonResult:
    """Analyse paired comparisons or visual-analogue ratings.

    Parameters
    ----------
    table
        As for `focalgradient.statistics.tables.rating_table`; `rating` is a signed step (0: identical), or 1 if the
        picture was judged deeper than the reference, else 0. Catch trials are excluded.
    scale
        The analysis (`focalgradient.scales.Slopes` or `Choices`), or its name: "bipolar" or "choice".

    Raises
    ------
    InputError
        If the table is invalid or contains only catch trials, or the analysis has no slopes.

    Examples
    --------
    >>> rows = [
    ...     {"participant_id": who, "trial": trial, "scene": "room", "aperture": name, "aperture_mm": mm,
    ...      "fixation": "nearest", "rating": round((0.2 + 0.05 * who) * mm), "catch": False}
    ...     for who in range(4) for trial, (name, mm) in enumerate([("pinhole", 0.0), ("f/11", 4.5), ("f/5.6", 8.9)])
    ... ]
    >>> found = compare_pictures(pd.DataFrame(rows), "bipolar")
    >>> found
    <ComparisonResult: 4 subjects, 12 answers, scale 'bipolar'>
    >>> print(found.summary().splitlines()[1])
    steps per mm, nearest in focus: 0.281, 95 % interval 0.178 to 0.384, t(3) = 8.66, p = .003
    >>> round(found.slopes[0].estimate, 2), round(found.means[-1].mean.estimate, 1)
    (0.28, 2.5)
    """
    analysis = analysis_named(scale)
    if not isinstance(analysis, Slopes | Choices):
        raise InputError(f"scale is {analysis.name!r}, but must be 'bipolar' or 'choice', or an analysis by slopes.")
    table = rating_table(table, analysis)
    table = table[~table["catch"]]
    if table.empty:
        raise InputError("All trials are catch trials: there are no answers to analyse.")
    present = fixations_of(table)
    answers = table.rename(columns={"rating": "answer"})
    of = {name: cells(answers[answers["fixation"] == name]) for name in present}
    pairs = list(combinations(present, 2)) if analysis.compares_slopes else []
    slopes = [_both(own_slopes(of[name])) for name in present]
    slopes += [_difference(of[one], of[other]) for one, other in pairs]
    largest = [_largest(own, analysis) for own in of.values()]
    size = len(present)
    both, here = (
        ([test[k] for test in slopes[:size]], [test[k] for test in slopes[size:]], [test[k] for test in largest])
        for k in (0, 1)
    )
    deciding = _tests(*by_role(*(here if analysis.binary else both)), pairs, analysis)
    return ComparisonResult(
        analysis,
        tuple(sorted(set(table["participant_id"]))),
        len(table),
        _means(table, analysis),
        present,
        deciding.slopes,
        deciding.against_reference,
        deciding.interaction,
        deciding.differences,
        _tests(*here, pairs, analysis),
        _tests(*both, pairs, analysis),
    )


CHOICES = NotComputed("Slopes of choices are not compared between fixations.")
UNLIKE = NotComputed("No answer of the scale means that two pictures are alike.")

Test = Effect | NotComputed


def _tests(
    slopes: list[Test], apart: list[Test], largest: list[Test], pairs: list[tuple[str, str]], analysis: Analysis
) -> ComparisonTests:
    """Name the differences by their pairs."""
    differences = dict(zip(pairs, apart, strict=True))
    return ComparisonTests(
        tuple(slopes),
        tuple(largest),
        only_difference(differences) if analysis.compares_slopes else CHOICES,
        differences if len(pairs) > 1 else {},
    )


def _both(values: FloatArray | NotComputed) -> tuple[Test, Test]:
    """Test the mean over subjects and scenes, and over subjects only, for bounded values."""
    if isinstance(values, NotComputed):
        return values, values
    return crossed_effect(values), over_subjects(values)


def _difference(one: Cells, other: Cells) -> tuple[Test, Test]:
    """Test the difference between two slopes within subject and scene; of the means over scenes if none has both."""
    lines = []
    for own in (one, other):
        slopes = own_slopes(own)
        if isinstance(slopes, NotComputed):
            return slopes, slopes
        names = list(own.scenes) if slopes.shape[1] == len(own.scenes) else [""]
        lines.append(pd.DataFrame(slopes, index=list(own.subjects), columns=names))
    first, second = lines
    difference = (first - second).to_numpy(dtype=float)
    if not np.isfinite(difference).any():
        difference = (first.mean(axis=1) - second.mean(axis=1)).to_frame().to_numpy(dtype=float)
    return _both(difference)


def own_slopes(own: Cells) -> FloatArray | NotComputed:
    """Return least-squares slopes per mm of aperture (subjects x scenes; per subject if no scene has all apertures)."""
    weights = slope_weights(own.amounts)
    if isinstance(weights, NotComputed):
        return weights
    slopes = own.contrast(weights)
    if np.isfinite(slopes).any():
        return slopes
    seen = np.isfinite(own.values)
    with np.errstate(invalid="ignore"):
        means = np.where(seen, own.values, 0).sum(axis=1, keepdims=True) / seen.sum(axis=1, keepdims=True)
    return replace(own, values=means).contrast(weights)


def _largest(own: Cells, analysis: Slopes | Choices) -> tuple[Test, Test]:
    """Test the answers at the largest aperture against the answer for identical pictures."""
    if analysis.alike is None:
        return UNLIKE, UNLIKE
    return _both(own.values[:, :, -1] - analysis.alike)


def _means(table: pd.DataFrame, analysis: Slopes | Choices) -> tuple[ComparisonMean, ...]:
    interval = share_interval if analysis.binary else t_interval
    found = []
    for fixation in fixations_of(table):
        rows = table[table["fixation"] == fixation]
        names = rows.drop_duplicates("aperture_mm").sort_values("aperture_mm")
        for mm, name in zip(names["aperture_mm"], names["aperture"], strict=True):
            cell = rows[rows["aperture_mm"] == mm]
            own = cell.groupby("participant_id")["rating"].mean().to_numpy(float)
            found.append(ComparisonMean(fixation, str(name), float(mm), len(own), interval(own)))
    return tuple(found)
