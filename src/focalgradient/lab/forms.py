"""Pages of text, and a form for the participant's data."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from focalgradient.dataset import Press
from focalgradient.errors import InputError

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = [
    "DIGITS",
    "ENTER",
    "WARN",
    "Letters",
    "draw_all",
    "edited",
    "form",
    "missing_glyphs",
    "pages",
    "respond",
    "rest",
    "warn_colour",
]

Answer = TypeVar("Answer")

ENTER = ("return", "num_enter")

WARN = (1.0, 0.9, -0.3)  # yellow: legible on black; on grey, warnings have the colour of other texts
COLUMN = 1.05  # width of a page's text, in screen heights
DIGITS = {**{f"num_{digit}": str(digit) for digit in range(10)}, "period": ".", "comma": ".", "num_decimal": "."}
MODIFIERS = frozenset({"lshift", "rshift", "lalt", "ralt"})


def missing_glyphs(text: str) -> str:
    """Return the characters that the font of the screen's texts lacks, which are shown as boxes.

    Only FreeType (Linux) shows boxes; other systems take these characters from another font.
    """
    import pyglet

    face = getattr(pyglet.font.load("", 12), "face", None)
    if face is None:
        return ""
    return "".join(sorted({one for one in text if one.isprintable() and not face.get_character_index(one)}))


def warn_colour(screen: Screen) -> Any:
    """Return the colour of warnings and marks on the screen's background."""
    return WARN if screen.ink > screen.background else screen.ink


def pages(screen: Screen, texts: Sequence[str], event: str, *, keys: Sequence[str] = ("space",), foot: str = "") -> str:
    """Show pages of text in turn, with the first line of each as its title; return the key that ended the last."""
    key = ""
    for text in texts:
        parts = [*_page(screen, text), screen.text(foot or screen.words("common.go_on"), height=0.026, y=-0.42)]
        key = screen.wait(partial(draw_all, parts), keys, event).key
    return key


def _page(screen: Screen, text: str) -> list[Any]:
    """Return the parts of a page: its title, the first line, and its text, centred if all of its lines are short."""
    title, _, body = text.strip().partition("\n")
    side = "left" if max(map(len, body.splitlines()), default=0) > 60 else "center"
    return [
        screen.plate(),
        screen.text(title, height=0.05, y=0.36, bold=True),
        screen.text(body.strip(), height=0.032, wrapWidth=COLUMN * screen.size[1], alignText=side),
    ]


def rest(screen: Screen, text: str, least_s: float) -> None:
    """Show a page for at least `least_s` seconds with a countdown, then wait until the participant continues."""
    parts = _page(screen, text)
    left = screen.text(" ", height=0.026, y=-0.42)

    def draw(since: float) -> None:
        left.text = screen.words("session.rest_wait", seconds=max(1, math.ceil(least_s - since)))
        draw_all([*parts, left])

    if least_s:
        screen.play(draw, least_s, "rest", lit=False)
    pages(screen, [text], "break")


def draw_all(parts: Iterable[Any]) -> None:
    """Draw parts of a screen, the first at the back."""
    for part in parts:
        part.draw()


def respond(
    screen: Screen,
    draw: Callable[[], object],
    event: str,
    answer: Callable[[Press, float], Answer | None],
    *,
    first: Callable[[], object] = lambda: None,
    last: Callable[[float], object] = lambda before: None,
    pointer: bool = False,
    lit: bool = False,
) -> Answer:
    """Draw a question at each frame until a key press answers it.

    Parameters
    ----------
    screen
        PsychoPy window.
    draw
        Draws the question.
    event
        Name of its event marker.
    answer
        Returns the response that a press or release gives, None for any other; it receives the press, and its time in s
        from the onset of the question.
    first, last
        Called at each frame before and after the keys; `last` receives the time of the frame before.
    pointer
        Whether the mouse pointer is shown; only with the question, since the blank after a picture must not show it.
    lit
        Whether the square of --photodiode is white.
    """
    screen.wait_out()
    screen.keys.clear()
    draw()
    asked = before = screen.frame(lit)
    try:
        if pointer:
            screen.window.mouseVisible = True
        screen.on_event(event, asked)
        while True:
            first()
            found = screen.keys.events()
            screen.stop_if_asked(found)
            for press in found:
                if (given := answer(press, press.time - asked)) is not None:
                    return given
            last(before)
            draw()
            before = screen.frame(lit)
    finally:
        if pointer:
            screen.window.mouseVisible = False


class Letters:
    """Reader of typed letters and digits: with Shift or Alt held, keys of digits and signs give none.

    Keys are named by what they show without Shift, so that "!" would count as "1".
    """

    def __init__(self) -> None:
        self._held: set[str] = set()

    def of(self, press: Press) -> str:
        """Return the character or the name of a key pressed; "" for a release, and for what cannot be known.

        >>> letters = Letters()
        >>> [letters.of(Press(0.0, key, True)) for key in ("1", "num_2", "lshift", "1", "a")]
        ['1', '2', 'lshift', '', 'a']
        """
        if press.key in MODIFIERS:
            (self._held.add if press.down else self._held.discard)(press.key)
        if not press.down:
            return ""
        key = DIGITS.get(press.key, press.key)
        return "" if self._held and len(key) == 1 and not key.isalpha() else key


def edited(text: str, key: str, letters: str, longest: int) -> str:
    """Return a typed text after one more key.

    >>> edited("1", "2", "0123456789", 8), edited("12", "backspace", "0123456789", 8)
    ('12', '1')
    """
    if key == "backspace":
        return text[:-1]
    return text + key if len(key) == 1 and key in letters and len(text) < longest else text


def form(
    screen: Screen,
    title: str,
    fields: Mapping[str, tuple[str, str]],
    check: Callable[[dict[str, str]], None],
) -> dict[str, str]:
    """Show a form of short text fields; the message of a failed `check` is shown until the entries are corrected.

    Parameters
    ----------
    screen
        Window in which the form is shown.
    title
        Title of the form.
    fields
        Label and hint of each field, by name.
    check
        Raises `InputError` if an entry is invalid; the message is shown.
    """
    names, typed, at = list(fields), dict.fromkeys(fields, ""), 0
    heads = [screen.plate(), screen.text(title, height=0.05, y=0.4, bold=True)]
    heads.append(screen.text(screen.words("form.foot"), height=0.026, y=-0.45))
    rows = []
    every = min(0.1, 0.68 / len(fields))
    for number, (label, hint) in enumerate(fields.values()):
        y = 0.3 - every * number
        heads.append(screen.text(f"{label}:", x=-0.2, y=y, anchorHoriz="right", alignText="right"))
        heads.append(screen.text(hint, height=0.022, x=-0.18, y=y - 0.034, anchorHoriz="left", alignText="left"))
        rows.append(screen.text("", x=-0.18, y=y, anchorHoriz="left", alignText="left", bold=True))
    wrong = screen.text("", height=0.026, y=-0.4, color=warn_colour(screen))

    def draw() -> None:
        for number, (name, row) in enumerate(zip(names, rows, strict=True)):
            row.text = typed[name] + ("_" if number == at else "") or " "
        draw_all((*heads, *rows, wrong))

    letters = Letters()

    def answer(press: Press, seconds: float) -> dict[str, str] | None:
        nonlocal at
        key = letters.of(press)
        if not press.down:
            return None
        typed[names[at]] = edited(typed[names[at]], key, "abcdefghijklmnopqrstuvwxyz0123456789.-/", 20)
        if press.key in ENTER and at == len(names) - 1:
            try:
                check(typed)
            except InputError as error:
                wrong.text, at = str(error), 0
            else:
                return typed
        elif press.key in (*ENTER, "tab", "down"):
            at = (at + 1) % len(names)
        elif press.key == "up":
            at = (at - 1) % len(names)
        return None

    return respond(screen, draw, "form", answer)
