"""Section of the report on the rotating Necker cube."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

from focalgradient.dataset import DataSet
from focalgradient.plotting.subjects import necker_figure
from focalgradient.report.analysed import Reports, analyse_necker
from focalgradient.report.choices import CUBE
from focalgradient.report.displays import ViewedScreen, place_effects_of_cube, screens, screens_sheet
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.dominance import dominance_sheet
from focalgradient.report.exclusions import exclusions_table, with_and_without
from focalgradient.report.export import report_files
from focalgradient.report.parts import Asked, Output, Part
from focalgradient.report.tables import MEANS, answer_tables, necker_sheets, quality_sheets
from focalgradient.report.words import counts, methods_necker
from focalgradient.statistics import NotComputed, Quality
from focalgradient.statistics.criteria import OF_CUBE
from focalgradient.statistics.questions import Answer

__all__ = ["CubePart"]

CAPTION = (
    "The turning cube. Left: nonrigid share of the time with one of the two readings, each subject thin, mean and 95 % "
    "interval of the mean bold (that of the table). Middle: mean shares of all the time. Right: median and middle "
    "half of the fitted distribution of durations."
)


@dataclass(frozen=True, slots=True, eq=False)
class CubePart(Part):
    """Section on the reports on the cube, of a data set or of the user's own table.

    Parameters
    ----------
    reports
        Analysed reports.
    data, simulated
        As in `reports`.
    """

    title: ClassVar[str] = "Necker cube"
    name: ClassVar[str] = "necker"
    rules: ClassVar[tuple[str, ...]] = OF_CUBE
    choices: ClassVar[tuple[str, ...]] = CUBE

    reports: Reports
    data: DataSet | None
    simulated: bool

    @classmethod
    def of(cls, reports: Reports) -> CubePart:
        """Create the section from analysed reports."""
        return cls(reports, reports.data, reports.simulated)

    @classmethod
    def of_dataset(cls, root: str | os.PathLike[str], asked: Asked) -> CubePart:
        """Read and analyse the reports of a data set; errors as in `analyse_necker`."""
        return cls.of(analyse_necker(root, rules=asked.rules))

    @property
    def quality(self) -> Quality:
        """Data quality and exclusions."""
        return self.reports.quality

    def findings(self, output: Output) -> Iterator[Block]:
        part, result = self.reports, self.reports.result
        if isinstance(result, NotComputed):
            yield Notice(result.reason)
        else:
            yield from self.said(result.answers)
            if not result.effects:
                yield Notice("No trial had a gradient of blur: nothing was compared.")
        yield Paragraph(counts(part.quality))
        yield from with_and_without(part.quality, self.both)
        sheets = quality_sheets(part.quality, self.name)
        if not isinstance(result, NotComputed):
            yield output.figure(self.name, necker_figure(result, simulated=part.simulated), CAPTION)
            caption = (
                "Odds of the nonrigid reading (time), each gradient against none; first row: primary. p (Holm): over "
                "all secondary comparisons"
            )
            yield from answer_tables(self.answers(), caption)
            yield from answer_tables(
                result.answers, "Reported percepts, means over subjects with 95 % intervals", MEANS
            )
            over_people = [] if result.over_people is None else [dominance_sheet(result.over_people)]
            sheets = [*necker_sheets(result), *over_people, *sheets]
        if part.quality.exclusions:
            yield exclusions_table(self.both, self.name)
        yield from output.tables([*sheets, *filter(None, [screens_sheet(self._screens, self.name)])])
        if not isinstance(result, NotComputed):
            yield from map(Paragraph, result.remarks)

    @property
    def _screens(self) -> list[ViewedScreen]:
        return [] if self.data is None else screens(self.data)

    def answers(self) -> Iterator[Answer]:
        result = self.reports.result
        yield from self.reports.answers
        if not isinstance(result, NotComputed):
            yield from place_effects_of_cube(self._screens, result)

    def methods(self, output: Output) -> Iterator[Block]:
        yield from map(Paragraph, methods_necker(self.reports))
        yield from output.tables(self.design_table())

    def exports(self) -> Mapping[str, bytes]:
        part = self.reports
        computed = None if isinstance(part.result, NotComputed) else part.result
        return report_files(part.table, part.kept, computed, self.data)
