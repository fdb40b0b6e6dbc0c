"""Combination of two depth cues: optimal predictions from single-cue thresholds, and comparison of combination rules.

`predict_combined` takes numerical thresholds. `fit_cue_combination` takes trials and fits combination rules to single
and combined cues in one likelihood, so that every test includes the uncertainty of the single-cue thresholds (Landy,
Maloney, Johnston & Young 1995; Ernst & Banks 2002, Nature 415).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special, stats

from focalgradient.errors import InputError
from focalgradient.statistics.hessian import covariance_at, polished
from focalgradient.statistics.records import NotComputed

__all__ = [
    "CUE_RULES",
    "CueCombination",
    "CueModel",
    "CuePerson",
    "CuePrediction",
    "CueThreshold",
    "fit_cue_combination",
    "predict_combined",
    "simulate_cue_judgements",
]

FloatArray = NDArray[np.float64]

LAPSES = 0.02
"""Lapse rate, fixed (Wichmann & Hill 2001)."""

MIN_TRIALS = 20
"""Minimum number of trials per person with each single cue, and with both."""

SAMPLES = 99
"""Default number of simulated data sets for Bartlett's correction: its factor has a standard error of 14 % for one
person, and less for more people.
"""

MAX_PARAMETER_CHANGE = 6.0
"""Maximum change of a log standard deviation or log odds from its start; a penalty keeps the search within it."""


@dataclass(frozen=True, slots=True)
class CueThreshold:
    """Cumulative normal psychometric function with mean `pse` and SD `sd`, in the unit of the levels."""

    sd: float
    sd_se: float
    pse: float = 0.0
    pse_se: float = 0.0


@dataclass(frozen=True, slots=True)
class CuePrediction:
    """Prediction of the optimal combination of independent cues.

    Parameters
    ----------
    weights, weight_ses
        Weight of each cue, proportional to its inverse variance, and standard error.
    combined
        Predicted psychometric function of all cues together.
    p_sd, p_pse
        Two-sided p values of the difference between measured and predicted function (z tests; of the log sd, and of the
        pse); NaN without a measurement.
    p_best
        One-sided p value of the hypothesis that the measured sd is no smaller than that of the best single cue.
    """

    weights: tuple[float, ...]
    weight_ses: tuple[float, ...]
    combined: CueThreshold
    p_sd: float = math.nan
    p_pse: float = math.nan
    p_best: float = math.nan


def predict_combined(cues: Sequence[CueThreshold], measured: CueThreshold | None = None) -> CuePrediction:
    """Predict the psychometric function of combined cues from the single cues, and test a measured one against it.

    Raises
    ------
    InputError
        With fewer than 2 cues, or if a standard deviation is not positive.

    Examples
    --------
    >>> found = predict_combined([CueThreshold(1.0, 0.1), CueThreshold(2.0, 0.2)], CueThreshold(0.9, 0.08))
    >>> round(found.weights[0], 2), round(found.combined.sd, 3), round(found.p_sd, 2)
    (0.8, 0.894, 0.96)
    """
    if len(cues) < 2:
        raise InputError(f"cues must have at least 2 thresholds, got {len(cues)}.")
    for one in [*cues, *([measured] if measured else [])]:
        if not (math.isfinite(one.sd) and one.sd > 0 and min(one.sd_se, one.pse_se) >= 0):
            raise InputError(f"sd must be positive and standard errors must not be negative, got {one}.")
    sds = np.array([one.sd for one in cues])
    relative = np.array([one.sd_se for one in cues]) / sds
    weights = sds**-2 / (sds**-2).sum()
    slope = 2 * weights[:, None] * (weights[None] - np.eye(len(cues)))  # derivative of the weights by the log sds
    weight_ses = np.sqrt(slope**2 @ relative**2)
    pses, pse_ses = np.array([(one.pse, one.pse_se) for one in cues]).T
    sd = float((sds**-2).sum() ** -0.5)
    log_se = float(np.hypot.reduce(weights * relative))
    pse_se = math.sqrt(float(((pses @ slope * relative) ** 2).sum() + ((weights * pse_ses) ** 2).sum()))
    combined = CueThreshold(sd, sd * log_se, float(weights @ pses), pse_se)
    stated = tuple(weights.tolist()), tuple(weight_ses.tolist()), combined
    if measured is None:
        return CuePrediction(*stated)
    own, best = measured.sd_se / measured.sd, int(sds.argmin())
    return CuePrediction(
        *stated,
        p_sd=_two_sided(math.log(measured.sd / sd), math.hypot(own, log_se)),
        p_pse=_two_sided(measured.pse - combined.pse, math.hypot(measured.pse_se, pse_se)),
        p_best=float(stats.norm.cdf(_score(math.log(measured.sd / sds[best]), math.hypot(own, relative[best])))),
    )


def _score(difference: float, error: float) -> float:
    return difference / error if error > 0 else math.nan


def _two_sided(difference: float, error: float) -> float:
    return float(2 * stats.norm.sf(abs(_score(difference, error))))


Components = Sequence[tuple[FloatArray | float, FloatArray | float, FloatArray | float]]
"""Mixture components of a rule: proportion of trials, weight of the first cue, SD of the estimate."""


@dataclass(frozen=True)
class CueRule:
    """Combination rule, which maps single-cue SDs and the rule's free parameters to mixture components.

    `start` contains the initial parameter values: log odds of a weight or proportion, log ratio of a standard
    deviation.
    """

    parts: Callable[[float, float, FloatArray], Components]
    start: tuple[float, ...] = ()


def _optimal(a: float, b: float) -> tuple[float, float]:
    return b**2 / (a**2 + b**2), a * b / math.hypot(a, b)


def _best(a: float, b: float, _: FloatArray) -> Components:
    return [(1.0, float(a <= b), min(a, b))]


def _free(a: float, b: float, own: FloatArray) -> Components:
    """Return weight and SD parametrised relative to the optimal ones; the weight is free only with cue conflicts."""
    weight, sd = _optimal(a, b)
    odds = special.logit(np.clip(weight, 1e-9, 1 - 1e-9)) + (own[1] if len(own) > 1 else 0.0)
    return [(1.0, float(special.expit(odds)), sd * math.exp(own[0]))]


CUE_RULES: Mapping[str, CueRule] = {
    "optimal": CueRule(lambda a, b, _: [(1.0, *_optimal(a, b))]),
    "best single cue": CueRule(_best),
    "average": CueRule(lambda a, b, _: [(1.0, 0.5, math.hypot(a, b) / 2)]),
    "switching": CueRule(
        lambda a, b, own: [(special.expit(own[0]), 1.0, a), (special.expit(-own[0]), 0.0, b)], start=(0.0,)
    ),
}
"""Combination rules: optimal weights; better cue only; equal weights; random switching between cues (free proportion).
"""


@dataclass(frozen=True, slots=True)
class CueModel:
    """Fit of one rule to all people, with its Akaike `weight` and its BIC `bayes_factor` over the optimal rule."""

    name: str
    log_likelihood: float
    parameters: int
    aic: float
    bic: float
    weight: float
    bayes_factor: float


@dataclass(frozen=True, slots=True)
class CuePerson:
    """One person's psychometric functions with standard errors, and the log likelihood of each rule.

    `weight` is that of the first cue, measured from cue conflicts (NaN without any); `predicted` follows from the
    single cues.
    """

    participant_id: str
    first: CueThreshold
    second: CueThreshold
    combined: CueThreshold
    weight: float
    weight_se: float
    predicted: CuePrediction
    log_likelihoods: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class CueCombination:
    """Comparison of combination rules.

    Parameters
    ----------
    models
        Fitted rules, in ascending order of AIC.
    p_optimal
        p value of the likelihood-ratio test of the optimal rule against free weights and SDs, with Bartlett's
        correction; a small value indicates suboptimal combination.
    people
        Results of each person.
    trials
        Number of answers.
    """

    models: tuple[CueModel, ...]
    p_optimal: float
    people: tuple[CuePerson, ...]
    trials: int


class _Person:
    """Likelihood of one person's answers; parameters: both log SDs, both biases, then those of the rule."""

    def __init__(self, first: FloatArray, second: FloatArray, larger: NDArray[np.bool_]):
        self.first, self.second, self.sign = first, second, np.where(larger, 1.0, -1.0)
        self.alone = np.isnan(second), np.isnan(first)
        self.both = ~(self.alone[0] | self.alone[1])
        self.conflict = bool(np.ptp(first[self.both] - second[self.both]) > 0)
        unit = float(np.nanstd(np.concatenate([first, second])))
        self.start = np.array([math.log(unit / 2), math.log(unit / 2), 0.0, 0.0])
        self.unit = unit

    def cost(self, free: FloatArray, rule: CueRule) -> float:
        beyond = float(np.square(np.maximum(np.abs(free - self.whole(rule)) - MAX_PARAMETER_CHANGE, 0)).sum())
        free = np.clip(free, self.whole(rule) - 2 * MAX_PARAMETER_CHANGE, self.whole(rule) + 2 * MAX_PARAMETER_CHANGE)
        return 100 * beyond - float(np.log(self.probability(free, rule, self.sign)).sum())

    def probability(self, free: FloatArray, rule: CueRule, sign: FloatArray) -> FloatArray:
        """Return the probability of each answer; `sign` is 1 for larger, -1 for smaller."""
        a, b = math.exp(free[0]), math.exp(free[1])
        first, second = self.first - self.unit * free[2], self.second - self.unit * free[3]
        chance = np.where(self.alone[0], special.ndtr(sign * first / a), special.ndtr(sign * second / b))
        one, other, of_both = first[self.both], second[self.both], sign[self.both]
        chance[self.both] = sum(
            share * special.ndtr(of_both * (weight * one + (1 - weight) * other) / sd)
            for share, weight, sd in rule.parts(a, b, free[4:])
        )
        return np.asarray(LAPSES / 2 + (1 - LAPSES) * chance)

    def ratios_by_chance(self, optimal: FloatArray, free_rule: CueRule, samples: int, seed: int) -> FloatArray:
        """Return the likelihood ratios, free to optimal rule, of data simulated by the fitted optimal rule."""
        rng = np.random.default_rng(seed)
        rule = CUE_RULES["optimal"]
        larger = self.probability(optimal, rule, np.ones_like(self.sign))
        answered, found = self.sign, []
        for _ in range(samples):
            self.sign = np.where(rng.random(len(larger)) < larger, 1.0, -1.0)
            options: Any = {"gtol": 1e-2}
            fit = optimize.minimize(partial(self.cost, rule=rule), optimal, method="BFGS", options=options)
            start = np.concatenate([fit.x, free_rule.start])
            freed = optimize.minimize(partial(self.cost, rule=free_rule), start, method="BFGS", options=options)
            found.append(2 * max(float(fit.fun - freed.fun), 0.0))
        self.sign = answered
        return np.array(found)

    def whole(self, rule: CueRule) -> FloatArray:
        return np.concatenate([self.start, rule.start])

    def fitted(self, rule: CueRule) -> tuple[FloatArray, float]:
        cost = partial(self.cost, rule=rule)
        found = optimize.minimize(cost, self.whole(rule), method="BFGS", options={"gtol": 1e-3})
        if rule.start or not found.success:  # mixtures have several maxima; "best" is not smooth
            options: Any = {"xatol": 1e-4, "fatol": 1e-5, "maxiter": 4000}
            found = optimize.minimize(cost, found.x, method="Nelder-Mead", options=options)
        end = polished(cost, found.x)
        end = np.asarray(found.x) if end is None else end
        return end, -cost(end)

    def thresholds(self, free: FloatArray, covariance: FloatArray) -> tuple[CueThreshold, CueThreshold]:
        errors = np.sqrt(np.diag(covariance))
        sds = np.exp(free[:2])
        first, second = (
            CueThreshold(
                float(sds[k]),
                float(sds[k] * errors[k]),
                float(self.unit * free[2 + k]),
                float(self.unit * errors[2 + k]),
            )
            for k in (0, 1)
        )
        return first, second


def fit_cue_combination(
    first: ArrayLike,
    second: ArrayLike,
    larger: ArrayLike,
    participant: ArrayLike | None = None,
    *,
    bootstrap: int = SAMPLES,
    seed: int = 0,
) -> CueCombination | NotComputed:
    """Fit combination rules to judgements by each cue alone and by both.

    Parameters
    ----------
    first, second
        Difference between test and standard by each cue, in any common unit (one entry per trial); NaN if the cue was
        absent. Trials in which the two differ are cue conflicts, which determine the weights.
    larger
        1 or True if the test was judged larger (deeper, more slanted), else 0.
    participant
        Participant of each trial; None: a single person.
    bootstrap
        Number of data sets simulated per person by the fitted optimal rule, for Bartlett's correction: the likelihood
        ratio is divided by its simulated mean and multiplied by its degrees of freedom. 0: no correction; chi-square
        then holds only for many trials.
    seed
        Random seed of the simulations.

    Returns
    -------
    CueCombination or NotComputed
        `NotComputed` states the reason.

    Raises
    ------
    InputError
        If lengths differ, a trial has neither cue, or an answer is not 0 or 1.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> level, cues = rng.uniform(-3, 3, 1200), np.repeat([0, 1, 2], 400)
    >>> a, b = np.where(cues == 1, np.nan, level), np.where(cues == 0, np.nan, level)
    >>> larger = simulate_cue_judgements(a, b, (1.0, 1.5), "optimal", seed=2)
    >>> found = fit_cue_combination(a, b, larger, bootstrap=20)
    >>> bool(found.p_optimal > 0.01), len(found.models)
    (True, 5)
    """
    a, b, answers = np.asarray(first, float), np.asarray(second, float), np.asarray(larger)
    who = np.zeros(len(answers), int).astype(str) if participant is None else np.asarray(participant).astype(str)
    if a.ndim != 1 or not a.shape == b.shape == answers.shape == who.shape:
        raise InputError("first, second, larger and participant differ in length: give one entry a trial in each.")
    if np.isinf(a).any() or np.isinf(b).any() or (np.isnan(a) & np.isnan(b)).any():
        raise InputError("A trial has an infinite level or neither cue: leave it out.")
    if not np.isin(answers, (0, 1)).all():
        raise InputError("larger must be 1 where the test was judged larger, else 0.")
    people, of_rules, df, ratio, by_chance = [], dict.fromkeys([*CUE_RULES, "free"], 0.0), 0, 0.0, 0.0
    for number, name in enumerate(np.unique(who).tolist()):
        own = who == name
        counts = {
            "the first cue alone": int((own & np.isnan(b)).sum()),
            "the second cue alone": int((own & np.isnan(a)).sum()),
            "both cues": int((own & ~np.isnan(a + b)).sum()),
        }
        for what, count in counts.items():
            if count < MIN_TRIALS:
                return NotComputed(f"{name} has {count} trials by {what}, and {MIN_TRIALS} are needed.")
        person = _Person(a[own], b[own], answers[own].astype(bool))
        free_rule = CueRule(_free, (0.0, 0.0) if person.conflict else (0.0,))
        fits = {rule: person.fitted(each) for rule, each in {**CUE_RULES, "free": free_rule}.items()}
        covariance = covariance_at(partial(person.cost, rule=free_rule), fits["free"][0])
        if covariance is None:
            return NotComputed(f"The answers of {name} do not determine the thresholds: use levels closer to them.")
        people.append(_person(name, person, fits, covariance))
        for rule, (_, likelihood) in fits.items():
            of_rules[rule] += likelihood
        df += len(free_rule.start)
        ratio += 2 * (fits["free"][1] - fits["optimal"][1])
        if bootstrap:
            by_chance += float(person.ratios_by_chance(fits["optimal"][0], free_rule, bootstrap, seed + number).mean())
    counts_of = {rule: len(people) * (4 + len(each.start)) for rule, each in CUE_RULES.items()}
    parameters = counts_of | {"free": len(people) * 4 + df}
    return CueCombination(
        _models(of_rules, parameters, len(answers)),
        float(stats.chi2.sf(max(ratio, 0.0) * (df / by_chance if by_chance else 1.0), df)),
        tuple(people),
        len(answers),
    )


def _models(likelihoods: Mapping[str, float], parameters: Mapping[str, int], trials: int) -> tuple[CueModel, ...]:
    aic = {name: 2 * parameters[name] - 2 * value for name, value in likelihoods.items()}
    bic = {name: parameters[name] * math.log(trials) - 2 * value for name, value in likelihoods.items()}
    share = {name: math.exp((min(aic.values()) - value) / 2) for name, value in aic.items()}
    models = [
        CueModel(
            name,
            value,
            parameters[name],
            aic[name],
            bic[name],
            share[name] / sum(share.values()),
            math.exp(min((bic["optimal"] - bic[name]) / 2, 700.0)),
        )
        for name, value in likelihoods.items()
    ]
    return tuple(sorted(models, key=lambda one: one.aic))


def _person(
    name: str, person: _Person, fits: Mapping[str, tuple[FloatArray, float]], covariance: FloatArray
) -> CuePerson:
    """Derive one person's psychometric functions from the free rule; those of both cues by the delta method."""
    free = fits["free"][0]
    a, b = person.thresholds(free, covariance)

    def both(at: FloatArray) -> FloatArray:
        ((_, weight, sd),) = _free(math.exp(at[0]), math.exp(at[1]), at[4:])
        weight = float(weight)
        return np.array([sd, person.unit * (weight * at[2] + (1 - weight) * at[3]), weight])

    step = 1e-4 * np.eye(len(free))
    slope = np.array([(both(free + one) - both(free - one)) / 2e-4 for one in step])
    sd_se, pse_se, weight_se = np.sqrt(np.diag(slope.T @ covariance @ slope)).tolist()
    sd, pse, weight = both(free).tolist()
    combined = CueThreshold(sd, sd_se, pse, pse_se)
    if not person.conflict:
        weight = weight_se = math.nan
    likelihoods = {rule: value for rule, (_, value) in fits.items()}
    return CuePerson(name, a, b, combined, weight, weight_se, predict_combined([a, b]), likelihoods)


def simulate_cue_judgements(
    first: ArrayLike,
    second: ArrayLike,
    sds: tuple[float, float],
    rule: str = "optimal",
    *,
    own: float = 0.0,
    seed: int = 0,
) -> NDArray[np.bool_]:
    """Simulate the judgements of a person with single-cue SDs `sds` who combines cues by a rule of `CUE_RULES`.

    `first` and `second` are as in `fit_cue_combination`; `own` is the log odds of the first cue when switching.

    Raises
    ------
    InputError
        If the rule is not one of `CUE_RULES`.
    """
    if rule not in CUE_RULES:
        raise InputError(f"rule is {rule!r}, but must be one of {', '.join(CUE_RULES)}.")
    a, b = np.asarray(first, float), np.asarray(second, float)
    chance = np.where(np.isnan(b), special.ndtr(a / sds[0]), special.ndtr(b / sds[1]))
    both = ~np.isnan(a + b)
    chance[both] = sum(
        share * special.ndtr((weight * a + (1 - weight) * b)[both] / sd)
        for share, weight, sd in CUE_RULES[rule].parts(*sds, np.array([own]))
    )
    rng = np.random.default_rng(seed)
    return np.asarray(rng.random(len(a)) < LAPSES / 2 + (1 - LAPSES) * chance)
