"""Preregistration of a user-defined task."""

from __future__ import annotations

from typing import Any

from focalgradient.errors import InputError
from focalgradient.power import Observers, Study, power, run_here
from focalgradient.power.own_tasks import planned_of, task_questions
from focalgradient.report.conditions import methods_of_task
from focalgradient.report.preregistered import Planned, Preregistered, enough, power_table
from focalgradient.statistics.conditions import level_text
from focalgradient.statistics.wording import many
from focalgradient.tasks import Task

__all__ = ["preregister_task"]

SUBJECTS = (6, 10, 16, 24, 40)
"""Sample sizes of the power analysis."""

EXPERIMENTS = 200
"""Number of simulated experiments per sample size; the standard error of a power of .5 is then .035."""


def preregister_task(task: Task, design: Any, asked: Planned) -> Preregistered:
    """Write the preregistration of a user-defined task.

    Raises
    ------
    InputError
        If an effect is given, which only the task's simulated observer defines.
    """
    if asked.effects:
        raise InputError(f"effect cannot go with {task.called}, whose simulated observer has its own: leave it out.")
    tests = planned_of(task, design)
    settings = design.model_dump(mode="json")
    subjects, table = "State the number of subjects and its reason: the task has no simulated observer.", None
    if not tests:
        subjects = "State the number of subjects and its reason: no test is made whose power would give it."
    elif task.simulates:
        study = Study(Observers(task), design, seed=asked.seed)
        found = {one.subjects: one.found for one in power(run_here(study, SUBJECTS, EXPERIMENTS))}
        assumed = (
            f"by {EXPERIMENTS} simulated experiments each with the task’s simulated observers, analysed as above. "
            "Their effect is that of the observer in the task’s class."
        )
        subjects, table = enough(found, assumed), power_table(found, study.tests)
    levels = "; ".join(f"{name}: {', '.join(map(level_text, values))}" for name, values in task.factors(design).items())
    neutral = (
        [f"Catch trials ({settings['catch_trials']}) are answered as their trials ask."]
        if settings.get("catch_trials")
        else ["The design has no catch trials; state which trials show that participants attended."]
    )
    return Preregistered(
        f"Preregistration: {task.title}",
        task_questions(task, design).hypotheses
        or ["No hypothesis is tested: means are estimated, with their intervals."],
        f"The {tests[0].name}, one value for each subject." if tests else "The means of each condition.",
        f"{levels or 'One condition'}; {many(int(settings.get('repetitions', 1)), 'repetition')}, in random order "
        "from the seed that the data set records.",
        ["Nobody is left out."],
        None,
        methods_of_task(task, settings, tests),
        subjects,
        table,
        neutral=neutral,
        failed=[
            "The tests rest on normally distributed effects of the subjects, and stay those that decide. State here "
            "what else is reported where they are not."
        ],
    )
