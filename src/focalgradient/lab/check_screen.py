"""Check the screen and keyboard as the experiments use them, and print the results as JSON for 'focalgradient doctor'.

The output is one line: a list of checks, each with its name, the measured value, whether it passed, and the remedy if
it did not.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import asdict
from statistics import median
from types import ModuleType
from typing import TYPE_CHECKING

from focalgradient.display import CARD, Display
from focalgradient.errors import InputError
from focalgradient.lab.computer import Check
from focalgradient.lab.devices.triggers import Port, Triggers, open_triggers
from focalgradient.lab.forms import ENTER, draw_all
from focalgradient.lab.options import CheckOptions
from focalgradient.lab.preparation import ASSUMED_PITCH, import_screen, plain_screen
from focalgradient.lab.running import PART
from focalgradient.luminance import UNEQUAL, read_luminance
from focalgradient.options import parsed

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")
STEPS = {"left": -1.0, "right": 1.0, "down": -10.0, "up": 10.0}
"""Change of the card frame's width per key press, in pixels."""

IN_MONITOR_CENTER = "in PsychoPy's Monitor Center and give --monitor NAME"


WIDTH_TOLERANCE = 0.01
"""Tolerance between the screen width measured with a card and the calibrated width, as a fraction; an error of half a
millimetre on the card is 0.6 %.
"""

RATE_TOLERANCE = 0.01
"""Tolerance between the mean frame rate and the rate measured at the start, as a fraction."""

PULSES, PULSE_MS, PULSE_GAP = 20, 2.0, 0.02
"""Number of test pulses, their maximum duration in ms (an eighth of a frame at 60 Hz), and the gap between them in s.
"""


def main() -> int:
    """Run and print the checks; return exit code 2, with one sentence on standard error, if no window can be opened."""
    try:
        options = parsed(CheckOptions, sys.argv[1:], program="check_screen", about=__doc__)
        module = import_screen()
        if options.luminance is not None and options.monitor is not None:
            module.store_luminance(options.monitor, read_luminance(options.luminance))
        with closing(open_triggers(options)) as triggers:
            checks = [*_geometry(options, module), *_window(options, module, triggers)]
            print(json.dumps([asdict(check) for check in checks]))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _geometry(options: CheckOptions, module: ModuleType) -> Iterator[Check]:
    size, found = module.screen_size(options.screen), module.calibration_of(options.monitor)
    yield Check("screen", f"{size[0]} x {size[1]} px", True)
    if not (found.width and found.distance):
        yield Check("pixels per degree", "size or viewing distance unknown", False, f"enter them {IN_MONITOR_CENTER}")
    elif found.size_px and found.size_px != size:
        measured = f"calibrated at {found.size_px[0]} x {found.size_px[1]} px"
        yield Check("pixels per degree", measured, False, "set the screen to that resolution, or calibrate it again")
    else:
        display = Display(size, found.width / size[0], found.distance)
        text = f"{display.pixels_per_degree:.2f} ({found.width:.3f} m wide, viewed from {found.distance:.3f} m)"
        yield Check("pixels per degree", text, True)
    gamma = found.gamma
    remedy = f"measure it with a photometer, enter it {IN_MONITOR_CENTER}"
    yield Check("gamma", "not measured" if gamma is None else f"{gamma:.2f}", gamma is not None, remedy, "measured")
    if found.channels is not None:
        red, green, blue = found.channels
        apart = max(found.channels) - min(found.channels)
        text = f"red {red:.2f}, green {green:.2f}, blue {blue:.2f}"
        remedy = "greys are not neutral: reset the screen's colours to their defaults, and measure again"
        yield Check("gamma of the guns", text, apart <= UNEQUAL, remedy, f"differ by {UNEQUAL:g} at most")
    if found.white is not None:
        yield Check("white", f"{found.white:.1f} cd/m2", True)


def _window(options: CheckOptions, module: ModuleType, triggers: Triggers) -> Iterator[Check]:
    with closing(plain_screen(options, module)) as screen:
        yield from _timing(screen, options.seconds)
        yield _device_pixels(screen)
        for port in triggers.ports:
            yield _pulses(triggers, port)
        if options.card:
            yield _card(screen, options, module)
        renderer = module.versions()["opengl"]
        hardware = not any(word in renderer.lower() for word in SOFTWARE)
        yield Check(
            "graphics",
            renderer,
            hardware,
            "install the graphics card's driver: the present one renders in software",
            "hardware",
        )
        yield Check(
            "keyboard",
            f"PsychToolbox, {screen.keys.devices} devices",
            screen.keys.devices > 0,
            "connect a keyboard",
            "1",
        )


def _timing(screen: Screen, seconds: float) -> Iterator[Check]:
    """Show a moving mark, and check the refresh rate, the clocks, dropped frames and the mean frame rate."""
    rate = screen.refresh_hz
    text = "irregular frames: drawing is not synchronised with the screen" if rate is None else f"{rate:.2f} Hz"
    limit = "irregular by at most a tenth of a frame"
    yield Check(
        "refresh rate", text, rate is not None, "enable vertical synchronisation in the driver's settings", limit
    )
    mark, words = screen.fixation(0, 0), screen.text(f"Checking the screen for {seconds:g} seconds ...", y=-0.3)

    def draw(since: float) -> None:
        mark.move(0.3 * screen.size[1] * math.sin(2 * math.pi * since / 2), 0)
        mark.draw()
        words.draw()

    before = time.monotonic(), time.time()
    screen.play(draw, seconds, "check")
    lasted = time.monotonic() - before[0]
    by = 1e3 * (time.time() - before[1] - lasted)
    text = f"wall clock drifted from the monotonic clock by {by:+.1f} ms in {lasted:.1f} s"
    yield Check(
        "clock",
        text,
        abs(by) < 1e3 * PART,
        f"pause clock synchronisation: a drift above {1e3 * PART:g} ms invalidates a trial",
        f"{1e3 * PART:g} ms",
    )
    frames = seconds / screen.frame_s
    text = f"{screen.dropped} of {frames:.0f} in {seconds:g} s"
    yield Check(
        "dropped frames", text, screen.dropped == 0, "close other programs, and disable window compositing", "none"
    )
    if screen.intervals:
        mean = len(screen.intervals) / sum(screen.intervals)
        off = abs(mean * screen.frame_s - 1)
        remedy = "set the screen to one fixed rate (no variable refresh), and close other programs"
        text = f"{mean:.2f} Hz on average; {histogram(screen.intervals)}"
        yield Check(
            "frames", text, off <= RATE_TOLERANCE, remedy, f"{1 / screen.frame_s:.2f} Hz to {RATE_TOLERANCE:.0%}"
        )


def histogram(intervals: Sequence[float]) -> str:
    """Format a histogram of frame durations, rounded to ms.

    >>> histogram([0.0166, 0.0167, 0.0333])
    '17 ms: 2, 33 ms: 1'
    """
    counts = sorted(Counter(round(1e3 * one) for one in intervals).items())
    return ", ".join(f"{length} ms: {count}" for length, count in counts)


def _device_pixels(screen: Screen) -> Check:
    """Check that a pixel of the window is a pixel of the screen; desktop scaling would interpolate pictures."""
    real = tuple(int(side) for side in screen.window.winHandle.get_framebuffer_size())
    text = f"{real[0]} x {real[1]} for a window of {screen.size[0]} x {screen.size[1]}"
    remedy = "set the desktop's scale to 100 %, so that pictures are shown pixel for pixel"
    return Check("device pixels", text, real == screen.size, remedy, "equal")


def _pulses(triggers: Triggers, port: Port) -> Check:
    """Send test pulses to a port, and check their durations."""
    code, times = triggers.codes.of("test"), []
    for number in range(PULSES):
        before = time.perf_counter()
        try:
            triggers.send(port, "test", time.monotonic(), PULSE_GAP * number, None)
        except Exception as error:
            return Check("triggers", f"{port.name} failed: {error!r}"[:200], False, "correct the error", "no error")
        times.append(1e3 * (time.perf_counter() - before))
        time.sleep(PULSE_GAP)
    text = f"{port.name}: {PULSES} pulses of code {code} in {median(times):.2f} ms, {max(times):.2f} ms at most"
    remedy = f"make {port.name} return immediately: it delays the following frame"
    return Check("triggers", text, max(times) <= PULSE_MS, remedy, f"{PULSE_MS:g} ms each")


def _card(screen: Screen, options: CheckOptions, module: ModuleType) -> Check:
    """Measure the screen's width: the participant matches a frame to the size of a bank card held to the screen."""
    wide = float(round(CARD[0] / ASSUMED_PITCH))
    head = screen.text("Hold a bank card flat to the screen, in the frame.", height=0.035, y=0.42)
    foot = screen.text(
        "←  →  one pixel     ↓  ↑  ten pixels     ENTER: the frame is as large as the card", height=0.03, y=-0.42
    )
    screen.keys.clear()
    pressed: list[str] = []
    while not {*ENTER, "escape"} & {*pressed}:
        x, y = wide / 2, wide * CARD[1] / CARD[0] / 2
        corners = [(-x, -y), (x, -y), (x, y), (-x, y)]
        sides = zip(corners, [*corners[1:], corners[0]], strict=True)
        draw_all((head, foot, *(screen.line(*side) for side in sides)))
        screen.frame()
        pressed = [press.key for press in screen.keys.events() if press.down]
        wide = min(max(wide + sum(STEPS.get(key, 0.0) for key in pressed), 20), screen.size[0])
    if "escape" in pressed:
        return Check(
            "size by a card",
            "not measured: stopped with ESC",
            False,
            "give --card again, and match the frame to a card",
        )
    pixels = module.screen_size(options.screen)[0]
    width = CARD[0] * pixels / wide
    known = module.calibration_of(options.monitor).width
    text = f"card of 85.6 mm is {wide:.0f} px: screen {width:.3f} m wide"
    if known is None:
        return Check("size by a card", text, False, f"enter that width {IN_MONITOR_CENTER}", "known width to 1 %")
    remedy = f"measure the screen, and enter its width {IN_MONITOR_CENTER}, which has {known:.3f} m"
    return Check(
        "size by a card",
        text,
        abs(width / known - 1) <= WIDTH_TOLERANCE,
        remedy,
        f"{known:.3f} m to {WIDTH_TOLERANCE:.0%}",
    )


if __name__ == "__main__":
    sys.exit(main())
