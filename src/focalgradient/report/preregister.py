"""Files of a preregistration, generated from a design in the wording of the later report."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from focalgradient.design import load_design
from focalgradient.errors import InputError
from focalgradient.power import Model
from focalgradient.report.document import as_html, as_markdown
from focalgradient.report.preregister_cube import preregister_cube
from focalgradient.report.preregister_ratings import preregister_ratings
from focalgradient.report.preregister_task import preregister_task
from focalgradient.report.preregister_thresholds import preregister_thresholds
from focalgradient.report.preregistered import Planned, Preregistered
from focalgradient.report.rules import Stated
from focalgradient.statistics.hypotheses import check_bound
from focalgradient.tasks import task_named

__all__ = ["preregistration"]

PREREGISTERED: Mapping[str, Callable[[Any, Planned], Preregistered]] = {
    "depthrating": preregister_ratings,
    "necker": preregister_cube,
    "blurthreshold": preregister_thresholds,
}
"""Preregistrations of the built-in tasks, used instead of `Task.preregistered`."""


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
    """Write the files of a preregistration: HTML, Markdown, and the rules file for `report --rules`.

    Parameters
    ----------
    design_file
        Design file (TOML).
    bound
        Equivalence bound; None: that of `stated`, else 1.2.
    stated
        Exclusion rules.
    effect, far_effect
        Effect size for the power analysis: for ratios, the depth effect at the largest aperture; for ordinal ratings,
        choices and the cube, an odds ratio. `far_effect` applies to the fixations after the first. None: as in
        `focalgradient.power`.
    ordinal
        True to analyse the answers as ordinal.
    model
        Model of the simulated subjects who rate depth in ratios, which replaces the two effects.

    Raises
    ------
    InputError
        If the file is not a design, lacks information for the hypotheses, or a setting does not apply to it.
    """
    design = load_design(design_file)
    effects = {name: one for name, one in (("effect", effect), ("far_effect", far_effect)) if one is not None}
    if model is not None:
        effects = dataclasses.asdict(model) | effects
    asked = Planned(stated, bound, effects, ordinal)
    check_bound("bound", asked.used_bound)
    task = task_named(design.task)
    given = {"bound": bound is not None, "ordinal": ordinal, "far_effect": far_effect is not None}
    if wrong := [name for name, is_given in given.items() if is_given and name not in task.settings_of_report]:
        raise InputError(
            f"{wrong[0]} is for depth ratings, but {design_file} is a design of {design.task}: leave it out."
        )
    preregistered: Callable[..., Preregistered | None] | None = PREREGISTERED.get(task.name, task.preregistered)
    text = (preregistered and preregistered(design, asked)) or preregister_task(task, design, asked)
    blocks = text.blocks()
    files = {
        "preregistration.html": as_html(text.title, blocks).encode(),
        "preregistration.md": as_markdown(text.title, blocks).encode(),
    }
    return files | ({"rules.toml": text.rules_file.encode()} if text.rules_file else {})
