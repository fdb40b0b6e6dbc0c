"""Import of the user's own stimuli, described by a table, as a set."""

from __future__ import annotations

import hashlib
import io
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from focalgradient.display import Display
from focalgradient.errors import InputError, checked, located, warn
from focalgradient.files import inner_name, plain_name, read_bytes, refuse_overwriting
from focalgradient.files.cells import as_number
from focalgradient.files.tables import read_cells
from focalgradient.optics import Aperture
from focalgradient.photographs.encodings import FORMATS
from focalgradient.photographs.pictures import read_distances
from focalgradient.progress import Progress
from focalgradient.quantities import Range
from focalgradient.render.rendered import LUMINANCE
from focalgradient.stimuli.controls import SMOOTH, against_discs
from focalgradient.stimuli.fixated import target_of
from focalgradient.stimuli.folder import MANIFEST, UNFINISHED
from focalgradient.stimuli.making import FOCAL_LENGTH, Depth, Entry, Recipe, make_set
from focalgradient.stimuli.sets import (
    FIXATIONS,
    Fixation,
    StimulusSet,
    Targets,
    check_size,
    picture_entry,
    png_of,
    stored_distance,
)
from focalgradient.stimuli.sharpness import sharpest

__all__ = ["import_pictures"]

REQUIRED = ("file", "scene", "aperture", "fixation")
OPTIONAL = ("x_px", "y_px", "depth", "focus_m")
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
APERTURE = re.compile(r"(?:f/)?(\d+(?:\.\d+)?)")
MODES = ("1", "L", "LA", "P", "RGB", "RGBA")


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the table; `where` identifies it, and `fixations` lists all if one pinhole picture serves all."""

    where: str
    file: str
    scene: str
    aperture: str
    fixations: tuple[Fixation, ...]
    position: tuple[float, float] | None
    depth: str | None
    focus: float | None
    further: Mapping[str, str]
    version: int = 1
    """Number, from 1, of pictures with the same scene, aperture and fixation that differ in further columns."""

    @property
    def stem(self) -> str:
        """Stem of the picture's files in the set."""
        end = "" if len(self.fixations) > 1 else f"-{self.fixations[0]}"
        version = "" if self.version == 1 else f"-{self.version}"
        return f"{self.scene}/{self.aperture.replace('/', '')}{end}{version}"


@checked
def import_pictures(
    folder: str | Path,
    table: str | Path,
    out: str | Path,
    *,
    display: Display | None = None,
    focal_length: Annotated[float, Range("metres", most=1, positive=True)] = FOCAL_LENGTH,
    field: Annotated[float | None, Range("radians", most=3.14, positive=True)] = None,
    progress: Progress | None = None,
) -> StimulusSet:
    """Make a set from existing pictures, resume an interrupted one, or verify a finished one.

    Parameters
    ----------
    folder
        Folder with the pictures: 8-bit PNG, JPEG or TIFF files, all of one size, encoded for the display.
    table
        CSV file with the columns ``file`` (in `folder`), ``scene``, ``aperture`` (``pinhole`` or an f-number) and
        ``fixation`` (``nearest``, ``farthest``, or any other names of letters, digits and _; may be empty for a pinhole
        picture, which then serves all). Optional columns are ``x_px`` and ``y_px`` (position of the fixated object from
        the upper left corner), ``depth`` (a file in `folder`, in metres) and ``focus_m``; all other columns are copied
        to the manifest.
    out
        Output folder of the set.
    display
        Display for which the pictures are made.
    focal_length
        Focal length of the lens in metres, which relates f-numbers to diameters; must equal the design's
        ``focal_length_mm``.
    field
        Width of the pictures as an angle in radians at the camera. If given, spectra and shifts of the pictures of
        scenes with a pinhole picture and ``depth`` are measured as in generated sets, for a lens of `focal_length`;
        otherwise only mean luminance is measured.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Returns
    -------
    StimulusSet
        The set, as returned by `read_set`. Values missing from the table are NaN.

    Raises
    ------
    InputError
        If the table is invalid (row and column are named), or a picture cannot be read or displayed.

    Warns
    -----
    FocalGradientWarning
        If the position of a fixated object is missing: the centre of the picture is used.
    """
    folder, table, out = Path(folder), Path(table), Path(out)
    display = display or Display()
    rows = _rows(table)
    hashes, size = _checked(folder, rows, display)
    made_names = [f"{row.stem}.{kind}" for row in rows for kind in ("png", "npy")]
    made_names += [MANIFEST, UNFINISHED, *(f"{row.scene}/depth.npy" for row in rows)]
    refuse_overwriting([table, *(folder / name for name in hashes)], [out / name for name in made_names])
    parameters: dict[str, Any] = {
        "kind": "imported",
        "apertures": _apertures(rows),
        "focal_length_mm": focal_length * 1e3,
        "table_sha256": hashlib.sha256(read_bytes(table, "a table of pictures")).hexdigest(),
        "sources_sha256": hashes,
    }
    if field is not None:
        parameters["pixel_angle_rad"] = 2 * math.tan(field / 2) / size[0]
    ends = _fixations([end for row in rows for end in row.fixations])

    def recipes() -> Iterator[ImportRecipe]:
        middles = []
        for name in dict.fromkeys(row.scene for row in rows):
            own = {row.stem.partition("/")[2]: row for row in rows if row.scene == name}
            targets, depth, is_in_middle = _located(folder, [*own.values()], size, ends)
            pixel_angle = parameters.get("pixel_angle_rad")
            yield ImportRecipe(name, display, None, targets, depth, own, folder, focal_length, pixel_angle)
            middles += [name] * is_in_middle
        if middles:
            warn(
                f"the table does not give the positions of the fixated objects of {', '.join(middles[:5])}: their "
                "marks are put in the middle of the pictures; give the columns x_px and y_px, or depth."
            )

    remedy = f"{SMOOTH}; or leave out the control (field)"
    return make_set(out, display, size[::-1], parameters, recipes(), progress, remedy=remedy)


def _rows(table: Path) -> list[Row]:
    """Return the rows, each validated by itself and against the preceding ones."""
    cells = read_cells(table, "a table of pictures")
    name, header = cells.name, list(cells.header)
    missing = [column for column in REQUIRED if column not in header]
    if missing:
        there = ", ".join(cell[:40] for cell in header[:12]) or "none"
        raise InputError(
            f"{name} has no column {missing[0]!r} (its columns are {there}), but must have {', '.join(REQUIRED)}: add "
            "it."
        )
    lines = cells.records(("x_px", "y_px", "focus_m"))
    every = _fixations([line["fixation"] for line in lines])
    rows: list[Row] = []
    known: dict[tuple[object, ...], str] = {}
    versions: Counter[tuple[str, ...]] = Counter()
    for number, line in zip(cells.places, lines, strict=True):
        where = f"{name} row {number}"
        row = _row(where, line, every)
        for end in row.fixations:
            before = known.setdefault((row.scene, row.aperture, end, *row.further.values()), where)
            if before != where:
                raise InputError(
                    f"{where}, columns scene, aperture and fixation: the same values occur in row "
                    f"{before.split()[-1]}: give "
                    "pictures that differ otherwise a further column, or different scene names."
                )
        same = (row.scene, row.aperture, *row.fixations)
        versions[same] += 1
        rows.append(replace(row, version=versions[same]))
    return rows


def _fixations(cells: Sequence[str]) -> tuple[Fixation, ...]:
    """Return the names of all fixations in a table: nearest and farthest, unless others are named."""
    named = tuple(dict.fromkeys(name for name in cells if name))
    return FIXATIONS if set(named) <= {*FIXATIONS} else named


def _row(where: str, cells: dict[str, str], every: tuple[Fixation, ...]) -> Row:
    def wrong(column: str, expected: str) -> InputError:
        return InputError(f"{where}, column {column}: is {cells[column]!r}, but must be {expected}.")

    def number(column: str, most: float = math.inf) -> float | None:
        if not cells.get(column):
            return None
        value = as_number(cells[column])
        if value is None:
            raise wrong(column, "a number")
        if not 0 <= value < most or (column == "focus_m" and value == 0):
            raise wrong(column, "a positive finite number")
        return value

    found = APERTURE.fullmatch(cells["aperture"])
    if cells["aperture"] != "pinhole" and not (found and float(found[1]) > 0):
        raise wrong("aperture", "'pinhole' or an f-number like 'f/5.6'")
    aperture = f"f/{float(found[1]):g}" if found else "pinhole"
    both = aperture == "pinhole" and not cells["fixation"]
    if not (both or NAME.fullmatch(cells["fixation"])):
        raise wrong(
            "fixation",
            "a name of letters (a to z, A to Z), digits and _, or empty for a pinhole picture that serves all",
        )
    fixations = tuple(end for end in every if both or end == cells["fixation"])
    x, y = number("x_px"), number("y_px")
    if (x is None) != (y is None):
        column = "x_px" if x is None else "y_px"
        raise InputError(f"{where}, column {column}: is empty, but x_px and y_px must be given together: give both.")
    if both and x is not None:
        raise InputError(
            f"{where}, column x_px: has a position, but column fixation is empty: leave x_px and y_px empty."
        )
    return Row(
        where,
        inner_name(cells["file"], f"{where}, column file"),
        plain_name(cells["scene"], f"{where}, column scene"),
        aperture,
        fixations,
        None if x is None or y is None else (x, y),
        inner_name(cells["depth"], f"{where}, column depth") if cells.get("depth") else None,
        number("focus_m"),
        {name: text for name, text in cells.items() if name not in (*REQUIRED, *OPTIONAL)},
    )


def _checked(folder: Path, rows: Sequence[Row], display: Display) -> tuple[dict[str, str], tuple[int, int]]:
    """Return the SHA-256 of every source, and the common width and height."""
    hashes: dict[str, str] = {}
    first: tuple[int, int] | None = None
    for row in rows:
        for column, name in (("file", row.file), ("depth", row.depth)):
            if name is not None and name not in hashes:
                with located(f"{row.where}, column {column}"):
                    data = read_bytes(folder / name)
                hashes[name] = hashlib.sha256(data).hexdigest()
        height, width = _values(folder, row).shape[:2]
        first = check_size(f"{row.where}, column file: {row.file}", (height, width), display, first)
        if row.position is not None:
            for column, value, side in zip(("x_px", "y_px"), row.position, first[::-1], strict=True):
                if value >= side:
                    raise InputError(
                        f"{row.where}, column {column}: is {value:g}, but must lie within the picture's {side} pixels."
                    )
    assert first is not None
    return hashes, first[::-1]


def _values(folder: Path, row: Row) -> NDArray[np.uint8]:
    """Return the 8-bit values of a picture, H x W x 3."""
    where = f"{row.where}, column file: {row.file}"
    try:
        content = io.BytesIO(read_bytes(folder / row.file, "a picture"))
        with Image.open(content, formats=FORMATS) as image:
            if image.mode not in MODES:
                raise InputError(f"{where} is of the kind {image.mode}, but must be 8-bit grey or RGB: convert it.")
            turned = ImageOps.exif_transpose(image).convert("RGBA")
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where} cannot be read: expected an intact PNG, JPEG or TIFF file.") from error
    values = np.array(turned)
    if (values[..., 3] < 255).any():
        raise InputError(f"{where} is transparent in places, but a display shows opaque pictures: flatten it.")
    return values[..., :3]


def _located(
    folder: Path, rows: Sequence[Row], size: tuple[int, int], ends: tuple[Fixation, ...]
) -> tuple[Targets, NDArray[np.float32] | None, bool]:
    """Return the fixated objects of a scene, its depth (m), and whether a mark had to be placed at the centre."""
    with_depth = [row for row in rows if row.depth is not None]
    other = next((row for row in with_depth if row.depth != with_depth[0].depth), None)
    if other is not None:
        raise InputError(
            f"{other.where}, column depth: is {other.depth!r}, but {with_depth[0].depth!r} for the scene before."
        )
    depth = None
    if with_depth:
        where = f"{with_depth[0].where}, column depth"
        with located(where):
            depth = stored_distance(read_distances(folder / str(with_depth[0].depth)).metres, str(with_depth[0].depth))
        if depth.shape != size[::-1]:
            raise InputError(
                f"{where}: has {depth.shape[1]} x {depth.shape[0]} pixels, but its picture {size[0]} x {size[1]}: "
                "scale or crop it."
            )
    targets: dict[Fixation, tuple[tuple[float, float], float | None]] = {}
    middle = False
    for end in ends:
        own = [row for row in rows if row.fixations == (end,)]
        places = [row for row in own if row.position is not None]
        other = next((row for row in places if row.position != places[0].position), None)
        if other is not None:
            raise InputError(
                f"{other.where}, column x_px: differs from the position given above for this scene and fixation: "
                "give one position."
            )
        position = places[0].position if places else None
        distance = next((row.focus for row in own if row.focus is not None), None)
        if position is None and (depth is None or end not in FIXATIONS):  # depth does not give its position
            position, middle = (size[0] / 2, size[1] / 2), middle or bool(own)
        if depth is not None:
            with located(f"{with_depth[0].where}, column depth"):
                position, distance = target_of(depth, end, position)
        assert position is not None
        targets[end] = position, distance
    return targets, depth, middle


@dataclass(eq=False)
class ImportRecipe(Recipe):
    """The rows of a scene by file stem, its fixated objects and its depth (m), and the folder of the pictures.

    Blur is measured relative to a disc's if a `pixel_angle` (rad) is given, for a lens of this focal length (m).
    """

    targets: Targets
    depth: Depth
    rows: Mapping[str, Row]
    folder: Path
    focal_length: float
    pixel_angle: float | None

    @property
    def stems(self) -> tuple[str, ...]:
        """File stems of the pictures."""
        return tuple(self.rows)

    def encoded(self, stem: str, light: NDArray[np.float32]) -> bytes:
        """Return the picture's own values as a PNG file."""
        return png_of(_values(self.folder, self.rows[stem]))

    def picture(self, stem: str, progress: Progress) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Read a picture, and measure it, if possible relative to the first one of the pinhole."""
        row, weights = self.rows[stem], np.array(LUMINANCE)
        light = self._light(row)
        measured: dict[str, Any] = {"mean_luminance": float((light @ weights).mean())}
        pinhole = next((other for other in self.rows.values() if other.aperture == "pinhole"), None)
        focus = row.focus or self.targets[row.fixations[0]][1]
        if row.aperture != "pinhole" and pinhole and focus and self.pixel_angle and self.depth is not None:
            lens, sharp = Aperture(1e-3 * self._aperture_mm(row), 1 / focus), self._light(pinhole) @ weights
            measured |= against_discs(light @ weights, sharp, self.depth, lens, self.pixel_angle)
            measured |= sharpest(light @ weights, sharp, self.depth, [lens], self.pixel_angle)
        return light, measured

    def _light(self, row: Row) -> NDArray[np.float32]:
        return self.display.decode(_values(self.folder, row)).astype(np.float32)

    def _aperture_mm(self, row: Row) -> float:
        return 0.0 if row.aperture == "pinhole" else 1e3 * self.focal_length / float(row.aperture[2:])

    def listed(self, scene: Entry, depth: Depth) -> Iterator[Entry]:
        """Return the entry of each picture for each of its fixations."""
        for row in self.rows.values():
            for end in row.fixations:
                yield picture_entry(
                    *(row.stem, row.aperture, end),
                    focus_m=row.focus or self.targets[end][1],
                    aperture_mm=self._aperture_mm(row),
                    source=row.file,
                    further=dict(row.further),
                )


def _apertures(rows: Sequence[Row]) -> list[str]:
    """Return the apertures from smallest to largest, the pinhole first."""
    found = {row.aperture for row in rows}
    return sorted(found, key=lambda name: -math.inf if name == "pinhole" else -float(name[2:]))
