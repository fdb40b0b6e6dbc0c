"""The text of a preregistration: what `Task.preregistered` returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from focalgradient.report.document import Block, Heading, Paragraph, Table
from focalgradient.report.parts import BOUND
from focalgradient.report.rules import MEANING, Stated

__all__ = [
    "AFTERWARDS",
    "EXPERIMENTS",
    "STOPPING",
    "SUBJECTS",
    "Planned",
    "Preregistered",
    "enough",
    "power_table",
    "rules_table",
]

SUBJECTS = (6, 8, 10, 12, 16, 20, 24, 30, 40)
EXPERIMENTS = 2000
WANTED = 0.8
"""Power that the number of subjects is to reach, for all of the hypotheses: Cohen's (1988) convention."""


STOPPING = (
    "Data are collected until the stated number of subjects is in the analysis, after exclusions; no test is made "
    "before. For looks in between, state their number and bounds in advance: focalgradient power gives them with "
    "their error rates."
)


@dataclass(frozen=True, slots=True)
class Planned:
    """Settings of a preregistration.

    Parameters
    ----------
    stated
        Rules of exclusion, and the bound of equivalence where the file states it.
    bound
        Of equivalence; None where none was given.
    effects
        Effects and standard deviations that were given, by the name of their option.
    ordinal
        Whether answers are to be taken for steps.
    seed
        Of the simulations.
    """

    stated: Stated
    bound: float | None = None
    effects: Mapping[str, float] = field(default_factory=dict)
    ordinal: bool = False
    seed: int = 1

    @property
    def used_bound(self) -> float:
        """The bound of equivalence: the given one, that of the rules, or the default."""
        return next((one for one in (self.bound, self.stated.bound) if one is not None), BOUND)


@dataclass(frozen=True, slots=True)
class Preregistered:
    """What a preregistration states, in the order of its headings.

    Parameters
    ----------
    title
        Of the page.
    hypotheses, outcome, shown, exclusions, analysis
        Hypotheses, primary outcome, design, exclusions and analysis, in sentences.
    rules, rules_file
        The rules of exclusion as a table, and as a file that `report --rules` reads; empty without rules.
    subjects, power
        Number of subjects with its reason, and the power that gives it.
    neutral, stopping, failed
        Of a Registered Report: outcome-neutral tests, stopping rule, and what is done where assumptions fail.
    """

    title: str
    hypotheses: list[str]
    outcome: str
    shown: str
    exclusions: list[str]
    rules: Table | None
    analysis: list[str]
    subjects: str
    power: Table | None
    neutral: list[str]
    failed: list[str]
    stopping: str = STOPPING
    rules_file: str = ""

    def blocks(self) -> list[Block]:
        tables = [[table] if table else [] for table in (self.rules, self.power)]
        return [
            Heading("Hypotheses"),
            *map(Paragraph, self.hypotheses),
            Heading("Primary outcome"),
            Paragraph(self.outcome),
            Heading("Design"),
            Paragraph(self.shown),
            Heading("Exclusions"),
            *map(Paragraph, self.exclusions),
            *tables[0],
            Heading("Analysis"),
            Paragraph("In the words in which the report will describe it:"),
            *map(Paragraph, self.analysis),
            Heading("Number of subjects"),
            Paragraph(self.subjects),
            *tables[1],
            Heading("Registered Report"),
            Heading("Outcome-neutral tests", 3),
            Paragraph("They show that the data can answer the question, whatever the answer; they look at no effect."),
            *map(Paragraph, self.neutral),
            Heading("Stopping rule", 3),
            Paragraph(self.stopping),
            Heading("Where assumptions fail", 3),
            *map(Paragraph, self.failed),
        ]


AFTERWARDS = ("Results without exclusions stand beside those with them; the file rules.toml holds the rules.",)


def rules_table(stated: Stated, names: list[str]) -> Table:
    """Rules that apply, and those numbers that they need."""
    rows = []
    needed = {"lapse_factor": "lapses", "catch_factor": "catch_passed", "catch_share": "catch_passed"}
    for name in names:
        if needed.get(name, name) in names:
            value = getattr(stated.rules, name)
            rows.append([name, "none" if value is None else str(value), MEANING[name].split("; false")[0]])
    return Table("Rules", ["rule", "value", "meaning"], rows)


def enough(powers: Mapping[int, Mapping[str, float]], assumed: str) -> str:
    """The fewest subjects with enough power for each hypothesis, and what was assumed."""
    subjects = next((number for number, found in powers.items() if min(found.values()) >= WANTED), None)
    number = (
        f"{subjects} subjects are the fewest of those tried with a power of {WANTED:.0%} or more for each hypothesis"
        if subjects
        else f"None of the numbers tried reaches a power of {WANTED:.0%} for each hypothesis"
    )
    return f"{number}, {assumed} These are assumptions: state your own effect."


def power_table(powers: Mapping[int, Mapping[str, float]], tests: Mapping[str, str]) -> Table:
    """Power of each test by number of subjects."""
    there = [test for test in tests if test in next(iter(powers.values()))]
    rows = [[str(subjects), *(f"{found[test]:.0%}" for test in there)] for subjects, found in powers.items()]
    header = ["subjects", *(tests[test] for test in there)]
    return Table("Share of simulated experiments that find", header, rows)
