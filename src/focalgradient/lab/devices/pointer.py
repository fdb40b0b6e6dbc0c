"""Operation by mouse or touch alone: clicking a button on a page or question acts as pressing its key."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from focalgradient.dataset import Press

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["Pointer"]

HIGH, GAP = 0.07, 0.05
"""Height of a button, and gap between buttons, as fractions of the screen's height: 2 cm on a screen 30 cm high, the
width of a fingertip.
"""

ROW, CORNER = -0.33, 0.455
"""Heights of the row of buttons and of the ESC button above the screen's centre, as fractions of the screen's height.
"""


class Pointer:
    """Buttons drawn frame by frame, and the keys of those that are clicked."""

    def __init__(self, screen: Screen):
        self._screen = screen
        self._made: dict[tuple[str, float, float], tuple[list[Any], tuple[float, float]]] = {}
        self._drawn: dict[str, tuple[float, float, float, float]] = {}
        self._targets: dict[str, tuple[float, float, float, float]] = {}
        self._held = False

    def target(self, key: str, x: float, y: float, width: float, height: float) -> None:
        """Make a click on a rectangle (in px from the screen's centre) act as a key while the next frame is shown."""
        self._drawn[key] = (x, y, width, height)

    def buttons(self, keys: Sequence[tuple[str, str]]) -> None:
        """Draw a row of buttons, each with the label of its key, and an ESC button in the corner."""
        screen = self._screen
        screen.window.mouseVisible = True
        unit, widths = screen.size[1], [HIGH + 0.022 * len(label) for _, label in keys]
        left = -(sum(widths) + GAP * (len(keys) - 1)) / 2
        for (key, label), width in zip(keys, widths, strict=True):
            self._button(key, label, left + width / 2, ROW, width)
            left += width + GAP
        self._button("escape", "ESC", 0.5 * screen.size[0] / unit - 0.08, CORNER, 0.12)

    def _button(self, key: str, label: str, x: float, y: float, width: float) -> None:
        screen, unit = self._screen, self._screen.size[1]
        if (label, x, y) not in self._made:
            sides = (width * unit, HIGH * unit)
            frame = screen.box(1.0)
            frame.size, frame.pos = sides, (x * unit, y * unit)
            self._made[label, x, y] = [frame, screen.text(label, x=x, y=y)], sides
        parts, sides = self._made[label, x, y]
        for part in parts:
            part.draw()
        self.target(key, x * unit, y * unit, *sides)

    def shown(self) -> None:
        """Make the buttons of the frame just shown clickable; called after each frame."""
        self._targets, self._drawn = self._drawn, {}

    def events(self) -> list[Press]:
        """Return key presses and releases for buttons clicked since the last call."""
        held, at = bool(self._screen.mouse.getPressed()[0]), time.monotonic()
        clicked, self._held = held and not self._held, held
        if not clicked:
            return []
        here_x, here_y = self._screen.mouse.getPos()
        hit = [
            key
            for key, (x, y, width, height) in self._targets.items()
            if abs(here_x - x) <= width / 2 and abs(here_y - y) <= height / 2
        ]
        return [Press(at, key, down) for key in hit[:1] for down in (True, False)]

    def close(self) -> None:
        """Do nothing."""
