"""Section of a report on one task: its plan and results as data, laid out in one order for every task."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any, NamedTuple

import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.plotting.figures import as_files
from focalgradient.progress import Progress
from focalgradient.report.choices import chosen
from focalgradient.report.document import FURTHER, Block, Details, Figure, Notice, Paragraph
from focalgradient.report.exclusions import WITHOUT, both_results, exclusions_table, with_and_without
from focalgradient.report.rules import Stated
from focalgradient.report.tables import CHECKS, EFFECTS, MEANS, Sheet, answer_tables, listed, quality_sheets
from focalgradient.scales import Analysis
from focalgradient.statistics import NotComputed, Quality, Rules
from focalgradient.statistics.criteria import BOUND, AnalysisOptions
from focalgradient.statistics.questions import Analysis as Questions
from focalgradient.statistics.questions import Answer, Answers, Caution
from focalgradient.statistics.wording import many
from focalgradient.tasks import Task

__all__ = ["BOUND", "Asked", "Drawing", "Output", "Part", "Plan", "is_simulated"]


@dataclass(frozen=True, slots=True)
class Asked:
    """Settings of a report, or of a preregistration.

    Parameters
    ----------
    stated
        Exclusion rules, with the equivalence bound if the file states it.
    given_bound
        Equivalence bound, a ratio, which goes before that of the file; None if not given.
    scale
        Analysis of the ratings; None: that of the design.
    bayes
        True to add a Bayesian analysis of the ratings.
    progress
        Function called with the completed fraction of the slow models.
    effects
        Effects and standard deviations assumed by a preregistration, by the name of their option.
    ordinal
        True to preregister an analysis of the answers as ordinal.
    """

    stated: Stated
    given_bound: float | None = None
    scale: Analysis | str | None = None
    bayes: bool = False
    progress: Progress | None = None
    effects: Mapping[str, float] = field(default_factory=dict)
    ordinal: bool = False

    @property
    def options(self) -> AnalysisOptions:
        """Settings of the analysis."""
        return AnalysisOptions(bound=self.used_bound, rules=self.rules, scale=self.scale)

    @property
    def rules(self) -> Rules:
        """Exclusion rules."""
        return self.stated.rules

    @property
    def bound(self) -> float | None:
        """Equivalence bound: the given one, or that of the file; None if neither states it."""
        return self.stated.bound if self.given_bound is None else self.given_bound

    @property
    def used_bound(self) -> float:
        """Equivalence bound, or the default."""
        return BOUND if self.bound is None else self.bound


def is_simulated(table: pd.DataFrame, data: DataSet | None = None) -> bool:
    """Return whether a table's answers, or those of its data set, are of simulated observers."""
    return bool((table["kind"] == "simulated").any()) if data is None else data.simulated


class Drawing(NamedTuple):
    """Figure of a section: name of its files, caption, function of `simulated` that draws it; True if it is folded."""

    name: str
    caption: str
    draw: Callable[..., Any]
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Output:
    """Tables and figures of a report, by file, as added by its sections.

    Parameters
    ----------
    sheets, figures
        Tables, and figures by file.
    named
        Function that returns the name of a file of the section that adds it.
    """

    sheets: list[Sheet] = field(default_factory=list)
    figures: dict[str, bytes] = field(default_factory=dict)
    named: Callable[[str], str] = str

    def tables(self, sheets: Iterable[Sheet]) -> list[Block]:
        """Add tables; return those to be displayed."""
        added = [sheet.of_file(self.named(sheet.file)) for sheet in sheets]
        self.sheets.extend(added)
        return [sheet.table for sheet in added if sheet.table]

    def figure(self, name: str, drawn: Any, caption: str) -> Figure:
        """Add a figure as PNG and PDF; return it with its caption."""
        name = self.named(name)
        self.figures.update({f"{name}.{kind}": content for kind, content in as_files(drawn).items()})
        return Figure(f"{name}.png", self.figures[f"{name}.png"], caption)


@dataclass(frozen=True, slots=True)
class Plan:
    """Preregistration and methods of a task, in the words of a paper.

    Parameters
    ----------
    questions
        Analysis: its hypotheses, primary outcome, methods, rules and choices.
    shown
        Design in sentences; ``{people}`` stands for the subjects.
    exclusions
        Exclusion rules, in sentences.
    further
        Further sentences on the analysis.
    """

    questions: Questions
    shown: str = ""
    exclusions: Sequence[str] = ()
    further: Sequence[str] = ()

    @property
    def analysis(self) -> list[str]:
        """Analysis in sentences."""
        return [
            self.questions.method,
            *self.further,
            *(text for other in self.questions.also if (text := other.method)),
        ]

    def sections(self, people: str) -> dict[str, Sequence[str]]:
        """Return all sentences by heading, in the order of a preregistration; `people` are the subjects."""
        return {
            "Primary outcome": [self.questions.outcome],
            "Design": [self.shown.replace("{people}", people)],
            "Exclusions": self.exclusions,
            "Analysis": self.analysis,
        }


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Part:
    """Section of a report on one task, read and analysed.

    Parameters
    ----------
    title, name
        Heading, and prefix of the files.
    usual
        Prefix in the names of files given here, where it is not `name`: see `of_task`.
    plan
        Statements made before the data.
    answers
        All effects, the rows of results.csv.
    simulated
        True for simulated observers.
    sample
        Sentences on the sample.
    shown
        Effects, checks and means that are described and tabled; None: those of `answers`.
    data
        The data set; None for the user's own table.
    quality
        Data quality and exclusions; None where only trials, or nobody, can be excluded.
    said
        Further findings in sentences, after those of the effects.
    notices
        Sentences on people and conditions left out, or confounded.
    remarks
        Sentences after the table of effects.
    figures
        Figures, the first one first.
    captions
        Captions of the tables of `answers` by role: EFFECTS, CHECKS, MEANS.
    sheets
        Other tables.
    subsections
        Functions that yield the blocks of further parts with headings of their own.
    advice
        Notices among the methods.
    files
        Files for other software by name: all trials as a table, and scripts.
    observed
        Arguments of the section's function in `focalgradient.report.observers`: trials analysed, and their analysis.
    """

    title: str
    name: str
    plan: Plan
    answers: Answers
    simulated: bool
    sample: Sequence[str] = ()
    shown: Answers | None = None
    data: DataSet | None = None
    quality: Quality | None = None
    said: Sequence[str] = ()
    notices: Sequence[str] = ()
    remarks: Sequence[str] = ()
    figures: Sequence[Drawing] = ()
    captions: Mapping[tuple[str, ...], str] = field(default_factory=dict)
    sheets: Sequence[Sheet] = ()
    subsections: Sequence[Callable[[Output], Iterable[Block]]] = ()
    advice: Sequence[str] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    observed: tuple[Any, ...] = ()
    usual: str = ""

    def of_task(self, task: Task) -> Part:
        """Return the section for a task derived from its own, with files named by that task, as scripts name them."""
        part = replace(self, title=task.title, name=task.name, usual=self.name)
        others = (rf"\b{re.escape(file)}" for file in self.files if self.name not in file)
        named = re.compile("|".join([self.name, *others]).encode())
        files = {
            part.named(file): named.sub(lambda found: part.named(found[0].decode()).encode(), content)
            if file.endswith(".R")
            else content
            for file, content in self.files.items()
        }
        return replace(part, files=files)

    def named(self, file: str) -> str:
        """Return the name of a file, or of a figure: that of `of_task`."""
        if not self.usual:
            return file
        return file.replace(self.usual, self.name) if self.usual in file else f"{self.name}_{file}"

    @property
    def both(self) -> list[tuple[str, Answer]]:
        """Main results with and without exclusions."""
        answers = [*self.answers]
        excludes = bool(self.plan.questions.rules) or any(one.role == WITHOUT for one in answers)
        return both_results(answers, excludes=excludes)

    def findings(self, output: Output) -> Iterator[Block]:
        """Yield the findings: sentences, figures and tables; the latter two are also added to `output`."""
        output = replace(output, named=self.named)
        answers = self.answers.of_roles(*EFFECTS, *CHECKS, *MEANS) if self.shown is None else self.shown
        for answer, text in answers.said(*EFFECTS):
            yield Notice(text) if isinstance(answer.outcome, NotComputed) else Paragraph(text)
        checks = answers.sentences(*CHECKS)
        cautions = [text for text in checks if isinstance(text, Caution)]
        yield from map(Paragraph, [*self.said, *cautions, *self.sample])
        yield from map(Notice, self.notices)
        yield from with_and_without(self.quality, self.both)
        figures = [
            (drawing, output.figure(drawing.name, drawing.draw(simulated=self.simulated), drawing.caption))
            for drawing in self.figures
        ]
        yield from (figure for drawing, figure in figures if not drawing.folded)
        tables = [table for role in self.captions for table in answer_tables(answers, self.captions[role], role)]
        sheets = list(self.sheets)
        if self.quality is not None:
            tables += [exclusions_table(self.both, self.name)] if self.quality.exclusions else []
            sheets += quality_sheets(self.quality, self.usual or self.name)
        shown = [*tables, *output.tables(sheets)]
        yield from shown[:1]
        yield from map(Paragraph, self.remarks)
        for blocks in self.subsections:
            yield from blocks(output)
        further: list[Block] = [Paragraph(text) for text in checks if text not in cautions]
        further += [figure for drawing, figure in figures if drawing.folded]
        if further or len(shown) > 2:
            yield Details(FURTHER, [*further, *shown[1:]])
        else:
            yield from shown[1:]

    def methods(self, output: Output) -> Iterator[Block]:
        """Yield the methods for a paper."""
        plan, quality, people = self.plan, self.quality, ""
        exclusions = " ".join(plan.exclusions)
        if quality is not None:
            before, model = quality.subjects_before, "computed by a model; no people took part"
            people = f"{many(before, 'simulated observer')} ({model})" if self.simulated else many(before, "subject")
            trials = sum(one.trials for one in quality.exclusions if not one.whole_subject)
            exclusions += (
                f" This left out {many(before - quality.subjects_after, 'subject')} and "
                f"{many(trials, 'single trial')}; the recorded data stay as they were. Results are shown with and "
                "without exclusions."
            )
        sections = plan.sections(people) | {"Exclusions": [exclusions]}
        order = ("Design", "Exclusions", "Primary outcome", "Analysis")
        yield from map(Paragraph, filter(None, chain.from_iterable(sections[heading] for heading in order)))
        yield from output.tables(self._design())
        yield from map(Notice, self.advice)
        yield chosen(plan.questions.choices)

    def _design(self) -> list[Sheet]:
        """Return every setting of the design as a table, with all values if sessions differ."""
        values: dict[str, dict[str, None]] = {}
        for sidecar in {} if self.data is None else self.data.sidecars.values():
            for setting, value in sidecar["Design"].items():
                text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
                values.setdefault(setting, {})[text] = None
        rows = [[setting, "; ".join(text)] for setting, text in values.items()]
        file = f"{self.name}_design.csv"
        return [listed(file, "Design", ["setting", "value"], rows, folded=True)] if self.data else []
