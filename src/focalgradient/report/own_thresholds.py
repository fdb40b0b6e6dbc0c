"""Section of the report on thresholds in the user's own table: functions of each person, means, and conditions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

from focalgradient.dataset import DataSet
from focalgradient.plotting.thresholds import person_figure, threshold_figure
from focalgradient.report.choices import THRESHOLDS
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.export import table_files
from focalgradient.report.parts import Output, Part
from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet, answer_tables
from focalgradient.report.thresholds import BIAS, fitted_values, threshold_answers
from focalgradient.statistics import (
    Effect,
    Interval,
    NotComputed,
    ThresholdFit,
    ThresholdResult,
    blur_thresholds,
)
from focalgradient.statistics.own_thresholds import OwnThresholds
from focalgradient.statistics.questions import Answer, stated
from focalgradient.statistics.thresholds import ATTENDING, threshold_differences
from focalgradient.statistics.wording import decimals, freedom, many, number, p_is

__all__ = ["OwnThresholdPart"]

GROUPS = (
    "Left: each person’s function, with the share of right answers at each level (disc: larger for more trials). "
    "Right: thresholds with 95 % intervals, those of the table; geometric means bold."
)
PEOPLE = "Each person’s share of right answers at each level (disc: larger for more trials) and function."


@dataclass(frozen=True, slots=True, eq=False)
class OwnThresholdPart(Part):
    """Analysed threshold data of the user's own table.

    Parameters
    ----------
    own
        Imported table.
    results
        Thresholds of each person, by condition.
    simulated, data
        As in every section.
    """

    title: ClassVar[str] = "Thresholds"
    name: ClassVar[str] = "threshold"
    choices: ClassVar[tuple[str, ...]] = THRESHOLDS

    own: OwnThresholds
    results: Mapping[str, ThresholdResult]
    simulated: bool
    data: DataSet | None = None

    @classmethod
    def of(cls, own: OwnThresholds) -> OwnThresholdPart:
        """Fit each person in each condition."""
        table = own.table
        least, most = float(table["level"].min()), float(table["level"].max())
        results = {
            str(name): blur_thresholds(rows, least=least, most=most, unit=own.unit, guess=own.guess)
            for name, rows in table.groupby("condition", sort=True)
        }
        return cls(own, results, bool((table["kind"] == "simulated").any()))

    def findings(self, output: Output) -> Iterator[Block]:
        table, unit = self.own.table, self.own.unit
        people = table["participant_id"].nunique()
        several = f" in {len(self.results)} conditions" if len(self.results) > 1 else ""
        yield Paragraph(
            f"Thresholds of {many(people, 'person').replace('persons', 'people')}{several}, of "
            f"{many(len(table), 'trial')} at levels from {_level(table['level'].min(), unit)} to "
            f"{_level(table['level'].max(), unit)}."
        )
        for name, result in self.results.items():
            yield from self._notices(name, result)
            where = f"{name}: geometric" if name else "Geometric"
            if isinstance(result.mean, Interval):
                yield Paragraph(f"{where} mean of each person’s threshold: {_ends(result.mean, unit)}.")
            else:
                yield Notice(f"{name}: {result.mean.reason}" if name else result.mean.reason)
        differences = threshold_differences(self.results)
        for pair, test in differences.items():
            yield from self._difference(*pair, test)
        if any(isinstance(one.fit, ThresholdFit) for result in self.results.values() for one in result.subjects):
            level = f"level ({unit})" if unit else "level"
            yield output.figure(
                "thresholds", threshold_figure(self.results, simulated=self.simulated, level=level), GROUPS
            )
            yield output.figure(
                "threshold_people", person_figure(self.results, simulated=self.simulated, level=level), PEOPLE
            )
        if differences:
            yield from answer_tables(self.answers(), "Geometric mean thresholds, and their ratios between conditions")
        yield from output.tables([self._each()])

    def _notices(self, condition: str, result: ThresholdResult) -> Iterator[Block]:
        low, high = self.own.table["level"].min(), self.own.table["level"].max()
        for one in result.subjects:
            who = " ".join(filter(None, [one.participant, one.session, condition]))
            if isinstance(one.fit, NotComputed):
                yield Notice(f"{who}: {one.fit.reason}")
            elif one.fit.low < 1.1 * low or one.fit.high > high / 1.1:
                yield Notice(
                    f"{who}: the interval reaches the end of the levels, which go from {_level(low, self.own.unit)} to "
                    f"{_level(high, self.own.unit)}: the threshold may lie beyond."
                )
            if not one.kept:
                yield Notice(
                    f"{who} was right in {one.catch_right} of {one.catch_trials} catch trials, fewer than "
                    f"{ATTENDING:.0%}: by inattention, or because the threshold is high."
                )

    def _difference(self, one: str, other: str, test: Effect | NotComputed) -> Iterator[Block]:
        if isinstance(test, NotComputed):
            yield Notice(f"The thresholds of {one} and {other} were not compared: {test.reason}")
            return
        holm = "" if test.p_holm is None else f", by Holm {p_is(test.p_holm)}"
        yield Paragraph(
            f"Threshold of {one} over that of {other}: {_ends(test.ratio, '')}, t({freedom(test.df)}) = "
            f"{decimals(test.statistic)}, p {p_is(test.p)}{holm}."
        )

    def _each(self) -> Sheet:
        head = ["participant", "session", "condition", "threshold", "low", "high", "slope", "lapses", "trials"]
        rows = [
            [one.participant, one.session, name, *fitted_values(one.fit)]
            for name, result in self.results.items()
            for one in result.subjects
        ]
        unit = f" ({self.own.unit})" if self.own.unit else ""
        return listed("thresholds.csv", f"Each person’s threshold{unit} with its 95 % interval", head, rows)

    def answers(self) -> Iterator[Answer]:
        for name, result in self.results.items():
            yield from threshold_answers(result, name, "main")
        for (one, other), test in threshold_differences(self.results).items():
            yield stated("log ratio of thresholds", f"{one} over {other}", test, "main", "log ratio")

    def methods(self, output: Output) -> Iterator[Block]:
        guess = self.own.guess
        yield Paragraph(
            "Each person’s answers in each condition were fitted by psignifit (Schütt, Harmeling, Macke & Wichmann, "
            f"2016): Weibull’s function of the logarithm of the level, from the guess rate of {guess:.3g} upwards, "
            "threshold evenly distributed over the levels shown, slope from 1 to 10 evenly on its logarithm, lapse "
            "rate beta (1, 66) up to 10 %, no overdispersion. Given are the median of the posterior and its central "
            f"95 %. At threshold {guess + (1 - guess) / 2:.3g} of the answers are right, without lapses. The mean is "
            "geometric, its interval by Student’s t over people; conditions are compared by t-tests of log thresholds "
            "over people (paired, of separate groups Welch’s), several by Holm’s method. Catch trials do not count. "
            f"{BIAS}"
        )

    def exports(self) -> Mapping[str, bytes]:
        return table_files(f"{self.name}_trials", self.own.table)


def _level(value: float, unit: str) -> str:
    return f"{number(float(value))} {unit}".strip()


def _ends(found: Interval, unit: str) -> str:
    ends = "" if found.low is None else f" (95 % interval {number(found.low)} to {_level(found.high or 0, unit)})"
    return _level(found.estimate, unit) + ends
