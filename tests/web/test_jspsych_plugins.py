"""The plugins for jsPsych in Chromium: an experiment of ten lines, pixel by pixel, and what a package holds."""

from __future__ import annotations

import base64
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import browser
import cv2
import numpy as np
import pytest

from focalgradient.display import Display
from focalgradient.live import FocusSeries, packed
from focalgradient.render import necker_frame
from focalgradient.scenes import NeckerCube
from focalgradient.stimuli.cube_frames import room_of, shown

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")

SHAPE = (120, 160)


def series() -> FocusSeries:
    random = np.random.default_rng(7)
    planes = [cv2.resize(random.uniform(0, 1, (12, 16, 3)) ** 2, SHAPE[::-1]).astype(np.float16) for _ in range(4)]
    return FocusSeries((0.5, 1.0, 1.5, 2.5), tuple(planes), np.ones(SHAPE), np.full((3, 2), np.nan))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[browser.Browser, str, Path]]:
    """A browser, the address of a folder, and the folder: with a picture and a series."""
    folder = tmp_path_factory.mktemp("jspsych")
    random = np.random.default_rng(3)
    cv2.imwrite(str(folder / "picture.png"), random.integers(0, 256, (*SHAPE, 3), dtype=np.uint8))
    (folder / "series").mkdir()
    (folder / "series" / "focus.json").write_text(json.dumps(packed(series())))
    with browser.serving(folder) as address, browser.Browser() as chromium:
        yield chromium, address, folder


def open_timeline(site: tuple[browser.Browser, str, Path], source: str, name: str) -> browser.Browser:
    """Bundle a timeline as a laboratory writes it, and open it."""
    chromium, address, folder = site
    page = browser.bundle_jspsych(f"{source}\nwindow.done = jsPsych.data.get().values();\n", folder, name)
    chromium.call("Emulation.setDeviceMetricsOverride", width=1000, height=700, deviceScaleFactor=1, mobile=False)
    chromium.events.clear()
    chromium.call("Page.navigate", url=f"{address}/{page}")
    return chromium


def press(page: browser.Browser, key: str, *kinds: str) -> None:
    """Press a key and release it, or only one of the two."""
    text = {"text": key} if len(key) == 1 else {}
    for kind in kinds or ("keyDown", "keyUp"):
        page.call("Input.dispatchKeyEvent", type=kind, key=key, **(text if kind == "keyDown" else {}))


def pixels(page: browser.Browser, name: str) -> np.ndarray:
    """What the canvas shows, from a screenshot: canvases with WebGL, too."""
    x, y, width, height = page.js(
        f"(() => {{ const r = document.querySelector('#{name}').getBoundingClientRect();"
        " return [r.x, r.y, r.width, r.height]; })()"
    )
    data = base64.b64decode(page.call("Page.captureScreenshot")["data"])
    whole = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    return whole[round(y) : round(y + height), round(x) : round(x + width), ::-1].astype(int)


def encoded(focus: float) -> np.ndarray:
    return series().encoded(focus, Display()).astype(int)


@pytest.mark.slow
def test_an_experiment_of_ten_lines(site: tuple[browser.Browser, str, Path]) -> None:
    source = (browser.JSPSYCH / "examples" / "timeline.js").read_text("utf-8")
    assert len(source.strip().splitlines()) <= 10
    page = open_timeline(site, source, "timeline")
    page.wait("document.querySelector('#item')")
    page.js("document.querySelector('#end_resize_phase').click()")
    page.wait("document.querySelector('#virtual-chinrest-circle')")
    for _ in range(5):
        left = page.js("document.querySelector('#click').textContent")
        press(page, " ")
        time.sleep(1.2)
        press(page, " ")
        page.wait(f"document.querySelector('#click')?.textContent !== {json.dumps(left)}")
    page.wait("document.querySelector('#jspsych-html-button-response-btngroup button')")
    page.js("document.querySelector('#jspsych-html-button-response-btngroup button').click()")
    page.wait("document.querySelector('#picture')?.width === 160")
    time.sleep(0.2)
    press(page, "x")
    press(page, "j")
    page.wait("document.querySelector('#focal-blur-foot input')")
    start = page.js("Number(document.querySelector('#focal-blur-foot input').value)")
    press(page, "ArrowRight")
    wanted = min(start + 2.0 / 25, 2.5)
    page.wait(f"Math.abs(document.querySelector('#focal-blur-foot input').value - {wanted}) < 1e-9")
    time.sleep(0.2)
    assert np.abs(pixels(page, "focal-blur") - encoded(wanted)).max() <= 1
    press(page, "Enter")
    page.wait("document.querySelector('#cube')")
    time.sleep(0.4)
    press(page, "f", "keyDown")
    time.sleep(0.6)
    press(page, "f", "keyUp")
    page.wait("window.done")
    rows = page.js("window.done")
    assert [row["trial_type"] for row in rows[-3:]] == ["focal-picture", "focal-blur", "focal-cube"]
    picture, blur, cube = rows[-3:]
    assert picture["response"] == "j"
    assert picture["stimulus"].endswith(".png")
    assert 0 < picture["rt"] < 2000
    assert blur["focus"] == pytest.approx(wanted)
    assert blur["start"] == pytest.approx(start)
    assert blur["rt"] > 0
    assert cube["held"]["rigid"] == pytest.approx(0.6, abs=0.3)
    assert cube["held"]["nonrigid"] == 0
    assert cube["seconds"] == pytest.approx(2.0, abs=0.2)
    assert cube["pixels_per_degree"] > 0
    assert cube["viewing_distance_mm"] > 0


SHOWN = """
import { initJsPsych } from "jspsych";
import { FocalBlur, FocalCube, FocalPicture } from "@focalgradient/jspsych";
const jsPsych = initJsPsych();
const still = { pixels_per_degree: 40, turns_per_s: 1e-9, size_deg: 5, gradient: "rigid" };
const blur = { type: FocalBlur, stimulus: "series/focus.json" };
await jsPsych.run([
  { type: FocalPicture, stimulus: "picture.png", choices: ["a"] },
  { ...blur, focus: 1.2, choices: ["a"] },
  { ...blur, focus_at: (s) => 0.5 + s, trial_duration: 1000, choices: "NO_KEYS" },
  { type: FocalCube, ...still, trial_duration: 5000 },
]);
"""


@pytest.mark.slow
def test_what_is_shown_is_the_stimulus_to_the_8_bit_step(site: tuple[browser.Browser, str, Path]) -> None:
    cube = NeckerCube(size=np.radians(5.0), line_width=np.radians(0.05))
    angle = float(np.tan(np.radians(1)) / 40)
    light = necker_frame(
        cube, 0.0, shape=room_of(cube, 0.004, angle), pixel_angle=angle, gradient="rigid", aperture=0.004
    )
    page = open_timeline(site, SHOWN, "shown")
    page.wait("document.querySelector('#picture') && document.querySelector('#picture').width === 160")
    time.sleep(0.3)
    file = cv2.imread(str(site[2] / "picture.png"))
    assert np.abs(pixels(page, "picture") - file[..., ::-1].astype(int)).max() == 0
    press(page, "a")
    page.wait("document.querySelector('#focal-blur') && document.querySelector('#focal-blur').width === 160")
    time.sleep(0.3)
    assert np.abs(pixels(page, "focal-blur") - encoded(1.2)).max() <= 1
    press(page, "a")
    page.wait("document.querySelector('#cube')")
    time.sleep(0.5)
    seen = pixels(page, "cube")
    assert seen.shape[:2] == light.shape
    assert np.abs(seen[..., 0] - shown(light, Display()).astype(int)).max() <= 1
    page.wait("window.done")
    live = page.js("window.done")[2]
    times, focus = np.array(live["changes"]).T
    assert len(times) > 5
    assert np.abs(focus - (0.5 + times / 1000)).max() < 1e-3
