"""Method of adjustment: a stimulus follows a knob (arrow keys, mouse wheel or slider) until Enter confirms it."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from focalgradient.dataset import Press
from focalgradient.errors import InputError
from focalgradient.lab.forms import ENTER, WARN, draw_all, respond
from focalgradient.lab.questions import HOLD, STEP, SWEEP, Given
from focalgradient.scales import Scale

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["adjust"]

COARSE_STEPS = 6
"""Number of steps per press of the up or down arrow key."""

INK, BAND = 0.9, -0.6
"""Greys of texts and of the bands behind them, from -1 to 1: contrast 11:1, where WCAG 2.1 requires 7:1."""

WIDTH, PLACE = 0.6, -0.4
"""Length of the slider, and its height above the screen's centre, as fractions of the screen's height."""


def adjust(
    screen: Screen,
    draw: Callable[[float], object],
    least: float,
    most: float,
    *,
    question: str = "",
    ratios: bool = False,
    start: float | None = None,
    event: str = "adjust",
) -> Given:
    """Let the participant adjust a stimulus; return the value that Enter confirms.

    Left and right arrow keys and the mouse wheel turn the knob by one step, up and down arrow keys by `COARSE_STEPS`
    steps, and a held key turns it continuously; the slider at the bottom can be dragged with the mouse. No number is
    shown. Enter is ignored until the knob has been turned. The question and the slider lie on dark bands, the upper
    and lower eighths of the screen: draw stimuli between them.

    Parameters
    ----------
    screen
        PsychoPy window.
    draw
        Function that draws the stimulus for a value, called once per frame; for example, it sets the ``focus`` of a
        `FocusView` and draws it.
    least, most
        Range of the knob.
    question
        Instruction shown in the upper part of the screen.
    ratios
        Whether equal steps of the knob are equal ratios of the value (both limits must be above 0); otherwise equal
        differences.
    start
        Starting value; None: drawn at random from the middle four fifths of the knob's range.
    event
        Name of the event in the event markers.

    Returns
    -------
    Given
        Value, response time from the first frame in s, and starting value.

    Raises
    ------
    InputError
        If the range is empty, or includes values of 0 or less although `ratios` is true.
    Quit, Again
        If the participant pressed Escape, depending on the answer to the question whether to stop.
    """
    if not (least < most and (least > 0 or not ratios)):
        raise InputError(
            f"the range of the knob is {least:g} to {most:g}, but must increase{' and lie above 0' if ratios else ''}."
        )
    unit, half = screen.size[1], WIDTH * screen.size[1] / 2
    still = [
        *([_band(screen, 0.385, 0.5)] if question else []),  # room for two lines
        _band(screen, -0.5, PLACE + 0.055),
        screen.text(question or " ", height=0.035, y=0.44, color=INK),
        screen.text(screen.words("scale.knob_keys"), height=0.024, y=-0.47, color=INK),
        screen.line((-half, PLACE * unit), (half, PLACE * unit), 3, lineColor=INK),
    ]
    if screen.practice:
        still.append(screen.text(screen.words("web.practice"), height=0.024, y=0.405, bold=True, color=WARN))
    marker = screen.triangle(0.03 * unit, fillColor=INK)
    scale = Scale(question, "", least, most, ratios)
    share = random.uniform(0.1, 0.9) if start is None else scale.share(start)
    begun, turned, dragged = scale.value(share), False, False
    held: dict[str, float] = {}

    def show() -> None:
        draw(scale.value(share))
        draw_all(still)
        marker.pos = ((2 * share - 1) * half, (PLACE + 0.014) * unit)
        marker.draw()

    def turn(taps: float) -> None:
        nonlocal share, turned
        share, turned = min(max(share + taps * STEP, 0.0), 1.0), turned or taps != 0

    def answer(press: Press, seconds: float) -> Given | None:
        if press.key in KEYS and press.down:
            turn(KEYS[press.key])  # apply at once: Enter may arrive within the same frame
            held[press.key] = press.time
        elif press.key in KEYS:
            held.pop(press.key, None)
        elif press.down and press.key in ENTER and turned:
            return Given(round(scale.value(share), 6), seconds, round(begun, 6))
        return None

    def move(before: float) -> None:
        nonlocal share, turned, dragged
        for key, since in held.items():
            if before - since > HOLD:
                turn(KEYS[key] / abs(KEYS[key]) * screen.frame_s / SWEEP / STEP)
        x, y = screen.mouse.getPos()
        dragged = screen.mouse.getPressed()[0] and (
            dragged or (abs(y - PLACE * unit) < 0.06 * unit and abs(x) < half + 0.05 * unit)
        )
        if dragged:
            share, turned = min(max((float(x) / half + 1) / 2, 0.0), 1.0), True

    def wheel() -> None:
        turn(float(screen.mouse.getWheelRel()[1]))

    screen.mouse.getWheelRel()
    return respond(screen, show, event, answer, first=wheel, last=move, pointer=True, lit=True)


KEYS = {"left": -1, "right": 1, "down": -COARSE_STEPS, "up": COARSE_STEPS}
"""Signed number of steps per press, by key."""


def _band(screen: Screen, low: float, high: float) -> Any:
    """Return a dark band across the whole width; limits in fractions of the screen's height from its centre."""
    band, (width, unit) = screen.whole(min(screen.background, BAND)), screen.size
    band.size, band.pos = (width, (high - low) * unit), (0, (low + high) / 2 * unit)
    return band
