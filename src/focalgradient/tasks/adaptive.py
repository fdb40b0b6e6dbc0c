"""Analysis of tasks whose level an adaptive procedure sets, with the guess rate of their control."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from focalgradient.scales import Held
from focalgradient.tasks.steps import control_of

if TYPE_CHECKING:
    from focalgradient.statistics.questions import Analysis
    from focalgradient.tasks.base import Task

__all__ = ["adapted_analysis", "guessed"]

GUESS_RATE = 0.5
"""Guess rate of tasks without a described control: two alternatives."""


def adapted_analysis(task: Task, design: Any) -> Analysis | None:
    """Return the questions about the thresholds of a task; None if no procedure sets one level of correct answers."""
    settings = design.model_dump(mode="json")
    columns = {column.name: column for column in task.columns(settings)}
    judged = [name for name in task.measures(settings) if columns[name].form == "bool"]
    if "correct" in judged:
        judged = ["correct"]
    if len(task.adapted_fields) != 1 or len(judged) != 1:
        return None
    from focalgradient.statistics.adaptive import adapted_questions  # with pandas and SciPy

    [level], [right] = task.adapted_fields, judged
    factors = dict(task.factors(design))
    guess, keys = guessed(task, design, right)
    compared = {name: levels for name, levels in factors.items() if name not in keys}
    return adapted_questions(level, right, compared, columns[level].units or "", guess)


def guessed(task: Task, design: Any, right: str) -> tuple[float, frozenset[str]]:
    """Return the guess rate, and the fields of a trial that decide which answer is correct.

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
        return GUESS_RATE, frozenset()
    words, main = design.words(), [one for one in design.trials("01") if one.phase == "main" and not one.catch]

    def correct(trial: Any) -> tuple[bool, ...]:
        shown = task.adapted(design, trial, ())
        control = control_of(task, design, words, shown, "01")
        times = {"onset": 0.0, "response_time": 1.0, "dropped_frames": 0}
        values = () if isinstance(control, Held) else control.reached()
        return tuple(bool(getattr(task.answered(design, shown, value, **times), right)) for value in values)

    ways = [correct(trial) for trial in main]
    if not ways[0]:
        return GUESS_RATE, frozenset()
    keys = frozenset(
        name
        for name, levels in task.factors(design).items()
        if hasattr(main[0], name) and any(correct(replace(main[0], **{name: level})) != ways[0] for level in levels)
    )
    return (sum(map(sum, ways)) / sum(map(len, ways)) if len({*ways}) > 1 else 0.0), keys
