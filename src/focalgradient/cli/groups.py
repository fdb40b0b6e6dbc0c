"""Groups of options shared by several commands, from functions and classes of the library."""

from __future__ import annotations

from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.generate import Given, Made
from focalgradient.errors import InputError
from focalgradient.parallel import shared, workers_for
from focalgradient.plausibility import given_as
from focalgradient.quantities import CENTIMETRES, LUMINANCE, METRES, MICROMETRES

__all__ = [
    "GIVEN",
    "SERVER",
    "SESSION_S",
    "STORE",
    "DepthFile",
    "Limits",
    "Optics",
    "Screen",
    "Work",
    "Workers",
]

SERVER = ("the server", "web", "starlette", "uvicorn")
STORE = ("the store", "store", "psycopg")
"""Arguments of `check_installed`: purpose, extra and modules."""

SESSION_S = 0.04
"""Time of checking a session of about 400 trials, in s on one core."""

GIVEN = {
    "focal_length": ("--focal-length", "mm"),
    "f_number": ("--f-number", ""),
    "focus_distance": ("--focus-distance", "m"),
    "pixel_pitch": ("--pixel-pitch", "um"),
    "pixel_pitch_um": ("--pixel-pitch", ""),
    "pupil_diameter": ("--pupil", "mm"),
    "near": ("--near", "m"),
    "far": ("--far", "m"),
}
"""Options of optics with their units, by the library's parameter: for `focalgradient.plausibility.given_as`."""

SCREEN = {"pixel_pitch": ("--pixel-pitch", "um"), "distance": ("--distance", "m"), "width": ("--screen-width", "cm")}
"""Options of a display with their units, by the library's parameter."""

OF_DEPTH = {"unit": "--depth-unit", "scale": "--depth-scale", "offset": "--disparity-offset"}
"""Options of a depth file whose names differ from the parameters of `focalgradient.photographs.read_distances`."""


@dataclass(frozen=True)
class Work:
    """Where the work is done.

    Parameters
    ----------
    workers
        Number of processes on this machine, without influence on the results.  [default: one per core for long work,
        otherwise one]
    scheduler
        Address of a Dask scheduler in a trusted network, whose workers do the work instead.
    """

    workers: Annotated[int | None, click.IntRange(1, 256), "N"] = None
    scheduler: Annotated[str | None, "ADDRESS"] = None

    def shared(self, seconds: float = 0.0) -> AbstractContextManager[Executor | None]:
        """Return a context with the executor.

        `seconds` is the approximate time on one core: without --workers, longer work is run in parallel.
        """
        if self.workers is not None and self.scheduler is not None:
            raise InputError("--workers and --scheduler both set where the work is done: give one of them.")
        return shared(self.workers or workers_for(seconds), self.scheduler)


def screen_size(option: str, given: str) -> tuple[int, int]:
    """Parse a display's size in pixels, such as 1920x1080."""
    try:
        width, height = (int(side) for side in given.lower().split("x"))
    except ValueError as error:
        raise InputError(f"{option} is {given}, but must be a width and height in pixels, like 1920x1080.") from error
    return width, height


def gamma_of(option: str, given: str) -> Any:
    """Parse a display's gamma: ``"sRGB"``, a number, or three such as ``"2.1,2.2,2.4"`` for red, green and blue."""
    if given.lower() == "srgb":
        return "sRGB"
    expected = "must be a number between 1 and 4, three of them such as 2.1,2.2,2.4, or sRGB"
    try:
        guns = tuple(float(gun) for gun in given.split(","))
    except ValueError as error:
        raise InputError(f"{option} is {given}, but {expected}.") from error
    if len(guns) not in (1, 3):
        raise InputError(f"{option} is {given}, but {expected}.")
    return guns[0] if len(guns) == 1 else guns


def display_of(
    *,
    screen: Annotated[Any, screen_size, "WxH"] = "1920x1080",
    pixel_pitch: Annotated[float | None, MICROMETRES.si] = None,
    screen_width: Annotated[float | None, CENTIMETRES.si] = None,
    distance: Annotated[float, METRES] = 0.57,
    gamma: Annotated[Any, gamma_of, "G"] = "sRGB",
    white: Annotated[float, LUMINANCE] = 100.0,
    dither: bool = False,
) -> fg.display.Display:
    """Return a display.

    Parameters
    ----------
    screen
        Width and height of the display in pixels.
    pixel_pitch
        Pixel pitch of the display, in micrometres.  [default: 276.7]
    screen_width
        Instead of --pixel-pitch: width of the display's picture, in centimetres.
    distance
        Distance from the eye to the display, in metres.
    gamma
        Gamma of the display, or sRGB.
    white
        Luminance of the display's white, in cd/m^2.
    dither
        Dither 8-bit values randomly, so that mean luminance is exact.
    """
    if pixel_pitch is not None and screen_width is not None:
        raise InputError("--pixel-pitch and --screen-width both determine the size of a pixel: give one of them.")
    others: dict[str, Any] = {"distance": distance, "gamma": gamma, "white": white, "dither": dither}
    with given_as(SCREEN):
        if screen_width is not None:
            return fg.display.Display.of_width(screen_width, screen, **others)
        return fg.display.Display(screen, pixel_pitch or 276.7 * 1e-6, **others)


Screen = Annotated[Any, Made(display_of)]
"""A `focalgradient.display.Display`."""

Workers = Annotated[Work, Made(Work)]
"""Where the work is done."""

DepthFile = Annotated[
    dict[str, Any],
    Given("focalgradient.photographs:read_distances", OF_DEPTH, only=("unit", "scale", "baseline", "offset")),
]
"""How a depth file is read, for `focalgradient.photographs.read_distances`."""

Limits = Annotated[dict[str, Any], Given("focalgradient:recover_depth", only=("near", "far"))]
"""Limits of the depth search, in metres."""

Optics = Annotated[
    dict[str, Any],
    Given(
        "focalgradient.photographs:from_exif",
        {
            "focal_length_mm": "--focal-length",
            "f_numbers": "--f-number",
            "focus_distances_m": "--focus-distance",
            "pixel_pitch_um": "--pixel-pitch",
            "sensor_to_pupil_mm": "--sensor-to-pupil",
            "sensor_to_front_mm": "--sensor-to-front",
        },
        only=(
            *("focal_length_mm", "f_numbers", "focus_distances_m", "pixel_pitch_um", "encoding", "telecentric"),
            *("distances_from", "focus_from", "focus_tolerance", "f_number_tolerance", "field_tolerance"),
            *("sensor_to_pupil_mm", "sensor_to_front_mm"),
        ),
        prefix="* ",
    ),
]
"""Optics of views without a settings file."""
