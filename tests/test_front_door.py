"""`import focalgradient as fg`: what stands there, when it is loaded, and that documents cite names that exist."""

import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import focalgradient as fg

ROOT = Path(__file__).parents[1]
ROOMS = sorted(
    file.stem
    for file in (ROOT / "src" / "focalgradient").iterdir()
    if file.suffix == ".py" or (file / "__init__.py").exists()
)


@pytest.mark.parametrize("room", sorted({*ROOMS} - {"__init__", "cli"}))
def test_every_room_stands_at_the_front_door(room: str) -> None:
    assert room in dir(fg)
    assert found(f"focalgradient.{room}")


@pytest.mark.parametrize("name", fg.__all__)
def test_every_name_of_the_front_door_is_there(name: str) -> None:
    assert getattr(fg, name) is not None
    assert name in dir(fg)


def test_rooms_are_loaded_when_touched() -> None:
    program = (
        "import sys, focalgradient as fg; before = set(sys.modules); fg.Eye; after = set(sys.modules) - before; "
        "print('focalgradient.eye' in before, 'focalgradient.eye' in after, fg.eye.Eye is fg.Eye)"
    )
    assert subprocess.check_output([sys.executable, "-c", program], text=True).split() == ["False", "True", "True"]


def documents() -> list[Path]:
    """Those that are written; what `make docs` generates beside them comes from elsewhere."""
    docs = ROOT / "docs"
    found = (path for kind in ("*.md", "*.rst") for path in docs.rglob(kind))
    written = (path for path in found if not {"generated", "gallery", "_build"} & {*path.relative_to(docs).parts})
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(written)]


def cited(text: str) -> Iterator[str]:
    """Dotted names of the package that a document cites or imports."""
    for room, names in re.findall(r"from (focalgradient[\w.]*) import \(?([\w ,\n]+)", text):
        for name in names.split(","):
            if name.strip():
                yield f"{room}.{name.split()[0]}"
    for name in re.findall(r"(?<![\w/.-])(?:focalgradient|fg)((?:\.[A-Za-z_]\w*)+)", text):
        yield f"focalgradient{name}"


def found(name: str) -> bool:
    """Whether a dotted name is a module or something in one."""
    thing, path = fg, "focalgradient"
    for part in name.split(".")[1:]:
        path += f".{part}"
        if not hasattr(thing, part):
            try:
                importlib.import_module(path)
            except ModuleNotFoundError as error:
                return not str(error.name).startswith("focalgradient")  # a room exists without its own library
        thing = getattr(thing, part)
    return True


@pytest.mark.parametrize("document", documents(), ids=lambda path: str(path.relative_to(ROOT)))
def test_documents_cite_names_that_exist(document: Path) -> None:
    assert [name for name in cited(document.read_text(encoding="utf-8")) if not found(name)] == []
