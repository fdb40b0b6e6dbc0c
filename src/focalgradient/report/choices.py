"""Rationale of the analysis: one paragraph per methodological choice, linked from the methods."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from focalgradient.report.document import Anchored, Block, Heading, Links
from focalgradient.scales import Analysis, Choices, OrdinalSteps, Ratios, Slopes

__all__ = ["CUBE", "DETECTION", "JUDGEMENTS", "OWN", "THRESHOLDS", "chosen", "explained", "of_analysis"]

CHOICES = {
    "judgements": (
        "One likelihood of all judgements",
        "What single cues predict of both is uncertain, too. All judgements are fitted in one "
        "likelihood, so that this uncertainty is part of each comparison; thresholds fitted first and combined "
        "afterwards would be taken as known.",
    ),
    "exclusions": (
        "Exclusions",
        "Rules of exclusion look at catch trials, repeated answers, response times and dropped frames, never at the "
        "effect of blur, so that they cannot select for it (Simmons, Nelson and Simonsohn, 2011). They are to be "
        "stated before the data are seen; results without them stand beside those with them. In full: "
        "docs/statistics.md, “Who is left out”.",
    ),
    "random": (
        "Subjects and scenes as random",
        "Results are meant to hold for other people and other scenes. A test over subjects alone takes these scenes "
        "for all scenes, and errs where scenes differ (Clark, 1973; Judd, Westfall and Kenny, 2012). With fewer than "
        "five scenes too little is known of how they differ: results then hold for these scenes, and say so. In full: "
        "docs/statistics.md, “Depth ratings”.",
    ),
    "logarithm": (
        "Logarithm",
        "Ratings are ratios to a standard. Twice and half as deep are equally far from the standard on the logarithm, "
        "and estimates of magnitude scatter in proportion to themselves, so that the scatter is even there. In full: "
        "docs/statistics.md, “Depth ratings”.",
    ),
    "equivalence": (
        "Equivalence",
        "That a test is not significant does not show that there is no effect. The rise is called equivalent to zero "
        "only where two one-sided tests (Schuirmann, 1987) exclude a rise, and a fall, that would matter: the bound "
        "stated in advance. In full: docs/statistics.md, “Depth ratings”.",
    ),
    "ordinal": (
        "Cumulative-link model",
        "Steps have an order but no distances: means of steps depend on how people use them, and can reverse an effect "
        "(Liddell and Kruschke, 2018). The model places thresholds between the steps on one latent scale. In full: "
        "docs/statistics.md, “Depth ratings”.",
    ),
    "slopes": (
        "Slope within each subject",
        "A straight line through all apertures uses every answer, and one number for each subject and scene makes "
        "subjects the units of the test. In full: docs/statistics.md, “Depth ratings”.",
    ),
    "choice": (
        "Log odds of choices",
        "A share of choices is bounded by 0 and 1, so that its change with the aperture is measured in log odds; what "
        "one person chooses again and again counts as one person. In full: docs/statistics.md, “Depth ratings”.",
    ),
    "holm": (
        "Holm’s correction",
        "Each family of tests that answers one question errs in at most 5 % of experiments without an effect, and has "
        "more power than Bonferroni’s correction (Holm, 1979). One rule decides everywhere: the corrected p below "
        ".05. In full: docs/statistics.md, “Depth ratings”.",
    ),
    "share": (
        "Share of time",
        "The nonrigid share of the time with one of the two readings does not depend on how fast a person’s percept "
        "alternates, nor on how long no key is held. Durations are fitted with what the end of a trial cut off as "
        "lower limits. In full: docs/statistics.md, “The Necker cube”.",
    ),
    "threshold": (
        "Threshold by its posterior",
        "A psychometric function is fitted with a lapse rate, as lapses would otherwise flatten it (Wichmann and Hill, "
        "2001); the threshold is the median of its posterior. Thresholds multiply, so that their mean is geometric. In "
        "full: docs/thresholds.md.",
    ),
    "d-prime": (
        "d′ instead of a share",
        "The share of right answers mixes how well a signal is seen with how readily “yes” is said. d′ and the "
        "criterion part the two; confidence shows whether signal and noise scatter alike, and how well people know "
        "when they are right. In full: docs/thresholds.md, “Answers of yes and no, ratings, confidence”.",
    ),
    "over-subjects": (
        "Tests over subjects",
        "Answers are averaged within subject and condition first: people, not trials, are the sample, and treating "
        "trials as independent would count one person many times.",
    ),
}
"""Title and paragraph of each choice, by anchor."""

OF_ANALYSIS: dict[type[Analysis], tuple[str, ...]] = {
    Ratios: ("logarithm", "random", "equivalence", "holm"),
    OrdinalSteps: ("ordinal", "random", "holm"),
    Slopes: ("slopes", "random", "holm"),
    Choices: ("choice", "random", "holm"),
}
CUBE = ("exclusions", "share", "holm")
THRESHOLDS = ("threshold",)
DETECTION = ("d-prime", "over-subjects", "holm")
OWN = ("over-subjects", "holm")
JUDGEMENTS = ("judgements",)


def of_analysis(analysis: Analysis) -> tuple[str, ...]:
    """Return the keys of the choices of an analysis of ratings.

    >>> of_analysis(Ratios())[:2]
    ('exclusions', 'logarithm')
    """
    found = next(keys for kind, keys in OF_ANALYSIS.items() if isinstance(analysis, kind))
    return ("exclusions", *found)


def chosen(keys: Sequence[str]) -> Links:
    """Return the links from the methods to the paragraphs of their choices."""
    return Links("Why:", [(f"why-{key}", CHOICES[key][0]) for key in keys])


def explained(keys: Sequence[str]) -> Iterator[Block]:
    """Yield the paragraphs of the choices, each once."""
    yield Heading("Choices and their reasons", 3)
    for key in dict.fromkeys(keys):
        yield Anchored(f"why-{key}", *CHOICES[key])
