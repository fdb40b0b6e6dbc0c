"""Section of the report on the rotating Necker cube."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from focalgradient.dataset import DataSet
from focalgradient.plotting.subjects import necker_figure
from focalgradient.report.analysed import Reports, analyse_necker
from focalgradient.report.choices import CUBE
from focalgradient.report.displays import place_effects_of_cube, place_sheet, screens, screens_sheet
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.dominance import dominance_sheet
from focalgradient.report.exclusions import answers_of, with_and_without
from focalgradient.report.export import report_files
from focalgradient.report.parts import Asked, Output, Part
from focalgradient.report.tables import necker_sheets, quality_sheets
from focalgradient.report.words import counts, methods_necker, necker_findings
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
    def title(self) -> str:
        return "Necker cube"

    @property
    def name(self) -> str:
        return "necker"

    @property
    def quality(self) -> Quality:
        """Data quality and exclusions."""
        return self.reports.quality

    @property
    def rules(self) -> tuple[str, ...]:
        return OF_CUBE

    def findings(self, output: Output) -> Iterator[Block]:
        part = self.reports
        yield Paragraph(counts(part.quality))
        own = quality_sheets(part.quality, "necker")
        seen = [] if part.data is None else screens(part.data)
        own += [sheet for sheet in [screens_sheet(seen, "necker")] if sheet]
        without = [*with_and_without("necker", part.quality, part.result, part.everyone, own)]
        if isinstance(part.result, NotComputed):
            yield Notice(part.result.reason)
            yield from without
            yield from output.tables(own)
            return
        yield from map(Paragraph, necker_findings(part.result))
        yield from without
        yield output.figure("necker", necker_figure(part.result, simulated=part.simulated), CAPTION)
        if places := place_effects_of_cube(seen, part.result):
            own = [place_sheet(places, "necker", "log odds of the nonrigid reading (time)"), *own]
        if part.result.over_people is not None:
            own = [dominance_sheet(part.result.over_people), *own]
        yield from output.tables([*necker_sheets(part.result), *own])
        yield from map(Paragraph, part.result.remarks)

    def answers(self) -> Iterator[Answer]:
        yield from answers_of(self.reports.result, self.reports.everyone, self.quality)

    def methods(self, output: Output) -> Iterator[Block]:
        yield from map(Paragraph, methods_necker(self.reports))
        yield from output.tables(self.design_table())

    @property
    def choices(self) -> tuple[str, ...]:
        return CUBE

    def exports(self) -> Mapping[str, bytes]:
        part = self.reports
        computed = None if isinstance(part.result, NotComputed) else part.result
        return report_files(part.table, part.kept, computed, self.data)
