"""The files of a preregistration, written from a design before there are data, in the words of the later report."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from focalgradient.design import load_design
from focalgradient.errors import InputError
from focalgradient.power import Model
from focalgradient.report.document import as_html, as_markdown
from focalgradient.report.preregistered import Planned
from focalgradient.report.rules import Stated
from focalgradient.statistics.hypotheses import check_bound
from focalgradient.tasks import task_named

__all__ = ["preregistration"]


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
    effects = {name: one for name, one in (("effect", effect), ("far_effect", far_effect)) if one is not None}
    if model is not None:
        effects = dataclasses.asdict(model) | effects
    asked = Planned(stated, bound, effects, ordinal)
    check_bound("bound", asked.used_bound)
    task = task_named(design.task)
    given = {"bound": bound is not None, "ordinal": ordinal, "far_effect": far_effect is not None}
    if wrong := [name for name, is_given in given.items() if is_given and name not in task.settings_of_report]:
        raise InputError(
            f"{wrong[0]} is of depth ratings, but {design_file} is a design of {design.task}: leave it out."
        )
    text = task.preregistered(design, asked)
    blocks = text.blocks()
    files = {
        "preregistration.html": as_html(text.title, blocks).encode(),
        "preregistration.md": as_markdown(text.title, blocks).encode(),
    }
    return files | ({"rules.toml": text.rules_file.encode()} if text.rules_file else {})
