"""Options shared by several commands: optics of the views, limits of the search, display, depth files, workers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, TypeVar

import click

from focalgradient.cli.generate import options_named
from focalgradient.errors import InputError
from focalgradient.plausibility import given_as

if TYPE_CHECKING:
    from focalgradient.display import Display

__all__ = [
    "DEPTH_FILE",
    "DIAMETER",
    "GIVEN",
    "NEAREST",
    "OF_DEPTH",
    "OPENEST",
    "SCREEN",
    "SERVER",
    "STORE",
    "UNITS",
    "added",
    "depth_file_options",
    "display_of",
    "display_options",
    "focal_length_option",
    "gamma_of",
    "limit_options",
    "options_named",
    "picture_encoding_option",
    "positive",
    "screen_size",
    "shared_options",
    "shared_work",
]

Command = TypeVar("Command", bound=Callable[..., Any])


OF_DEPTH = {"scale": "--depth-scale", "baseline": "--baseline", "offset": "--disparity-offset", "unit": "--depth-unit"}
"""Parameters of `focalgradient.photographs.read_distances`, and the corresponding options."""

DEPTH_FILE = ("depth_unit", "depth_scale", "baseline", "disparity_offset")
"""Options added by `depth_file_options`."""

GIVEN = {
    "focal_length": ("--focal-length", "mm"),
    "f_number": ("--f-number", ""),
    "focus_distance": ("--focus-distance", "m"),
    "pixel_pitch": ("--pixel-pitch", "um"),
    "pupil_diameter": ("--pupil", "mm"),
    "near": ("--near", "m"),
    "far": ("--far", "m"),
}
"""Options of optics with their units, by the library's parameter: for `focalgradient.plausibility.given_as`."""

SCREEN = {
    "pixel_pitch": ("--pixel-pitch", "um"),
    "distance": ("--distance", "m"),
    "width": ("--screen-width", "cm"),
}
"""Options of a display with their units, by the library's parameter."""

SERVER = ("the server", "web", "starlette", "uvicorn")
STORE = ("the store", "store", "psycopg")
"""Arguments of `check_installed`: purpose, extra and modules."""

SESSION_S = 0.04
"""Time of checking a session of about 400 trials, in s on one core."""

LEAST, MOST = 1e-6, 1e9
"""Default range of a physical quantity, within which derived quantities stay within double precision."""

NEAREST = 1e-3
"""Minimum distance in m: below it, a lens blurs by more than any picture's width."""

OPENEST = 0.1
"""Minimum f-number; no lens in air is below 0.5."""

DIAMETER = ": if it is the aperture's diameter, give focal length / diameter"
"""Hint on a probable mistake, added to the message on a smaller number."""

UNITS = ": check its unit"
"""Hint on a probable mistake, added to the message on a number out of range."""


def positive(
    unit: str = "", infinite: bool = False, least: float = LEAST, most: float = MOST, hint: str = ""
) -> Callable[[click.Context, click.Parameter, float | tuple[float, ...] | None], Any]:
    """Return an option's callback that raises `InputError` unless a number is positive and from `least` to `most`."""

    def check(_: click.Context, option: click.Parameter, given: float | tuple[float, ...] | None) -> Any:
        for value in given if isinstance(given, tuple) else (given,):
            if value is None:
                continue
            if not (value > 0 and (infinite or math.isfinite(value))):
                raise InputError(f"{option.opts[0]} is {value:g}, but must be a positive number{unit}.")
            if not least <= value <= most and value != math.inf:
                raise InputError(
                    f"{option.opts[0]} is {value:g}, but must be a number{unit} from {least:g} to {most:g}{hint}."
                )
        return given

    return check


def screen_size(screen: str) -> tuple[int, int]:
    """Parse a display's size in pixels, such as 1920x1080."""
    try:
        width, height = (int(side) for side in screen.lower().split("x"))
    except ValueError as error:
        raise InputError(f"--screen is {screen}, but must be a width and height in pixels, like 1920x1080.") from error
    return width, height


def gamma_of(word: str) -> Any:
    """Parse a display's gamma: ``"sRGB"``, a number, or three such as ``"2.1,2.2,2.4"`` for red, green and blue."""
    if word.lower() == "srgb":
        return "sRGB"
    expected = "must be a number between 1 and 4, three of them such as 2.1,2.2,2.4, or sRGB"
    try:
        guns = tuple(float(gun) for gun in word.split(","))
    except ValueError as error:
        raise InputError(f"--gamma is {word}, but {expected}.") from error
    if len(guns) not in (1, 3):
        raise InputError(f"--gamma is {word}, but {expected}.")
    return guns[0] if len(guns) == 1 else guns


def display_options(command: Command) -> Command:
    """Add the options of a display, from which `display_of` makes a `Display`."""
    return added(command, _DISPLAY)


def display_of(
    screen: str,
    pixel_pitch: float | None,
    screen_width: float | None,
    distance: float,
    gamma: str,
    white: float,
    dither: bool,
) -> Display:
    """Return the display given by the options of `display_options`."""
    from focalgradient.display import Display

    size, curve = screen_size(screen), gamma_of(gamma)
    if pixel_pitch is not None and screen_width is not None:
        raise InputError("--pixel-pitch and --screen-width both determine the size of a pixel: give one of them.")
    others: dict[str, Any] = {"distance": distance, "gamma": curve, "white": white, "dither": dither}
    with given_as(SCREEN):
        if screen_width is not None:
            return Display.of_width(screen_width * 1e-2, size, **others)
        return Display(size, (pixel_pitch or 276.7) * 1e-6, **others)


def depth_file_options(command: Command) -> Command:
    """Add the options that interpret a depth file."""
    return added(command, _DEPTH_FILE)


def limit_options(command: Command) -> Command:
    """Add the limits of the depth search: ``near``, ``far``."""
    return added(command, _LIMITS)


def focal_length_option(command: Command) -> Command:
    """Add ``focal_length``, in mm."""
    return _FOCAL_LENGTH(command)


def picture_encoding_option(command: Command) -> Command:
    """Add ``encoding``, for pictures read by `photographs.read_picture`."""
    return _PICTURE_ENCODING(command)


def added(command: Command, options: Sequence[Callable[[Any], Any]]) -> Command:
    """Add options to a command, in order."""
    for option in reversed(options):
        command = option(command)
    return command


def shared_options(command: Command) -> Command:
    """Add the options for parallel work: ``workers`` (None: chosen by the command) and ``scheduler``."""
    return added(command, _SHARED)


def shared_work(
    workers: int | None, scheduler: str | None, seconds: float = 0.0
) -> AbstractContextManager[Executor | None]:
    """Return a context with the executor of the options of `shared_options`.

    `seconds` is the approximate time on one core: without --workers, longer work is run in parallel.
    """
    from focalgradient.parallel import shared, workers_for

    if workers is not None and scheduler is not None:
        raise InputError("--workers and --scheduler both set where the work is done: give one of them.")
    return shared(workers or workers_for(seconds), scheduler)


_DEPTH_FILE: list[Callable[[Any], Any]] = [
    click.option(
        "--depth-unit",
        type=click.Choice(["m", "mm", "dioptres", "disparity"]),
        default="m",
        show_default=True,
        help="Unit of the depth values.",
    ),
    click.option(
        "--depth-scale",
        type=float,
        metavar="S",
        callback=positive(),
        help="Units per step of the depth values; required for integer files.",
    ),
    click.option(
        "--baseline",
        type=float,
        metavar="M",
        callback=positive(" of metres"),
        help="Baseline of the stereo pair in metres, for disparity in pixels.",
    ),
    click.option(
        "--disparity-offset",
        type=float,
        default=0.0,
        metavar="PX",
        help="Offset added to each disparity, in pixels.",
    ),
]

_DISPLAY: list[Callable[[Any], Any]] = [
    click.option(
        "--screen",
        default="1920x1080",
        show_default=True,
        metavar="WxH",
        help="Width and height of the display in pixels.",
    ),
    click.option(
        "--pixel-pitch",
        type=float,
        metavar="UM",
        callback=positive(" of micrometres"),
        help="Pixel pitch of the display, in micrometres.  [default: 276.7]",
    ),
    click.option(
        "--screen-width",
        type=float,
        metavar="CM",
        callback=positive(" of centimetres"),
        help="Instead of --pixel-pitch: width of the display's picture, in centimetres.",
    ),
    click.option(
        "--distance",
        type=float,
        default=0.57,
        show_default=True,
        metavar="M",
        callback=positive(" of metres"),
        help="Distance from the eye to the display, in metres.",
    ),
    click.option("--gamma", default="sRGB", show_default=True, metavar="G", help="Gamma of the display, or sRGB."),
    click.option(
        "--white",
        type=float,
        default=100.0,
        show_default=True,
        metavar="CD_M2",
        callback=positive(" of cd/m^2"),
        help="Luminance of the display's white, in cd/m^2.",
    ),
    click.option("--dither", is_flag=True, help="Dither 8-bit values randomly, so that mean luminance is exact."),
]

_SHARED: list[Callable[[Any], Any]] = [
    click.option(
        "--workers",
        type=click.IntRange(1, 256),
        metavar="N",
        help="Number of processes on this machine, without influence on the results.  [default: one per core for "
        "long work, "
        "otherwise one]",
    ),
    click.option(
        "--scheduler",
        metavar="ADDRESS",
        help="Address of a Dask scheduler in a trusted network, whose workers do the work instead.",
    ),
]

_PICTURE_ENCODING: Callable[[Any], Any] = click.option(
    "--encoding",
    type=click.Choice(["srgb", "linear"]),
    help="Encoding of the picture.  [default: as stated in the file; else srgb for 8 bits, linear for more]",
)

_LIMITS: list[Callable[[Any], Any]] = [
    click.option(
        "--near",
        type=float,
        metavar="M",
        callback=positive(" of metres", least=NEAREST),
        help="Nearest distance of the search, in metres.  [default: where blur is 16 pixels]",
    ),
    click.option(
        "--far",
        type=float,
        metavar="M",
        callback=positive(" of metres", infinite=True, least=NEAREST),
        help="Farthest distance of the search, in metres.  [default: where blur is 16 pixels]",
    ),
]

_FOCAL_LENGTH: Callable[[Any], Any] = click.option(
    "--focal-length",
    type=float,
    metavar="MM",
    callback=positive(" of millimetres"),
    help="* Focal length, in millimetres.",
)
