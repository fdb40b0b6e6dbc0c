"""The plugins for other programs as they lie in `plugins/`: nothing is installed, no window opened."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import pytest

PSYCHOPY = Path(__file__).parents[1] / "plugins" / "psychopy"


def entry_points() -> dict[str, tuple[str, Path, str]]:
    """By name: the group, the module's file and the class."""
    project = tomllib.loads((PSYCHOPY / "pyproject.toml").read_text("utf-8"))["project"]
    found = {}
    for group, entries in project["entry-points"].items():
        for name, target in entries.items():
            module, _, kind = target.partition(":")
            path = PSYCHOPY / module.replace(".", "/")
            found[name] = (group, path / "__init__.py" if path.is_dir() else path.with_suffix(".py"), kind)
    return found


@pytest.mark.parametrize("name", entry_points())
def test_psychopys_entry_points_name_classes(name: str) -> None:
    group, path, kind = entry_points()[name]
    assert group in ("psychopy.visual", "psychopy.experiment.components")
    assert kind == name  # PsychoPy registers a component by the name of its class
    classes = [one.name for one in ast.parse(path.read_text("utf-8")).body if isinstance(one, ast.ClassDef)]
    assert kind in classes
