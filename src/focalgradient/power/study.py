"""Power study: an analysis and simulated people with assumed effects, whose experiments are analysed as in a report."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Self

import numpy as np
from numpy.random import SeedSequence, default_rng

from focalgradient.errors import InputError, check_fields, described
from focalgradient.quantities import Range
from focalgradient.statistics import Effect, Equivalence, Interval
from focalgradient.statistics.criteria import AnalysisOptions
from focalgradient.statistics.hypotheses import check_bound
from focalgradient.statistics.questions import Analysis, Answers
from focalgradient.tasks import task_named

__all__ = ["LAPSES", "ODDS_RATIOS", "SPREAD", "AnyStudy", "Claim", "People", "Study", "planned_trials"]

SPREAD = Range("standard deviations of a natural logarithm", 0, 3)
"""Range of a standard deviation: 3 is a factor of 20 between people, far above any published variation of ratings or
durations.
"""
LAPSES = Range("proportions", 0, 0.999)
ODDS_RATIOS = Range("odds ratios, where 1 means none,", 0.01, 100)


@cache
def planned_trials(kind: type[Any], design_json: str, participant: str) -> tuple[Any, ...]:
    """Return the trials of a design after practice; cached, because making the list takes longer than simulating it."""
    trials = kind.model_validate_json(design_json).trials(participant)
    return tuple(trial for trial in trials if trial.phase == "main")


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim that a study tests: an effect, an equivalence or a precision at all levels of a question.

    Parameters
    ----------
    meaning
        Description.
    question
        Name of the question of the report's analysis.
    levels
        Levels at which the claim must be supported; empty: at all that have an outcome.
    sign
        Expected sign of the effect; 0 for either.
    factor
        Factor of the estimate within which the upper end of its interval must lie; None for tests.
    """

    meaning: str
    question: str
    levels: tuple[str, ...]
    sign: int = 1
    factor: float | None = None

    def supported(self, answers: Answers) -> bool:
        """Return whether answers support the claim at all levels."""
        outcomes = answers.to(self.question)
        levels = self.levels or tuple(outcomes)
        return bool(levels) and all(self._supports(outcomes.get(level)) for level in levels)

    def _supports(self, outcome: object) -> bool:
        match outcome:
            case Equivalence():
                return outcome.equivalent
            case Effect():
                return outcome.significant and (self.sign == 0 or self.sign * outcome.estimate > 0)
            case Interval(estimate, _, float(high)):
                return self.factor is not None and high <= self.factor * estimate
        return False


class People(ABC):
    """Simulated people: assumptions, and the analysis of their answers; a subclass is a dataclass."""

    __slots__ = ()

    version: ClassVar[int] = 1
    """Version of the analysis, recorded in the file of experiments: files of other versions are not continued."""
    logs: ClassVar[bool] = False
    """Whether widths of intervals are logarithms, to be reported as the ratio of the limits."""
    bounded: ClassVar[bool] = False
    """Whether the analysis has a bound, a ratio above 1."""
    kind: ClassVar[str] = "subjects from a statistical model"
    """Who is simulated."""
    width_label: ClassVar[str] = "95 % interval: width"
    """Description of the widths of intervals."""
    spreads: ClassVar[tuple[str, ...]] = ()
    """Names of the assumed standard deviations."""
    designs: ClassVar[type[Any]] = object
    """Class of the design."""

    def __post_init__(self) -> None:
        check_fields(self)

    def analysis(self, design: Any, bound: float) -> Analysis:
        """Return the analysis of the design's task, with exclusions."""
        asked = task_named(design.task).analysis(design, AnalysisOptions(bound=bound))
        return dataclasses.replace(asked, also=())  # further questions are of values that the models do not simulate

    @abstractmethod
    def simulated(self, design: Any, subjects: int, rng: np.random.Generator, seed: int) -> Any:
        """Simulate the answers of a number of people, as the analysis takes them; `seed` is that of the study."""

    @abstractmethod
    def claims(self, design: Any, bound: float) -> Mapping[str, Claim]:
        """Return the claims that are tested, by name; the first is the primary one."""

    @abstractmethod
    def measured(self, design: Any) -> tuple[tuple[str, str, str], ...]:
        """Return description, question and level of the effects whose interval widths are reported; two at most."""

    def seconds(self, design: Any) -> float:
        """Return the processor time of one experiment, in s per subject (measured)."""
        return 0.01

    def setup_seconds(self) -> float:
        """Return the processor time in s before the first experiment, in each process."""
        return 0.0

    def check(self, design: Any) -> None:
        """Raise `InputError` if a design is of another class or lacks a comparison, or the effect is not a rise."""
        if not isinstance(design, self.designs):
            raise InputError(f"design is {described(design)}, but must be a {self.designs.__name__}.")
        if (effect := getattr(self, "effect", 1)) < 1:
            raise InputError(
                f"effect is {effect:g}, but must be 1 or more, as the hypothesis is a rise: give a ratio, 1.2 for a "
                "rise by 20 %; a fall has the power of its inverse."
            )

    def settings(self, design: Any) -> dict[str, object]:
        """Return the assumptions in the form stored in the file of experiments."""
        return {"model": dataclasses.asdict(self)}  # type: ignore[call-overload]


@dataclass(frozen=True, slots=True)
class Study:
    """Power study: experiments with simulated people are analysed as in a report.

    Parameters
    ----------
    model
        Simulated people.
    design
        Design of the experiment.
    bound
        Ratio above 1, for ratings on a ratio scale and thresholds: equivalence bound, or factor within which the mean
        must be known.
    seed
        Seed of all random draws.

    Raises
    ------
    InputError
        If the bound is not above 1 and at most 10, or the design lacks the conditions to be compared.
    """

    model: People
    design: Any
    bound: float = 1.2
    seed: int = 1

    def __post_init__(self) -> None:
        check_fields(self)
        if self.model.bounded:
            check_bound("bound", self.bound)
        self.model.check(self.design)

    @property
    def tests(self) -> Mapping[str, str]:
        """Tests and their meaning; the first is the primary test."""
        return {name: claim.meaning for name, claim in self.claims.items()}

    @property
    def claims(self) -> Mapping[str, Claim]:
        """Claims by the name of their test."""
        return self.model.claims(self.design, self.bound)

    @property
    def widths(self) -> tuple[str, str]:
        """Descriptions of the two widths: of the primary test, and of another; empty if there is none."""
        first, second = (*(label for label, _, _ in self.model.measured(self.design)), "", "")[:2]
        return first, second

    @property
    def analysis(self) -> Analysis:
        """Questions of the report, with exclusions."""
        return self.model.analysis(self.design, self.bound)

    def settings(self) -> dict[str, object]:
        """Return all settings in the form stored in the file of experiments."""
        stated = {"seed": self.seed, "analysis": self.model.version, **self.model.settings(self.design)}
        stated |= {"bound": self.bound} if self.model.bounded else {}
        return stated | {"design": self.design.model_dump(mode="json"), "simulated": True}

    def table(self, subjects: int, rng: np.random.Generator) -> Any:
        """Simulate the answers of a number of subjects, as the analysis takes them."""
        return self.model.simulated(self.design, subjects, rng, self.seed)

    def outcome(self, table: Any) -> dict[str, float | None]:
        """Apply exclusion criteria to answers and analyse them as a report does.

        Returns
        -------
        dict
            For each of `tests` 1.0 if it was significant, otherwise 0.0; `width` and `far_width`, widths of 95 %
            confidence intervals, None if not computed; and `left_out`, the number of subjects excluded.
        """
        asked = self.analysis
        kept, found = asked.excluded(table)
        outcome: dict[str, float | None] = dict.fromkeys(self.claims, 0.0) | {"width": None, "far_width": None}
        outcome["left_out"] = 0.0 if found is None else float(found.subjects_before - found.subjects_after)
        if found is not None and not found.subjects_after:
            return outcome
        answers = asked.asked(kept, everyone=True)
        outcome |= {name: float(claim.supported(answers)) for name, claim in self.claims.items()}
        for width, (_, question, level) in zip(("width", "far_width"), self.model.measured(self.design), strict=False):
            outcome[width] = _width(answers.to(question).get(level))
        return outcome

    def varied(self, spread: str, factor: float) -> Self:
        """Return the same study with one of the assumed standard deviations (`spreads`) multiplied by a factor."""
        changed = {spread: factor * getattr(self.model, spread)}
        return dataclasses.replace(self, model=dataclasses.replace(self.model, **changed))  # type: ignore[type-var]

    def experiment(self, subjects: int, number: int) -> dict[str, float | None]:
        """Simulate and analyse one experiment, whose number selects its subjects: see `outcome`."""
        return self.outcome(self.table(subjects, self.stream(subjects, number)))

    def stream(self, *what: int) -> np.random.Generator:
        """Return the random generator of one experiment, which depends only on the seed and the numbers."""
        return default_rng(SeedSequence([self.seed, *what]))


AnyStudy = Study
"""Power study of any task."""


def _width(outcome: object) -> float | None:
    """Return the width of an effect's interval, or of the logarithm of a geometric mean."""
    match outcome:
        case Effect():
            return outcome.high - outcome.low
        case Interval(_, float(low), float(high)):
            return math.log(high / low)
    return None
