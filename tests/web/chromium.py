"""A participant with a browser: Chromium without a window, a server of its own, and answers by keys or by touch."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

from interrupts import interruptible
from participant import make_set
from playwright.sync_api import Error, Page

LOOK = os.environ.get("FOCALGRADIENT_SCREENSHOTS")
"""A folder to keep what each screen looked like in."""


class Server:
    """The command, serving from a folder; it can be killed and started again at the same address."""

    def __init__(self, folder: Path, port: int = 0, *options: object, store: str | None = None):
        self.folder, self.options, self.store = folder, options, store
        self.port, self.token, self.password = port, "", ""

    def start(self, *options: object) -> None:
        """Start it, and wait until it has said its addresses."""
        program = [str(Path(sys.executable).with_name("focalgradient")), "serve", "design.toml"]
        kept = ["--data", "data"] if self.store is None else ["--store", self.store]
        pictures = ["--stimuli", "set"] if (self.folder / "set").exists() else []
        given = [*program, *kept, *pictures, "--port", str(self.port), *map(str, (*self.options, *options))]
        with interruptible():
            self.process = subprocess.Popen(given, cwd=self.folder, stdout=subprocess.PIPE, text=True, bufsize=1)
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if found := re.search(r"http://127\.0\.0\.1:(\d+)/", line):
                self.port = int(found[1])
            if found := re.search(r"/s/([\w-]+)", line):
                self.token = found[1]
            if found := re.search(r"password: ([\w-]+)", line):
                self.password = found[1]
            if line.startswith("Ctrl-C"):
                return
        raise AssertionError(f"the server ended: {self.process.wait()}")

    @property
    def address(self) -> str:
        """Of the page of the invited participant."""
        return f"http://127.0.0.1:{self.port}/s/{self.token}"

    def end(self, how: int = signal.SIGINT) -> int:
        """End it."""
        self.process.send_signal(how)
        self.process.communicate(timeout=60)
        return self.process.returncode


def served(folder: Path, design: str, *options: object) -> Server:
    """A server of a design, with an invitation."""
    (folder / "design.toml").write_text(design)
    if "depthrating" in design or "blurthreshold" in design:
        make_set(folder / "set", ["spheres-00", "spheres-01", "spheres-02"], size=(320, 241))
    server = Server(folder, 0, *options)
    server.start("--invite", 1)
    return server


def journal(folder: Path) -> Path:
    """The journal of the only session."""
    return next((folder / "data" / "sourcedata").rglob("*.jsonl"))


def _screen(page: Page) -> str:
    return page.inner_text("body").strip()


def take_part(
    page: Page, *, seconds: float = 500, until: str = "#complete", title: str = "", name: str = ""
) -> list[str]:
    """Go through the screens by keys until the end, or until a CSS selector or a title is there; give their texts."""
    seen: list[str] = []
    end = time.monotonic() + seconds
    arrived = False
    while not arrived:
        assert time.monotonic() < end, f"stuck at {seen[-1:]}"
        try:
            arrived = step(page, seen, name, until, title)
        except Error as error:  # the screen has changed meanwhile
            if "closed" in str(error):
                raise
        time.sleep(0.1)
    seen.append(_screen(page))
    _look(page, name, len(seen))
    return seen


def _look(page: Page, name: str, number: int) -> None:
    if LOOK:
        page.screenshot(path=str(Path(LOOK, f"{name}-{number:02}.png")))


KIND = """([until, title]) => {
    if (!window.answered) {
        window.answered = [];
        addEventListener("keydown", () => window.answered.push(document.body.innerText.trim()), true);
    }
    const arrived = title
        ? [...document.querySelectorAll("h1")].some((one) => one.innerText.trim() === title)
        : until && document.querySelector(until);
    const found = arrived ? ["arrived"] : [
        ["typed", "#typed"],
        ["slider", "input[type=range]"], ["step", "button.step"], ["held", "button.held"],
        ["blind spot", "#blind-spot"], ["card", "#page-size"], ["arrows", "button.way"],
        ["button", "#stage button:enabled"],
    ].find(([, selector]) => [...document.querySelectorAll(selector)].some((one) => one.checkVisibility()));
    return [found?.[0] ?? "none", document.body.innerText.trim(), window.answered.splice(0)];
}"""
"""What is on the screen, and what it says, at one moment, in which the screen cannot change; screens that got a key."""


FAINT = """() => {
    const parts = (colour) => colour.match(/[\\d.]+/g).map(Number);
    const light = (colour) => parts(colour).slice(0, 3).map((value) => value / 255)
        .map((value) => value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4)
        .reduce((sum, value, index) => sum + value * [0.2126, 0.7152, 0.0722][index], 0);
    const ground = (one) => {
        for (; one; one = one.parentElement) {
            const found = getComputedStyle(one).backgroundColor;
            if (parts(found)[3] !== 0) return light(found);
        }
        return 1;
    };
    const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const faint = [];
    while (words.nextNode()) {
        const one = words.currentNode.parentElement, text = words.currentNode.data.trim();
        if (!text || one.closest(":disabled") || !one.checkVisibility({visibilityProperty: true})) continue;
        const [least, most] = [light(getComputedStyle(one).color), ground(one)].sort((a, b) => a - b);
        if ((most + 0.05) / (least + 0.05) < 7) faint.push([text, (most + 0.05) / (least + 0.05)]);
    }
    return faint;
}"""
"""Texts whose contrast is below 7 to 1, WCAG 2.2's level AAA; not those of buttons that cannot be pressed."""


def step(page: Page, seen: list[str], name: str, until: str = "", title: str = "") -> bool:
    """Answer the screen by keys; `seen` gains what it says. True, and unanswered, where `until` or `title` is there."""
    kind, text, answered = page.evaluate(KIND, [until, title])
    seen += [one for one in dict.fromkeys(answered) if one and one not in seen[-1:]]  # shown between two looks
    if kind == "arrived":
        return True
    if text and (not seen or seen[-1] != text):
        seen.append(text)
        faint = page.evaluate(FAINT)
        assert faint == [], f"below 7 to 1: {faint}"
        _look(page, name, len(seen))
    if kind == "slider":
        slider = page.query_selector("input[type=range]")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        _look(page, name + "-moved", len(seen))
        page.keyboard.press("Enter")
        if slider is not None:
            slider.wait_for_element_state("hidden")  # once answered, lest it is moved again
    elif kind == "typed":
        page.fill("#typed", "9")  # off the scale: refused
        page.keyboard.press("Enter")
        _look(page, name + "-wrong", len(seen))
        page.fill("#typed", "1,5")
        page.keyboard.press("Enter")
        page.wait_for_selector("#typed", state="detached")
    elif kind == "step":
        page.keyboard.press("ArrowRight")  # chooses one, so that a digit that is none leaves it
        page.keyboard.press("3")
        page.keyboard.press("Enter")
    elif kind == "held":
        for key in ("f", "ArrowLeft"):
            page.keyboard.down(key)
            page.wait_for_timeout(200)
            page.keyboard.up(key)
    elif kind == "arrows":
        page.keyboard.press("ArrowLeft")
    elif kind == "card":
        page.keyboard.press("ArrowRight")
        page.focus("#end_resize_phase")
        page.keyboard.press("Enter")
    elif kind == "button":
        # Of two, the one that goes on: the viewing distance is right, not to be measured again.
        goes_on = page.query_selector("#proceed:visible") or page.query_selector("#stage button:visible:enabled")
        if goes_on is not None:
            goes_on.focus()
            page.keyboard.press("Enter")
    elif text:  # on an empty screen the key might answer the next one, unseen
        page.keyboard.press(" ")
        page.wait_for_timeout(200)
    return False


COVERED = """() => {
    const stop = document.getElementById("stop"), covered = [];
    if (!stop?.checkVisibility()) return covered;
    const button = stop.getBoundingClientRect(), range = document.createRange();
    const texts = document.createTreeWalker(document.getElementById("stage"), NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
        range.selectNodeContents(texts.currentNode);
        const hits = [...range.getClientRects()].some(({ right, top, bottom }) =>
            right > button.left && top < button.bottom && bottom > button.top);
        if (hits && texts.currentNode.data.trim()) covered.push(texts.currentNode.data);
    }
    return covered;
}"""
"""Texts below the button that stops the session."""

TOUCHED = """(until) => document.querySelector(until) ? null : [
    "#virtual-chinrest-circle", "#proceed", "input[type=range].unset", "#stage button:enabled:not(.held)",
].map((selector) => [...document.querySelectorAll(selector)].find((one) => one.checkVisibility())).find(Boolean)"""
"""What a finger touches next; nothing once the selector ``until`` is there, however lately it came."""


def take_part_by_touch(page: Page, name: str = "", until: str = "#complete") -> list[str]:
    """Go through the screens by touch until the end, or until a CSS selector is there; give their texts."""
    seen, end = list[str](), time.monotonic() + 120
    while not page.query_selector(until):
        assert time.monotonic() < end, seen[-2:]
        with suppress(Error):  # the screen has changed meanwhile
            text = _screen(page)
            if text not in seen[-1:]:
                seen.append(text)
                _look(page, name, len(seen))
            assert page.evaluate(COVERED) == []
            if not page.query_selector("#typed"):
                touch_on(page, until)
                continue
            for number in ("9", "1,5"):  # the first is off the scale: refused
                page.fill("#typed", "")
                page.tap("#typed")
                page.keyboard.insert_text(number)
                page.tap("#stage button")
                seen.append(_screen(page))
                _look(page, f"{name}-typed", len(seen))
            page.wait_for_selector("#typed", state="detached")
    seen.append(_screen(page))
    _look(page, name, len(seen))
    return [*seen, *(text for _, text in page.evaluate("focalgradient.page.shown"))]  # also of pages between two looks


def touch_on(page: Page, until: str = "#complete") -> None:
    """Touch what goes on from the page shown, unless a CSS selector is there."""
    found = page.evaluate_handle(TOUCHED, until).as_element()
    if found is None:
        return
    found.evaluate("(one) => one.scrollIntoViewIfNeeded()")
    if (box := found.bounding_box()) is not None:
        page.touchscreen.tap(box["x"] + 0.6 * box["width"], box["y"] + box["height"] / 2)
    with suppress(Error):  # or another touch falls on what comes next
        found.wait_for_element_state(
            "hidden", timeout=1000 if found.evaluate("(one) => one.tagName") == "BUTTON" else 100
        )
