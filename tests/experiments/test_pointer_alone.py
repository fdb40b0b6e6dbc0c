"""Mouse or touch alone, from the first page to the last: buttons found on the screen by their frames, and clicked."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from headless import Running, design, headless, keep, make_set, psychopy_here, session

from focalgradient.dataset import read_dataset, validate

pytestmark = psychopy_here

LOWEST = round(768 / 2 + 0.33 * 768)
"""Row of the buttons, in pixels from above."""


@pytest.mark.slow
def test_ratings_by_the_mouse_alone(tmp_path: Path) -> None:
    make_set(tmp_path / "set", ["spheres-00", "spheres-01"])
    (tmp_path / "consent.txt").write_text("Consent\nI take part.")
    made = design("depthrating", fixations=["nearest"], practice_trials=1)
    given = [*session(tmp_path, made), "--pointer", "--consent", tmp_path / "consent.txt"]
    with headless(tmp_path / "x") as screen:
        running = Running(screen, "depth-rating", *given)
        stopped = False
        for event in running.events():
            time.sleep(0.15)
            keep(screen, f"pointer-{event.strip('?')}")
            if event == "question" and not stopped:
                stopped = True
                screen.click(1024 - round(0.08 * 768), round(768 / 2 - 0.455 * 768))  # ESC
            elif event == "quit?":
                screen.click(512 + 60, LOWEST)  # no
            elif event == "question":
                screen.click(512 + 150, round(768 / 2 + 0.05 * 768))
                time.sleep(0.15)
                keep(screen, "pointer-answered")
                screen.click(512, LOWEST)
            elif event in ("instructions", "ready", "thanks", "debriefing", "example", "break", "keep?"):
                screen.click(512, LOWEST)
            elif event == "consent":
                screen.click(512 - 60, LOWEST)  # yes
        assert running.end() == 0, running.errors
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    table = read_dataset(tmp_path / "data").depth_rating
    assert len(table) == 2
    assert table["start"].isna().all()  # no key moved the marker
    assert (table["rating"] > 1).all()
