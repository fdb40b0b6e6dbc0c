"""Precision of thresholds: the adaptive procedure is run with simulated observers, fitted and averaged as in a report.

Thresholds involve no hypothesis test, so precision is evaluated instead (Maxwell, Kelley & Rausch 2008): whether the
upper 95 % confidence limit of the geometric mean stays within a given factor of it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
import pandas as pd
from scipy import stats

from focalgradient.design import BlurThresholdDesign
from focalgradient.errors import check_fields
from focalgradient.power.study import LAPSES, SPREAD, AnyStudy, model_of
from focalgradient.statistics import ThresholdFit, blur_thresholds
from focalgradient.statistics.hypotheses import check_bound
from focalgradient.statistics.means import t_interval

__all__ = ["ThresholdModel", "ThresholdStudy"]

POOL_SIZE = 100
"""Size of the pool of simulated people, from which experiments are drawn; measuring it takes some 40 s of processor
time.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdModel:
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

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True, slots=True)
class ThresholdStudy(AnyStudy):
    """Precision study of thresholds.

    Parameters
    ----------
    model
        Model of the people.
    design
        Design of the experiment: levels, procedure and trials.
    bound
        Factor within which the mean threshold must be known.
    seed
        Seed of all random draws.

    Raises
    ------
    InputError
        If the bound is not above 1 and at most 10.
    """

    model: ThresholdModel
    design: BlurThresholdDesign
    bound: float = 1.2
    seed: int = 1

    seconds: ClassVar[float] = 0.0005
    logs: ClassVar[bool] = True
    width_label: ClassVar[str] = "95 % interval of the mean threshold: ratio of its ends"
    widths: ClassVar[tuple[str, str]] = ("mean threshold", "")
    spreads: ClassVar[tuple[str, ...]] = ("between",)

    @classmethod
    def of(cls, design: BlurThresholdDesign, assumed: Mapping[str, float], seed: int) -> ThresholdStudy:
        """Create the study from given values: see `focalgradient.tasks.Task.study`."""
        bound = {name: value for name, value in assumed.items() if name == "bound"}
        return cls(model_of(ThresholdModel, assumed, design.task, bound), design, **bound, seed=seed)

    def __post_init__(self) -> None:
        check_fields(self)
        check_bound("bound", self.bound)

    def settings(self) -> dict[str, object]:
        """Return all settings in the form stored in the file of experiments."""
        return AnyStudy.settings(self) | {"people": POOL_SIZE}

    @property
    def tests(self) -> Mapping[str, str]:
        return {"precise": f"mean threshold known to a factor of {self.bound:g}"}

    def table(self, subjects: int, rng: np.random.Generator) -> pd.DataFrame:
        """Draw people from the pool; return their fitted log thresholds."""
        fitted = _people(self.model, self.design.model_dump_json(), self.seed)
        return pd.DataFrame({"threshold": rng.choice(np.array(fitted), subjects)})

    def outcome(self, table: pd.DataFrame) -> dict[str, float | None]:
        found = t_interval(table["threshold"].dropna())
        outcome: dict[str, float | None] = {"precise": 0.0, "width": None, "far_width": None}
        outcome["left_out"] = float(table["threshold"].isna().sum())
        if found.low is not None and found.high is not None:
            outcome["width"] = found.high - found.low
            outcome["precise"] = float(found.high - found.estimate <= math.log(self.bound))
        return outcome


@lru_cache(maxsize=4)
def _people(model: ThresholdModel, design_json: str, seed: int) -> tuple[float, ...]:
    """Return the fitted log thresholds of the pool (NaN if not fitted)."""
    from focalgradient.observers import observer_named
    from focalgradient.observers.thresholds import THRESHOLDS, choose

    design = BlurThresholdDesign.model_validate_json(design_json)
    observer = dataclasses.replace(observer_named("default"), lapses=model.lapses)
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
    result = blur_thresholds(table, least=design.least_level, most=design.most_level, unit=design.unit)
    fits = [one.fit for one in result.subjects]
    return tuple(math.log(fit.threshold) if isinstance(fit, ThresholdFit) else math.nan for fit in fits)


def _quantiles(count: int) -> np.ndarray:
    """Return quantiles of the standard normal distribution, rescaled to a variance of 1."""
    normal = stats.norm.ppf((np.arange(count) + 0.5) / count)
    return np.asarray(normal / normal.std())
