"""Measures the luminance of the screen with a photometer, for 'focalgradient doctor --photometer'.

The photometer is driven by PsychoPy's package of it. The table goes to standard output, as one would write it by hand.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import math
import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab.preparation import ASSUMED_DISTANCE, ASSUMED_PITCH, WINDOW, import_screen
from focalgradient.luminance import GUNS, fit_luminance

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
"""Module and package of each class of PsychoPy's, all of which take a port and have `getLum()` in cd/m2. PsychoPy 2026
finds only those of the first package by itself: the other packages declare no entry points."""

LEVELS: NDArray[np.float64] = np.linspace(0.0, 255.0, 16)
"""Levels that are measured: 16, both ends among them."""

SIDE = 1 / 3
"""Side of the square that is measured, as a share of the screen's height: 10 cm on a screen 30 cm high, wider than the
spot of 1 degree of a spectrometer at 1 m (1.7 cm)."""

SETTLE_S = 0.2
"""Seconds before each reading: ten times what an LCD takes from one grey to another."""

TRIES = 3
"""Readings that may fail at one level, before the measurement is given up."""

GUN = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1), "grey": (1, 1, 1)}


def open_photometer(device: str) -> Any:
    """Open a photometer.

    Parameters
    ----------
    device
        Name of its class and serial port, as in "LS100:/dev/ttyUSB0".

    Returns
    -------
    Any
        PsychoPy's object, whose `getLum()` gives the luminance in cd/m2.

    Raises
    ------
    InputError
        If the name is not known, its package is missing, or it does not answer.
    """
    name, _, port = device.partition(":")
    if name not in PHOTOMETERS or not port:
        raise InputError(
            f"--photometer is {device!r}, but must be one of {', '.join(PHOTOMETERS)} with its port, such as "
            "LS100:/dev/ttyUSB0."
        )
    module, package = PHOTOMETERS[name]
    if importlib.util.find_spec(module.partition(".")[0]) is None:
        raise InputError(f"--photometer {name} needs PsychoPy's package of it: pip install {package}.")
    remedy = "switch it on, set it to remote control, close other programs that use it, and see that the port is right"
    try:
        found = getattr(importlib.import_module(module), name)(port)
    except Exception as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"the photometer {device} did not start ({why}): {remedy}.") from error
    if not getattr(found, "OK", True):
        raise InputError(f"the photometer {device} does not answer: {remedy}.")
    return found


def measure(show: Callable[[tuple[int, int, int]], object], photometer: Any) -> dict[str, NDArray[np.float64]]:
    """Measure each gun and grey at each level.

    Parameters
    ----------
    show
        Shows a colour, given red, green and blue from 0 to 255, until it has settled.
    photometer
        Has `getLum()`, in cd/m2.

    Returns
    -------
    dict[str, NDArray[np.float64]]
        Luminance in cd/m2 by gun, at each of `LEVELS`.

    Raises
    ------
    InputError
        If a level cannot be read.

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
    """One reading; PsychoPy's classes say -1 or None where there was none."""
    given: object = None
    for _ in range(TRIES):
        try:
            given = photometer.getLum()
            value = float(given)  # type: ignore[arg-type]
        except Exception as error:
            given = error
            continue
        if math.isfinite(value) and value >= 0:
            return value
    raise InputError(
        f"the photometer gave no luminance at {where} ({given!r}), but must give a number of 0 or more: see that its "
        "range and its battery are right, and measure again."
    )


def main() -> int:
    """Print the table; exit code 2 with a sentence where it cannot be measured."""
    add = (parser := argparse.ArgumentParser(description=__doc__)).add_argument
    add("--screen", type=int, default=0)
    add("--windowed", action="store_true")
    add("device")
    options = parser.parse_args()
    try:
        module = import_screen()
        photometer = open_photometer(options.device)
        display = Display(module.screen_size(options.screen), ASSUMED_PITCH, ASSUMED_DISTANCE)
        screen = module.Screen(options.screen, WINDOW if options.windowed else None, display)
        try:
            measured = _measure_on(screen, photometer)
        finally:
            screen.close()
        try:
            fit_luminance(LEVELS, measured)
        except InputError as error:
            raise InputError(
                f"what the photometer measured is no screen's curve ({str(error).partition(':')[0]}): point it at the "
                "square, and measure again."
            ) from error
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    print("level", *GUNS, sep=",")
    for number, level in enumerate(LEVELS):
        print(f"{level:g}", *(f"{measured[gun][number]:.6g}" for gun in GUNS), sep=",")
    return 0


def _measure_on(screen: Screen, photometer: Any) -> dict[str, NDArray[np.float64]]:
    """Show white until ENTER is pressed, then each level; ESC stops."""
    side = round(SIDE * screen.size[1])
    head = screen.text("Point the photometer at the square, and focus it.", height=0.035, y=0.42)
    foot = screen.text(
        "ENTER: measure. It takes some minutes: darken the room, and touch nothing.", height=0.03, y=-0.42
    )

    def square(colour: tuple[int, int, int]) -> Any:
        return screen.picture(np.tile(np.array(colour, np.uint8), (side, side, 1)), recorded=False)

    def pressed() -> set[str]:
        keys = {press.key for press in screen.keys.events() if press.down}
        if "escape" in keys:
            raise InputError("the measurement was stopped by ESC: nothing was written.")
        return keys

    def show(colour: tuple[int, int, int]) -> None:
        shown, until = square(colour), screen.now() + SETTLE_S
        while screen.now() < until:
            shown.draw()
            screen.frame()
        pressed()

    white = square((255, 255, 255))
    screen.keys.clear()
    while not pressed() & {"return", "num_enter"}:
        for part in (white, head, foot):
            part.draw()
        screen.frame()
    return measure(show, photometer)


if __name__ == "__main__":
    sys.exit(main())
