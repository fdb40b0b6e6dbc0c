"""Power of experiment 1: simulated depth ratings, with exclusion and analysis.

The logarithm of a rating is the sum of the subject's and the scene's depth effects times the aperture relative to the
largest, a term for the scene, and noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import Annotated, ClassVar

import numpy as np
import pandas as pd
from numpy.random import SeedSequence, default_rng
from numpy.typing import NDArray
from scipy import stats

from focalgradient.design import DepthRatingDesign
from focalgradient.errors import InputError
from focalgradient.power.study import LAPSES, SPREAD, Claim, People, Study, planned_trials
from focalgradient.quantities import Range
from focalgradient.statistics import rating_questions, slope_questions, step_questions
from focalgradient.statistics.crossed import mean_tests
from focalgradient.statistics.hypotheses import one_sided
from focalgradient.statistics.means import holm
from focalgradient.statistics.questions import less
from focalgradient.statistics.rating_questions import EQUIVALENT
from focalgradient.statistics.records import ALPHA
from focalgradient.user_tables.tidy import in_order

__all__ = ["Model", "Raters", "main_questions", "quick_power", "shares_found", "shown_to", "simulated_ratings"]

Array = NDArray[np.float64]
RATIO = Range("ratios, where 1 means none,", 0.1, 10)


class Raters(People):
    """People who rate depth: on each scale the effect of the aperture, and how it differs between fixations."""

    __slots__ = ()

    designs: ClassVar[type[DepthRatingDesign]] = DepthRatingDesign

    def check(self, design: DepthRatingDesign) -> None:
        People.check(self, design)
        if len(design.apertures) < 2:
            raise InputError("apertures has only one, but the change with aperture needs at least two: add another.")

    def claims(self, design: DepthRatingDesign, bound: float) -> Mapping[str, Claim]:
        scale, (effect, difference) = design.response_scale.analysis, main_questions(design)
        first, *others = in_order(design.fixations)
        rest = " and ".join(others)
        claims = {"near_rise": Claim(f"{first}: depth effect", effect, (first,))}
        if others and scale.ratios:
            claims["far_equivalent"] = Claim(f"{rest}: equivalent to zero", EQUIVALENT, tuple(others))
        if others and scale.compares_slopes:
            levels = tuple(less(first, other) for other in others)
            claims["interaction"] = Claim(f"{first}: larger effect than {rest}", difference, levels)
        return claims

    def measured(self, design: DepthRatingDesign) -> tuple[tuple[str, str, str], ...]:
        effect, _ = main_questions(design)
        return tuple((f"{name} in focus", effect, name) for name in in_order(design.fixations)[:2])


def main_questions(design: DepthRatingDesign) -> tuple[str, str]:
    """Return the names of the questions about the change with the aperture, and about its differences."""
    scale = design.response_scale.analysis
    if scale.ratios:
        return rating_questions.EFFECT, rating_questions.DIFFERENCE
    if scale.whole:
        return step_questions.EFFECT, step_questions.DIFFERENCE
    return slope_questions.SLOPE, slope_questions.DIFFERENCE


@dataclass(frozen=True, slots=True, kw_only=True)
class Model(Raters):
    """Statistical model of subjects in experiment 1; docs/power.md gives the source of each value.

    Parameters
    ----------
    effect, far_effect
        Mean depth effect, as the ratio of ratings between the largest aperture and the pinhole, with the nearest and
        with the farthest object in focus.
    between
        Standard deviation over subjects of the logarithm of each effect.
    between_scenes
        Standard deviation over scenes of the logarithm of each effect, common to all subjects.
    scenes
        Standard deviation of a subject's deviation for a scene, in the logarithm of all its ratings.
    noise
        Standard deviation of the logarithm of a single rating around its expected value.
    lapses
        Lapse rate: proportion of ratings that are uniformly distributed on the scale.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    effect: Annotated[float, RATIO] = 1.3
    far_effect: Annotated[float, RATIO] = 1.0
    between: Annotated[float, SPREAD] = 0.15
    between_scenes: Annotated[float, SPREAD] = 0.05
    scenes: Annotated[float, SPREAD] = 0.1
    noise: Annotated[float, SPREAD] = 0.3
    lapses: Annotated[float, LAPSES] = 0.01

    version: ClassVar[int] = 5
    logs: ClassVar[bool] = True
    bounded: ClassVar[bool] = True
    width_label: ClassVar[str] = "95 % interval of the depth effect: ratio of its ends"
    spreads: ClassVar[tuple[str, ...]] = ("between", "between_scenes", "scenes", "noise")

    def seconds(self, design: DepthRatingDesign) -> float:
        return 0.005

    def check(self, design: DepthRatingDesign) -> None:
        Raters.check(self, design)
        if not design.response_scale.analysis.ratios:
            raise InputError(
                f"scale is {design.scale!r}, but must have answers that are ratios: use LatentModel, or another scale."
            )
        if "pinhole" not in design.apertures:
            raise InputError("apertures must have 'pinhole', from which the depth effect is measured: add it.")

    def simulated(self, design: DepthRatingDesign, subjects: int, rng: np.random.Generator, seed: int) -> pd.DataFrame:
        return simulated_ratings(design, subjects, self, rng)


EXAMPLES = {"example-flat": -1.0, "example-deep": 1.0}
"""Log ratio answered to a drawing that looks clearly flat or deep (our choice)."""


def simulated_ratings(design: DepthRatingDesign, subjects: int, model: Model, rng: np.random.Generator) -> pd.DataFrame:
    """Simulate depth ratings, with the columns of a data set.

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
    >>> table = simulated_ratings(DepthRatingDesign(), 2, Model(effect=2.0), default_rng(1))
    >>> table.shape[0], table["kind"].unique().tolist()
    (396, ['simulated'])
    """
    text = design.model_dump_json()
    tables = []
    tilt = {
        (scene, fixation): rng.normal(0, model.between_scenes)
        for scene in design.scenes
        for fixation in ("nearest", "farthest")
    }
    for number in range(1, subjects + 1):
        trials = planned_trials(type(design), text, f"{number:02}")
        own = {
            fixation: rng.normal(math.log(mean), model.between)
            for fixation, mean in (("nearest", model.effect), ("farthest", model.far_effect))
        }
        of_scene = {scene: rng.normal(0, model.scenes) for scene in design.scenes}
        largest = max(trial.aperture_mm for trial in trials) or 1.0
        table = shown_to(type(design), text, f"{number:02}")
        level = np.array(
            [
                EXAMPLES.get(trial.scene, 0.0)
                if trial.catch
                else (own[trial.fixation] + tilt[trial.scene, trial.fixation]) * trial.aperture_mm / largest
                + of_scene[trial.scene]
                for trial in trials
            ]
        )
        answer = level + rng.normal(0, model.noise, len(level))
        lowest, highest = map(math.log, design.response_scale.bounds)
        lapse = rng.random(len(level)) < model.lapses
        answer = np.where(lapse, rng.uniform(lowest, highest, len(level)), answer)
        tables.append(table.assign(rating=np.exp(np.clip(answer, lowest, highest))))
    return pd.concat(tables, ignore_index=True)


@cache
def shown_to(kind: type[DepthRatingDesign], design_json: str, participant: str) -> pd.DataFrame:
    """Return the main trials of a participant with the columns of a data set, but for the answers."""
    names = ("trial", "scene", "aperture", "aperture_mm", "fixation", "repetition", "catch")
    rows = [tuple(getattr(trial, name) for name in names) for trial in planned_trials(kind, design_json, participant)]
    return pd.DataFrame(rows, columns=list(names)).assign(
        participant_id=f"sub-{participant}", session="", kind="simulated", dropped_frames=0
    )


def quick_power(study: Study, subjects: int, experiments: int = 2000) -> dict[str, float]:
    """Return the power from directly drawn tables of log ratios, without lapses and exclusion.

    Parameters
    ----------
    study
        Power study with a `Model`; its design must be complete.
    subjects
        Number of subjects.
    experiments
        Number of experiments: 2000 give a standard error of .011 at a power of .5.

    Returns
    -------
    dict
        Proportion of experiments in which each claim of the study is supported.

    Examples
    --------
    >>> found = quick_power(Study(Model(effect=1.5), DepthRatingDesign()), 10, 200)
    >>> found["near_rise"] > 0.95
    True
    """
    model, design = study.model, study.design
    assert isinstance(model, Model)
    rng = default_rng(SeedSequence([study.seed, subjects, experiments]))
    shape = (experiments, subjects, len(design.scenes))
    noise = model.noise * math.sqrt(2 / design.repetitions)
    rises = [
        math.log(mean)
        + rng.normal(0, model.between, (experiments, subjects, 1))
        + rng.normal(0, model.between_scenes, (experiments, 1, shape[2]))
        + rng.normal(0, noise, shape)
        for mean in (model.effect, *[model.far_effect] * (len(design.fixations) - 1))
    ]
    pairs = list(combinations(range(len(rises)), 2))
    found = [mean_tests(cells) for cells in [*rises, *(rises[first] - rises[second] for first, second in pairs)]]
    estimates, errors, df = np.moveaxis(np.array(found), 0, -1)
    shares = shares_found(estimates, errors, df, len(rises))
    if not pairs:
        return shares
    far = slice(1, len(rises))
    none = np.maximum(*one_sided(estimates[:, far], errors[:, far], df[:, far], math.log(study.bound))) < ALPHA
    return shares | {"far_equivalent": float(none.all(axis=1).mean())}


def shares_found(estimates: Array, errors: Array, df: Array, effects: int) -> dict[str, float]:
    """Return how often the first effect is found, and that it exceeds each other one, differences by Holm's p.

    Parameters
    ----------
    estimates, errors, df
        Estimates of experiments (rows), standard errors and degrees of freedom: of the effects, then of the differences
        of each pair of them, if these are tested.
    effects
        Number of effects.

    Examples
    --------
    >>> shares_found(np.array([[1.0, 0.1, 0.9], [1.0, 0.9, 0.1]]), np.array(0.2), np.array(11), 2)
    {'near_rise': 1.0, 'interaction': 0.5}
    """
    t = estimates / errors
    p = np.asarray(2 * stats.t.sf(np.abs(t), df))
    found = (np.column_stack([p[:, :effects], holm(p[:, effects:])]) < ALPHA) & (t > 0)
    shares = {"near_rise": float(found[:, 0].mean())}
    larger = found[:, effects : 2 * effects - 1]  # than each other one: the first pairs
    return shares | ({"interaction": float(larger.all(axis=1).mean())} if larger.size else {})
