"""A page for each figure of `analysis/`: the picture, its content, the measured values, the command and the program."""

from __future__ import annotations

import ast
import json
import shutil
import sys
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from PIL import Image

ROOT = Path(__file__).parents[1]
THUMBNAIL_PX = (480, 320)

sys.path.insert(0, str(ROOT / "analysis"))
from report import rows_of  # noqa: E402

NOT_MADE = "These pages were built before the figure was made: run the command, then `make docs`."


def programs() -> dict[str, str]:
    """Programs that make a figure, the paper's first, by name: the first paragraph of what each says of itself."""
    found = {}
    for path in sorted((ROOT / "analysis").glob("*.py"), key=lambda path: (not path.stem.startswith("fig"), path.stem)):
        module = ast.parse(path.read_text(encoding="utf-8"))
        made = (part for part in module.body if isinstance(part, ast.FunctionDef) and part.name == "make")
        if any(part.args.kwonlyargs for part in made):  # as `analysis/reproduce.py` calls them
            found[path.stem] = (ast.get_docstring(module) or "").split("\n\n")[0].replace("\n", " ")
    return found


def write(results: Path, into: Path) -> None:
    """Write all pages into the folder `into`, and beside it, as ``figures.md``, the part of a page that lists them.

    Parameters
    ----------
    results
        Folder of ``make reproduce``; a figure that is not there has a page that says so.
    into
        Folder below this one; its content is replaced.
    """
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir(parents=True)
    numbers: dict[str, Any] = {}
    for file in (*sorted(results.glob("*.json")), results / "numbers.json"):
        numbers |= json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    cards = []
    for name, first in programs().items():
        made = numbers.get(name)
        picture = results / f"{name}.png"
        shown = bool(made) and picture.is_file()
        title = made["title"] if shown else first.split(":")[0].rstrip(".")
        if shown:
            shutil.copy(picture, into)
            with Image.open(picture) as image:
                image.thumbnail(THUMBNAIL_PX)
                image.save(into / f"{name}-small.png")
        (into / f"{name}.md").write_text(_page(name, title, first, made if shown else None), encoding="utf-8")
        link = f"{into.name}/{name}"
        small = f"![{title}](generated/{link}-small.png)\n\n" if shown else ""
        cards.append(f":::{{container}} figure-card\n{small}[{title}](generated/{link}.md)\n:::\n")
    toctree = "\n".join(f"generated/{into.name}/{name}" for name in programs())
    parts = ["::::{container} figure-cards", *cards, "::::", "", ":::{toctree}", ":hidden:", "", toctree, ":::", ""]
    into.with_suffix(".md").write_text("\n".join(parts), encoding="utf-8")


def _page(name: str, title: str, first: str, made: Mapping[str, Any] | None) -> str:
    """Return the page of one figure."""
    command = f"```sh\npython analysis/{name}.py --out results\n```"
    program = f"```{{literalinclude}} /../analysis/{name}.py\n:language: python\n```"
    if made is None:
        return "\n\n".join([f"# {title}", first, NOT_MADE, command, "## The program", program, ""])
    words = "".join(f"<p>{escape(paragraph)}</p>" for paragraph in made["caption"])
    table = rows_of(made["summary"])
    rows = "".join(f"<tr><th>{escape(what)}</th><td>{escape(value)}</td></tr>" for what, value in table)
    measured = f'<div class="measured"><table class="table">{rows}</table></div>'
    parts = [f"# {title}", f"![{title}]({name}.png)", _raw(words), "## Measured values", _raw(measured)]
    return "\n\n".join([*parts, "## The command", command, "## The program", program, ""])


def _raw(html: str) -> str:
    return f"```{{raw}} html\n{html}\n```"
