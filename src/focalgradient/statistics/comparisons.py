"""Analysis of paired comparisons (signed steps, or two-interval choices) and of visual-analogue ratings.

The answers are regressed on aperture within each subject and scene, and the slopes are tested over subjects and scenes.
For choices (0 or 1) this is the slope of the proportion: with few subjects, Wald's test of a marginal logistic slope
does not keep its level, or has less power (docs/report/statistics.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from focalgradient.analyses import Analysis, Choices, Slopes, analysis_named
from focalgradient.errors import InputError
from focalgradient.statistics.cells import cells_of
from focalgradient.statistics.means import only_difference, share_interval, t_interval
from focalgradient.statistics.questions import Answers, stated
from focalgradient.statistics.records import Effect, Interval, NotComputed, line, summed
from focalgradient.statistics.slope_questions import CHOICES, DIFFERENCE, LARGEST, SLOPE, slope_questions
from focalgradient.user_tables.tidy import fixations_of, main_trials

__all__ = [
    "ComparisonMean",
    "ComparisonResult",
    "compare_pictures",
]


@dataclass(frozen=True, slots=True)
class ComparisonMean:
    """Mean answer, or proportion of choices, at one aperture and fixation, averaged over subjects."""

    fixation: str
    aperture: str
    aperture_mm: float
    subjects: int
    mean: Interval


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
    answers
        All effects, by question and level; slopes and comparisons of steps and places generalise over subjects and
        scenes, those of choices hold for these scenes. The others are answers with `HERE` or `RANDOM` in their name.

    Notes
    -----
    The first slope is primary: its p is not corrected, nor is that of a single difference (several are corrected by
    Holm). The other slopes and the comparisons with the reference are secondary, one family by Holm. Choices are tested
    over subjects, because the test over subjects and scenes finds fewer effects of six subjects and six scenes (.215
    instead of .256).
    """

    analysis: Slopes | Choices
    participants: tuple[str, ...]
    trials: int
    means: tuple[ComparisonMean, ...]
    fixations: tuple[str, ...]
    answers: Answers

    @property
    def slopes(self) -> tuple[Effect | NotComputed, ...]:
        """Slope for each fixation: steps, or share of choices, per millimetre of aperture."""
        return tuple(self.answers.to(SLOPE).values())

    @property
    def against_reference(self) -> tuple[Effect | NotComputed, ...]:
        """Test at the largest aperture for each fixation: mean step against 0, or share of choices against one half.

        Not computed if the scale has no answer that means "identical".
        """
        return tuple(self.answers.to(LARGEST).values())

    @property
    def interaction(self) -> Effect | NotComputed:
        """Slope with the nearest object in focus less that with the farthest; only for steps, and two fixations."""
        return only_difference(self._pairs) if self.analysis.compares_slopes else CHOICES

    @property
    def differences(self) -> Mapping[tuple[str, str], Effect | NotComputed]:
        """With more than two fixations: difference of the slopes of each pair, by their names."""
        return self._pairs if len(self.fixations) > 2 else {}

    @property
    def _pairs(self) -> dict[tuple[str, str], Effect | NotComputed]:
        return self.answers.pairs(DIFFERENCE, self.fixations) if self.analysis.compares_slopes else {}

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
        slope = f"{self.analysis.unit} per mm"
        both = zip(self.fixations, self.slopes, self.against_reference, strict=True)
        for name, change, compared in both:
            lines.append(line(f"{slope}, {name} in focus", change))
            if self.analysis.alike is not None:
                lines.append(line(f"largest aperture against the reference, {name} in focus", compared))
        return "\n".join([*lines, *summed([], self.differences, self.interaction)])


def compare_pictures(table: pd.DataFrame, scale: Analysis | str) -> ComparisonResult:
    """Analyse paired comparisons or visual-analogue ratings.

    Parameters
    ----------
    table
        As for `focalgradient.user_tables.tidy.rating_table`; `rating` is a signed step (0: identical), or 1 if the
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
    table = main_trials(table, analysis)
    present = fixations_of(table)
    found = slope_questions(present, analysis, table["scene"].nunique()).answers(cells_of(table))
    means = _means(table, analysis)
    described = [
        stated("mean answer", f"{one.fixation}, {one.aperture}", one.mean, "description", n=one.subjects)
        for one in means
    ]
    people = tuple(sorted(set(table["participant_id"])))
    return ComparisonResult(analysis, people, len(table), means, present, Answers((*found, *described)))


def _means(table: pd.DataFrame, analysis: Slopes | Choices) -> tuple[ComparisonMean, ...]:
    interval = share_interval if analysis.binary else t_interval
    found = []
    for (fixation, _, aperture), rows in table.groupby(["fixation", "aperture_mm", "aperture"]):
        own = rows.groupby("participant_id")["rating"].mean().to_numpy(float)
        mm = float(rows["aperture_mm"].iloc[0])
        found.append(ComparisonMean(str(fixation), str(aperture), mm, len(own), interval(own)))
    order = fixations_of(table)
    return tuple(sorted(found, key=lambda mean: order.index(mean.fixation)))
