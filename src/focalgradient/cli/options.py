"""Options that several commands share: the optics of the views, and the limits of the search."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from focalgradient.errors import InputError, check_tolerance
from focalgradient.plausibility import given_as

if TYPE_CHECKING:
    from focalgradient.display import Display
    from focalgradient.photographs import Distances

PLANES = ("entrance_pupil", "sensor", "lens_front")
"""Planes that distances count from: `focalgradient.photographs.planes`, which is not loaded for help."""

__all__ = [
    "DEPTH_FILE",
    "DIAMETER",
    "GIVEN",
    "NEAREST",
    "OPENEST",
    "SCREEN",
    "SERVER",
    "STORE",
    "added",
    "depth_file_options",
    "display_of",
    "display_options",
    "focal_length_option",
    "gamma_of",
    "limit_options",
    "optics_options",
    "options_named",
    "picture_encoding_option",
    "positive",
    "read_depth_file",
    "screen_size",
    "shared_options",
    "shared_work",
    "task_file_option",
]

Command = TypeVar("Command", bound=Callable[..., Any])


OF_DEPTH = {"scale": "--depth-scale", "baseline": "--baseline", "offset": "--disparity-offset", "unit": "--depth-unit"}
"""Parameters of `focalgradient.photographs.read_distances` and the options that give them."""

DEPTH_FILE = ("depth_unit", "depth_scale", "baseline", "disparity_offset")
"""What `depth_file_options` adds."""

GIVEN = {
    "focal_length": ("--focal-length", "mm"),
    "f_number": ("--f-number", ""),
    "focus_distance": ("--focus-distance", "m"),
    "pixel_pitch": ("--pixel-pitch", "um"),
    "pupil_diameter": ("--pupil", "mm"),
    "near": ("--near", "m"),
    "far": ("--far", "m"),
}
"""Options of optics, with their units, by the library's parameter: for `focalgradient.plausibility.given_as`."""

SCREEN = {
    "pixel_pitch": ("--pixel-pitch", "um"),
    "distance": ("--distance", "m"),
    "width": ("--screen-width", "cm"),
}
"""The same for a display."""

SERVER = ("the server", "web", "starlette", "uvicorn")
STORE = ("the store", "store", "psycopg")
"""What needs which extra for which modules: see `check_installed`."""

SESSION_S = 0.04
"""Seconds that the check of a session of some 400 trials takes, on one core."""

LEAST, MOST = 1e-6, 1e9
"""Range of a physical quantity, unless an option states another: what follows from it stays within double precision."""

NEAREST = 1e-3
"""Metres: at less, a lens blurs by more than any picture is wide."""

OPENEST = 0.1
"""Smallest f-number; no lens in air has less than 0.5."""

DIAMETER = ": if it is an aperture's diameter, give focal length / diameter"
"""What a smaller number may be."""

BODY_MM = 1.0, 1e4
"""Millimetres from the sensor to a part of a lens: of a phone 3 to 5, of the longest lens 2 m."""

UNITS = ": look at its unit"
"""What a number out of range may be."""


def positive(
    unit: str = "", infinite: bool = False, least: float = LEAST, most: float = MOST, hint: str = ""
) -> Callable[[click.Context, click.Parameter, float | tuple[float, ...] | None], Any]:
    """Refuse, as an option's callback, what is not a positive number of some `unit`, or beyond what can be meant."""

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


def tolerance(_: click.Context, option: click.Parameter, given: float | None) -> float | None:
    """Refuse, as an option's callback, values that cannot be a relative standard deviation."""
    if given is not None:
        check_tolerance(option.opts[0], given)
    return given


def screen_size(screen: str) -> tuple[int, int]:
    """Width and height of a display in pixels, of a word like 1920x1080."""
    try:
        width, height = (int(side) for side in screen.lower().split("x"))
    except ValueError as error:
        raise InputError(f"--screen is {screen}, but must be a width and height in pixels, like 1920x1080.") from error
    return width, height


def gamma_of(word: str) -> Any:
    """A display's gamma: ``"sRGB"``, a number, or three, as ``"2.1,2.2,2.4"``, of red, green and blue."""
    if word.lower() == "srgb":
        return "sRGB"
    expected = "must be a number between 1 and 4, three of them as 2.1,2.2,2.4, or sRGB"
    try:
        guns = tuple(float(gun) for gun in word.split(","))
    except ValueError as error:
        raise InputError(f"--gamma is {word}, but {expected}.") from error
    if len(guns) not in (1, 3):
        raise InputError(f"--gamma is {word}, but {expected}.")
    return guns[0] if len(guns) == 1 else guns


def display_options(command: Command) -> Command:
    """Add what is known of the display, of which `display_of` makes a `Display`."""
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
    """Give the display of the options that `display_options` added."""
    from focalgradient.display import Display

    size, curve = screen_size(screen), gamma_of(gamma)
    if pixel_pitch is not None and screen_width is not None:
        raise InputError("--pixel-pitch and --screen-width say the same thing in two ways: give one of them.")
    others: dict[str, Any] = {"distance": distance, "gamma": curve, "white": white, "dither": dither}
    with given_as(SCREEN):
        if screen_width is not None:
            return Display.of_width(screen_width * 1e-2, size, **others)
        return Display(size, (pixel_pitch or 276.7) * 1e-6, **others)


def depth_file_options(command: Command) -> Command:
    """Add what the values of a depth file are, as `read_depth_file` takes them."""
    return added(command, _DEPTH_FILE)


def read_depth_file(path: Path, options: Mapping[str, Any], pixel_angle: float) -> Distances:
    """Read a depth file by the options that `depth_file_options` added; a pixel subtends `pixel_angle` radians."""
    from focalgradient.photographs import read_distances

    with options_named(OF_DEPTH):
        return read_distances(
            path,
            options["depth_unit"],
            scale=options["depth_scale"],
            baseline=options["baseline"],
            pixel_angle=pixel_angle,
            offset=options["disparity_offset"],
        )


def limit_options(command: Command) -> Command:
    """Add where depth is sought: ``near``, ``far``."""
    return added(command, _LIMITS)


def focal_length_option(command: Command) -> Command:
    """Add ``focal_length``, in millimetres, of the optics."""
    return _FOCAL_LENGTH(command)


def picture_encoding_option(command: Command) -> Command:
    """Add ``encoding``, of pictures that are read by `photographs.read_picture`."""
    return _PICTURE_ENCODING(command)


def optics_options(command: Command) -> Command:
    """Add the optics where no settings file gives them, as `photographs.from_exif` takes them."""
    return added(command, _OPTICS)


def added(command: Command, options: Sequence[Callable[[Any], Any]]) -> Command:
    """Add options to a command, in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def _load(_: click.Context, __: click.Parameter, files: tuple[Path, ...]) -> None:
    """Load the files of tasks; before other options, so that these may name them."""
    from focalgradient.tasks.registry import load_file

    for file in files:
        load_file(file)


_TASK_FILE: list[Callable[[Any], Any]] = [
    click.option(
        "--task-file",
        multiple=True,
        type=click.Path(path_type=Path),
        metavar="FILE",
        is_eager=True,
        expose_value=False,
        callback=_load,
        help="Python file of a task of your own, that data or design are of. Repeatable.",
    )
]


def task_file_option(command: Command) -> Command:
    """Add ``--task-file``, by which a command knows tasks of one's own."""
    return added(command, _TASK_FILE)


def shared_options(command: Command) -> Command:
    """Add how the work is shared: ``workers``, None where the command chooses, and ``scheduler``."""
    return added(command, _SHARED)


def shared_work(
    workers: int | None, scheduler: str | None, seconds: float = 0.0
) -> AbstractContextManager[Executor | None]:
    """Give what shares the work, of the options that `shared_options` added.

    `seconds` is about what the work takes on one core: without --workers it is shared where that pays.
    """
    from focalgradient.parallel import shared, workers_for

    if workers is not None and scheduler is not None:
        raise InputError("--workers and --scheduler are two ways to share the work: give one of them.")
    return shared(workers or workers_for(seconds), scheduler)


_DEPTH_FILE: list[Callable[[Any], Any]] = [
    click.option(
        "--depth-unit",
        type=click.Choice(["m", "mm", "dioptres", "disparity"]),
        default="m",
        show_default=True,
        help="What the values of the depth are.",
    ),
    click.option(
        "--depth-scale",
        type=float,
        metavar="S",
        callback=positive(),
        help="Units in a step of the depth; needed where it is a file of integers.",
    ),
    click.option(
        "--baseline",
        type=float,
        metavar="M",
        callback=positive(" of metres"),
        help="Of a stereo pair, in metres, for disparity in pixels.",
    ),
    click.option(
        "--disparity-offset",
        type=float,
        default=0.0,
        metavar="PX",
        help="Added to each disparity.",
    ),
]

_DISPLAY: list[Callable[[Any], Any]] = [
    click.option(
        "--screen",
        default="1920x1080",
        show_default=True,
        metavar="WxH",
        help="The display's width and height in pixels.",
    ),
    click.option(
        "--pixel-pitch",
        type=float,
        metavar="UM",
        callback=positive(" of micrometres"),
        help="Side of its pixels, in micrometres.  [default: 276.7]",
    ),
    click.option(
        "--screen-width",
        type=float,
        metavar="CM",
        callback=positive(" of centimetres"),
        help="Instead of --pixel-pitch: width of its picture, in centimetres.",
    ),
    click.option(
        "--distance",
        type=float,
        default=0.57,
        show_default=True,
        metavar="M",
        callback=positive(" of metres"),
        help="From the eye to the display, in metres.",
    ),
    click.option(
        "--gamma", default="sRGB", show_default=True, metavar="G", help="Exponent of light over value, or sRGB."
    ),
    click.option(
        "--white",
        type=float,
        default=100.0,
        show_default=True,
        metavar="CD_M2",
        callback=positive(" of cd/m^2"),
        help="Luminance of its white, in cd/m^2.",
    ),
    click.option("--dither", is_flag=True, help="Mix 8-bit values at random, so that light is right on average."),
]

_SHARED: list[Callable[[Any], Any]] = [
    click.option(
        "--workers",
        type=click.IntRange(1, 256),
        metavar="N",
        help="Processes on this machine; the results do not depend on it.  [default: one for each core for long work, "
        "else none beside this]",
    ),
    click.option(
        "--scheduler",
        metavar="ADDRESS",
        help="Of a Dask scheduler in a network that you trust, whose workers do the work instead.",
    ),
]

_PICTURE_ENCODING: Callable[[Any], Any] = click.option(
    "--encoding",
    type=click.Choice(["srgb", "linear"]),
    help="Of the picture.  [default: as the file says; else srgb for 8 bits, linear for more]",
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

_OPTICS: list[Callable[[Any], Any]] = [
    _FOCAL_LENGTH,
    click.option(
        "--f-number",
        "f_numbers",
        type=float,
        multiple=True,
        metavar="N",
        callback=positive(infinite=True, least=OPENEST, hint=DIAMETER),
        help="* f-number: once for all photographs, or once for each, in order.",
    ),
    click.option(
        "--focus-distance",
        "focus_distances",
        type=float,
        multiple=True,
        metavar="M",
        callback=positive(" of metres", infinite=True, least=NEAREST),
        help="* Distance of the plane in focus, in metres: once for all photographs, or once for each, in order.",
    ),
    click.option(
        "--pixel-pitch",
        type=float,
        metavar="UM",
        callback=positive(" of micrometres"),
        help="* Size of a pixel, in micrometres.",
    ),
    click.option(
        "--encoding",
        type=click.Choice(["linear", "srgb"]),
        help="* How pixel values encode light.  [default: as the files say; else srgb for 8 bits, linear for more]",
    ),
    click.option("--telecentric", is_flag=True, help="* Magnification does not change with focus (image side)."),
    click.option(
        "--distances-from",
        type=click.Choice(PLANES),
        help="* Plane that distances count from.  [default: entrance_pupil, or as calibrated]",
    ),
    click.option(
        "--focus-from",
        type=click.Choice(PLANES),
        help="* Plane that focus distances count from: a lens's scale counts from the sensor.  [default: as others]",
    ),
    click.option(
        "--focus-tolerance",
        type=float,
        metavar="SHARE",
        callback=tolerance,
        help="* Standard deviation of the focus distances, as a share; it widens what the whole frame shares in error."
        "  [default: 0.1]",
    ),
    click.option(
        "--f-number-tolerance",
        type=float,
        metavar="SHARE",
        callback=tolerance,
        help="* The same of a factor of all f-numbers.  [default: 0.05]",
    ),
    click.option(
        "--sensor-to-pupil",
        type=float,
        metavar="MM",
        callback=positive(" of millimetres", least=BODY_MM[0], most=BODY_MM[1], hint=UNITS),
        help="* From the sensor to the entrance pupil, in millimetres.  [default: as of a thin lens]",
    ),
    click.option(
        "--sensor-to-front",
        type=float,
        metavar="MM",
        callback=positive(" of millimetres", least=BODY_MM[0], most=BODY_MM[1], hint=UNITS),
        help="* From the sensor to the front of the lens, in millimetres.",
    ),
]


_ENTRY = re.compile(r'\b(\w+)=\{"([^"]*)": "([^"]*)"\}')
"""An entry of a parameter that is a mapping, as the library writes it: columns={"rating": "NAME"}."""


@contextmanager
def options_named(names: Mapping[str, str]) -> Iterator[None]:
    """Put options in the place of the library's parameters, `names`, where it refuses what was given.

    An entry of a mapping, columns={"rating": "NAME"}, becomes --columns rating=NAME.
    """
    try:
        yield
    except InputError as error:
        words = _ENTRY.sub(r"--\1 \2=\3", str(error))
        if names:
            words = re.sub(r"\b(" + "|".join(names) + r")\b", lambda found: names[found.group()], words)
        raise InputError(words) from error


trials_option = click.option(
    "--trials",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="List of trials instead of the design's own (CSV or XLSX), as 'focalgradient trials' writes it.",
)
"""Adds ``trials``, a table for `with_trials`."""


def with_trials(design: Any, trials: Path | None) -> Any:
    """Return a design with the trials of a table in the place of its own, where one is given."""
    from focalgradient.design.given_list import read_trials

    return design if trials is None else design.with_trials(str(trials), read_trials(trials))
