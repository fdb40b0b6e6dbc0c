"""Hierarchical psychometric functions of several people and conditions.

Each person's threshold, slope and lapse rate is partially pooled: shrunk towards the population mean according to its
uncertainty. Means are over people, not over trials. `fit_psychometric_groups` fits by restricted maximum likelihood;
`focalgradient.statistics.bayes_psychometric_groups` samples the same model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import special, stats

from focalgradient.errors import InputError, described
from focalgradient.progress import Progress
from focalgradient.statistics.means import family, student_effect
from focalgradient.statistics.psychometric_model import (
    LARGEST_SD,
    LEAST_SD,
    Counts,
    Layout,
    ModelFit,
    fit_model,
)
from focalgradient.statistics.psychometric_records import (
    GroupFunction,
    PersonFunction,
    PsychometricGroups,
    ThresholdDifference,
)
from focalgradient.statistics.psychometric_shapes import SHAPES, Shape, shape_named
from focalgradient.statistics.records import CONFIDENCE, Effect, Interval, NotComputed

__all__ = ["PsychometricData", "Rate", "fit_psychometric_groups", "psychometric_data"]

FloatArray = NDArray[np.float64]

Rate = float | Literal["common", "people"]
"""Lapse or guess rate: a fixed number, "common" (one estimated rate), or "people" (estimated and partially pooled)."""

LARGEST_RATE = 0.5
"""Maximum fixed lapse rate."""


@dataclass(frozen=True, slots=True, eq=False)
class PsychometricData:
    """Input of the hierarchical models, as prepared by `psychometric_data`.

    Parameters
    ----------
    counts, layout, shape
        Counted answers, parameter layout and sigmoid; levels are standardised to (x - center) / scale, x the level or
        its log.
    center, scale
        Mean and standard deviation of x.
    participants, conditions
        Names, by the indices in `counts`.
    levels
        Level of each entry of `counts`.
    """

    counts: Counts
    layout: Layout
    shape: Shape
    center: float
    scale: float
    participants: tuple[str, ...]
    conditions: tuple[str, ...]
    levels: FloatArray


def psychometric_data(
    table: pd.DataFrame | Mapping[str, ArrayLike],
    *,
    shape: Shape | str = "weibull",
    guess: Rate = 0.5,
    lapse: Rate = "people",
    overdispersed: bool = False,
) -> PsychometricData:
    """Validate and count the answers of a table; parameters and errors are those of `fit_psychometric_groups`.

    Examples
    --------
    >>> table = {"participant_id": ["a", "a", "b"], "level": [1.0, 1.0, 2.0], "correct": [True, False, True]}
    >>> psychometric_data(table).counts.shown.tolist()
    [2.0, 1.0]
    """
    kind = shape_named(shape)
    rows = pd.DataFrame(table).reset_index(drop=True)
    for name in ("participant_id", "level", "correct"):
        if name not in rows:
            raise InputError(
                f"The table has no column {name!r}; its columns must be participant_id, level and correct."
            )
    if rows.empty:
        raise InputError("The table has no rows, but must have one for each trial.")
    known = {name: _known(name, rate) for name, rate in (("guess", guess), ("lapse", lapse))}
    if (known["guess"] or 0.0) + (known["lapse"] or 0.0) >= 1:
        raise InputError("guess and lapse must add up to less than 1: otherwise the function cannot rise.")
    try:
        level = rows["level"].to_numpy(dtype=float)
        given = rows["correct"].to_numpy(dtype=float)
    except (TypeError, ValueError):
        raise InputError("level and correct must be numbers; correct may be true or false.") from None
    wrong = ~np.isfinite(level) | (kind.logarithmic & (level <= 0))
    if wrong.any():
        above = " above 0, as this sigmoid takes their logarithm (shape='logistic' takes any)"
        row = int(np.flatnonzero(wrong)[0])
        raise InputError(
            f"level is {level[row]:g} in row {row}, but levels must be numbers{above if kind.logarithmic else ''}."
        )
    if not np.isin(given, (0, 1)).all():
        row = int(np.flatnonzero(~np.isin(given, (0, 1)))[0])
        raise InputError(f"correct is {given[row]:g} in row {row}, but must be 0 or 1 (false or true).")
    if np.unique(level).size < 2:
        raise InputError("All trials have one level, but a psychometric function needs two or more.")
    person, people = pd.factorize(rows["participant_id"].astype(str), sort=True)
    named = rows["condition"].astype(str) if "condition" in rows else pd.Series([""] * len(rows))
    condition, conditions = pd.factorize(named, sort=False)
    block = pd.factorize(rows["block"])[0] if overdispersed and "block" in rows else np.zeros(len(rows), dtype=int)
    entries = (
        pd.DataFrame({"person": person, "condition": condition, "level": level, "block": block, "right": given})
        .groupby(["person", "condition", "level", "block"])["right"]
        .agg(["sum", "size"])
        .reset_index()
    )
    x = np.log(entries["level"].to_numpy()) if kind.logarithmic else entries["level"].to_numpy()
    center, scale = float(x.mean()), float(x.std()) or 1.0
    counts = Counts(
        (x - center) / scale,
        entries["sum"].to_numpy(dtype=float),
        entries["size"].to_numpy(dtype=float),
        entries["person"].to_numpy(),
        entries["condition"].to_numpy(),
    )
    each = entries.groupby("person")["condition"].nunique()
    layout = Layout(
        len(conditions),
        bool((each > 1).any()),
        len(people) > 1,
        known["guess"],
        known["lapse"],
        guess == "people",
        lapse == "people",
        overdispersed,
    )
    names = tuple(map(str, people)), tuple(map(str, conditions))
    return PsychometricData(counts, layout, kind, center, scale, *names, entries["level"].to_numpy())


def _known(name: str, rate: Any) -> float | None:
    """Return a fixed rate; None if it is estimated."""
    if isinstance(rate, str) and rate in ("common", "people"):
        return None
    limit = 1.0 if name == "guess" else LARGEST_RATE
    if isinstance(rate, int | float) and not isinstance(rate, bool) and 0 <= rate < limit:
        return float(rate)
    raise InputError(
        f"{name} is {described(rate)}, but must be a rate from 0 to below {limit:g}, 'common' (estimated, one for all) "
        "or 'people' (estimated for each)."
    )


def fit_psychometric_groups(
    table: pd.DataFrame | Mapping[str, ArrayLike],
    *,
    shape: Shape | str = "weibull",
    guess: Rate = 0.5,
    lapse: Rate = "people",
    overdispersed: bool = False,
    unit: str = "",
    progress: Progress | None = None,
) -> PsychometricGroups | NotComputed:
    """Fit psychometric functions of all people and conditions in one hierarchical model.

    Parameters
    ----------
    table
        One row per trial, or arrays by name: `participant_id`, `level`, `correct` (True or False, 1 or 0; for
        subjective judgements, the answer "yes" or "more"). Optional: `condition`, each with its own mean threshold and
        slope, and `block`, within which answers may be correlated (see `overdispersed`).
    shape
        "weibull" or "lognormal" for the logarithm of the level; "logistic" or "normal" for the level itself, which may
        be negative; or the name of a custom `Shape`, once added to `SHAPES`.
    guess
        Probability of a correct answer without a stimulus: 1 / alternatives in forced choice; 0, or estimated ("common"
        or "people"), for yes/no answers.
    lapse
        Lapse rate; an estimated rate has a beta(1, 20) prior.
    overdispersed
        True to estimate the correlation of a person's answers at one level (within a block) by a beta-binomial model,
        which widens the intervals if people change during a session.
    unit
        Unit of the levels, for texts.
    progress
        Function called with the completed fraction.

    Returns
    -------
    PsychometricGroups
        `NotComputed` if the search has no maximum or the answers do not depend on the level.

    Raises
    ------
    InputError
        If a column is missing, or a level, an answer or an option is invalid.

    Notes
    -----
    Intervals of means and differences use Student's t with people - 1 degrees of freedom (people - conditions if each
    person took part in one condition), as do those of individuals, which include the uncertainty of the mean. Without
    degrees of freedom intervals are normal and hold for these people; conditions are then compared within one person
    only.

    Measured in 60 data sets of 6 people with 60 trials in each of 2 conditions (benchmarks/psychometric_recovery.py):
    coverage is .93 for individual thresholds, .96 for the mean threshold, .98 for the mean slope, and 1.00 for the
    difference between conditions. The bias is -1.6 +- 2.8 % for the mean slope and -0.3 +- 0.8 % for the mean
    threshold.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> who = np.repeat(np.arange(8), 100)
    >>> own = 0.2 * np.exp(0.3 * rng.standard_normal(8))
    >>> level = np.tile([0.05, 0.1, 0.2, 0.3, 0.5], 160)
    >>> right = rng.random(800) < 0.5 + 0.48 * (1 - 0.5 ** ((level / own[who]) ** 3))
    >>> found = fit_psychometric_groups({"participant_id": who, "level": level, "correct": right}, unit="D")
    >>> found
    <PsychometricGroups: 8 people, 1 conditions, weibull>
    >>> at = found.groups[0].threshold
    >>> at.low < 0.2 < at.high, 0.18 < at.estimate < 0.24
    (True, True)
    """
    data = psychometric_data(table, shape=shape, guess=guess, lapse=lapse, overdispersed=overdispersed)

    def watch(step: int) -> None:
        if progress is not None and step % 5 == 0:
            progress(1 - 1 / (1 + step / 50), "psychometric functions")

    if np.ptp(data.counts.right / data.counts.shown) == 0:
        return NotComputed("All answers are the same: there is no psychometric function.")
    fit = fit_model(data.counts, data.layout, data.shape, watch)
    if fit is None:
        return NotComputed("The hierarchical model of psychometric functions has no maximum.")
    return _result(fit, data, unit)


def _result(fit: ModelFit, data: PsychometricData, unit: str) -> PsychometricGroups:
    layout, c = data.layout, data.layout.conditions
    people = len(data.participants)
    left = people - 1 if layout.within or c == 1 else people - c
    df = left if left > 0 else math.inf
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, df))
    remarks = []
    if left <= 0:
        remarks.append("There are too few people to generalise to others: intervals and tests hold for these alone.")
    errors = np.sqrt(np.diag(fit.covariance))
    shape = next(name for name, one in SHAPES.items() if one is data.shape)

    def fixed(place: int, back: Any) -> Interval:
        ends = fit.fixed[place] + half * errors[place] * np.array([0, -1, 1])
        return Interval(*(float(back(end)) for end in ends))

    def level(x: float) -> float:
        return math.exp(data.center + data.scale * x) if data.shape.logarithmic else data.center + data.scale * x

    def slope(w: float) -> float:
        return math.exp(w) / data.scale

    rates = {
        name: Interval(known, None, None) if known is not None else fixed(place, special.expit)
        for name, known, place in (("lapse", layout.lapse, 2 * c), ("guess", layout.guess, layout.fixed - 1))
    }
    groups = tuple(
        GroupFunction(
            name,
            int(np.unique(data.counts.person[data.counts.condition == number]).size),
            fixed(number, level),
            fixed(c + number, slope),
            rates["lapse"].estimate,
            rates["guess"].estimate,
            shape,
        )
        for number, name in enumerate(data.conditions)
    )
    effects: list[Effect | NotComputed] = []
    pairs = list(combinations(range(c), 2)) if left > 0 or people == 1 else []
    if len(pairs) < c - 1:
        remarks.append("Conditions were not compared: a test between people needs more people than conditions.")
    spent = "t on subjects - 1" if layout.within or c == 1 else "t on subjects - conditions"
    method = "hierarchical psychometric model, restricted maximum likelihood (Laplace), "
    method += spent if left > 0 else "normal intervals"
    for one, other in pairs:
        weights = np.eye(layout.fixed)[one] - np.eye(layout.fixed)[other]
        error = data.scale * math.sqrt(float(weights @ fit.covariance @ weights))
        effects.append(student_effect(data.scale * float(weights @ fit.fixed), error, people, method, df=df))
    differences = tuple(
        ThresholdDifference(data.conditions[one], data.conditions[other], effect)
        for (one, other), effect in zip(pairs, family(effects), strict=True)
        if isinstance(effect, Effect)
    )
    sd = {}
    for name, value, error in zip(layout.sds, fit.sds, fit.sd_errors, strict=True):
        in_unit = value * (data.scale if name.startswith("threshold") else 1.0)
        if value < 2 * LEAST_SD:
            sd[name] = Interval(0.0, None, None)
            remarks.append(f"The estimated standard deviation over people of the {name} is 0.")
        elif not error < math.log(LARGEST_SD / LEAST_SD) or value > LARGEST_SD / 2:  # NaN, or beyond both limits
            sd[name] = Interval(in_unit, None, None)
        else:
            reach = math.exp(float(stats.norm.ppf((1 + CONFIDENCE) / 2)) * error)
            sd[name] = Interval(in_unit, in_unit / reach, in_unit * reach)
    overdispersion = None
    if fit.correlation is not None:
        overdispersion = Interval(fit.correlation, None, None)
        if not math.isnan(fit.correlation_error):
            z = float(stats.norm.ppf((1 + CONFIDENCE) / 2)) * fit.correlation_error
            middle = special.logit(fit.correlation)
            overdispersion = Interval(fit.correlation, *(float(special.expit(middle + end)) for end in (-z, z)))
    return PsychometricGroups(
        shape,
        unit,
        groups,
        tuple(_people(fit, data, shape, half, level, slope)),
        differences,
        rates["lapse"],
        rates["guess"],
        sd,
        overdispersion,
        int(data.counts.shown.sum()),
        fit.log_likelihood,
        method,
        tuple(remarks),
    )


def _people(
    fit: ModelFit, data: PsychometricData, shape: str, half: float, level: Any, slope: Any
) -> list[PersonFunction]:
    """Return each person's function in each condition: conditional modes, with intervals of `half` standard errors.

    `half` is a quantile of Student's t, as the standard deviations over people are estimated from few people.
    """
    columns, random, _ = data.layout.columns(np.arange(data.layout.conditions))
    found = []
    for number, name in enumerate(data.participants):
        for place, condition in enumerate(data.conditions):
            own = np.flatnonzero((data.counts.person == number) & (data.counts.condition == place))
            if not own.size:
                continue
            turn = np.hstack([columns[place], random[place]])  # 4 x (fixed and deviations)
            values = turn @ np.concatenate([fit.fixed, fit.deviations[number]])
            errors = np.sqrt(np.diag(turn @ fit.person_covariance[number] @ turn.T))
            ends = [[values[k] + half * errors[k] * sign for sign in (0, -1, 1)] for k in (0, 1)]
            lapse, guess = (
                float(special.expit(values[k])) if known is None else known
                for k, known in ((2, data.layout.lapse), (3, data.layout.guess))
            )
            by_level = (
                pd.DataFrame(
                    {"level": data.levels[own], "right": data.counts.right[own], "shown": data.counts.shown[own]}
                )
                .groupby("level")
                .sum()
            )
            found.append(
                PersonFunction(
                    name,
                    condition,
                    Interval(*(level(end) for end in ends[0])),
                    Interval(*(slope(end) for end in ends[1])),
                    lapse,
                    guess,
                    tuple(map(float, by_level.index)),
                    tuple(map(int, by_level["right"])),
                    tuple(map(int, by_level["shown"])),
                    shape,
                )
            )
    return found
