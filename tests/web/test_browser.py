"""Both experiments in Chromium, by keys alone, against the command's own server."""

from __future__ import annotations

import base64
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chromium import Server, journal, served, take_part
from participant import DEPTH, NECKER, SHORT
from PIL import Image
from playwright.sync_api import Browser

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.dataset.conduct import exposures
from focalgradient.design import load_design

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")

TABLET = (820, 1180)

SCALES = {
    "ratio": 'language = "de"\n',
    "steps": 'scale = "steps"\ncatch_pictures = ["flatter", "deeper"]\n',
    "choice": 'scale = "choice"\ncatch_pictures = ["flatter", "deeper"]\n',
    "typed": 'answer = "typed"\nconfidence = true\nmask = "noise"\nmask_s = 0.15\nlanguage = "de"\n',
}


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
