"""Adjustment: what is shown follows a knob, turned by keys, the mouse wheel or a slider, until it is confirmed."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from focalgradient.errors import InputError
from focalgradient.lab.questions import Given

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["adjust"]

TURN = 1 / 60
"""Share of the range that a tap, or a notch of the wheel, turns the knob by: as a tap moves the slider's marker."""

COARSE = 6
"""Taps that an up or down arrow key counts as."""

SWEEP_S = 2.5
"""Time in which a held key turns the knob from one end to the other (s), as for the slider."""

HOLD_S = 0.3
"""Time after which a key counts as held (s)."""

WIDTH, PLACE = 0.6, -0.4
"""Length of the slider and its height above the middle, as shares of the screen's height."""


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
    """Let the participant set what is shown, and return the value once it is confirmed with the Enter key.

    Left and right arrow keys and the mouse wheel turn the knob a little, up and down by more, a held key goes on; the
    slider at the bottom is dragged with the mouse. No number is shown. Enter counts only after the knob was turned.
    Question and slider lie on dark bands, the upper and lower eighths of the screen: stimuli belong between them.

    Parameters
    ----------
    screen
        The window.
    draw
        Draws the stimulus at a value, once a frame, as a `FocusView` whose ``focus`` it sets; several side by side.
    least, most
        Ends of the knob.
    question
        What is to be set, in the upper part of the screen.
    ratios
        Whether equal turns are equal ratios of the value, both ends above 0; else equal differences.
    start
        Value at the start; None: a random one of the middle four fifths of the knob.
    event
        Name for the markers.

    Returns
    -------
    Given
        Value, seconds from the first frame, and value at the start.

    Raises
    ------
    InputError
        If the range is empty, or has ratios of what is not above 0.
    Quit, Again
        If escape was pressed, by what was answered to the question whether to stop.
    """
    if not (least < most and (least > 0 or not ratios)):
        raise InputError(f"the knob goes from {least:g} to {most:g}, but must rise{', above 0' if ratios else ''}.")
    unit, half = screen.size[1], WIDTH * screen.size[1] / 2
    still = [
        *([_band(screen, 0.385, 0.5)] if question else []),  # room for two lines
        _band(screen, -0.5, PLACE + 0.055),
        screen.text(question or " ", height=0.035, y=0.44),
        screen.text(screen.words("scale.knob_keys"), height=0.024, y=-0.47),
        screen.line((-half, PLACE * unit), (half, PLACE * unit), 3),
    ]
    marker = screen.triangle(0.03 * unit)
    share = random.uniform(0.1, 0.9) if start is None else _share(start, least, most, ratios)
    begun, turned, dragged = _value(share, least, most, ratios), False, False
    held: dict[str, float] = {}

    def show() -> float:
        draw(_value(share, least, most, ratios))
        for part in still:
            part.draw()
        marker.pos = ((2 * share - 1) * half, (PLACE + 0.014) * unit)
        marker.draw()
        return screen.frame(lit=True)

    def turn(taps: float) -> None:
        nonlocal share, turned
        share, turned = min(max(share + taps * TURN, 0.0), 1.0), turned or taps != 0

    screen.wait_out()
    screen.keys.clear()
    screen.mouse.getWheelRel()
    asked = before = show()
    screen.window.mouseVisible = True
    screen.on_event(event, asked)
    try:
        while True:
            turn(_turns(screen.mouse.getWheelRel()))
            found = screen.keys.events()
            screen.stop_if_asked(found)
            for press in found:
                if press.key in KEYS and press.down:
                    turn(KEYS[press.key])  # at once: Enter may come within the same frame
                    held[press.key] = press.time
                elif press.key in KEYS:
                    held.pop(press.key, None)
                elif press.down and press.key in ("return", "num_enter") and turned:
                    return Given(round(_value(share, least, most, ratios), 6), press.time - asked, round(begun, 6))
            for key, since in held.items():
                if before - since > HOLD_S:
                    turn(KEYS[key] / abs(KEYS[key]) * screen.frame_s / SWEEP_S / TURN)
            x, y = screen.mouse.getPos()
            dragged = screen.mouse.getPressed()[0] and (
                dragged or (abs(y - PLACE * unit) < 0.06 * unit and abs(x) < half + 0.05 * unit)
            )
            if dragged:
                share, turned = min(max((float(x) / half + 1) / 2, 0.0), 1.0), True
            before = show()
    finally:
        screen.window.mouseVisible = False


KEYS = {"left": -1, "right": 1, "down": -COARSE, "up": COARSE}
"""Taps of each key."""


def _band(screen: Screen, low: float, high: float) -> Any:
    """A part of the plate, over the whole width, between two heights: shares of the screen's, from its middle."""
    band, (width, unit) = screen.plate(), screen.size
    band.size, band.pos = (width, (high - low) * unit), (0, (low + high) / 2 * unit)
    return band


def _turns(wheel: Any) -> float:
    return float(wheel[1])


def _value(share: float, least: float, most: float, ratios: bool) -> float:
    return least * (most / least) ** share if ratios else least + (most - least) * share


def _share(value: float, least: float, most: float, ratios: bool) -> float:
    return math.log(value / least) / math.log(most / least) if ratios else (value - least) / (most - least)
