"""Sessions in Chromium on a phone held across, by touch alone, against the command's own server."""

from __future__ import annotations

import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from chromium import journal, served, take_part_by_touch, touch_on
from participant import SHORT, make_set
from playwright.sync_api import Browser, Error
from test_revealed import THRESHOLD

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.tasks.registry import FILES

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")

SIDES = {"width": 844, "height": 420}
PHONE: Any = {"viewport": SIDES, "screen": SIDES, "has_touch": True, "is_mobile": True}

SMALL = "smallest_screen = [800, 400]\n"
TYPED = SHORT + SMALL + 'answer = "typed"\nconfidence = true\nmask = "noise"\nmask_s = 0.15\n'

SHOWN = "() => focalgradient.page.shown.filter(([name]) => name === 'trial').length"
"""Number of trials that have begun."""


@pytest.mark.slow
@pytest.mark.parametrize("language", ["en", "de"])
def test_numbers_are_typed_and_confidence_is_rated_by_touch(browser: Browser, tmp_path: Path, language: str) -> None:
    server = served(tmp_path, TYPED + f'language = "{language}"\n')
    phone = browser.new_context(**PHONE)
    page = phone.new_page()
    page.goto(server.address)
    texts = "".join(take_part_by_touch(page, f"typed-touched-{language}"))
    phone.close()
    assert server.end() == 0
    assert ("Bitte tippen Sie eine Zahl von 0,25 bis 4" if language == "de" else "a number from 0.25 to 4") in texts
    assert ("tippen Sie auf den Bildschirm" if language == "de" else "tap the screen") in texts, "no space bar is there"
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    table = read_dataset(tmp_path / "data").depth_rating
    assert {*table["rating"]} == {1.5}
    assert table["confidence"].between(0.5, 0.7).all(), "where it was touched"
    asked = table["question_onset"] - table["mask_onset"]
    assert ((table["mask_onset"] - table["onset"]).between(0.28, 60) & asked.between(0.2, 60)).all()


@pytest.mark.slow
def test_intervals_of_a_threshold_are_chosen_by_touch(browser: Browser, tmp_path: Path) -> None:
    server = served(tmp_path, THRESHOLD + SMALL)
    phone = browser.new_context(**PHONE)
    page = phone.new_page()
    page.goto(server.address)
    take_part_by_touch(page, "threshold-touched", until="button.way")
    page.set_viewport_size({"width": 420, "height": 844})
    end = time.monotonic() + 60
    while not page.is_visible("dialog:text('hold the phone or tablet across')"):  # before the next trial
        assert time.monotonic() < end, page.inner_text("body")
        with suppress(Error):  # the screen has changed meanwhile
            touch_on(page)
    turned = page.evaluate(SHOWN)
    page.wait_for_timeout(500)
    assert page.evaluate(SHOWN) == turned, "no picture is shown upright, where it may be cut off"
    page.set_viewport_size(SIDES)
    take_part_by_touch(page, "threshold-touched")
    phone.close()
    assert server.end() == 0
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    (table,) = (one for one in read_dataset(tmp_path / "data").tables.values() if len(one))
    assert {*table["answer"]} == {1}, "the first of the two buttons"
    assert table["correct"].tolist() == (table["interval"] == 1).tolist()
    assert table["level"].iloc[1:].nunique() > 1, "it adapts to the answers"


PINHOLE = """task = "pinhole"
language = "de"
scenes = ["spheres-01"]
repetitions = 1
look_s = 0.5
picture_s = 0.3
field_deg = 6.0
ask = ["eye"]
smallest_screen = [800, 400]
"""


@pytest.mark.slow
def test_the_pinhole_demonstration_by_touch_in_german(browser: Browser, tmp_path: Path) -> None:
    make_set(tmp_path / "set", ["spheres-01"], size=(320, 241))
    server = served(tmp_path, PINHOLE)
    phone = browser.new_context(**PHONE)
    page = phone.new_page()
    page.goto(server.address)
    seen = take_part_by_touch(page, "pinhole-touched")
    phone.close()
    assert server.end() == 0
    texts = "".join(seen)
    for words in (
        "Durch das Loch",
        "Ohne alles",
        "Durch die Röhre",
        "Blicken Sie jetzt in den Raum",
        "Wie räumlich sah",
    ):
        assert words in texts
    assert "LEERTASTE" not in texts
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    table = read_dataset(tmp_path / "data").pinhole
    assert Counter(table["form"]) == {"real": 3, "picture": 3}
    assert table["stimulus"].isna().tolist() == (table["form"] == "real").tolist()
    assert table["shown_sha256"].notna().sum() == 2  # pictures in the round field
    frames = [event for event in read_journal(journal(tmp_path)).of("note") if event["kind"] == "frames"]
    looked = [part["event"] for event in frames for part in event["shown"] if event["condition"]["form"] == "real"]
    assert Counter(looked)["look"] == 3


BRIGHT = """
from dataclasses import dataclass, field

import numpy as np

from focalgradient.dataset import Response
from focalgradient.design import Plan, Trial
from focalgradient.scales import Held
from focalgradient.tasks import Step, Task, register


@dataclass(frozen=True, slots=True, kw_only=True)
class BrightTrial(Trial):
    turns: int = field(metadata={"about": "Cycles of the light."})


@dataclass(frozen=True, slots=True, kw_only=True)
class BrightAnswer(Response):
    held: float = field(metadata={"about": "Time for which it looked bright.", "units": "s", "least": 0})
    pressed: int = field(metadata={"about": "Number of key presses.", "least": 0})


class BrightDesign(Plan):
    task: str = "bright"
    repetitions: int = 1
    practice_trials: int = 0

    def trials(self, participant, session=None):
        return self.ordered(participant, session, [BrightTrial(turns=turns) for turns in (1, 2)])


@register
class Bright(Task):
    \"\"\"Hold a key while a square looks bright, another while it looks dark.\"\"\"

    name, title = "bright", "Brightness of a square"
    design, trial, answer = BrightDesign, BrightTrial, BrightAnswer
    texts = {"en": {"instructions": "Bright or dark?\\nHold the key of what you see.", "b": "bright", "d": "dark"}}

    def shown(self, design, trial, pixels_per_degree, *, refresh_hz=60.0):
        light = np.sin(np.linspace(0, 2 * np.pi * trial.turns, round(refresh_hz), endpoint=False))
        return Step((np.full((200, 260), 128 + 100 * one, np.uint8) for one in light), 2.5, "square")

    def control(self, words, trial):
        return Held(("b", "right"), (self.text(words, "b"), self.text(words, "d")))

    def answered(self, design, trial, value, **times):
        down = {press.key: press.time for press in value if press.down}
        held = sum(press.time - down[press.key] for press in value if not press.down and press.key == "b")
        return BrightAnswer(held=held, pressed=sum(press.down for press in value), **times)
"""


@pytest.mark.slow
def test_keys_of_a_task_of_ones_own_are_held_by_touch_during_its_film(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bright.py").write_text(BRIGHT)
    monkeypatch.setenv(FILES, str(tmp_path / "bright.py"))
    server = served(tmp_path, 'task = "bright"\nask = []\nsmallest_screen = [800, 400]\n')
    context = browser.new_context(**PHONE)
    page, trials, end = context.new_page(), 0, time.monotonic() + 90
    page.goto(server.address)
    while not page.query_selector("#complete"):
        assert time.monotonic() < end, page.inner_text("body")
        with suppress(Error):  # the screen has changed meanwhile
            if not page.query_selector("button.held"):
                touch_on(page)
                continue
            if (number := page.evaluate(SHOWN)) == trials:
                continue
            trials = number
            label = page.locator("button.held").first
            assert label.inner_text() == "B bright"
            box = label.bounding_box()
            assert box
            touch = page.context.new_cdp_session(page)
            place = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
            touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [place]})
            page.wait_for_timeout(300)
            touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
            page.locator("button.held").last.tap()
            page.wait_for_function(f"({SHOWN})() > {trials} || !document.querySelector('button.held')")
    context.close()
    assert server.end() == 0
    assert validate(tmp_path / "data").problems == ()
    table = read_dataset(tmp_path / "data").tables["bright"]
    assert trials == len(table) == 2
    assert 0.25 <= table["held"].max() <= 1.0  # Chromium cancels a touch that a busy machine answers late
    assert table["pressed"].tolist() == [2, 2]
    assert table["response_time"].between(2.45, 2.6).all()
    frames = [event for event in read_journal(journal(tmp_path)).of("note") if event["kind"] == "frames"]
    assert [part["event"] for event in frames for part in event["shown"]] == ["square", "square"]
