"""Every block of commands or Python in the documents runs as pasted, in order, on the folder that `demo` makes.

A block that needs a window, a person or hours has a comment before it: ``<!-- not run: the reason -->``. A page that is
tested elsewhere is named in `ELSEWHERE`.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from blocks import BLOCK, README, ROOT, RUN, Block, blocks, runnable

ELSEWHERE = {"docs/own-stimuli.md": "tests/test_own_stimuli.py"}
WRITTEN = [ROOT / "experiments" / "README.md", *(ROOT / "docs").glob("*.md")]
WRITTEN += [path for folder in ("report", "tutorials") for path in (ROOT / "docs" / folder).glob("*.md")]
PAGES = sorted(str(path.relative_to(ROOT)) for path in WRITTEN)
SHOWN = {"toml", "csv", "text", "r", "json", "js", "matlab"}
"""Kinds of blocks that only show what a file holds."""

LONGEST_S = 500
"""A block that takes longer needs a comment that says so."""

LONGEST_BUILD_S = 3000


@pytest.mark.parametrize("page", [README, *PAGES])
def test_every_block_is_of_a_known_kind_and_none_hides(page: str) -> None:
    assert {block.kind for block in blocks(page)} <= RUN | SHOWN
    text = (ROOT / page).read_text(encoding="utf-8")
    assert len(re.findall("^```", text, re.MULTILINE)) == 2 * len(blocks(page))
    assert not re.findall(r"^    (?:focalgradient|make|python) ", re.sub(BLOCK, "", text), re.MULTILINE)
    assert not re.findall(r"^\s*%.*", re.sub(BLOCK, "", text), re.MULTILINE)  # a comment, which no page shows
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
    [page for page in PAGES if page not in ELSEWHERE and runnable(page)],
)
def test_the_blocks_of_a_page_run_in_order(page: str, demo: Path, tmp_path: Path) -> None:
    shutil.copytree(demo, tmp_path / "demo")
    for block in runnable(page):
        run(block, tmp_path)


@pytest.mark.slow
def test_the_readme_runs_from_an_empty_folder(tmp_path: Path) -> None:
    ran = runnable(README)
    for block in ran:
        run(block, tmp_path)
    assert "focalgradient demo --out demo\n" in [block.text for block in ran]
    assert sum(block.text.count("focalgradient ") for block in ran) >= 8
    assert any(block.kind == "python" for block in ran)


def run(block: Block, folder: Path, longest_s: float = LONGEST_S) -> None:
    """Run a block as it stands, in `folder`; a command that fails ends it."""
    programs = str(Path(sys.executable).parent)
    kept = {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}", "FOCALGRADIENT_CACHE": str(folder / "cache")}
    command = ["bash", "-e", "-c", block.text] if block.kind == "sh" else [sys.executable, "-c", block.text]
    environment = os.environ | kept | {"MPLBACKEND": "Agg"}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment, timeout=longest_s)
    assert done.returncode == 0, f"{block.text}\n{done.stderr}"
    assert "Traceback" not in done.stderr


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The documents as pages, built without a warning, after one figure of `analysis/` was made."""
    folder = tmp_path_factory.mktemp("built")
    left = shutil.ignore_patterns("_build", "generated", "gallery", "__pycache__")
    for part in ("docs", "analysis"):
        shutil.copytree(ROOT / part, folder / part, ignore=left)
    run(Block("sh", f"{sys.executable} analysis/fig6.py --out results", None), folder)
    # Of the kernel that ran the notebook, which may print a traceback as it ends, sphinx tells what failed.
    build = Block("sh", f"{sys.executable} -m sphinx -q -W --keep-going -b html docs html 2> build.txt", None)
    try:
        run(build, folder, LONGEST_BUILD_S)
    except AssertionError as error:
        raise AssertionError((folder / "build.txt").read_text()) from error
    return folder / "html"


@pytest.mark.slow
def test_every_public_name_has_a_page_that_leads_to_the_examples_which_use_it(built: Path) -> None:
    page = (built / "generated" / "focalgradient.depth.recover_depth.html").read_text(encoding="utf-8")
    assert "Examples that use it" in page
    assert "gallery/plot_depth_from_two_apertures.html" in page
    commands = re.sub("<[^>]*>", "", (built / "generated" / "commands" / "depth.html").read_text(encoding="utf-8"))
    assert "focalgradient depth [OPTIONS]" in commands
    assert not re.search(r"\.\. (program|rubric|option)::", commands)  # markup that was not understood


@pytest.mark.slow
def test_the_live_figures_lie_beside_the_pages(built: Path) -> None:
    assert 'href="play/index.html"' in (built / "index.html").read_text(encoding="utf-8")
    scripts = re.findall(r'src="(\S+\.js)"', (built / "play" / "index.html").read_text(encoding="utf-8"))
    assert scripts
    assert [name for name in (*scripts, "../play.webp") if not (built / "play" / name).is_file()] == []


@pytest.mark.slow
def test_every_figure_has_a_page_with_its_program_and_once_it_was_made_its_picture(built: Path) -> None:
    pages = {path.stem: path.read_text(encoding="utf-8") for path in (built / "generated" / "figures").glob("*.html")}
    listed = re.findall(
        r'^    \("(\w+)", \w+\.make, ', (ROOT / "analysis" / "reproduce.py").read_text("utf-8"), re.MULTILINE
    )
    assert set(pages) == set(listed) >= {"fig1", "fig2", "fig3", "fig4", "fig5", "fig6"}
    assert all(
        f"python analysis/{name}.py --out results" in re.sub("<[^>]*>", "", page) for name, page in pages.items()
    )
    assert {name for name, page in pages.items() if f"{name}.png" in page} == {"fig6"}
    assert "Measured values" in pages["fig6"]
    assert "before the figure was made" in pages["fig5"]


@pytest.mark.slow
def test_the_notebook_of_the_paper_is_offered_with_all_its_output(built: Path) -> None:
    (file,) = built.glob("_downloads/*/plot_the_paper.ipynb")
    cells = [cell for cell in json.loads(file.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == [*range(1, len(cells) + 1)]
    shown = [output for cell in cells for output in cell["outputs"]]
    assert {output["output_type"] for output in shown} == {"stream", "display_data"}
    assert sum("image/png" in output.get("data", {}) for output in shown) == 2  # depth, and Fig. 3
    said = "".join("".join(output.get("text", "")) for output in shown)
    assert "default, nearest in focus" in said
    assert "blur-blind, farthest in focus" in said


LOADED = re.compile(
    r'<(?:script|img|iframe|source)\b[^>]*\bsrc="(?:https?:)?//|<link\b(?![^>]*rel="canonical")[^>]*\bhref="(?:https?:)?//'
)
"""What a browser fetches by itself from elsewhere; a link to follow is not of it."""


@pytest.mark.slow
def test_no_page_loads_anything_from_elsewhere_and_formulas_need_no_script(built: Path) -> None:
    pages = {path: path.read_text(encoding="utf-8") for path in built.rglob("*.html")}
    assert len(pages) > 300
    assert [path for path, text in pages.items() if LOADED.search(text)] == []
    assert not any("url(http" in path.read_text(encoding="utf-8") for path in built.rglob("*.css"))
    assert pages[built / "report" / "method.html"].count("<math ") > 30
    assert not re.search(r"<script[^>]*mathjax", pages[built / "report" / "method.html"], re.IGNORECASE)
