"""The ready experiment on accommodation, in a real window with a simulated lens: from its page to a valid data set."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from headless import PROGRAMS, Running, design, headless, psychopy_here, session

from focalgradient.dataset import bids_problems

pytestmark = psychopy_here

DESIGN: dict[str, Any] = {"task": "accommodation", "repetitions": 1, "demands_d": [0.0, 3.0, 6.0], "letter_s": 0.3}
PROGRAM = PROGRAMS / "accommodation_range.py"


@pytest.mark.slow
def test_a_letter_is_clear_up_to_a_vergence(tmp_path: Path) -> None:
    answers = iter(["Left", "Right", "Left"])
    with headless(tmp_path / "x") as screen:
        running = Running(screen, str(PROGRAM), *session(tmp_path, design(**DESIGN)))
        events = running.answer(question=lambda: screen.keys(next(answers)))
    assert [events.count(name) for name in ("focus", "picture", "question", "recorded")] == [3, 3, 3, 3]
    names, *rows = (
        line.split("\t") for line in next(tmp_path.glob("data/sub-01/**/*_beh.tsv")).read_text().splitlines()
    )
    clear = [dict(zip(names, row, strict=True)) for row in rows]
    assert sorted(float(row["demand_d"]) for row in clear) == [0.0, 3.0, 6.0]
    assert [row["clear"] for row in clear] == ["true", "false", "true"]
    environment = {**os.environ, "FOCALGRADIENT_TASKS": str(PROGRAM)}
    checked = [sys.executable, "-m", "focalgradient", "validate", str(tmp_path / "data")]
    done = subprocess.run(checked, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert bids_problems(tmp_path / "data") == []


@pytest.mark.slow
def test_a_lens_that_does_not_reach_is_refused_before_the_window(tmp_path: Path) -> None:
    with headless(tmp_path / "x") as screen:
        running = Running(screen, str(PROGRAM), *session(tmp_path, design(**DESIGN, lens="planes:0,2")))
        assert running.answer(code=2) == []
    assert "from 0 to 2 dioptres" in running.errors
    assert "Traceback" not in running.errors
    assert not (tmp_path / "data").exists()
