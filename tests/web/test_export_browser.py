"""An exported study in Chromium, from a server of plain files with a stand-in for the platform, and read back."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from chromium import take_part
from command_line import succeed
from participant import DEPTH, NECKER, Participant, client_of, make_set, study
from platform_stub import Platform, platform
from playwright.sync_api import Browser, Page

from focalgradient.dataset import read_journal, validate
from focalgradient.design import load_design

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")


def exported(folder: Path, design: str, *options: object) -> Path:
    (folder / "design.toml").write_text(design)
    pictures: list[object] = []
    if "depthrating" in design:
        make_set(folder / "set", ["spheres-00", "spheres-01", "spheres-02"], size=(320, 241))
        pictures = ["--stimuli", folder / "set"]
    succeed("serve", folder / "design.toml", *pictures, "--export", folder / "study", "--participants", "2-4", *options)
    return folder / "study"


@contextmanager
def opened(browser: Browser, stub: Platform, address: str) -> Iterator[Page]:
    """A page of a browser of its own; it may ask nobody but the study's own address and the platform."""
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    elsewhere: list[str] = []
    allowed = (stub.address, "https://pipe.jspsych.org/", "https://pavlovia.org/", "data:", "blob:")
    context.on("request", lambda one: None if one.url.startswith(allowed) else elsewhere.append(one.url))
    stub.beside(context)
    page = context.new_page()
    page.on("pageerror", lambda error: elsewhere.append(str(error)))
    page.goto(f"{stub.address}/{address}")
    yield page
    context.close()
    assert elsewhere == []


def journal(folder: Path, label: str = "002") -> Path:
    return next((folder / "sourcedata").rglob(f"sub-{label}*.jsonl"))


def shape(value: Any) -> Any:
    """A value with its numbers and times left out: what two sessions of one list have in common."""
    if isinstance(value, dict):
        return {key: shape(one) for key, one in value.items() if key not in OF_ONE_SESSION}
    if isinstance(value, list):
        return ["..."] if value and isinstance(value[0], (int, float, list)) else [shape(one) for one in value]
    return type(value).__name__ if isinstance(value, float) else value


OF_ONE_SESSION = {"attempt", "browser", "dropped_frames", "hidden", "left_full_screen", "zoomed", "time", "starlette"}
OF_ONE_SESSION |= {"platform", "received", "record", "presses", "screen_px", "screen_m", "waited_s"}
# Unknown where a busy computer hides the browser's frame rate.
OF_ONE_SESSION |= {"clock", "refresh_hz", "viewing_distance_m", "viewing_distance_sd_m"}


def served_events(folder: Path, design: str, label: str = "002") -> list[Any]:
    """The journal of a session with a server, for the same label."""
    (folder / "served").mkdir()
    with client_of(study(folder / "served", design)) as client:
        Participant(client)  # 001
        someone = Participant(client)
        assert someone.begin().status_code == 200
        for number in range(len(someone.trials)):
            assert someone.answer(number).status_code == 200
    return events_of(journal(folder / "served" / "data", label))


def events_of(path: Path) -> list[Any]:
    """What a journal holds, but for exposures, and for practice that was repeated: there the answers decide."""
    events = read_journal(path).events
    return [shape(event) for event in events if event.get("kind") not in ("exposure", "practice", "practice again")]


@pytest.mark.slow
def test_a_study_on_jatos_gives_the_journal_of_a_served_one(browser: Browser, tmp_path: Path) -> None:
    bundle = exported(tmp_path, DEPTH, "--completion", "https://example.org/done")
    with platform(bundle) as stub, opened(browser, stub, "jatos.html") as page:
        seen = take_part(page, until="input[type=range]", name="jatos")
        stub.away = True
        for key in ("ArrowRight", "ArrowRight", "Enter"):
            page.keyboard.press(key)
        take_part(page, until="input[type=range]", name="jatos")
        page.reload()  # while the network is away: nothing is lost
        stub.away = False
        take_part(page, name="jatos")
        assert page.get_attribute("#completion", "href") == "https://example.org/done"
    assert "You will see pictures" in "".join(seen)
    assert stub.ended == ["https://example.org/done"]
    assert stub.batch == {"list-002": 7}

    (tmp_path / "result.txt").write_text(stub.text)
    words = ("collect", tmp_path / "result.txt", "--stimuli", tmp_path / "set", "--data", tmp_path / "data")
    trials = load_design(tmp_path / "design.toml").trials("002")
    assert f"sub-002: {len(trials)} of {len(trials)} trials, {len(trials)} new" in succeed(*words).output
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    events = events_of(journal(tmp_path / "data"))
    resumed = next(number for number, event in enumerate(events) if event["event"] == "resumed")
    assert events[resumed + 1]["kind"] == "sitting"
    del events[resumed : resumed + 2]
    reloaded = next(event for event in events[resumed:] if event["event"] == "trial")
    assert reloaded.pop("extra")["interruptions"]["value"] == 1
    assert events == served_events(tmp_path, DEPTH)

    before = {path: path.read_bytes() for path in (tmp_path / "data").rglob("*") if path.is_file()}
    assert "0 new" in succeed(*words).output
    assert before == {path: path.read_bytes() for path in (tmp_path / "data").rglob("*") if path.is_file()}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["datapipe", "pavlovia"])
def test_the_cube_on_other_platforms(browser: Browser, tmp_path: Path, name: str) -> None:
    bundle = exported(tmp_path, NECKER, "--datapipe", "abc123")
    address = {"datapipe": "datapipe.html", "pavlovia": "index.html?participant=3"}[name]
    with platform(bundle) as stub, opened(browser, stub, address) as page:
        take_part(page, until="button.held", name=name)
        other = page.context.new_page()
        other.goto(f"{stub.address}/{address}")
        other.wait_for_selector("text=This session is open in another window")
        other.close()
        for title in ("Once more", ""):  # until practice is to be repeated, and from there to the end
            page.goto("about:blank")
            page.goto(f"{stub.address}/{address}")
            take_part(page, name=name, title=title)
    files = []
    for number, (file, content) in enumerate(stub.files.items()):
        assert "/" not in file
        (tmp_path / f"{number}.csv").write_text(content, newline="")
        files.append(tmp_path / f"{number}.csv")
    assert len(files) >= 2  # the beginning is sent at once
    assert stub.closed == ([{"isCompleted": True}] if name == "pavlovia" else [])
    report = json.loads(succeed("collect", *files, "--data", tmp_path / "data", "--json").output)
    assert report["left_out"] == []
    (session,) = report["sessions"]
    assert (session["participant"], session["answered"]) == ("003", session["trials"])
    assert validate(tmp_path / "data").problems == ()
    found = read_journal(journal(tmp_path / "data", "003"))
    assert any(event["presses"] for event in found.of("trial"))
    assert len(found.of("resumed")) == 2
    rounds = [(note["round"], note["passed"]) for note in found.of("note") if note["kind"] == "practice"]
    assert rounds == [(1, False), (2, False), (3, False)]


@pytest.mark.slow
def test_what_is_refused_at_the_end_is_offered_as_a_file(browser: Browser, tmp_path: Path) -> None:
    bundle = exported(tmp_path, NECKER, "--datapipe", "abc123", "--completion", "https://example.org/done")
    with platform(bundle) as stub, opened(browser, stub, "datapipe.html?participant=2") as page:
        take_part(page, until="button.held", name="over")
        stub.over = True
        seen = take_part(page, until="#undelivered", name="over")
        assert "There is no such experiment" in seen[-1]
        assert page.query_selector("#completion") is None
        with page.expect_download() as given:
            page.focus("#file")
            page.keyboard.press("Enter")
        given.value.save_as(tmp_path / "rest.csv")
    (tmp_path / "first.csv").write_text("".join(stub.files.values()), newline="")
    succeed("collect", tmp_path / "first.csv", tmp_path / "rest.csv", "--data", tmp_path / "data")
    assert validate(tmp_path / "data").problems == ()
