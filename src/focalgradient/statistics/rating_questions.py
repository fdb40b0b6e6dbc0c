"""Questions about depth ratings as ratios: depth effects, differences, single apertures, slopes and equivalence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

from focalgradient.statistics.bootstrap import bootstrap_t
from focalgradient.statistics.cells import Cells, Values, cells_of, differences, less, rises, slopes
from focalgradient.statistics.crossed import FEWEST_SCENES, crossed_effect, over_subjects, own_means, random_scenes
from focalgradient.statistics.hypotheses import Equivalence, equivalence
from focalgradient.statistics.questions import (
    HERE,
    OVER_SCENES,
    SECONDARY,
    Analysis,
    Answers,
    Caution,
    Outcome,
    Question,
    corrections,
    in_r,
    in_two_ways,
)
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.wording import (
    SPACE,
    ci,
    decimals,
    difference,
    direction,
    expected_differences,
    expected_rise,
    in_focus,
    over,
    p_is,
    ratio_ci,
    size,
    statistic,
)
from focalgradient.user_tables.tidy import main_trials

__all__ = [
    "BOOTSTRAP",
    "DIFFERENCE",
    "EFFECT",
    "ENOUGH_SUBJECTS",
    "EQUIVALENT",
    "PINHOLE",
    "SLOPE",
    "rating_questions",
]

EFFECT, DIFFERENCE, PINHOLE = "depth effect", "difference of the depth effects", "ratio to the pinhole"
SLOPE, EQUIVALENT, BOOTSTRAP = "slope on aperture", "equivalence to zero", "depth effect, bootstrap-t"
"""Names of the questions about ratios."""


Data = Mapping[str, Cells]
"""Log ratings of each fixation in cells."""


def rating_questions(fixations: Sequence[str], bound: float, scenes: int) -> Analysis:
    """Return the questions about ratings on a ratio scale, asked of the cells of their logarithms by fixation.

    Parameters
    ----------
    fixations
        Objects in focus; the depth effect with the first is the primary outcome.
    bound
        Equivalence bound, a ratio.
    scenes
        Number of scenes.

    Examples
    --------
    >>> [question.name for question in rating_questions(["nearest"], 1.2, 6).questions if question.role == "secondary"]
    ['equivalence to zero', 'ratio to the pinhole', 'slope on aperture']
    """
    first, *others = fixations
    pairs = {less(*pair): pair for pair in combinations(fixations, 2)}

    def effects(data: Data) -> dict[str, Values]:
        return {name: rises(name, own) for name, own in data.items()}

    def against(data: Data) -> dict[str, Values]:
        return {
            f"{name}, {own.apertures[number]}": rises(name, own, number)
            for name, own in data.items()
            for number in range(1, len(own.amounts) - 1)
            if own.amounts[0] == 0
        }

    def equal(data: Data) -> dict[str, Outcome]:
        values = effects(data).items()
        tests = {name: one if isinstance(one, NotComputed) else crossed_effect(one) for name, one in values}
        return {
            name: equivalence(test, math.log(bound)) if isinstance(test, Effect) else test
            for name, test in tests.items()
        }

    def resampled(data: Data) -> dict[str, Outcome]:
        name, values = next(iter(effects(data).items()))
        if isinstance(values, NotComputed) or isinstance(fixed := over_subjects(values), NotComputed):
            return {name: values if isinstance(values, NotComputed) else fixed}
        return {name: bootstrap_t(own_means(values.to_numpy()))}

    def effect_sentence(level: str, answers: Answers) -> str:
        effect = answers.to(EFFECT)[level]
        if isinstance(effect, NotComputed):
            return f"With {in_focus(level)}, the depth effect was not tested: {effect.reason}"
        equal = answers.to(EQUIVALENT)[level]
        return _changed(level, effect) if level == first or (effect.significant and not equal.equivalent) else ""

    def equal_sentence(level: str, answers: Answers) -> str:
        return "" if level == first else _equivalent(level, answers.to(EFFECT)[level], answers.to(EQUIVALENT)[level])

    def apart_sentence(level: str, answers: Answers) -> str:
        return difference("depth effects", pairs[level], answers.to(DIFFERENCE)[level], only=len(pairs) == 1)

    def here_sentence(level: str, answers: Answers) -> str:
        effect, fixed = answers.to(EFFECT)[level], answers.to(EFFECT + HERE)[level]
        if not (isinstance(effect, Effect) and random_scenes(effect) and isinstance(fixed, Effect)):
            return ""
        ends = ci(fixed.ratio.low, fixed.ratio.high)
        return f"With {in_focus(level)}, for these {scenes} scenes alone: {ends}; {statistic(fixed)}."

    log = "log ratio"
    apart = "The difference of the two depth effects was"
    if len(pairs) != 1:
        apart = "The pairwise differences of the depth effects were"
    asked = [
        in_two_ways(
            *(OVER_SCENES, effects, "effects"),
            Question(
                EFFECT,
                role="primary",
                unit=log,
                family=SECONDARY,
                headline="depth effect at the largest aperture (ratio to the pinhole), {level} in focus",
                ratio=True,
                sentence=effect_sentence,
                hypothesis=(
                    expected_rise(fixations, "ratings of depth change", "from the pinhole to the largest aperture"),
                ),
                method=f"The mean depth effect was tested {ENOUGH_SCENES if scenes >= FEWEST_SCENES else FEW_SCENES}.",
                r_code="effects <- each_fixation(d, function(e) log_ratio(e, max(e$aperture_mm)))\n",
            ),
            here_sentence,
        ),
        in_two_ways(
            *(OVER_SCENES, lambda data: differences(effects(data)), "differing"),
            Question(
                DIFFERENCE,
                unit=log,
                family="differences" * (len(pairs) > 1),
                headline="ratio of the depth effects, {pair}",
                ratio=True,
                sentence=apart_sentence,
                hypothesis=expected_differences(fixations),
                method=f"{apart} tested as the depth effect was.",
                r_code="differing <- differences(effects)\n",
            ),
        ),
        in_two_ways(
            *(OVER_SCENES, against, "ratios"),
            Question(PINHOLE, unit=log, family=SECONDARY, ratio=True, r_code="ratios <- intermediate(d)\n"),
        ),
    ]
    (effect, difference_, pinhole), checks = zip(*asked, strict=True)
    slope, _ = in_two_ways(
        *(OVER_SCENES, lambda data: {name: slopes(own) for name, own in data.items()}, "slopes"),
        Question(
            SLOPE,
            unit=f"{log} per mm",
            family=SECONDARY,
            method="As a trend, the least-squares slope of the log rating on aperture diameter was tested as the depth "
            "effect was.",
            r_code='slopes <- slopes_of(d, "log_rating")\n',
        ),
    )
    equivalent = Question(
        *(EQUIVALENT, equal, "secondary", log),
        ratio=True,
        sentence=equal_sentence,
        hypothesis=tuple(
            f"With {in_focus(other)}, that change is equivalent to zero: within a factor of {bound:g}, the "
            "smallest depth effect that would matter."
            for other in others
        ),
        method="Equivalence to zero was tested by two one-sided tests by Student’s t at .05 (Schuirmann, 1987) "
        f"against a factor of {bound:.3g}, the smallest depth effect that would matter; a change that is both "
        "significant and equivalent to zero is reported as both.",
        r_code=in_r(EQUIVALENT, "effects", f"(function(y) equivalence(crossed(y), log({bound!r})))"),
    )
    robust = Question(BOOTSTRAP, resampled, "check", log, ratio=True, sentence=_bootstrapped, method=BOOTSTRAP_METHOD)
    questions = [replace(effect, r_code=effect.r_code + BY_LMER), equivalent, difference_, pinhole, slope]
    secondary = ["the other depth effects"] * bool(others)
    secondary += ["the comparisons of intermediate apertures with the pinhole", "the slopes"]
    return Analysis(
        [question for question in [*questions, *checks, robust] if pairs or not question.name.startswith(DIFFERENCE)],
        "The primary outcome is the depth effect: the log ratio of the rating at the largest aperture to that at the "
        f"pinhole with {in_focus(first)}, one value for each subject and scene, averaged over repetitions.",
        "Ratings were analysed on their logarithm and are reported as ratios; means are geometric.",
        f"{corrections(secondary, len(pairs))} {INTERVALS}",
        prepare=lambda table: cells_of(main_trials(table)),
    )


ENOUGH_SCENES = (
    "with subjects and scenes crossed as random effects, log_ratio ~ 1 + (1 | participant_id) + (1 | scene): variance "
    "from the mean squares of subjects, scenes and residuals, with a nonnegative scene component, Student’s t with "
    "Satterthwaite’s degrees of freedom (the quasi-F of Clark, 1973; tables with empty cells by REML). A t-test of the "
    "subject means, for these scenes only, is also reported"
)
FEW_SCENES = (
    "by Student’s t over the subject means, with N − 1 degrees of freedom, for these scenes only: fewer than "
    f"{FEWEST_SCENES} scenes give too little information on how scenes differ"
)
"""Tests of the depth effect with enough, and with too few scenes to treat them as random."""

ENOUGH_SUBJECTS = 60
"""Number of subjects from which Student's t rejects at most .06 at a level of .05 where 20 % of subjects have an effect
and the others none (benchmarks/statistics_error_rates.py --tables enough).
"""

BOOTSTRAP_METHOD = (
    "As a sensitivity analysis, which decides nothing, the primary effect is also tested by the bootstrap-t over "
    "subjects, for these scenes (Hall, 1988; 9,999 resamples, equal-tailed); the report states whether it disagrees. "
    "Normality of the subject means and of the residuals is checked by the Shapiro-Wilk test at .05 and by Q-Q plots; "
    "where it fails, the report states it. Few skewed subjects mislead every test: where one subject in five shows an "
    f"effect, {ENOUGH_SUBJECTS} subjects are needed for Student’s t to keep its level."
)

INTERVALS = (
    "Intervals of ratios are 95 % intervals by Student’s t on the logarithm, not adjusted for multiple tests; those of "
    "ratings are within subjects (Cousineau, Morey). Effect sizes of tests over subjects and scenes are d of Westfall, "
    "Kenny and Judd (2014): the mean divided by the root of the summed variance components. Their intervals are by the "
    "noncentral t of the test (Steiger and Fouladi, 1997)."
)

BY_LMER = "for (f in names(effects)) by_lmer(effects[[f]])\n"


def _changed(fixation: str, effect: Effect) -> str:
    """Describe a depth effect by its test."""
    return (
        f"With {in_focus(fixation)}, ratings {direction(effect)} from the pinhole to the largest aperture (ratio "
        f"{ratio_ci(effect)}; {statistic(effect)}{size(effect)}; over {over(effect)})."
    )


def _equivalent(fixation: str, effect: Effect | NotComputed, equal: Equivalence | NotComputed) -> str:
    """Describe a depth effect by its equivalence to zero; empty where it is significant and not small, or untested."""
    if isinstance(effect, NotComputed) or isinstance(equal, NotComputed):
        return ""
    if effect.significant and not equal.equivalent:
        return ""
    said = "the depth effect is" if equal.equivalent else "the depth effect was not shown to be"
    if effect.significant:
        said = f"ratings {direction(effect)}, by less than what would matter: {said}"
    return (
        f"With {in_focus(fixation)}, {said} equivalent to zero within a factor of {decimals(math.exp(equal.bound))} "
        f"(ratio {decimals(math.exp(effect.estimate))}, {ci(math.exp(equal.low), math.exp(equal.high), 90)}; two "
        f"one-sided tests, p{SPACE}{p_is(equal.p)})."
    )


def _bootstrapped(level: str, answers: Answers) -> str:
    """Report the sensitivity analysis of the primary effect: a caution where it disagrees."""
    found, effect, fixed = (answers.to(name)[level] for name in (BOOTSTRAP, EFFECT, EFFECT + HERE))
    if isinstance(found, NotComputed) or isinstance(effect, NotComputed):
        return ""
    ends = ci(math.exp(found.low), math.exp(found.high))
    said = f"Sensitivity: bootstrap-t over subjects, for these scenes, {ends}, p{SPACE}{p_is(found.p)}"
    if found.significant == effect.significant:
        return f"{said}; it agrees."
    if isinstance(fixed, Effect) and fixed.significant == found.significant:
        because = "It disagrees because, as the test for these scenes, it does not generalise to other scenes."
        return Caution(f"{said}. {because}")
    return Caution(
        f"{said}. It disagrees, and the test above decides: the result depends on the assumption that subjects’ "
        "effects are normally distributed. Look at each subject’s effect (Q-Q plot), and do not rely on the result "
        "before it is repeated with more subjects."
    )
