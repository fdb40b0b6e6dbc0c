"""A picture with depth imaged through a lens or an eye: shared options, and the optics that they describe."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from focalgradient.cli.blur_eye import eye_of
from focalgradient.cli.options import DIAMETER, OPENEST, added, positive, read_depth_file
from focalgradient.cli.person import has_natural_pupil, is_person, person_options
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import printable
from focalgradient.plausibility import check_field, check_frame, check_pixel_pitch

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from focalgradient.display import Display
    from focalgradient.optics import Optics

__all__ = [
    "lens_or_eye_options",
    "optics_of",
    "pixel_angle_of",
    "pixel_options",
    "read_picture_and_depth",
    "refuse_slips",
]

Command = Callable[..., Any]

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
    """Add the options of the size of a pixel, for `pixel_angle_of`."""
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


def pixel_angle_of(options: dict[str, Any], width: int, display: Display | None) -> float:
    """Return the visual angle in rad of a pixel of a picture `width` pixels wide."""
    field, pitch = options["field"], options["pixel_pitch"]
    if field is not None and pitch is not None:
        raise InputError("--field and --pixel-pitch both give the size of a pixel: give one of them.")
    if field is not None:
        if not field < 180:
            raise InputError(f"--field is {field:g} degrees, but must be less than 180.")
        focal_length = options["focal_length"]
        check_field(math.radians(field), width, None if focal_length is None else 1e-3 * focal_length)
        return 2 * math.tan(math.radians(field) / 2) / width
    if pitch is not None:
        if options["focal_length"] is None:
            raise InputError(
                "--pixel-pitch of a camera's sensor requires a focal length: give --focal-length, or --field instead."
            )
        angle = float(1e-3 * pitch / options["focal_length"])
        check_pixel_pitch(1e-6 * pitch, angle)
        return angle
    if display is not None:
        return display.pixel_pitch / display.distance
    raise InputError(
        "the size of a pixel is unknown: give --field, or --pixel-pitch, or --screen-width and --distance."
    )


def read_picture_and_depth(
    picture: Path, depth: Path, options: dict[str, Any], optics: Sequence[Optics]
) -> tuple[NDArray[Any], NDArray[Any], float]:
    """Read a picture and its depth; return linear light, distances in m, and the visual angle of a pixel in rad."""
    from focalgradient.photographs import read_picture

    light = read_picture(picture, options["encoding"]).light
    angle = pixel_angle_of(options, light.shape[1], None)
    metres = read_depth_file(depth, options, angle).metres
    if metres.shape != light.shape[:2]:
        (h, w), (dh, dw) = light.shape[:2], metres.shape
        raise InputError(
            f"{printable(picture)} is {w} x {h} pixels but {printable(depth)} is {dw} x {dh}, but both must have the "
            "same "
            "size: scale or crop one of them."
        )
    refuse_slips(metres, optics, angle, options["depth_unit"])
    check_frame(angle, light.shape)
    return light, metres, angle


def refuse_slips(distances: Any, optics: Sequence[Optics], angle: float, unit: str) -> None:
    """Raise `InputError` for distances (m) implausible with the optics; only warn if the user stated their unit."""
    from focalgradient.plausibility import picture_slip

    ends = float(distances.min()), float(distances.max())
    for one in optics:
        slip = picture_slip(ends, one.aperture_diameter, one.focus_vergence, angle, max(distances.shape))
        if slip is None:
            continue
        source = click.get_current_context().get_parameter_source("depth_unit")
        if source is not click.core.ParameterSource.COMMANDLINE:
            raise InputError(f"{slip} If all is correct, give --depth-unit {unit}.")
        warnings.warn(FocalGradientWarning(slip), stacklevel=2)
