"""The README's commands run as they stand, in order, on the folder that `focalgradient demo` makes."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
LONG = ("focalgradient stimuli", "focalgradient run", "focalgradient simulate", "focalgradient validate", "pictures")
"""Commands that take long, need a person, or need what those make: the experiments from pictures to report."""


def commands() -> list[str]:
    """The lines of the shell blocks that call the command."""
    lines = [line for block in re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL) for line in block.splitlines()]
    return [line.partition("#")[0].strip() for line in lines if line.startswith("focalgradient ")]


@pytest.mark.slow
def test_the_blocks_run_on_the_demo_folder(tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("focalgradient")
    ran = 0
    for command in commands():
        if command.startswith(LONG) or "results/power" in command or "results/simulated" in command:
            continue
        done = subprocess.run([str(program), *command.split()[1:]], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}\n{done.stderr}"
        assert "Traceback" not in done.stderr
        ran += 1
    assert ran >= 8
    for made in ("demo/depth/depth.png", "results/mine/depth.png", "results/camera.toml", "results/cards/depth.png"):
        assert (tmp_path / made).stat().st_size > 0
