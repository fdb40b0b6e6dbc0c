"""The text of a preregistration, written from a design before there are data, in the words of the later report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, NeckerDesign, load_design
from focalgradient.errors import InputError
from focalgradient.power import (
    CubeModel,
    CubeStudy,
    LatentModel,
    LatentStudy,
    Model,
    latent_power,
    quick_cube_power,
    rise_power,
)
from focalgradient.report.analysed import BOUND
from focalgradient.report.document import Block, Heading, Paragraph, Table, as_html, as_markdown
from focalgradient.report.exclusions import CUBE_CATCH, catch_answers, criteria
from focalgradient.report.plans import Plan, in_focus, plan_of
from focalgradient.report.rules import MEANING, Stated, as_toml
from focalgradient.report.tables import many
from focalgradient.report.thresholds import methods_thresholds, unit_of
from focalgradient.report.words import analysis_necker
from focalgradient.scales import OrdinalSteps
from focalgradient.statistics.criteria import OF_CUBE, OF_RATINGS
from focalgradient.statistics.exclusions import (
    FEW_OF_CONDITION,
    FEW_PLACES,
    NO_CATCH,
    NO_STARTS,
    NOT_DIFFERENT,
    NOT_REPEATED,
)
from focalgradient.statistics.hypotheses import check_bound
from focalgradient.statistics.judging import FEW, FEW_STARTS

__all__ = ["preregistration"]

SUBJECTS = (6, 8, 10, 12, 16, 20, 24, 30, 40)
EXPERIMENTS = 2000
WANTED = 0.8
"""Power that the number of subjects is to reach, for all of the hypotheses: Cohen's (1988) convention."""


def preregistration(
    design_file: Path,
    *,
    bound: float | None = None,
    stated: Stated,
    effect: float | None = None,
    far_effect: float | None = None,
    ordinal: bool = False,
    model: Model | None = None,
) -> dict[str, bytes]:
    """Files of a preregistration: HTML, Markdown, and the rules as a file for `report --rules`.

    Parameters
    ----------
    design_file
        The design (TOML).
    bound
        Of equivalence; without it that of `stated`, or 1.2.
    stated
        Rules of exclusion.
    effect, far_effect
        Effect for which the number of subjects is found: of ratios the rise at the largest aperture; of steps and
        choices, and of the cube, a ratio of odds. `far_effect` is that of the fixations after the first. None: as in
        `focalgradient.power`.
    ordinal
        Whether the report is to take the answers for steps.
    model
        Of the simulated subjects that rate depth in ratios, in place of the two effects.

    Raises
    ------
    InputError
        If the file is no design, or lacks what the hypotheses need, or a setting does not concern it.
    """
    design = load_design(design_file)
    used = next((one for one in (bound, stated.bound) if one is not None), BOUND)
    check_bound("bound", used)
    effects = {name: one for name, one in (("effect", effect), ("far_effect", far_effect)) if one is not None}
    of_ratings = isinstance(design, DepthRatingDesign)
    if not of_ratings and (bound is not None or ordinal or far_effect is not None):
        given = "bound" if bound is not None else "ordinal" if ordinal else "far_effect"
        raise InputError(f"{given} is of depth ratings, but {design_file} is a design of {design.task}: leave it out.")
    if isinstance(design, DepthRatingDesign):
        text = _of_ratings(design, used, stated, effects, model, ordinal=ordinal)
        rules = as_toml(stated.rules, used if text.has_bound else None, OF_RATINGS)
    elif isinstance(design, NeckerDesign):
        text, rules = _of_cube(design, stated, effects), as_toml(stated.rules, None, OF_CUBE)
    elif isinstance(design, BlurThresholdDesign):
        if effects:
            raise InputError(f"effect is of a test, but {design_file} is a design of {design.task}: leave it out.")
        text, rules = _of_threshold(design), ""
    else:
        raise InputError(
            f"{design_file} is a design of {design.task}: a preregistration is written for depthrating, necker and "
            "blurthreshold."
        )
    blocks = text.blocks()
    files = {
        "preregistration.html": as_html(text.title, blocks).encode(),
        "preregistration.md": as_markdown(text.title, blocks).encode(),
    }
    return files | ({"rules.toml": rules.encode()} if rules else {})


@dataclass(frozen=True, slots=True)
class _Text:
    """What a preregistration states, in the order of its headings."""

    title: str
    hypotheses: list[str]
    outcome: str
    shown: str
    exclusions: list[str]
    rules: Table | None
    analysis: list[str]
    subjects: str
    power: Table | None
    has_bound: bool = False

    def blocks(self) -> list[Block]:
        tables = [[table] if table else [] for table in (self.rules, self.power)]
        return [
            Heading("Hypotheses"),
            *map(Paragraph, self.hypotheses),
            Heading("Primary outcome"),
            Paragraph(self.outcome),
            Heading("Design"),
            Paragraph(self.shown),
            Heading("Exclusions"),
            *map(Paragraph, self.exclusions),
            *tables[0],
            Heading("Analysis"),
            Paragraph("In the words in which the report will describe it:"),
            *map(Paragraph, self.analysis),
            Heading("Number of subjects"),
            Paragraph(self.subjects),
            *tables[1],
        ]


def _of_ratings(
    design: DepthRatingDesign,
    bound: float,
    stated: Stated,
    effects: Mapping[str, float],
    model: Model | None,
    *,
    ordinal: bool,
) -> _Text:
    analysis = design.response_scale.analysis
    if ordinal and not isinstance(analysis, OrdinalSteps):
        raise InputError(
            f"ordinal is of answers in steps, but the design has scale = {design.scale!r}: set scale = 'steps' in it."
        )
    plan = plan_of(analysis, design.fixations, len(design.scenes), design.model_dump(), bound)
    ratios = analysis.ratios
    if ratios and "pinhole" not in design.apertures:
        raise InputError("apertures has no pinhole, from which the rise is measured: add it.")
    assumed, powers = (_ratios if ratios else _latent)(design, bound, effects, model)
    orders = "" if len(design.fixations) == 1 else f" ({design.fixation_order} order)"
    focus = " and ".join(in_focus(name) for name in plan.fixations)
    shown = (
        f"{many(len(design.scenes), 'scene')}, the apertures {', '.join(design.apertures)} of a lens of "
        f"{design.focal_length_mm:g} mm, each scene with {focus}{orders}, {many(design.repetitions, 'repetition')}, "
        f"{many(design.catch_trials, 'catch trial')}. {design.response_scale.answered} Every subject "
        "judges every scene, in a random order from the seed that the data set records."
    )
    unjudged = _unjudged(design, stated)
    sentences = criteria(stated.rules, unjudged, catch_answers(analysis, design.catch_pictures))
    skipped = {*unjudged} if ratios else {*unjudged, "catch_factor"}
    table = _rules(stated, [name for name in OF_RATINGS if name not in skipped])
    return _Text(
        "Preregistration: depth ratings by aperture and fixation",
        plan.hypotheses,
        plan.outcome,
        shown,
        [*sentences, *AFTERWARDS],
        table,
        [plan.outcome, plan.analysis],
        _enough(powers, assumed),
        _power(powers, _named(plan)),
        has_bound=ratios,
    )


AFTERWARDS = ("Results without exclusions stand beside those with them; the file rules.toml holds the rules.",)


def _unjudged(design: DepthRatingDesign, stated: Stated) -> dict[str, str]:
    """Rules that cannot be applied to answers of a design, with the reasons that the report will give."""
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
    if analysis.binary and design.catch_trials < FEW:
        reasons["same_answer"] = NOT_DIFFERENT
    if analysis.binary or design.answer == "typed":
        reasons["first_press"] = NO_STARTS
    elif trials * len(design.apertures) * len(design.fixations) < FEW_STARTS:
        reasons["first_press"] = FEW_PLACES
    return {name: reason for name, reason in reasons.items() if getattr(stated.rules, name) is not None}


def _ratios(
    design: DepthRatingDesign, bound: float, effects: Mapping[str, float], model: Model | None
) -> tuple[str, dict[int, dict[str, float]]]:
    """What is assumed of ratios, in words, and the power of their tests."""
    model = replace(model or Model(), **effects)
    powers = {subjects: rise_power(model, design, bound, subjects, EXPERIMENTS) for subjects in SUBJECTS}
    far = "" if len(design.fixations) == 1 else f" and of {model.far_effect:g} with the other objects in focus"
    assumed = (
        f"by {EXPERIMENTS:,} simulated experiments each, analysed as above, none excluded. Assumed: a mean rise of "
        f"{model.effect:g} with the first object in focus{far} (ratios), standard deviations of the log rise of "
        f"{model.between:g} over subjects and {model.between_scenes:g} over scenes, of one log rating of "
        f"{model.noise:g}."
    )
    return assumed, powers


def _latent(
    design: DepthRatingDesign, bound: float, effects: Mapping[str, float], model: Model | None
) -> tuple[str, dict[int, dict[str, float]]]:
    """What is assumed of steps and choices, in words, and the power of their tests."""
    latent = LatentModel(**effects)
    powers = latent_power(LatentStudy(latent, design), SUBJECTS)
    far = "" if len(design.fixations) == 1 else f" and of {latent.far_effect:g} with the other objects in focus"
    assumed = (
        "by simulated experiments with 8 and 24 subjects, analysed as above, none excluded, whose standard errors give "
        f"those of other numbers. Assumed: a ratio of the odds of a higher answer of {latent.effect:g} at the largest "
        f"aperture with the first object in focus{far}, standard deviations of its logarithm of {latent.between:g} "
        f"over subjects and {latent.between_scenes:g} over scenes."
    )
    return assumed, powers


def _named(plan: Plan) -> dict[str, str]:
    """The tests whose power is given, in words."""
    first, *others = plan.fixations
    rest = " and ".join(others)
    return {
        "near_rise": f"{first}: rises with blur",
        "far_equivalent": f"{rest}: equivalent to zero",
        "interaction": f"{first} rises more than {rest}",
    }


def _of_cube(design: NeckerDesign, stated: Stated, effects: Mapping[str, float]) -> _Text:
    model = CubeModel(**effects)
    study = CubeStudy(model, design)
    powers = quick_cube_power(study, SUBJECTS, EXPERIMENTS)
    largest = max(design.strengths_mm)
    claims = {
        "nonrigid_longer": ("nonrigid", "raises"),
        "nonrigid_shorter": ("rigid", "lowers"),
    }
    hypotheses = [
        f"H{number}{' (primary)' if number == 1 else ''}. Blur that agrees with the {claims[test][0]} reading "
        f"({largest:g} mm) {claims[test][1]} the nonrigid share of the time."
        for number, test in enumerate(study.tests, start=1)
    ]
    first = claims[next(iter(study.tests))][0]
    outcome = (
        "The nonrigid share of the time with one of the two readings: that with blur that agrees with the "
        f"{first} reading ({largest:g} mm) less that without blur, one value for each subject."
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
        "above (paired t-tests, Holm’s p over all gradients and strengths), none excluded. Assumed: a ratio of odds "
        f"of {model.effect:g} at the largest aperture, its standard deviation over subjects (of its logarithm) of "
        f"{model.between:g}, a nonrigid share of {model.nonrigid:g} without blur, and durations as 22 people reported "
        "of a lattice."
    )
    unjudged = {}
    if not design.catch_trials and stated.rules.catch_passed is not None:
        unjudged["catch_passed"] = NO_CATCH
    return _Text(
        "Preregistration: the turning Necker cube and focal gradients",
        hypotheses,
        outcome,
        shown,
        [*criteria(stated.rules, unjudged, CUBE_CATCH), *AFTERWARDS],
        _rules(stated, [name for name in OF_CUBE if name not in unjudged]),
        [analysis_necker(stated.rules.shortest_both)],
        _enough(powers, assumed),
        _power(powers, study.tests),
    )


def _of_threshold(design: BlurThresholdDesign) -> _Text:
    settings = design.model_dump()
    what = "of blur" if design.judged == "blur" else "of depth from blur"
    return _Text(
        "Preregistration: thresholds " + what,
        ["No hypothesis is tested: thresholds are estimated, with their intervals."],
        f"The geometric mean over participants of the threshold {what} ({unit_of(settings)}).",
        f"{many(len(design.scenes), 'scene')}, {many(design.repetitions, 'repetition')}, "
        f"{many(design.catch_trials, 'catch trial')}, levels from {design.least_level:g} to {design.most_level:g} "
        f"{unit_of(settings)}.",
        ["Nobody is left out of the mean; the mean without those who miss catch trials stands beside it."],
        None,
        [*methods_thresholds(settings)],
        "State the number of participants and its reason: there is no test whose power could give it.",
        None,
    )


def _rules(stated: Stated, names: list[str]) -> Table:
    """Rules that apply, and those numbers that they need."""
    rows = []
    needed = {"lapse_factor": "lapses", "catch_factor": "catch_passed", "catch_share": "catch_passed"}
    for name in names:
        if needed.get(name, name) in names:
            value = getattr(stated.rules, name)
            rows.append([name, "none" if value is None else str(value), MEANING[name].split("; false")[0]])
    return Table("Rules", ["rule", "value", "meaning"], rows)


def _enough(powers: Mapping[int, Mapping[str, float]], assumed: str) -> str:
    subjects = next((number for number, found in powers.items() if min(found.values()) >= WANTED), None)
    number = (
        f"{subjects} subjects are the fewest of those tried with a power of {WANTED:.0%} or more for each hypothesis"
        if subjects
        else f"None of the numbers tried reaches a power of {WANTED:.0%} for each hypothesis"
    )
    return f"{number}, {assumed} These are assumptions: state your own effect."


def _power(powers: Mapping[int, Mapping[str, float]], tests: Mapping[str, str]) -> Table:
    there = [test for test in tests if test in next(iter(powers.values()))]
    rows = [[str(subjects), *(f"{found[test]:.0%}" for test in there)] for subjects, found in powers.items()]
    header = ["subjects", *(tests[test] for test in there)]
    return Table("Share of simulated experiments that find", header, rows)
