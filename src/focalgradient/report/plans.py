"""Wording of the analysis of each response scale: hypotheses, primary outcome and tests.

Preregistration and report both take their sentences from here, given the numbers of scenes and fixations, so that they
agree.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, ClassVar

from focalgradient.report.tables import many
from focalgradient.scales import Analysis, Choices, OrdinalSteps, Ratios, Slopes, analysis_named
from focalgradient.statistics.crossed import FEWEST_SCENES
from focalgradient.statistics.tables import FIXATIONS, in_order

__all__ = ["CONFIDENCE_PLAN", "ENOUGH_SUBJECTS", "PLANS", "Plan", "in_focus", "plan_of"]


def in_focus(fixation: str) -> str:
    """Describe the object in focus.

    >>> in_focus("nearest"), in_focus("tree")
    ('the nearest object in focus', '“tree” in focus')
    """
    return f"the {fixation} object in focus" if fixation in FIXATIONS else f"“{fixation}” in focus"


def _and(things: Sequence[str]) -> str:
    *first, last = things
    return f"{', '.join(first)} and {last}" if first else last


@dataclass(frozen=True, slots=True)
class Plan(ABC):
    """Analysis plan of depth ratings on one response scale.

    Parameters
    ----------
    fixations
        Objects in focus, in the order of the report; the first is that of the primary outcome.
    scenes
        Number of scenes.
    bound
        Equivalence bound, a ratio.
    reference
        Reference picture of paired comparisons.
    steps
        Number of scale steps, if any and known.
    statistic
        Analysis of the answers.
    """

    fixations: tuple[str, ...]
    scenes: int
    bound: float
    reference: str
    steps: int | None
    statistic: Analysis

    @property
    def random(self) -> bool:
        """True if there are enough scenes to treat them as random."""
        return self.scenes >= FEWEST_SCENES

    @property
    def _steps(self) -> str:
        return "steps" if self.steps is None else many(self.steps, "step")

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Pairs of fixations that are compared."""
        return list(combinations(self.fixations, 2))

    def _corrections(self, others: str, *further: str) -> str:
        """State which p values are corrected; `others` names the effects at the other fixations."""
        secondary = [*([others] if len(self.fixations) > 1 else []), *further]
        text = "The p of the primary outcome is not corrected"
        if len(self.pairs) == 1:
            text += ", nor is that of the difference"
        elif self.pairs:
            text += "; the differences are one family by Holm’s method"
        if secondary:
            text += f". Secondary comparisons are one family by Holm’s method: {_and(secondary)}"
        return f"{text}. Tests are at .05, and two-sided except those of equivalence."

    @property
    @abstractmethod
    def outcome(self) -> str:
        """Primary outcome, in one sentence."""

    @property
    @abstractmethod
    def hypotheses(self) -> list[str]:
        """Hypotheses, the primary one first, each with its test."""

    @property
    @abstractmethod
    def analysis(self) -> str:
        """Description of the analysis for a paper."""

    def _numbered(self, sentences: list[str]) -> list[str]:
        return [
            f"H{number}{' (primary)' if number == 1 else ''}. {text}" for number, text in enumerate(sentences, start=1)
        ]

    def _changes(self, what: str, *others: str, until: str = "with the aperture") -> list[str]:
        """Return hypotheses that something changes with the first object in focus, and differs with each other one."""
        first = in_focus(self.fixations[0])
        rows = [f"With {first}, {what} {until}; a rise is expected (two-sided test).", *others]
        rows += [
            f"That change differs between {first} and {in_focus(other)}; a larger rise with the former is expected "
            "(two-sided test)."
            for other in (self.fixations[1:] if self.pairs else ())
        ]
        return self._numbered(rows)


ENOUGH_SUBJECTS = 60
"""Number of subjects from which Student's t rejects at most .06 at a level of .05 where 20 % of subjects have an effect
and the others none (benchmarks/statistics_error_rates.py --tables enough).
"""

CONFIDENCE_PLAN = (
    "Confidence was asked after each answer. Whether it changes with the aperture is tested by its least-squares slope "
    "on aperture diameter within subject and scene, over subjects and scenes; its p is not corrected, and it decides "
    "nothing."
)
"""Analysis of confidence, for a paper."""

BOOTSTRAP = (
    "As a sensitivity analysis, which decides nothing, the primary effect is also tested by the bootstrap-t over "
    "subjects, for these scenes (Hall, 1988; 9,999 resamples, equal-tailed); the report states whether it disagrees. "
    "Normality of the subject means and of the residuals is checked by the Shapiro-Wilk test at .05 and by Q-Q plots; "
    "where it fails, the report states it. Few skewed subjects mislead every test: where one subject in five shows an "
    f"effect, {ENOUGH_SUBJECTS} subjects are needed for Student’s t to keep its level."
)
"""Treatment of skewed subjects for ratios, for a paper."""


class RatioPlan(Plan):
    """Plan for ratings as ratios to a standard."""

    __slots__ = ()

    @property
    def outcome(self) -> str:
        return (
            "The primary outcome is the depth effect: the log ratio of the rating at the largest aperture to that at "
            f"the pinhole with {in_focus(self.fixations[0])}, one value for each subject and scene, averaged over "
            "repetitions."
        )

    @property
    def hypotheses(self) -> list[str]:
        equal = [
            f"With {in_focus(other)}, that change is equivalent to zero: within a factor of {self.bound:g}, the "
            "smallest depth effect that would matter."
            for other in self.fixations[1:]
        ]
        return self._changes("ratings of depth change", *equal, until="from the pinhole to the largest aperture")

    @property
    def analysis(self) -> str:
        if self.random:
            test = (
                "with subjects and scenes crossed as random effects, log_ratio ~ 1 + (1 | participant_id) + "
                "(1 | scene): variance from the mean squares of subjects, scenes and residuals, with a nonnegative "
                "scene component, Student’s t with Satterthwaite’s degrees of freedom (the quasi-F of Clark, 1973; "
                "tables with empty cells by REML). A t-test of the subject means, for these scenes only, is also "
                "reported"
            )
        else:
            test = (
                f"by Student’s t over the subject means, with N − 1 degrees of freedom, for these scenes "
                f"only: fewer than {FEWEST_SCENES} scenes give too little information on how scenes differ"
            )
        differences = {
            0: "",
            1: " The difference of the two depth effects was tested in the same way.",
        }.get(len(self.pairs), " The pairwise differences of the depth effects were tested in the same way.")
        corrections = self._corrections(
            "the other depth effects",
            "the comparisons of intermediate apertures with the pinhole",
            "the slopes",
        )
        return (
            "Ratings were analysed on their logarithm and are reported as ratios; means are geometric. The mean depth "
            f"effect was tested {test}.{differences} {BOOTSTRAP} Equivalence to zero was tested by two one-sided tests "
            f"by Student’s t at .05 (Schuirmann, 1987) against a factor of {self.bound:.3g}, the smallest depth effect "
            "that would matter; a change that is both significant and equivalent to zero is reported as both. As a "
            "trend, the least-squares slope of the log rating on aperture diameter was tested likewise. "
            f"{corrections} Intervals of ratios are 95 % intervals by Student’s t "
            "on the logarithm, not adjusted for multiple tests; those of ratings are within subjects (Cousineau, "
            "Morey). Effect sizes of tests over subjects and scenes are d of Westfall, Kenny and Judd (2014): the mean "
            "divided by the root of the summed variance components. Their intervals are by the noncentral t of the "
            "test (Steiger and Fouladi, 1997)."
        )


class StepsPlan(Plan):
    """Plan for ordinal ratings."""

    __slots__ = ()

    @property
    def outcome(self) -> str:
        return (
            "The primary outcome is the slope on the aperture: the log odds of a higher answer at the largest aperture "
            f"against the pinhole, with {in_focus(self.fixations[0])}."
        )

    @property
    def hypotheses(self) -> list[str]:
        return self._changes("the odds of a higher answer change")

    @property
    def analysis(self) -> str:
        each = " for each fixation" if self.pairs else ""
        fixed = _and([*(["fixation"] if self.pairs else []), *(["scenes"] if self.scenes > 1 else [])] or ["none"])
        slopes = "slopes and of their difference" if self.pairs else "slope"
        if self.random:
            test = (
                f" The contribution of random scenes was added to the variance of the {slopes}: Cochran’s Q of the "
                "slopes within scenes, one Newton step from the fit, divided by its degrees of freedom, minus 1. The "
                "tests use Student’s t with Satterthwaite’s degrees of freedom; tests for these scenes "
                "alone, by Student’s t with N − 1 degrees of freedom, are also reported."
            )
        else:
            test = (
                f" {'The slopes and their differences were' if self.pairs else 'The slope was'} tested by Student’s t "
                f"with N − 1 degrees of freedom, for these scenes only: fewer than {FEWEST_SCENES} scenes give too "
                "little information on how scenes differ."
            )
        return (
            f"Answers were {self._steps} of an ordinal scale. One cumulative-link mixed model (logit) with a slope on "
            f"aperture diameter{each}, {fixed} as fixed effects, and random intercepts and slopes of the "
            f"subjects was fitted by adaptive Gauss-Hermite quadrature.{test} {self._corrections('the other slopes')}"
        )


class _Comparison(Plan):
    """Plan for paired comparisons or visual-analogue ratings."""

    __slots__ = ()

    statistic: Slopes | Choices
    generalises: ClassVar[bool] = True
    """True if the test decides over subjects and scenes, where there are enough of them."""

    @property
    def _tested(self) -> str:
        if self.random and self.generalises:
            return (
                "with subjects and scenes as crossed random factors (quasi-F of Clark, 1973, Satterthwaite’s degrees "
                "of freedom; tables with empty cells by REML)"
            )
        return "by Student’s t over subjects, with N − 1 degrees of freedom"

    @property
    def _largest(self) -> str:
        generalises = self.random and self.generalises
        over = "with both as crossed random factors" if generalises else "by Student’s t with N − 1 degrees of freedom"
        here = (
            " Such tests for these scenes alone, by Student’s t with N − 1 degrees of freedom, are also reported."
            if generalises
            else " Results are for these scenes; tests with subjects and scenes as crossed random factors are also "
            "reported."
            if self.random
            else f" Results are for these scenes only: fewer than {FEWEST_SCENES} scenes give too little information "
            "on how scenes differ."
        )
        if self.statistic.alike is None:
            return f"{self._corrections('the other slopes')}{here}"
        return (
            f"The {self.statistic.mean.removesuffix(' of choices')}s of subjects and scenes at the largest aperture "
            f"were compared with those of identical pictures {over}. "
            f"{self._corrections('the other slopes', 'the comparisons at the largest aperture')}{here}"
        )


class SlopesPlan(_Comparison):
    """Plan for signed steps relative to another picture, or visual-analogue ratings."""

    __slots__ = ()

    statistic: Slopes

    @property
    def _answer(self) -> str:
        """Noun for one answer: "step" or "place"."""
        return self.statistic.mean.removeprefix("mean ")

    @property
    def outcome(self) -> str:
        return (
            f"The primary outcome is the slope of the {self._answer} on aperture diameter "
            f"({self.statistic.unit} per millimetre) with {in_focus(self.fixations[0])}, one value for each subject "
            "and scene."
        )

    @property
    def hypotheses(self) -> list[str]:
        return self._changes(f"the {self.statistic.mean} changes")

    @property
    def analysis(self) -> str:
        slopes = "slopes and their difference between the fixations were" if self.pairs else "slope was"
        compared = ""
        if self.statistic.compared:
            compared = f"Pictures were compared with {self.reference} in {self._steps} {self.statistic.compared}. "
        return (
            f"{compared}A straight line on aperture diameter was fitted to the {self._answer}s of each "
            f"subject and scene; its {slopes} tested {self._tested}. {self._largest}"
        )


class ChoicePlan(_Comparison):
    """Plan for choices of the deeper of two pictures."""

    __slots__ = ()

    statistic: Choices
    generalises = False

    @property
    def outcome(self) -> str:
        return (
            "The primary outcome is the slope of the proportion of choices of the picture on its aperture diameter, "
            f"with {in_focus(self.fixations[0])}, one value for each subject and scene."
        )

    @property
    def hypotheses(self) -> list[str]:
        return self._changes("the proportion of choices changes")

    @property
    def analysis(self) -> str:
        return (
            f"In each trial a picture and {self.reference} were shown in random order, and the one that looked deeper "
            "was chosen. A straight line on aperture diameter was fitted to the choices (0 or 1) of each "
            f"subject and scene; its slope was tested {self._tested}. {self._largest}"
        )

    @property
    def pairs(self) -> list[tuple[str, str]]:
        return []


PLANS: dict[type[Analysis], type[Plan]] = {
    Ratios: RatioPlan,
    OrdinalSteps: StepsPlan,
    Slopes: SlopesPlan,
    Choices: ChoicePlan,
}
"""Plan class of each analysis."""


REFERENCES = {
    "standard": "the standard, a pinhole picture of another scene,",
    "same-scene": "the pinhole picture of the same scene",
}
"""Description of the reference picture, by the design setting `reference`."""


def plan_of(
    analysis: Analysis | str,
    fixations: Collection[str],
    scenes: int,
    design: Mapping[str, Any] | None = None,
    bound: float = 1.2,
) -> Plan:
    """Return the plan of an analysis (or its name) for a design or table.

    Examples
    --------
    >>> plan_of("ordinal", {"farthest", "nearest"}, 1, {"steps": 5}).outcome[-28:]
    'the nearest object in focus.'
    """
    design = design or {}
    steps = int(design["steps"]) if "steps" in design else None
    reference = REFERENCES[str(design.get("reference", "standard"))]
    statistic = analysis_named(analysis)
    return PLANS[type(statistic)](in_order(fixations), scenes, bound, reference, steps, statistic)
