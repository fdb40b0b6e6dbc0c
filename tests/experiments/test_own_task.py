"""The task of docs/extending.md in a real window, with real keys: from its page to a valid data set."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import runpy
from pathlib import Path

import pytest
from extended import ROOT, build, command
from headless import SIZE, Running, headless, psychopy_here, session

from focalgradient.display import Display
from focalgradient.lab.preparation import ASSUMED_DISTANCE, ASSUMED_PITCH

pytestmark = psychopy_here

ALSO = """[also.interest]
question = "How interesting was it?"
ends = ["dull", "gripping"]
unit = "points"
"""


@pytest.mark.slow
def test_the_task_of_the_document_runs_with_a_person(tmp_path: Path) -> None:
    installed = build("A task", "edge_blur.py", tmp_path)
    with headless(tmp_path / "x") as screen:
        screen.environment["PYTHONPATH"] = os.pathsep.join([str(installed), str(ROOT / "src")])
        running = Running(screen, "edgeblur", *session(tmp_path, f'task = "edgeblur"\nrepetitions = 1\n\n{ALSO}'))
        events = running.answer(*["Right"] * 3, "Return")
    assert f"Saved in {tmp_path / 'data'}." in running.printed
    assert [events.count(name) for name in ("instructions", "picture", "question", "recorded")] == [1, 3, 6, 3]
    done = command(installed, "validate", tmp_path / "data")
    assert done.returncode == 0, done.stdout
    table = next(tmp_path.glob("data/sub-01/**/*_beh.tsv"))
    rows = [*csv.DictReader(table.read_text().splitlines(), delimiter="\t")]
    assert {"shown_sha256", "interest", "interest_start", "start"} <= rows[0].keys()
    own, display = runpy.run_path(str(installed / "edge_blur.py")), Display(SIZE, ASSUMED_PITCH, ASSUMED_DISTANCE)
    for sigma, told in [(float(row["sigma_arcmin"]), row["shown_sha256"]) for row in rows]:
        pixels, _ = own["EdgeBlur"]().shown(None, own["EdgeTrial"](sigma_arcmin=sigma), display.pixels_per_degree)
        assert told == hashlib.sha256(pixels.tobytes()).hexdigest()
    assert all(0 <= float(row["interest"]) <= 10 for row in rows)
    sidecar = json.loads(next(tmp_path.glob("data/sub-01/**/*_beh.json")).read_text())
    assert sidecar["interest"] == {"Description": "How interesting was it?", "Units": "points", "Format": "number"}
    assert sorted(float(row["sigma_arcmin"]) for row in rows) == [1, 4, 16]
