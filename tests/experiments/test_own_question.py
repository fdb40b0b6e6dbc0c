"""The question of one's own in experiments/README.md, pasted into the trial of a program, with real keys."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from headless import PROGRAMS, Running, design, headless, make_set, psychopy_here, session

from focalgradient.dataset import read_dataset, validate

pytestmark = psychopy_here


@pytest.mark.slow
def test_the_question_of_the_document_is_recorded(tmp_path: Path) -> None:
    text = (PROGRAMS / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(from focalgradient.lab import Scale, ask\n.*?)^```$", text, re.DOTALL | re.M)
    source = (PROGRAMS / "depth_rating.py").read_text(encoding="utf-8")
    pasted = "".join(f"    {line}\n" for line in block.splitlines())
    program = tmp_path / "mine.py"
    program.write_text(source.replace("    return answer", pasted + "    return answer"), encoding="utf-8")
    make_set(tmp_path / "set", ["spheres-00", "spheres-01"])
    with headless(tmp_path / "x") as screen:
        running = Running(screen, str(program.with_suffix("")), *session(tmp_path, design("depthrating")))
        asked = running.answer("Right", "Right", "Return").count("question")
    assert validate(tmp_path / "data").problems == ()
    table = read_dataset(tmp_path / "data").depth_rating
    assert len(table) * 2 == asked
    assert table["interest"].between(0, 10).all()
    assert table["interest_start"].between(0, 10).all()
    sidecar = json.loads(next(tmp_path.glob("data/sub-01/**/*_beh.json")).read_text())
    assert sidecar["interest"] == {
        "Description": "How interesting the picture was.",
        "Units": "points",
        "Format": "number",
    }
