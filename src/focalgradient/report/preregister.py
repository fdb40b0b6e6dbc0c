"""Preregistrations: the plan of each task's report, without data, with number of subjects and checks of assumptions."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from numpy.random import default_rng

from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, NeckerDesign, load_design
from focalgradient.errors import InputError
from focalgradient.power import (
    CubeModel,
    LatentModel,
    Model,
    Observers,
    Study,
    latent_power,
    power,
    quick_cube_power,
    quick_power,
    run_here,
)
from focalgradient.progress import Progress
from focalgradient.report.conditions import task_plan
from focalgradient.report.cube import shown_cube
from focalgradient.report.document import Block, Heading, Paragraph, Table, as_html, as_markdown
from focalgradient.report.exclusions import CUBE_CATCH, criteria
from focalgradient.report.parts import Asked, Plan
from focalgradient.report.ratings import rating_plan, shown_ratings
from focalgradient.report.rules import Stated, as_toml
from focalgradient.report.thresholds import threshold_plan
from focalgradient.scales import Analysis, OrdinalSteps
from focalgradient.statistics.criteria import WORDING
from focalgradient.statistics.exclusions import quality
from focalgradient.statistics.hypotheses import check_bound
from focalgradient.statistics.questions import Kind
from focalgradient.statistics.thresholds import ATTENDING
from focalgradient.tasks import Task, task_named

__all__ = ["Preregistered", "preregistration"]

SUBJECTS = (6, 8, 10, 12, 16, 20, 24, 30, 40)
"""Sample sizes of the power analysis."""

EXPERIMENTS = 2000
"""Number of simulated experiments per sample size."""

TASK_SUBJECTS, TASK_EXPERIMENTS = (6, 10, 16, 24, 40), 200
"""The same for a user-defined task; the standard error of a power of .5 is then .035."""

WANTED = 0.8
"""Target power for every hypothesis: Cohen's (1988) convention."""

STOPPING = (
    "Data are collected until the stated number of subjects is in the analysis, after exclusions; no test is made "
    "before."
)
NEUTRAL = "They show that the data can answer the question, whatever the answer; they look at no effect."
AFTERWARDS = "Results are shown with and without exclusions; the file rules.toml holds the rules."
IN_WORDS = "In the words, and the tense, in which the report will describe it:"


Powers = Mapping[int, Mapping[str, float]]
"""Power of each test by number of subjects."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Preregistered:
    """Contents of a preregistration.

    Parameters
    ----------
    about
        Subject of the preregistration: the title after "Preregistration:".
    plan
        Hypotheses, primary outcome, design, exclusions and analysis.
    subjects
        Number of subjects with its justification; with `powers`, the assumptions behind them.
    powers, tests
        Power of the tests, and what each finds.
    neutral, failed
        Outcome-neutral tests, and procedure if assumptions fail, of a Registered Report.
    stated, judged
        Exclusion rules, and those that can be applied, for the table.
    """

    about: str
    plan: Plan
    subjects: str
    neutral: Sequence[str]
    failed: Sequence[str]
    powers: Powers = field(default_factory=dict)
    tests: Mapping[str, str] = field(default_factory=dict)
    stated: Stated | None = None
    judged: Sequence[str] = ()

    def blocks(self) -> list[Block]:
        """Return the document."""
        sections: dict[str, list[str | Table]] = {"Hypotheses": [*self.plan.questions.hypotheses]}
        for heading, texts in self.plan.sections("Subjects").items():
            sections[heading] = [*[IN_WORDS] * (heading in ("Design", "Exclusions", "Analysis")), *texts]
        if self.plan.questions.rules:
            sections["Exclusions"] += [AFTERWARDS, self._rules()]
        sections["Number of subjects"] = [self._enough(), self._power()] if self.powers else [self.subjects]
        registered: dict[str, list[str | Table]] = {
            "Outcome-neutral tests": [NEUTRAL, *self.neutral],
            "Stopping rule": [STOPPING],
            "Where assumptions fail": [*self.failed],
        }
        return [*_blocks(sections, 2), Heading("Registered Report"), *_blocks(registered, 3)]

    def _rules(self) -> Table:
        """Return a table of the applicable rules, with the numbers on which they depend."""
        assert self.stated is not None
        rows = []
        for name in self.judged:
            if (WORDING[name].defines or name) in self.judged:
                value = getattr(self.stated.rules, name)
                rows.append([name, "none" if value is None else str(value), WORDING[name].meaning.split("; false")[0]])
        return Table("Rules", ["rule", "value", "meaning"], rows)

    def _enough(self) -> str:
        """Return the smallest sample size with sufficient power for each hypothesis, and the assumptions."""
        enough = [number for number, found in self.powers.items() if min(found.values()) >= WANTED]
        number = f"None of the numbers tried reaches a power of {WANTED:.0%} for each hypothesis"
        if enough:
            number = (
                f"{enough[0]} subjects are the fewest of those tried with a power of {WANTED:.0%} or more for each "
                "hypothesis"
            )
        return f"{number}, {self.subjects}"

    def _power(self) -> Table:
        there = [test for test in self.tests if test in next(iter(self.powers.values()))]
        rows = [[str(subjects), *(f"{found[test]:.0%}" for test in there)] for subjects, found in self.powers.items()]
        header = ["subjects", *(self.tests[test] for test in there)]
        return Table("Share of simulated experiments that find", header, rows)


def _blocks(sections: Mapping[str, Sequence[str | Table]], level: int) -> Iterator[Block]:
    for heading, content in sections.items():
        yield Heading(heading, level)
        yield from (Paragraph(one) if isinstance(one, str) else one for one in content)


def preregistration(
    design_file: Path,
    *,
    bound: float | None = None,
    stated: Stated,
    ordinal: bool = False,
    model: Model | None = None,
    progress: Progress | None = None,
    **assumed: float | None,
) -> dict[str, bytes]:
    """Write the files of a preregistration: HTML, Markdown, and the rules file for `report --rules`.

    Parameters
    ----------
    design_file
        Design file (TOML).
    bound
        Equivalence bound; None: that of `stated`, else 1.2.
    stated
        Exclusion rules.
    ordinal
        True to analyse the answers as ordinal.
    model
        Model of the simulated subjects who rate depth in ratios, which replaces the two effects.
    progress
        Function called with the completed fraction of the power analysis of a user-defined task.
    assumed
        Effects and standard deviations for the power analysis, by the fields of `focalgradient.power.Model`,
        `LatentModel` or `CubeModel`: effect (for ratios, the depth effect at the largest aperture; for ordinal ratings,
        choices and the cube, an odds ratio), far_effect (with the fixations after the first), between, between_scenes,
        noise. None: those of the model.

    Raises
    ------
    InputError
        If the file is not a design, lacks information for the hypotheses, or a setting does not apply to it.
    """
    design = load_design(design_file)
    effects = {name: value for name, value in assumed.items() if value is not None}
    if model is not None:
        effects = dataclasses.asdict(model) | effects
    asked = Asked(stated, bound, progress=progress, effects=effects, ordinal=ordinal)
    check_bound("bound", asked.used_bound)
    task = task_named(design.task)
    given = {"bound": bound is not None, "ordinal": ordinal, "far_effect": "far_effect" in effects}
    if wrong := [name for name, is_given in given.items() if is_given and name not in task.settings_of_report]:
        raise InputError(
            f"{wrong[0]} is for depth ratings, but {design_file} is a design of {design.task}: leave it out."
        )
    text: Preregistered | None = task.preregistered and task.preregistered(design, asked)
    text = text or PREREGISTERED[task.analysis(design).kind](task, design, asked)
    title, blocks, rules = f"Preregistration: {text.about}", text.blocks(), text.plan.questions.rules
    files = {
        "preregistration.html": as_html(title, blocks).encode(),
        "preregistration.md": as_markdown(title, blocks).encode(),
    }
    if rules:
        files["rules.toml"] = as_toml(stated.rules, asked.used_bound if "bound" in rules else None, rules).encode()
    return files


AnyModel = TypeVar("AnyModel")


def _assuming(model: Callable[..., AnyModel], asked: Asked) -> AnyModel:
    """Return the model of simulated subjects with the assumed effects.

    Raises
    ------
    InputError
        If the model has no such standard deviation.
    """
    known = inspect.signature(model).parameters
    if wrong := [name for name in asked.effects if name not in known]:
        raise InputError(f"{wrong[0]} does not apply to the simulated answers of this design: leave it out.")
    return model(**asked.effects)


def preregister_ratings(task: Task, design: DepthRatingDesign, asked: Asked) -> Preregistered:
    """Write the preregistration of depth ratings.

    Raises
    ------
    InputError
        If a setting does not apply to the scale, or the design has no pinhole as reference.
    """
    scale, settings = design.response_scale, design.model_dump()
    analysis = scale.analysis
    if asked.ordinal and not isinstance(analysis, OrdinalSteps):
        raise InputError(
            f"ordinal is for answers in steps, but the design has scale = {design.scale!r}: set scale = 'steps'."
        )
    if analysis.ratios and "pinhole" not in design.apertures:
        raise InputError("apertures has no pinhole, the reference of the depth effect: add it.")
    unjudged = _unjudged(design, asked.stated)
    plan = rating_plan(
        *(task.analysis(design, asked.options), analysis, settings),
        shown=shown_ratings(settings),
        rules=asked.rules,
        unjudged=unjudged,
    )
    study = Study(_assuming(Model if analysis.ratios else LatentModel, asked), design, asked.used_bound)
    assumed, powers = (_ratios if analysis.ratios else _latent)(study)
    skipped = {"bound", *unjudged, *(() if analysis.ratios else ("catch_factor",))}
    return Preregistered(
        about="depth ratings by aperture and fixation",
        plan=plan,
        subjects=assumed,
        powers=powers,
        tests=study.tests,
        neutral=_neutral(design, analysis),
        failed=[FAILED_RATIOS if analysis.ratios else FAILED_OTHERS],
        stated=asked.stated,
        judged=[name for name in plan.questions.rules if name not in skipped],
    )


FAILED_RATIOS = (
    "Where subjects’ effects are not normally distributed, the test stated above still decides, and the bootstrap-t is "
    "reported beside it. The report draws the subjects’ own effects and the residuals by normal quantiles."
)
FAILED_OTHERS = (
    "Where the model does not converge, or cannot be fitted, the hypothesis is reported as not tested, with the "
    "reason; no other model takes its place. The report draws the subjects’ own slopes and the residuals by normal "
    "quantiles."
)


def _unjudged(design: DepthRatingDesign, stated: Stated) -> dict[str, str]:
    """Return rules that cannot be applied to answers of a design, with the reasons that the report will give.

    They are those that cannot be applied to answers of three people to whom scenes differ. Whether ratings of scenes
    differ enough for `same_answer` depends on the answers, not on the design.
    """
    scale, rng = design.response_scale, default_rng(0)
    levels = dict(zip(design.scenes, np.linspace(-1, 1, len(design.scenes)), strict=True))
    rows = [
        (f"sub-{who}", *(getattr(trial, name) for name in SHOWN), scale.simulated(levels.get(trial.scene, 0.0), 1.0))
        for who in ("01", "02", "03")
        for trial in design.trials(who)
        if trial.phase == "main"
    ]
    table = pd.DataFrame(rows, columns=["participant_id", *SHOWN, "rating"]).assign(response_time=1.0, dropped_frames=0)
    if not scale.analysis.binary and design.answer != "typed":
        table["start"] = [scale.simulated(level, 1.0) for level in rng.uniform(-1, 1, len(table))]
    unjudged = quality(table, stated.rules, scale.analysis)[1].unjudged
    return {one.rule: one.reason for one in unjudged if scale.analysis.binary or one.rule != "same_answer"}


SHOWN = ("trial", "scene", "aperture", "aperture_mm", "fixation", "interval", "catch")
"""Fields of a trial that are columns of a table of ratings."""


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


def _ratios(study: Study) -> tuple[str, Powers]:
    """Return the assumptions about ratios in words, and the power of their tests."""
    model: Any = study.model
    powers = {number: quick_power(study, number, EXPERIMENTS) for number in SUBJECTS}
    far = "" if len(study.design.fixations) == 1 else f" and of {model.far_effect:g} with the other objects in focus"
    assumed = (
        f"by {EXPERIMENTS:,} simulated experiments each, analysed as above, none excluded. Assumed: a mean depth "
        f"effect of {model.effect:g} with the first object in focus{far} (ratios), standard deviations of the log "
        f"depth effect of {model.between:g} over subjects and {model.between_scenes:g} over scenes, of one log rating "
        f"of {model.noise:g}."
    )
    return assumed, powers


def _latent(study: Study) -> tuple[str, Powers]:
    """Return the assumptions about ordinal answers or choices in words, and the power of their tests."""
    latent: Any = study.model
    far = "" if len(study.design.fixations) == 1 else f" and of {latent.far_effect:g} with the other objects in focus"
    assumed = (
        "by simulated experiments with 8 and 24 subjects, analysed as above, none excluded, whose standard errors give "
        "those of other numbers, so that a power is accurate to some 5 percentage points. Assumed: a ratio of the odds "
        f"of a higher answer of {latent.effect:g} at the largest aperture with the first object in focus{far}, "
        f"standard deviations of its logarithm of {latent.between:g} over subjects and {latent.between_scenes:g} over "
        "scenes."
    )
    return assumed, latent_power(study, SUBJECTS)


def preregister_cube(task: Task, design: NeckerDesign, asked: Asked) -> Preregistered:
    """Write the preregistration of reports on the cube.

    Raises
    ------
    InputError
        If the design contains no comparison.
    """
    model, rules = _assuming(CubeModel, asked), asked.rules
    study = Study(model, design)
    judged = quality(study.table(1, study.stream(1)), rules)[1]
    unjudged = {one.rule: one.reason for one in judged.unjudged}
    plan = Plan(
        task.analysis(design, asked.options), shown_cube(design.model_dump()), criteria(rules, unjudged, CUBE_CATCH)
    )
    return Preregistered(
        about="the turning Necker cube and focal gradients",
        plan=plan,
        subjects=f"by {EXPERIMENTS:,} simulated experiments each, drawn from one pool of 400 simulated people and "
        "analysed as above (paired t-tests, the primary one uncorrected, Holm’s p for the others), none excluded. "
        f"Assumed: a ratio of odds of {model.effect:g} at the largest aperture, its standard deviation over subjects "
        f"(of its logarithm) of {model.between:g}, a nonrigid share of {model.nonrigid:g} without blur, and durations "
        "as 22 people reported of a lattice.",
        powers=quick_cube_power(study, SUBJECTS, EXPERIMENTS),
        tests=study.tests,
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
        stated=asked.stated,
        judged=[name for name in plan.questions.rules if name not in unjudged],
    )


def preregister_thresholds(task: Task, design: BlurThresholdDesign, asked: Asked) -> Preregistered:
    """Write the preregistration of thresholds of blur, or of depth from blur.

    Raises
    ------
    InputError
        If an effect is given, as no hypothesis is tested.
    """
    if asked.effects:
        raise InputError(f"{min(asked.effects)} is for hypothesis tests, but {design.task} has none: leave it out.")
    return Preregistered(
        about=f"thresholds of {design.thresholds_of}",
        plan=threshold_plan(task.analysis(design, asked.options), design.model_dump()),
        subjects="State the number of participants and its reason: no test is made, but focalgradient power "
        "blur-threshold gives how precisely a number of them determines the mean.",
        neutral=[
            f"Participants answer {ATTENDING:.0%} or more of the catch trials, at the greatest level, correctly.",
            "The levels reach beyond the thresholds: no interval of a threshold ends within 10 % of their ends.",
        ],
        failed=[
            "Where a psychometric function cannot be fitted, or its interval ends within 10 % of an end of the "
            "levels, the report names the participant; the mean is over those with a fitted function.",
        ],
    )


def preregister_conditions(task: Task, design: Any, asked: Asked) -> Preregistered:
    """Write the preregistration of a task whose conditions are compared.

    Raises
    ------
    InputError
        If an effect is given, which only the task's simulated observer defines.
    """
    if asked.effects:
        stated = min(asked.effects)
        raise InputError(f"{stated} cannot go with {task.called}, whose simulated observer has its own: leave it out.")
    questions, powers, named = task.analysis(design), dict[int, Mapping[str, float]](), dict[str, str]()
    settings = design.model_dump(mode="json")
    subjects = "State the number of subjects and its reason: the task has no simulated observer."
    if not questions.every:
        subjects = "State the number of subjects and its reason: no test is made whose power would give it."
    elif task.simulates:
        observers = Observers(task)
        study = Study(observers, design)
        experiments = run_here(study, TASK_SUBJECTS, TASK_EXPERIMENTS, asked.progress)
        powers = {one.subjects: one.found for one in power(experiments)}
        named = dict(study.tests)
        subjects = (
            f"by {TASK_EXPERIMENTS} simulated experiments each with the task’s simulated observers, analysed as above. "
            "Their effect is that of the observer in the task’s class."
        )
        if observers.are_alike(design):
            subjects += " They do not differ from one another: with people, who do, the power is lower."
    neutral = "The design has no catch trials; state which trials show that participants attended."
    if catches := settings.get("catch_trials"):
        neutral = f"Catch trials ({catches}) are answered as their trials ask."
    return Preregistered(
        about=task.title,
        plan=task_plan(task, design, questions),
        subjects=subjects,
        powers=powers,
        tests=named,
        neutral=[neutral],
        failed=[
            "The tests rest on normally distributed effects of the subjects, and stay those that decide. State here "
            "what else is reported where they are not."
        ],
    )


PREREGISTERED: Mapping[Kind, Callable[[Task, Any, Asked], Preregistered]] = {
    "conditions": preregister_conditions,
    "ratings": preregister_ratings,
    "cube": preregister_cube,
    "thresholds": preregister_thresholds,
}
"""Preregistrations by the kind of the task's analysis."""
