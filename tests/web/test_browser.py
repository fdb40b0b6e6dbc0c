"""Both experiments in Chromium, by keys alone, against the command's own server."""

from __future__ import annotations

import base64
import re
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from chromium import Server, take_part
from participant import DEPTH, NECKER, make_set
from PIL import Image
from playwright.sync_api import Browser, Error, Page

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.dataset.conduct import exposures
from focalgradient.design import load_design
from focalgradient.tasks.registry import FILES

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")

TABLET = (820, 1180)

SCALES = {
    "ratio": 'language = "de"\n',
    "steps": 'scale = "steps"\ncatch_pictures = ["flatter", "deeper"]\n',
    "choice": 'scale = "choice"\ncatch_pictures = ["flatter", "deeper"]\n',
    "typed": 'answer = "typed"\nconfidence = true\nmask = "noise"\nmask_s = 0.15\nlanguage = "de"\n',
}


SHORT = DEPTH.replace(', "spheres-02"', "").replace("_trials = 3", "_trials = 1").replace("every = 6", "every = 3")
"""Six trials instead of fourteen, with a break after three."""


def served(folder: Path, design: str, *options: object) -> Server:
    (folder / "design.toml").write_text(design)
    if "depthrating" in design:
        make_set(folder / "set", ["spheres-00", "spheres-01", "spheres-02"], size=(320, 241))
    server = Server(folder, 0, *options)
    server.start("--invite", 1)
    return server


def journal(folder: Path) -> Path:
    return next((folder / "data" / "sourcedata").rglob("*.jsonl"))


@pytest.mark.parametrize(
    "scale", ["ratio", *(pytest.param(scale, marks=pytest.mark.slow) for scale in ("steps", "typed"))]
)
def test_depth_rating_from_its_link_to_a_valid_data_set(browser: Browser, tmp_path: Path, scale: str) -> None:
    design = DEPTH if scale == "steps" else SHORT
    server = served(tmp_path, design + SCALES[scale], "--completion", "https://example.org/done")
    wide, high = (1280, 800) if scale == "ratio" else TABLET
    page = browser.new_page(viewport={"width": wide, "height": high})
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(server.address)
    seen = []
    if scale == "steps":
        seen = take_part(page, until="button.step")
        places = [one.bounding_box() for one in page.query_selector_all("button.step")]
        assert len({place["y"] for place in places if place}) == 1  # side by side, from end to end of the scale
        assert all(place and place["x"] >= 0 and place["x"] + place["width"] <= wide for place in places)
    seen += take_part(page, name=f"depth-{scale}")
    assert page.get_attribute("#completion", "href") == "https://example.org/done"
    assert ("Wie tief sieht das Bild aus?" if scale in ("ratio", "typed") else "You will see pictures") in "".join(seen)
    # how many depends on how fast the machine goes
    left = r"Es dauert noch etwa \d+ min" if scale in ("ratio", "typed") else r"About \d+ min are left"
    assert re.search(left, "".join(seen))
    assert errors == []
    marked = [
        ("Übung" in text or "Practice" in text) for text in seen if re.search(r"\bsah das Bild aus|did it look", text)
    ]
    if scale in ("ratio", "typed"):
        assert any(marked)
        assert not marked[-1]
    page.close()
    assert server.end() == 0
    found = validate(tmp_path / "data", tmp_path / "set")
    assert found.problems == ()
    made = load_design(tmp_path / "design.toml")
    answers = read_journal(journal(tmp_path)).of("trial")
    assert len(answers) == len(made.trials("001"))
    if scale == "ratio":  # the first key puts the marker at a random place, the second moves it by one step
        key_step = 16 ** (1 / 60)  # that of the laboratory's window
        before_the_end = [one for one in answers if one["start"] * key_step < made.response_scale.bounds[1]]
        ratios = [one["rating"] / one["start"] for one in before_the_end]
        assert ratios == pytest.approx([key_step] * len(ratios), rel=1e-3)
        assert len({one["start"] for one in answers}) > len(answers) / 2
        table = read_dataset(tmp_path / "data").tables["depthrating"]
        asked = table["question_onset"] - table["onset"]
        assert ((table["onset"] - table["mark_onset"]).between(0.05, 60) & asked.between(0.2, 60)).all()
        assert (pd.to_datetime(table["sitting_began"]) > pd.Timestamp.now("UTC") - pd.Timedelta(hours=1)).all()
    if scale == "steps":
        assert {one["rating"] for one in answers} == {3.0}
        assert len({one["start"] for one in answers}) > 2  # the first arrow chose one at random
    if scale == "typed":
        assert {one["rating"] for one in answers} == {1.5}
        table = read_dataset(tmp_path / "data").tables["depthrating"]
        moved = table["confidence"] - table["confidence_start"]
        assert (moved[table["confidence"] < 1] > 0).all()
        asked = table["question_onset"] - table["mask_onset"]
        assert ((table["mask_onset"] - table["onset"]).between(0.28, 60) & asked.between(0.2, 60)).all()
    frames = [event for event in read_journal(journal(tmp_path)).of("note") if event["kind"] == "frames"]
    for one in frames:
        stamps = next(shown["stamps"] for shown in one["shown"] if shown["event"] == "picture")
        assert 280 < stamps[-1] - stamps[0] < 10_000  # 0.3 s, and what a busy machine adds
        assert all(np.diff(stamps) > 0)


@pytest.fixture(scope="module")
def consent_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server whose page asks for consent to a text with markup; nobody agrees."""
    folder = tmp_path_factory.mktemp("consent")
    (folder / "consent.txt").write_text("Consent <script>document.title='run'</script>\n\n<img src=x onerror=alert(1)>")
    server = served(folder, NECKER, "--consent", folder / "consent.txt")
    yield server
    server.end()


def test_a_picture_in_the_canvas_is_its_file_value_for_value(
    browser: Browser, consent_server: Server, tmp_path: Path
) -> None:
    shown = np.random.default_rng(1).integers(0, 256, (241, 320, 3), dtype=np.uint8)
    Image.fromarray(shown).save(tmp_path / "shown.png")
    page = browser.new_page()
    page.goto(consent_server.address)
    page.wait_for_function("globalThis.focalgradient")
    page.route("**/pictures/main/1/0", lambda route: route.fulfill(path=tmp_path / "shown.png"))
    told = page.evaluate(
        """async (url) => {
            const image = await focalgradient.load(url);
            const canvas = document.createElement("canvas");
            [canvas.width, canvas.height] = [image.width, image.height];
            const context = canvas.getContext("2d", { colorSpace: "srgb" });
            context.drawImage(image, 0, 0);
            const data = context.getImageData(0, 0, image.width, image.height).data;
            let text = "";
            for (const value of data) text += String.fromCharCode(value);
            return [image.width, image.height, btoa(text)];
        }""",
        "/pictures/main/1/0",
    )
    page.close()
    pixels = np.frombuffer(base64.b64decode(told[2]), np.uint8).reshape(told[1], told[0], 4)
    assert (pixels[..., :3] == shown).all()


@pytest.mark.slow
def test_greys_are_matched_by_keys_and_the_gamma_is_recorded(browser: Browser, tmp_path: Path) -> None:
    server = served(tmp_path, NECKER, "--gamma")
    page = browser.new_page(viewport={"width": TABLET[0], "height": TABLET[1]})
    page.goto(server.address)
    take_part(page, until="#virtual-chinrest-square")
    levels = []
    for number, of in enumerate((2, 4, 2, 4), 1):
        take_part(page, until="#board")
        page.wait_for_selector(f"text=({number} of 4)")
        for _ in range(3):
            page.keyboard.press("ArrowRight")
        rows = page.evaluate(
            """() => {
                const board = document.getElementById("board");
                const data = board.getContext("2d").getImageData(0, 0, 1, board.height).data;
                return [...data].filter((_, n) => n % 4 === 0);
            }"""
        )
        level = int(page.input_value("input[type=range]"))
        striped, even = rows[:32], rows[32:64]  # of the first column: a cell of either kind
        assert striped == [0 if row % of else 255 for row in range(32)]
        assert even == [level] * 32
        assert page.get_attribute("input[type=range]", "aria-label") == "Brightness of the grey squares"
        levels.append([1 / of, level])
        page.keyboard.press("Enter")
    take_part(page, until="button.held")
    page.close()
    server.end()
    log = read_journal(journal(tmp_path))
    (sitting,) = (note for note in log.of("note") if note["kind"] == "sitting")
    assert sitting["gamma_matches"] == levels
    each = [np.log(share) / np.log(level / 255) for share, level in levels]
    assert log.head["apparatus"]["gamma_seen"][0] == pytest.approx(np.mean(each))
    assert log.head["apparatus"]["gamma"] is None  # nothing was corrected by it


@pytest.mark.slow
@pytest.mark.parametrize("remove", [False, True])
def test_a_participant_stops_and_the_answers_are_kept_or_removed(
    browser: Browser, tmp_path: Path, remove: bool
) -> None:
    server = served(tmp_path, DEPTH)
    page = browser.new_page()
    page.goto(server.address)
    take_part(page, until="input[type=range]")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    take_part(page, until="canvas")
    assert not page.is_visible("#stop")  # not beside a picture
    page.wait_for_selector("input[type=range]")
    page.click("#stop")
    page.click("#stopping button:text-is('Continue')")
    assert page.is_visible("input[type=range]")
    assert len(read_journal(journal(tmp_path)).of("trial")) == 1
    page.click("#stop")
    page.click(f"#stopping button:text-is('Stop, {'remove' if remove else 'keep'} my answers')")
    page.wait_for_selector("text=You have stopped")
    assert not page.is_visible("#stop")
    if remove:
        assert not list(tmp_path.glob("data/**/sub-*"))
        page.reload()
        page.wait_for_selector("text=its data were deleted")
    else:
        page.reload()
        take_part(page, until="input[type=range]")
        page.reload()
        take_part(page)
        events = read_journal(journal(tmp_path)).events
        again = [
            event["extra"]["interruptions"]["value"] for event in events if "interruptions" in event.get("extra", {})
        ]
        assert again == [2]  # reloaded twice at the slider of the second trial
        assert {*exposures(events).values()} == {1, 3}
        found = validate(tmp_path / "data")
        assert found.problems == ()
        assert "1 trial was shown more than once (column interruptions); none is excluded." in "\n".join(found.notes)
    page.close()
    server.end()


def test_texts_are_shown_and_never_run(browser: Browser, consent_server: Server) -> None:
    page = browser.new_page()
    page.on("dialog", lambda dialog: pytest.fail(dialog.message))
    page.goto(consent_server.address)
    page.wait_for_selector("text=<script>")
    assert page.title() != "run"
    assert page.query_selector("img") is None
    page.click("text=I do not agree")
    page.wait_for_selector("text=Nothing was recorded")
    assert not (consent_server.folder / "data").exists()
    page.close()


@pytest.mark.slow
def test_the_browser_that_joined_comes_back_to_its_session_and_no_other_does(browser: Browser, tmp_path: Path) -> None:
    server = served(tmp_path, NECKER, "--join-rate", 2)
    address = f"http://127.0.0.1:{server.port}/"
    mine, other = browser.new_context(), browser.new_context()
    tokens: dict[str, list[str]] = {"named": [], "plain": []}
    for name, query in (("named", "?PROLIFIC_PID=5f1e&SESSION_ID={}"), ("plain", "")):
        for number, context in enumerate((mine, mine, other) if name == "named" else (mine, mine)):
            page = context.new_page()
            page.goto(address + query.format(number))
            page.wait_for_url("**/s/*", timeout=100_000)  # the fifth waits, and tries again
            tokens[name].append(page.evaluate("focalgradient.page.token"))
            page.reload()
            page.wait_for_selector("#stage *")
            page.wait_for_function("globalThis.focalgradient")
            assert page.evaluate("focalgradient.page.token") == tokens[name][-1]
            page.close()
    first, again, elsewhere = tokens["named"]
    assert first == again != elsewhere
    assert len({first, elsewhere, *tokens["plain"]}) == 4
    mine.close()
    other.close()
    server.end()
    assert len((tmp_path / "data-links.jsonl").read_text().splitlines()) == 5  # and the invitation


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

SIDES = {"width": 844, "height": 420}
PHONE: Any = {"viewport": SIDES, "screen": SIDES, "has_touch": True, "is_mobile": True}

TOUCHED = """() => [
    "#virtual-chinrest-circle", "#proceed", "input[type=range].unset", "#stage button:enabled:not(.held)",
].map((selector) => [...document.querySelectorAll(selector)].find((one) => one.checkVisibility())).find(Boolean)"""
"""What a finger touches next."""


@pytest.mark.slow
def test_the_pinhole_demonstration_by_touch_in_german(browser: Browser, tmp_path: Path) -> None:
    make_set(tmp_path / "set", ["spheres-01"], size=(320, 241))
    server = served(tmp_path, PINHOLE)
    phone = browser.new_context(**PHONE)
    page, seen, end = phone.new_page(), list[str](), time.monotonic() + 90
    page.goto(server.address)
    while not page.query_selector("#complete"):
        assert time.monotonic() < end, seen[-2:]
        text = page.inner_text("body")
        if text not in seen[-1:]:
            seen.append(text)
        with suppress(Error):  # the screen has changed meanwhile
            touch_on(page)
    seen += [text for _, text in page.evaluate("focalgradient.page.shown")]  # also of pages between two looks
    phone.close()
    assert server.end() == 0
    told = "".join(seen)
    for words in (
        "Durch das Loch",
        "Ohne alles",
        "Durch die Röhre",
        "Blicken Sie jetzt in den Raum",
        "Wie räumlich sah",
    ):
        assert words in told
    assert "LEERTASTE" not in told
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


SHOWN = "() => focalgradient.page.shown.filter(([name]) => name === 'trial').length"
"""Number of trials that have begun."""


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


def touch_on(page: Page) -> None:
    """Go on from a page that is not a trial."""
    found = page.evaluate_handle(TOUCHED).as_element()
    if found is None:
        return
    found.evaluate("(one) => one.scrollIntoViewIfNeeded()")
    if (box := found.bounding_box()) is not None:
        page.touchscreen.tap(box["x"] + 0.6 * box["width"], box["y"] + box["height"] / 2)
    with suppress(Error):  # or another touch falls on what comes next
        found.wait_for_element_state(
            "hidden", timeout=1000 if found.evaluate("(one) => one.tagName") == "BUTTON" else 100
        )
