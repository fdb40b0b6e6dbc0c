"""Questions about signed steps, places on a line and choices: slopes on the aperture, and the largest aperture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import pandas as pd

from focalgradient.analyses import Choices, Slopes
from focalgradient.statistics.cells import Cells, Values, cells_of, differences, less, slopes
from focalgradient.statistics.crossed import FEWEST_SCENES, random_scenes
from focalgradient.statistics.questions import (
    OVER_SCENES,
    OVER_SUBJECTS,
    SECONDARY,
    Analysis,
    Answers,
    Question,
    corrections,
    in_two_ways,
)
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.wording import expected_differences, expected_rise, in_focus, over, summary
from focalgradient.user_tables.tidy import main_trials

__all__ = [
    "DIFFERENCE",
    "LARGEST",
    "SLOPE",
    "confidence_questions",
    "slope_questions",
]

CHOICES = NotComputed("Slopes of choices are not compared between fixations.")
UNLIKE = NotComputed("No answer of the scale means that two pictures are alike.")

SLOPE, DIFFERENCE = "slope on aperture", "difference of the slopes"
LARGEST = "largest aperture against identical pictures"
CONFIDENCE_SLOPE = "slope of confidence on aperture"
"""Names of the questions."""

Data = Mapping[str, Cells]
"""Answers of each fixation in cells."""


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
    decides, end = (OVER_SUBJECTS, OVER_SCENES.end) if analysis.binary else (OVER_SCENES, OVER_SUBJECTS.end)

    def apart(data: Data) -> dict[str, Values]:
        found = differences(_slopes_of(data))
        return found if analysis.compares_slopes else dict.fromkeys(found, CHOICES)

    def largest(data: Data) -> dict[str, Values]:
        alike = analysis.alike
        if alike is None:
            return dict.fromkeys(data, UNLIKE)
        return {name: own.table(own.values[:, :, -1] - alike) for name, own in data.items()}

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
        in_two_ways(
            *(decides, _slopes_of, "slopes"),
            Question(
                SLOPE,
                role="primary",
                unit=unit,
                family=SECONDARY,
                headline=f"slope, {{level}} in focus ({unit})",
                sentence=changed,
                hypothesis=(expected_rise(fixations, changes),),
                method=f"{line} tested {method}.",
            ),
        ),
        in_two_ways(
            *(decides, apart, "differing" if compared else ""),
            Question(
                DIFFERENCE,
                unit=unit,
                family="differences" * (len(pairs) > 1),
                headline="difference of the slopes, {level}",
                sentence=differed,
                hypothesis=expected_differences(fixations) if compared else (),
                r_code="differing <- differences(slopes)\n" * bool(compared),
            ),
        ),
        in_two_ways(
            *(decides, largest, "" if analysis.alike is None else "against"),
            Question(
                LARGEST,
                unit=analysis.unit,
                family=SECONDARY,
                sentence=unlike,
                method=""
                if analysis.alike is None
                else f"The {analysis.mean.removesuffix(' of choices')}s of subjects and scenes at the largest aperture "
                f"were compared with those of identical pictures {test}.",
                r_code=f"against <- lapply(largest, function(y) y - {analysis.alike!r})\n"
                * (analysis.alike is not None),
            ),
        ),
    ]
    return Analysis(
        [
            question
            for part in zip(*asked, strict=True)
            for question in part
            if pairs or not question.name.startswith(DIFFERENCE)
        ],
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


def confidence_questions() -> Analysis:
    """Return the question whether confidence changes with the aperture at each fixation.

    It is asked of trials of `focalgradient.user_tables.tidy.rating_table`, with `confidence` from 0 to 1.

    Examples
    --------
    >>> rows = [{"participant_id": who, "scene": "room", "fixation": "nearest", "aperture": f"{mm:g} mm",
    ...          "aperture_mm": mm, "catch": False, "confidence": 0.2 + (0.05 + 0.01 * who) * mm}
    ...         for who in range(4) for mm in (0.0, 4.0, 8.0)]
    >>> [answer] = confidence_questions().asked(pd.DataFrame(rows))
    >>> round(answer.outcome.estimate, 3)
    0.065
    """

    def prepare(table: pd.DataFrame) -> dict[str, Cells]:
        rows = table[~table["catch"] & table["confidence"].notna()]
        return cells_of(rows.assign(answer=rows["confidence"].astype(float))) if len(rows) else {}

    def sentence(level: str, answers: Answers) -> str:
        slope = answers.to(CONFIDENCE_SLOPE)[level]
        return f"With {in_focus(level)}, slope of confidence on the aperture: {summary(slope)}"

    question, _ = in_two_ways(
        *(OVER_SCENES, _slopes_of, "confidence"),
        Question(
            CONFIDENCE_SLOPE,
            role="check",
            unit="confidence per millimetre",
            sentence=sentence,
            method=CONFIDENCE_METHOD,
            r_code='confidence <- slopes_of(d[!is.na(d$confidence), ], "confidence")\n',
        ),
    )
    return Analysis([question], prepare=prepare)


def _slopes_of(data: Data) -> dict[str, Values]:
    return {name: slopes(own) for name, own in data.items()}
