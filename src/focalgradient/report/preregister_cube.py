"""Preregistration of the rotating Necker cube."""

from __future__ import annotations

from focalgradient.design import NeckerDesign
from focalgradient.power import CubeModel, CubeStudy, quick_cube_power
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
from focalgradient.report.words import analysis_necker
from focalgradient.statistics.criteria import OF_CUBE
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
    study = CubeStudy(model, design)
    powers = quick_cube_power(study, SUBJECTS, EXPERIMENTS)
    largest = max(design.strengths_mm)
    claims = {
        "nonrigid_longer": ("nonrigid", "raises"),
        "nonrigid_shorter": ("rigid", "lowers"),
    }
    hypotheses = [
        f"H{number} ({'primary' if number == 1 else 'secondary'}). Blur that agrees with the {claims[test][0]} "
        f"reading ({largest:g} mm) {claims[test][1]} the odds of the nonrigid reading (two-sided test)."
        for number, test in enumerate(study.tests, start=1)
    ]
    first = claims[next(iter(study.tests))][0]
    outcome = (
        "The log odds of the nonrigid reading (its time over that of the rigid reading): those with blur that agrees "
        f"with the {first} reading ({largest:g} mm) less those without blur, one value for each subject."
    )
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
    unjudged = {}
    if not design.catch_trials and asked.stated.rules.catch_passed is not None:
        unjudged["catch_passed"] = NO_CATCH
    return Preregistered(
        "Preregistration: the turning Necker cube and focal gradients",
        hypotheses,
        outcome,
        shown,
        [*criteria(asked.stated.rules, unjudged, CUBE_CATCH), *AFTERWARDS],
        rules_table(asked.stated, [name for name in OF_CUBE if name not in unjudged]),
        [analysis_necker(asked.stated.rules.shortest_both)],
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
        rules_file=as_toml(asked.stated.rules, None, OF_CUBE),
    )
