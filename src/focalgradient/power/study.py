"""Base class of power studies: simulated subjects, analysis, and tests; one subclass for each kind of answers."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
import pandas as pd
from numpy.random import SeedSequence, default_rng

from focalgradient.errors import InputError
from focalgradient.quantities import Range
from focalgradient.scales import Analysis
from focalgradient.statistics import Effect, Equivalence, quality
from focalgradient.statistics.questions import Answers, Outcome
from focalgradient.tasks import task_named

__all__ = ["LAPSES", "ODDS_RATIOS", "SPREAD", "AnyStudy", "Claim", "main_trials", "model_of", "supports"]

Model = TypeVar("Model")

SPREAD = Range("standard deviations of a natural logarithm", 0, 3)
"""Range of a standard deviation: 3 is a factor of 20 between people, far above any published variation of ratings or
durations.
"""
LAPSES = Range("proportions", 0, 0.999)
ODDS_RATIOS = Range("odds ratios, where 1 is no effect,", 0.01, 100)


def model_of(kind: type[Model], assumed: Mapping[str, Any], task: str, others: Collection[str] = ()) -> Model:
    """Create a model of simulated subjects from given values; other fields have their defaults.

    Parameters
    ----------
    kind
        Class of the model, a dataclass.
    assumed
        Values by field.
    task
        Name of the task, for the message.
    others
        Names of values that belong to the study rather than the model.

    Raises
    ------
    InputError
        If the model has no such field, or a value is out of range.
    """
    known = {one.name for one in dataclasses.fields(kind)}  # type: ignore[arg-type]
    if wrong := [name for name in assumed if name not in known and name not in others]:
        raise InputError(
            f"{wrong[0]} cannot be set for {task_named(task).called}, whose model does not have it: leave it out."
        )
    return kind(**{name: value for name, value in assumed.items() if name in known})


@cache
def main_trials(kind: type[Any], design_json: str, participant: str) -> tuple[Any, ...]:
    """Return the main trials of a design; cached, because making the list takes longer than simulating it."""
    trials = kind.model_validate_json(design_json).trials(participant)
    return tuple(trial for trial in trials if trial.phase == "main")


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim that a study tests: an effect of one sign, or an equivalence, at all levels of a question.

    Parameters
    ----------
    question
        Name of the question of the report's analysis.
    levels
        Levels at which the claim must be supported.
    sign
        Expected sign of the effect.
    """

    question: str
    levels: tuple[str, ...]
    sign: int = 1


def supports(outcome: Outcome | None, sign: int = 1) -> bool:
    """Return whether an outcome is an equivalence, or a significant effect of the expected sign."""
    if isinstance(outcome, Equivalence):
        return outcome.equivalent
    return isinstance(outcome, Effect) and outcome.significant and sign * outcome.estimate > 0


class AnyStudy(ABC):
    """Power study: model of the subjects, design and seed; experiments are simulated and analysed as in a report."""

    __slots__ = ()

    version: ClassVar[int] = 1
    """Version of the analysis, recorded in the file of experiments: files of other versions are not continued."""
    seconds: ClassVar[float] = 0.01
    """Processor time of one experiment, in s per subject (measured)."""
    logs: ClassVar[bool] = False
    """Whether widths of intervals are logarithms, to be reported as the ratio of the limits."""
    people: ClassVar[str] = "subjects from a statistical model"
    """Who is simulated."""
    width_label: ClassVar[str] = "95 % interval: width"
    """Description of the widths of intervals."""
    spreads: ClassVar[tuple[str, ...]] = ()
    """Names of the assumed standard deviations."""

    seed: int
    design: Any

    def settings(self) -> dict[str, object]:
        """Return all settings in the form stored in the file of experiments."""
        stated: dict[str, object] = {"seed": self.seed, "analysis": self.version}
        if hasattr(self, "model"):
            stated["model"] = dataclasses.asdict(self.model)
        if hasattr(self, "bound"):
            stated["bound"] = self.bound
        return stated | {"design": self.design.model_dump(mode="json"), "simulated": True}

    @property
    @abstractmethod
    def tests(self) -> Mapping[str, str]:
        """Tests and their meaning; the first is the primary test."""

    @property
    def widths(self) -> tuple[str, str]:
        """Descriptions of the two widths: of the primary test, and of another; empty if there is none."""
        return "", ""

    @abstractmethod
    def table(self, subjects: int, rng: np.random.Generator) -> pd.DataFrame:
        """Simulate the answers of a number of subjects, with the columns of a data set."""

    @property
    def claims(self) -> Mapping[str, Claim]:
        """Claims by the name of their test."""
        raise NotImplementedError

    @property
    def measured(self) -> tuple[tuple[str, str], ...]:
        """Question and level of each effect whose interval is described by `widths`."""
        raise NotImplementedError

    @property
    def scale(self) -> Analysis | str:
        """Analysis of the answers, which determines the exclusion rules that apply."""
        return "ratio"

    def answers(self, kept: pd.DataFrame) -> Answers:
        """Analyse answers as a report does."""
        raise NotImplementedError

    def outcome(self, table: pd.DataFrame) -> dict[str, float | None]:
        """Apply exclusion criteria to answers and analyse them as a report does.

        Returns
        -------
        dict
            For each of `tests` 1.0 if it was significant, otherwise 0.0; `width` and `far_width`, widths of 95 %
            confidence intervals, None if not computed; and `left_out`, the number of subjects excluded.
        """
        kept, found = quality(table, None, self.scale)
        outcome: dict[str, float | None] = dict.fromkeys(self.tests, 0.0) | {"width": None, "far_width": None}
        outcome["left_out"] = float(found.subjects_before - found.subjects_after)
        if not found.subjects_after:
            return outcome
        answers = self.answers(kept)
        for test, claim in self.claims.items():
            of = answers.to(claim.question)
            outcome[test] = float(all(supports(of.get(level), claim.sign) for level in claim.levels))
        for width, (question, level) in zip(("width", "far_width"), self.measured, strict=False):
            effect = answers.to(question).get(level)
            outcome[width] = effect.high - effect.low if isinstance(effect, Effect) else None
        return outcome

    def varied(self, spread: str, factor: float) -> Self:
        """Return the same study with one of the assumed standard deviations (`spreads`) multiplied by a factor."""
        model = self.model  # type: ignore[attr-defined]  # studies with spreads have a model
        changed = dataclasses.replace(model, **{spread: factor * getattr(model, spread)})
        return dataclasses.replace(self, model=changed)  # type: ignore[type-var]

    def experiment(self, subjects: int, number: int) -> dict[str, float | None]:
        """Simulate and analyse one experiment, whose number selects its subjects: see `outcome`."""
        return self.outcome(self.table(subjects, self.stream(subjects, number)))

    def stream(self, *what: int) -> np.random.Generator:
        """Return the random generator of one experiment, which depends only on the seed and the numbers."""
        return default_rng(SeedSequence([self.seed, *what]))
