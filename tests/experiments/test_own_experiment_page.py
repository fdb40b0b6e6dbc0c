"""The blocks of docs/in-your-own-experiment.md for other programs, taken from the page and run."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import browser
import cv2
import numpy as np
import pytest
from headless import Headless, psychopy_here
from test_psychopy_plugin import plugin, ran

from focalgradient.live import FocusSeries, packed

__all__ = ["plugin"]  # the screen with the plugin's wheel

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "in-your-own-experiment.md").read_text("utf-8")
SHAPE = (60, 80)

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="elsewhere no screen is set up")]


def block(heading: str, kind: str, number: int = 0) -> str:
    """A block of the page below a heading."""
    part = PAGE.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    return str(re.findall(rf"^```{kind}\n(.*?)^```$", part, re.DOTALL | re.MULTILINE)[number])


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with small files under the names that the first block makes, which tests/test_docs.py runs."""
    folder = tmp_path_factory.mktemp("files")
    picture = cv2.resize(np.random.default_rng(1).integers(0, 256, (15, 20), dtype=np.uint8), SHAPE[::-1])
    planes = tuple((picture / 255).astype(np.float16) * level for level in (0.5, 0.8, 1.0))
    made = FocusSeries((0.4, 1.0, 1.5), planes, np.ones(SHAPE), np.full((2, 2), np.nan))
    made.save(folder / "series")
    (folder / "series" / "focus.json").write_text(json.dumps(packed(made)))
    for name in ("demo", "blurred"):
        (folder / name).mkdir()
    cv2.imwrite(str(folder / "demo" / "picture.png"), picture)
    np.save(folder / "demo" / "distance.npy", np.where(np.arange(SHAPE[1]) < 40, 0.7, 2.0) * np.ones((SHAPE[0], 1)))
    for focus in ("0.8", "1.2", "2.0"):
        cv2.imwrite(str(folder / "blurred" / f"blurred-{focus}m.png"), picture)
    return folder


def given(screen: Headless, files: Path) -> None:
    for name in ("demo", "series", "blurred"):
        shutil.copytree(files / name, screen.folder / name, dirs_exist_ok=True)


@psychopy_here
def test_coder(plugin: Headless, files: Path) -> None:
    given(plugin, files)
    check = "\nprint('found', picture.focus, cube.phase)\n"
    (said,) = re.findall("^found (.*)$", ran(plugin, "-c", block("PsychoPy Coder", "python") + check), re.MULTILINE)
    focus, phase = map(float, said.split())
    assert 1.2 < focus < 1.5
    assert 0.1 < phase < 0.15


@psychopy_here
def test_opensesame(plugin: Headless, files: Path) -> None:
    given(plugin, files)
    before = """
import time
from types import SimpleNamespace
from psychopy import visual
win = visual.Window((640, 480), units="pix", color=-1)
var, clock = SimpleNamespace(dioptres=1.2), SimpleNamespace(sleep=lambda ms: time.sleep(ms / 1000))
"""
    scripts = "\n".join(block("OpenSesame", "python", number) for number in (0, 1))
    assert ran(plugin, "-c", before + scripts + "\nprint('found', picture.focus)").count("found 1.2\n") == 1


def test_jspsych(files: Path) -> None:
    name = browser.bundle_jspsych(block("jsPsych", "js"), files, "own")
    with browser.serving(files) as address, browser.Browser() as page:
        page.call("Page.navigate", url=f"{address}/{name}")
        page.wait("document.querySelector('#picture')?.width === 80")
        for kind in ("keyDown", "keyUp", "keyDown", "keyUp"):
            page.call("Input.dispatchKeyEvent", type=kind, key="f", **({"text": "f"} if kind == "keyDown" else {}))
            page.js("new Promise((resolve) => setTimeout(resolve, 600))")
        page.wait("document.querySelector('#focal-blur')?.width === 80")
        assert page.js("document.querySelector('#focal-blur-foot').textContent").startswith("Make the left side sharp.")


SCREEN = """function out = Screen(what, varargin)
  global shown
  out = 1;
  if strcmp(what, 'MakeTexture')
    shown{end + 1} = varargin{2};
    out = numel(shown);
  elseif strcmp(what, 'Flip')
    out = 0.0;
  end
end
"""


def test_matlab(files: Path) -> None:
    octave = shutil.which("octave-cli")
    if octave is None:
        pytest.skip("GNU Octave is not installed")
    (files / "Screen.m").write_text(SCREEN)
    (files / "WaitSecs.m").write_text("function WaitSecs(seconds)\nend\n")
    (files / "page.m").write_text(
        "global shown\nshown = {};\n"
        + block("MATLAB and Psychtoolbox", "matlab")
        + "printf('%d %d %d\\n', numel(shown), size(shown{1}, 1), size(shown{1}, 2));\n"
    )
    done = subprocess.run([octave, "--quiet", "page.m"], cwd=files, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-3:] == ["3", "60", "80"]
