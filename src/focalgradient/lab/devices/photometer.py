"""Measure the luminance of the screen with a photometer, for 'focalgradient doctor --photometer'.

PsychoPy's package for the photometer controls it. The table of luminances is printed as CSV on standard output.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
import sys
from collections.abc import Callable, Mapping
from contextlib import closing
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.lab.forms import ENTER, draw_all
from focalgradient.lab.options import MeterOptions
from focalgradient.lab.preparation import import_screen, plain_screen
from focalgradient.luminance import GUNS, fit_luminance
from focalgradient.options import parsed

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["PHOTOMETERS", "measure", "open_photometer"]

PHOTOMETERS: Mapping[str, tuple[str, str]] = {
    "CS100A": ("psychopy_minolta.minolta", "psychopy-minolta"),
    "LS100": ("psychopy_minolta.minolta", "psychopy-minolta"),
    "PR650": ("psychopy_photoresearch.pr", "psychopy-photoresearch"),
    "PR655": ("psychopy_photoresearch.pr", "psychopy-photoresearch"),
    "ColorCAL": ("psychopy_crs.colorcal", "psychopy-crs"),
    "S470": ("psychopy_gammasci.gammasci", "psychopy-gammasci"),
}
"""Module and package of PsychoPy's class for each photometer; the classes take a port, and `getLum()` returns cd/m2.
PsychoPy 2026 finds only the classes of the first package itself: the other packages declare no entry points.
"""

LEVELS: NDArray[np.float64] = np.linspace(0.0, 255.0, 16)
"""Measured levels: 16 from black to white."""

SIDE = 1 / 3
"""Side of the measured square as a fraction of the screen's height: 10 cm on a screen 30 cm high, wider than the
1-degree spot of a spectroradiometer at 1 m (1.7 cm).
"""

SETTLE_S = 0.2
"""Delay in s before each reading: ten times the response time of an LCD between greys."""

MOST_FAILURES = 3
"""Number of failed readings at one level after which the measurement is aborted."""

GUN = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1), "grey": (1, 1, 1)}


def open_photometer(device: str) -> Any:
    """Open a photometer.

    Parameters
    ----------
    device
        Class name and serial port, such as "LS100:/dev/ttyUSB0".

    Returns
    -------
    Any
        PsychoPy's photometer object, whose `getLum()` returns the luminance in cd/m2.

    Raises
    ------
    InputError
        If the name is unknown, its package is missing, or the photometer does not respond.
    """
    name, _, port = device.partition(":")
    if name not in PHOTOMETERS or not port:
        raise InputError(
            f"--photometer is {device!r}, but must be one of {', '.join(PHOTOMETERS)}, with its port, such as "
            "LS100:/dev/ttyUSB0."
        )
    module, package = PHOTOMETERS[name]
    if importlib.util.find_spec(module.partition(".")[0]) is None:
        raise InputError(f"--photometer {name} needs PsychoPy's package for it: pip install {package}.")
    remedy = "switch it on, set it to remote control, close other programs that use it, and check the port"
    try:
        found = getattr(importlib.import_module(module), name)(port)
    except Exception as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"the photometer {device} did not start ({why}): {remedy}.") from error
    if not getattr(found, "OK", True):
        raise InputError(f"the photometer {device} does not respond: {remedy}.")
    return found


def measure(show: Callable[[tuple[int, int, int]], object], photometer: Any) -> dict[str, NDArray[np.float64]]:
    """Measure the luminance of each channel and of grey, at each level.

    Parameters
    ----------
    show
        Function that shows a colour (red, green, blue from 0 to 255) until the display has settled.
    photometer
        Photometer, whose `getLum()` returns cd/m2.

    Returns
    -------
    dict[str, NDArray[np.float64]]
        Luminance in cd/m2 at each of `LEVELS`, by channel.

    Raises
    ------
    InputError
        If no valid reading is obtained at a level.

    Examples
    --------
    >>> class Linear:
    ...     def getLum(self):
    ...         return shown[-1][1] / 2.55
    >>> shown = []
    >>> found = measure(shown.append, Linear())
    >>> len(shown), float(found["green"][-1]), float(found["red"][-1])
    (64, 100.0, 0.0)
    """
    measured: dict[str, NDArray[np.float64]] = {}
    for gun in GUNS:
        values = []
        for level in LEVELS:
            red, green, blue = (int(level) * part for part in GUN[gun])
            show((red, green, blue))
            values.append(_read(photometer, f"{gun} {level:g}"))
        measured[gun] = np.array(values)
    return measured


def _read(photometer: Any, where: str) -> float:
    """Return one valid reading; PsychoPy's classes return -1 or None if a reading failed."""
    given: object = None
    for _ in range(MOST_FAILURES):
        try:
            given = photometer.getLum()
            value = float(given)  # type: ignore[arg-type]
        except Exception as error:
            given = error
            continue
        if math.isfinite(value) and value >= 0:
            return value
    raise InputError(
        f"the photometer gave {given!r} at {where}, but must give a luminance of 0 or more: check its "
        "range and its battery, and measure again."
    )


def main() -> int:
    """Print the table; return exit code 2, with one sentence on standard error, if the measurement fails."""
    try:
        options = parsed(MeterOptions, sys.argv[1:], program="photometer", about=__doc__)
        module = import_screen()
        photometer = open_photometer(options.device)
        with closing(plain_screen(options, module)) as screen:
            measured = _measure_on(screen, photometer)
        try:
            fit_luminance(LEVELS, measured)
        except InputError as error:
            raise InputError(
                f"the measured luminances are not those of a screen ({str(error).partition(':')[0]}): point the "
                "photometer at the square, and measure again."
            ) from error
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    print("level", *GUNS, sep=",")
    for number, level in enumerate(LEVELS):
        print(f"{level:g}", *(f"{measured[gun][number]:.6g}" for gun in GUNS), sep=",")
    return 0


def _measure_on(screen: Screen, photometer: Any) -> dict[str, NDArray[np.float64]]:
    """Show white until ENTER is pressed, then measure each level; ESC aborts."""
    side = round(SIDE * screen.size[1])
    head = screen.text("Point the photometer at the square, and focus it.", height=0.035, y=0.42)
    foot = screen.text(
        "ENTER: start. The measurement takes some minutes: darken the room, and touch nothing.", height=0.03, y=-0.42
    )

    def square(colour: tuple[int, int, int]) -> Any:
        return screen.picture(np.tile(np.array(colour, np.uint8), (side, side, 1)), recorded=False)

    def pressed() -> set[str]:
        keys = {press.key for press in screen.keys.events() if press.down}
        if "escape" in keys:
            raise InputError("the measurement was stopped with ESC, and nothing was written: start it again.")
        return keys

    def show(colour: tuple[int, int, int]) -> None:
        shown, until = square(colour), screen.now() + SETTLE_S
        while screen.now() < until:
            shown.draw()
            screen.frame()
        pressed()

    white = square((255, 255, 255))
    screen.keys.clear()
    while not pressed() & {*ENTER}:
        draw_all((white, head, foot))
        screen.frame()
    return measure(show, photometer)


if __name__ == "__main__":
    sys.exit(main())
