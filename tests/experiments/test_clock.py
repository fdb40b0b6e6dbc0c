"""The computer's clock is set while a session runs: nothing is lost, nothing hangs, and the trial is shown again."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from headless import PROGRAMS, Running, design, headless, make_set, psychopy_here, session

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.design import load_design
from focalgradient.lab.running import parted
from focalgradient.tasks import task_named

pytestmark = psychopy_here

SCENES = ["spheres-01", "spheres-02"]
DESIGN = design("depthrating", scenes=SCENES, fixations=["nearest"], mark_s=0.3, picture_s=0.8, answer="typed")
OWN = design("borderblur", ask=[], repetitions=1, practice_trials=0, picture_s=0.8)

STEPS = {1: ("mark", -3600), 2: ("picture", -1), 3: ("question", 1), 4: ("picture", 3600)}
"""Of each trial: at which event the clock is set, and by how many seconds."""

OWN_STEPS = {**STEPS, 1: ("off", -3600)}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize(
    ("name", "text", "steps"),
    [("depth-rating", DESIGN, STEPS), ("border_blur.py", OWN, OWN_STEPS)],
    ids=["ours", "own task"],
)
def test_steps_of_the_clock_lose_nothing_and_the_trial_is_shown_again(name, text, steps, tmp_path):
    own = name.endswith(".py")
    task = task_named(str(PROGRAMS / name)) if own else task_named("depthrating")
    shim, step = tmp_path / "clock.so", tmp_path / "step"
    source = Path(__file__).with_name("clock_shim.c")
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", str(shim), str(source), "-ldl"], check=True)
    step.write_text("0")
    if not own:
        make_set(tmp_path / "set", ["spheres-00", *SCENES], (64, 48))
    given = [*[str(PROGRAMS / name)] * own, *session(tmp_path, text), "--windowed"]
    trials = load_design(tmp_path / "design.toml").trials("01")
    total, done, made = 0, 0, set()
    with headless(tmp_path / "x") as screen:
        screen.environment |= {"LD_PRELOAD": str(shim), "CLOCK_STEP": str(step)}
        running = Running(screen, "from-file" if own else name, *given)
        for event in running.events():
            at, by = steps.get(done + 1, ("", 0))
            if event == at and done not in made:
                made.add(done)
                total += by
                step.write_text(str(total))
            if event in ("instructions", "example", "ready", "thanks", "debriefing"):
                screen.keys("space")
            elif event == "question":
                screen.keys(*(["Left"] if own else ["1", "period", str(done + 1), "Return"]))
            elif event == "recorded":
                done += 1
        assert running.end() == 0, running.errors
    assert len(made) == len(steps) == len(trials)
    log = read_journal(running.journal())
    void = {note["trial"]: note["clocks_parted_s"] for note in log.of("note") if note["kind"] == "void"}
    assert void == pytest.approx({trial: by for trial, (_, by) in steps.items()}, abs=0.2)
    table = read_dataset(tmp_path / "data").tables[task.name]
    assert table["interruptions"].tolist() == [1] * len(trials)
    if own:
        assert table["blurred_near"].tolist() == [trial.blurred == "left" for trial in trials]
    else:
        assert table["rating"].tolist() == [1.1, 1.2, 1.3, 1.4]
    assert table["response_time"].between(0.001, 30).all()
    for note in (note for note in log.of("note") if note["kind"] == "events"):
        times = [seconds for _, seconds, _ in note["events"]]
        assert times == sorted(times)
        names = [name for name, _, _ in note["events"]]
        at = names.index("picture")
        assert names[at + 1] == "off"
        assert 0.75 < times[at + 1] - times[at] < 5
    assert validate(tmp_path / "data", None if own else tmp_path / "set").problems == ()


def test_clocks_part_by_steps_and_not_by_slewing():
    slewed = 40 * (1 + 500e-6)  # the fastest that Linux slews, over the longest trial
    assert parted((0.0, 0.0), (40.0, slewed)) == 0
    assert [round(parted((0.0, 0.0), (3.0, 3.0 + by))) for by in (-3600, -1, 1, 3600)] == [-3600, -1, 1, 3600]
