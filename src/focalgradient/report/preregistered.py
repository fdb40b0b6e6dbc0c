"""Document of a preregistration, as returned by `Task.preregistered`."""

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
"""Sample sizes of the power analysis."""

EXPERIMENTS = 2000
"""Number of simulated experiments per sample size."""

WANTED = 0.8
"""Target power for every hypothesis: Cohen's (1988) convention."""


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
        Exclusion rules, with the equivalence bound if the file states it.
    bound
        Equivalence bound; None if not given.
    effects
        Given effects and standard deviations, by the name of their option.
    ordinal
        True to analyse the answers as ordinal.
    seed
        Random seed of the simulations.
    """

    stated: Stated
    bound: float | None = None
    effects: Mapping[str, float] = field(default_factory=dict)
    ordinal: bool = False
    seed: int = 1

    @property
    def used_bound(self) -> float:
        """Equivalence bound: the given one, that of the rules, or the default."""
        return next((one for one in (self.bound, self.stated.bound) if one is not None), BOUND)


@dataclass(frozen=True, slots=True)
class Preregistered:
    """Contents of a preregistration, in the order of its headings.

    Parameters
    ----------
    title
        Page title.
    hypotheses, outcome, shown, exclusions, analysis
        Hypotheses, primary outcome, design, exclusions and analysis, in sentences.
    rules, rules_file
        Exclusion rules as a table, and as a file for `report --rules`; empty without rules.
    subjects, power
        Number of subjects with its justification, and the power table behind it.
    neutral, stopping, failed
        Sections of a Registered Report: outcome-neutral tests, stopping rule, and procedure if assumptions fail.
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


AFTERWARDS = ("Results are shown with and without exclusions; the file rules.toml holds the rules.",)


def rules_table(stated: Stated, names: list[str]) -> Table:
    """Return a table of the applicable rules, with the numbers on which they depend."""
    rows = []
    needed = {"lapse_factor": "lapses", "catch_factor": "catch_passed", "catch_share": "catch_passed"}
    for name in names:
        if needed.get(name, name) in names:
            value = getattr(stated.rules, name)
            rows.append([name, "none" if value is None else str(value), MEANING[name].split("; false")[0]])
    return Table("Rules", ["rule", "value", "meaning"], rows)


def enough(powers: Mapping[int, Mapping[str, float]], assumed: str) -> str:
    """Return the smallest sample size with sufficient power for each hypothesis, and the assumptions."""
    subjects = next((number for number, found in powers.items() if min(found.values()) >= WANTED), None)
    number = (
        f"{subjects} subjects are the fewest of those tried with a power of {WANTED:.0%} or more for each hypothesis"
        if subjects
        else f"None of the numbers tried reaches a power of {WANTED:.0%} for each hypothesis"
    )
    return f"{number}, {assumed} These are assumptions: state your own effect."


def power_table(powers: Mapping[int, Mapping[str, float]], tests: Mapping[str, str]) -> Table:
    """Return the power of each test by number of subjects."""
    there = [test for test in tests if test in next(iter(powers.values()))]
    rows = [[str(subjects), *(f"{found[test]:.0%}" for test in there)] for subjects, found in powers.items()]
    header = ["subjects", *(tests[test] for test in there)]
    return Table("Share of simulated experiments that find", header, rows)
