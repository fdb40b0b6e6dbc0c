"""The programs that a laboratory copies are the tasks of the commands, not descriptions of their own."""

from __future__ import annotations

import runpy

import pytest
from headless import PROGRAMS

from focalgradient.tasks import task_named

COMMANDS = {
    "depth_rating": "depth-rating",
    "necker_rotation": "necker",
    "pinhole_demonstration": "pinhole",
    "blur_threshold": "blur-threshold",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_program_runs_the_task_of_its_command(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("focalgradient.lab.show_described", lambda task, sitting, trial: (task, sitting, trial))
    program = runpy.run_path(str(PROGRAMS / f"{name}.py"))
    assert type(program["TASK"]) is type(task_named(COMMANDS[name]))
    assert program["trial"]("sitting", "trial") == (program["TASK"], "sitting", "trial")
    assert f"focalgradient run {COMMANDS[name]}`" in program["__doc__"]
