"""Precision of thresholds: the adaptive procedure is run with simulated observers, fitted and averaged as in a report.

Thresholds involve no hypothesis test, so precision is evaluated instead (Maxwell, Kelley & Rausch 2008): whether the
upper 95 % confidence limit of the geometric mean stays within a given factor of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
import pandas as pd
from scipy import stats

from focalgradient.design import BlurThresholdDesign
from focalgradient.power.study import LAPSES, SPREAD, Claim, People
from focalgradient.statistics import SubjectThreshold, ThresholdResult, blur_thresholds
from focalgradient.statistics.questions import Analysis
from focalgradient.statistics.threshold_questions import MEAN, fitted

__all__ = ["ThresholdModel"]

POOL_SIZE = 100
"""Size of the pool of simulated people, from which experiments are drawn; measuring it takes some 40 s of processor
time.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdModel(People):
    """Statistical model of people whose thresholds are measured.

    Parameters
    ----------
    between
        Standard deviation over people of the natural logarithm of the threshold.
    lapses
        Lapse rate: proportion of trials answered without attention.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    between: Annotated[float, SPREAD] = 0.4
    lapses: Annotated[float, LAPSES] = 0.01

    logs: ClassVar[bool] = True
    bounded: ClassVar[bool] = True
    width_label: ClassVar[str] = "95 % interval of the mean threshold: ratio of its ends"
    spreads: ClassVar[tuple[str, ...]] = ("between",)
    designs: ClassVar[type[BlurThresholdDesign]] = BlurThresholdDesign

    def analysis(self, design: BlurThresholdDesign, bound: float) -> Analysis:
        return replace(People.analysis(self, design, bound), exclusions=fitted)

    def simulated(
        self, design: BlurThresholdDesign, subjects: int, rng: np.random.Generator, seed: int
    ) -> dict[str, ThresholdResult]:
        pool = _people(self, type(design), design.model_dump_json(), seed)
        chosen = [pool[number] for number in rng.choice(len(pool), subjects)]
        people = (replace(person, participant=f"{number:03}") for number, person in enumerate(chosen))
        return {"": ThresholdResult(design.unit, tuple(people))}

    def claims(self, design: BlurThresholdDesign, bound: float) -> Mapping[str, Claim]:
        return {"precise": Claim(f"mean threshold known to a factor of {bound:g}", MEAN, ("",), factor=bound)}

    def measured(self, design: BlurThresholdDesign) -> tuple[tuple[str, str, str], ...]:
        return (("mean threshold", MEAN, ""),)

    def seconds(self, design: BlurThresholdDesign) -> float:
        return 0.0005

    def setup_seconds(self) -> float:
        return 40.0

    def settings(self, design: BlurThresholdDesign) -> dict[str, object]:
        return {**People.settings(self, design), "people": POOL_SIZE}


@lru_cache(maxsize=4)
def _people(
    model: ThresholdModel, kind: type[BlurThresholdDesign], design_json: str, seed: int
) -> tuple[SubjectThreshold, ...]:
    """Return the pool."""
    from focalgradient.observers import observer_named
    from focalgradient.observers.thresholds import THRESHOLDS, choose

    design = kind.model_validate_json(design_json)
    observer = replace(observer_named("default"), lapses=model.lapses)
    # Quantiles instead of draws, so that the pool's mean and standard deviation equal the model's.
    normal = np.random.default_rng(seed).permutation(_quantiles(POOL_SIZE))
    true = np.log(THRESHOLDS[design.unit]) + model.between * normal
    rows = []
    for number, log in enumerate(true, start=1):
        name = f"{number:03}"
        trials = design.trials(name)
        for trial, answer in zip(trials, choose(design, observer, name, seed, threshold=math.exp(log)), strict=True):
            if trial.phase == "main":
                rows.append((f"sub-{name}", "", answer.level, answer.correct, trial.catch))
    table = pd.DataFrame(rows, columns=["participant_id", "session", "level", "correct", "catch"])
    return blur_thresholds(table, least=design.least_level, most=design.most_level, unit=design.unit).subjects


def _quantiles(count: int) -> np.ndarray:
    """Return quantiles of the standard normal distribution, rescaled to a variance of 1."""
    normal = stats.norm.ppf((np.arange(count) + 0.5) / count)
    return np.asarray(normal / normal.std())
