"""Tables of settings files: read, checked, and what is wrong with them said in one sentence."""

from __future__ import annotations

import difflib
import math
import tomllib
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, ValidationInfo

from focalgradient.errors import InputError
from focalgradient.photographs.images import Encoding

__all__ = ["ImagePath", "Sensor", "Table", "load_table", "read_toml", "shown"]


def _in_folder(path: Path, info: ValidationInfo) -> Path:
    """Image paths are relative to the settings file, whose folder comes as context."""
    return Path(info.context or "") / path


class Table(BaseModel):
    """A table of a settings file: unknown keys are refused."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    tables: ClassVar[dict[str, type[Table]]] = {}
    """The tables within, by key, for messages."""


ImagePath = Annotated[Path, Field(strict=False), AfterValidator(_in_folder)]


# Each description completes "..., but must be " and "... is missing: give ".
class Sensor(Table):
    """What is fixed in a camera: focal length, pixels, and how their values are written."""

    focal_length_mm: Annotated[
        float, Field(gt=0, allow_inf_nan=False, description="a positive number of millimetres, like 25.0")
    ]
    pixel_pitch_um: Annotated[
        float, Field(gt=0, allow_inf_nan=False, description="a positive number of micrometres, like 8.0")
    ]
    """Of the sensor's pixels, also for camera raw files."""
    encoding: Annotated[Encoding | None, Field(description="'linear' or 'srgb'")] = None
    """None: sRGB for 8-bit image files, linear for all others."""
    telecentric: Annotated[bool, Field(description="true or false")] = False
    """Whether magnification stays the same when the focus changes: all views then share the first's pixel angle."""


def read_toml(path: Path) -> dict[str, Any]:
    """Read a settings file as it stands.

    Raises
    ------
    InputError
        If it cannot be read, or is not TOML.
    """
    try:
        # "utf-8-sig": some editors put a byte order mark, which TOML does not know.
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): give the path of a settings file.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a TOML file: expected text in UTF-8.") from error
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        hint = "; write \\ as / in paths" if "\\" in text else ""
        raise InputError(f"{path} is not valid TOML: {error}{hint}.") from error


Kind = TypeVar("Kind", bound=Table)


def load_table(path: Path, data: dict[str, Any], kind: type[Kind]) -> Kind:
    """Check the `data` that stood in `path`.

    Raises
    ------
    InputError
        If there are unknown, missing or wrong keys: the first is named.
    """
    try:
        return kind.model_validate(data, context=path.parent)
    except ValidationError as error:
        raise InputError(f"{path}: {_sentence(error, kind)}") from error


def _sentence(error: ValidationError, kind: type[Table]) -> str:
    """Put the first problem that pydantic found into a sentence that says what to do."""
    # A misspelt key is also a missing one: the misspelling is the better thing to say.
    problem = min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")
    place = problem["loc"]
    table = kind.tables[str(place[0])] if len(place) > 1 else kind
    if len(place) > 1 and isinstance(place[1], int):
        place = (f"{place[0]} {place[1] + 1}", *place[2:])
    key = place[-1]
    where = ": ".join(str(part) for part in place)
    fields = {field.alias or name: field.description for name, field in table.model_fields.items()}
    if problem["type"] == "extra_forbidden":
        near = difflib.get_close_matches(str(key), fields, 1)
        return f"{where} is not a known key: " + (f"did you mean {near[0]}?" if near else f"use {', '.join(fields)}.")
    expected = fields.get(str(key), "a table")
    if problem["type"] == "missing":
        return f"{where} is missing: give {expected}."
    if problem["type"] == "too_short":
        return f"no view is given, but there must be {expected}: add what is missing."
    return f"{where} is {shown(problem['input'])}, but must be {expected}."


def shown(value: Any) -> str:
    """`value` as a message shows it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return repr(value)
