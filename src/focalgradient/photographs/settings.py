"""The settings file, VIEWS.toml: which image was taken with which optics."""

from __future__ import annotations

import difflib
import math
import os
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, ValidationInfo

from focalgradient.errors import InputError
from focalgradient.optics import Lens
from focalgradient.photographs.images import Encoding, Photograph, read_photographs
from focalgradient.view import View

__all__ = ["Camera", "Settings", "Shot", "load_settings", "make_views", "read_views"]


def _in_folder(path: Path, info: ValidationInfo) -> Path:
    """Image paths are relative to the settings file, whose folder comes as context."""
    return Path(info.context or "") / path


class _Table(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


# Each description completes "..., but must be " and "... is missing: give ".
class Camera(_Table):
    """What all views share: the table ``[camera]``."""

    focal_length_mm: Annotated[
        float, Field(gt=0, allow_inf_nan=False, description="a positive number of millimetres, like 25.0")
    ]
    pixel_pitch_um: Annotated[
        float, Field(gt=0, allow_inf_nan=False, description="a positive number of micrometres, like 8.0")
    ]
    encoding: Annotated[Encoding | None, Field(description="'linear' or 'srgb'")] = None
    """None: sRGB for 8-bit image files, linear for all others."""
    telecentric: Annotated[bool, Field(description="true or false")] = False
    """Whether magnification stays the same when the focus changes: all views then share the first's pixel angle."""
    blur_k: Annotated[
        float, Field(gt=0, le=2, description="a number above 0 and up to 2, the sd of the blur over the disc's radius")
    ] = 0.5
    """Standard deviation of a Gaussian blur over the radius of the blur disc; it has no effect on disc blur."""


class Shot(_Table):
    """One image and how it was taken: a table ``[[view]]``."""

    image: Annotated[
        Path, Field(strict=False, description="the path of an image, like 'view0.png'"), AfterValidator(_in_folder)
    ]
    f_number: Annotated[float, Field(gt=0, description="a positive number, like 5.6, or inf for a pinhole")]
    focus_distance_m: Annotated[float, Field(gt=0, description="a positive number of metres, like 0.85, or inf")]


class Settings(_Table):
    """The camera, and its shots of one scene.

    >>> settings = Settings.model_validate(
    ...     {
    ...         "camera": {"focal_length_mm": 25.0, "pixel_pitch_um": 8.0},
    ...         "view": [{"image": f"{n}.png", "f_number": n, "focus_distance_m": 0.85} for n in (16, 5.6)],
    ...     }
    ... )
    >>> settings.lenses()[1].f_number, round(settings.pixel_angles()[0] * 1e6, 1)
    (5.6, 310.6)
    """

    camera: Annotated[Camera, Field(description="a table [camera] with focal_length_mm and pixel_pitch_um")]
    shots: Annotated[
        list[Shot],
        Field(alias="view", min_length=1, description="one or more [[view]] tables, in double brackets"),
    ]

    def lenses(self) -> list[Lens]:
        """Give the lens of each shot, in SI units.

        Raises
        ------
        InputError
            If a shot is focused within the focal length.
        """
        lenses = []
        for number, shot in enumerate(self.shots, 1):
            try:
                lenses.append(Lens(self.camera.focal_length_mm * 1e-3, shot.f_number, shot.focus_distance_m))
            except InputError as error:
                raise InputError(f"view {number} ({shot.image.name}): {error}") from error
        return lenses

    def pixel_angles(self) -> list[float]:
        """Give the angle in radians that a pixel of each shot subtends on the axis: pixel pitch / sensor distance.

        Focusing moves the sensor, and so changes the angle, unless the lens is telecentric (on the image side).
        """
        angles = [self.camera.pixel_pitch_um * 1e-6 / lens.sensor_distance for lens in self.lenses()]
        return angles[:1] * len(angles) if self.camera.telecentric else angles


def load_settings(path: str | os.PathLike[str]) -> Settings:
    """Read and check a settings file; its image paths are relative to its folder.

    Raises
    ------
    InputError
        If it cannot be read, is not TOML, or has unknown, missing or wrong keys.
    """
    path = Path(path)
    try:
        # "utf-8-sig": some editors put a byte order mark, which TOML does not know.
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): give the path of a settings file.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a TOML file: expected text in UTF-8.") from error
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        hint = "; write \\ as / in paths" if "\\" in text else ""
        raise InputError(f"{path} is not valid TOML: {error}{hint}.") from error
    try:
        settings = Settings.model_validate(data, context=path.parent)
        settings.lenses()
    except ValidationError as error:
        raise InputError(f"{path}: {_sentence(error)}") from error
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return settings


def make_views(settings: Settings, photographs: Sequence[Photograph]) -> list[View]:
    """Join each photograph with the optics of its shot."""
    return [
        View(photograph.luminance, lens, pixel_angle)
        for photograph, lens, pixel_angle in zip(photographs, settings.lenses(), settings.pixel_angles(), strict=True)
    ]


def read_views(path: str | os.PathLike[str]) -> list[View]:
    """Read the views that a settings file names, ready for `focalgradient.recover_depth`.

    Raises
    ------
    InputError
        As `load_settings` and `read_photographs` do.
    """
    settings = load_settings(path)
    return make_views(settings, read_photographs([shot.image for shot in settings.shots], settings.camera.encoding))


def _sentence(error: ValidationError) -> str:
    """Put the first problem that pydantic found into a sentence that says what to do."""
    # A misspelt key is also a missing one: the misspelling is the better thing to say.
    problem = min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")
    *above, key = problem["loc"]
    tables: dict[str, type[_Table]] = {"camera": Camera, "view": Shot}
    table = tables[str(above[0])] if above else Settings
    if above[:1] == ["view"]:
        above = [f"view {int(above[1]) + 1}"] if len(above) > 1 else []
        key = key if above else f"view {int(key) + 1}"
    where = ": ".join(str(part) for part in (*above, key))
    fields = {field.alias or name: field.description for name, field in table.model_fields.items()}
    if problem["type"] == "extra_forbidden":
        near = difflib.get_close_matches(str(key), fields, 1)
        return f"{where} is not a known key: " + (f"did you mean {near[0]}?" if near else f"use {', '.join(fields)}.")
    expected = fields.get(str(key), "a table")
    if problem["type"] == "missing":
        return f"{where} is missing: give {expected}."
    if problem["type"] == "too_short":
        return f"no view is given, but depth needs {expected}: add what is missing."
    return f"{where} is {_shown(problem['input'])}, but must be {expected}."


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return repr(value)
