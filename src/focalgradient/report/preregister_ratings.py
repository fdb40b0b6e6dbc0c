"""Preregistration of depth ratings, for any response scale."""

from __future__ import annotations

from collections.abc import Sequence

from focalgradient.design import DepthRatingDesign
from focalgradient.errors import InputError
from focalgradient.power import LatentModel, Model, Study, latent_power, rise_power
from focalgradient.report.exclusions import catch_answers, criteria
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
from focalgradient.report.robustness_part import ROBUSTNESS_PLAN
from focalgradient.report.rules import Stated, as_toml
from focalgradient.scales import Analysis, OrdinalSteps
from focalgradient.statistics.criteria import OF_RATINGS
from focalgradient.statistics.effects import questions_of
from focalgradient.statistics.exclusions import (
    FEW_OF_CONDITION,
    FEW_PLACES,
    NO_CATCH,
    NO_STARTS,
    NOT_DIFFERENT,
    NOT_REPEATED,
)
from focalgradient.statistics.judging import MIN_ANSWERS, MIN_STARTS
from focalgradient.statistics.slope_questions import CONFIDENCE_METHOD
from focalgradient.statistics.wording import in_focus, many
from focalgradient.user_tables.tidy import in_order

__all__ = ["preregister_ratings"]

FAILED_RATIOS = [
    "Where subjects’ effects are not normally distributed, the test stated above still decides, and the bootstrap-t is "
    "reported beside it. The report draws the subjects’ own effects and the residuals by normal quantiles."
]
FAILED_OTHERS = [
    "Where the model does not converge, or cannot be fitted, the hypothesis is reported as not tested, with the "
    "reason; no other model takes its place. The report draws the subjects’ own slopes and the residuals by normal "
    "quantiles."
]


def preregister_ratings(design: DepthRatingDesign, asked: Planned) -> Preregistered:
    """Write the preregistration of depth ratings.

    Raises
    ------
    InputError
        If a setting does not apply to the scale, or the design has no pinhole as reference.
    """
    analysis = design.response_scale.analysis
    if asked.ordinal and not isinstance(analysis, OrdinalSteps):
        raise InputError(
            f"ordinal is for answers in steps, but the design has scale = {design.scale!r}: set scale = 'steps'."
        )
    fixations = in_order(design.fixations)
    questions = questions_of(analysis, fixations, len(design.scenes), design.model_dump(), asked.used_bound)
    ratios = analysis.ratios
    if ratios and "pinhole" not in design.apertures:
        raise InputError("apertures has no pinhole, the reference of the depth effect: add it.")
    names = OF_RATINGS
    assumed, powers = (_ratios if ratios else _latent)(design, asked)
    orders = "" if len(design.fixations) == 1 else f" ({design.fixation_order} order)"
    focus = " and ".join(in_focus(name) for name in fixations)
    shown = (
        f"{many(len(design.scenes), 'scene')}, the apertures {', '.join(design.apertures)} of a lens of "
        f"{design.focal_length_mm:g} mm, each scene with {focus}{orders}, {many(design.repetitions, 'repetition')}, "
        f"{many(design.catch_trials, 'catch trial')}. {design.response_scale.answered} Every subject "
        "judges every scene, in a random order from the seed that the data set records."
    )
    unjudged = _unjudged(design, asked.stated)
    sentences = criteria(asked.stated.rules, unjudged, catch_answers(analysis, design.catch_pictures))
    skipped = {*unjudged} if ratios else {*unjudged, "catch_factor"}
    table = rules_table(asked.stated, [name for name in names if name not in skipped])
    return Preregistered(
        "Preregistration: depth ratings by aperture and fixation",
        questions.hypotheses,
        questions.outcome,
        shown,
        [*sentences, *AFTERWARDS],
        table,
        [questions.outcome, questions.method, ROBUSTNESS_PLAN, *[CONFIDENCE_METHOD] * design.confidence],
        enough(powers, assumed),
        power_table(powers, _named(fixations)),
        neutral=_neutral(design, analysis),
        failed=FAILED_RATIOS if ratios else FAILED_OTHERS,
        rules_file=as_toml(asked.stated.rules, asked.used_bound if ratios else None, names),
    )


def _unjudged(design: DepthRatingDesign, stated: Stated) -> dict[str, str]:
    """Return rules that cannot be applied to answers of a design, with the reasons that the report will give."""
    reasons = {}
    trials = len(design.scenes) * design.repetitions
    analysis = design.response_scale.analysis
    if not design.catch_trials:
        reasons["catch_passed"] = NO_CATCH
    if not analysis.ratios:
        reasons |= {"repeat_factor": analysis.no_ratios, "lapses": analysis.no_ratios}
    if analysis.ratios and design.repetitions < 2:
        reasons["repeat_factor"] = NOT_REPEATED
    if analysis.ratios and trials < 3:
        reasons["lapses"] = FEW_OF_CONDITION
    if analysis.binary and design.catch_trials < MIN_ANSWERS:
        reasons["same_answer"] = NOT_DIFFERENT
    if analysis.binary or design.answer == "typed":
        reasons["first_press"] = NO_STARTS
    elif trials * len(design.apertures) * len(design.fixations) < MIN_STARTS:
        reasons["first_press"] = FEW_PLACES
    return {name: reason for name, reason in reasons.items() if getattr(stated.rules, name) is not None}


def _neutral(design: DepthRatingDesign, analysis: Analysis) -> list[str]:
    """Return the outcome-neutral tests, which show whether the data can answer the question."""
    tests = []
    if design.catch_trials:
        tests.append("Catch trials whose right answer is known are passed as the rules above ask.")
    if analysis.ratios and design.repetitions > 1:
        tests.append("Repeated ratings of one picture agree within the spread that the rules above allow.")
    tests.append("Answers to pictures that differ whatever blur does (the scenes) are not all the same.")
    tests.append(
        "Fewer than 5 % of the trials have dropped frames, and the recorded apertures are those of the design."
    )
    return tests


def _ratios(design: DepthRatingDesign, asked: Planned) -> tuple[str, dict[int, dict[str, float]]]:
    """Return the assumptions about ratios in words, and the power of their tests."""
    model = Model(**asked.effects)
    settings = model, design, asked.used_bound
    powers = {number: rise_power(*settings, number, EXPERIMENTS) for number in SUBJECTS}
    far = "" if len(design.fixations) == 1 else f" and of {model.far_effect:g} with the other objects in focus"
    assumed = (
        f"by {EXPERIMENTS:,} simulated experiments each, analysed as above, none excluded. Assumed: a mean depth "
        f"effect of {model.effect:g} with the first object in focus{far} (ratios), standard deviations of the log "
        f"depth effect of {model.between:g} over subjects and {model.between_scenes:g} over scenes, of one log rating "
        f"of {model.noise:g}."
    )
    return assumed, powers


def _latent(design: DepthRatingDesign, asked: Planned) -> tuple[str, dict[int, dict[str, float]]]:
    """Return the assumptions about ordinal answers or choices in words, and the power of their tests."""
    latent = LatentModel(**asked.effects)
    powers = latent_power(Study(latent, design), SUBJECTS)
    far = "" if len(design.fixations) == 1 else f" and of {latent.far_effect:g} with the other objects in focus"
    assumed = (
        "by simulated experiments with 8 and 24 subjects, analysed as above, none excluded, whose standard errors give "
        f"those of other numbers. Assumed: a ratio of the odds of a higher answer of {latent.effect:g} at the largest "
        f"aperture with the first object in focus{far}, standard deviations of its logarithm of {latent.between:g} "
        f"over subjects and {latent.between_scenes:g} over scenes."
    )
    return assumed, powers


def _named(fixations: Sequence[str]) -> dict[str, str]:
    """Return descriptions of the tests in the power analysis."""
    first, *others = fixations
    rest = " and ".join(others)
    return {
        "near_rise": f"{first}: rises with blur",
        "far_equivalent": f"{rest}: equivalent to zero",
        "interaction": f"{first} rises more than {rest}",
    }
