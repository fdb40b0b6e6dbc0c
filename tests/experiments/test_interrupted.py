"""What an experimenter is told: what was saved, how to go on, and what was refused or announced."""

from __future__ import annotations

import shlex
import signal
import sys
from types import SimpleNamespace
from typing import Any

import pytest
from headless import PAGES, Running, design, headless, psychopy_here, session

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.design.words import words_text
from focalgradient.lab import preparation
from focalgradient.lab.forms import missing_glyphs
from focalgradient.lab.preparation import import_screen

pytestmark = psychopy_here

WATCHING: dict[str, Any] = {"gradients": ["none", "nonrigid"], "strengths_mm": [4.0], "directions": ["left"]}
WATCHING |= {"repetitions": 1, "practice_trials": 0, "catch_trials": 0, "trial_s": 1.0}


FACE = SimpleNamespace(get_character_index=lambda one: int(one.isascii() or one in "äß"))


def answered(running: Running, until: tuple[str, int]) -> None:
    """Take part without a key for the cube, until an event has come so many times."""
    came = 0
    for event in running.events():
        came += event == until[0]
        if came == until[1] and event == until[0]:
            return
        if event in PAGES:
            running.screen.keys("space")


@pytest.mark.slow
def test_an_interrupted_run_says_what_is_saved_and_how_to_go_on(tmp_path) -> None:
    """By Ctrl-C, and as it goes on by SIGTERM."""
    data = tmp_path / "data"
    given = [*session(tmp_path, design("necker", **WATCHING)), "--windowed", "--gaze", "mouse", "--photodiode", "left"]
    with headless(tmp_path / "x") as screen:
        for stop, code, cubes, more in ((signal.SIGINT, 130, 2, ()), (signal.SIGTERM, 143, 1, ("--resume",))):
            stopped = Running(screen, "from-file", "necker", *given, *more)
            answered(stopped, ("cube", cubes))
            stopped.process.send_signal(stop)
            assert stopped.end() == code
            said = stopped.errors
            assert f"Interrupted: 1 answer is saved in {data}; continue with: " in said
            assert "does not report its frames" in said  # no vertical synchronisation on a virtual screen
            call = shlex.split(said.rpartition("continue with: ")[2])
            assert call[-1] == "--resume"
            log = read_journal(stopped.journal())
            assert any("does not report its frames" in one for one in log.of("note")[0]["warnings"])

        session(tmp_path, design("necker", **WATCHING | {"trial_s": 2.0}))
        changed = Running(screen, "from-file", "necker", *given, "--resume")
        assert changed.end() == 2
        assert "design.toml has another trial_s than the session began with" in changed.errors

        session(tmp_path, design("necker", **WATCHING))
        last = Running(screen, "from-file", *call[call.index("run") + 1 :])
        answered(last, ("end", 99))
        assert last.end() == 0, last.errors
    table = read_dataset(data).necker
    assert {*table["interruptions"][table["trial"] == 2]} == {2}
    assert [*data.rglob("*_task-necker_recording-eye1_physio.tsv.gz")], "gaze is recorded in every task"
    assert "gaze_left" not in table, "a cube has no object to be fixated"
    found = validate(data)
    assert found.problems == ()
    assert any("1 trial was shown more than once" in note for note in found.notes)
    assert any("the display did not report its frames" in note for note in found.notes)


@pytest.mark.parametrize(("face", "lacking"), [(FACE, "ö与参谢"), (None, "")], ids=["FreeType", "other systems"])
def test_characters_that_the_font_lacks_are_found(face, lacking, monkeypatch) -> None:
    font = SimpleNamespace(load=lambda *_: SimpleNamespace(face=face))
    monkeypatch.setitem(sys.modules, "pyglet", SimpleNamespace(font=font))
    assert missing_glyphs("Größe, Länge\n参与: 谢谢") == lacking


def test_a_missing_library_of_the_keyboard_is_named_with_its_package(monkeypatch) -> None:
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(preparation, "_psychopy", lambda: None)

    class Finder:
        def find_spec(self, name, path=None, target=None):
            if name == "psychtoolbox":
                raise ImportError("libjack.so.0: cannot open shared object file: No such file or directory")

    monkeypatch.delitem(sys.modules, "psychtoolbox", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Finder(), *sys.meta_path])
    with pytest.raises(Exception, match=r"keyboard needs libjack: apt-get install libjack-jackd2-0\.$"):
        import_screen()


@pytest.mark.slow
def test_a_session_ends_after_practice_that_the_design_requires(tmp_path) -> None:
    more = {"practice_trials": 1, "practice_s": 1.0, "practice_rounds": 2, "practice_required": True}
    thanks = "Finished\\n\\nThank you for taking part."
    assert thanks in words_text("en")
    (tmp_path / "zh.toml").write_text(words_text("en").replace(thanks, "谢谢参与"), encoding="utf-8")
    data = tmp_path / "data"
    given = [*session(tmp_path, design("necker", language="zh.toml", **WATCHING | more)), "--windowed"]
    with headless(tmp_path / "x") as screen:
        running = Running(screen, "from-file", "necker", *given)
        answered(running, ("end", 99))
        assert running.end() == 1
        assert "the screen's font cannot show 与, 参, 谢 of the language 'zh.toml', but shows boxes" in running.errors
        assert "Stopped: practice was not passed (0 of 1 trials right in round 2)" in running.errors
        assert not [event for event in read_journal(running.journal()).of("trial") if event["phase"] == "main"]
        assert "necker" in (data / "participants.tsv").read_text()
        assert any("practice was not passed: 0 of 1 trials right in round 2" in note for note in validate(data).notes)
        again = Running(screen, "from-file", "necker", *given, "--resume")
        assert again.end() == 2
        assert "ended with its practice, which was not passed" in again.errors
