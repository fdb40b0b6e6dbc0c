"""Questions about ordinal steps: log odds of a higher answer at the largest aperture, and their differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from focalgradient.statistics.crossed import FEWEST_SCENES, random_scenes
from focalgradient.statistics.means import family
from focalgradient.statistics.questions import (
    HERE,
    SECONDARY,
    Analysis,
    Answers,
    Outcome,
    Question,
    corrections,
    in_r,
    less,
)
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.wording import (
    ci,
    difference,
    direction,
    expected_differences,
    expected_rise,
    in_focus,
    listed,
    over,
    ratio_ci,
    statistic,
)

__all__ = ["DIFFERENCE", "EFFECT", "SLOPE", "step_outcomes", "step_questions"]

EFFECT, DIFFERENCE, SLOPE = "log odds of a higher answer", "difference of the log odds", "slope of the log odds"
"""Names of the questions."""


def step_questions(fixations: Sequence[str], scenes: int, steps: str = "steps") -> Analysis:
    """Return the questions about ordinal steps, asked of the outcomes of the mixed model by question and level.

    Parameters
    ----------
    fixations
        Objects in focus; the effect with the first is the primary outcome.
    scenes
        Number of scenes.
    steps
        Number of steps, in words.

    Examples
    --------
    >>> [question.name for question in step_questions(["nearest"], 6).questions][:2]
    ['log odds of a higher answer', 'log odds of a higher answer, these scenes']
    """
    pairs = {less(*pair): pair for pair in combinations(fixations, 2)}
    unit = "log odds ratio"

    def changed(level: str, answers: Answers) -> str:
        test, fixed = answers.to(EFFECT)[level], answers.to(EFFECT + HERE)[level]
        if isinstance(test, NotComputed):
            return f"With {in_focus(level)}, the slope was not tested: {test.reason}"
        sentence = (
            f"With {in_focus(level)}, ratings {direction(test)} with blur (odds ratio of a higher answer at the "
            f"largest aperture {ratio_ci(test)}; {statistic(test)}; over {over(test)})."
        )
        if random_scenes(test) and isinstance(fixed, Effect):
            ends = ci(fixed.ratio.low, fixed.ratio.high)
            sentence += f" For these scenes alone: {ends}; {statistic(fixed)}."
        return sentence

    def differed(level: str, answers: Answers) -> str:
        return difference("odds ratios", pairs[level], answers.to(DIFFERENCE)[level], only=len(pairs) == 1)

    fixed = listed([*["fixation"] * bool(pairs), *["scenes"] * (scenes > 1)], nothing="none")
    slopes = "slopes and of their difference" if pairs else "slope"
    if scenes >= FEWEST_SCENES:
        test = (
            f"The contribution of random scenes was added to the variance of the {slopes}: Cochran’s Q of the slopes "
            "within scenes, one Newton step from the fit, divided by its degrees of freedom, minus 1. The tests use "
            "Student’s t with Satterthwaite’s degrees of freedom; tests for these scenes alone, by Student’s t with "
            "N − 1 degrees of freedom, are also reported."
        )
    else:
        test = (
            f"{'The slopes and their differences were' if pairs else 'The slope was'} tested by Student’s t with "
            f"N − 1 degrees of freedom, for these scenes only: fewer than {FEWEST_SCENES} scenes give too little "
            "information on how scenes differ."
        )
    asked = [
        Question(
            EFFECT,
            role="primary",
            unit=unit,
            family=SECONDARY,
            headline="odds ratio of a higher answer at the largest aperture, {level} in focus",
            ratio=True,
            sentence=changed,
            hypothesis=(expected_rise(fixations, "the odds of a higher answer change"),),
            method="One cumulative-link mixed model (logit) with a slope on aperture "
            f"diameter{' for each fixation' if pairs else ''}, {fixed} as fixed effects, and random intercepts and "
            f"slopes of the subjects was fitted by adaptive Gauss-Hermite quadrature. {test}",
            r_code=in_r(EFFECT, "effects", "tested"),
        ),
        Question(
            DIFFERENCE,
            unit=unit,
            family="differences" * (len(pairs) > 1),
            headline="ratio of the odds ratios, {pair}",
            ratio=True,
            sentence=differed,
            hypothesis=expected_differences(fixations),
            r_code=in_r(DIFFERENCE, "differing", "tested"),
        ),
        *(
            Question(name + HERE, role="check", unit=unit, ratio=True, r_code=in_r(name + HERE, values, "tested_here"))
            for name, values in ((EFFECT, "effects"), (DIFFERENCE, "differing"))
        ),
        Question(SLOPE, unit="log odds per mm", r_code=in_r(SLOPE, "effects", "per_mm")),
    ]
    return Analysis(
        [question for question in asked if pairs or not question.name.startswith(DIFFERENCE)],
        "The primary outcome is the slope on the aperture: the log odds of a higher answer at the largest aperture "
        f"against the pinhole, with {in_focus(fixations[0])}.",
        f"Answers were {steps} of an ordinal scale.",
        corrections(["the other slopes"] * bool(pairs), len(pairs)),
    )


def step_outcomes(
    fixations: Sequence[str],
    tests: Sequence[Effect | NotComputed],
    fixed: Sequence[Effect | NotComputed],
    width: float,
) -> dict[str, dict[str, Outcome]]:
    """Return the outcomes of the questions by name and level, from tests of each fixation, then of each pair.

    Parameters
    ----------
    fixations
        Objects in focus.
    tests, fixed
        Log odds from the smallest to the largest aperture, over subjects and scenes, and for these scenes.
    width
        Range of the apertures in mm.
    """
    size = len(fixations)
    pairs = [less(*pair) for pair in combinations(fixations, 2)]
    data: dict[str, dict[str, Outcome]] = {
        name + end: dict(zip(levels, some[part], strict=True))
        for end, some in (("", tests), (HERE, fixed))
        for name, levels, part in ((EFFECT, fixations, slice(size)), (DIFFERENCE, pairs, slice(size, None)))
    }
    corrected = [tests[0], *family(tests[1:size])]  # the slopes are the same tests
    slopes = [_scaled(test, width) if width else test for test in corrected]
    return data | {SLOPE: dict(zip(fixations, slopes, strict=True))}


def _scaled(effect: Effect | NotComputed, width: float) -> Effect | NotComputed:
    """Rescale the effect to one millimetre of aperture."""
    if isinstance(effect, NotComputed):
        return effect
    ends = {name: getattr(effect, name) / width for name in ("estimate", "low", "high", "standard_error")}
    return replace(effect, **ends)
