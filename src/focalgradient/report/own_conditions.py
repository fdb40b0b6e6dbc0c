"""Section of the report on ratings by any condition of the user's own table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

from focalgradient.dataset import DataSet
from focalgradient.plotting.conditions import condition_figure
from focalgradient.report.choices import OWN
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.exclusions import TRIALS, WITHOUT, changed
from focalgradient.report.export import table_files
from focalgradient.report.parts import Output, Part
from focalgradient.report.tables import answer_tables
from focalgradient.statistics import ConditionTest, Effect, NotComputed, Rules
from focalgradient.statistics.conditions import answers_of_tests
from focalgradient.statistics.exclusions import kept_rows
from focalgradient.statistics.own_conditions import RULES, OwnConditions, rating_tests
from focalgradient.statistics.questions import Answer, Answers
from focalgradient.statistics.wording import many, number, statistic

__all__ = ["ConditionPart"]


@dataclass(frozen=True, slots=True, eq=False)
class ConditionPart(Part):
    """Analysed ratings by condition.

    Parameters
    ----------
    own
        Imported table.
    tests, everyone
        Tests of the conditions with their effects, with and without exclusions.
    criteria
        Exclusion rules.
    simulated, data
        As in every section.
    """

    title: ClassVar[str] = "Ratings by condition"
    name: ClassVar[str] = "ratings_by_condition"
    choices: ClassVar[tuple[str, ...]] = OWN

    own: OwnConditions
    tests: tuple[ConditionTest, ...]
    everyone: tuple[ConditionTest, ...]
    criteria: Rules
    simulated: bool
    data: DataSet | None = None

    @classmethod
    def of(cls, own: OwnConditions, rules: Rules) -> ConditionPart:
        """Test the conditions of a table."""
        simulated = bool((own.table["kind"] == "simulated").any())
        return cls(own, rating_tests(own, rules), rating_tests(own), rules, simulated)

    @property
    def rules(self) -> tuple[str, ...]:
        return tuple(rule for rule in RULES if rule in self.own.table)

    def findings(self, output: Output) -> Iterator[Block]:
        everyone = self.own.table[~self.own.table["catch"]]
        rows = everyone[kept_rows(everyone, [], self.criteria)]
        people = rows["participant_id"].nunique()
        scenes = f" of {many(rows['scene'].nunique(), 'scene')}" if "scene" in rows else ""
        for test in self.tests:
            effect = test.effect
            if isinstance(effect, Effect):
                yield Paragraph(_sentence(test, effect))
            elif isinstance(effect, NotComputed):
                yield Notice(f"{test.name}: {effect.reason}")
        who = "simulated observer" if self.simulated else "subject"
        left = many(len(everyone) - len(rows), "rating")
        out = f"{left} left out by the rules on trials" if len(rows) < len(everyone) else "nobody is left out"
        yield Paragraph(f"{many(people, who)} with {many(len(rows), 'rating')}{scenes}; {out}.")
        yield from map(Notice, changed(answers_of_tests(self.tests), answers_of_tests(self.everyone)))
        for factor in self.own.conditions:
            figure = condition_figure(rows, factor, [("rating", self.own.log)], units={}, simulated=self.simulated)
            alike = rows.groupby("participant_id")[factor].nunique().max() == 1
            drawn = "a point for each subject" if alike else "each subject thin"
            caption = f"Ratings by {factor}: {drawn}, mean and its 95 % interval over subjects bold."
            if alike and any(test.factor == factor and test.level is None for test in self.tests):
                caption = f"Ratings by {factor}: a point for each subject, and their least-squares line."
            yield output.figure(f"{self.name}_{factor}".replace(" ", "_").replace("/", "_"), figure, caption)
        caption = "Tests of the conditions; Holm’s correction is over those of ratings, and over those of effects"
        yield from answer_tables(answers_of_tests(self.tests), caption)

    def answers(self) -> Iterator[Answer]:
        yield from answers_of_tests(self.tests)
        if self.everyone != self.tests:
            yield from Answers(tuple(answers_of_tests(self.everyone))).variant(WITHOUT)

    def methods(self, output: Output) -> Iterator[Block]:
        applied = [TRIALS[rule] for rule in self.rules if getattr(self.criteria, rule) is not None]
        if applied:
            yield Paragraph(
                f"By rules that do not look at the effect, {'; '.join(applied)}.".format(rules=self.criteria)
            )
        scale = "on their logarithm" if self.own.log else "as they are"
        scenes = ", crossed with scenes as random where there are five or more" if "scene" in self.own.table else ""
        yield Paragraph(
            f"Ratings were analysed {scale}, averaged within subject and condition. The effect of a condition with "
            "three or more levels that are numbers is its least-squares slope within subject"
            f"{scenes}; of other conditions each level was compared with the first (paired over subjects). Conditions "
            "that vary between subjects were compared by Welch’s test, or estimated together by least squares over "
            "subjects (each adjusted for the others), on the subjects’ means and on their effects. Tests are "
            "two-sided, with Holm’s correction over "
            f"{many(len([test for test in self.tests if test.answer == 'rating']), 'test')} of ratings, and over those "
            "of effects."
        )

    def exports(self) -> Mapping[str, bytes]:
        return table_files(f"{self.name}_trials", self.own.table)


def _sentence(test: ConditionTest, effect: Effect) -> str:
    """Return the finding of a test, with its size as a factor where ratings are ratios."""
    what = (
        f"each unit of {test.factor}" if test.level is None else f"{test.factor} {test.level} instead of {test.against}"
    )
    estimates = (effect.estimate, effect.low, effect.high)
    size, low, high = (number(math.exp(value), 4) if test.log else number(value) for value in estimates)
    by = "a factor of " if test.log else "+" if effect.estimate > 0 else ""
    of = "ratings" if test.answer == "rating" else f"the effect {test.answer}"
    differ = "differ" if test.answer == "rating" else "differs"
    verb = f"changes {of}" if effect.significant else f"is not shown to change {of}, which {differ}"
    return f"{what[0].upper()}{what[1:]} {verb} by {by}{size} (95 % interval {low} to {high}; {statistic(effect)})."
