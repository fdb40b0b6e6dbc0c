"""Preregistration of the rotating Necker cube."""

from __future__ import annotations

from focalgradient.design import NeckerDesign
from focalgradient.power import CubeModel, Study, quick_cube_power
from focalgradient.report.exclusions import CUBE_CATCH, criteria
from focalgradient.report.preregistered import (
    AFTERWARDS,
    EXPERIMENTS,
    SUBJECTS,
    Planned,
    Preregistered,
    enough,
    power_table,
    rules_table,
)
from focalgradient.report.rules import as_toml
from focalgradient.statistics.criteria import OF_CUBE
from focalgradient.statistics.cube import cube_questions
from focalgradient.statistics.exclusions import NO_CATCH
from focalgradient.statistics.wording import many

__all__ = ["preregister_cube"]


def preregister_cube(design: NeckerDesign, asked: Planned) -> Preregistered:
    """Write the preregistration of reports on the cube.

    Raises
    ------
    InputError
        If the design contains no comparison.
    """
    model = CubeModel(**asked.effects)
    study = Study(model, design)
    powers = quick_cube_power(study, SUBJECTS, EXPERIMENTS)
    sizes = ", ".join(f"{mm:g}" for mm in design.strengths_mm)
    shown = (
        f"A turning wireframe Necker cube; gradients of blur: {', '.join(design.gradients)}; apertures of {sizes} mm; "
        f"trials of {design.trial_s:g} s, {many(design.repetitions, 'repetition')}, turning "
        f"{' and '.join(design.directions)}; {many(design.catch_trials, 'catch trial')}. Every subject sees every "
        "condition, in random order from the seed that the data set records."
    )
    assumed = (
        f"by {EXPERIMENTS:,} simulated experiments each, drawn from one pool of 400 simulated people and analysed as "
        "above (paired t-tests, the primary one uncorrected, Holm’s p for the others), none excluded. Assumed: a "
        f"ratio of odds of {model.effect:g} at the largest aperture, its standard deviation over subjects (of its "
        f"logarithm) of {model.between:g}, a nonrigid share of {model.nonrigid:g} without blur, and durations as 22 "
        "people reported of a lattice."
    )
    rules = asked.stated.rules
    questions = cube_questions([], design.gradients, max(design.strengths_mm), rules)
    unjudged = {} if design.catch_trials or rules.catch_passed is None else {"catch_passed": NO_CATCH}
    return Preregistered(
        "Preregistration: the turning Necker cube and focal gradients",
        questions.hypotheses,
        questions.outcome,
        shown,
        [*criteria(rules, unjudged, CUBE_CATCH), *AFTERWARDS],
        rules_table(asked.stated, [name for name in OF_CUBE if name not in unjudged]),
        [questions.method],
        enough(powers, assumed),
        power_table(powers, study.tests),
        neutral=[
            "The truly nonrigid cube of the catch trials is reported so, as the rules above ask.",
            "Without a gradient both readings are reported: neither takes less than 2 % of the time over all subjects.",
            "Keys are held for more of the time than the rules above ask.",
        ],
        failed=[
            "The test rests on normally distributed changes of the log odds over subjects. No other test of this "
            "hypothesis is made; shares of time only describe.",
            "Where a subject reports neither reading in a condition, its change is missing, and is not replaced.",
        ],
        rules_file=as_toml(rules, None, OF_CUBE),
    )
