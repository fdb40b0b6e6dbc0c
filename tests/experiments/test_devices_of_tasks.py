"""Markers, photodiode, gaze and stereoscope belong to the runner, so that every task has them, a laboratory's too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from headless import PAGES, PROGRAMS, Headless, Running, headless, make_set, psychopy_here

from focalgradient.dataset import read_journal
from focalgradient.dataset.markers import MARKERS
from focalgradient.tasks import task_named

TIMES = "mark_s = 0.2\npicture_s = 0.4\npractice_trials = 0\nrepetitions = 1\ncatch_trials = 0\npause_s = 0.1\n"
DESIGNS = {
    "depthrating": f'scenes = ["spheres-01"]\napertures = ["pinhole", "f/5.6"]\nstandard_s = 0.2\n{TIMES}',
    "blurthreshold": f'scenes = ["spheres-01"]\nblank_s = 0.1\n{TIMES.replace("repetitions = 1", "repetitions = 5")}',
    "necker": 'gradients = ["none"]\npractice_trials = 0\ncatch_trials = 0\nrepetitions = 2\ntrial_s = 1.5\n',
    "pinhole": 'scenes = ["spheres-01"]\nrepetitions = 1\nlook_s = 0.3\npicture_s = 0.5\nfield_deg = 2.0\n',
    "slantfromblur": "practice_trials = 0\n",
}
"""Settings by task: those of the package, and that of a file which a laboratory copies."""

OF_EITHER_KIND = ("necker", "slantfromblur")
"""A task of the package whose stimulus is a film, and a laboratory's: gaze is recorded by the same code for all."""

SHOWN = ("picture", "reference", "cube", "look")
CODES = [[str(MARKERS[name].code)] for name in SHOWN]
ANSWERS = {"blurthreshold": ("Left",)}


def answer_one(running: Running, screen: Headless, task: str) -> dict[str, list[np.ndarray]]:
    """Answer one trial, then stop and keep it; return what the screen showed at each event of the trial."""
    seen: dict[str, list[np.ndarray]] = {}
    recorded = 0
    for event in running.events():
        if event == "align":
            screen.keys("Return")
        elif recorded and event in ("mark", "picture", "reference", "cube", "look", "question"):
            screen.keys("Escape")
        elif event in ("quit?", "keep?"):
            screen.keys("y")
        elif event in SHOWN:
            screen.xdotool("sleep", "0.15")
            seen.setdefault("shown", []).append(screen.pixels().copy())
        elif event == "question":
            screen.xdotool("sleep", "0.1")
            seen.setdefault("question", []).append(screen.pixels().copy())
            screen.keys(*ANSWERS.get(task, ("Left", "Return")))
        elif event == "recorded":
            recorded += 1
        elif event in PAGES:
            screen.keys("space")
    assert running.end() == 1, running.errors
    return seen


@psychopy_here
@pytest.mark.slow
@pytest.mark.parametrize(
    ("eyes", "task"),
    [*(("--stereoscope eyes.toml", task) for task in DESIGNS), *(("--gaze mouse", task) for task in OF_EITHER_KIND)],
)
def test_every_task_has_every_device(eyes: str, task: str, tmp_path: Path) -> None:
    make_set(tmp_path / "set", ["spheres-00", "spheres-01"])
    (tmp_path / "design.toml").write_text(f'task = "{task}"\nask = []\n{DESIGNS[task]}')
    given = ["--data", tmp_path / "data", "--uncalibrated", "--participant", "01", "--design", tmp_path / "design.toml"]
    program = {"depthrating": "depth_rating", "blurthreshold": "blur_threshold", "pinhole": "pinhole_demonstration"}
    file = [str(PROGRAMS / "slant_from_blur.py")] if task == "slantfromblur" else []
    task_named(file[0] if file else task)
    if "scenes" in DESIGNS[task]:
        given += ["--stimuli", tmp_path / "set"]
    with headless(tmp_path / "x") as screen:
        (screen.folder / "eyes.toml").write_text('layout = "halves"\n')
        running = Running(
            screen,
            "from-file" if file else program.get(task, task),
            *file,
            *given,
            *eyes.split(),
            "--photodiode",
            "right",
        )
        seen = answer_one(running, screen, task)
    assert {int(pixels[-5, -5].max()) for pixels in seen["shown"]} == {255}  # the photodiode's patch
    assert {int(pixels[-5, -5].max()) for pixels in seen.get("question", [])} <= {0}
    log = read_journal(running.journal())
    (table,) = (tmp_path / "data").rglob("*_events.tsv")
    header, *rows = (line.split("\t") for line in table.read_text().splitlines())
    sent = [dict(zip(header, row, strict=True)) for row in rows]
    assert [row["value"] for row in sent if row["trial_type"] in SHOWN and row["trial"] == "1"][:1] in CODES
    if "--gaze" in eyes:
        assert [note["trial"] for note in log.of("note") if note["kind"] == "gaze" and note["samples"]] == [1]
        return
    assert log.head["apparatus"]["stereoscope"]["layout"] == "halves"
    halves = [(pixels[100:600, :512, 0].astype(int), pixels[100:600, 512:, 0].astype(int)) for pixels in seen["shown"]]
    assert all((left - right).std() < 0.1 * left.std() for left, right in halves), "each eye has the picture"
