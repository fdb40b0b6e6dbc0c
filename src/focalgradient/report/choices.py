"""Rationale of the analysis: one paragraph per methodological choice, linked from the methods."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from focalgradient.report.document import Anchored, Block, Details, Links

__all__ = ["chosen", "explained"]

CHOICES = {
    "exclusions": (
        "Exclusions",
        "Exclusion rules depend on catch trials, repeated answers, response times and dropped frames, never on the "
        "effect of blur, so that they cannot select for it (Simmons, Nelson and Simonsohn, 2011). They should be "
        "stated before the data are seen; results with and without them are both reported. In full: "
        "docs/statistics.md, “Exclusion criteria”.",
    ),
    "random": (
        "Subjects and scenes as random",
        "Results should generalise to other people and other scenes. A test over subjects alone treats these scenes "
        "as all scenes, and has an inflated error rate if scenes differ (Clark, 1973; Judd, Westfall and Kenny, 2012). "
        "Fewer than five scenes give too little information on how they differ: results then apply to these scenes, as "
        "is stated. In full: docs/statistics.md, “Depth ratings”.",
    ),
    "logarithm": (
        "Logarithm",
        "Ratings are ratios to a standard. On the logarithm, twice and half as deep are equally far from the standard, "
        "and the scatter of magnitude estimates, which is proportional to their size, becomes homogeneous. In full: "
        "docs/statistics.md, “Depth ratings”.",
    ),
    "equivalence": (
        "Equivalence",
        "A test that is not significant does not show that there is no effect. The depth effect is called equivalent "
        "to zero only if two one-sided tests (Schuirmann, 1987) exclude both a rise and a fall that would matter, by "
        "the bound stated in advance. In full: docs/statistics.md, “Depth ratings”.",
    ),
    "ordinal": (
        "Cumulative-link model",
        "Steps are ordered but have no distances: mean steps depend on how people use them, and can reverse an effect "
        "(Liddell and Kruschke, 2018). The model places thresholds between the steps on one latent scale. In full: "
        "docs/statistics.md, “Depth ratings”.",
    ),
    "slopes": (
        "Slope within each subject",
        "A straight line through all apertures uses every answer, and a single value per subject and scene makes "
        "subjects the units of the test. In full: docs/statistics.md, “Depth ratings”.",
    ),
    "choice": (
        "Slope of the share of choices",
        "A straight line through the choices of each subject and scene gives a single value, so that subjects are the "
        "units of the test. With few subjects, Wald’s test of a marginal logistic model (GEE) rejects too many true "
        "null hypotheses, or finds fewer effects. The test over subjects and scenes is reported as well. "
        "Slopes are not compared between fixations: a share ends at 0 and at 1. "
        "In full: docs/statistics.md, “Steps and choices”.",
    ),
    "holm": (
        "Holm’s correction",
        "The primary hypothesis is stated in advance and needs no correction. Within a family of secondary comparisons "
        "the probability of any false positive is at most 5 %, with more power than by Bonferroni’s correction (Holm, "
        "1979). In full: docs/statistics.md, “Depth ratings”.",
    ),
    "odds": (
        "Odds of time",
        "The time of the nonrigid reading over that of the rigid one depends neither on how fast a person’s percept "
        "alternates, nor on how long no key is held. On log odds one change has the same size for people who rarely "
        "and who often see the reading, unlike on shares. Durations cut off by the end of a trial enter the fits as "
        "lower limits. In full: docs/statistics.md, “The Necker cube”.",
    ),
    "threshold": (
        "Threshold from its posterior",
        "A psychometric function is fitted with a lapse rate, as lapses would otherwise flatten it (Wichmann and Hill, "
        "2001); the threshold is the median of its posterior. Thresholds vary multiplicatively, so that their mean is "
        "geometric. In full: docs/thresholds.md.",
    ),
    "d-prime": (
        "d′ instead of a proportion",
        "The proportion of correct answers confounds sensitivity with the readiness to say “yes”, which d′ and the "
        "criterion separate; confidence shows whether signal and noise have equal variances, and how well people know "
        "when they are right. In full: docs/thresholds.md, “Yes-no answers, confidence”.",
    ),
    "over-subjects": (
        "Tests over subjects",
        "Answers are averaged within subject and condition first: people, not trials, are the sample, and treating "
        "trials as independent would count one person many times.",
    ),
}
"""Title and paragraph of each choice, by anchor."""


def chosen(keys: Sequence[str]) -> Links:
    """Return the links from the methods to the paragraphs of their choices."""
    return Links("Why:", [(f"why-{key}", CHOICES[key][0]) for key in keys])


def explained(keys: Sequence[str]) -> Iterator[Block]:
    """Yield the paragraphs of the choices, each once, folded."""
    yield Details("Choices and their reasons", [Anchored(f"why-{key}", *CHOICES[key]) for key in dict.fromkeys(keys)])
