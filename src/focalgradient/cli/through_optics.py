"""A picture with depth imaged through a lens or an eye: shared options, and what they describe."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import click

import focalgradient as fg
from focalgradient.cli.generate import File, Given
from focalgradient.cli.groups import OF_DEPTH, DepthFile
from focalgradient.cli.person import PERSON, eye_notes, eye_of, eye_state
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.optics import Lens, Optics
from focalgradient.quantities import APERTURE_RATIO, DEGREES, METRES, MICROMETRES, MILLIMETRES

if TYPE_CHECKING:
    from focalgradient.photographs import DepthPicture

__all__ = ["DISTANCE", "NAMED", "LensOrEye", "Read", "Stored", "Through", "read_picture_and_depth", "settings_given"]

DISTANCE = replace(METRES, words="metres, or inf", infinite=True)
"""Distance in a picture, which may be infinite."""

NAMED = {
    **{name: (option, "") for name, option in OF_DEPTH.items()},
    **{name: (f"--{name}", "") for name in ("baseline", "chromatic", "field", "focus", "illuminant", "psf")},
    **{name: (f"--{name}", "") for name in ("wavelengths", "white")},
    "f_number": ("--f-number", ""),
    "focal_length": ("--focal-length", "mm"),
    "focus_distance": ("--focus", "m"),
    "pixel_pitch": ("--pixel-pitch", "um"),
    "pupil_diameter": ("--pupil", "mm"),
    "pixel_angle": ("--screen-width and --distance", ""),
    "screen": ("--to-show", ""),
    "lens": ("--f-number", ""),
    "eye": ("--pupil or --eye", ""),
    "picture": ("PICTURE", ""),
    "depth": ("DEPTH", ""),
}
"""Options with their units, by the library's parameter: for `focalgradient.plausibility.given_as`."""


@dataclass(frozen=True)
class Through:
    """A lens or an eye.

    Parameters
    ----------
    f_number
        f-number of a camera's lens.
    focal_length
        Focal length of a camera's lens, in millimetres.
    pupil
        Pupil diameter of an eye, in millimetres.
    eye_file
        Eye (TOML): pupil_mm, and aberrations = [[n, m, um], ...] or zernike = "TABLE.csv", ...
    """

    f_number: Annotated[float | None, replace(APERTURE_RATIO, infinite=False), "N"] = None
    focal_length: Annotated[float | None, MILLIMETRES] = None
    pupil: Annotated[float | None, MILLIMETRES] = None
    eye_file: Annotated[File | None, "--eye"] = None
    person: Any = None

    @property
    def is_lens(self) -> bool:
        """Whether a lens is described."""
        return self.f_number is not None or self.focal_length is not None

    def focused(self, vergence: float) -> Optics:
        """Return the lens or eye, focused at a vergence (D)."""
        pupil = self.pupil is not None or self.person.has_natural_pupil
        if not self.person.is_empty and (self.is_lens or self.eye_file is not None or not pupil):
            raise InputError(
                "--refraction, --correction, --age, --luminance, --aberrations and --zones describe an eye: give its "
                "--pupil, or --luminance, --refraction or --age for its natural pupil, and no other optics."
            )
        if self.is_lens + pupil + (self.eye_file is not None) != 1:
            raise InputError(
                "the optics must be --f-number and --focal-length, or --pupil (or --refraction, --age), or --eye: give "
                "exactly one of the three."
            )
        if not self.is_lens:
            return eye_of(self.person, self.eye_file, self.pupil, vergence)
        if self.f_number is None or self.focal_length is None:
            raise InputError("a lens needs both --f-number and --focal-length: add the missing one.")
        return Lens(1e-3 * self.focal_length, self.f_number, 1 / vergence if vergence > 0 else math.inf)

    def states(self, optics: Sequence[Any], vergences: Sequence[float]) -> dict[str, Any]:
        """Return, for a summary, the pupil (mm) and state of each eye that looks at a vergence (D); not of lenses."""
        if self.is_lens:
            return {}
        states = [eye_state(self.person, eye, vergence) for eye, vergence in zip(optics, vergences, strict=True)]
        return {"pupil": states[0]["pupil_mm"], "eyes": states}

    def notes(self, states: Mapping[str, Any]) -> list[str]:
        """Return a line for the terminal about each of the eyes' `states`."""
        return eye_notes(states.get("eyes", []))


class _LensOrEye(Given):
    """Options of a lens, an eye and a person, for a command that receives `Through`."""

    def parameters(self) -> dict[str, list[click.Parameter]]:
        """Return the options of each parameter."""
        return super().parameters() | PERSON.parameters()

    def value(self, given: dict[str, Any]) -> Through:
        """Return the optics for values by parameter."""
        own = {name: given.pop(name) for name in ("f_number", "focal_length", "pupil", "eye_file")}
        return Through(**own, person=PERSON.value(given))


@dataclass(frozen=True)
class _Joined(Given):
    """Parameters of a function, after those of other groups, as one group."""

    others: Sequence[Given] = ()

    def parameters(self) -> dict[str, list[click.Parameter]]:
        """Return the options of each parameter."""
        groups = [*(other.parameters() for other in self.others), super().parameters()]
        return {name: options for group in groups for name, options in group.items()}


def read_picture_and_depth(
    picture: Path,
    depth: Path,
    optics: Sequence[Optics] = (),
    *,
    field: Annotated[float | None, DEGREES] = None,
    pixel_pitch: Annotated[float | None, MICROMETRES] = None,
    focal_length: float | None = None,
    unit: Any = "m",
    **others: Any,
) -> DepthPicture:
    """Read a picture and its depth with the options of a command, as `focalgradient.photographs.read_depth_picture`.

    Parameters
    ----------
    field
        Width of the picture, in degrees.
    pixel_pitch
        Pixel pitch of the camera's sensor, in micrometres.
    """
    source = click.get_current_context().get_parameter_source("depth_unit")
    return fg.photographs.read_depth_picture(
        picture,
        _depth_of(depth),
        field=None if field is None else math.radians(field),
        pixel_pitch=None if pixel_pitch is None else 1e-6 * pixel_pitch,
        focal_length=None if focal_length is None else 1e-3 * focal_length,
        unit=unit if source is click.core.ParameterSource.COMMANDLINE else None,
        optics=optics,
        **others,
    )


def _depth_of(given: Path) -> Path | float:
    """Return the depth file, or the distance of a flat picture if it is a number and no such file exists."""
    if given.exists():
        return given
    with suppress(ValueError):
        return float(str(given))
    raise InputError(
        f"{printable(given)} does not exist: give a depth file, or the distance of a flat picture in metres, such as 2."
    )


def settings_given(*others: str) -> dict[str, Any]:
    """Return the running command's options for its summary, without its files and the `others`."""
    names = {"eye": "eye_file", "display": "display_file"}
    return {
        names.get(name, name): printable(value) if isinstance(value, Path) else value
        for name, value in click.get_current_context().params.items()
        if name not in ("picture", "depth", "out", *others)
    }


LensOrEye = Annotated[Through, _LensOrEye(Through)]
"""A lens or an eye."""

_PICTURE, _ENCODING = "focalgradient.photographs:read_picture", ("encoding",)
_DEPTH = get_args(DepthFile)[1]
_PIXEL = Given(read_picture_and_depth, only=("field", "pixel_pitch"))

Stored = Annotated[dict[str, Any], _Joined(_PICTURE, only=_ENCODING, others=(_DEPTH,))]
"""How a picture and its depth file are read, for `read_picture_and_depth`."""

Read = Annotated[dict[str, Any], _Joined(_PICTURE, only=_ENCODING, others=(_PIXEL, _DEPTH))]
"""Size of a pixel, and how a picture and its depth file are read, for `read_picture_and_depth`."""
