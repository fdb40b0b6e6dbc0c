"""Every block of commands or Python in the documents runs as pasted, in order, on the folder that `demo` makes.

A block that needs a window, a person or hours has a comment before it: ``<!-- not run: the reason -->``. A page that is
tested elsewhere is named in `ELSEWHERE`.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ELSEWHERE = {"docs/own-stimuli.md": "tests/test_own_stimuli.py"}
WRITTEN = (*ROOT.glob("docs/*.md"), *ROOT.glob("docs/tutorials/*.md"), ROOT / "experiments" / "README.md")
PAGES = sorted(str(path.relative_to(ROOT)) for path in WRITTEN)
README = "README.md"
RUN = {"sh", "python"}
SHOWN = {"toml", "csv", "text", "r", "json"}
"""Kinds of blocks that are run, and that only show what a file holds."""

LONGEST_S = 500
"""A block that takes longer needs a comment that says so."""

BLOCK = re.compile(
    r"(?:<!-- not run: (?P<reason>[^\n]+) -->\n)?^```(?P<kind>\w*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE
)


@dataclass(frozen=True)
class Block:
    kind: str
    text: str
    reason: str | None


def blocks(page: str) -> list[Block]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return [Block(found["kind"], found["text"], found["reason"]) for found in BLOCK.finditer(text)]


@pytest.mark.parametrize("page", [README, *PAGES])
def test_every_block_is_of_a_known_kind_and_none_hides(page: str) -> None:
    assert {block.kind for block in blocks(page)} <= RUN | SHOWN
    text = (ROOT / page).read_text(encoding="utf-8")
    assert len(re.findall("^```", text, re.MULTILINE)) == 2 * len(blocks(page))
    assert not re.findall(r"^    (?:focalgradient|make|python) ", re.sub(BLOCK, "", text), re.MULTILINE)
    for block in blocks(page):
        assert block.reason is None or len(block.reason.split()) > 2


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of examples, made as README says."""
    folder = tmp_path_factory.mktemp("made")
    run(Block("sh", "focalgradient demo --out demo", None), folder)
    return folder / "demo"


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if page not in ELSEWHERE and any(b.kind in RUN and b.reason is None for b in blocks(page))],
)
def test_the_blocks_of_a_page_run_in_order(page: str, demo: Path, tmp_path: Path) -> None:
    shutil.copytree(demo, tmp_path / "demo")
    for block in blocks(page):
        if block.kind in RUN and block.reason is None:
            run(block, tmp_path)


@pytest.mark.slow
def test_the_readme_runs_from_an_empty_folder(tmp_path: Path) -> None:
    ran = [block for block in blocks(README) if block.kind in RUN and block.reason is None]
    for block in ran:
        run(block, tmp_path)
    assert "focalgradient demo --out demo\n" in [block.text for block in ran]
    assert sum(block.text.count("focalgradient ") for block in ran) >= 8
    assert any(block.kind == "python" for block in ran)


def run(block: Block, folder: Path) -> None:
    """Run a block as it stands, in `folder`; a command that fails ends it."""
    programs = str(Path(sys.executable).parent)
    kept = {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}", "FOCALGRADIENT_CACHE": str(folder / "cache")}
    command = ["bash", "-e", "-c", block.text] if block.kind == "sh" else [sys.executable, "-c", block.text]
    environment = os.environ | kept | {"MPLBACKEND": "Agg"}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment, timeout=LONGEST_S)
    assert done.returncode == 0, f"{block.text}\n{done.stderr}"
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_the_documents_are_built_without_a_warning(tmp_path: Path) -> None:
    """With every example of the gallery run, every link resolved, and a page of its own for each public name."""
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("_build", "generated", "gallery"))
    run(Block("sh", f"{sys.executable} -m sphinx -q -W --keep-going -b html docs html", None), tmp_path)
    page = (tmp_path / "html" / "generated" / "focalgradient.depth.recover_depth.html").read_text(encoding="utf-8")
    assert "Examples that use it" in page
    assert (tmp_path / "html" / "command-reference.html").read_text(encoding="utf-8").count("focalgradient-depth") > 0
