"""Section of a report on one task, as returned by `Task.reported`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from focalgradient.dataset import DataSet
from focalgradient.plotting.figures import as_files
from focalgradient.progress import Progress
from focalgradient.report.document import Block, Figure, Notice, Paragraph
from focalgradient.report.exclusions import WITHOUT, both_results
from focalgradient.report.provenance import listed
from focalgradient.report.tables import EFFECTS, Sheet
from focalgradient.scales import Analysis
from focalgradient.statistics import NotComputed, Rules
from focalgradient.statistics.effects import BOUND
from focalgradient.statistics.questions import Answer, Answers

__all__ = ["BOUND", "Asked", "Output", "Part"]


@dataclass(frozen=True, slots=True)
class Asked:
    """Settings of a report.

    Parameters
    ----------
    rules
        Exclusion rules.
    bound
        Equivalence bound, a ratio; None if not stated.
    scale
        Analysis of the ratings; None: that of the design.
    bayes
        True to add a Bayesian analysis of the ratings.
    progress
        Function called with the completed fraction of the slow models.
    """

    rules: Rules
    bound: float | None = None
    scale: Analysis | str | None = None
    bayes: bool = False
    progress: Progress | None = None

    @property
    def used_bound(self) -> float:
        """Equivalence bound, or the default."""
        return BOUND if self.bound is None else self.bound


class Output:
    """Tables and figures of a report, by file, as added by its sections."""

    def __init__(self) -> None:
        self.sheets: list[Sheet] = []
        self.figures: dict[str, bytes] = {}

    def tables(self, sheets: Iterable[Sheet]) -> list[Block]:
        """Add tables; return those to be displayed."""
        added = list(sheets)
        self.sheets += added
        return [sheet.table for sheet in added if sheet.table]

    def figure(self, name: str, drawn: Any, caption: str) -> Figure:
        """Add a figure as PNG and PDF; return it with its caption."""
        self.figures |= {f"{name}.{kind}": content for kind, content in as_files(drawn).items()}
        return Figure(f"{name}.png", self.figures[f"{name}.png"], caption)


class Part(ABC):
    """Section of a report on one task, read and analysed."""

    __slots__ = ()

    data: DataSet | None
    """The data set; None for the user's own table."""
    simulated: bool
    """True for simulated observers."""

    @property
    @abstractmethod
    def title(self) -> str:
        """Heading of the section."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Prefix of the section's file names."""

    @property
    @abstractmethod
    def choices(self) -> tuple[str, ...]:
        """Methodological choices to be explained: keys of `focalgradient.report.choices`."""

    @property
    def rules(self) -> tuple[str, ...]:
        """Fields of `focalgradient.statistics.Rules` that the analysis goes by, and "bound" where it does so."""
        return ()

    @abstractmethod
    def findings(self, output: Output) -> Iterator[Block]:
        """Yield the findings: sentences, figures and tables; the latter two are also added to `output`."""

    @staticmethod
    def said(answers: Answers, *roles: str) -> Iterator[Block]:
        """Yield the findings of some roles (by default the effects) in words; what was not tested as notices."""
        for answer, text in answers.said(*(roles or EFFECTS)):
            yield Notice(text) if isinstance(answer.outcome, NotComputed) else Paragraph(text)

    @abstractmethod
    def answers(self) -> Iterable[Answer]:
        """Yield all effects, the rows of results.csv."""

    @abstractmethod
    def methods(self, output: Output) -> Iterator[Block]:
        """Yield the methods for a paper."""

    @property
    def both(self) -> list[tuple[str, Answer]]:
        """Main results with and without exclusions."""
        answers = [*self.answers()]
        return both_results(answers, excludes=bool(self.rules) or any(one.role == WITHOUT for one in answers))

    @abstractmethod
    def exports(self) -> Mapping[str, bytes]:
        """Return the files for other software by name: all trials as a table, and scripts."""

    def design_table(self) -> list[Sheet]:
        """Return every setting of the design as a table, with all values if sessions differ."""
        values: dict[str, dict[str, None]] = {}
        for sidecar in {} if self.data is None else self.data.sidecars.values():
            for setting, value in sidecar["Design"].items():
                text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
                values.setdefault(setting, {})[text] = None
        rows = [[setting, "; ".join(text)] for setting, text in values.items()]
        return (
            [listed(f"{self.name}_design.csv", "Design", ["setting", "value"], rows, folded=True)] if self.data else []
        )
