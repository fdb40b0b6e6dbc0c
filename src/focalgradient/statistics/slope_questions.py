"""Questions about signed steps, places on a line and choices: slopes on the aperture, and the largest aperture."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.scales.analyses import Choices, Slopes
from focalgradient.statistics.cells import Cells, cells, paired_differences, slope_weights
from focalgradient.statistics.crossed import FEWEST_SCENES, crossed_effect, over_subjects, random_scenes
from focalgradient.statistics.questions import (
    HERE,
    SECONDARY,
    Analysis,
    Answers,
    Question,
    Test,
    Tested,
    corrections,
    in_r,
    less,
    tested,
)
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.wording import expected_differences, expected_rise, in_focus, over, summary
from focalgradient.user_tables.tidy import fixations_of, main_trials

__all__ = [
    "DIFFERENCE",
    "LARGEST",
    "SLOPE",
    "cells_of",
    "confidence_questions",
    "own_slopes",
    "slope_questions",
]

FloatArray = NDArray[np.float64]

CHOICES = NotComputed("Slopes of choices are not compared between fixations.")
UNLIKE = NotComputed("No answer of the scale means that two pictures are alike.")

RANDOM = ", subjects and scenes"
"""End of the name of a question about choices that is asked over subjects and scenes."""

SLOPE, DIFFERENCE = "slope on aperture", "difference of the slopes"
LARGEST = "largest aperture against identical pictures"
CONFIDENCE_SLOPE = "slope of confidence on aperture"
"""Names of the questions."""

Tests = dict[str, Tested | NotComputed]
Values = pd.DataFrame | NotComputed


def slope_questions(
    fixations: Sequence[str], analysis: Slopes | Choices, scenes: int, reference: str = "", steps: str = "steps"
) -> Analysis:
    """Return the questions about comparisons, asked of the cells of each fixation.

    Parameters
    ----------
    fixations
        Objects in focus; the slope with the first is the primary outcome.
    analysis
        Analysis of the answers.
    scenes
        Number of scenes.
    reference, steps
        Reference picture of paired comparisons, and number of steps, in words.

    Examples
    --------
    >>> [question.name for question in slope_questions(["nearest"], Choices(), 6).questions][:2]
    ['slope on aperture', 'largest aperture against identical pictures']
    """
    first = fixations[0]
    pairs = {less(*pair): pair for pair in combinations(fixations, 2)}
    if not analysis.compares_slopes and len(pairs) > 1:
        pairs = {}
    what = f"the {analysis.mean}"
    # Choices are tested over subjects, as the test over subjects and scenes finds fewer effects of few of both.
    deciding, other, end = crossed_effect, over_subjects, HERE
    decides, beside_it = "crossed", "over_subjects"
    if analysis.binary:
        deciding, other, end = over_subjects, crossed_effect, RANDOM
        decides, beside_it = beside_it, decides

    def slopes(of: Mapping[str, Cells]) -> dict[str, Values]:
        return {name: _slope_table(own) for name, own in of.items()}

    def apart(one: Cells, another: Cells) -> Values:
        first, second = _slope_table(one), _slope_table(another)
        if isinstance(first, NotComputed):
            return first
        return second if isinstance(second, NotComputed) else paired_differences(first, second)

    def differences(of: Mapping[str, Cells]) -> dict[str, Values]:
        both = {less(*pair): pair for pair in combinations(of, 2)}
        if not analysis.compares_slopes:
            return dict.fromkeys(both, CHOICES)
        return {name: apart(*(of[one] for one in pair)) for name, pair in both.items()}

    def largest(of: Mapping[str, Cells]) -> dict[str, Values]:
        alike = analysis.alike
        if alike is None:
            return dict.fromkeys(of, UNLIKE)
        return {name: own.table(own.values[:, :, -1] - alike) for name, own in of.items()}

    def asked_of(values: Callable[[Mapping[str, Cells]], dict[str, Values]], test: Test) -> Callable[[Any], Tests]:
        return lambda of: {name: tested(found, test) for name, found in values(of).items()}

    def changed(level: str, answers: Answers) -> str:
        slope = answers.to(SLOPE)[level]
        if isinstance(slope, NotComputed):
            return f"With {in_focus(level)}, the slope on the aperture was not tested: {slope.reason}"
        verb = "was not shown to change" if not slope.significant else "rose" if slope.estimate > 0 else "fell"
        unit = f"{analysis.unit} per millimetre: {summary(slope)}; over {over(slope)}"
        return f"With {in_focus(level)}, {what} {verb} with the aperture ({unit}).{beside(level, answers)}"

    def beside(level: str, answers: Answers) -> str:
        test = answers.to(SLOPE + end)[level]
        if random_scenes(answers.to(SLOPE)[level]):
            return f" For these scenes alone: {summary(test)}."
        return f" Over {over(test)}: {summary(test)}." if isinstance(test, Effect) and random_scenes(test) else ""

    def differed(level: str, answers: Answers) -> str:
        test, (one, another) = answers.to(DIFFERENCE)[level], pairs[level]
        slopes = f"The slopes of “{one}” and “{another}”"
        if not analysis.compares_slopes:
            return ""
        if isinstance(test, NotComputed):
            return f"{slopes} were not compared: {test.reason}"
        verb = "differed" if test.significant else "were not shown to differ"
        return f"{slopes} {verb} ({summary(test)}; over {over(test)})."

    def unlike(level: str, answers: Answers) -> str:
        test = answers.to(LARGEST)[level]
        if analysis.alike is None:
            return ""
        subject = f"With {in_focus(level)} at the largest aperture, {what}"
        if isinstance(test, NotComputed):
            return f"{subject} was not tested: {test.reason}"
        verb = "differed" if test.significant else "was not shown to differ"
        return f"{subject} {verb} from that of pictures that are alike ({summary(test)}; over {over(test)})."

    unit = f"{analysis.unit} per millimetre"
    random = scenes >= FEWEST_SCENES
    generalises = random and not analysis.binary
    method = (
        "with subjects and scenes as crossed random factors (quasi-F of Clark, 1973, Satterthwaite’s degrees of "
        "freedom; tables with empty cells by REML)"
        if generalises
        else "by Student’s t over subjects, with N − 1 degrees of freedom"
    )
    test = "with both as crossed random factors" if generalises else "by Student’s t with N − 1 degrees of freedom"
    secondary = ["the other slopes"] * (len(fixations) > 1) + [LARGEST_KIND] * (analysis.alike is not None)
    compared = pairs if analysis.compares_slopes else {}
    described = _choices(reference) if analysis.binary else _slopes(analysis, reference, steps, bool(compared))
    outcome, line, changes = described
    asked = [
        Question(
            SLOPE,
            asked_of(slopes, deciding),
            "primary",
            unit,
            SECONDARY,
            f"slope, {{level}} in focus ({unit})",
            sentence=changed,
            hypothesis=(expected_rise(fixations, changes),),
            method=f"{line} tested {method}.",
            r_code=in_r(SLOPE, "slopes", decides),
        ),
        Question(
            DIFFERENCE,
            asked_of(differences, deciding),
            "secondary",
            unit,
            "differences" * (len(pairs) > 1),
            "difference of the slopes, {level}",
            sentence=differed,
            hypothesis=expected_differences(fixations) if compared else (),
            r_code=f"differing <- differences(slopes)\n{in_r(DIFFERENCE, 'differing', decides)}" * bool(compared),
        ),
        Question(
            LARGEST,
            asked_of(largest, deciding),
            "secondary",
            analysis.unit,
            SECONDARY,
            sentence=unlike,
            method=""
            if analysis.alike is None
            else f"The {analysis.mean.removesuffix(' of choices')}s of subjects and scenes at the largest aperture "
            f"were compared with those of identical pictures {test}.",
            r_code=""
            if analysis.alike is None
            else f"against <- lapply(largest, function(y) y - {analysis.alike!r})\n{in_r(LARGEST, 'against', decides)}",
        ),
        Question(SLOPE + end, asked_of(slopes, other), "check", unit, r_code=in_r(SLOPE + end, "slopes", beside_it)),
        Question(
            DIFFERENCE + end,
            asked_of(differences, other),
            "check",
            unit,
            r_code=in_r(DIFFERENCE + end, "differing", beside_it) * bool(compared),
        ),
        Question(
            LARGEST + end,
            asked_of(largest, other),
            "check",
            analysis.unit,
            r_code=in_r(LARGEST + end, "against", beside_it) * (analysis.alike is not None),
        ),
    ]
    return Analysis(
        [question for question in asked if pairs or not question.name.startswith(DIFFERENCE)],
        f"The primary outcome is {outcome} with {in_focus(first)}, one value for each subject and scene.",
        after=f"{corrections(secondary, len(compared))} {_generality(random, generalises)}",
        prepare=lambda table: cells_of(main_trials(table, analysis)),
    )


LARGEST_KIND = "the comparisons at the largest aperture"


def _slopes(analysis: Slopes | Choices, reference: str, steps: str, compared: bool) -> tuple[str, str, str]:
    """Return outcome, line and changing quantity of steps or places in words."""
    answer = analysis.mean.removeprefix("mean ")
    slopes = "slopes and their difference between the fixations were" if compared else "slope was"
    of = ""
    if isinstance(analysis, Slopes) and analysis.compared:
        of = f"Pictures were compared with {reference} in {steps} {analysis.compared}. "
    return (
        f"the slope of the {answer} on aperture diameter ({analysis.unit} per millimetre)",
        f"{of}A straight line on aperture diameter was fitted to the {answer}s of each subject and scene; its {slopes}",
        f"the {analysis.mean} changes",
    )


def _choices(reference: str) -> tuple[str, str, str]:
    """Return the same of choices."""
    return (
        "the slope of the proportion of choices of the picture on its aperture diameter,",
        f"In each trial a picture and {reference} were shown in random order, and the one that looked deeper was "
        "chosen. A straight line on aperture diameter was fitted to the choices (0 or 1) of each subject and scene; "
        "its slope was",
        "the proportion of choices changes",
    )


def _generality(random: bool, generalises: bool) -> str:
    """Describe what results hold for."""
    if generalises:
        return "Such tests for these scenes alone, by Student’s t with N − 1 degrees of freedom, are also reported."
    if random:
        return (
            "Results are for these scenes; tests with subjects and scenes as crossed random factors are also reported."
        )
    return (
        f"Results are for these scenes only: fewer than {FEWEST_SCENES} scenes give too little information on how "
        "scenes differ."
    )


CONFIDENCE_METHOD = (
    "Confidence was asked after each answer. Whether it changes with the aperture is tested by its least-squares slope "
    "on aperture diameter within subject and scene, over subjects and scenes; its p is not corrected, and it decides "
    "nothing."
)


CONFIDENCE_R = f"""\
confidence <- slopes_of(d[!is.na(d$confidence), ], "confidence")
{in_r(CONFIDENCE_SLOPE, "confidence", "crossed")}"""


def confidence_questions() -> Analysis:
    """Return the question whether confidence changes with the aperture at each fixation.

    It is asked of trials of `focalgradient.user_tables.tidy.rating_table`, with `confidence` from 0 to 1.

    Examples
    --------
    >>> rows = [{"participant_id": who, "scene": "room", "fixation": "nearest", "aperture_mm": mm, "catch": False,
    ...          "confidence": 0.2 + (0.05 + 0.01 * who) * mm} for who in range(4) for mm in (0.0, 4.0, 8.0)]
    >>> [answer] = confidence_questions().asked(pd.DataFrame(rows))
    >>> round(answer.outcome.estimate, 3)
    0.065
    """

    def prepare(table: pd.DataFrame) -> dict[str, Cells]:
        rows = table[~table["catch"] & table["confidence"].notna()]
        return cells_of(rows.assign(answer=rows["confidence"].astype(float))) if len(rows) else {}

    def slopes(of: Mapping[str, Cells]) -> Tests:
        return {name: tested(_slope_table(own), crossed_effect) for name, own in of.items()}

    def sentence(level: str, answers: Answers) -> str:
        slope = answers.to(CONFIDENCE_SLOPE)[level]
        return f"With {in_focus(level)}, slope of confidence on the aperture: {summary(slope)}"

    unit = "confidence per millimetre"
    described: dict[str, Any] = {"sentence": sentence, "method": CONFIDENCE_METHOD, "r_code": CONFIDENCE_R}
    return Analysis([Question(CONFIDENCE_SLOPE, slopes, "check", unit, **described)], prepare=prepare)


def cells_of(trials: pd.DataFrame) -> dict[str, Cells]:
    """Return the cells of each fixation of trials that have a column `answer`."""
    return {name: cells(trials[trials["fixation"] == name]) for name in fixations_of(trials)}


def _slope_table(own: Cells) -> Values:
    slopes = own_slopes(own)
    return slopes if isinstance(slopes, NotComputed) else own.table(slopes)


def own_slopes(own: Cells) -> FloatArray | NotComputed:
    """Return least-squares slopes per mm of aperture (subjects x scenes; per subject if no scene has all apertures)."""
    weights = slope_weights(own.amounts)
    if isinstance(weights, NotComputed):
        return weights
    slopes = own.contrast(weights)
    if np.isfinite(slopes).any():
        return slopes
    seen = np.isfinite(own.values)
    with np.errstate(invalid="ignore"):
        means = np.where(seen, own.values, 0).sum(axis=1, keepdims=True) / seen.sum(axis=1, keepdims=True)
    return replace(own, values=means).contrast(weights)
