"""The computer's clock is set while a session runs: nothing is lost, nothing hangs, and the trial is shown again."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from headless import PAGES, Running, design, headless, make_set, psychopy_here, session

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.design import load_design
from focalgradient.lab.running import parted

pytestmark = psychopy_here

SCENES = ["spheres-01", "spheres-02"]
DESIGN = design("depthrating", scenes=SCENES, fixations=["nearest"], mark_s=0.3, picture_s=0.8, answer="typed")

STEPS = {1: ("mark", -3600), 2: ("picture", -1), 3: ("question", 1), 4: ("picture", 3600)}
"""Of each trial: at which event the clock is set, and by how many seconds."""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_steps_of_the_clock_lose_nothing_and_the_trial_is_shown_again(tmp_path):
    shim, step = tmp_path / "clock.so", tmp_path / "step"
    source = Path(__file__).with_name("clock_shim.c")
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", str(shim), str(source), "-ldl"], check=True)
    step.write_text("0")
    make_set(tmp_path / "set", ["spheres-00", *SCENES], (64, 48))
    given = [*session(tmp_path, DESIGN), "--windowed"]
    trials = load_design(tmp_path / "design.toml").trials("01")
    total, done, made = 0, 0, set()
    with headless(tmp_path / "x") as screen:
        screen.environment |= {"LD_PRELOAD": str(shim), "CLOCK_STEP": str(step)}
        running = Running(screen, "depth-rating", *given)
        for event in running.events():
            at, by = STEPS.get(done + 1, ("", 0))
            if event == at and done not in made:
                made.add(done)
                total += by
                step.write_text(str(total))
            if event in PAGES:
                screen.keys("space")
            elif event == "question":
                screen.keys("1", "period", str(done + 1), "Return")
            elif event == "recorded":
                done += 1
        assert running.end() == 0, running.errors
    assert len(made) == len(STEPS) == len(trials)
    log = read_journal(running.journal())
    void = {note["trial"]: note["clocks_parted_s"] for note in log.of("note") if note["kind"] == "void"}
    assert void == pytest.approx({trial: by for trial, (_, by) in STEPS.items()}, abs=0.2)
    table = read_dataset(tmp_path / "data").depth_rating
    assert table["interruptions"].tolist() == [1] * len(trials)
    assert table["rating"].tolist() == [1.1, 1.2, 1.3, 1.4]
    assert table["response_time"].between(0.001, 30).all()
    for note in (note for note in log.of("note") if note["kind"] == "events"):
        times = [seconds for _, seconds, _ in note["events"]]
        assert times == sorted(times)
        names = [name for name, _, _ in note["events"]]
        at = names.index("picture")
        assert names[at + 1] == "off"
        assert 0.75 < times[at + 1] - times[at] < 5
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()


def test_clocks_part_by_steps_and_not_by_slewing():
    slewed = 40 * (1 + 500e-6)  # the fastest that Linux slews, over the longest trial
    assert parted((0.0, 0.0), (40.0, slewed)) == 0
    assert [round(parted((0.0, 0.0), (3.0, 3.0 + by))) for by in (-3600, -1, 1, 3600)] == [-3600, -1, 1, 3600]
