"""Paragraph of the report on robustness: how far results of ratings depend on each exclusion rule."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from focalgradient.report.document import Block, Paragraph
from focalgradient.report.exclusions import NAMES
from focalgradient.report.parts import Output
from focalgradient.report.tables import Sheet
from focalgradient.scales import Analysis, Choices, Slopes
from focalgradient.statistics import ComparisonResult, DepthRatingResult, NotComputed, as_table
from focalgradient.statistics.questions import Answer
from focalgradient.statistics.robustness import ALL_RULES, Variant
from focalgradient.statistics.wording import in_focus, number, p_is

__all__ = ["ROBUSTNESS_PLAN", "robustness_part", "variant_answers"]

ROBUSTNESS_PLAN = (
    "Robustness. The analysis is repeated with each exclusion rule left out. These variants share their data; each has "
    "its own uncorrected p, and none decides."
)


def robustness_part(variants: Sequence[Variant], analysis: Analysis, output: Output) -> Iterator[Block]:
    """Yield a sentence for each rule that changes the data; all variants are in robustness.csv."""
    if not variants:
        return
    output.tables([Sheet("robustness.csv", None, as_table(variants))])
    sentences = [
        sentence
        for fixation in dict.fromkeys(variant.fixation for variant in variants)
        if (sentence := _sentence([variant for variant in variants if variant.fixation == fixation], analysis))
    ]
    if sentences:
        yield Paragraph(" ".join(["Robustness.", *sentences]))


def variant_answers(
    variants: Iterable[Variant], main: DepthRatingResult | ComparisonResult | NotComputed
) -> Iterator[Answer]:
    """Yield the primary question's answer without each exclusion rule."""
    if isinstance(main, NotComputed):
        return
    question = main.answers.primary[0].question
    for one in variants:
        if one.rules != ALL_RULES:
            outcome = NotComputed(one.reason) if one.estimate is None else one
            yield Answer(question, one.fixation, outcome, f"without the rule {one.rules}", one.subjects)


def _sentence(variants: Sequence[Variant], analysis: Analysis) -> str:
    """Describe the effect at one fixation without each rule that excludes data; empty if none does."""
    slopes = isinstance(analysis, Slopes | Choices)
    what = "the slope" if slopes else "the odds ratio" if analysis.latent else "the depth effect"
    parts = []
    for variant in variants:
        if variant.rules != ALL_RULES and variant.distinct and variant.estimate is not None:
            value = number(variant.estimate if slopes else math.exp(variant.estimate))
            parts.append(f"{value} without the rule “{NAMES[variant.rules]}” (p {p_is(variant.p)})")
    return f"With {in_focus(variants[0].fixation)}, {what} is {', '.join(parts)}." if parts else ""
