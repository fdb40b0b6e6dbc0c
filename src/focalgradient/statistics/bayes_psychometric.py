"""Bayesian hierarchical psychometric functions: the model of `fit_psychometric_groups`, sampled by PyMC (NUTS).

PyMC is installed by the extra `bayes`; it is imported here only, and only when used.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_installed
from focalgradient.parallel import cores as available_cores
from focalgradient.statistics.bayes import NEEDED, quiet
from focalgradient.statistics.means import student_effect
from focalgradient.statistics.psychometric import Rate, psychometric_data
from focalgradient.statistics.psychometric_model import LAPSE_PRIOR, SLOPE_PRIOR
from focalgradient.statistics.psychometric_records import (
    GroupFunction,
    PersonFunction,
    PsychometricGroups,
    ThresholdDifference,
)
from focalgradient.statistics.psychometric_shapes import SHAPES, Shape
from focalgradient.statistics.records import Interval

__all__ = ["bayes_psychometric_groups"]

FloatArray = NDArray[np.float64]

DRAWS, TUNE, CHAINS, ACCEPT = 1000, 1000, 4, 0.95

THRESHOLD_SD, SD_SCALE, RATE_SD = 2.0, 0.5, 0.5
"""Priors, with levels standardised: SD of the normal prior of mean thresholds; scale of the half-normal priors of the
SDs over people of log slopes (for thresholds, twice this); and the same scale for the log odds of rates.
"""


def bayes_psychometric_groups(
    table: pd.DataFrame | Mapping[str, ArrayLike],
    *,
    shape: Shape | str = "weibull",
    guess: Rate = 0.5,
    lapse: Rate = "people",
    unit: str = "",
    seed: int = 1,
    draws: int = DRAWS,
    tune: int = TUNE,
    chains: int = CHAINS,
) -> PsychometricGroups:
    """Sample the posterior of hierarchical psychometric functions.

    Parameters
    ----------
    table, shape, guess, lapse, unit
        As in `fit_psychometric_groups`; estimated rates have a beta(1, 20) prior.
    seed, draws, tune, chains
        Settings of the sampler.

    Returns
    -------
    PsychometricGroups
        Posterior medians and central 95 % intervals. The differences are tested by posterior mean over posterior
        standard deviation. `diagnostics` contains R-hat, the effective sample size and the number of divergences.

    Raises
    ------
    InputError
        If the extra `bayes` is not installed, there are fewer than two people, or the table or an option is invalid.
    """
    check_installed(*NEEDED)
    import arviz
    import pymc as pm
    import pytensor.tensor as pt

    data = psychometric_data(table, shape=shape, guess=guess, lapse=lapse)
    layout, counts, c = data.layout, data.counts, data.layout.conditions
    people = len(data.participants)
    if people < 2:
        raise InputError("A hierarchical model needs two or more people, but the table has 1: add people.")
    name = next(key for key, one in SHAPES.items() if one is data.shape)
    with quiet(), pm.Model():
        threshold = pm.Normal("threshold", 0, THRESHOLD_SD, shape=c)
        slope = pm.Normal("slope", *SLOPE_PRIOR, shape=c)
        own_t = pm.HalfNormal("sd threshold", 2 * SD_SCALE) * pm.Normal("u", shape=(people, 1))
        own_w = pm.HalfNormal("sd log slope", SD_SCALE) * pm.Normal("w", shape=people)
        if layout.within:
            own_t = own_t + pm.HalfNormal("sd threshold by condition", SD_SCALE) * pm.Normal("d", shape=(people, c))
        at = pm.Deterministic("at", threshold + own_t + pt.zeros((people, c)))
        steep = pm.Deterministic("steep", slope + own_w[:, None])
        rates: dict[str, Any] = {}
        for rate, known, own in (("lapse", layout.lapse, layout.own_lapse), ("guess", layout.guess, layout.own_guess)):
            if known is not None:
                rates[rate] = known + np.zeros(people)
                continue
            mean = pm.Beta(rate, *LAPSE_PRIOR)
            logs = pt.log(mean / (1 - mean)) + pt.zeros(people)
            if own:
                logs = logs + pm.HalfNormal(f"sd log odds of {rate}", RATE_SD) * pm.Normal(f"{rate} z", shape=people)
            rates[rate] = pm.Deterministic(f"{rate} of people", pm.math.sigmoid(logs))
        who, where = counts.person, counts.condition
        z = pt.exp(steep[who, where]) * (counts.x - at[who, where])
        low, miss = rates["guess"][who], rates["lapse"][who]
        p = pt.clip(low + (1 - low - miss) * _sigmoid(name, z), 1e-9, 1 - 1e-9)
        pm.Binomial("right", n=counts.shown.astype(int), p=p, observed=counts.right.astype(int))
        found = pm.sample(
            draws=draws,
            tune=tune,
            chains=chains,
            cores=min(chains, available_cores()),
            random_seed=seed,
            target_accept=ACCEPT,
            progressbar=False,
        )
        watched = [
            one for one in found.posterior if one in ("threshold", "slope", "lapse", "guess") or one.startswith("sd ")
        ]
        checked = arviz.summary(found, var_names=watched, kind="diagnostics", round_to="none")
    draw = {key: np.asarray(found.posterior[key].values, float) for key in found.posterior}
    flat = {key: value.reshape(-1, *value.shape[2:]) for key, value in draw.items()}

    def level(x: FloatArray) -> FloatArray:
        moved = data.center + data.scale * x
        return np.exp(moved) if data.shape.logarithmic else moved

    def rate_of(rate: str, known: float | None) -> Interval:
        return Interval(known, None, None) if known is not None else _interval(flat[rate])

    lapses, guesses = rate_of("lapse", layout.lapse), rate_of("guess", layout.guess)
    groups, persons, differences = [], [], []
    for number, condition in enumerate(data.conditions):
        own = counts.condition == number
        groups.append(
            GroupFunction(
                condition,
                int(np.unique(counts.person[own]).size),
                _interval(level(flat["threshold"][:, number])),
                _interval(np.exp(flat["slope"][:, number]) / data.scale),
                lapses.estimate,
                guesses.estimate,
                name,
            )
        )
    for person, participant in enumerate(data.participants):
        for number, condition in enumerate(data.conditions):
            own = (counts.person == person) & (counts.condition == number)
            if not own.any():
                continue
            persons.append(
                PersonFunction(
                    participant,
                    condition,
                    _interval(level(flat["at"][:, person, number])),
                    _interval(np.exp(flat["steep"][:, person, number]) / data.scale),
                    _rate(flat, "lapse of people", person, layout.lapse),
                    _rate(flat, "guess of people", person, layout.guess),
                    tuple(map(float, data.levels[own])),
                    tuple(map(int, counts.right[own])),
                    tuple(map(int, counts.shown[own])),
                    name,
                )
            )
    method = f"hierarchical psychometric model, NUTS (PyMC {pm.__version__}), {chains} chains of {draws} draws"
    for one, other in combinations(range(c), 2):
        away = data.scale * (flat["threshold"][:, one] - flat["threshold"][:, other])
        effect = student_effect(float(away.mean()), float(away.std(ddof=1)), people, method, df=math.inf)
        differences.append(ThresholdDifference(data.conditions[one], data.conditions[other], effect))
    sd = {
        key: _interval(flat[f"sd {key}"] * (data.scale if key.startswith("threshold") else 1.0)) for key in layout.sds
    }
    diagnostics = {
        "r_hat": float(checked["r_hat"].max()),
        "effective": float(checked[["ess_bulk", "ess_tail"]].min().min()),
        "diverging": float(found.sample_stats["diverging"].sum()),
    }
    return PsychometricGroups(
        name,
        unit,
        tuple(groups),
        tuple(persons),
        tuple(differences),
        lapses,
        guesses,
        sd,
        None,
        int(counts.shown.sum()),
        None,
        method,
        (),
        diagnostics,
    )


def _sigmoid(name: str, z: Any) -> Any:
    """Evaluate the sigmoid `name` in PyTensor."""
    import pytensor.tensor as pt

    return {
        "weibull": lambda: 1 - pt.exp(-math.log(2) * pt.exp(pt.minimum(z, 40.0))),
        "logistic": lambda: pt.sigmoid(z),
        "normal": lambda: 0.5 * pt.erfc(-z / math.sqrt(2)),
        "lognormal": lambda: 0.5 * pt.erfc(-z / math.sqrt(2)),
    }[name]()


def _rate(flat: Mapping[str, FloatArray], key: str, person: int, known: float | None) -> float:
    return known if known is not None else float(np.median(flat[key][:, person]))


def _interval(draws: FloatArray) -> Interval:
    low, middle, high = np.quantile(draws, [0.025, 0.5, 0.975])
    return Interval(float(middle), float(low), float(high))
