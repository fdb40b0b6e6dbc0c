"""Section of the report on robustness: dependence of the ratings' results on analysis choices and single people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from focalgradient.plotting.robustness import robustness_figure
from focalgradient.report.analysed import Ratings
from focalgradient.report.document import Block, Paragraph
from focalgradient.report.exclusions import NAMES
from focalgradient.report.parts import Output
from focalgradient.report.plans import in_focus
from focalgradient.report.tables import SPACE, Sheet, number, probability
from focalgradient.scales import Analysis, Choices, Slopes
from focalgradient.scales.analyses import LOGARITHM, RANKS
from focalgradient.statistics import as_table
from focalgradient.statistics.robustness import ALL_RULES, NO_RULES, Variant, most_influential, robustness

__all__ = ["robustness_part", "robustness_plan"]

RULES = {ALL_RULES: "all rules", NO_RULES: "no rules", **{name: f"not: {text}" for name, text in NAMES.items()}}

CAPTION = (
    "Robustness, {focus}: the effect under each choice, sorted, with 95 % intervals (none where too few subjects leave "
    "it without ends), by what was done with the answers: of the logarithm the ratio, else the difference{slope}. "
    "Right: the main analysis without each subject. Filled: p below .05; orange: the main analysis. Squares below: the "
    "rules of exclusion and the test. Of sets of rules that leave the same data one is drawn."
)


def robustness_plan(analysis: Analysis) -> str:
    """Describe the variants, identically in preregistration and report.

    >>> from focalgradient.scales import Choices
    >>> "Answers are taken as given" in robustness_plan(Choices())
    True
    """
    taken = ", ".join(map(_as, analysis.transformations))
    other = " The model of steps is not fitted again: mean steps are compared." if analysis.latent else ""
    return (
        "Robustness. The analysis is repeated with each exclusion rule left out and with none of them, by Student’s t "
        f"and sign flips over subjects, and without each subject. Answers are taken "
        f"{taken}.{other} These variants are described, each with its own uncorrected p; they decide nothing."
    )


def robustness_part(part: Ratings, output: Output) -> Iterator[Block]:
    """Yield sentences, table and figure on how results depend on rules, transformation, test and single people."""
    variants = robustness(part.table, part.quality.rules, part.analysis)
    digits = as_table(variants).assign(significant=[each.significant for each in variants])
    output.tables([Sheet("robustness.csv", None, digits)])
    computed = [each for each in variants if each.estimate is not None]
    if not computed:
        return
    names = [*dict.fromkeys(each.fixation for each in computed)]
    sentences = [_sentence([each for each in variants if each.fixation == name], part.analysis) for name in names]
    first, *others = filter(None, sentences)
    yield Paragraph(" ".join([f"Robustness. {first}", *others]))
    slope = " per millimetre of aperture" if isinstance(part.analysis, Slopes | Choices) else ""
    own = [each for each in variants if each.fixation == names[0]]
    figure = robustness_figure(own, RULES, simulated=part.simulated)
    yield output.figure("robustness", figure, CAPTION.format(focus=in_focus(names[0]), slope=slope))


def _sentence(variants: Sequence[Variant], analysis: Analysis) -> str:
    """Describe the range of effects at one fixation, the number of reliable variants, and the most influential one."""
    used = [each for each in variants if each.distinct and each.estimate is not None and not each.without]
    main = [each for each in used if each.transformation == analysis.transformations[0]]
    if not main:
        return ""
    slopes = isinstance(analysis, Slopes | Choices)
    what = "the slope" if slopes else "the difference of mean steps" if analysis.latent else "the depth effect"
    estimates = sorted(each.estimate or 0.0 for each in main)
    low, high = (_shown(each, main[0]) for each in (estimates[0], estimates[-1]))
    reach = f"is {low}" if low == high else f"is {low} to {high}"
    text = (
        f"With {in_focus(main[0].fixation)}, {what} {reach} over {len(main)} variants with the answers "
        f"{_as(main[0].transformation)}; of all {len(used)} variants of rules, transformation and test "
        f"{sum(each.significant for each in used)} are reliable (p{SPACE}<{SPACE}.05, uncorrected)."
    )
    person = most_influential(variants, main[0].fixation)
    if person is None:
        return text
    changed = f"{_shown(person.estimate or 0.0, person)} (p {_equal(probability(person.p))})"
    return f"{text} Leaving out {person.without} changes it most, to {changed}."


def _as(transformation: str) -> str:
    return {LOGARITHM: "on their logarithm", RANKS: "as each subject’s ranks"}.get(transformation, transformation)


def _shown(value: float, variant: Variant) -> str:
    return number(math.exp(value) if variant.transformation == LOGARITHM else value)


def _equal(p: str) -> str:
    return p if p.startswith("<") else f"= {p}"
