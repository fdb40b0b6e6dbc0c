"""Stereoscope with mirrors or two screens: each eye sees its half of the window, aligned by nonius lines.

Pages, marks and pictures are drawn for both eyes; a pair (`Screen.pair`) shows a different picture to each eye, encoded
with the gamma of its screen. Settings are read from a TOML file, to which the alignment page writes the offset.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from focalgradient.dataset import Press
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import read_text, read_toml, write_whole
from focalgradient.lab.forms import ENTER, draw_all, respond
from focalgradient.lab.options import SessionOptions
from focalgradient.tables import Table, load_table

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["Eyes", "Pair", "Stereoscope", "Still", "align", "eye_displays", "open_stereoscope", "read_stereoscope"]

NEAR = 0.01
"""Tolerance between width and viewing distance of the two eyes' screens, as a fraction; that of the pictures' angle."""

STEPS = {"left": (-1, 0), "right": (1, 0), "down": (0, -1), "up": (0, 1)}
"""Direction in which a key moves the right eye's picture, in pixels per press."""

HOLD_S, RATE = 0.4, 30.0
"""Time in s after which a pressed key counts as held, and speed in px/s at which it then moves the picture."""

LARGEST_OFFSET = 0.25
"""Maximum offset, as a fraction of the width of an eye's part of the window."""

LINE, GAP, LOCK = 0.1, 0.012, 0.14
"""Length of a nonius line, its distance from the centre, and half the side of the fusion-lock frame, as fractions of
the screen's height. Both eyes see the frame, which keeps vergence constant while the lines are compared.
"""

EYES = ("left", "right")


class Stereoscope(Table):
    """Settings of a stereoscope.

    Parameters
    ----------
    layout
        ``"halves"``: left and right half of one screen; ``"screens"``: two screens of equal size side by side, the left
        eye's on the left, in one window across both.
    screens
        Numbers of the two screens.
    mirrored
        Whether each eye looks into a single mirror, which reverses left and right: pictures are then reversed in
        advance.
    monitors
        Names of the left and right eye's monitors in PsychoPy's Monitor Center, for the gamma of each; None: that of
        ``--monitor`` for both.
    offset_px
        Displacement of the right eye's picture in pixels, as that eye sees it, x right and y up.
    """

    layout: Annotated[Literal["halves", "screens"], Field(description='"halves" or "screens"')] = "halves"
    screens: Annotated[tuple[int, int], Field(description="two different numbers of screens")] = (0, 1)
    mirrored: bool = False
    monitors: Annotated[tuple[str, str] | None, Field(description="two names of monitors")] = None
    offset_px: Annotated[tuple[int, int], Field(description="two whole numbers of pixels")] = (0, 0)

    @model_validator(mode="after")
    def _check(self) -> Stereoscope:
        if self.screens[0] == self.screens[1]:
            raise ValueError(f"screens names {self.screens[0]} twice, but must name two different ones.")
        return self

    def part(self, size_px: tuple[int, int], windowed: bool) -> tuple[int, int]:
        """Return the size in pixels of an eye's part of a screen or, if `windowed`, of a window.

        Its width is even, so that both parts have their centres between pixels.
        """
        width, height = size_px
        halved = windowed or self.layout == "halves"
        return (width // 4 * 2 if halved else width // 2 * 2, height)

    def stated(self, displays: tuple[Display, Display]) -> dict[str, Any]:
        """Return the sidecar's entry for the stereoscope, with the gamma of each eye's display."""
        return {**self.model_dump(), "gamma": {eye: one.gamma for eye, one in zip(EYES, displays, strict=True)}}


def read_stereoscope(path: Path) -> Stereoscope:
    """Read the settings of a stereoscope (TOML).

    Raises
    ------
    InputError
        If the file cannot be read, or a setting is unknown or of the wrong type.
    """
    return load_table(path, read_toml(path, "the settings of a stereoscope"), Stereoscope)


def store_offset(path: Path, offset_px: tuple[int, int]) -> None:
    """Write the offset to a settings file, leaving everything else in it unchanged."""
    text = read_text(path, "the settings of a stereoscope")
    line = f"offset_px = [{offset_px[0]}, {offset_px[1]}]"
    changed, found = re.subn(r"(?m)^[ \t]*offset_px[ \t]*=[ \t]*\[[^\]]*\]", line, text, count=1)
    if not found:
        changed = f"{line}\n{text}"
    write_whole(path, changed.encode())


def open_stereoscope(options: SessionOptions) -> Stereoscope | None:
    """Read the file given with ``--stereoscope``, and set the screen and monitor options that it determines.

    Raises
    ------
    InputError
        As for `read_stereoscope`; and if options that need a pointer are given.
    """
    if options.stereoscope is None:
        return None
    setup = read_stereoscope(options.stereoscope)
    if options.pointer:
        raise InputError("--pointer is given, but a pointer cannot be shown through a stereoscope: leave it out.")
    if setup.layout == "screens":
        options.screen = setup.screens[0]
    if setup.monitors is not None:
        options.monitor = options.monitor or setup.monitors[0]
    return setup


def eye_displays(
    setup: Stereoscope, screen: ModuleType, display: Display, gamma_of: Callable[[Any], Any]
) -> tuple[Display, Display]:
    """Return the displays of the left and right eye: the geometry of `display` with each monitor's gamma.

    Raises
    ------
    InputError
        If a monitor is unknown or has no gamma, or the two differ in width or viewing distance.
    """
    if setup.monitors is None:
        return display, display
    found = [screen.calibration_of(name) for name in setup.monitors]
    for what in ("width", "distance"):
        sides = [getattr(one, what) for one in found]
        if None not in sides and abs(sides[0] / sides[1] - 1) > NEAR:
            raise InputError(
                f"the monitors {' and '.join(setup.monitors)} differ in {what} ({sides[0]:g} and {sides[1]:g} m): both "
                "eyes must see the same visual angle: calibrate them again."
            )
    for name, one in zip(setup.monitors, found, strict=True):
        if gamma_of(one) is None:
            raise InputError(
                f"the gamma of the monitor {name!r} has not been measured: measure it, or leave out monitors."
            )
    left, right = (replace(display, gamma=gamma_of(one)) for one in found)
    return left, right


class Still:
    """Stand-in for the mouse, which cannot be used through a stereoscope."""

    def getPressed(self, getTime: bool = False) -> Any:
        """Return that no button is pressed."""
        return ([0, 0, 0], [0.0, 0.0, 0.0]) if getTime else [0, 0, 0]

    def getPos(self) -> tuple[float, float]:
        """Return a position far off the screen."""
        return (-1e6, -1e6)

    def setPos(self, place: Any) -> None:
        """Do nothing."""

    def clickReset(self) -> None:
        """Do nothing."""

    def getWheelRel(self) -> tuple[float, float]:
        """Return that the wheel was not turned."""
        return (0.0, 0.0)


class Eyes:
    """The two eyes' parts of a window, each with its display.

    The viewport is set at each draw, because PsychoPy resets it to the whole window at each flip.

    Parameters
    ----------
    window
        PsychoPy window.
    setup
        Settings of the stereoscope.
    displays
        Displays of the left and right eye.
    """

    def __init__(self, window: Any, setup: Stereoscope, displays: tuple[Display, Display]):
        self._window, self.setup, self.displays = window, setup, displays
        width, height = (int(side) for side in window.size)
        self._whole = (width, height)
        self.size = setup.part((width, height), windowed=True)
        """Size of an eye's part in pixels."""
        self.offset_px = setup.offset_px

    @contextmanager
    def part(self, eye: int) -> Iterator[None]:
        """Draw in one eye's part of the window (0: left, 1: right), centred on it and clipped to it."""
        window, (width, height) = self._window, self._whole
        x, y = self.offset_px if eye else (0, 0)
        side = -1 if self.setup.mirrored else 1
        window.viewport = ((2 * eye - 1) * (width // 4) + side * x, y, width, height)
        window.scissor = (eye * (width // 2), 0, width // 2, height)
        try:
            yield
        finally:
            window.viewport = window.scissor = (0, 0, width, height)

    def each(self, draw: Callable[[], object]) -> None:
        """Draw the same stimulus for both eyes."""
        for eye in range(2):
            with self.part(eye):
                draw()

    def refocused(self, view: Any) -> Any:
        """Make a focus series be drawn for both eyes, each with its display's gamma; return it."""
        draw = view.draw

        def drawn() -> None:
            for eye, display in enumerate(self.displays):
                view.display = display
                with self.part(eye):
                    draw()

        view.draw, view.mirrored = drawn, self.setup.mirrored
        return view


class Pair:
    """Dichoptic stimulus: a picture for each eye."""

    def __init__(self, eyes: Eyes, left: Any, right: Any):
        self._eyes, self.left, self.right = eyes, left, right

    def draw(self) -> None:
        """Draw both pictures."""
        for eye, picture in enumerate((self.left, self.right)):
            with self._eyes.part(eye):
                picture.draw()


def align(screen: Screen, path: Path | None) -> tuple[int, int]:
    """Let the participant align nonius lines with the arrow keys; return the offset, and write it to the settings file.

    Both eyes see a frame; the left eye sees the upper and the left line, the right eye the lower and the right line.
    """
    eyes = screen.eyes
    assert eyes is not None
    unit, farthest = screen.size[1], round(LARGEST_OFFSET * eyes.size[0])
    near, far, lock = GAP * unit, (GAP + LINE) * unit, LOCK * unit
    title, _, body = screen.words("stereoscope.align").partition("\n")
    corners = [(-lock, -lock), (lock, -lock), (lock, lock), (-lock, lock)]
    both = [
        screen.plate(),
        screen.text(title, height=0.045, y=0.4, bold=True),
        screen.text(body, height=0.03, y=0.28),
        screen.text(screen.words("stereoscope.align_keys"), height=0.026, y=-0.4),
        *(screen.line(start, end) for start, end in zip(corners, corners[1:] + corners[:1], strict=True)),
    ]
    lines = [
        [screen.line((0, near), (0, far), for_both=False), screen.line((-far, 0), (-near, 0), for_both=False)],
        [screen.line((0, -far), (0, -near), for_both=False), screen.line((near, 0), (far, 0), for_both=False)],
    ]
    held: dict[str, float] = {}
    place = [float(one) for one in eyes.offset_px]

    def draw() -> None:
        draw_all(both)
        for eye, own in enumerate(lines):
            with eyes.part(eye):
                draw_all(own)

    def move(key: str, pixels: float) -> None:
        for axis, step in enumerate(STEPS[key]):
            place[axis] = min(max(place[axis] + step * pixels, -farthest), farthest)
        eyes.offset_px = (round(place[0]), round(place[1]))

    def answer(press: Press, seconds: float) -> tuple[int, int] | None:
        if press.key in STEPS and press.down:
            move(press.key, 1)
            held[press.key] = press.time
        elif press.key in STEPS:
            held.pop(press.key, None)
        return eyes.offset_px if press.down and press.key in ENTER else None

    def move_held(before: float) -> None:
        for key, since in held.items():
            if before - since > HOLD_S:
                move(key, RATE * screen.frame_s)

    found = respond(screen, draw, "align", answer, last=move_held)
    eyes.setup = eyes.setup.model_copy(update={"offset_px": found})
    if path is not None:
        store_offset(path, found)
    return found
