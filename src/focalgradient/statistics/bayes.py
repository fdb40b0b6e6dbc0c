"""Bayesian estimates of the depth effects: crossed random subjects and scenes, explicit priors, sampled by NUTS.

Ratios have the model of the main test, fitted once per fixation and once to the difference; ordinal ratings have one
cumulative-link model for all answers. The models are fitted by bambi and PyMC, which the extra `bayes` installs; both
are imported here only, and only when used.
"""

from __future__ import annotations

import logging
import math
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from focalgradient.analyses import Analysis, analysis_named
from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_installed
from focalgradient.parallel import cores as available_cores
from focalgradient.progress import Progress
from focalgradient.statistics.cells import cells_of, differences, less, rises
from focalgradient.statistics.hypotheses import check_bound
from focalgradient.statistics.posteriors import ORDINAL_PRIORS, RATIO_PRIORS, BayesResult, Name, Posterior, Prior
from focalgradient.statistics.records import NotComputed
from focalgradient.user_tables.tidy import FIXATIONS, check_steps, rating_table

__all__ = [
    "NEEDED",
    "ODDS_BOUND",
    "bayes_depth_rating",
    "effective_number",
    "posterior_of_rises",
    "posteriors_of_steps",
    "quiet",
]

NEEDED = ("a Bayesian model", "bayes", "bambi", "pymc", "arviz")
"""Purpose, extra and modules for `check_installed`."""


KINDS: tuple[Name, ...] = ("nearest", "farthest", "difference")
"""Effects that are estimated."""

ODDS_BOUND: Final = 1.44
"""Default equivalence bound of ordinal ratings: odds ratio of a small effect (d = 0.2), exp(d pi / sqrt(3)) (Chinn
2000).
"""

DRAWS, TUNE, CHAINS = 1000, 1000, 4
"""Number of draws and of tuning steps per chain, and number of chains."""

ORDINAL_DRAWS, ORDINAL_TUNE = 500, 700
"""Draws and tuning steps per chain of the ordinal model, where a draw takes ten times as long and the effective sample
size is a third of the number of draws.
"""

ACCEPT = 0.95  # above the usual 0.8: with few subjects, standard deviations near 0 need smaller steps


def bayes_depth_rating(
    table: pd.DataFrame,
    *,
    bound: float,
    scale: Analysis | Literal["ratio", "ordinal"] = "ratio",
    seed: int = 1,
    progress: Progress | None = None,
) -> BayesResult:
    """Estimate the posterior distributions of the depth effects.

    Parameters
    ----------
    table
        One row per trial: see `focalgradient.user_tables.tidy.rating_table`. Catch trials are excluded.
    bound
        Equivalence bound, above 1: an effect within 1 / bound to bound counts as none. A ratio of ratings, or for
        ordinal ratings an odds ratio of a higher answer.
    scale
        Analysis of the ratings, or its name.
    seed
        Random seed of the chains.
    progress
        Function called with the completed fraction.

    Raises
    ------
    InputError
        If the extra `bayes` is not installed, the table is invalid, or the bound is not above 1 and at most 10.
    """
    check_bound("bound", bound)
    check_installed(*NEEDED)
    analysis = analysis_named(scale)
    table = rating_table(table)
    table = table[~table["catch"]].assign(answer=lambda rows: np.log(rows["rating"]))
    if analysis.whole:
        check_steps(table)
    others = sorted({*table["fixation"]} - {*FIXATIONS})
    if others:
        raise InputError(
            f"fixation is {others[0]!r} in some trials, but the Bayesian models support only nearest and farthest: "
            "leave the others out."
        )
    fit, priors, draws, tune = _ratios, RATIO_PRIORS, DRAWS, TUNE
    if analysis.whole:
        fit, priors, draws, tune = posteriors_of_steps, ORDINAL_PRIORS, ORDINAL_DRAWS, ORDINAL_TUNE
    formula, posteriors = fit(table, bound, seed=seed, progress=progress)
    return BayesResult(
        analysis,
        bound,
        formula,
        priors,
        posteriors,
        f"{CHAINS} chains of {draws:,} draws after {tune:,} tuning steps (NUTS, seed {seed})",
        {name: version(name) for name in ("bambi", "pymc", "arviz")},
    )


def posterior_of_rises(
    rises: pd.DataFrame,
    name: Name,
    bound: float,
    *,
    seed: int = 1,
    progress: Progress | None = None,
    **sampler: int,
) -> Posterior | NotComputed:
    """Estimate the posterior of the mean log ratio, with crossed random effects of subjects and scenes.

    Parameters
    ----------
    rises
        Columns `log_ratio`, `participant_id` and `scene`; missing cells have no row.
    name
        Name of the effect: "nearest", "farthest" or "difference".
    bound
        Equivalence bound, a ratio above 1.
    seed
        Random seed of the chains.
    progress
        Function called with the completed fraction.
    sampler
        `draws`, `tune` and `chains`, where they are not the defaults.
    """
    import bambi

    if rises["participant_id"].nunique() < 2:
        return NotComputed("A hierarchical model needs two or more subjects.")
    several = rises["scene"].nunique() > 1
    prior = {key: _bambi(each) for key, each in RATIO_PRIORS.items()}
    priors = {"Intercept": prior["rise"], "sigma": prior["residual"]}
    for term, column in (("subjects", "participant_id"), ("scenes", "scene"))[: 1 + several]:
        priors[f"1|{column}"] = bambi.Prior("Normal", mu=0, sigma=prior[term])
    with quiet():
        model = bambi.Model(_formula(several), rises, priors=priors, auto_scale=False)
        found = _sampled(model, seed, progress, **{"draws": DRAWS, "tune": TUNE} | sampler)
    spread = {"subjects": _flat(found, "1|participant_id_sigma"), "residual": _flat(found, "sigma")}
    if several:
        spread["scenes"] = _flat(found, "1|scene_sigma")
    names = ["Intercept", "sigma", *(f"{term}_sigma" for term in priors if "|" in term)]
    return _summary(name, _flat(found, "Intercept"), math.log(bound), spread, found, names)


def _formula(several: bool) -> str:
    return "log_ratio ~ 1 + (1 | participant_id)" + (" + (1 | scene)" if several else "")


def _ratios(
    table: pd.DataFrame, bound: float, *, seed: int = 1, progress: Progress | None = None
) -> tuple[str, dict[Name, Posterior | NotComputed]]:
    """Fit one model to the depth effects of each fixation, and one to their difference."""
    data = cells_of(table)
    of: dict[str, pd.DataFrame | NotComputed] = {name: rises(name, data[name]) for name in KINDS if name in data}
    if len(of) == 2:
        of["difference"] = differences(of)[less(*FIXATIONS)]
    cells = {kind: _long(rises) for kind, rises in of.items() if not isinstance(rises, NotComputed)}
    found: dict[Name, Posterior | NotComputed] = {}
    for number, kind in enumerate(KINDS):
        if kind not in cells or cells[kind].empty:
            found[kind] = NotComputed("There are no trials with both the pinhole and a larger aperture to compare.")
            continue

        def part(share: float, what: str, number: int = number) -> None:
            if progress is not None:
                progress((number + share) / len(KINDS), what)

        found[kind] = posterior_of_rises(cells[kind], kind, bound, seed=seed + number, progress=part)
    return _formula(any(rises["scene"].nunique() > 1 for rises in cells.values())), found


def _long(rises: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each log ratio."""
    cells = pd.Series(rises.stack(), name="log_ratio").dropna()
    return cells.rename_axis(["participant_id", "scene"]).reset_index()


def posteriors_of_steps(
    table: pd.DataFrame,
    bound: float,
    *,
    seed: int = 1,
    progress: Progress | None = None,
    **sampler: int,
) -> tuple[str, dict[Name, Posterior | NotComputed]]:
    """Fit one cumulative-link model to all ordinal ratings; derive the difference of the effects from its draws.

    Parameters
    ----------
    table
        Columns `participant_id`, `scene`, `fixation`, `aperture_mm` and `rating` (integers).
    bound
        Equivalence bound, an odds ratio above 1.
    seed
        Random seed of the chains.
    progress
        Function called with the completed fraction.
    sampler
        `draws`, `tune` and `chains`, where they are not the defaults.

    Returns
    -------
    formula, posteriors
        As in `BayesResult`; `spread` of a posterior is the standard deviation of the effect over subjects and scenes.
    """
    import bambi
    from pymc.distributions.transforms import ordered

    fixations = [name for name in FIXATIONS if (table["fixation"] == name).any()]
    width = float(np.ptp(table["aperture_mm"]))
    steps = np.unique(table["rating"].astype(int))
    several = table["scene"].nunique() > 1
    slopes = [f"blur_{name}" for name in fixations]
    fixed = " + ".join([*slopes, *(["fixation"] if len(fixations) > 1 else [])])
    groups = dict((("participant_id", "subjects"), ("scene", "scenes"))[: 1 + several])
    formula = f"rating ~ {fixed} + " + " + ".join(f"(1 + {' + '.join(slopes)} | {group})" for group in groups)
    missing = NotComputed("The ordinal model needs at least two subjects, two apertures and two different answers.")
    if table["participant_id"].nunique() < 2 or width == 0 or len(steps) < 2:
        return formula, dict.fromkeys(KINDS, missing)
    rows = table[["participant_id", "scene"]].astype(str)
    rows["rating"] = pd.Categorical(table["rating"].astype(int), categories=steps, ordered=True)
    for name in fixations:  # scaled to a range of 1, so that a slope is the effect of the largest aperture
        rows[f"blur_{name}"] = (table["fixation"] == name) * table["aperture_mm"] / width
    rows["fixation"] = (table["fixation"] == fixations[-1]).astype(float)
    prior = {key: _bambi(each) for key, each in ORDINAL_PRIORS.items()}
    even = np.arange(1, len(steps)) / len(steps)
    priors: dict[str, Any] = {
        "threshold": bambi.Prior(
            "Normal", mu=np.log(even / (1 - even)), sigma=ORDINAL_PRIORS["thresholds"].sd, transform=ordered
        ),
        **({"fixation": prior["fixation"]} if len(fixations) > 1 else {}),
        **dict.fromkeys(slopes, prior["rise"]),
    }
    for group, term in groups.items():
        priors |= {f"{name}|{group}": bambi.Prior("Normal", mu=0, sigma=prior[term]) for name in ("1", *slopes)}
    with quiet():
        model = bambi.Model(
            formula, rows, family="cumulative", priors=priors, auto_scale=False, center_predictors=False
        )
        posterior = _sampled(model, seed, progress, **{"draws": ORDINAL_DRAWS, "tune": ORDINAL_TUNE} | sampler)
    spreads = [f"{name}|{group}_sigma" for group in groups for name in ("1", *slopes)]
    names = ["threshold", *slopes, *spreads]
    found: dict[Name, Posterior | NotComputed] = {}
    for name in KINDS[:2]:
        if name not in fixations:
            found[name] = NotComputed(f"The {name} object is fixated in no trial.")
            continue
        spread = {term: _flat(posterior, f"blur_{name}|{group}_sigma") for group, term in groups.items()}
        found[name] = _summary(name, _flat(posterior, f"blur_{name}"), math.log(bound), spread, posterior, names)
    near, far = found["nearest"], found["farthest"]
    found["difference"] = NotComputed("There is only one fixation: nothing can be compared.")
    if isinstance(near, Posterior) and isinstance(far, Posterior):
        found["difference"] = _summary("difference", near.draws - far.draws, math.log(bound), {}, posterior, names)
    return formula, found


def _sampled(
    model: Any, seed: int, progress: Progress | None, *, draws: int, tune: int, chains: int | None = None
) -> Any:
    chains = chains or CHAINS
    done, total = [0], chains * (draws + tune)

    def step(**_: Any) -> None:
        done[0] += 1
        if progress is not None and done[0] % 50 == 0:
            progress(min(1.0, done[0] / total), "Bayesian model")

    return model.fit(
        draws=draws,
        tune=tune,
        chains=chains,
        cores=min(chains, available_cores()),  # the draws do not depend on the number of cores
        random_seed=seed,
        target_accept=ACCEPT,
        progressbar=False,
        callback=step,
    )


def _summary(
    name: Name, draws: FloatArray, bound: float, spread: Mapping[str, FloatArray], found: Any, parameters: list[str]
) -> Posterior:
    import arviz

    low, median, high = (float(end) for end in np.quantile(draws, [0.025, 0.5, 0.975]))
    with quiet():
        table = arviz.summary(found, var_names=parameters, kind="diagnostics", round_to="none")
    return Posterior(
        name,
        median,
        low,
        high,
        float((draws > 0).mean()),
        float((np.abs(draws) < bound).mean()),
        float(np.median(spread["subjects"])) if "subjects" in spread else None,
        float(np.median(spread["scenes"])) if "scenes" in spread else None,
        draws,
        spread,
        float(table["r_hat"].max()),
        float(table[["ess_bulk", "ess_tail"]].min().min()),
        int(found.sample_stats["diverging"].sum()),
    )


def _flat(found: Any, name: str) -> FloatArray:
    return np.asarray(found.posterior[name].values, dtype=float).ravel()


def _bambi(prior: Prior) -> Any:
    import bambi

    return bambi.Prior("HalfNormal", sigma=prior.sd) if prior.half else bambi.Prior("Normal", mu=0, sigma=prior.sd)


def effective_number(draws: FloatArray) -> float:
    """Return the effective sample size of the mean of draws (chains x draws); needs the extra `bayes`."""
    import arviz

    return float(np.asarray(arviz.ess(draws)))


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress log messages and warnings of the libraries; the result contains the diagnostics."""
    logs = [logging.getLogger(name) for name in ("pymc", "pytensor", "bambi", "arviz", "arviz_base", "arviz_stats")]
    levels = [log.level for log in logs]
    for log in logs:
        log.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for log, level in zip(logs, levels, strict=True):
            log.setLevel(level)
