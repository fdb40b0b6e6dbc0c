"""Sequential designs with interim analyses; error rates are simulated with the report's test.

Group-sequential bounds spend the error rate over the analyses (Lan & DeMets 1983). With Bayes factors an experiment
stops at a bound for either hypothesis (Schönbrodt, Wagenmakers, Zehetleitner & Perugini 2017); its error rates are not
set, but estimated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.parallel import in_order
from focalgradient.power.study import AnyStudy
from focalgradient.statistics import Effect
from focalgradient.statistics.records import ALPHA

__all__ = ["RULES", "Look", "bayes_factor", "sequential_power", "spending_bounds"]

Rule = Literal["obrien-fleming", "pocock", "bayes-factor"]
RULES: tuple[Rule, ...] = ("obrien-fleming", "pocock", "bayes-factor")

NODES = 801
"""Number of grid points of the density between the bounds: nominal levels agree with published ones to 1e-5."""

CAUCHY = math.sqrt(2) / 2
"""Scale of the Cauchy prior of the standardised effect (Rouder, Speckman, Sun, Morey & Iverson 2009; "medium")."""


@dataclass(frozen=True, slots=True)
class Look:
    """Results at one interim (or the final) analysis.

    Parameters
    ----------
    subjects
        Number of subjects at this analysis.
    bound
        Two-sided p value below which the experiment stops; for Bayes factors, the factor for either hypothesis.
    stopped_without_effect, stopped_with_effect
        Proportion of experiments that stop at this analysis, without and with the assumed effect.
    error, power
        Proportion that found an effect at this analysis or earlier: without the assumed effect in either direction,
        with it in the direction of the study's primary test.
    missed
        Proportion with the assumed effect that stopped for the null hypothesis at this analysis or earlier (Bayes
        factors).
    mean_subjects_without_effect, mean_subjects_with_effect
        Mean number of subjects at the end of experiments; the same in each row.
    """

    subjects: int
    bound: float
    stopped_without_effect: float
    stopped_with_effect: float
    error: float
    power: float
    missed: float
    mean_subjects_without_effect: float
    mean_subjects_with_effect: float


def spending_bounds(shares: Sequence[float], rule: Rule, alpha: float = ALPHA) -> tuple[float, ...]:
    """Return the nominal two-sided significance levels of group-sequential analyses.

    Parameters
    ----------
    shares
        Fraction of the final number of subjects at each analysis: increasing, ending with 1.
    rule
        Spending function of Lan and DeMets: "obrien-fleming" or "pocock".
    alpha
        Total error rate over all analyses.

    Raises
    ------
    InputError
        If the fractions do not increase to 1, or the rule is unknown.

    Examples
    --------
    Three equally spaced analyses stop beyond z = 3.71, 2.51 and 1.99 (Reboussin, DeMets, Kim & Lan 2000):

    >>> from scipy.stats import norm
    >>> [round(float(norm.isf(p / 2)), 2) for p in spending_bounds([1 / 3, 2 / 3, 1], "obrien-fleming")]
    [3.71, 2.51, 1.99]
    """
    from scipy import optimize, stats

    times = np.asarray(shares, float)
    if not (times.size and (np.diff(times, prepend=0) > 0).all() and math.isclose(times[-1], 1)):
        raise InputError(f"shares are {list(shares)}, but must increase to 1: give increasing numbers of subjects.")
    spending: dict[str, Callable[[float], float]] = {
        "obrien-fleming": lambda t: 4 * float(stats.norm.sf(stats.norm.isf(alpha / 4) / math.sqrt(t))),
        "pocock": lambda t: alpha * math.log(1 + (math.e - 1) * t),
    }
    if rule not in spending:
        raise InputError(f"rule is {rule!r}, but must be 'obrien-fleming' or 'pocock'.")
    spent = [spending[rule](float(t)) for t in times]
    levels: list[float] = []
    nodes, density = np.zeros(1), np.ones(1)  # density of z times the root of the fraction, at grid points
    before = 0.0
    for at, time in enumerate(times):
        sd = math.sqrt(time - before)
        root = math.sqrt(float(time))
        due = spent[at] - (spent[at - 1] if at else 0.0)

        def crossed(
            z: float,
            nodes: NDArray[np.float64] = nodes,
            density: NDArray[np.float64] = density,
            sd: float = sd,
            root: float = root,
        ) -> float:
            out = stats.norm.sf((z * root - nodes) / sd) + stats.norm.cdf((-z * root - nodes) / sd)
            return float(density @ out)

        z = float(optimize.brentq(lambda z: crossed(z) - due, 0.0, 20.0))  # noqa: B023  called at once
        levels.append(2 * float(stats.norm.sf(z)))
        inside = np.linspace(-z * root, z * root, NODES)
        weights = np.full(NODES, inside[1] - inside[0])
        weights[[0, -1]] /= 2
        density = weights * (stats.norm.pdf((inside[:, None] - nodes) / sd) / sd @ density)
        nodes, before = inside, float(time)
    return tuple(levels)


def bayes_factor(t: float, subjects: float) -> float:
    """Return the Bayes factor for an effect, given a one-sample t with the default (JZS) prior.

    Rouder et al. (2009), equation 1, with a Cauchy prior of scale 0.707 on the standardised effect.

    Parameters
    ----------
    t
        Student's t.
    subjects
        Number of subjects; for a test with other degrees of freedom, these plus 1.

    Examples
    --------
    >>> round(bayes_factor(2.24, 80), 2), round(bayes_factor(0.0, 20), 3)
    (1.3, 0.232)
    """
    from scipy import integrate

    df = subjects - 1
    without = (1 + t**2 / df) ** (-(df + 1) / 2)

    def with_effect(g: float) -> float:
        wide = 1 + subjects * CAUCHY**2 * g
        prior = (2 * math.pi) ** -0.5 * g**-1.5 * math.exp(-1 / (2 * g))
        return float(wide**-0.5 * (1 + t**2 / (wide * df)) ** (-(df + 1) / 2) * prior)

    return float(integrate.quad(with_effect, 0, math.inf)[0] / without)


def sequential_power(
    study: AnyStudy,
    looks: Sequence[int],
    experiments: int,
    rule: Rule,
    *,
    factor: float = 10.0,
    executor: Executor | None = None,
) -> tuple[Look, ...]:
    """Return the results of a sequential design with and without the assumed effect.

    Parameters
    ----------
    study
        Power study, whose primary test decides at each analysis, without exclusion.
    looks
        Numbers of subjects at which the data are analysed; the last ends the experiment.
    experiments
        Number of experiments with and, again, without the effect.
    rule
        Stopping rule, one of `RULES`.
    factor
        Bayes factor for either hypothesis at which an experiment stops, above 1.
    executor
        Executor of the simulations. None: this process.

    Raises
    ------
    InputError
        If there are fewer than two analyses, the factor is not above 1, or the study has no test.
    """
    counts = sorted(set(looks))
    if len(counts) < 2:
        raise InputError(
            "looks has one number of subjects, but a sequential design needs at least two: give, for example, 6,10,20."
        )
    if not factor > 1:
        raise InputError(f"factor is {factor!r}, but must be a Bayes factor above 1, such as 10.")
    bayes = rule == "bayes-factor"
    bounds = [factor] * len(counts) if bayes else list(spending_bounds([one / counts[-1] for one in counts], rule))
    blind = study.without_effect()
    jobs = [(one, counts, number) for one in (blind, study) for number in range(experiments)]
    outcomes = np.array(list(in_order(executor, _primaries, jobs))).reshape(2, experiments, len(counts), 4)
    decided = _decided(outcomes, bounds, bayes=bayes)
    # First analysis at which an experiment stops, and for which hypothesis; the last analysis ends it.
    stop = decided != 0
    stop[:, :, -1] = True
    first = stop.argmax(axis=2)
    verdict = np.take_along_axis(decided, first[:, :, None], 2)[:, :, 0]
    means = np.array(counts)[first].mean(axis=1)
    found = []
    for at, (count, bound) in enumerate(zip(counts, bounds, strict=True)):
        here = first <= at
        # without an effect either direction is an error; with one only the true direction is a correct result
        error = float((here[0] & (np.abs(verdict[0]) == 1)).mean())
        power = float((here[1] & (verdict[1] == 1)).mean())
        missed = float((here[1] & (verdict[1] == 2)).mean())
        stopped = [float((first[one] == at).mean()) for one in (0, 1)]
        shares = (stopped[0], stopped[1], error, power, missed)
        found.append(Look(count, bound, *shares, float(means[0]), float(means[1])))
    return tuple(found)


def _primaries(job: tuple[AnyStudy, Sequence[int], int]) -> list[tuple[float, float, float, float]]:
    """Return sign, p, t and df of the primary test at each analysis of one experiment; NaN if not computed.

    The sign is 1 for an estimate in the expected direction (`AnyStudy.expected_sign`), otherwise -1.
    """
    study, counts, number = job
    table = study.table(counts[-1], study.stream(counts[-1], number))
    people = table["participant_id"].drop_duplicates().tolist()
    found = []
    for count in counts:
        test = study.primary(table[table["participant_id"].isin(people[:count])])
        if isinstance(test, Effect):
            sign = math.copysign(1, test.estimate * study.expected_sign) if study.expected_sign else 1.0
            found.append((sign, test.p, test.statistic, test.df))
        else:
            found.append((math.nan,) * 4)
    return found


def _decided(outcomes: NDArray[np.float64], bounds: Sequence[float], *, bayes: bool) -> NDArray[np.int64]:
    """Return each analysis' decision: an effect (1, or -1 in the other direction), the null (2), or none (0)."""
    sign, p, t, df = np.moveaxis(outcomes, -1, 0)
    if not bayes:
        return np.where(p < np.asarray(bounds), np.nan_to_num(sign), 0).astype(int)
    factors = np.vectorize(lambda t, df: bayes_factor(t, df + 1) if math.isfinite(t) else 1.0, otypes=[float])(t, df)
    effect = np.where(factors >= bounds[0], np.nan_to_num(sign), 0)
    return np.where(factors <= 1 / bounds[0], 2, effect).astype(int)
