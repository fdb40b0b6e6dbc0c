"""A mirror stereoscope or two screens: each eye has its half of the window, aligned by nonius lines.

Pages, marks and pictures are drawn for both eyes; a pair (`Screen.pair`) gives each eye its own picture, encoded with
the gamma of its own screen or half. The settings stand in a TOML file, to which the alignment page writes its offset.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import read_text, read_toml, write_whole

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["Eyes", "Pair", "Stereoscope", "Still", "align", "eye_displays", "open_stereoscope", "read_stereoscope"]

NEAR = 0.01
"""Share by which width and distance of the two eyes' screens may differ: that of the degrees of pictures."""

STEPS = {"left": (-1, 0), "right": (1, 0), "down": (0, -1), "up": (0, 1)}
"""Pixels by which a key moves the right eye's picture."""

HOLD_S, RATE = 0.4, 30.0
"""Seconds after which a key counts as held, and pixels a second that it then moves the picture by."""

FARTHEST = 0.25
"""Largest offset, as a share of the width of an eye's part."""

LINE, GAP, LOCK = 0.1, 0.012, 0.14
"""Length of a nonius line, its distance from the middle, and half the side of the frame that both eyes see: shares of
the screen's height. The frame keeps the eyes converged while the lines are compared."""

EYES = ("left", "right")


@dataclass(frozen=True, slots=True)
class Stereoscope:
    """How a stereoscope is set up, as its settings file states it.

    Parameters
    ----------
    layout
        ``"halves"``: left and right half of one screen; ``"screens"``: two screens of one size side by side, the left
        eye's first, in one window over both.
    screens
        Numbers of the two screens.
    mirrored
        Whether each eye looks into one mirror, which turns left to right: the picture is then turned beforehand.
    monitors
        Names in PsychoPy's Monitor Center, of the left eye's and the right eye's, for the gamma of each; none: that of
        ``--monitor`` for both.
    offset_px
        From where the right eye's picture would be to where it is shown, in pixels as the eye sees it, x right and y
        up.
    """

    layout: Literal["halves", "screens"] = "halves"
    screens: tuple[int, int] = (0, 1)
    mirrored: bool = False
    monitors: tuple[str, str] | None = None
    offset_px: tuple[int, int] = (0, 0)

    def part(self, size_px: tuple[int, int], windowed: bool) -> tuple[int, int]:
        """Return the size in pixels of an eye's part, of that of a screen or, where `windowed`, of a window.

        Its width is even, so that both parts have their middles between pixels.
        """
        width, height = size_px
        halved = windowed or self.layout == "halves"
        return (width // 4 * 2 if halved else width // 2 * 2, height)

    def stated(self, displays: tuple[Display, Display]) -> dict[str, Any]:
        """Return what the sidecar states of it, with the gamma of each eye's display."""
        return {**asdict(self), "gamma": {eye: one.gamma for eye, one in zip(EYES, displays, strict=True)}}


def read_stereoscope(path: Path) -> Stereoscope:
    """Read the settings of a stereoscope (TOML).

    Raises
    ------
    InputError
        If the file cannot be read, or a setting is unknown or of another kind.
    """
    content = read_toml(path, "the settings of a stereoscope")
    kinds: dict[str, tuple[str, Callable[[Any], bool]]] = {
        "layout": ('"halves" or "screens"', lambda value: value in ("halves", "screens")),
        "screens": ("two different numbers of screens", lambda value: _two(value, int) and value[0] != value[1]),
        "mirrored": ("true or false", lambda value: isinstance(value, bool)),
        "monitors": ("two names of monitors", lambda value: _two(value, str)),
        "offset_px": ("two whole numbers of pixels", lambda value: _two(value, int)),
    }
    for name, value in content.items():
        if name not in kinds:
            raise InputError(f"{path} has the setting {name!r}, but must have only {', '.join(kinds)}.")
        expected, fits = kinds[name]
        if not fits(value):
            raise InputError(f"{name} is {value!r} in {path}, but must be {expected}.")
    given: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in content.items()
    }
    return Stereoscope(**given)


def _two(value: Any, kind: type) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(type(one) is kind for one in value)


def store_offset(path: Path, offset_px: tuple[int, int]) -> None:
    """Write the offset into a settings file, and leave all else in it as it stands."""
    text = read_text(path, "the settings of a stereoscope")
    line = f"offset_px = [{offset_px[0]}, {offset_px[1]}]"
    changed, found = re.subn(r"(?m)^[ \t]*offset_px[ \t]*=[ \t]*\[[^\]]*\]", line, text, count=1)
    if not found:
        changed = f"{line}\n{text}"
    write_whole(path, changed.encode())


def open_stereoscope(options: argparse.Namespace) -> Stereoscope | None:
    """Read the settings that ``--stereoscope`` names, and fill in the screen and the monitor that they give.

    Raises
    ------
    InputError
        As `read_stereoscope` does, and with options that need a pointer or an eye tracker.
    """
    if options.stereoscope is None:
        return None
    setup = read_stereoscope(options.stereoscope)
    if options.pointer:
        raise InputError("--pointer is given, but no pointer can be seen through a stereoscope: leave it out.")
    if setup.layout == "screens":
        options.screen = setup.screens[0]
    if setup.monitors is not None:
        options.monitor = options.monitor or setup.monitors[0]
    return setup


def eye_displays(
    setup: Stereoscope, screen: ModuleType, display: Display, gamma_of: Callable[[Any], Any]
) -> tuple[Display, Display]:
    """Return the displays of the left and of the right eye: geometry of `display`, each with its monitor's gamma.

    Raises
    ------
    InputError
        If a monitor is not known or has no gamma, or the two differ in width or distance.
    """
    if setup.monitors is None:
        return display, display
    found = [screen.calibration_of(name) for name in setup.monitors]
    for what in ("width", "distance"):
        sides = [getattr(one, what) for one in found]
        if None not in sides and abs(sides[0] / sides[1] - 1) > NEAR:
            raise InputError(
                f"the monitors {' and '.join(setup.monitors)} differ in {what} ({sides[0]:g} and {sides[1]:g} m): both "
                "eyes must see the same degrees; calibrate them anew."
            )
    for name, one in zip(setup.monitors, found, strict=True):
        if gamma_of(one) is None:
            raise InputError(
                f"the gamma of the monitor {name!r} has not been measured: measure it, or leave out monitors."
            )
    left, right = (replace(display, gamma=gamma_of(one)) for one in found)
    return left, right


class Still:
    """A mouse that nobody uses: through a stereoscope no pointer can be seen."""

    def getPressed(self, getTime: bool = False) -> Any:
        """Return that no button is down."""
        return ([0, 0, 0], [0.0, 0.0, 0.0]) if getTime else [0, 0, 0]

    def getPos(self) -> tuple[float, float]:
        """Return a place far from everything."""
        return (-1e6, -1e6)

    def setPos(self, place: Any) -> None:
        """Do nothing."""

    def clickReset(self) -> None:
        """Do nothing."""

    def getWheelRel(self) -> tuple[float, float]:
        """Return that the wheel stands."""
        return (0.0, 0.0)


class Eyes:
    """The two parts of a window, each with its display.

    The viewport is set at each draw: PsychoPy resets it to the whole window at each flip.

    Parameters
    ----------
    window
        Of PsychoPy.
    setup
        How the stereoscope is set up.
    displays
        Of the left and of the right eye.
    """

    def __init__(self, window: Any, setup: Stereoscope, displays: tuple[Display, Display]):
        self._window, self.setup, self.displays = window, setup, displays
        width, height = (int(side) for side in window.size)
        self._whole = (width, height)
        self.size = setup.part((width, height), windowed=True)
        """Of an eye's part, in pixels."""
        self.offset_px = setup.offset_px

    @contextmanager
    def part(self, eye: int) -> Iterator[None]:
        """Draw in an eye's part, the left eye's being 0: its middle is where the window's is, all else is cut off."""
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
        """Draw the same for both eyes."""
        for eye in range(2):
            with self.part(eye):
                draw()

    def refocused(self, view: Any) -> Any:
        """Let a focus series be drawn for both eyes, each with the gamma of its display; return it."""
        draw = view.draw

        def drawn() -> None:
            for eye, display in enumerate(self.displays):
                view.display = display
                with self.part(eye):
                    draw()

        view.draw, view.mirrored = drawn, self.setup.mirrored
        return view


class Pair:
    """A picture for each eye."""

    def __init__(self, eyes: Eyes, left: Any, right: Any):
        self._eyes, self.left, self.right = eyes, left, right

    def draw(self) -> None:
        """Draw both."""
        for eye, picture in enumerate((self.left, self.right)):
            with self._eyes.part(eye):
                picture.draw()


def align(screen: Screen, path: Path | None) -> tuple[int, int]:
    """Let nonius lines be brought into line by the arrow keys: the offset, which is written into the settings file.

    Both eyes see a frame; the upper and the left line are the left eye's, the lower and the right line the right
    eye's.
    """
    eyes = screen.eyes
    assert eyes is not None
    unit, farthest = screen.size[1], round(FARTHEST * eyes.size[0])
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

    def show() -> float:
        for part in both:
            part.draw()
        for eye, own in enumerate(lines):
            with eyes.part(eye):
                for line in own:
                    line.draw()
        return screen.frame()

    def move(key: str, pixels: float) -> None:
        for axis, step in enumerate(STEPS[key]):
            place[axis] = min(max(place[axis] + step * pixels, -farthest), farthest)
        eyes.offset_px = (round(place[0]), round(place[1]))

    screen.keys.clear()
    before = show()
    screen.on_event("align", before)
    while True:
        found = screen.keys.events()
        screen.stop_if_asked(found)
        for press in found:
            if press.key in STEPS and press.down:
                move(press.key, 1)
                held[press.key] = press.time
            elif press.key in STEPS:
                held.pop(press.key, None)
            elif press.down and press.key in ("return", "num_enter"):
                eyes.setup = replace(eyes.setup, offset_px=eyes.offset_px)
                if path is not None:
                    store_offset(path, eyes.offset_px)
                return eyes.offset_px
        for key, since in held.items():
            if before - since > HOLD_S:
                move(key, RATE * screen.frame_s)
        before = show()
