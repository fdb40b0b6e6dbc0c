"""Power of tests of ratings in steps, of signed comparisons in steps, and of choices.

A subject's latent response is a level plus an effect times the aperture relative to the largest, plus logistic noise;
the response scale converts it to an answer. Experiments of two sizes are analysed as a report does, and the standard
error of each test at any other number of subjects N is interpolated from theirs, as variance over subjects / N + the
part that subjects do not change.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated, ClassVar

import numpy as np
import pandas as pd
from numpy.random import default_rng
from numpy.typing import NDArray

from focalgradient.design import DepthRatingDesign
from focalgradient.errors import InputError
from focalgradient.power.ratings import Raters, main_questions, shares_found, shown_to
from focalgradient.power.study import ODDS_RATIOS, SPREAD, Study
from focalgradient.statistics import Effect, NotComputed
from focalgradient.user_tables.tidy import in_order

__all__ = ["LatentModel", "latent_power", "simulated_answers"]

SIZES = (8, 24)
"""Numbers of subjects in the experiments that are analysed."""

DRAWS = 20_000
"""Number of estimates drawn for each number of subjects: standard error of .004 at a power of .5."""

BETWEEN_LEVELS = 1.0
"""Standard deviation over subjects of the level of their answers in steps, in log odds (our choice, as in
benchmarks/simulated_experiments.py).
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentModel(Raters):
    """Statistical model of subjects who answer in steps or by choices.

    Parameters
    ----------
    effect, far_effect
        Odds ratio of a higher answer at the largest aperture to no blur, for the first fixation and for the others.
    between, between_scenes
        Standard deviation of its logarithm over subjects and over scenes.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    effect: Annotated[float, ODDS_RATIOS] = 3.0
    far_effect: Annotated[float, ODDS_RATIOS] = 1.0
    between: Annotated[float, SPREAD] = 1.0
    between_scenes: Annotated[float, SPREAD] = 0.5

    width_label: ClassVar[str] = "95 % interval of the change with the aperture: width"
    spreads: ClassVar[tuple[str, ...]] = ("between", "between_scenes")

    def seconds(self, design: DepthRatingDesign) -> float:
        return design.response_scale.analysis.seconds

    def check(self, design: DepthRatingDesign) -> None:
        Raters.check(self, design)
        if design.response_scale.analysis.ratios:
            raise InputError(f"scale is {design.scale!r}, whose answers are ratios: use Model, or another scale.")

    def simulated(self, design: DepthRatingDesign, subjects: int, rng: np.random.Generator, seed: int) -> pd.DataFrame:
        return simulated_answers(self, design, subjects, rng)


def simulated_answers(
    model: LatentModel, design: DepthRatingDesign, subjects: int, rng: np.random.Generator
) -> pd.DataFrame:
    """Simulate answers, without catch trials, with the columns of a data set.

    Examples
    --------
    >>> table = simulated_answers(LatentModel(), DepthRatingDesign(scale="steps", steps=5), 2, default_rng(1))
    >>> len(table), sorted(table["rating"].unique().tolist())
    (384, [1.0, 2.0, 3.0, 4.0, 5.0])
    """
    scale, fixations = design.response_scale, in_order(design.fixations)
    rows = shown_to(type(design), design.model_dump_json(), "01")
    rows = rows[~rows["catch"]]
    means = [model.effect, *[model.far_effect] * (len(fixations) - 1)]
    picture = rows.groupby(["scene", "fixation"], sort=False).ngroup().to_numpy()
    scene = rng.normal(0, model.between_scenes, picture.max() + 1)[picture]
    share = rows["aperture_mm"].to_numpy() / (rows["aperture_mm"].max() or 1.0)
    which = rows["fixation"].map(fixations.index).to_numpy()
    tables = []
    for number in range(1, subjects + 1):
        rises = np.array([rng.normal(math.log(mean), model.between) for mean in means])
        level = 0.0 if scale.compares else rng.normal(0, BETWEEN_LEVELS)
        felt = level + (rises[which] + scene) * share + rng.logistic(size=len(rows))
        tables.append(rows.assign(participant_id=f"sub-{number:02}", rating=scale.latent(felt)))
    return pd.concat(tables, ignore_index=True)


def _tests(study: Study, subjects: int, number: int) -> list[Effect | NotComputed]:
    """Return the tests of one experiment: slopes by fixation, then their differences if the report tests them."""
    asked, (effect, difference) = study.analysis, main_questions(study.design)
    answers = asked.asked(study.table(subjects, study.stream(subjects, number)))
    pairs = answers.to(difference).values() if study.design.response_scale.analysis.compares_slopes else ()
    return [*answers.to(effect).values(), *pairs]


def latent_power(study: Study, subjects: Sequence[int]) -> dict[int, dict[str, float]]:
    """Return the power of a report's tests for several numbers of subjects, without exclusion.

    Parameters
    ----------
    study
        Power study with a `LatentModel`.
    subjects
        Numbers of subjects.

    Returns
    -------
    dict
        For each number of subjects, proportion of experiments with a significant result: "near_rise", the slope of the
        first fixation; "interaction", that it exceeds the slope of each other one, if the report compares them.

    Raises
    ------
    InputError
        If too few experiments can be analysed.
    """
    assert isinstance(study.model, LatentModel)
    analysis, of_size = study.design.response_scale.analysis, {}
    for size in SIZES:
        runs = [_tests(study, size, number) for number in range(analysis.experiments)]
        whole = [[(one.estimate, one.standard_error, one.df) for one in run if isinstance(one, Effect)] for run in runs]
        whole = [run for run in whole if len(run) == len(runs[0])]
        if len(whole) < len(runs) / 2:
            raise InputError("too few simulated experiments of this design can be analysed: add trials to the design.")
        of_size[size] = np.array(whole)
    singles = len(study.design.fixations)
    weighed = [(found[:, :, 0].mean(axis=0), size) for size, found in of_size.items()]
    mean = sum(estimate * size for estimate, size in weighed) / sum(SIZES)
    if analysis.latent:  # its model is that of the simulation, so the mean is the true value
        logs = [math.log(study.model.effect), *[math.log(study.model.far_effect)] * (singles - 1)]
        mean = np.array([*logs, *(one - other for one, other in combinations(logs, 2))])
    error = _by_size([(found[:, :, 1] ** 2).mean(axis=0) for found in of_size.values()])
    spread = error  # variance of the estimates; replaced by the empirical one if the standard errors are conservative
    if not analysis.latent:
        spread = _by_size([found[:, :, 0].var(axis=0, ddof=1) for found in of_size.values()])
    few, many = (found[:, :, 2].mean(axis=0) for found in of_size.values())
    rng = default_rng(study.seed)

    def df(number: int) -> NDArray[np.float64]:
        return np.maximum(few + (many - few) * (number - SIZES[0]) / (SIZES[1] - SIZES[0]), 1.0)

    return {number: _share(mean, spread(number), error(number), df(number), singles, rng) for number in subjects}


def _by_size(variances: list[NDArray[np.float64]]) -> Callable[[int], NDArray[np.float64]]:
    """Return the variance at any number of subjects, as a part inversely proportional to it and a constant part."""
    first, second = variances
    own = np.maximum((first - second) / (1 / SIZES[0] - 1 / SIZES[1]), 0)
    shared = np.maximum(second - own / SIZES[1], 0)
    return lambda number: own / number + shared


def _share(
    mean: NDArray[np.float64],
    spread: NDArray[np.float64],
    error: NDArray[np.float64],
    df: NDArray[np.float64],
    singles: int,
    rng: np.random.Generator,
) -> dict[str, float]:
    """Return the proportion of drawn estimates that are significant in each test; several differences by Holm's p."""
    normal = rng.normal(size=(DRAWS, singles)) * np.sqrt(spread[:singles])
    pairs = list(combinations(range(singles), 2)) if len(mean) > singles else []
    apart = [
        (normal[:, one] - normal[:, other]) * np.sqrt(spread[singles + at] / (spread[one] + spread[other]))
        for at, (one, other) in enumerate(pairs)
    ]
    estimates = mean + np.column_stack([normal, *apart]) if apart else mean + normal
    errors = np.sqrt(error * rng.chisquare(df, size=(DRAWS, len(mean))) / df)
    return shares_found(estimates, errors, df, singles)
