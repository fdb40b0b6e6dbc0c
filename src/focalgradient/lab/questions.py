"""What is asked on the screen: pages to read, the slider, a number to type, a form for who takes part."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from focalgradient.errors import InputError

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["Given", "Scale", "ask", "form", "pages"]

SWEEP = 2.5  # seconds that a held key takes from one end of the slider to the other
STEP = 1 / 60  # of the slider that a tap moves
HOLD = 0.3  # seconds after which a key counts as held
WARN = (1.0, 0.9, -0.3)  # yellow: to be read on grey and on black
COLUMN = 1.05  # width of a page's text, in screen's heights
WIDTH, LOW = 0.9, -0.05  # of the slider, and its height above the middle: shares of the screen's height
DIGITS = {**{f"num_{digit}": str(digit) for digit in range(10)}, "period": ".", "comma": ".", "num_decimal": "."}


@dataclass(frozen=True, slots=True)
class Scale:
    """What an answer is given on.

    Parameters
    ----------
    question, below
        What is asked, and what it is to be compared with.
    least, most
        Its ends.
    ratios
        Whether equal ratios are equally far apart; else equal differences are.
    ends
        What the ends mean, in a word or two.
    typed
        Whether the answer is typed, not set on a slider.
    """

    question: str
    below: str
    least: float
    most: float
    ratios: bool = True
    ends: tuple[str, str] = ("", "")
    typed: bool = False

    def value(self, share: float) -> float:
        """What lies at that share of the way from `least` to `most`."""
        if self.ratios:
            return self.least * (self.most / self.least) ** share
        return self.least + (self.most - self.least) * share

    def share(self, value: float) -> float:
        """Where a value lies, from 0 to 1."""
        if self.ratios:
            return math.log(value / self.least) / math.log(self.most / self.least)
        return (value - self.least) / (self.most - self.least)

    def ticks(self) -> list[float]:
        """Values that are marked: doublings from 1 within the range, or five evenly spaced."""
        if not self.ratios:
            return [self.value(number / 4) for number in range(5)]
        first, last = math.ceil(math.log2(self.least) - 1e-9), math.floor(math.log2(self.most) + 1e-9)
        every = max(1, math.ceil((last - first) / 8))
        return [2.0**power for power in range(first, last + 1) if power % every == 0]


@dataclass(frozen=True, slots=True)
class Given:
    """An answer: its `value`, and the seconds from the question to it."""

    value: float
    seconds: float


def pages(screen: Screen, texts: Sequence[str], event: str, *, keys: Sequence[str] = ("space",), foot: str = "") -> str:
    """Show pages of text one after the other, the first line of each as its title: the key that ended the last."""
    key = ""
    for text in texts:
        title, _, body = text.strip().partition("\n")
        parts = [
            screen.text(title, height=0.05, y=0.36, bold=True),
            screen.text(body.strip(), height=0.032, wrapWidth=COLUMN * screen.size[1], alignText=_side(body)),
            screen.text(foot or "Press SPACE to go on.", height=0.026, y=-0.42),
        ]
        key = screen.wait(partial(_draw, parts), keys, event).key
    return key


def _draw(parts: Sequence[Any]) -> None:
    for part in parts:
        part.draw()


def _side(body: str) -> str:
    """Short lines stand in the middle; what is wrapped begins at the left."""
    return "left" if max(map(len, body.splitlines()), default=0) > 60 else "center"


def ask(screen: Screen, scale: Scale, event: str = "question") -> Given:
    """Ask for a number: on a slider (arrow keys or mouse) or typed, confirmed with the Enter key."""
    if scale.typed:
        return _typed(screen, scale, event)
    screen.mouse.setPos((0, -0.25 * screen.size[1]))  # away from the scale: it is to suggest nothing
    screen.window.mouseVisible = True
    try:
        return _slider(screen, scale, event)
    finally:
        screen.window.mouseVisible = False


def _head(screen: Screen, scale: Scale, foot: str) -> list[Any]:
    return [
        screen.text(scale.question, height=0.045, y=0.28),
        screen.text(scale.below, y=0.2),
        screen.text(foot, height=0.026, y=-0.42),
    ]


def _slider(screen: Screen, scale: Scale, event: str) -> Given:
    unit = screen.size[1]
    half = min(WIDTH * unit, 0.8 * screen.size[0]) / 2
    still = _head(screen, scale, "←  →  or the mouse: move the marker            ENTER: confirm")
    still.append(screen.line((-half, LOW * unit), (half, LOW * unit), 3))
    for tick in scale.ticks():
        x = (2 * scale.share(tick) - 1) * half
        still.append(screen.line((x, (LOW - 0.012) * unit), (x, (LOW + 0.012) * unit)))
        still.append(screen.text(f"{tick:g}", x=x / unit, y=LOW - 0.045))
    for side, word in zip((-1, 1), scale.ends, strict=True):
        still.append(screen.text(word, height=0.026, x=side * half / unit, y=LOW - 0.09))
    marker = screen.triangle(0.035 * unit)
    number = screen.text("", height=0.035)
    place: float | None = None
    moving: dict[str, float] = {}

    def draw() -> None:
        for part in still:
            part.draw()
        if place is not None:
            x = (2 * place - 1) * half
            marker.pos = (x, (LOW + 0.014) * unit)
            marker.draw()
            number.pos, number.text = (x, (LOW + 0.08) * unit), f"{scale.value(place):.2f}"
            number.draw()

    screen.keys.clear()
    screen.mouse.clickReset()
    draw()
    asked = before = screen.frame()
    screen.on_event(event, asked)
    while True:
        # Before the keys: who clicks and then confirms is to be understood, even if both come within one frame.
        held, pressed = screen.mouse.getPressed(getTime=True)
        if held[0] or pressed[0]:
            screen.mouse.clickReset()
            x, y = screen.mouse.getPos()
            if abs(y - LOW * unit) < 0.08 * unit and abs(x) < half + 0.05 * unit:
                place = min(max((x / half + 1) / 2, 0), 1)
        found = screen.keys.events()
        screen.stop_if_asked(found)
        for press in found:
            if press.key in ("left", "right"):
                if press.down:
                    moving[press.key] = press.time
                    # Nothing is shown before the first move, from the middle: no answer is suggested.
                    start = 0.5 if place is None else place
                    place = min(max(start + (STEP if press.key == "right" else -STEP), 0), 1)
                else:
                    moving.pop(press.key, None)
            if press.down and press.key in ("return", "num_enter") and place is not None:
                return Given(round(scale.value(place), 4), press.time - asked)
        for key, since in moving.items():
            if place is not None and before - since > HOLD:
                place = min(max(place + screen.frame_s / SWEEP * (1 if key == "right" else -1), 0), 1)
        draw()
        before = screen.frame()


def _typed(screen: Screen, scale: Scale, event: str) -> Given:
    still = _head(screen, scale, "Type a number            BACKSPACE: take back            ENTER: confirm")
    unit = screen.size[1]
    for y in (-0.04, 0.06):
        still.append(screen.line((-0.15 * unit, y * unit), (0.15 * unit, y * unit)))
    number, wrong = screen.text("", height=0.06, y=0.01), screen.text("", y=-0.12, color=WARN)
    typed = ""

    def draw() -> None:
        number.text = typed or " "
        for part in (*still, number, wrong):
            part.draw()

    screen.keys.clear()
    draw()
    asked = screen.frame()
    screen.on_event(event, asked)
    while True:
        found = screen.keys.events()
        screen.stop_if_asked(found)
        for press in found:
            if not press.down:
                continue
            typed = _edited(typed, DIGITS.get(press.key, press.key), "0123456789.", 8)
            if press.key in ("return", "num_enter"):
                try:
                    value = float(typed)
                except ValueError:
                    value = math.nan
                if scale.least <= value <= scale.most:
                    return Given(value, press.time - asked)
                wrong.text = f"Please type a number from {scale.least:g} to {scale.most:g}."
        draw()
        screen.frame()


def _edited(text: str, key: str, letters: str, longest: int) -> str:
    if key == "backspace":
        return text[:-1]
    return text + key if len(key) == 1 and key in letters and len(text) < longest else text


def form(
    screen: Screen,
    title: str,
    fields: Mapping[str, str],
    check: Callable[[dict[str, str]], None],
) -> dict[str, str]:
    """Ask for words of letters and digits; what `check` says against them is shown, and they can be mended.

    Parameters
    ----------
    screen
        Where.
    title
        Of the form.
    fields
        By name, what to say of each.
    check
        Raises InputError if what was typed cannot be.
    """
    names, typed, at = list(fields), dict.fromkeys(fields, ""), 0
    heads = [screen.text(title, height=0.05, y=0.36, bold=True)]
    heads.append(screen.text("TAB: next            ENTER: next, and at the last: done", height=0.026, y=-0.42))
    rows = []
    for number, (name, hint) in enumerate(fields.items()):
        y = 0.22 - 0.1 * number
        heads.append(screen.text(f"{name}:", x=-0.3, y=y, anchorHoriz="right", alignText="right"))
        heads.append(screen.text(hint, height=0.022, x=-0.28, y=y - 0.04, anchorHoriz="left", alignText="left"))
        rows.append(screen.text("", x=-0.28, y=y, anchorHoriz="left", alignText="left", bold=True))
    wrong = screen.text("", height=0.026, y=-0.34, color=WARN)

    def draw() -> None:
        for number, (name, row) in enumerate(zip(names, rows, strict=True)):
            row.text = typed[name] + ("_" if number == at else "") or " "
        for part in (*heads, *rows, wrong):
            part.draw()

    screen.keys.clear()
    draw()
    screen.on_event("form", screen.frame())
    while True:
        draw()
        screen.frame()
        found = screen.keys.events()
        screen.stop_if_asked(found)
        for press in found:
            if not press.down:
                continue
            key = DIGITS.get(press.key, press.key)
            typed[names[at]] = _edited(typed[names[at]], key, "abcdefghijklmnopqrstuvwxyz0123456789", 20)
            if press.key in ("return", "num_enter") and at == len(names) - 1:
                try:
                    check(typed)
                except InputError as error:
                    wrong.text, at = str(error), 0
                else:
                    return typed
            elif press.key in ("return", "num_enter", "tab", "down"):
                at = (at + 1) % len(names)
            elif press.key == "up":
                at = (at - 1) % len(names)
