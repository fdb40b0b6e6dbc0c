"""Analysis of tasks whose level an adaptive procedure sets, and of answers that are correct or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from focalgradient.errors import InputError, described
from focalgradient.files.columns import Column
from focalgradient.scales import Held
from focalgradient.tasks.steps import control_of

if TYPE_CHECKING:
    from focalgradient.statistics.questions import Analysis
    from focalgradient.tasks.base import Task

__all__ = ["adapted_analysis", "compared_answers", "compared_factors", "constant_levels", "guessed"]

GUESS_RATE = 0.5
"""Guess rate of tasks without a described control: two alternatives."""


def adapted_analysis(task: Task, design: Any) -> Analysis | None:
    """Return the questions about the thresholds of a task; None if no procedure sets one level of correct answers."""
    judged = _judged(task, design)
    if len(task.adapted_fields) != 1 or len(judged) != 1:
        return None
    from focalgradient.statistics.adaptive import adapted_questions  # with pandas and SciPy

    [level], [right] = task.adapted_fields, judged
    factors = _factors(task, design)
    guess, keys = guessed(task, design, right)
    compared = {name: levels for name, levels in factors.items() if name not in keys}
    unit, adaptive = _columns(task, design)[level].units or "", not constant_levels(task, design)
    return adapted_questions(level, right, compared, unit, guess, adaptive=adaptive)


def constant_levels(task: Task, design: Any) -> Mapping[str, tuple[object, ...]]:
    """Return the levels of constant stimuli, by field: those of the trials, which no procedure replaces."""
    trials = _main_trials(design)
    if any(task.adapted(design, trial, ()) != trial for trial in trials):
        return {}
    levels = {name: tuple(sorted({getattr(trial, name) for trial in trials})) for name in task.adapted_fields}
    return {name: found for name, found in levels.items() if len(found) > 1}


def compared_answers(task: Task, design: Any) -> list[str]:
    """Return the answers of a task to be tested, `correct` first.

    The choice that `correct` judges is left out: its mean over alternatives, each of which is correct in some trials,
    is the preference for one of them. If no other answer is left, all are returned.
    """
    names = sorted(task.measures(design.model_dump(mode="json")), key="correct".__ne__)
    if names[:1] != ["correct"] or not task.described or task.adjusts:
        return names
    given = [*map(_answers(task, design), _main_trials(design))]
    right = [[bool(getattr(one, "correct", False)) for one in answers] for answers in given]
    if {*map(any, zip(*right, strict=True))} != {True}:
        return names

    def is_choice(name: str) -> bool:
        values = [[getattr(one, name, None) for one in answers] for answers in given]
        decides = all(len({*zip(*both, strict=True)}) == len({*both[0]}) for both in zip(values, right, strict=True))
        return decides and all(one == values[0] for one in values)

    return ["correct", *(name for name in names[1:] if not is_choice(name))]


def compared_factors(task: Task, design: Any) -> Mapping[str, tuple[object, ...]]:
    """Return the factors of a task whose answers are correct or not, without those that are the correct answer.

    The interval of a stimulus, for example, is varied so that it cannot be known, not to be compared. If no other
    factor is left, all are returned.
    """
    factors = _factors(task, design)
    ways = {
        name: count for right in _judged(task, design) for name, count in _right_answers(task, design, right).items()
    }
    return {name: levels for name, levels in factors.items() if ways.get(name) != len(levels)} or factors


def _factors(task: Task, design: Any) -> Mapping[str, tuple[object, ...]]:
    factors = task.factors(design)
    if not isinstance(factors, Mapping):
        raise InputError(
            f"factors of {task.called} gives {described(factors)}, but must give the levels of each condition, such as "
            '{"pedestal": (0.0, 0.75)}.'
        )
    return factors


def _judged(task: Task, design: Any) -> list[str]:
    """Return the answer `correct`; if there is none, all answers that are true or false."""
    truths = {name for name, column in _columns(task, design).items() if column.form == "bool"}
    judged = [name for name in task.measures(design.model_dump(mode="json")) if name in truths]
    return ["correct"] if "correct" in judged else judged


def _columns(task: Task, design: Any) -> Mapping[str, Column]:
    return {column.name: column for column in task.columns(design.model_dump(mode="json"))}


def guessed(task: Task, design: Any, right: str) -> tuple[float, Mapping[str, int]]:
    """Return the guess rate, and the fields of a trial that decide which answer is correct, with the number of ways.

    The guess rate is the share of the control's values that are correct; 0 if it is the same value in all trials, as
    with yes and no.

    Parameters
    ----------
    task, design
        Task and design.
    right
        Field of the answer that is true if it was correct.
    """
    if not task.described or task.adjusts:
        return GUESS_RATE, {}
    ways = list(map(_correct(task, design, right), _main_trials(design)))
    if not ways[0]:
        return GUESS_RATE, {}
    rate = sum(map(sum, ways)) / sum(map(len, ways)) if len({*ways}) > 1 else 0.0
    return rate, _right_answers(task, design, right)


def _right_answers(task: Task, design: Any, right: str) -> Mapping[str, int]:
    """Return the fields of a trial that decide which answer is correct, with the number of ways in which they do."""
    if not task.described or task.adjusts:
        return {}
    correct, trial = _correct(task, design, right), _main_trials(design)[0]
    counts = {
        name: len({correct(replace(trial, **{name: level})) for level in levels})
        for name, levels in _factors(task, design).items()
        if hasattr(trial, name)
    }
    return {name: count for name, count in counts.items() if count > 1}


def _main_trials(design: Any) -> list[Any]:
    """Return the main trials of a participant as planned, without catch trials."""
    return [trial for trial in design.trials("01") if trial.phase == "main" and not trial.catch]


def _correct(task: Task, design: Any, right: str) -> Callable[[Any], tuple[bool, ...]]:
    """Return the function of a trial that says of each value of the control whether it is correct."""
    answers = _answers(task, design)
    return lambda trial: tuple(bool(getattr(answer, right)) for answer in answers(trial))


def _answers(task: Task, design: Any) -> Callable[[Any], list[Any]]:
    """Return the function of a trial that gives the answer for each value of the control."""
    words = design.words()

    def answers(trial: Any) -> list[Any]:
        shown = task.adapted(design, trial, ())
        control = control_of(task, design, words, shown, "01")
        times = {"onset": 0.0, "response_time": 1.0, "dropped_frames": 0}
        values = () if isinstance(control, Held) else control.reached()
        return [task.answered(design, shown, value, **times) for value in values]

    return answers
