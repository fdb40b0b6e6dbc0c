"""Preregistration of thresholds of blur, or of depth from blur."""

from __future__ import annotations

from focalgradient.design import BlurThresholdDesign
from focalgradient.errors import InputError
from focalgradient.report.preregistered import Planned, Preregistered
from focalgradient.report.thresholds import methods_thresholds, unit_of
from focalgradient.statistics.thresholds import ATTENDING
from focalgradient.statistics.wording import many

__all__ = ["preregister_thresholds"]


def preregister_thresholds(design: BlurThresholdDesign, asked: Planned) -> Preregistered:
    """Write the preregistration of thresholds.

    Raises
    ------
    InputError
        If an effect is given, as no hypothesis is tested.
    """
    if asked.effects:
        raise InputError(f"effect is for hypothesis tests, but {design.task} has none: leave it out.")
    settings = design.model_dump()
    what = "of blur" if design.judged == "blur" else "of depth from blur"
    return Preregistered(
        "Preregistration: thresholds " + what,
        ["No hypothesis is tested: thresholds are estimated, with their intervals."],
        f"The geometric mean over participants of the threshold {what} ({unit_of(settings)}).",
        f"{many(len(design.scenes), 'scene')}, {many(design.repetitions, 'repetition')}, "
        f"{many(design.catch_trials, 'catch trial')}, levels from {design.least_level:g} to {design.most_level:g} "
        f"{unit_of(settings)}.",
        ["The mean includes everyone; a second mean omits participants who failed catch trials."],
        None,
        [*methods_thresholds(settings)],
        "State the number of participants and its reason: no test is made, but focalgradient power blur-threshold "
        "gives how precisely a number of them determines the mean.",
        None,
        neutral=[
            f"Participants answer {ATTENDING:.0%} or more of the catch trials, at the greatest level, correctly.",
            "The levels reach beyond the thresholds: no interval of a threshold reaches an end of the levels.",
        ],
        failed=[
            "Where a psychometric function cannot be fitted, or its interval reaches an end of the levels, the report "
            "names the participant; the mean is over those with a fitted function.",
        ],
    )
