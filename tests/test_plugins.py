"""The plugins for other programs as they lie in `plugins/`: nothing is installed, no window opened."""

from __future__ import annotations

import ast
import json
import re
import tomllib
from pathlib import Path

import pytest
from PIL import Image

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


def test_components_have_icons_for_each_theme() -> None:
    for _, path, kind in entry_points().values():
        if not kind.endswith("Component"):
            continue
        for theme in ("light", "dark", "classic"):
            for suffix, side in (("", 48), ("@2x", 96)):
                with Image.open(path.parent / theme / f"{path.parent.name}{suffix}.png") as icon:
                    assert (icon.size, icon.mode) == ((side, side), "RGBA")
        assert "var(--outline)" in (path.parent / f"{kind}.svg").read_text("utf-8")


def test_the_plugin_is_licensed_as_psychopy_and_has_no_shader_of_its_own() -> None:
    project = tomllib.loads((PSYCHOPY / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["license"] == "GPL-3.0-or-later"
    assert "GNU GENERAL PUBLIC LICENSE" in (PSYCHOPY / "LICENSE").read_text("utf-8")
    sources = "".join(path.read_text("utf-8") for path in PSYCHOPY.rglob("*.py"))
    assert "gl_Frag" not in sources
    assert "#version" not in sources


JSPSYCH = PSYCHOPY.parent / "jspsych"


def test_each_jspsych_plugin_documents_its_parameters_and_data() -> None:
    package = json.loads((JSPSYCH / "package.json").read_text("utf-8"))
    assert package["license"] == "BSD-3-Clause"
    assert package["peerDependencies"] == {"jspsych": ">=8.0.0"}
    types = (JSPSYCH / "index.d.ts").read_text("utf-8")
    for source in sorted((JSPSYCH / "src").glob("focal-*.js")):
        text = source.read_text("utf-8")
        page = (JSPSYCH / "docs" / f"{source.stem}.md").read_text("utf-8")
        info = re.search(r"parameters: \{\n(.*?)\n    \},\n    data: \{\n(.*?)\n    \},", text, re.DOTALL)
        names = re.findall(r"^      (\w+): \{ type:", "\n".join(info.groups()), re.MULTILINE) if info else []
        assert [name for name in names if not re.search(rf"\b{name}\b", page)] == []
        for kind in re.findall(r"^export (?:default class|function) (\w+)", text, re.MULTILINE):
            assert re.search(rf"export declare (class|function) {kind}\b", types)
            assert kind in (JSPSYCH / "README.md").read_text("utf-8") or kind == "cubeOf"


def test_the_example_is_that_of_the_readme() -> None:
    example = (JSPSYCH / "examples" / "timeline.js").read_text("utf-8")
    assert example in (JSPSYCH / "README.md").read_text("utf-8")
