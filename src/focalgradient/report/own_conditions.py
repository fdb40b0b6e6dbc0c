"""Section of the report on ratings by any condition of the user's own table."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.plotting.conditions import condition_figure
from focalgradient.report.choices import OWN
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.exclusions import EFFECT
from focalgradient.report.export import reader, safe_csv
from focalgradient.report.parts import Output, Part
from focalgradient.report.tables import Sheet, effect_sheet, many
from focalgradient.statistics import ConditionTest, Effect, NotComputed, as_table
from focalgradient.statistics.own_conditions import OwnConditions, rating_tests

__all__ = ["ConditionPart"]


@dataclass(frozen=True, slots=True, eq=False)
class ConditionPart(Part):
    """Analysed ratings by condition.

    Parameters
    ----------
    own
        Imported table.
    tests
        Tests of the conditions with their effects.
    simulated, data
        As in every section.
    """

    own: OwnConditions
    tests: tuple[ConditionTest, ...]
    simulated: bool
    data: DataSet | None = None

    @classmethod
    def of(cls, own: OwnConditions) -> ConditionPart:
        """Test the conditions of a table."""
        return cls(own, rating_tests(own), bool((own.table["kind"] == "simulated").any()))

    @property
    def title(self) -> str:
        return "Ratings by condition"

    @property
    def name(self) -> str:
        return "ratings_by_condition"

    def findings(self, output: Output) -> Iterator[Block]:
        rows = self.own.table[~self.own.table["catch"]]
        people = rows["participant_id"].nunique()
        scenes = f" of {many(rows['scene'].nunique(), 'scene')}" if "scene" in rows else ""
        for test in self.tests:
            effect = test.effect
            if isinstance(effect, Effect):
                yield Paragraph(_sentence(test, effect))
            elif isinstance(effect, NotComputed):
                yield Notice(f"{test.name}: {effect.reason}")
        who = "simulated observer" if self.simulated else "subject"
        yield Paragraph(f"{many(people, who)} with {many(len(rows), 'rating')}{scenes}; nobody is left out.")
        for factor in self.own.conditions:
            figure = condition_figure(rows, factor, [("rating", self.own.log)], units={}, simulated=self.simulated)
            caption = f"Ratings by {factor}: each subject thin, mean and its 95 % interval over subjects bold."
            yield output.figure(f"{self.name}_{factor}".replace(" ", "_").replace("/", "_"), figure, caption)
        found = [(test.name, test.effect) for test in self.tests if test.effect is not None]
        digits = [
            {"exclusions": "without exclusions", "what": name}
            | ({"value": one.estimate, "value_low": one.low, "value_high": one.high} if isinstance(one, Effect) else {})
            | as_table([one]).iloc[0].to_dict()
            for name, one in found
        ]
        caption = "Tests of the conditions; Holm’s correction is over all"
        results = Sheet(f"{self.name}{EFFECT}", None, pd.DataFrame(digits))
        yield from output.tables([effect_sheet(f"{self.name}_tests.csv", caption, "effect", found), results])

    def methods(self, output: Output) -> Iterator[Block]:
        scale = "on their logarithm" if self.own.log else "as they are"
        scenes = ", crossed with scenes as random where there are five or more" if "scene" in self.own.table else ""
        yield Paragraph(
            f"Ratings were analysed {scale}, averaged within subject and condition. The effect of a condition with "
            "three or more levels that are numbers is its least-squares slope within subject"
            f"{scenes}; of other conditions each level was compared with the first (paired over subjects; levels of "
            "different subjects by Welch’s test), two-sided, with Holm’s correction over "
            f"{many(len(self.tests), 'test')}."
        )

    @property
    def choices(self) -> tuple[str, ...]:
        return OWN

    def exports(self) -> Mapping[str, bytes]:
        file = f"{self.name}_trials.csv"
        return {file: safe_csv(self.own.table), f"read_{file.removesuffix('.csv')}.R": reader(file, self.own.table)}


def _sentence(test: ConditionTest, effect: Effect) -> str:
    """Return the finding of a test, with its size as a factor where ratings are ratios."""
    what = (
        f"each unit of {test.factor}" if test.level is None else f"{test.factor} {test.level} instead of {test.against}"
    )
    size = f"by {effect.estimate:+.3g}"
    if test.log:
        size = f"by a factor of {math.exp(effect.estimate):.3g}"
    verb = "changes ratings" if effect.significant else "is not shown to change ratings, which differ"
    return f"{what[0].upper()}{what[1:]} {verb} {size} ({effect.summary()})."
