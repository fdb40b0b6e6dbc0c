"""Power of experiment 2: simulated percept reports on the rotating Necker cube, with exclusion and analysis.

Rigid and nonrigid percepts alternate, each with a log-normally distributed duration that is correlated with the
previous one. Without a gradient, the log odds of the time of the nonrigid percept vary between subjects. A gradient
that favours it adds the subject's effect times the gradient's strength relative to the largest; one that favours the
rigid percept subtracts as much.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
import pandas as pd
from numpy.random import SeedSequence, default_rng
from scipy import stats

from focalgradient.design import NeckerDesign
from focalgradient.errors import InputError
from focalgradient.power.study import LAPSES, ODDS_RATIOS, SPREAD, Claim, People, Study, planned_trials
from focalgradient.quantities import Range
from focalgradient.statistics.cube_questions import ODDS, PLAIN, condition_name, own_odds, primary_first
from focalgradient.statistics.means import holm
from focalgradient.statistics.questions import Analysis
from focalgradient.statistics.records import ALPHA

__all__ = ["CubeModel", "quick_cube_power", "simulated_reports"]

CUBE_TESTS = {
    "nonrigid_longer": "nonrigid gradient: nonrigid for longer",
    "nonrigid_shorter": "rigid gradient: nonrigid for less long",
}
"""Tests and their meaning, at the largest strength: the first is primary, the other belongs to the secondary family."""

CATCH_LOG_ODDS = 4.0
"""Log odds of the nonrigid percept in catch trials, whose shape is unambiguously nonrigid."""

ROWS = ("trial", "gradient", "strength", "catch", "onset", "duration", "percept", "censored", "trial_duration")


@dataclass(frozen=True, slots=True, kw_only=True)
class CubeModel(People):
    """Statistical model of subjects in experiment 2; docs/power.md gives the source of each value.

    Parameters
    ----------
    effect
        Odds ratio of the nonrigid percept (time of nonrigid over time of rigid) between the largest strength of a
        gradient that favours it and no gradient. A gradient that favours the rigid percept divides the odds by it.
    between
        Standard deviation over subjects of the logarithm of that odds ratio.
    nonrigid
        Proportion of nonrigid in the time of either percept, without a gradient, for the median subject.
    between_levels
        Standard deviation over subjects of the log odds without a gradient.
    dominance, between_dominances, duration_spread
        Geometric mean over subjects of the mean duration (s) of a percept at even odds; standard deviation over
        subjects of its logarithm; and standard deviation of log durations within a subject.
    serial
        Correlation of a log duration with that of the previous percept in the trial.
    first_ratio
        Ratio of the median duration of a trial's first percept to that of later ones, for the same percept. The first
        percept is usually the preferred one, and so longer on average; data of 22 people show no difference beyond
        that.
    lapses
        Lapse rate: proportion of trials answered at even odds, without attention.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    effect: Annotated[float, ODDS_RATIOS] = 1.5
    between: Annotated[float, SPREAD] = 0.3
    nonrigid: Annotated[float, Range("proportions", 0.001, 0.999)] = 0.2  # beyond, one takes no video frame per trial
    between_levels: Annotated[float, SPREAD] = 0.7
    dominance: Annotated[float, Range("seconds", 0.5, 100)] = 5.2
    between_dominances: Annotated[float, SPREAD] = 0.54
    duration_spread: Annotated[float, Range(SPREAD.words, 0.05, 3)] = 0.8
    serial: Annotated[float, Range("correlations", -0.9, 0.9)] = 0.24
    first_ratio: Annotated[float, Range("ratios", 0.1, 10)] = 1.0
    lapses: Annotated[float, LAPSES] = 0.01

    version: ClassVar[int] = 5
    width_label: ClassVar[str] = "95 % interval of the log odds ratio of the nonrigid time: width"
    spreads: ClassVar[tuple[str, ...]] = ("between", "between_levels", "between_dominances")
    designs: ClassVar[type[NeckerDesign]] = NeckerDesign

    def seconds(self, design: NeckerDesign) -> float:
        return 0.012

    def check(self, design: NeckerDesign) -> None:
        People.check(self, design)
        if "none" not in design.gradients or len(design.gradients) < 2:
            raise InputError(
                "gradients must have 'none' and another gradient, because their difference is tested: add the "
                "missing one."
            )

    def analysis(self, design: NeckerDesign, bound: float) -> Analysis:
        asked = People.analysis(self, design, bound)
        # without the checks of a report: a quarter faster
        return replace(asked, prepare=lambda table: own_odds(table[~table["catch"]]))

    def simulated(self, design: NeckerDesign, subjects: int, rng: np.random.Generator, seed: int) -> pd.DataFrame:
        return simulated_reports(design, subjects, self, rng)

    def claims(self, design: NeckerDesign, bound: float) -> Mapping[str, Claim]:
        tested = {"nonrigid": ("nonrigid_longer", 1), "rigid": ("nonrigid_shorter", -1)}
        return {
            test: Claim(CUBE_TESTS[test], ODDS, (_largest(design, gradient),), sign)
            for gradient, (test, sign) in tested.items()
            if gradient in design.gradients
        }

    def measured(self, design: NeckerDesign) -> tuple[tuple[str, str, str], ...]:
        return tuple((f"{name} gradient", ODDS, _largest(design, name)) for name in ("nonrigid", "rigid"))


def _largest(design: NeckerDesign, gradient: str) -> str:
    """Return the level of a gradient at its largest strength."""
    return condition_name((gradient, max(design.strengths_mm)))


def simulated_reports(design: NeckerDesign, subjects: int, model: CubeModel, rng: np.random.Generator) -> pd.DataFrame:
    """Simulate percept reports, one row per report, with the columns of a data set.

    Parameters
    ----------
    design
        Design of the experiment.
    subjects
        Number of subjects.
    model
        Model of the subjects.
    rng
        Random generator.

    Examples
    --------
    >>> table = simulated_reports(NeckerDesign(), 2, CubeModel(), default_rng(1))
    >>> table["trial"].nunique(), sorted(table["percept"].unique())
    (21, ['nonrigid', 'rigid'])
    """
    text = design.model_dump_json()
    signs = {"none": 0.0, "rigid": -1.0, "nonrigid": 1.0}
    tables = []
    for number in range(1, subjects + 1):
        level = math.log(model.nonrigid / (1 - model.nonrigid)) + rng.normal(0, model.between_levels)
        shift = rng.normal(math.log(model.effect), model.between)
        dominance = model.dominance * math.exp(rng.normal(0, model.between_dominances))
        rows: list[tuple[object, ...]] = []
        for trial in planned_trials(type(design), text, f"{number:02}"):
            odds = level + signs[trial.gradient] * shift * trial.strength / max(design.strengths_mm)
            if trial.catch:
                odds = CATCH_LOG_ODDS
            if rng.random() < model.lapses:
                odds = 0.0
            shown = trial.trial, trial.gradient, trial.strength, trial.catch
            for onset, lasts, percept in _reports(trial.trial_s, odds, dominance, model, rng):
                rows.append((*shown, onset, lasts, percept, onset + lasts >= trial.trial_s, trial.trial_s))
        table = pd.DataFrame(rows, columns=list(ROWS))
        tables.append(table.assign(participant_id=f"sub-{number:02}", session="", kind="simulated", dropped_frames=0))
    return pd.concat(tables, ignore_index=True)


def _reports(
    duration: float, odds: float, dominance: float, model: CubeModel, rng: np.random.Generator
) -> list[tuple[float, float, str]]:
    """Return onset, duration and percept of each report; mean durations have the ratio exp(odds)."""
    percepts, spread = ("rigid", "nonrigid"), model.duration_spread
    means = (dominance * math.exp(-odds / 2), dominance * math.exp(odds / 2))
    now, percept = 0.0, int(rng.random() < 1 / (1 + math.exp(-odds)))
    factor, residual, kept = model.first_ratio, rng.standard_normal(), math.sqrt(1 - model.serial**2)
    reports = []
    while now < duration:
        lasts = max(factor * means[percept] * math.exp(spread * residual - spread**2 / 2), 1e-3)
        reports.append((now, min(lasts, duration - now), percepts[percept]))
        now, percept, factor = now + lasts, 1 - percept, 1.0
        residual = model.serial * residual + kept * rng.standard_normal()
    return reports


def quick_cube_power(
    study: Study, subjects: Sequence[int], experiments: int = 2000, people: int = 400
) -> dict[int, dict[str, float]]:
    """Return the power for several numbers of subjects, resampled from one pool, without exclusion.

    Parameters
    ----------
    study
        Power study with a `CubeModel`.
    subjects
        Numbers of subjects.
    experiments
        Number of experiments drawn from the pool for each number of subjects: 2000 give a standard error of .011 at a
        power of .5.
    people
        Size of the pool, whose reports are simulated once.

    Returns
    -------
    dict
        Proportion of significant experiments for each test, by number of subjects.

    Examples
    --------
    >>> design = NeckerDesign(strengths_mm=(4.0,), repetitions=1)
    >>> found = quick_cube_power(Study(CubeModel(effect=4.0, between=0.1), design), [10], 200, 60)
    >>> found[10]["nonrigid_longer"] > 0.8
    True
    """
    rng = default_rng(SeedSequence([study.seed, people, experiments]))
    pool = _pool(study, people, rng)
    places = {test: (list(pool).index(claim.levels[0]), claim.sign) for test, claim in study.claims.items()}
    found = {}
    for number in subjects:
        drawn = pool.to_numpy(dtype=float)[rng.integers(len(pool), size=(experiments, number))]
        t = drawn.mean(axis=1) / (drawn.std(axis=1, ddof=1) / math.sqrt(number))
        p = 2 * stats.t.sf(np.abs(t), number - 1)
        significant = np.column_stack([p[:, :1], holm(p[:, 1:])]) < ALPHA
        found[number] = {
            test: float((significant[:, column] & (sign * t[:, column] > 0)).mean())
            for test, (column, sign) in places.items()
        }
    return found


def _pool(study: Study, people: int, rng: np.random.Generator) -> pd.DataFrame:
    """Return the changes of the log odds by each gradient of people with reports in all, the primary one first."""
    asked = study.analysis
    own = {condition: rows["log_odds"] for condition, rows in asked.prepare(study.table(people, rng)).items()}
    return pd.DataFrame(
        {condition_name(condition): own[condition] - own[PLAIN] for condition in primary_first(own)}
    ).dropna()
