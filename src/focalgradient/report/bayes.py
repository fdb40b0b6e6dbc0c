"""Bayesian section of a report: findings, figure, tables of posteriors and priors, and methods."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.plotting.posteriors import posterior_figure
from focalgradient.progress import Progress
from focalgradient.report.analysed import Ratings
from focalgradient.report.document import Block, Heading, Notice, Paragraph
from focalgradient.report.parts import Output
from focalgradient.report.tables import Sheet, listed, sheet
from focalgradient.scales import Analysis
from focalgradient.statistics import Interval, NotComputed
from focalgradient.statistics.bayes import ODDS_BOUND, bayes_depth_rating
from focalgradient.statistics.posteriors import BayesResult, Posterior
from focalgradient.statistics.wording import SPACE, decimals, interval, number, probability

__all__ = ["bayes_analysis", "bayes_methods", "bayes_part"]

WHAT = {
    "nearest": "With the nearest object in focus, the depth effect",
    "farthest": "With the farthest object in focus, the depth effect",
    "difference": "The near depth effect over the far one",
}
CAPTION = (
    "Bayesian analysis. Left: posterior density of the depth effect with the near and the far object in focus and of "
    "their ratio, prior dashed, the bound within which a depth effect counts as none shaded. Right: standard "
    "deviations of the near depth effect over subjects, over scenes, and of the residual, priors dashed."
)


def bayes_analysis(
    part: Ratings, analysis: Analysis, bound: float | None, used: float, progress: Progress | None
) -> BayesResult:
    """Fit the Bayesian model to the rows kept; `used` is the bound of ratios if the user gave no `bound`."""
    limit = used if analysis.ratios else ODDS_BOUND if bound is None else bound
    return bayes_depth_rating(part.kept, bound=limit, scale=analysis, progress=progress)


def bayes_part(result: BayesResult, output: Output, *, simulated: bool) -> Iterator[Block]:
    """Yield sentences, figure and tables."""
    yield Heading("Bayesian analysis", 3)
    for name, found in result.posteriors.items():
        if isinstance(found, NotComputed):
            yield Paragraph(f"{WHAT[name]} was not estimated: {found.reason}")
        else:
            yield Paragraph(_sentence(found, result))
    fitted = {name: one for name, one in result.posteriors.items() if isinstance(one, Posterior)}
    if loose := [name for name, one in fitted.items() if not one.sound]:
        yield Notice(
            f"The chains of {', '.join(loose)} have not converged (required: R-hat below 1.01, 400 effective draws and "
            "no divergences): these posteriors are approximate."
        )
    if fitted:
        yield output.figure("depth_rating_bayes", posterior_figure(result, simulated=simulated), CAPTION)
    rows = [[name, str(prior), prior.why] for name, prior in result.priors.items()]
    priors = listed("depth_rating_priors.csv", "Priors", ["parameter", "prior (of logarithms)", "why"], rows)
    draws = pd.DataFrame({name: np.asarray(one.draws[::10]) for name, one in fitted.items()})  # for other summaries
    yield from output.tables([_posteriors(result), priors, Sheet("depth_rating_bayes_draws.csv", None, draws)])


def bayes_methods(result: BayesResult) -> str:
    """Return the methods for a paper."""
    software = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    one = (
        "one cumulative-link (logit) model of all answers, random effects uncorrelated"
        if not result.analysis.ratios
        else "one model for the log ratios of each fixation, and one for their difference"
    )
    priors = "; ".join(f"{name} {prior}" for name, prior in result.priors.items())
    return (
        f"Bayesian analysis: {result.formula}, {one}; subjects and scenes as crossed random effects. Priors: {priors}. "
        f"{result.sampler}, by {software}. Intervals are the central 95{SPACE}% of the posterior; a depth effect "
        f"counts as none within a factor of {decimals(result.bound)} on either side."
    )


def _sentence(found: Posterior, result: BayesResult) -> str:
    what = "odds ratio" if not result.analysis.ratios else "ratio"
    ends = interval(math.exp(found.low), math.exp(found.high), 2)
    return (
        f"{WHAT[found.name]} has the posterior median {decimals(math.exp(found.median))} ({what}, 95{SPACE}% credible "
        f"interval {ends}); it is above 1 with a probability of {_probability(found.above)}, and within a factor of "
        f"{decimals(result.bound)} of 1 with {_probability(found.within)}."
    )


def _probability(share: float) -> str:
    r"""Format a probability estimated from draws: three decimals, never 1.

    >>> _probability(0.99999), _probability(0.034)
    ('>\xa0.999', '.034')
    """
    return f">{SPACE}.999" if share > 0.999 else probability(share)


COLUMNS = {
    "depth effect": "{name}",
    "median": "{ratio.estimate:2}",
    "95 %": "{ratio:i2}",
    "p(above 1)": "{above}",
    "p(within the bound)": "{within}",
    "SD of subjects": "{found.subjects:3}",
    "SD of scenes": "{found.scenes:3}",
    "R-hat": "{found.r_hat:3}",
    "effective draws": "{found.effective:.0f}",
    "divergences": "{found.divergences}",
}
STORED = ("median", "low", "high", "above", "within", "subjects", "scenes", "r_hat", "effective", "divergences")


def _posteriors(result: BayesResult) -> Sheet:
    rows, digits = list[dict[str, Any]](), []
    for name, found in result.posteriors.items():
        rows.append({"name": name, "found": found})
        if isinstance(found, NotComputed):
            digits.append({"rise": name, "not_computed": found.reason})
            continue
        ratio = Interval(math.exp(found.median), math.exp(found.low), math.exp(found.high))
        rows[-1] |= {"ratio": ratio, "above": _probability(found.above), "within": _probability(found.within)}
        digits.append({"rise": name} | {field: getattr(found, field) for field in STORED})
    caption = f"Posterior of the depth effects: {result.formula}; bound {number(result.bound)}"
    return sheet("depth_rating_bayes.csv", caption, rows, COLUMNS, digits=pd.DataFrame(digits))
