"""The rises by Bayes' rule: subjects and scenes crossed as random, priors stated, fitted by bambi and PyMC (NUTS).

Ratios have the model of the headline test, one for each fixation and one for the difference; answers in steps have one
cumulative-link model of all. Both need the extra `bayes`, which is imported only here and only when it is used.
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
from numpy.typing import NDArray

from focalgradient.errors import InputError, check_installed
from focalgradient.parallel import cores as available_cores
from focalgradient.progress import Progress
from focalgradient.scales import Analysis, analysis_named
from focalgradient.statistics.cells import cells
from focalgradient.statistics.hypotheses import check_bound
from focalgradient.statistics.posteriors import ORDINAL_PRIORS, RATIO_PRIORS, BayesResult, Name, Posterior, Prior
from focalgradient.statistics.records import NotComputed
from focalgradient.statistics.tables import FIXATIONS, PINHOLE, check_steps, rating_table

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
"""What needs which extra for which modules: see `check_installed`."""

FloatArray = NDArray[np.float64]


ODDS_BOUND: Final = 1.44
"""Odds ratio of a small effect, d = 0.2, whose logarithm is d pi / sqrt(3) (Chinn 2000): the bound of answers in steps
unless another is given."""

DRAWS, TUNE, CHAINS = 1000, 1000, 4
ORDINAL_DRAWS, ORDINAL_TUNE = 500, 700
"""Fewer, as a draw of that model takes ten times as long: its effective number of draws is a third of them."""

ACCEPT = 0.95  # few subjects leave their spread open near 0: smaller steps than usual


def bayes_depth_rating(
    table: pd.DataFrame,
    *,
    bound: float,
    scale: Analysis | Literal["ratio", "ordinal"] = "ratio",
    seed: int = 1,
    progress: Progress | None = None,
) -> BayesResult:
    """Posterior of the rises of depth ratings.

    Parameters
    ----------
    table
        One row a trial: see `focalgradient.statistics.tables.rating_table`. Catch trials are left out.
    bound
        Above 1: the rise counts as none within 1 / bound ... bound, a ratio of ratings, or an odds ratio of a higher
        answer where the scale is ordinal.
    scale
        What the ratings are.
    seed
        Of the chains.
    progress
        Called with the share done.

    Raises
    ------
    InputError
        If the extra `bayes` is not installed, the table cannot be read, or the bound is not above 1 and at most 10.
    """
    check_bound("bound", bound)
    check_installed(*NEEDED)
    analysis = analysis_named(scale)
    table = rating_table(table)
    table = table[~table["catch"]].assign(answer=lambda rows: np.log(rows["rating"]))
    if analysis.whole:
        check_steps(table)
    posteriors: dict[Name, Posterior | NotComputed]
    others = sorted({*table["fixation"]} - {*FIXATIONS})
    if others:
        raise InputError(
            f"fixation is {others[0]!r} in some trials, but the Bayesian models know nearest and farthest only: leave "
            "them out."
        )
    if analysis.whole:
        formula, posteriors = posteriors_of_steps(
            table, bound, seed=seed, draws=ORDINAL_DRAWS, tune=ORDINAL_TUNE, chains=CHAINS, progress=progress
        )
    else:
        formula, posteriors = _ratios(table, bound, seed, progress)
    draws, tune = (ORDINAL_DRAWS, ORDINAL_TUNE) if analysis.whole else (DRAWS, TUNE)
    return BayesResult(
        analysis,
        bound,
        formula,
        ORDINAL_PRIORS if analysis.whole else RATIO_PRIORS,
        posteriors,
        f"{CHAINS} chains of {draws:,} draws after {tune:,} of tuning (NUTS, seed {seed})",
        {name: version(name) for name in ("bambi", "pymc", "arviz")},
    )


def posterior_of_rises(
    rises: pd.DataFrame,
    name: Name,
    bound: float,
    *,
    seed: int = 1,
    draws: int = DRAWS,
    tune: int = TUNE,
    chains: int = CHAINS,
    progress: Progress | None = None,
) -> Posterior | NotComputed:
    """Posterior of the mean of log ratios, subjects and scenes crossed as random.

    Parameters
    ----------
    rises
        Columns `log_ratio`, `participant_id` and `scene`; gaps are rows that are not there.
    name
        Whose they are.
    bound
        As a ratio above 1.
    seed, draws, tune, chains
        Of the sampler.
    progress
        Called with the share done.
    """
    import bambi

    if rises["participant_id"].nunique() < 2:
        return NotComputed("A model over subjects needs two or more of them.")
    several = rises["scene"].nunique() > 1
    prior = {key: _bambi(each) for key, each in RATIO_PRIORS.items()}
    priors = {"Intercept": prior["rise"], "sigma": prior["residual"]}
    for term, column in (("subjects", "participant_id"), ("scenes", "scene"))[: 1 + several]:
        priors[f"1|{column}"] = bambi.Prior("Normal", mu=0, sigma=prior[term])
    with quiet():
        model = bambi.Model(_formula(several), rises, priors=priors, auto_scale=False)
        found = _sampled(model, seed, draws, tune, chains, progress)
    spread = {"subjects": _flat(found, "1|participant_id_sigma"), "residual": _flat(found, "sigma")}
    if several:
        spread["scenes"] = _flat(found, "1|scene_sigma")
    names = ["Intercept", "sigma", *(f"{term}_sigma" for term in priors if "|" in term)]
    return _summary(name, _flat(found, "Intercept"), math.log(bound), spread, found, names)


def _formula(several: bool) -> str:
    return "log_ratio ~ 1 + (1 | participant_id)" + (" + (1 | scene)" if several else "")


def _ratios(
    table: pd.DataFrame, bound: float, seed: int, progress: Progress | None
) -> tuple[str, dict[Name, Posterior | NotComputed]]:
    """A model for the rises of each fixation, and one for their difference."""
    of: dict[str, pd.Series[float]] = {}
    found: dict[Name, Posterior | NotComputed] = {}
    for fixation in FIXATIONS:
        rows = table[table["fixation"] == fixation]
        if PINHOLE in set(rows["aperture"].astype(str)) and rows["aperture_mm"].nunique() > 1:
            own = cells(rows)
            names = pd.MultiIndex.from_product(
                [own.subjects, own.scenes or ("all",)], names=["participant_id", "scene"]
            )
            of[fixation] = pd.Series(own.against_smallest(-1).ravel(), names, name="log_ratio").dropna()
    if len(of) == 2:
        of["difference"] = (of["nearest"] - of["farthest"]).dropna()
    several = any(each.index.get_level_values("scene").nunique() > 1 for each in of.values())
    kinds: tuple[Name, ...] = ("nearest", "farthest", "difference")
    for number, kind in enumerate(kinds):
        if kind not in of or of[kind].empty:
            found[kind] = NotComputed("There are no trials with both the pinhole and a larger aperture to compare.")
            continue

        def part(share: float, what: str, number: int = number) -> None:
            if progress is not None:
                progress((number + share) / len(kinds), what)

        rises, draws = of[kind].reset_index(), {"draws": DRAWS, "tune": TUNE, "chains": CHAINS}
        found[kind] = posterior_of_rises(rises, kind, bound, seed=seed + number, progress=part, **draws)
    return _formula(several), found


def posteriors_of_steps(
    table: pd.DataFrame,
    bound: float,
    *,
    seed: int = 1,
    draws: int = ORDINAL_DRAWS,
    tune: int = ORDINAL_TUNE,
    chains: int = CHAINS,
    progress: Progress | None = None,
) -> tuple[str, dict[Name, Posterior | NotComputed]]:
    """One cumulative-link model of all answers in steps; the difference of the rises comes from their draws.

    Parameters
    ----------
    table
        Columns `participant_id`, `scene`, `fixation`, `aperture_mm` and `rating`, whole numbers.
    bound
        An odds ratio above 1.
    seed, draws, tune, chains
        Of the sampler.
    progress
        Called with the share done.

    Returns
    -------
    formula, posteriors
        As in `BayesResult`; a posterior's `spread` is that of the rise over subjects and over scenes.
    """
    import bambi
    from pymc.distributions.transforms import ordered

    fixations = [name for name in FIXATIONS if (table["fixation"] == name).any()]
    width = float(np.ptp(table["aperture_mm"]))
    steps = np.unique(table["rating"].astype(int))
    several = table["scene"].nunique() > 1
    slopes = [f"blur_{name}" for name in fixations]
    fixed = " + ".join([*slopes, *(["fixation"] if len(fixations) > 1 else [])])
    groups = ("participant_id", "scene")[: 1 + several]
    formula = f"rating ~ {fixed} + " + " + ".join(f"(1 + {' + '.join(slopes)} | {group})" for group in groups)
    missing = NotComputed("The ordinal model needs two or more subjects, apertures and steps that were used.")
    kinds: tuple[Name, ...] = ("nearest", "farthest", "difference")
    if table["participant_id"].nunique() < 2 or width == 0 or len(steps) < 2:
        return formula, dict.fromkeys(kinds, missing)
    rows = table[["participant_id", "scene"]].astype(str)
    rows["rating"] = pd.Categorical(table["rating"].astype(int), categories=steps, ordered=True)
    for name in fixations:  # a range of 1, so that a slope is the rise at the largest aperture
        rows[f"blur_{name}"] = (table["fixation"] == name) * table["aperture_mm"] / width
    rows["fixation"] = (table["fixation"] == fixations[-1]).astype(float)
    prior = {key: _bambi(each) for key, each in ORDINAL_PRIORS.items()}
    even = np.arange(1, len(steps)) / len(steps)
    priors: dict[str, Any] = {
        "threshold": bambi.Prior(
            "Normal", mu=np.log(even / (1 - even)), sigma=ORDINAL_PRIORS["thresholds"].sd, transform=ordered
        ),
        "fixation": prior["fixation"],
    }
    for name in slopes:
        priors[name] = prior["rise"]
    for group, term in zip(groups, ("subjects", "scenes"), strict=False):
        for name in ("1", *slopes):
            priors[f"{name}|{group}"] = bambi.Prior("Normal", mu=0, sigma=prior[term])
    if len(fixations) < 2:
        del priors["fixation"]
    with quiet():
        model = bambi.Model(
            formula, rows, family="cumulative", priors=priors, auto_scale=False, center_predictors=False
        )
        posterior = _sampled(model, seed, draws, tune, chains, progress)
    spreads = [f"{name}|{group}_sigma" for group in groups for name in ("1", *slopes)]
    names = ["threshold", *slopes, *spreads]
    found: dict[Name, Posterior | NotComputed] = {}
    for name in kinds[:2]:
        if name not in fixations:
            found[name] = NotComputed(f"No trials have the {name} object fixated.")
            continue
        spread = {
            term: _flat(posterior, f"blur_{name}|{group}_sigma")
            for group, term in zip(groups, ("subjects", "scenes"), strict=False)
        }
        found[name] = _summary(name, _flat(posterior, f"blur_{name}"), math.log(bound), spread, posterior, names)
    near, far = found["nearest"], found["farthest"]
    found["difference"] = NotComputed("One fixation only: there is nothing to compare.")
    if isinstance(near, Posterior) and isinstance(far, Posterior):
        found["difference"] = _summary("difference", near.draws - far.draws, math.log(bound), {}, posterior, names)
    return formula, found


def _sampled(model: Any, seed: int, draws: int, tune: int, chains: int, progress: Progress | None) -> Any:
    done, total = [0], chains * (draws + tune)

    def step(**_: Any) -> None:
        done[0] += 1
        if progress is not None and done[0] % 50 == 0:
            progress(min(1.0, done[0] / total), "Bayesian model")

    return model.fit(
        draws=draws,
        tune=tune,
        chains=chains,
        cores=min(chains, available_cores()),  # the draws are the same on any number
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
    """Effective number of draws (of the mean) of a quantity, shape (chains, draws); needs the extra `bayes`."""
    import arviz

    return float(np.asarray(arviz.ess(draws)))


@contextmanager
def quiet() -> Iterator[None]:
    """Silence the libraries' own messages: what matters is in the results."""
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
