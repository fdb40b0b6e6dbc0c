"""Designs of the experiments: conditions, order, catch trials, practice and breaks, all from one seed.

A design is read from a TOML file; its trial list for a participant is the same on every machine. No window is needed.
The designs of the paper, and that of a threshold of blur, come with the package as such files, to be copied and changed
(`design_text`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from focalgradient.design.blur_threshold import BlurThresholdDesign, BlurTrial, Judged
from focalgradient.design.depth_rating import DepthRatingDesign, DepthTrial, Fixation
from focalgradient.design.factors import Factor
from focalgradient.design.necker import Direction, Gradient, NeckerDesign, NeckerTrial, Shape
from focalgradient.design.order import Place, check_label
from focalgradient.design.pinhole import Form, Pinhole, PinholeTrial, Viewing
from focalgradient.design.plan import Phase, Trial
from focalgradient.design.procedure import Procedure
from focalgradient.errors import InputError
from focalgradient.files import read_toml
from focalgradient.tables import check_table, shown

__all__ = [
    "DESIGNS",
    "NAMES",
    "BlurThresholdDesign",
    "BlurTrial",
    "DepthRatingDesign",
    "DepthTrial",
    "Design",
    "Direction",
    "Factor",
    "Fixation",
    "Form",
    "Gradient",
    "Judged",
    "NeckerDesign",
    "NeckerTrial",
    "Phase",
    "Pinhole",
    "PinholeTrial",
    "Place",
    "Procedure",
    "Shape",
    "Trial",
    "Viewing",
    "check_design",
    "check_label",
    "design_text",
    "load_design",
    "recorded_design",
]

Design = DepthRatingDesign | NeckerDesign | Pinhole | BlurThresholdDesign

DESIGNS: dict[str, type[Design]] = {
    "depthrating": DepthRatingDesign,
    "necker": NeckerDesign,
    "pinhole": Pinhole,
    "blurthreshold": BlurThresholdDesign,
}
"""By the name of the task."""

NAMES = {
    "depth-rating": "depthrating",
    "necker": "necker",
    "pinhole": "pinhole",
    "blur-threshold": "blurthreshold",
}
"""What the command line calls each task."""


def design_text(name: str) -> str:
    """Read the settings file of the paper's design, with all its settings and what each means.

    Parameters
    ----------
    name
        "depth-rating", "necker", "pinhole" or "blur-threshold".

    Raises
    ------
    InputError
        If there is no design of that name.

    Examples
    --------
    >>> design_text("necker").splitlines()[0]
    '# Experiment 2: does the rotating Necker cube look rigid, or does it wobble, by its focal gradient?'
    """
    if name not in NAMES:
        raise InputError(f"there is no design {name!r}: give one of {', '.join(map(repr, NAMES))}.")
    return (files("focalgradient.design") / "files" / f"{name.replace('-', '_')}.toml").read_text(encoding="utf-8")


def load_design(path: str | os.PathLike[str]) -> Design:
    """Read a design from its TOML file.

    Raises
    ------
    InputError
        If it cannot be read, is not TOML, has unknown or wrong keys, or asks for what cannot be run.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "own.toml").write_text(design_text("depth-rating"))
    ...     design = load_design(Path(folder, "own.toml"))
    >>> design.task, len(design.trials("01", "1"))
    ('depthrating', 204)
    """
    return check_design(str(path), read_toml(Path(path)))


EARLIER: dict[str, dict[str, Any]] = {
    "depthrating": {"catch_pictures": ["standard"], "blank_s": 0.0, "pause_s": 0.0, "least_break_s": 0.0}
}
"""By task, what a design meant that was recorded before the setting was there."""


def recorded_design(name: str, data: Mapping[str, Any]) -> Design:
    """Make a design of what a journal or a sidecar says, also of an earlier version.

    Raises
    ------
    InputError
        As `load_design` does.

    Examples
    --------
    >>> recorded_design("old", {"task": "depthrating"}).catch_pictures
    ('standard',)
    """
    return check_design(name, EARLIER.get(str(data.get("task")), {}) | dict(data))


def check_design(name: str, data: Mapping[str, Any]) -> Design:
    """Make a design of the settings that messages call `name`.

    Raises
    ------
    InputError
        As `load_design` does.

    Examples
    --------
    >>> check_design("mine", {"task": "necker", "repetitions": 3}).repetitions
    3
    """
    task = data.get("task")
    if not (isinstance(task, str) and task in DESIGNS):
        known = ", ".join(map(repr, DESIGNS))
        given = f"task is {shown(task)}, but must be" if "task" in data else "task is missing: give"
        raise InputError(f"{name}: {given} one of {known}.")
    return check_table(name, dict(data), DESIGNS[task])
