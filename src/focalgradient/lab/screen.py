"""The screen and the keyboard as the experiments use them: frames by a clock, exact pictures, keys with times.

All times are seconds of a clock that nobody can set: Python's monotonic clock (CLOCK_MONOTONIC on Linux). PsychoPy's
and PsychToolbox's follow the wall clock on Linux; their times of keys are carried over to the monotonic one when the
keys are read. The caller subtracts where its sitting began. Lengths are in pixels from the middle of the screen, x
right and y up, as PsychoPy has them. The graphics card's gamma table is left alone: what is shown is encoded for the
display before it comes here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import pairwise
from statistics import median, quantiles
from typing import Any

import numpy as np
from numpy.typing import NDArray
from psychopy import logging

logging.console.setLevel(logging.CRITICAL)  # its remarks would stand among ours on standard output

from psychopy import event, monitors, visual  # noqa: E402  after the log is silenced
from psychopy.hardware.keyboard import Keyboard, keyNames  # noqa: E402

from focalgradient.dataset import Press  # noqa: E402
from focalgradient.design.words import Words, load_words  # noqa: E402
from focalgradient.display import Display  # noqa: E402
from focalgradient.errors import InputError  # noqa: E402
from focalgradient.lab.boxes import Box  # noqa: E402
from focalgradient.lab.experiment import Again, Quit  # noqa: E402
from focalgradient.lab.focus_view import FocusView  # noqa: E402
from focalgradient.lab.monitor import Calibration, calibration_of, store_luminance  # noqa: E402
from focalgradient.lab.picture import ShownPicture  # noqa: E402
from focalgradient.lab.pointer import Pointer  # noqa: E402
from focalgradient.lab.stereoscope import Eyes, Pair, Stereoscope, Still  # noqa: E402
from focalgradient.live import FocusSeries  # noqa: E402

__all__ = ["Calibration", "Keys", "Screen", "calibration_of", "key_names", "screen_size", "store_luminance", "versions"]

INK = 0.9
PLATE = -0.6  # grey that text stands on where the background is lighter: contrast 11 to 1 (WCAG 2.1), 7 is asked for
PATCH = 0.045  # of the screen's height: the square that a photodiode looks at
PACE = 60.0  # frames a second where the display does not report when it has shown one

Draw = Callable[[float], object]
"""Draws one frame, given the seconds since the first."""


def screen_size(number: int) -> tuple[int, int]:
    """Width and height in pixels of a screen of this computer.

    Raises
    ------
    InputError
        If there is no screen of that number.
    """
    import pyglet

    screens = pyglet.canvas.get_display().get_screens()
    if not 0 <= number < len(screens):
        raise InputError(f"--screen is {number}, but this computer's screens are 0 to {len(screens) - 1}.")
    return screens[number].width, screens[number].height


def side_by_side(numbers: tuple[int, int]) -> tuple[int, int]:
    """Return the place of the first of two screens, whose right edge touches the second.

    Raises
    ------
    InputError
        If there is no such screen, or they differ in size or do not lie side by side.
    """
    import pyglet

    (width, height), other = screen_size(numbers[0]), screen_size(numbers[1])
    first, second = (pyglet.canvas.get_display().get_screens()[number] for number in numbers)
    if (width, height) != other or (second.x, second.y) != (first.x + width, first.y):
        raise InputError(
            f"the screens {numbers[0]} and {numbers[1]} ({width} x {height} px at {first.x}, {first.y}; {other[0]} x "
            f"{other[1]} px at {second.x}, {second.y}) must be of one size and side by side, the left eye's on the "
            "left: set this in the settings of the displays."
        )
    return first.x, first.y


def key_names() -> set[str]:
    """Names of all keys that this computer's keyboards have."""
    return set(keyNames.values())


class Keys:
    """The keyboard, as PsychToolbox reads it: every press and release with the time at which it happened."""

    def __init__(self) -> None:
        self._keyboard = Keyboard(backend="ptb")
        self.devices = len(self._keyboard.device._devs)
        if not self.devices:
            raise InputError("no keyboard was found: plug one in, and see 'focalgradient doctor'.")
        self.boxes: list[Box] = []
        """Response boxes, whose buttons count as keys."""
        self._down: list[Any] = []

    def events(self) -> list[Press]:
        """What was pressed and released since the last call, in order of time."""
        ended = self._keyboard.getKeys(waitRelease=True, clear=True)
        still = self._keyboard.getKeys(waitRelease=False, clear=False)
        new = [key for key in (*ended, *still) if not any(key is one for one in self._down)]
        self._down = [key for key in (*self._down, *new) if not any(key is one for one in ended)]
        ahead = time.monotonic() - logging.defaultClock.getTime()
        found = [Press(key.tDown + ahead, key.name, True) for key in new]
        found += [Press(key.tDown + key.duration + ahead, key.name, False) for key in ended]
        for box in self.boxes:
            found += box.events()
        return sorted(found, key=lambda press: press.time)

    def clear(self) -> None:
        """Forget what was pressed up to now; what is held stays held, and its release will be an event."""
        self.events()


class Screen:
    """The window of an experiment.

    Parameters
    ----------
    number
        Of the screen that it is on.
    size_px
        Of the window; None: the whole screen.
    display
        The screen's geometry and its encoding of light.
    background
        From -1, black, to 1, white.
    patch
        Corner ("left" or "right", below) of the square for a photodiode, white while a stimulus is shown; None: none.
    words
        What is said on it; None: in English.
    stereoscope
        How it is set up, and the displays of the left and of the right eye; None: both eyes look at the whole window.
    """

    def __init__(
        self,
        number: int,
        size_px: tuple[int, int] | None,
        display: Display,
        *,
        background: float = -1.0,
        patch: str | None = None,
        words: Words | None = None,
        stereoscope: tuple[Stereoscope, tuple[Display, Display]] | None = None,
    ):
        self.stop_question = "common.stop"  # of the words: what ESC asks
        whole = screen_size(number)
        width, height = size_px or whole
        place: tuple[int, int] | None = None
        if stereoscope is not None and size_px is None and stereoscope[0].layout == "screens":
            place, width = side_by_side(stereoscope[0].screens), 2 * width
        # A monitor of our own, without gamma: PsychoPy would load a gamma table into the graphics card for it.
        monitor = monitors.Monitor("focalgradient, of its own", width=1.0, distance=1.0, autoLog=False, currentCalib={})
        monitor.setGamma(None)
        monitor.setSizePix(list(whole))
        self.window = visual.Window(
            (width, height),
            fullscr=size_px is None and place is None,
            pos=place,
            viewScale=(-1, 1) if stereoscope is not None and stereoscope[0].mirrored else None,
            screen=number,
            monitor=monitor,
            units="pix",
            color=background,
            allowGUI=size_px is not None,
            checkTiming=False,
            autoLog=False,
            title="focalgradient",
        )
        self.eyes = None if stereoscope is None else Eyes(self.window, *stereoscope)
        """The parts of the two eyes, where they see different ones."""
        self.size = (int(self.window.size[0]), int(self.window.size[1])) if self.eyes is None else self.eyes.size
        self.display = display
        self.words = words or load_words("en")
        self.background = background
        self.keys = Keys()
        self.mouse = event.Mouse(win=self.window, visible=False) if self.eyes is None else Still()
        self.pointer: Pointer | None = None
        self.dropped = 0
        self.drawn: dict[str, None] = {}
        """Pictures that were drawn during this trial, in order: the SHA-256 of their pixels and what was changed."""
        self.intervals: list[float] = []
        """Seconds between the frames of the last `play`."""
        self.on_event: Callable[[str, float], object] = lambda event, time: None
        """Is called with the name and the time of each event, as soon as it is on the screen."""
        self.after_frame: Callable[[], object] = lambda: None
        """Is called after each frame that `frame` shows."""
        self._patch = self._make_patch(patch)
        self._last = self._until = 0.0
        self.refresh_hz = self._measure()
        self.frame_s = 1 / (self.refresh_hz or PACE)
        self.keys.clear()

    def close(self) -> None:
        """Give the screen back, and the response boxes."""
        for box in self.keys.boxes:
            box.close()
        self.window.close()

    def _make_patch(self, corner: str | None) -> Any:
        if corner is None:
            return None
        side = round(PATCH * self.size[1])
        x = (self.size[0] - side) / 2 * (-1 if corner == "left" else 1)
        where = {"pos": (x, (side - self.size[1]) / 2), "lineWidth": 0, "autoLog": False}
        return self.both(visual.Rect(self.window, side, side, **where))

    def _measure(self, frames: int = 40) -> float | None:
        """Frames a second; None where frames come irregularly or faster than any display: nothing waits for it then."""
        times = [self._flip() for _ in range(frames + 10)][10:]
        steps = [later - sooner for sooner, later in pairwise(times)]
        quarter, middle, three = quantiles(steps, n=4)
        regular = three - quarter < 0.1 * middle and middle > 1 / 500
        return 1 / median(steps) if regular else None

    # --- Frames ------------------------------------------------------------------------------------------------------

    def frame(self, lit: bool = False) -> float:
        """Show what was drawn: the time at which it is on the screen. `lit`: the photodiode's patch is white."""
        if self._patch is not None:
            self._patch.fillColor = 1.0 if lit else -1.0
            self._patch.draw()
        if self.refresh_hz is None and (rest := self._last + self.frame_s - self.now()) > 0:
            time.sleep(rest)
        self._last = self._flip()
        if self.pointer is not None:
            self.pointer.shown()
        self.after_frame()
        return self._last

    def _flip(self) -> float:
        self.window.flip()
        return time.monotonic()

    def now(self) -> float:
        """The time."""
        return time.monotonic()

    def play(
        self, draw: Draw, seconds: float, event: str, *, lit: bool = True, presses: list[Press] | None = None
    ) -> float:
        """Show frames for so long, and say when the first was on the screen.

        The last one stays until the caller shows something else, which is to be at once. Frames that came late are
        counted in `dropped`.

        Parameters
        ----------
        draw
            Draws a frame, given the seconds since the first.
        seconds
            How long, to the nearest frame.
        event
            Name for the markers.
        lit
            Whether the photodiode's patch is white.
        presses
            Takes what was pressed and released, with times of the clock.

        Raises
        ------
        Quit, Again
            If escape was pressed, by what was answered to the question whether to stop.
        """
        self.wait_out()
        if self.pointer is not None:
            self.window.mouseVisible = False
        draw(0.0)
        onset = self.frame(lit)
        self.on_event(event, onset)
        before = onset
        self.intervals = []
        while before + 1.5 * self.frame_s < onset + seconds:  # the next frame is still to be shown
            found = self.keys.events()
            if presses is not None:
                presses += found
            self.stop_if_asked(found)
            draw(before + self.frame_s - onset)
            now = self.frame(lit)
            self.intervals.append(now - before)
            self.dropped += max(round((now - before) / self.frame_s) - 1, 0)
            before = now
        return onset

    def warm(self, *parts: Any) -> None:
        """Draw something where nobody sees it: the first time takes longest, and is not to delay a frame."""
        before = [*self.drawn]
        for part in parts:
            part.draw()
        self.window.clearBuffer()
        self.drawn.clear()
        self.drawn.update(dict.fromkeys(before))

    def blank(self) -> float:
        """Clear the screen."""
        return self.frame()

    def empty(self, seconds: float, event: str, meanwhile: Callable[[], object] = lambda: None) -> float:
        """Show the background alone, for so long once `wait_out` is called; do something `meanwhile`."""
        onset = self.frame()
        self.on_event(event, onset)
        meanwhile()
        self._until = onset + seconds
        return onset

    def wait_out(self) -> None:
        """Keep the background until the time of the last `empty` is over, to the nearest frame."""
        while self.now() + 1.5 * self.frame_s < self._until:
            self.stop_if_asked(self.keys.events())
            self.frame()

    def wait(self, draw: Callable[[], object], keys: Sequence[str], event: str) -> Press:
        """Show something until one of the keys is pressed: which, and when."""
        self.keys.clear()
        draw()
        self.offer(*keys)
        self.on_event(event, self.frame())
        while True:
            found = self.keys.events()
            self.stop_if_asked(found)
            pressed = next((press for press in found if press.down and press.key in keys), None)
            if pressed is not None:
                return pressed
            draw()
            self.offer(*keys)
            self.frame()

    def point(self) -> None:
        """Let mouse or touch be enough: pages and questions get buttons."""
        self.pointer = Pointer(self)
        self.keys.boxes.append(self.pointer)

    def offer(self, *keys: str, **labels: str) -> None:
        """Draw a button for each key, where mouse or touch is to be enough; `labels`: other keys, with labels."""
        if self.pointer is None:
            return
        usual = {"space": "web.go_on", self.words.yes: "web.yes", self.words.no: "web.no"}
        named = [(key, self.words(usual[key]) if key in usual else key.upper()) for key in keys]
        self.pointer.buttons([*named, *labels.items()])

    def stop_if_asked(self, found: Iterable[Press]) -> None:
        """Where escape is among the keys, ask whether to stop."""
        if not any(press.key == "escape" and press.down for press in found):
            return
        self.on_event("quit?", self.now())
        title, _, body = self.words(self.stop_question).partition("\n")
        yes, no = self.words.yes, self.words.no
        parts = (
            self.plate(),
            self.text(title, height=0.05, y=0.12),
            self.text(body, y=0.02),
            self.text(self.words("common.stop_keys", yes=yes.upper(), no=no.upper()), y=-0.12, bold=True),
        )
        while True:
            for part in parts:
                part.draw()
            self.offer(yes, no)
            self.frame()
            for press in self.keys.events():
                if press.down and press.key in (yes, no):
                    raise Quit if press.key == yes else Again

    # --- What is drawn -----------------------------------------------------------------------------------------------

    def both(self, part: Any) -> Any:
        """Let a stimulus of one's own, made with `window`, be drawn for both eyes through a stereoscope; return it."""
        if self.eyes is not None:
            part.draw = partial(self.eyes.each, part.draw)
        return part

    def pair(self, left: NDArray[Any], right: NDArray[Any]) -> Pair:
        """A picture for each eye, in light (H x W or H x W x 3, 1: white), encoded by that eye's own gamma.

        Raises
        ------
        InputError
            If there is no stereoscope, or a picture is larger than an eye's part.
        """
        if self.eyes is None:
            raise InputError("a pair needs a stereoscope: give its settings (--stereoscope FILE), or show an anaglyph.")
        made = []
        for light, display in zip((left, right), self.eyes.displays, strict=True):
            if light.shape[0] > self.size[1] or light.shape[1] > self.size[0]:
                raise InputError(
                    f"a picture of {light.shape[1]} x {light.shape[0]} pixels is larger than an eye's part of the "
                    f"window, {self.size[0]} x {self.size[1]}: make it smaller."
                )
            made.append(self._picture(display.encode(light), self.drawn))
        return Pair(self.eyes, *made)

    def text(self, text: str, *, height: float = 0.03, x: float = 0.0, y: float = 0.0, **how: Any) -> Any:
        """Text about a place; `height`, `x` and `y` are shares of the screen's height."""
        unit = self.size[1]
        wrap = min(1.3 * unit, 0.92 * self.size[0])
        how = {"color": INK, "wrapWidth": wrap, **how}
        how |= {"pos": (x * unit, y * unit), "height": height * unit, "autoLog": False}
        return self.both(visual.TextStim(self.window, text, **how))

    def picture(self, pixels: NDArray[np.uint8], *, recorded: bool = True) -> Any:
        """A picture in the middle of the screen, H x W (grey) or H x W x 3, one pixel on one of the screen's.

        Where it is `recorded`, the SHA-256 of its pixels is among `drawn` once it is drawn.
        """
        return self.both(self._picture(pixels, self.drawn if recorded else None))

    def _picture(self, pixels: NDArray[np.uint8], drawn: dict[str, None] | None) -> ShownPicture:
        height, width = pixels.shape[:2]
        # Where one side is odd and the other even, the middle of the screen lies between pixels.
        place = ((self.size[0] - width) % 2 / 2, (self.size[1] - height) % 2 / 2)
        return ShownPicture(self.window, pixels, place, drawn)

    def refocused(self, series: FocusSeries, pos: tuple[float, float] = (0.0, 0.0)) -> FocusView:
        """A focus series, one pixel on one of the screen's; `pos` is its middle, in pixels from that of the screen."""
        if self.eyes is None:
            return FocusView(self.window, series, self.display, pos)
        return self.eyes.refocused(FocusView(self.window, series, self.display, pos))

    def fixation(self, x: float, y: float) -> Any:
        """A mark to look at: a bull's eye with a cross, 0.6 degrees wide."""
        radius = self.display.pixels_per_degree * 0.3
        dark = {"fillColor": -1.0, "lineWidth": 0, "pos": (x, y), "autoLog": False}
        light = {**dark, "fillColor": 1.0}
        arm = radius / 3
        parts = [
            visual.Circle(self.window, radius, edges=48, **dark),
            visual.Rect(self.window, 2 * radius, arm, **light),
            visual.Rect(self.window, arm, 2 * radius, **light),
            visual.Circle(self.window, arm / 2 * 1.2, edges=24, **dark),
        ]
        return self.both(_Group(parts))

    def whole(self, light: float) -> Any:
        """The whole screen in one grey, from -1 to 1."""
        how = {"fillColor": light, "lineWidth": 0, "autoLog": False}
        sides = self.size if self.eyes is None else [2 * side for side in self.size]  # whatever the offset
        return self.both(visual.Rect(self.window, *sides, **how))

    def plate(self) -> Any:
        """What text is drawn on: the whole screen, dark enough to read what stands on it."""
        return self.whole(min(self.background, PLATE))

    def box(self, side: float) -> Any:
        """The outline of a square."""
        how = {"fillColor": None, "lineColor": INK, "lineWidth": 3, "autoLog": False}
        return self.both(visual.Rect(self.window, side, side, **how))

    def line(
        self, start: tuple[float, float], end: tuple[float, float], width: float = 2.0, *, for_both: bool = True
    ) -> Any:
        """A straight line; `for_both` eyes, or in the part where it is drawn."""
        made = visual.Line(self.window, start, end, lineColor=INK, lineWidth=width, autoLog=False)
        return self.both(made) if for_both else made

    def triangle(self, size: float, **how: Any) -> Any:
        """A triangle that points down at its place."""
        corners = [(0, 0), (-size / 2, size), (size / 2, size)]
        how |= {"vertices": corners, "fillColor": INK, "lineWidth": 0, "autoLog": False}
        return self.both(visual.ShapeStim(self.window, **how))


class _Group:
    """Shapes that stand at one place."""

    def __init__(self, parts: Sequence[Any]):
        self.parts = parts

    def move(self, x: float, y: float) -> None:
        for part in self.parts:
            part.pos = (x, y)

    def draw(self) -> None:
        for part in self.parts:
            part.draw()


def versions() -> dict[str, str]:
    """Versions of what is used here, and what draws; a window must be open."""
    from importlib.metadata import version

    from pyglet.gl import gl_info

    names = ("psychopy", "psychtoolbox", "pyglet")
    return {name: version(name) for name in names} | {"opengl": " ".join(gl_info.get_renderer().split())}
