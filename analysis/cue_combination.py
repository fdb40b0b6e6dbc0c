"""Combination of two depth cues: fit combination rules to judgements by each cue alone and by both.

Every rule is fitted to single and combined cues in one likelihood, so each comparison includes the uncertainty of the
single-cue thresholds (Landy, Maloney, Johnston & Young 1995; Ernst & Banks 2002, Nature 415). Run:

    python analysis/cue_combination.py cues.csv

The table has one row per trial: `participant`, `first` and `second` (difference between test and standard by each cue,
in one unit; empty where the cue was absent; the two differ in conflict trials) and `larger` (1 where the test was
judged larger, deeper or more slanted, else 0).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize, special, stats

from focalgradient.errors import InputError
from focalgradient.statistics.hessian import covariance_at

FloatArray = NDArray[np.float64]

LAPSE_RATE = 0.02
"""Fixed lapse rate (Wichmann & Hill 2001)."""

MIN_TRIALS = 20
"""Minimum number of trials per person with each single cue, and with both."""

SAMPLES = 99
"""Simulated data sets per person for Bartlett's correction: its factor has a standard error of 14 % for one person."""

MAX_CHANGE = 6.0
"""Maximum change of a log standard deviation or log odds from its start; a penalty keeps the search within it."""

Components = Sequence[tuple[float, float, float]]
"""Mixture components of a rule: proportion of trials, weight of the first cue, SD of the estimate."""
Rule = Callable[[float, float, FloatArray], Components]
"""Combination rule: mixture components from both single-cue SDs and the rule's free parameters."""


def optimal(a: float, b: float) -> tuple[float, float]:
    """Return the optimal weight of the first cue and the combined SD.

    >>> [round(value, 3) for value in optimal(1.0, 2.0)]
    [0.8, 0.894]
    """
    return b**2 / (a**2 + b**2), a * b / math.hypot(a, b)


def _free(a: float, b: float, own: FloatArray) -> Components:
    """Return weight and SD parametrised relative to the optimal ones; the weight is free only with cue conflicts."""
    weight, sd = optimal(a, b)
    odds = special.logit(np.clip(weight, 1e-9, 1 - 1e-9)) + (own[1] if len(own) > 1 else 0.0)
    return [(1.0, float(special.expit(odds)), sd * math.exp(own[0]))]


RULES: dict[str, Rule] = {
    "optimal": lambda a, b, _: [(1.0, *optimal(a, b))],
    "best single cue": lambda a, b, _: [(1.0, float(a <= b), min(a, b))],
    "average": lambda a, b, _: [(1.0, 0.5, math.hypot(a, b) / 2)],
    "switching": lambda a, b, own: [
        (float(special.expit(own[0])), 1.0, a),
        (float(special.expit(-own[0])), 0.0, b),
    ],
    "free": _free,
}
"""Optimal weights; better cue only; equal weights; random switching in a free proportion; free weight and SD."""


def simulate(
    first: FloatArray, second: FloatArray, sds: tuple[float, float], rule: str, *, seed: int, switch: float = 0.0
) -> NDArray[np.bool_]:
    """Simulate the judgements of a person with two single-cue SDs; `switch` is the first cue's log odds (switching)."""
    chance = np.where(np.isnan(second), special.ndtr(first / sds[0]), special.ndtr(second / sds[1]))
    both = ~np.isnan(first + second)
    chance[both] = sum(
        share * special.ndtr((weight * first + (1 - weight) * second)[both] / sd)
        for share, weight, sd in RULES[rule](*sds, np.array([switch]))
    )
    return np.random.default_rng(seed).random(len(first)) < LAPSE_RATE / 2 + (1 - LAPSE_RATE) * chance


class Person:
    """Likelihood of one person's answers; parameters: both log SDs, both biases, then those of the rule."""

    def __init__(self, trials: pd.DataFrame) -> None:
        self.first, self.second = trials["first"].to_numpy(float), trials["second"].to_numpy(float)
        self.sign = np.where(trials["larger"].to_numpy(float) == 1, 1.0, -1.0)
        self.only_first, only_second = np.isnan(self.second), np.isnan(self.first)
        self.both = ~(self.only_first | only_second)
        if min(mask.sum() for mask in (self.only_first, only_second, self.both)) < MIN_TRIALS:
            raise InputError(
                f"trials must include {MIN_TRIALS} or more by each cue alone and by both: add trials, or leave the "
                "person out."
            )
        self.unit = float(np.nanstd(np.concatenate([self.first, self.second])))
        self.conflict = bool(np.ptp((self.first - self.second)[self.both]) > 0)

    def start(self, rule: str) -> FloatArray:
        """Return initial parameters of a rule."""
        own = {"switching": 1, "free": 1 + self.conflict}.get(rule, 0)
        return np.array([math.log(self.unit / 2)] * 2 + [0.0] * (2 + own))

    def probability(self, free: FloatArray, rule: str, sign: FloatArray) -> FloatArray:
        """Return the probability of each answer; `sign` is 1 for larger, -1 for smaller."""
        a, b = math.exp(free[0]), math.exp(free[1])
        first, second = self.first - self.unit * free[2], self.second - self.unit * free[3]
        chance = np.where(self.only_first, special.ndtr(sign * first / a), special.ndtr(sign * second / b))
        chance[self.both] = sum(
            share * special.ndtr((sign * (weight * first + (1 - weight) * second))[self.both] / sd)
            for share, weight, sd in RULES[rule](a, b, free[4:])
        )
        return np.asarray(LAPSE_RATE / 2 + (1 - LAPSE_RATE) * chance)

    def cost(self, free: FloatArray, rule: str) -> float:
        """Return minus the log likelihood, with the penalty of `MAX_CHANGE`."""
        start = self.start(rule)
        excess = float(np.square(np.maximum(np.abs(free - start) - MAX_CHANGE, 0)).sum())
        free = np.clip(free, start - 2 * MAX_CHANGE, start + 2 * MAX_CHANGE)
        return 100 * excess - float(np.log(self.probability(free, rule, self.sign)).sum())

    def fit(self, rule: str) -> tuple[FloatArray, float]:
        """Return the parameters of highest likelihood, and the log likelihood."""
        cost = partial(self.cost, rule=rule)
        fit = optimize.minimize(cost, self.start(rule), method="BFGS", options={"gtol": 1e-3})
        if rule == "switching" or not fit.success:  # mixtures have several maxima; "best single cue" is not smooth
            fit = optimize.minimize(cost, fit.x, method="Nelder-Mead", options={"maxiter": 4000, "fatol": 1e-5})
        return np.asarray(fit.x), -float(fit.fun)

    def mean_ratio(self, parameters: FloatArray, samples: int, seed: int) -> float:
        """Return the mean likelihood ratio, free to optimal, of data simulated by the fitted optimal rule."""
        rng, answered = np.random.default_rng(seed), self.sign
        larger = self.probability(parameters, "optimal", np.ones_like(answered))
        own = self.start("free")[4:]
        ratios = []
        for _ in range(samples):
            self.sign = np.where(rng.random(len(larger)) < larger, 1.0, -1.0)
            fit = optimize.minimize(partial(self.cost, rule="optimal"), parameters, method="BFGS", tol=1e-2)
            start = np.concatenate([fit.x, own])
            freed = optimize.minimize(partial(self.cost, rule="free"), start, method="BFGS", tol=1e-2)
            ratios.append(2 * max(float(fit.fun - freed.fun), 0.0))
        self.sign = answered
        return float(np.mean(ratios))


def compare(table: pd.DataFrame, *, samples: int = SAMPLES, seed: int = 0) -> tuple[pd.DataFrame, pd.DataFrame, float]:
    """Compare the rules over all people, and estimate each person's thresholds.

    Parameters
    ----------
    table
        Trials, with the columns that the module names.
    samples
        Data sets simulated per person for Bartlett's correction of the test; 0 for chi-square without correction.
    seed
        Random seed of the simulations.

    Returns
    -------
    tuple
        Rules by ascending AIC, with their Akaike weights; people, with each single cue's SD, the weight of the first
        cue (NaN without conflicts) and the combined SD, measured with standard errors and predicted; and the p value of
        the likelihood-ratio test of the optimal rule against a free weight and SD.

    Raises
    ------
    InputError
        If a column is missing, an answer is not 0 or 1, a trial has neither cue, or a person has too few trials.
    """
    if missing := {"participant", "first", "second", "larger"} - set(table):
        raise InputError(f"The table has no column {min(missing)!r}: it needs participant, first, second and larger.")
    if not table["larger"].isin([0, 1]).all() or table[["first", "second"]].isna().all(axis=1).any():
        raise InputError("Each trial needs a level of at least one cue, and larger of 0 or 1: leave other trials out.")
    likelihoods, parameters = dict.fromkeys(RULES, 0.0), dict.fromkeys(RULES, 0)
    rows, degrees, expected = [], 0, 0.0
    for number, (name, trials) in enumerate(table.groupby("participant")):
        person = Person(trials)
        fits = {rule: person.fit(rule) for rule in RULES}
        for rule, (free, likelihood) in fits.items():
            likelihoods[rule] += likelihood
            parameters[rule] += len(free)
        rows.append({"participant": name} | _thresholds(person, fits["free"][0]))
        degrees += 1 + person.conflict
        expected += person.mean_ratio(fits["optimal"][0], samples, seed + number) if samples else 1 + person.conflict
    rules = pd.DataFrame({"log_likelihood": likelihoods, "parameters": parameters}).rename_axis("rule").reset_index()
    rules["aic"] = 2 * (rules["parameters"] - rules["log_likelihood"])
    rules["weight"] = special.softmax(-rules["aic"] / 2)
    ratio = max(2 * (likelihoods["free"] - likelihoods["optimal"]), 0.0)
    p = float(stats.chi2.sf(ratio * degrees / expected, degrees))
    return rules.sort_values("aic"), pd.DataFrame(rows), p


def _thresholds(person: Person, free: FloatArray) -> dict[str, float]:
    """Return one person's thresholds by the free rule; errors by the delta method."""

    def values(at: FloatArray) -> FloatArray:
        ((_, weight, sd),) = _free(math.exp(at[0]), math.exp(at[1]), at[4:])
        return np.array([math.exp(at[0]), math.exp(at[1]), weight if person.conflict else math.nan, sd])

    covariance = covariance_at(partial(person.cost, rule="free"), free)
    if covariance is None:
        raise InputError("The answers do not determine the thresholds: use levels closer to them.")
    step = 1e-4 * np.eye(len(free))
    slope = np.array([(values(free + one) - values(free - one)) / 2e-4 for one in step])
    errors = np.sqrt(np.diag(slope.T @ covariance @ slope))
    names = ("first_sd", "second_sd", "first_weight", "combined_sd")
    found = dict(zip(names, values(free).tolist(), strict=True))
    found |= dict(zip((f"{name}_se" for name in names), errors.tolist(), strict=True))
    weight, sd = optimal(found["first_sd"], found["second_sd"])
    return found | {"predicted_weight": weight, "predicted_sd": sd}


def main() -> None:
    """Print the comparison of rules, and each person's thresholds."""
    parser = argparse.ArgumentParser(description="Compare rules by which people combine two depth cues.")
    parser.add_argument("table", help="CSV file of trials: participant, first, second, larger")
    rules, people, p = compare(pd.read_csv(parser.parse_args().table))
    print(rules.round(3).to_string(index=False), people.round(3).to_string(index=False), sep="\n\n")
    print(f"\noptimal against a free weight and standard deviation: p = {p:.3g}")


if __name__ == "__main__":
    main()
