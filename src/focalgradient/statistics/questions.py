"""Questions of an analysis, and their answers as one table: a row for each effect."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, Literal, NamedTuple, Protocol

import pandas as pd
from numpy.typing import ArrayLike

from focalgradient.statistics.bootstrap import BootstrapT
from focalgradient.statistics.cells import less
from focalgradient.statistics.crossed import crossed_effect, over_subjects
from focalgradient.statistics.exclusions import Quality
from focalgradient.statistics.hypotheses import Equivalence
from focalgradient.statistics.means import family
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.wording import listed

__all__ = [
    "COLUMNS",
    "HERE",
    "NO_ANSWERS",
    "OVER_SCENES",
    "OVER_SUBJECTS",
    "SECONDARY",
    "Analysis",
    "Answer",
    "Answers",
    "Caution",
    "Outcome",
    "Question",
    "Tested",
    "Tests",
    "Way",
    "corrections",
    "in_r",
    "in_two_ways",
    "less",
    "quoted",
    "stated",
]

COLUMNS = (
    *("name", "level", "role", "estimate", "standard_error", "low", "high", "unit", "statistic", "df", "p"),
    *("p_corrected", "effect_size", "effect_low", "effect_high", "n", "method", "reason"),
)
"""Columns of `Answers.frame`."""

HERE = ", these scenes"
"""End of the name of a question that is asked for the scenes shown only."""

SECONDARY = "secondary comparisons"
"""Family of all effects but the primary one and the differences between fixations."""


@dataclass(frozen=True, slots=True, eq=False)
class Tested:
    """Outcome with the values that it was made of, subjects (rows) x scenes (columns), or its number of subjects."""

    outcome: Outcome
    values: pd.DataFrame | None = None
    n: int | None = None


class Estimate(Protocol):
    """Estimate with an interval, as `Interval`, `Equivalence` or `BootstrapT`."""

    @property
    def estimate(self) -> float | None: ...
    @property
    def low(self) -> float | None: ...
    @property
    def high(self) -> float | None: ...


Outcome = Effect | NotComputed | Estimate
Tests = dict[str, Tested | NotComputed]
Role = Literal["primary", "main", "secondary", "check", "description"]


@dataclass(frozen=True, slots=True)
class Question:
    """Question that an analysis asks of its data.

    Parameters
    ----------
    name
        Quantity in question.
    fit
        Function of the data that returns uncorrected outcomes by level, with the values tested where it has them: a
        condition, a pair of conditions, or "" if there is one. None: the data have these outcomes under the name.
    role
        "primary" (of which the first level is the primary outcome, the others are secondary), "main" (tests of equal
        rank), "secondary", "check" or "description".
    unit
        Unit of the estimates.
    family
        Family of tests for Holm's correction; empty for tests that are not corrected. The primary outcome never is.
    headline
        Description of a main result in the unit displayed, with {level} or, for pairs, {pair}; empty for other results.
        ", {level}" is left out if there is one level, "".
    ratio
        True if the effect is a logarithm, displayed as a ratio.
    sentence
        Function of a level and all answers that returns the finding in words; empty text if there is nothing to say, a
        `Caution` if it changes the reading of other findings.
    hypothesis
        Sentences of the preregistration.
    method
        Description of the test for preregistration and report.
    r_code
        R code that prints the same outcomes, run after the head of the analysis' R script; empty if R cannot repeat
        them, as of resampling.
    levels
        Levels known before the data; empty: one, "".
    """

    name: str
    fit: Callable[[Any], Mapping[str, Outcome | Tested]] | None = field(default=None, compare=False)
    role: Role = "secondary"
    unit: str = ""
    family: str = ""
    headline: str = ""
    ratio: bool = False
    sentence: Callable[[str, Answers], str] = field(default=lambda level, answers: "", compare=False)
    hypothesis: tuple[str, ...] = ()
    method: str = ""
    r_code: str = ""
    levels: tuple[str, ...] = ()


class Caution(str):
    """Sentence of a check that changes the reading of the findings, and is shown with them."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Answer:
    """Outcome of a question at one level.

    Parameters
    ----------
    question, level, outcome
        Question, level, and outcome with the corrected p value.
    role
        Role of the question, or the name of the variant of the analysis, as "without exclusions".
    n
        Number of subjects, if the outcome does not state it.
    values
        Values that were tested, subjects (rows) x scenes (columns); None for other outcomes.
    """

    question: Question
    level: str
    outcome: Outcome
    role: str
    n: int | None = None
    values: pd.DataFrame | None = field(default=None, compare=False)

    @property
    def name(self) -> str:
        """Name of the question."""
        return self.question.name

    @property
    def displayed_name(self) -> str:
        """Name in the unit displayed: differences of logarithms are ratios.

        >>> asked = Question("difference of the log odds", lambda table: {}, ratio=True)
        >>> Answer(asked, "", NotComputed("no answers"), "check").displayed_name
        'ratio of the odds'
        """
        ratio = self.question.ratio
        return self.name.replace("log odds", "odds").replace("difference of", "ratio of") if ratio else self.name

    @property
    def headline(self) -> str:
        """Description of the result in the unit displayed; empty if it is not a main result."""
        if not self.level:
            return self.question.headline.replace(", {level}", "")
        pair = self.level.replace(" less ", " to ")
        return self.question.headline.replace("{level}", self.level).replace("{pair}", pair)

    def displayed(self, value: float) -> float:
        """Convert a value to the unit of `headline`."""
        return math.exp(value) if self.question.ratio else value

    def row(self) -> dict[str, Any]:
        """Return the values of `COLUMNS`."""
        found = self.outcome
        row: dict[str, Any] = {"name": self.name, "level": self.level, "role": self.role, "unit": self.question.unit}
        row["n"] = self.n if self.n is not None else getattr(found, "subjects", None)
        if isinstance(found, NotComputed):
            return row | {"reason": found.reason}
        for name in ("estimate", "standard_error", "low", "high", "statistic", "df", "p"):
            row[name] = getattr(found, name, None)
        match found:
            case Effect():
                size = found.d or found.dz_interval
                row |= {"p_corrected": found.p_holm, "method": "; ".join([found.method, *found.remarks])}
                if size is not None:
                    row |= {"effect_size": size.estimate, "effect_low": size.low, "effect_high": size.high}
            case Equivalence():
                row["method"] = f"two one-sided tests, bound {found.bound:.6g}, 90 % interval"
            case BootstrapT():
                row["method"] = "bootstrap-t over subjects"
        return row


def _answer(question: Question, level: str, found: Outcome | Tested, role: str) -> Answer:
    if isinstance(found, Tested):
        return Answer(question, level, found.outcome, role, found.n, found.values)
    return Answer(question, level, found, role)


def in_r(name: str, tables: str, test: str) -> str:
    """Return R code that prints the test of each table of an R list, with question and level.

    >>> print(in_r("depth effect", "effects", "crossed"), end="")
    for (f in names(effects)) show("depth effect", f, crossed(effects[[f]]))
    """
    return f'for (f in names({tables})) show("{name}", f, {test}({tables}[[f]]))\n'


def quoted(text: str) -> str:
    """Quote a text for R."""
    return json.dumps(text, ensure_ascii=False)


def stated(name: str, level: str, outcome: Outcome, role: Role, unit: str = "", n: int | None = None) -> Answer:
    """Return an answer whose outcome is computed outside of an `Analysis`; parameters as in `Question` and `Answer`.

    >>> stated("threshold", "01", NotComputed("no answers"), "description").row()["reason"]
    'no answers'
    """
    return Answer(Question(name, role=role, unit=unit), level, outcome, role, n)


@dataclass(frozen=True, slots=True)
class Answers:
    """Answers of an analysis, in its order."""

    rows: tuple[Answer, ...] = ()

    def __iter__(self) -> Iterator[Answer]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def to(self, name: str) -> dict[str, Any]:
        """Return the outcomes of a question by level; empty if it was not asked."""
        return {row.level: row.outcome for row in self.rows if row.name == name}

    def pairs(self, name: str, levels: Iterable[str]) -> dict[tuple[str, str], Any]:
        """Return the outcomes of a question about pairs of levels, by pair; empty if it was not asked."""
        found = self.to(name)
        return {pair: found[less(*pair)] for pair in combinations(levels, 2) if found}

    @property
    def r_code(self) -> str:
        """R code of all questions that were asked."""
        return "".join(dict.fromkeys(row.question.r_code for row in self.rows))

    def said(self, *roles: str) -> Iterator[tuple[Answer, str]]:
        """Yield the answers of some roles that have a finding, with the finding in words."""
        for row in self.rows:
            if row.role in roles and (text := row.question.sentence(row.level, self)):
                is_first = row.role == "primary" and not isinstance(text, Caution)
                yield row, f"Primary outcome. {text}" if is_first else text

    def sentences(self, *roles: str) -> list[str]:
        """Return the findings of some roles in words, in the order of the questions."""
        return [text for _, text in self.said(*roles)]

    def of_roles(self, *roles: str) -> Answers:
        """Return the answers of some roles."""
        return Answers(tuple(row for row in self.rows if row.role in roles))

    @property
    def primary(self) -> tuple[Answer, ...]:
        """Answers to the primary question, the primary outcome first."""
        return tuple(row for row in self.rows if row.question.role == "primary")

    @property
    def headlines(self) -> tuple[Answer, ...]:
        """Main results."""
        return tuple(row for row in self.rows if row.headline)

    def variant(self, role: str) -> Answers:
        """Return the main results under the name of a variant of the analysis."""
        return Answers(tuple(replace(row, role=role) for row in self.headlines))

    def frame(self) -> pd.DataFrame:
        """Return a row for each effect, with the columns `COLUMNS`; empty cells where a value does not apply."""
        return pd.DataFrame([row.row() for row in self.rows], columns=list(COLUMNS))


Values = Callable[[Any], Mapping[str, pd.DataFrame | NotComputed]]
"""Function of the data that returns the values of each level, or the reason why there are none."""


class Way(NamedTuple):
    """Test of values: its function, its name in R, and the end of a question's name where another test decides."""

    test: Callable[[ArrayLike], Effect | NotComputed]
    in_r: str
    end: str

    def fit(self, values: Values) -> Callable[[Any], Tests]:
        """Return the fit of a question that tests values by level."""
        return lambda data: {
            level: found if isinstance(found, NotComputed) else Tested(self.test(found), found)
            for level, found in values(data).items()
        }


OVER_SCENES = Way(crossed_effect, "crossed", ", subjects and scenes")
OVER_SUBJECTS = Way(over_subjects, "over_subjects", HERE)


def in_two_ways(
    decides: Way,
    values: Values,
    tables: str,
    question: Question,
    sentence: Callable[[str, Answers], str] = lambda level, answers: "",
) -> tuple[Question, Question]:
    """Return a question about values by the test that decides, and by the other as a check.

    Parameters
    ----------
    decides
        `OVER_SCENES` or `OVER_SUBJECTS`.
    values
        Values by level, whose test replaces the fit of the question.
    tables
        Name of the R list of the values; empty without R code.
    question, sentence
        Question, with the R code that makes the list, and the finding of the check in words.

    >>> asked = Question("rise", lambda data: {}, "primary")
    >>> [one.name for one in in_two_ways(OVER_SCENES, lambda data: {}, "rises", asked)]
    ['rise', 'rise, these scenes']
    """
    other = OVER_SUBJECTS if decides is OVER_SCENES else OVER_SCENES
    name, fit = question.name + other.end, other.fit(values)
    own, beside = (
        in_r(of, tables, way.in_r) if tables else "" for of, way in ((question.name, decides), (name, other))
    )
    check = Question(name, fit, "check", question.unit, ratio=question.ratio, sentence=sentence, r_code=beside)
    return replace(question, fit=decides.fit(values), r_code=question.r_code + own), check


def corrections(secondary: Iterable[str], differences: int) -> str:
    """Describe which p values are corrected.

    Parameters
    ----------
    secondary
        Kinds of secondary comparisons, which are one family.
    differences
        Number of differences of effects.

    Examples
    --------
    >>> corrections(["the slopes"], 0)[:90]
    'The p of the primary outcome is not corrected. Secondary comparisons are one family by Hol'
    """
    text = "The p of the primary outcome is not corrected"
    if differences == 1:
        text += ", nor is that of the difference"
    elif differences:
        text += "; the differences are one family by Holm’s method"
    if kinds := listed(secondary, nothing=""):
        text += f". Secondary comparisons are one family by Holm’s method: {kinds}"
    return f"{text}. Tests are at .05, and two-sided except those of equivalence."


NO_ANSWERS = Answers()
"""Answers of an analysis that asks nothing."""


Kind = Literal["conditions", "ratings", "cube", "thresholds", "detection"]
Exclusions = Callable[[Any], tuple[Any, Quality]]
"""Application of exclusion rules to a table."""


@dataclass(frozen=True, slots=True)
class Analysis:
    """List of questions, asked of the same data.

    Parameters
    ----------
    questions
        Questions.
    outcome
        Description of the primary outcome.
    before, after
        Description of the answers before the methods of the questions, and of corrections and intervals after them.
    prepare
        Function of a table of trials that returns what the questions are asked of.
    exclusions
        Function of a table that applies the exclusion rules: it returns the table kept, and the data quality.
    kind
        Kind of data that the questions are about, by which figures and models of simulated people are chosen.
    rules
        Fields of `focalgradient.statistics.Rules` that the analysis goes by, and "bound" where it does so.
    choices
        Methodological choices to be explained: keys of `focalgradient.report.choices`.
    estimates
        Quantity estimated where no hypothesis is tested.
    also
        Further analyses of the same table, with preparations and families of their own.

    Examples
    --------
    >>> from focalgradient.statistics.means import paired_effect
    >>> analysis = Analysis([
    ...     Question("rise", lambda table: {"a": paired_effect(table["a"], "paired t")}, "primary"),
    ...     Question("fall", lambda table: {name: paired_effect(table[name], "paired t") for name in "ab"}, family="x"),
    ... ])
    >>> found = analysis.answers(pd.DataFrame({"a": [0.1, 0.4, 0.2, 0.3], "b": [0.2, 0.1, -0.1, 0.3]}))
    >>> found.frame()[["level", "role", "estimate", "p_corrected"]].round(3).values.tolist()
    [['a', 'primary', 0.25, nan], ['a', 'secondary', 0.25, 0.061], ['b', 'secondary', 0.125, 0.239]]
    """

    questions: Sequence[Question]
    outcome: str = ""
    before: str = ""
    after: str = ""
    prepare: Callable[[Any], Any] = lambda table: table
    exclusions: Exclusions | None = None
    kind: Kind = "conditions"
    rules: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    estimates: str = "means"
    also: Sequence[Analysis] = ()

    @property
    def every(self) -> list[Question]:
        """All questions, those of `also` last."""
        return [*self.questions, *(question for other in self.also for question in other.every)]

    @property
    def hypotheses(self) -> list[str]:
        """Numbered hypotheses of all questions, the primary one first; a sentence that says so if there is none."""
        sentences = [sentence for question in self.every for sentence in question.hypothesis]
        if not sentences:
            return [f"No hypothesis is tested: {self.estimates} are estimated, with their intervals."]
        return [f"H{place}{' (primary)' * (place == 1)}. {text}" for place, text in enumerate(sentences, start=1)]

    @property
    def method(self) -> str:
        """Description of the analysis for a paper."""
        methods = [question.method for question in self.questions]
        return " ".join(filter(None, [self.before, *methods, self.after]))

    def excluded(self, table: Any) -> tuple[Any, Quality | None]:
        """Apply the exclusion rules; return the table kept and the data quality, None without rules."""
        return (table, None) if self.exclusions is None else self.exclusions(table)

    def asked(self, table: Any, *, everyone: bool = False) -> Answers:
        """Return the answers of a table, with exclusions before and corrections within families after.

        Parameters
        ----------
        table
            Table of trials.
        everyone
            True to exclude nothing.
        """
        kept = table if everyone else self.excluded(table)[0]
        return Answers((*self.answers(self.prepare(kept)), *self.asked_also(kept)))

    def asked_also(self, kept: Any) -> Answers:
        """Return the answers to the questions of `also` alone, of a table after exclusions."""
        return Answers(tuple(answer for other in self.also for answer in other.asked(kept)))

    def answers(self, data: Any) -> Answers:
        """Return the answers, corrected within families; `data` is what `prepare` returns."""
        asked = self.questions
        rows = [
            _answer(one, level, found, "secondary" if one.role == "primary" and place else one.role)
            for one in asked
            for place, (level, found) in enumerate((one.fit(data) if one.fit else data[one.name]).items())
        ]
        for name in dict.fromkeys(one.family for one in asked if one.family):
            places = [n for n, row in enumerate(rows) if row.question.family == name and row.role != "primary"]
            corrected = family(rows[n].outcome for n in places)  # type: ignore[misc]
            for n, outcome in zip(places, corrected, strict=True):
                rows[n] = replace(rows[n], outcome=outcome)
        return Answers(tuple(rows))
