"""Tests of the effects of conditions, as planned before data are collected and as computed from them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import pandas as pd

from focalgradient.files.cells import name_and_unit
from focalgradient.statistics.means import share_interval, t_interval
from focalgradient.statistics.questions import less
from focalgradient.statistics.records import Effect, Interval, NotComputed
from focalgradient.statistics.wording import number, statistic

__all__ = ["ConditionTest", "level_text", "planned_interactions", "planned_tests"]

UNITS = {
    "mm": "millimetre",
    "cm": "centimetre",
    "m": "metre",
    "deg": "degree",
    "degree": "degree",
    "arcmin": "minute of arc",
    "ms": "millisecond",
    "s": "second",
    "d": "dioptre",
}
"""Names of the units of conditions."""


@dataclass(frozen=True, slots=True)
class ConditionTest:
    """Test of the effect of one condition on one answer.

    Parameters
    ----------
    answer
        Column of the answer.
    factor
        Column of the condition.
    level, against
        Levels compared; None for numeric factors with three or more levels, whose slope is tested.
    log
        True if the answer is a ratio, analysed on its natural logarithm.
    effect
        Slope per unit of the factor, or difference between the levels; None before data are collected.
    points
        Mean answer of each subject (row) at each level of the factor (column), logarithmic for `log`, over all scenes;
        None before data are collected.
    r_code
        R code that prints the same effect: see `focalgradient.statistics.questions.Question`.
    unit
        Unit of the effect; empty if it has none, or it is unknown.
    of
        Of an interaction, the test whose effect is the answer; else None.
    """

    answer: str
    factor: str
    level: str | None = None
    against: str | None = None
    log: bool = False
    effect: Effect | NotComputed | None = None
    points: pd.DataFrame | None = field(default=None, compare=False)
    r_code: str = field(default="", compare=False)
    unit: str = field(default="", compare=False)
    of: ConditionTest | None = field(default=None, compare=False)

    @property
    def means(self) -> list[Interval]:
        """Mean of the points at each level, with its 95 % interval over subjects; geometric for `log`.

        Intervals of shares are on the log odds of their mean.

        >>> [mean.estimate for mean in ConditionTest("blur", "eye", points=pd.DataFrame({"L": [1.0, 2.0]})).means]
        [1.5]
        """
        columns = [] if self.points is None else [self.points[level].dropna() for level in self.points]
        if self.log:
            return [t_interval(values).ratio for values in columns]
        of = share_interval if re.match("share( per |$)", self.unit) else t_interval
        return [of(values) for values in columns]

    @property
    def sentence(self) -> str:
        """Finding of the test in words, with its size as a factor where answers are ratios; empty before data exist.

        >>> ConditionTest("blur", "sigma", effect=NotComputed("There are no answers.")).sentence
        'slope of blur on sigma: There are no answers.'
        """
        effect = self.effect
        if effect is None:
            return ""
        if isinstance(effect, NotComputed):
            return f"{self.name}: {effect.reason}"
        name, unit = name_and_unit(self.factor)
        if not unit:  # of the task's column
            name, unit = self.factor, self.unit.rpartition("per ")[2].casefold()
        what = (
            f"each {UNITS.get(unit, 'unit')} of {name if unit in UNITS else self.factor}"
            if self.level is None
            else f"{self.factor} {self.level} instead of {self.against}"
        )
        estimates = (effect.estimate, effect.low, effect.high)
        on_log = re.match(r"\((?:slope of )?log ", self.answer)  # an effect on a ratio
        answer = self.answer.replace("log ", "", 1) if on_log else self.answer
        log = self.log or on_log is not None
        size, low, high = (number(math.exp(value), 4) if log else number(value) for value in estimates)
        by = "a factor of " if log else "+" if effect.estimate > 0 else ""
        several = answer == "rating"
        of = "ratings" if several else f"the effect {answer}" if answer.startswith("(") else answer
        differ = "differ" if several else "differs"
        verb = f"changes {of}" if effect.significant else f"is not shown to change {of}, which {differ}"
        ends = f"(95 % interval {low} to {high}; {statistic(effect)})"
        return f"{what[0].upper()}{what[1:]} {verb} by {by}{size} {ends}."

    @property
    def name(self) -> str:
        """Description of the test in words.

        >>> ConditionTest("blur", "sigma_arcmin").name, ConditionTest("rating", "eye", "left", "right", log=True).name
        ('slope of blur on sigma_arcmin', 'log rating, eye left less right')
        """
        answer = f"log {self.answer}" if self.log else self.answer
        if self.level is None:
            return f"slope of {answer} on {self.factor}"
        return f"{answer}, {self.factor} {less(self.level, self.against)}"


def planned_tests(answers: Mapping[str, bool], factors: Mapping[str, Sequence[object]]) -> tuple[ConditionTest, ...]:
    """List the tests of a task before data are collected.

    Parameters
    ----------
    answers
        Answer columns; the value is True if the answer is a ratio.
    factors
        Condition columns with their levels, in the order of comparison.

    Returns
    -------
    tuple
        For each answer and factor: the slope if the factor has three or more levels that are all numbers, otherwise
        each level minus the first; nothing for factors with one level.

    Examples
    --------
    >>> [test.name for test in planned_tests({"blur": False}, {"sigma": [1.0, 2.0, 4.0], "eye": ["left", "right"]})]
    ['slope of blur on sigma', 'blur, eye right less left']
    """
    tests = []
    for answer, log in answers.items():
        for factor, levels in factors.items():
            numbers = all(isinstance(one, int | float) and not isinstance(one, bool) for one in levels)
            if numbers and len(levels) >= 3:
                tests.append(ConditionTest(answer, factor, log=log))
            else:
                first, *others = map(level_text, levels)
                tests += [ConditionTest(answer, factor, level, first, log) for level in others]
    return tuple(tests)


def planned_interactions(tests: Sequence[ConditionTest]) -> tuple[ConditionTest, ...]:
    """List the tests of whether the effect of each condition differs between the levels of each later one.

    >>> tests = planned_tests({"blur": False}, {"mm": [1, 2, 4], "eye": ["L", "R"]})
    >>> [test.name for test in planned_interactions(tests)]
    ['(slope of blur on mm), eye R less L']
    """
    return tuple(
        replace(other, answer=f"({test.name})", log=False, of=test)
        for test, other in combinations(tests, 2)
        if test.answer == other.answer and test.factor != other.factor
    )


def level_text(value: object) -> str:
    """Return a level as tests name it."""
    return f"{value:g}" if isinstance(value, float) else str(value)
