"""Screen and keyboard of the experiments: timed frames, pixel-exact pictures, and time-stamped keys.

All times are in seconds on Python's monotonic clock, which cannot be set (CLOCK_MONOTONIC on Linux). PsychoPy's and
PsychToolbox's clocks follow the wall clock on Linux; their key times are converted when the keys are read. Callers
subtract the start of their sitting. Positions are in pixels from the screen's centre, x right and y up, as in PsychoPy.
The graphics card's gamma table is left unchanged: pixels are encoded for the display before they are passed here.
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

logging.console.setLevel(logging.CRITICAL)  # its messages would mix with ours on standard output

from psychopy import event, monitors, visual  # noqa: E402  after the log is silenced
from psychopy.hardware.keyboard import Keyboard, keyNames  # noqa: E402

from focalgradient.dataset import Press  # noqa: E402
from focalgradient.design.words import Words, load_words  # noqa: E402
from focalgradient.display import Display  # noqa: E402
from focalgradient.errors import InputError  # noqa: E402
from focalgradient.lab.devices.boxes import Box  # noqa: E402
from focalgradient.lab.devices.pointer import Pointer  # noqa: E402
from focalgradient.lab.devices.stereoscope import Eyes, Pair, Stereoscope, Still  # noqa: E402
from focalgradient.lab.experiment import Again, Quit  # noqa: E402
from focalgradient.lab.focus_view import FocusView  # noqa: E402
from focalgradient.lab.monitor import Calibration, calibration_of, store_luminance  # noqa: E402
from focalgradient.lab.picture import ShownPicture  # noqa: E402
from focalgradient.live import FocusSeries  # noqa: E402

__all__ = ["Calibration", "Keys", "Screen", "calibration_of", "key_names", "screen_size", "store_luminance", "versions"]

INK, DARK_INK = 0.9, -1.0
LIGHTEST = -0.08  # background on which light text has more contrast than dark text (5:1 and more)
PATCH = 0.045  # side of the photodiode's square as a fraction of the screen's height
PACE = 60.0  # frame rate in Hz if the display does not report its frames

Draw = Callable[[float], object]
"""Function that draws one frame, given the time in s since the first."""


def screen_size(number: int) -> tuple[int, int]:
    """Return width and height in pixels of a screen of this computer.

    Raises
    ------
    InputError
        If there is no screen with that number.
    """
    import pyglet

    screens = pyglet.canvas.get_display().get_screens()
    if not 0 <= number < len(screens):
        raise InputError(f"--screen is {number}, but this computer's screens are numbered 0 to {len(screens) - 1}.")
    return screens[number].width, screens[number].height


def side_by_side(numbers: tuple[int, int]) -> tuple[int, int]:
    """Return the position of the first of two screens, whose right edge touches the second.

    Raises
    ------
    InputError
        If there is no such screen, or they differ in size or are not side by side.
    """
    import pyglet

    (width, height), other = screen_size(numbers[0]), screen_size(numbers[1])
    first, second = (pyglet.canvas.get_display().get_screens()[number] for number in numbers)
    if (width, height) != other or (second.x, second.y) != (first.x + width, first.y):
        raise InputError(
            f"the screens {numbers[0]} and {numbers[1]} ({width} x {height} px at {first.x}, {first.y}; {other[0]} x "
            f"{other[1]} px at {second.x}, {second.y}) must have one size and be side by side, the left eye's on the "
            "left: change the display settings of the operating system."
        )
    return first.x, first.y


def key_names() -> set[str]:
    """Return the names of all keys that PsychoPy knows."""
    return set(keyNames.values())


class Keys:
    """Keyboard, read by PsychToolbox: presses and releases with time stamps."""

    def __init__(self) -> None:
        self._keyboard = Keyboard(backend="ptb")
        self.devices = len(self._keyboard.device._devs)
        if not self.devices:
            raise InputError("no keyboard was found: connect one, and run 'focalgradient doctor'.")
        self.boxes: list[Box] = []
        """Response boxes, whose buttons act as keys."""
        self._down: list[Any] = []

    def events(self) -> list[Press]:
        """Return presses and releases since the last call, in order of time."""
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
        """Discard presses so far; keys that are held remain held, and their release will be an event."""
        self.events()


class Screen:
    """Window of an experiment.

    Parameters
    ----------
    number
        Number of the screen.
    size_px
        Size of the window; None: the whole screen.
    display
        Geometry and light encoding of the screen.
    background
        Background grey, from -1 (black) to 1 (white).
    patch
        Lower corner ("left" or "right") of the photodiode's square, white while a stimulus is shown; None: no square.
    words
        Texts shown on the screen; None: in English.
    stereoscope
        Settings of the stereoscope, and the displays of the left and right eye; None: both eyes see the whole window.
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
        self.stop_question = "common.stop"  # key in `words` of the question that ESC asks
        whole = screen_size(number)
        width, height = size_px or whole
        place: tuple[int, int] | None = None
        if stereoscope is not None and size_px is None and stereoscope[0].layout == "screens":
            place, width = side_by_side(stereoscope[0].screens), 2 * width
        # A monitor without gamma: PsychoPy would otherwise load a gamma table into the graphics card.
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
        """The parts of the window for the two eyes, with a stereoscope."""
        self.size = (int(self.window.size[0]), int(self.window.size[1])) if self.eyes is None else self.eyes.size
        self.display = display
        self.words = words or load_words("en")
        self.background = background
        self.ink = INK if background < LIGHTEST else DARK_INK
        """Grey of texts and lines on the background."""
        self.practice = False
        """True during practice, which questions are marked with."""
        self.keys = Keys()
        self.mouse = event.Mouse(win=self.window, visible=False) if self.eyes is None else Still()
        self.pointer: Pointer | None = None
        self.dropped = 0
        self.drawn: dict[str, None] = {}
        """Pictures drawn during this trial, in order: SHA-256 of their pixels, and changed properties."""
        self.intervals: list[float] = []
        """Frame durations of the last `play`, in s."""
        self.on_event: Callable[[str, float], object] = lambda event, time: None
        """Called with the name and time of each event, as soon as it is on the screen."""
        self.after_frame: Callable[[], object] = lambda: None
        """Called after each frame that `frame` shows."""
        self._patch = self._make_patch(patch)
        self._last = self._until = 0.0
        self.refresh_hz = self._measure()
        self.frame_s = 1 / (self.refresh_hz or PACE)
        self.keys.clear()

    def close(self) -> None:
        """Close the window and the response boxes."""
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
        """Return the frame rate in Hz; None if frames are irregular or implausibly fast (not synchronised)."""
        times = [self._flip() for _ in range(frames + 10)][10:]
        steps = [later - sooner for sooner, later in pairwise(times)]
        quarter, middle, three = quantiles(steps, n=4)
        regular = three - quarter < 0.1 * middle and middle > 1 / 500
        return 1 / median(steps) if regular else None

    # --- Frames ------------------------------------------------------------------------------------------------------

    def frame(self, lit: bool = False) -> float:
        """Flip the window; return its time of onset. `lit`: the photodiode's square is white."""
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
        """Return the time in s."""
        return time.monotonic()

    def play(
        self, draw: Draw, seconds: float, event: str, *, lit: bool = True, presses: list[Press] | None = None
    ) -> float:
        """Show an animation for a duration; return the onset of its first frame.

        The last frame stays until the caller shows something else, which must follow immediately. Late frames are
        counted in `dropped`.

        Parameters
        ----------
        draw
            Function that draws a frame, given the time in s since the first.
        seconds
            Duration in s, rounded to whole frames.
        event
            Name of the event in the event markers.
        lit
            Whether the photodiode's square is white.
        presses
            Receives presses and releases during the animation, with times on the screen's clock.

        Raises
        ------
        Quit, Again
            If Escape was pressed, depending on the answer to the question whether to stop.
        """
        self.wait_out()
        if self.pointer is not None:
            self.window.mouseVisible = False
        draw(0.0)
        onset = self.frame(lit)
        self.on_event(event, onset)
        before = onset
        self.intervals = []
        while before + 1.5 * self.frame_s < onset + seconds:  # the next frame still has to be shown
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
        """Draw stimuli off screen once, because the first draw is slow and would delay a frame."""
        before = [*self.drawn]
        for part in parts:
            part.draw()
        self.window.clearBuffer()
        self.drawn.clear()
        self.drawn.update(dict.fromkeys(before))

    def blank(self) -> float:
        """Show the background; return the time."""
        return self.frame()

    def empty(self, seconds: float, event: str, meanwhile: Callable[[], object] = lambda: None) -> float:
        """Show the background for a duration, which `wait_out` completes; call `meanwhile` during it."""
        onset = self.frame()
        self.on_event(event, onset)
        meanwhile()
        self._until = onset + seconds
        return onset

    def wait_out(self) -> None:
        """Keep the background until the duration of the last `empty` has passed, to the nearest frame."""
        while self.now() + 1.5 * self.frame_s < self._until:
            self.stop_if_asked(self.keys.events())
            self.frame()

    def wait(self, draw: Callable[[], object], keys: Sequence[str], event: str) -> Press:
        """Show a picture until one of the keys is pressed; return the press."""
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
        """Enable operation by mouse or touch alone: pages and questions show buttons."""
        self.pointer = Pointer(self)
        self.keys.boxes.append(self.pointer)

    def offer(self, *keys: str, **labels: str) -> None:
        """Draw a button for each key, if operation by mouse or touch is enabled; `labels`: more keys, with labels."""
        if self.pointer is None:
            return
        usual = {"space": "web.go_on", self.words.yes: "web.yes", self.words.no: "web.no"}
        named = [(key, self.words(usual[key]) if key in usual else self.words.key(key)) for key in keys]
        self.pointer.buttons([*named, *labels.items()])

    def stop_if_asked(self, found: Iterable[Press]) -> None:
        """Ask whether to stop if Escape is among the presses."""
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

    # --- Drawing -----------------------------------------------------------------------------------------------------

    def both(self, part: Any) -> Any:
        """Make a stimulus that was created with `window` be drawn for both eyes of a stereoscope; return it."""
        if self.eyes is not None:
            part.draw = partial(self.eyes.each, part.draw)
        return part

    def pair(self, left: NDArray[Any], right: NDArray[Any]) -> Pair:
        """Return a pair of pictures, one per eye, from light (H x W or H x W x 3, 1: white) and each eye's gamma.

        Raises
        ------
        InputError
            If there is no stereoscope, or a picture exceeds an eye's part of the window.
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
        """Return a text centred at a position; `height`, `x` and `y` are fractions of the screen's height."""
        unit = self.size[1]
        how = {"color": self.ink, "wrapWidth": 1.3 * unit, **how}
        how["wrapWidth"] = min(how["wrapWidth"], 0.92 * self.size[0])
        how |= {"pos": (x * unit, y * unit), "height": height * unit, "autoLog": False}
        return self.both(visual.TextStim(self.window, text, **how))

    def picture(self, pixels: NDArray[np.uint8], *, recorded: bool = True) -> Any:
        """Return a picture at the screen's centre, H x W (grey) or H x W x 3, shown pixel for pixel.

        If it is `recorded`, the SHA-256 of its pixels is added to `drawn` when it is drawn.
        """
        return self.both(self._picture(pixels, self.drawn if recorded else None))

    def _picture(self, pixels: NDArray[np.uint8], drawn: dict[str, None] | None) -> ShownPicture:
        height, width = pixels.shape[:2]
        # Where one side is odd and the other even, the screen's centre lies between pixels.
        place = ((self.size[0] - width) % 2 / 2, (self.size[1] - height) % 2 / 2)
        return ShownPicture(self.window, pixels, place, drawn)

    def refocused(self, series: FocusSeries, pos: tuple[float, float] = (0.0, 0.0)) -> FocusView:
        """Return a view of a focus series, shown pixel for pixel; `pos` is its centre, in px from the screen's."""
        if self.eyes is None:
            return FocusView(self.window, series, self.display, pos)
        return self.eyes.refocused(FocusView(self.window, series, self.display, pos))

    def fixation(self, x: float, y: float) -> Any:
        """Return a fixation mark: bull's eye with cross, 0.6 degrees wide (Thaler et al. 2013)."""
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
        """Return a uniform grey field over the whole screen, from -1 to 1."""
        how = {"fillColor": light, "lineWidth": 0, "autoLog": False}
        sides = self.size if self.eyes is None else [2 * side for side in self.size]  # covers the part at any offset
        return self.both(visual.Rect(self.window, *sides, **how))

    def plate(self) -> Any:
        """Return the background of pages, over the whole screen: that of stimuli, so that brightness does not jump."""
        return self.whole(self.background)

    def box(self, side: float) -> Any:
        """Return the outline of a square."""
        how = {"fillColor": None, "lineColor": self.ink, "lineWidth": 3, "autoLog": False}
        return self.both(visual.Rect(self.window, side, side, **how))

    def line(self, start: tuple[float, float], end: tuple[float, float], width: float = 2.0, **how: Any) -> Any:
        """Return a straight line, drawn for both eyes or, with `for_both=False`, in the current eye's part."""
        for_both = how.pop("for_both", True)
        how = {"lineColor": self.ink, **how}
        made = visual.Line(self.window, start, end, lineWidth=width, autoLog=False, **how)
        return self.both(made) if for_both else made

    def triangle(self, size: float, **how: Any) -> Any:
        """Return a triangle that points down at its position."""
        corners = [(0, 0), (-size / 2, size), (size / 2, size)]
        how = {"fillColor": self.ink, **how, "vertices": corners, "lineWidth": 0, "autoLog": False}
        return self.both(visual.ShapeStim(self.window, **how))


class _Group:
    """Group of shapes drawn at one position."""

    def __init__(self, parts: Sequence[Any]):
        self.parts = parts

    def move(self, x: float, y: float) -> None:
        for part in self.parts:
            part.pos = (x, y)

    def draw(self) -> None:
        for part in self.parts:
            part.draw()


def versions() -> dict[str, str]:
    """Return the versions of PsychoPy's packages and the OpenGL renderer; requires an open window."""
    from importlib.metadata import version

    from pyglet.gl import gl_info

    names = ("psychopy", "psychtoolbox", "pyglet")
    return {name: version(name) for name in names} | {"opengl": " ".join(gl_info.get_renderer().split())}
