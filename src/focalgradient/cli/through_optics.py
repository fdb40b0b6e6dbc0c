"""A picture with depth imaged through a lens or an eye: shared options, and the optics that they describe."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from focalgradient.cli.blur_eye import eye_of
from focalgradient.cli.options import DIAMETER, GIVEN, OF_DEPTH, OPENEST, added, positive
from focalgradient.cli.person import has_natural_pupil, is_person, person_options
from focalgradient.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from focalgradient.optics import Optics
    from focalgradient.photographs import DepthPicture

__all__ = ["NAMED", "lens_or_eye_options", "optics_of", "pixel_options", "read_picture_and_depth"]

Command = Callable[..., Any]

NAMED = {
    **GIVEN,
    **{name: (option, "") for name, option in OF_DEPTH.items()},
    "focus_distance": ("--focus", "m"),
    "field": ("--field", ""),
    "otherwise": ("--screen-width and --distance", ""),
    "white": ("--white", ""),
    "picture": ("PICTURE", ""),
    "depth": ("DEPTH", ""),
}
"""Options with their units, by the library's parameter: for `focalgradient.plausibility.given_as`."""

_LENS_OR_EYE = [
    click.option(
        "--f-number",
        type=float,
        metavar="N",
        callback=positive(least=OPENEST, hint=DIAMETER),
        help="f-number of a camera's lens.",
    ),
    click.option(
        "--focal-length",
        type=float,
        metavar="MM",
        callback=positive(" of millimetres"),
        help="Focal length of a camera's lens, in millimetres.",
    ),
    click.option(
        "--pupil",
        type=float,
        metavar="MM",
        callback=positive(" of millimetres"),
        help="Pupil diameter of an eye, in millimetres.",
    ),
    click.option(
        "--eye",
        "eye_file",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help='Eye (TOML): pupil_mm, and aberrations = [[n, m, um], ...] or zernike = "TABLE.csv", ...',
    ),
]
"""Options of a lens or an eye."""

_PIXEL = [
    click.option(
        "--field", type=float, metavar="DEG", callback=positive(" of degrees"), help="Width of the picture, in degrees."
    ),
    click.option(
        "--pixel-pitch",
        type=float,
        metavar="UM",
        callback=positive(" of micrometres"),
        help="Pixel pitch of the camera's sensor, in micrometres.",
    ),
]
"""Options of the size of a pixel."""


def lens_or_eye_options(command: Command) -> Command:
    """Add the options of a lens or an eye, from which `optics_of` makes optics."""
    return added(person_options(command), _LENS_OR_EYE)


def pixel_options(command: Command) -> Command:
    """Add the options of the size of a pixel, for `read_picture_and_depth`."""
    return added(command, _PIXEL)


def optics_of(options: dict[str, Any], vergence: float) -> Optics:
    """Return the lens or eye of the options, focused at a vergence (D)."""
    from focalgradient.optics import Lens

    camera = options["f_number"] is not None or options["focal_length"] is not None
    pupil = options["pupil"] is not None or has_natural_pupil(options)
    if is_person(options) and (camera or options["eye_file"] is not None or not pupil):
        raise InputError(
            "--refraction, --correction, --age, --luminance, --aberrations and --zones describe an eye: give its "
            "--pupil, or --luminance, --refraction or --age for its natural pupil, and no other optics."
        )
    if camera + pupil + (options["eye_file"] is not None) != 1:
        raise InputError(
            "the optics must be --f-number and --focal-length, or --pupil (or --refraction, --age), or --eye: give "
            "exactly one of the three."
        )
    if not camera:
        return eye_of(options, vergence)
    if options["f_number"] is None or options["focal_length"] is None:
        raise InputError("a lens needs both --f-number and --focal-length: add the missing one.")
    return Lens(1e-3 * options["focal_length"], options["f_number"], 1 / vergence if vergence > 0 else math.inf)


def read_picture_and_depth(
    picture: Path,
    depth: Path,
    options: dict[str, Any],
    optics: Sequence[Optics],
    pixel_angle: float | None = None,
    frame: NDArray[Any] | None = None,
) -> DepthPicture:
    """Read a picture and its depth with the options of a command, whose messages `NAMED` names."""
    from focalgradient.photographs import read_depth_picture

    source = click.get_current_context().get_parameter_source("depth_unit")
    lengths = {"pixel_pitch": 1e-6, "focal_length": 1e-3, "field": math.radians(1)}
    return read_depth_picture(
        picture,
        depth,
        **{name: None if options.get(name) is None else options[name] * unit for name, unit in lengths.items()},
        pixel_angle=pixel_angle,
        encoding=options["encoding"],
        unit=options["depth_unit"] if source is click.core.ParameterSource.COMMANDLINE else None,
        scale=options["depth_scale"],
        baseline=options["baseline"],
        offset=options["disparity_offset"],
        optics=optics,
        frame=frame,
    )
