"""What every study whose power is simulated states: subjects, analysis, tests; one class for each kind of answers."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
import pandas as pd
from numpy.random import SeedSequence, default_rng

from focalgradient.errors import InputError
from focalgradient.statistics import Effect, NotComputed
from focalgradient.tasks import task_named

__all__ = ["AnyStudy", "model_of"]

Model = TypeVar("Model")


def model_of(kind: type[Model], assumed: Mapping[str, Any], task: str, others: Collection[str] = ()) -> Model:
    """Make a model of simulated subjects of the numbers that were given; the rest has its defaults.

    Parameters
    ----------
    kind
        Its class, a dataclass.
    assumed
        Numbers by field.
    task
        Name of the task, for the error.
    others
        Numbers that the study takes beside those of the model.

    Raises
    ------
    InputError
        If the model has no such number, or it is out of range.
    """
    known = {one.name for one in dataclasses.fields(kind)}  # type: ignore[arg-type]
    if wrong := [name for name in assumed if name not in known and name not in others]:
        raise InputError(f"{wrong[0]} cannot go with {task_named(task).called}, which has no such thing: leave it out.")
    return kind(**{name: value for name, value in assumed.items() if name in known})


class AnyStudy(ABC):
    """A model of subjects, a design and a seed: whole experiments are simulated and analysed as a report does."""

    __slots__ = ()

    seconds: ClassVar[float] = 0.01
    """Processor time (s) of one experiment for each of its subjects: measured."""
    logs: ClassVar[bool] = False
    """Whether widths of intervals are logarithms, to be given as the ratio of their ends."""
    width_label: ClassVar[str] = "95 % interval: width"
    """What is measured by the widths of intervals."""

    seed: int
    design: Any

    @abstractmethod
    def settings(self) -> dict[str, object]:
        """Return all of it, as a file may hold it."""

    @property
    @abstractmethod
    def tests(self) -> Mapping[str, str]:
        """What is counted, and what it means; the first is the primary test."""

    @property
    def widths(self) -> tuple[str, str]:
        """Of what the widths are, in words: of the primary test, and of another; empty where there is none."""
        return "", ""

    @property
    def spreads(self) -> tuple[str, ...]:
        """Names of the standard deviations that are assumed."""
        return ()

    @abstractmethod
    def table(self, subjects: int, rng: np.random.Generator) -> pd.DataFrame:
        """Simulate the answers of this number of subjects, in the columns that a data set has."""

    @abstractmethod
    def outcome(self, table: pd.DataFrame) -> dict[str, float | None]:
        """Judge and analyse answers as a report does.

        Returns
        -------
        dict
            For each of `tests` 1.0 if it came out, else 0.0; `width` and `far_width`, of the 95 % intervals, None
            where there is none; and `left_out`, subjects that the rules of exclusion left out.
        """

    @abstractmethod
    def primary(self, table: pd.DataFrame) -> Effect | NotComputed:
        """Return the primary test of answers, nobody left out."""

    @abstractmethod
    def without_effect(self) -> AnyStudy:
        """Return the same study where no condition has an effect."""

    def varied(self, spread: str, factor: float) -> Self:
        """Return the same study with one of the assumed standard deviations (`spreads`) times a factor."""
        model = self.model  # type: ignore[attr-defined]  # whoever has spreads has a model
        changed = dataclasses.replace(model, **{spread: factor * getattr(model, spread)})
        return dataclasses.replace(self, model=changed)  # type: ignore[type-var]

    def experiment(self, subjects: int, number: int) -> dict[str, float | None]:
        """Simulate and analyse one experiment: see `outcome`; another number, other subjects."""
        return self.outcome(self.table(subjects, self.stream(subjects, number)))

    def stream(self, *what: int) -> np.random.Generator:
        """Return the random numbers of one experiment: they depend on seed and numbers alone."""
        return default_rng(SeedSequence([self.seed, *what]))
