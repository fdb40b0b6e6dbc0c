"""Ordinal answers: slopes, their difference and thresholds from one cumulative-link mixed model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from focalgradient.arrays import FloatArray
from focalgradient.progress import Progress
from focalgradient.statistics.crossed import FEWEST_SCENES, with_scenes
from focalgradient.statistics.cumulative import CumulativeFit, answer_derivatives, cumulative_fit
from focalgradient.statistics.means import only_difference, paired_effect, student_effect
from focalgradient.statistics.ordinal_people import own_rises
from focalgradient.statistics.questions import HERE, Answers, Outcome
from focalgradient.statistics.records import CONFIDENCE, Effect, Interval, NotComputed, summed
from focalgradient.statistics.step_questions import DIFFERENCE, EFFECT, SLOPE, step_outcomes, step_questions
from focalgradient.user_tables.tidy import fixations_of

__all__ = [
    "OrdinalResult",
    "StepShare",
    "Threshold",
    "design_matrix",
    "nodes_for",
    "ordinal_rating",
]


MIN_TRIALS_FOR_3_NODES = 60
"""Number of trials per subject above which 3 quadrature nodes per random effect replace 7: in simulated answers of 200
subjects, slopes and standard errors then differ by less than 1e-3 of the standard error.
"""


@dataclass(frozen=True, slots=True)
class StepShare:
    """Proportion of one scale step among the answers at one aperture and fixation, averaged over subjects."""

    fixation: str
    aperture: str
    aperture_mm: float
    step: int
    share: float


@dataclass(frozen=True, slots=True)
class Threshold:
    """Boundary between two steps on the latent scale, in log odds; 0 is the pinhole with the first scene."""

    below: int
    above: int
    place: Interval


@dataclass(frozen=True, slots=True, repr=False)
class OrdinalResult:
    """Results of one cumulative-link mixed model of the ordinal answers at all fixations.

    Parameters
    ----------
    formula
        Model in the notation of R's ordinal package.
    fixations
        Fixations in the data, nearest first.
    thresholds
        Boundaries between the steps.
    shares
        Mean proportions of the steps, by fixation and aperture.
    log_likelihood
        Maximum of the log likelihood; None without a fit.
    by_people
        True if within-subject effects were tested because the mixed model's standard errors are unreliable; all tests
        are then over subjects, for these scenes.
    outcomes
        Uncorrected outcomes of the questions, by name and level.
    scenes
        Number of scenes.

    Notes
    -----
    The first effect is primary: its p is not corrected, nor is that of a single difference (several are corrected by
    Holm). The other effects are secondary, one family by Holm; the slopes are the same tests. The tests in
    `these_scenes` are not corrected.
    """

    formula: str
    fixations: tuple[str, ...]
    outcomes: Mapping[str, Mapping[str, Outcome]]
    scenes: int
    thresholds: tuple[Threshold, ...]
    shares: tuple[StepShare, ...]
    log_likelihood: float | None = None
    by_people: bool = False

    @property
    def answers(self) -> Answers:
        """All effects, by question and level."""
        return step_questions(self.fixations, self.scenes).answers(self.outcomes)

    @property
    def slopes(self) -> tuple[Effect | NotComputed, ...]:
        """Change in the log odds of a higher answer per millimetre of aperture, for each fixation."""
        return tuple(self.answers.to(SLOPE).values())

    @property
    def rises(self) -> tuple[Effect | NotComputed, ...]:
        """The same change from the pinhole (or no aperture) to the largest aperture; `Effect.ratio` is the odds ratio.

        With five or more scenes, slopes, effects and differences have random subjects and scenes.
        """
        return tuple(self.answers.to(EFFECT).values())

    @property
    def interaction(self) -> Effect | NotComputed:
        """With two fixations: effect with the nearest object in focus minus effect with the farthest."""
        return only_difference(self.answers.pairs(DIFFERENCE, self.fixations))

    @property
    def differences(self) -> Mapping[tuple[str, str], Effect | NotComputed]:
        """With more than two fixations: difference of the effects of each pair, by their names."""
        return self.answers.pairs(DIFFERENCE, self.fixations) if len(self.fixations) > 2 else {}

    @property
    def these_scenes(self) -> tuple[Effect | NotComputed, ...]:
        """The effects, then the differences of each pair, over subjects only, for these scenes."""
        return (*self.answers.to(EFFECT + HERE).values(), *self.answers.to(DIFFERENCE + HERE).values())

    def __repr__(self) -> str:
        """Return a one-line description; `summary` gives the results."""
        return f"<OrdinalResult: {self.formula}>"

    def summary(self) -> str:
        """Return the effects in log odds and their differences as text, one per line."""
        return "\n".join(self.lines())

    def lines(self) -> list[str]:
        """Return the lines of `summary`."""
        names = (f"log odds, {name} in focus" for name in self.fixations)
        return summed(zip(names, self.rises, strict=True), self.differences, self.interaction)


def design_matrix(amount: FloatArray, kinds: NDArray[np.object_]) -> FloatArray:
    """Return the columns 1, amount, and one indicator for each scene after the first.

    Examples
    --------
    >>> design_matrix(np.array([0.0, 2.0]), np.array(["room", "terrain"], dtype=object))
    array([[1., 0., 0.],
           [1., 2., 1.]])
    """
    return np.column_stack([np.ones(len(amount)), amount, *(kinds == kind for kind in sorted(set(kinds))[1:])]).astype(
        float
    )


def nodes_for(subject: NDArray[np.int_]) -> int:
    """Return the number of quadrature nodes per random effect: with many trials the integrand is nearly normal."""
    return 3 if np.bincount(subject).min() >= MIN_TRIALS_FOR_3_NODES else 7


def ordinal_rating(rows: pd.DataFrame, remarks: list[str], progress: Progress | None = None) -> OrdinalResult:
    """Analyse ordinal answers: slopes at each fixation, their difference, and thresholds.

    Parameters
    ----------
    rows
        Trials with `participant_id`, `scene`, `aperture`, `aperture_mm`, `fixation` and `rating` (integers).
    remarks
        List to which omissions are appended.
    progress
        Function called with the completed fraction.

    Examples
    --------
    >>> rng = np.random.default_rng(3)
    >>> rows = pd.DataFrame({"participant_id": np.repeat(np.arange(8), 16), "scene": "room", "fixation": "nearest",
    ...                      "aperture_mm": np.tile([0.0, 1.0, 2.0, 3.0], 32)})
    >>> rows["aperture"] = rows["aperture_mm"].astype(str)
    >>> latent = rng.normal(1.0, 0.3, 8)[rows["participant_id"]] * rows["aperture_mm"] + rng.logistic(size=128)
    >>> found = ordinal_rating(rows.assign(rating=1 + np.digitize(latent, [0.5, 2.0])), [])
    >>> found.slopes[0].low < 1.0 < found.slopes[0].high, [each.below for each in found.thresholds]
    (True, [1, 2])
    >>> print(found.summary())  # doctest: +ELLIPSIS
    log odds, nearest in focus: 2.9..., 95 % interval 1.0... to 4.8..., t(7) = 3.6..., p = .009
    difference: There is only one fixation: nothing can be compared.
    """
    fixations = fixations_of(rows)
    steps, category = np.unique(rows["rating"].to_numpy().astype(int), return_inverse=True)
    subject, names = pd.factorize(rows["participant_id"], sort=True)
    width = float(np.ptp(rows["aperture_mm"].to_numpy(dtype=float)))
    shares = _shares(rows, steps)
    formula = _formula(fixations)
    scenes = rows["scene"].nunique()

    pairs = list(combinations(range(len(fixations)), 2))

    def result(
        tests: Sequence[Effect | NotComputed],
        fixed: Sequence[Effect | NotComputed],
        fit: CumulativeFit | None = None,
        half: float | None = None,
        *,
        by_people: bool = False,
    ) -> OrdinalResult:
        places = [] if fit is None else zip(fit.thresholds.tolist(), fit.threshold_errors.tolist(), strict=True)
        thresholds = tuple(
            Threshold(
                low, high, Interval(at, *((None, None) if half is None else (at - half * error, at + half * error)))
            )
            for low, high, (at, error) in zip(steps[:-1].tolist(), steps[1:].tolist(), places, strict=False)
        )
        outcomes = step_outcomes(fixations, tests, fixed, width)
        height = None if fit is None else fit.log_likelihood
        return OrdinalResult(formula, fixations, outcomes, scenes, thresholds, shares, height, by_people)

    def missing(reason: str) -> OrdinalResult:
        tests = [NotComputed(reason)] * (len(fixations) + len(pairs))
        return result(tests, tests)

    if len(names) < 2 or width == 0:
        return missing("An ordinal slope over subjects needs two or more subjects, and two or more apertures.")
    if len(steps) < 2:
        return missing("All answers are the same: there is no variation to test a slope against.")
    design, random = _columns(rows, fixations, width, remarks)
    fit = cumulative_fit(category, design, random, subject, nodes_for(subject), progress)
    size = len(fixations)
    if fit is not None and not np.isfinite(fit.standard_errors[:size]).all():
        fit = None
    ends = np.bincount(category)[[0, -1]].max() / len(category)
    if fit is None or fit.at_boundary or ends >= FLOOR:
        own = own_rises(category, random[:, 1:], design[:, size : 2 * size - 1], subject)
        why = NO_MAXIMUM if fit is None else SINGULAR if fit.at_boundary else AT_END
        values = [*own.T, *(own[:, one] - own[:, other] for one, other in pairs)]
        tests = [paired_effect(each, PEOPLE_METHOD) for each in values]
        tests = [replace(test, remarks=(why,)) if isinstance(test, Effect) else test for test in tests]
        return result(tests, tests, fit, by_people=True)
    contrasts = list(np.eye(design.shape[1])[:size])
    contrasts += [contrasts[one] - contrasts[other] for one, other in pairs]
    fixed = [_contrast(fit, contrast, len(names)) for contrast in contrasts]
    scene = pd.factorize(rows["scene"], sort=True)[0]
    levels = design @ fit.fixed + (random * fit.effects[subject]).sum(axis=1)
    deviations = _scene_deviations(answer_derivatives(category, levels, fit.thresholds), random, scene)
    over = [_over_scenes(test, deviations, weights[:size]) for test, weights in zip(fixed, contrasts, strict=True)]
    return result(over, fixed, fit, float(stats.t.ppf((1 + CONFIDENCE) / 2, len(names) - 1)))


def _formula(fixations: Sequence[str]) -> str:
    """Return the model in the notation of R's ordinal package."""
    slopes = " + ".join(f"mm_{name}" for name in fixations)
    both = " + fixation" if len(fixations) > 1 else ""
    return f"rating ~ {slopes}{both} + scene + (1 + {slopes} | participant_id)"


def _columns(
    rows: pd.DataFrame, fixations: Sequence[str], width: float, remarks: list[str]
) -> tuple[FloatArray, FloatArray]:
    """Return the design matrices of fixed and random effects, one row per trial; amounts are divided by `width`."""
    amount = rows["aperture_mm"].to_numpy(dtype=float)
    own = [(rows["fixation"] == name).to_numpy() * amount / width for name in fixations]
    design = np.column_stack([*own, *(rows["fixation"] == name for name in fixations[1:])]).astype(float)
    scenes = design_matrix(amount, rows["scene"].to_numpy(dtype=object))[:, 2:]
    whole = np.column_stack([design, scenes])
    if np.linalg.matrix_rank(whole - whole.mean(axis=0)) == whole.shape[1]:
        design = whole
    elif scenes.shape[1]:
        remarks.append("Scenes and apertures are confounded: nothing is corrected for scenes.")
    return design, np.column_stack([np.ones(len(rows)), *own])


METHOD = "cumulative-link mixed model (logit), random intercepts and slopes, adaptive Gauss-Hermite, t on subjects - 1"


FLOOR = 0.5
"""Proportion of answers in the lowest (or highest) step above which within-subject effects are tested: there the mixed
model's test rejects .004 (4 subjects) and .013 (6 subjects) of data sets without an effect.
"""

PEOPLE_METHOD = (
    "subjects' own depth effects, penalised cumulative-link model (logit) with common thresholds, t-test over them"
)

NO_MAXIMUM = "The cumulative-link mixed model has no finite maximum: subjects' own depth effects were tested instead."
SINGULAR = "The mixed model's covariance is singular: subjects' own depth effects were tested instead."
AT_END = (
    "Half of all answers or more are the lowest or the highest step: subjects' own depth effects were tested instead."
)


def _contrast(fit: CumulativeFit, weights: FloatArray, subjects: int) -> Effect:
    error = math.sqrt(float(weights @ fit.covariance @ weights))
    return student_effect(float(weights @ fit.fixed), error, subjects, METHOD)


def _scene_deviations(
    derivatives: tuple[FloatArray, FloatArray], random: FloatArray, scene: NDArray[np.int_]
) -> tuple[FloatArray, FloatArray] | None:
    """Return the deviations of each scene's level and effects from the model, and their sampling covariance.

    The deviations are one Newton step from the fit, with the subjects at their conditional modes. Return None if some
    scene lacks a condition, or with fewer than five scenes.
    """
    slope, curvature = derivatives
    scenes = int(scene.max()) + 1
    away, left = np.empty((scenes, random.shape[1])), np.empty((scenes, random.shape[1], random.shape[1]))
    for each in range(scenes):
        own = random[scene == each]
        information = (own.T * curvature[scene == each]) @ own
        if scenes < FEWEST_SCENES or np.linalg.cond(information) > 1e8:
            return None
        left[each] = np.linalg.inv(information)
        away[each] = left[each] @ (own.T @ slope[scene == each])
    return away, left


def _over_scenes(effect: Effect, deviations: tuple[FloatArray, FloatArray] | None, weights: FloatArray) -> Effect:
    """Generalise the effect to other scenes, by Cochran's Q of the effects (or differences) within scenes.

    Each scene is weighted by the information in its answers. Q divided by its degrees of freedom, scenes - 1, is
    expected to be 1 if scenes do not differ; the excess is their contribution to the variance of the mean.
    """
    if deviations is None:
        return effect
    away, left = deviations[0][:, 1:] @ weights, weights @ deviations[1][:, 1:, 1:] @ weights
    total = float((1 / left).sum())
    q = float(((away - (away / left).sum() / total) ** 2 / left).sum())
    scenes = len(away)
    return with_scenes(effect, scenes, q / (scenes - 1) / total, 1 / total)


def _shares(rows: pd.DataFrame, steps: NDArray[np.int_]) -> tuple[StepShare, ...]:
    keys = ["fixation", "aperture_mm", "aperture"]
    found = []
    for step in map(int, steps):
        own = rows.assign(share=rows["rating"] == step).groupby([*keys, "participant_id"])["share"].mean()
        for fixation, mm, aperture, share in own.groupby(keys).mean().reset_index().itertuples(index=False):
            found.append(StepShare(str(fixation), str(aperture), float(mm), step, float(share)))
    return tuple(found)
