"""What a participant meets in Chromium: the laboratory's sequence, also after a reload; form, consent, debriefing."""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from chromium import Server, journal, served, step, take_part
from participant import NECKER, SHORT
from playwright.sync_api import Browser, Error
from test_browser import SCALES
from test_revealed import THRESHOLD
from walked import walked

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.design import load_design
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import sequence
from focalgradient.design.words import load_words

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")

TASKS = {**{name: SHORT + scale for name, scale in SCALES.items()}, "necker": NECKER + 'keys = ["f", "left"]\n'}
PHONE = {"viewport": {"width": 390, "height": 844}, "screen": {"width": 390, "height": 844}, "has_touch": True}


def shown(page: Any) -> list[tuple[str, str]]:
    """What the page has shown since it was loaded, but for what comes before the sequence."""
    log = page.evaluate("focalgradient.page.shown")
    return [(event, text) for event, text in log if event not in ("consent", "form")]


def go_on(page: Any, trials: int) -> None:
    """Take part until so many trials that count have been shown."""
    seen: list[str] = []
    end = time.monotonic() + 200
    while sum(text.startswith("main") for event, text in shown(page) if event == "trial") < trials:
        assert time.monotonic() < end, f"stuck at {seen[-1:]}"
        with suppress(Error):  # the screen has changed meanwhile
            step(page, seen, "")
        time.sleep(0.1)


@pytest.mark.slow
@pytest.mark.parametrize("task", ["ratio", "choice", "necker"])
def test_a_session_and_its_reload_show_the_laboratorys_sequence(browser: Browser, tmp_path: Path, task: str) -> None:
    server = served(
        tmp_path, TASKS[task].replace("least_break_s = 0.0", "least_break_s = 2.0") + "practice_rounds = 2\n"
    )
    design: Any = load_design(tmp_path / "design.toml")
    words = load_words(design.language)
    trials, pages = design.trials("001"), pages_of(design, words, "001", browser=True)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(server.address)
    page.wait_for_function("globalThis.focalgradient")
    go_on(page, 3)
    before = shown(page)
    rounds = 1 + before.count(("feedback", pages.again().text))  # type: ignore[union-attr]
    whole = walked(sequence(design, words, pages, trials), rounds)
    assert before == whole[: len(before)]
    page.reload()
    page.wait_for_function("globalThis.focalgradient")
    again = take_part(page)
    measured = [words(f"web.{name}").splitlines()[0] for name in ("about", "card", "blind_spot")]
    assert not any(title in text for title in measured for text in again), "a reload asks for nothing a second time"
    done = len(trials) - page.evaluate("focalgradient.page.left.length")
    assert done >= 2  # of those that count: they are not asked for again
    assert shown(page) == walked(sequence(design, words, pages, trials, done))
    page.close()
    server.end()
    assert validate(tmp_path / "data", tmp_path / "set" if task != "necker" else None).problems == ()
    if task == "necker":
        assert {"rigid", "nonrigid"} <= {*read_dataset(tmp_path / "data").necker["percept"]}, "both keys count"


@pytest.mark.slow
def test_a_reload_leads_to_the_round_of_practice_that_was_due(browser: Browser, tmp_path: Path) -> None:
    server = served(tmp_path, THRESHOLD)
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(server.address)
    for _ in range(2):  # rounds in which the first picture was always chosen
        take_part(page, title="Once more")
        page.reload()
        take_part(page, title="Once more")
        page.click("button:text-is('Continue')")
        page.wait_for_selector("h1:text-is('Once more')", state="detached")
    take_part(page, title="Practice is over")
    page.reload()
    seen = take_part(page)
    page.close()
    server.end()
    assert not any("Once more" in text for text in seen), "all rounds are over"
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    notes = [note for note in read_journal(journal(tmp_path)).of("note") if note["kind"] == "practice"]
    assert [(note["round"], note["right"], note["of"]) for note in notes] == [(1, 1, 2), (2, 1, 2), (3, 1, 2)]
    failed = read_dataset(tmp_path / "data").participants["practice_failed"]
    assert failed.tolist() == ["blurthreshold"]


@pytest.mark.slow
def test_consent_of_several_pages_form_and_debriefing(browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "consent.txt").write_text(
        "Version: 2.1\nWhat we do\n\nYou look at a cube.\fYour rights\n\nYou can stop."
    )
    server = served(tmp_path, NECKER, "--consent", tmp_path / "consent.txt")
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(f"http://127.0.0.1:{server.port}/")
    page.wait_for_selector("h1:text-is('What we do')")
    page.click("button:text-is('Continue')")
    page.wait_for_selector("h1:text-is('Your rights')")
    page.click("button:text-is('I agree')")
    page.wait_for_selector("#form-age")
    page.fill("#form-age", "old")
    page.click("button[type=submit]")
    assert "number of years" in page.inner_text("[role=alert]")
    page.fill("#form-age", "34")
    assert page.inner_text("label[for=form-sex]") == "Sex"
    page.select_option("#form-sex", label="female")
    page.select_option("#form-handedness", label="left-handed")
    page.click("button[type=submit]")
    seen = take_part(page, title="What this was about")
    assert not any("right or wrong" in text for text in seen)
    take_part(page)
    page.close()
    server.end()
    found = read_dataset(tmp_path / "data").participants.iloc[0]
    assert (found["age"], found["sex"], found["handedness"]) == (34, "female", "left")
    noted = next(event for event in read_journal(journal(tmp_path)).of("note") if event["kind"] == "sitting")
    assert (noted["consent"]["version"], noted["consent"]["file"]) == ("2.1", "consent.txt")


@pytest.mark.slow
def test_a_phone_is_refused_before_a_label_is_taken(browser: Browser, tmp_path: Path) -> None:
    server = served(tmp_path, NECKER)
    context = browser.new_context(**PHONE, is_mobile=True)  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(f"http://127.0.0.1:{server.port}/?PROLIFIC_PID=pid-of-a-phone")
    page.wait_for_selector("text=This screen is too small")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    context.close()
    server.end()
    assert "pid-of-a-phone" not in "".join(path.read_text() for path in tmp_path.glob("data-links*"))
    assert not (tmp_path / "data").exists()


BLOCKED = """for (const name of ["sessionStorage", "localStorage", "indexedDB"]) {
    Object.defineProperty(window, name, { get() { throw new DOMException("blocked", "SecurityError"); } });
}"""


@pytest.mark.slow
def test_blocked_storage_and_no_javascript_are_said(browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "design.toml").write_text('task = "necker"\nlanguage = "de"\n')
    server = Server(tmp_path)
    server.start("--invite", 1)
    try:
        blocked = browser.new_context()
        blocked.add_init_script(BLOCKED)
        page = blocked.new_page()
        page.goto(server.address)
        page.wait_for_selector("text=Erlauben Sie Cookies")
        page = browser.new_context(java_script_enabled=False).new_page()
        page.goto(server.address)
        said = page.inner_text("body")
        assert "needs JavaScript" in said
        assert "braucht JavaScript" in said
    finally:
        server.end()
    assert not (tmp_path / "data").exists()


@pytest.mark.slow
def test_a_choice_by_focus_or_touch_and_back_and_forward_lose_and_repeat_nothing(
    browser: Browser, tmp_path: Path
) -> None:
    server = served(tmp_path, TASKS["choice"])
    trials = load_design(tmp_path / "design.toml").trials("001")
    context = browser.new_context(viewport={"width": 1280, "height": 800}, has_touch=True)
    page = context.new_page()
    page.goto(f"http://127.0.0.1:{server.port}/static/page.css")  # to which Back leads
    page.goto(server.address)
    for answered in ("focus", "touch", "left"):
        take_part(page, until="button.way")
        first, second = page.locator("button.way").all()
        assert page.get_by_role("group", name=page.inner_text("h2")).get_by_role("button").count() == 2
        if answered == "focus":
            for _ in range(4):
                page.keyboard.press("Tab")
                if first.evaluate("(way) => way.matches(':focus-visible')"):
                    break
            page.keyboard.press("Enter")
        elif answered == "touch":
            second.tap()
        else:
            page.go_back()
            assert page.url.endswith("page.css")
            page.go_forward()
            page.wait_for_function("globalThis.focalgradient")
            continue
        page.wait_for_selector("button.way", state="detached")
    take_part(page)
    context.close()
    server.end()
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    events = read_journal(journal(tmp_path)).of("trial")
    assert [(event["phase"], event["trial"]) for event in events] == [(one.phase, one.trial) for one in trials]
    chosen = [1.0 if one.interval == way else 0.0 for way, one in enumerate(trials[:2], start=1)]
    assert [event["rating"] for event in events[:2]] == chosen
    table = read_dataset(tmp_path / "data").depth_rating
    assert table["trial"].tolist() == [one.trial for one in trials if one.phase == "main"]


@pytest.mark.slow
def test_of_two_windows_opened_at_once_the_second_continues_when_the_first_is_closed(
    browser: Browser, tmp_path: Path
) -> None:
    server = served(tmp_path, NECKER)
    first, second = browser.new_page(), browser.new_page()
    for page in (first, second):
        page.set_viewport_size({"width": 1280, "height": 800})
        page.goto(server.address)
    take_part(first, until="button.held")
    second.wait_for_selector("text=This session is open in another window")
    first.close()
    second.wait_for_selector("text=Full screen", timeout=60_000)
    take_part(second)
    second.close()
    server.end()
    assert validate(tmp_path / "data").problems == ()
    assert len(read_journal(journal(tmp_path)).of("trial")) == len(load_design(tmp_path / "design.toml").trials("001"))
