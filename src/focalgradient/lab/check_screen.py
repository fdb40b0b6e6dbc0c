"""Looks at screen and keyboard as the experiments use them, and prints it as JSON, for 'focalgradient doctor'.

One line on standard output: a list of checks, each with its name, what was measured, whether it is well, and what to do
where it is not.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Iterator
from types import ModuleType
from typing import TYPE_CHECKING, Any

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab.preparation import ASSUMED_DISTANCE, ASSUMED_PITCH, WINDOW, import_screen
from focalgradient.lab.running import PART

if TYPE_CHECKING:
    from focalgradient.lab.screen import Calibration, Screen

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")
IN_MONITOR_CENTER = "in PsychoPy's Monitor Center and give --monitor NAME"


def _check(name: str, measured: str, well: bool, remedy: str = "") -> dict[str, Any]:
    return {"check": name, "measured": measured, "well": well, "remedy": remedy}


def main() -> int:
    """Print the checks; exit code 2 with a sentence where no window can be opened."""
    add = (parser := argparse.ArgumentParser(description=__doc__)).add_argument
    add("--screen", type=int, default=0)
    add("--monitor")
    add("--seconds", type=float, default=10.0)
    add("--windowed", action="store_true")
    options = parser.parse_args()
    try:
        module = import_screen()
        calibration = None if options.monitor is None else module.calibration_of(options.monitor)
        print(json.dumps([*_geometry(options, module, calibration), *_window(options, module)]))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def _geometry(options: argparse.Namespace, module: ModuleType, found: Calibration | None) -> Iterator[dict[str, Any]]:
    size = module.screen_size(options.screen)
    yield _check("screen", f"{size[0]} x {size[1]} px", True)
    if found is None or not (found.width and found.distance):
        yield _check("pixels per degree", "size or distance not known", False, f"enter them {IN_MONITOR_CENTER}")
    elif found.size_px and found.size_px != size:
        measured = f"calibrated at {found.size_px[0]} x {found.size_px[1]} px"
        yield _check("pixels per degree", measured, False, "set the screen to that resolution, or calibrate it anew")
    else:
        display = Display(size, found.width / size[0], found.distance)
        text = f"{display.pixels_per_degree:.2f} ({found.width:.3f} m wide, seen from {found.distance:.3f} m)"
        yield _check("pixels per degree", text, True)
    gamma = None if found is None else found.gamma
    remedy = f"measure it with a photometer, enter it {IN_MONITOR_CENTER}"
    yield _check("gamma", "not measured" if gamma is None else f"{gamma:.2f}", gamma is not None, remedy)


def _window(options: argparse.Namespace, module: ModuleType) -> Iterator[dict[str, Any]]:
    display = Display(module.screen_size(options.screen), ASSUMED_PITCH, ASSUMED_DISTANCE)
    screen = module.Screen(options.screen, WINDOW if options.windowed else None, display)
    try:
        yield from _timing(screen, options.seconds)
        renderer = module.versions()["opengl"]
        hardware = not any(word in renderer.lower() for word in SOFTWARE)
        yield _check("graphics", renderer, hardware, "install the graphics card's driver: this one draws by software")
        yield _check("keyboard", f"PsychToolbox, {screen.keys.devices} devices", True)
    finally:
        screen.close()


def _timing(screen: Screen, seconds: float) -> Iterator[dict[str, Any]]:
    """Show a mark that moves, and count the frames that came late."""
    rate = screen.refresh_hz
    text = "frames come irregularly: nothing waits for the screen" if rate is None else f"{rate:.2f} Hz"
    yield _check("refresh rate", text, rate is not None, "switch vertical synchronisation on in the driver's settings")
    mark, words = screen.fixation(0, 0), screen.text(f"Checking the screen for {seconds:g} seconds ...", y=-0.3)

    def draw(since: float) -> None:
        mark.move(0.3 * screen.size[1] * math.sin(2 * math.pi * since / 2), 0)
        mark.draw()
        words.draw()

    before = time.monotonic(), time.time()
    screen.play(draw, seconds, "check")
    lasted = time.monotonic() - before[0]
    by = 1e3 * (time.time() - before[1] - lasted)
    text = f"wall and monotonic clock parted by {by:+.1f} ms in {lasted:.1f} s"
    yield _check(
        "clock",
        text,
        abs(by) < 1e3 * PART,
        f"stop what sets the computer's clock: over {1e3 * PART:g} ms voids a trial",
    )
    frames = seconds / screen.frame_s
    text = f"{screen.dropped} of {frames:.0f} in {seconds:g} s"
    yield _check("dropped frames", text, screen.dropped == 0, "close other programs, and composite no windows")


if __name__ == "__main__":
    sys.exit(main())
