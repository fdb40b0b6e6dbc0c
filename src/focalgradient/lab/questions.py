"""Questions on the screen: slider, typed number, rating steps, and choice between two pictures."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from focalgradient.dataset import Press
from focalgradient.lab.forms import ENTER, Letters, draw_all, edited, respond, warn_colour
from focalgradient.scales import Control, OwnControl, Scale, Steps, Ways

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["Given", "ask", "ask_which", "explain"]

SWEEP = 2.5  # time in s in which a held key moves the marker across the slider
STEP = 1 / 60  # step of one key press, as a fraction of the slider
HOLD = 0.3  # time in s after which a pressed key counts as held
SIGNS = {"left": -1, "right": 1}  # direction in which each key moves the marker
STEP_KEY = "step "  # followed by its index: name of the key that a click on a step stands for
WIDTH, LOW = 0.9, -0.05  # length of the slider, and its height above the centre, as fractions of the screen's height


@dataclass(frozen=True, slots=True)
class Given:
    """A participant's response.

    Parameters
    ----------
    value
        Value on the scale.
    seconds
        Response time from the onset of the question, in s.
    start
        Random initial position of the marker; None if it was not placed by a key.
    """

    value: float
    seconds: float
    start: float | None = None


def ask(screen: Screen, scale: Control | OwnControl, event: str = "question") -> Given:
    """Ask for a response on a control.

    A control of a user's own has a method `ask(screen, event)`, which may call `respond`.

    Responses are given on a slider (arrow keys or mouse), as a typed number, or as a rating step, and confirmed with
    the Enter key; a choice between two alternatives is the first press of an arrow key.

    The scale shows no marker until the first key press, which places it at random, so that no response is suggested and
    participants who press one key only can be detected.
    """
    if isinstance(scale, Ways):
        return ask_which(screen, scale.question, scale.ways, event)
    if isinstance(scale, Steps):
        return _steps(screen, scale, event)
    if isinstance(scale, Scale):
        return (_typed if scale.typed else _slider)(screen, scale, event)
    given: Given = scale.ask(screen, event)
    return given


def explain(screen: Screen, scale: Scale | Steps, text: str, at: float) -> None:
    """Show a page that explains a scale: title (the first line), text, and the scale with its marker at a value."""
    title, _, body = text.partition("\n")
    unit, half = screen.size[1], _half(screen)
    still = [
        screen.plate(),
        screen.text(title, height=0.05, y=0.4, bold=True),
        screen.text(body.strip(), height=0.032, y=0.22, alignText="left"),
        screen.text(screen.words("common.go_on"), height=0.026, y=-0.42),
    ]
    if isinstance(scale, Steps):
        boxes, places = _boxes(screen, scale)
        frame = screen.box(min(0.075 * unit, places[1] - places[0]))
        nearest = min(range(len(places)), key=lambda number: abs(scale.values[number] - at))
        frame.pos = (places[nearest], LOW * unit)
        screen.wait(lambda: draw_all([*still, *boxes, frame]), ["space"], "example")
        return
    still += _line(screen, scale, half)
    marker = _marker(screen, scale, half)

    def draw() -> None:
        draw_all(still)
        marker(scale.share(at))

    screen.wait(draw, ["space"], "example")


def ask_which(screen: Screen, question: str, ways: tuple[str, str], event: str = "question") -> Given:
    """Ask for a choice between two: the first press counts; the value is 1 for the left key and 2 for the right."""
    still = _head(screen, question, "", " ")
    still.append(screen.text(f"←   {ways[0]}", height=0.04, x=-0.25, y=LOW))
    still.append(screen.text(f"{ways[1]}   →", height=0.04, x=0.25, y=LOW))
    screen.warm(*still)

    def draw() -> None:
        draw_all(still)
        screen.offer(left=ways[0], right=ways[1])

    def answer(press: Press, seconds: float) -> Given | None:
        chosen = {"left": 1.0, "right": 2.0}.get(press.key)
        return Given(chosen, seconds) if press.down and chosen is not None else None

    return respond(screen, draw, event, answer)


def _head(screen: Screen, question: str, below: str, foot: str) -> list[Any]:
    return [
        screen.plate(),
        screen.text(question, height=0.045, y=0.28),
        screen.text(below or " ", y=0.2),
        screen.text(foot, height=0.026, y=-0.42),
        *(
            [screen.text(screen.words("web.practice"), y=0.4, bold=True, color=warn_colour(screen))]
            if screen.practice
            else []
        ),
    ]


def _line(screen: Screen, scale: Scale, half: float) -> list[Any]:
    """Return the slider without its marker."""
    unit = screen.size[1]
    still = [screen.line((-half, LOW * unit), (half, LOW * unit), 3)]
    for tick in scale.ticks():
        x = (2 * scale.share(tick) - 1) * half
        still.append(screen.line((x, (LOW - 0.012) * unit), (x, (LOW + 0.012) * unit)))
        still.append(screen.text(screen.words.number(tick, "g"), x=x / unit, y=LOW - 0.045))
    for side, word in zip((-1, 1), scale.ends, strict=True):
        still.append(screen.text(word or " ", height=0.026, x=side * half / unit, y=LOW - 0.09))
    return still


def _marker(screen: Screen, scale: Scale, half: float) -> Callable[[float], None]:
    """Return a function that draws the marker at a fraction of the slider, with its number."""
    unit = screen.size[1]
    marker, number = screen.triangle(0.035 * unit), screen.text("", height=0.035)

    def draw(place: float) -> None:
        x = (2 * place - 1) * half
        marker.pos = (x, (LOW + 0.014) * unit)
        marker.draw()
        if scale.numbered:
            number.pos, number.text = (x, (LOW + 0.08) * unit), screen.words.number(scale.value(place))
            number.draw()

    return draw


DIGIT = 1.5
"""Height of digits as a multiple of their space: the inverse of their width, 0.58 of the height, with a margin."""


def _half(screen: Screen) -> float:
    return min(WIDTH * screen.size[1], 0.8 * screen.size[0]) / 2


def _slider(screen: Screen, scale: Scale, event: str) -> Given:
    unit, half = screen.size[1], _half(screen)
    still = _head(screen, scale.question, scale.below, screen.words("scale.slider_keys"))
    still += _line(screen, scale, half)
    marker = _marker(screen, scale, half)
    place: float | None = None
    start: float | None = None
    moving: dict[str, float] = {}

    def draw() -> None:
        draw_all(still)
        screen.offer(**({} if place is None else {"return": "OK"}))
        if place is not None:
            marker(place)

    def click() -> None:
        nonlocal place
        held, pressed = screen.mouse.getPressed(getTime=True)
        if held[0] or pressed[0]:
            screen.mouse.clickReset()
            x, y = screen.mouse.getPos()
            if abs(y - LOW * unit) < 0.08 * unit and abs(x) < half + 0.05 * unit:
                place = min(max((x / half + 1) / 2, 0), 1)

    def answer(press: Press, seconds: float) -> Given | None:
        nonlocal place, start
        if press.key in SIGNS and press.down:
            moving[press.key] = press.time
            if place is None:
                place = random.random()
                start = round(scale.value(place), 4)
            else:
                place = min(max(place + SIGNS[press.key] * STEP, 0), 1)
        elif press.key in SIGNS:
            moving.pop(press.key, None)
        if press.down and press.key in ENTER and place is not None:
            return Given(round(scale.value(place), 4), seconds, start)
        return None

    def move(before: float) -> None:
        nonlocal place
        for key, since in moving.items():
            if place is not None and before - since > HOLD:
                place = min(max(place + SIGNS[key] * screen.frame_s / SWEEP, 0), 1)

    screen.warm(*still)
    screen.mouse.clickReset()
    screen.mouse.setPos((0, -0.25 * screen.size[1]))  # away from the scale, so that it suggests no response
    # Clicks come before keys, so that a click and its confirmation are both accepted if they come within one frame.
    return respond(screen, draw, event, answer, first=click, last=move, pointer=True)


def _typed(screen: Screen, scale: Scale, event: str) -> Given:
    still = _head(screen, scale.question, scale.below, screen.words("scale.typed_keys"))
    unit = screen.size[1]
    for y in (-0.04, 0.06):
        still.append(screen.line((-0.15 * unit, y * unit), (0.15 * unit, y * unit)))
    number, wrong = screen.text("", height=0.06, y=0.01), screen.text("", y=-0.12, color=warn_colour(screen))
    typed = ""

    def draw() -> None:
        number.text = typed.replace(".", screen.words("common.decimal")) or " "
        draw_all([*still, number, wrong])

    letters = Letters()

    def answer(press: Press, seconds: float) -> Given | None:
        nonlocal typed
        key = letters.of(press)
        if not press.down:
            return None
        typed = edited(typed, key, "0123456789.", 8)
        if press.key in ENTER:
            try:
                value = float(typed)
            except ValueError:
                value = math.nan
            if scale.least <= value <= scale.most:
                return Given(value, seconds)
            ends = (screen.words.number(end, "g") for end in (scale.least, scale.most))
            wrong.text = screen.words("scale.typed_wrong", **dict(zip(("least", "most"), ends, strict=True)))
        return None

    screen.warm(*still)
    return respond(screen, draw, event, answer)


def _boxes(screen: Screen, scale: Steps) -> tuple[list[Any], list[float]]:
    """Return the numbers of the steps with their labels, and the horizontal position of each in px."""
    unit, half = screen.size[1], _half(screen)
    values = scale.values
    places = [(2 * number / (len(values) - 1) - 1) * half for number in range(len(values))]
    texts = [_signed(screen, scale, value) for value in values]
    height = min(0.04, DIGIT * (places[1] - places[0]) / unit / max(map(len, texts)))
    still = [screen.text(text, height=height, x=x / unit, y=LOW) for text, x in zip(texts, places, strict=True)]
    wide = 2 * half / max(len(scale.labelled()) - 1, 1)
    for value, label in scale.labelled():
        x = places[values.index(value)]
        still.append(screen.text(label, height=0.026, x=x / unit, y=LOW - 0.09, wrapWidth=0.92 * wide))
    return still, places


def _signed(screen: Screen, scale: Steps, value: float) -> str:
    return screen.words.number(value, "+g" if scale.least < 0 and value else "g").replace("-", "\N{MINUS SIGN}")


def _steps(screen: Screen, scale: Steps, event: str) -> Given:
    keys = screen.words("scale.steps_keys" if scale.has_digits else "scale.arrow_keys")
    still = _head(screen, scale.question, scale.below, keys)
    boxes, places = _boxes(screen, scale)
    unit, values = screen.size[1], scale.values
    frame = screen.box(min(0.075 * unit, places[1] - places[0]))
    at: int | None = None
    start: float | None = None

    def draw() -> None:
        draw_all([*still, *boxes])
        screen.offer(**({} if at is None else {"return": "OK"}))
        if screen.pointer is not None:
            for number, x in enumerate(places):
                screen.pointer.target(f"{STEP_KEY}{number}", x, LOW * unit, places[1] - places[0], 0.12 * unit)
        if at is not None:
            frame.pos = (places[at], LOW * unit)
            frame.draw()

    letters = Letters()

    def answer(press: Press, seconds: float) -> Given | None:
        nonlocal at, start
        key = letters.of(press)
        if not press.down:
            return None
        if key in SIGNS and at is None:
            at = random.randrange(len(values))
            start = float(values[at])
        elif key in SIGNS and at is not None:
            at = min(max(at + SIGNS[key], 0), len(values) - 1)
        elif key.startswith(STEP_KEY):
            at = int(key.removeprefix(STEP_KEY))
        elif scale.has_digits and key.isdigit() and int(key) in values:
            at = values.index(int(key))
        elif press.key in ENTER and at is not None:
            return Given(float(values[at]), seconds, start)
        return None

    screen.warm(*still)
    return respond(screen, draw, event, answer)
