"""Depth ratings from a table of one's own, wide or long, with any names; what had to be assumed is noted."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable, read_bytes
from focalgradient.statistics.tables import PINHOLE, rating_table

__all__ = ["OwnRatings", "read_ratings"]

FOCAL_LENGTH_MM = 50.0
"""Of the lens, where neither a column aperture_mm nor the caller gives it: that of the paper's pictures."""

ROLES = {
    "participant_id": ("participant", "subject", "subj", "id", "observer"),
    "aperture": ("f_number", "fnumber", "fstop", "f-stop"),
    "aperture_mm": (),
    "fixation": ("focus", "fixated"),
    "rating": ("answer", "response", "resp"),
    "scene": ("picture", "image", "item", "stimulus"),
    "trial": (),
    "session": (),
    "catch": (),
    "response_time": ("rt",),
    "repetition": (),
    "dropped_frames": (),
    "kind": (),
}
"""Our columns, and the names by which they are found where the caller does not give them."""

FIXED = {
    "near": "nearest",
    "nearest": "nearest",
    "front": "nearest",
    "foreground": "nearest",
    "far": "farthest",
    "farthest": "farthest",
    "back": "farthest",
    "background": "farthest",
}
SHARP = {"pinhole", "ph", "sharp", "0", "inf", "f/inf", "none"}
ABSENT = {"", "na", "n/a", "nan", "null", "none", ".", "-", "#n/a"}
TRUTH = {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False, "": False, "n/a": False}
F_NUMBER = re.compile(r"f?\s*/?\s*(\d+(?:[.,]\d+)?)", re.IGNORECASE)
WITHIN = re.compile(r"pinhole|f/?\d+(?:[.,]\d+)?", re.IGNORECASE)


@dataclass(frozen=True, slots=True, eq=False)
class OwnRatings:
    """A table of one's own as `depth_rating` takes it.

    Parameters
    ----------
    table
        One row a trial: see `focalgradient.statistics.tables.rating_table`. The index gives file and row.
    notes
        What was assumed, left out or changed, a sentence each.
    """

    table: pd.DataFrame
    notes: tuple[str, ...]


def read_ratings(
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    *,
    focal_length_mm: float | None = None,
) -> OwnRatings:
    r"""Read depth ratings from a CSV or TSV file, a row a trial (long) or a column a condition (wide).

    Parameters
    ----------
    path
        Commas, semicolons or tabs between the cells; decimal points or commas.
    columns
        The file's name of each of our columns: participant, aperture, fixation, rating, and, where there are such,
        scene, trial, catch, session, response_time, aperture_mm. Without a column of ratings, every column whose name
        holds an aperture ("near_f5.6", "pinhole, far") is one: what else stands in the name is fixation and scene.
    conditions
        Our name of each of the file's conditions: {"vorn": "nearest", "weit offen": "f/5.6", "scharf": "pinhole"}.
        "near", "far", "f5.6", "5.6", "0" are understood without.
    focal_length_mm
        Of the lens in millimetres: the aperture's diameter is this over the f-number. 50 without, and a note tells it.

    Raises
    ------
    InputError
        If a column is missing or a cell cannot be understood: it is named.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "own.csv")
    ...     _ = file.write_text("subject;fstop;focus;resp\nA ;5,6;near;1,4\nA ;0;near;1,0\n")
    ...     own = read_ratings(file)
    >>> own.table[["participant_id", "aperture", "fixation", "rating"]].values.tolist()
    [['A', 'f/5.6', 'nearest', 1.4], ['A', 'pinhole', 'nearest', 1.0]]
    """
    path = Path(path)
    header, rows = _cells(path)
    theirs = _roles(path, header, columns or {})
    notes: list[str] = []
    table = pd.DataFrame(rows, columns=header, dtype=str)
    table.index = pd.MultiIndex.from_product([[path.name], range(2, len(table) + 2)], names=["file", "row"])
    table = table[table.apply(lambda row: any(cell.strip() for cell in row), axis=1)] if len(table) else table
    table = _long(path, table, theirs, conditions or {}) if "rating" not in theirs else _renamed(table, theirs)
    table = _checked_cells(path, table, dict(conditions or {}), notes)
    lens = FOCAL_LENGTH_MM if focal_length_mm is None else focal_length_mm
    if "aperture_mm" not in table:
        if focal_length_mm is None:
            notes.append(f"The apertures’ diameters are for a lens of {lens:g} mm: state another with focal_length_mm.")
        table["aperture_mm"] = [0.0 if name == PINHOLE else lens / float(name[2:]) for name in table["aperture"]]
    table["kind"] = table["kind"].str.strip() if "kind" in table else "human"
    return OwnRatings(rating_table(table), tuple(notes))


def _cells(path: Path) -> tuple[list[str], list[list[str]]]:
    """Header and rows as text; the delimiter is the one that the header has most of."""
    data = read_bytes(path, "a table of ratings")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", "replace")
    if "\0" in text:
        raise InputError(f"{printable(path)} is not a table of text: give a CSV or TSV file.")
    first = text.split("\n", 1)[0]
    delimiter = max(";\t,", key=first.count)
    try:
        lines = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
    except csv.Error as error:
        raise InputError(f"{printable(path)} cannot be read as a table ({error}): give a CSV or TSV file.") from error
    lines = [line for line in lines if line] or [[]]
    header = [name.strip() for name in lines[0]]
    again = [name for name in header if name and header.count(name) > 1]
    if not any(header) or again:
        what = f"the column {again[0]} twice" if again else "no header"
        raise InputError(f"{printable(path)} has {what}: give each column a name of its own in the first row.")
    for number, line in enumerate(lines[1:], start=2):
        if len(line) > len(header) and any(cell.strip() for cell in line[len(header) :]):
            raise InputError(
                f"{printable(path)}, row {number}: there are {len(line)} cells, but must be {len(header)}, as above."
            )
    width = len(header)
    return header, [(line + [""] * width)[:width] for line in lines[1:]]


def _roles(path: Path, header: list[str], columns: Mapping[str, str]) -> dict[str, str]:
    """The file's column for each of ours."""
    found = {}
    for given, name in columns.items():
        role = "participant_id" if given == "participant" else given
        if role not in ROLES:
            raise InputError(
                f"columns: {given} is not known: use {', '.join(['participant', *list(ROLES)[1:]])} = the file's name."
            )
        if name not in header:
            raise InputError(f"{printable(path)} has no column {name} for {given}: it has {', '.join(header)}.")
        found[role] = name
    lower = {name.lower(): name for name in header if name not in found.values()}
    for role, others in ROLES.items():
        if role not in found:
            near = next((lower[name] for name in (role, *others) if name in lower), None)
            if near is not None:
                found[role] = near
    return found


def _renamed(table: pd.DataFrame, theirs: Mapping[str, str]) -> pd.DataFrame:
    return pd.DataFrame({role: table[name] for role, name in theirs.items()}, index=table.index)


def _long(path: Path, table: pd.DataFrame, theirs: Mapping[str, str], conditions: Mapping[str, str]) -> pd.DataFrame:
    """A wide table with a row for each of its ratings."""
    wide = [name for name in table if name not in theirs.values() and _aperture_within(str(name), conditions)]
    if not wide:
        raise InputError(
            f"{printable(path)} has no column of ratings: name it with --columns rating=NAME, or give each condition a "
            "column whose name holds its aperture, like near_f5.6."
        )
    parts = []
    for name in wide:
        fixation, aperture, scene = _named(str(name), conditions)
        part = _renamed(table, theirs).assign(aperture=aperture, rating=table[name])
        if fixation is not None:
            part["fixation"] = fixation
        if scene and "scene" not in theirs:
            part["scene"] = scene
        parts.append(part)
    whole = pd.concat(parts).drop(columns="trial", errors="ignore")
    return whole.sort_index(kind="stable")


def _aperture_within(name: str, conditions: Mapping[str, str]) -> str | None:
    for theirs, ours in conditions.items():
        if theirs in name and (ours == PINHOLE or ours.startswith("f/")):
            return theirs
    found = WITHIN.search(name)
    return found.group() if found else None


def _named(name: str, conditions: Mapping[str, str]) -> tuple[str | None, str, str]:
    """Fixation, aperture and scene that a column's name holds."""
    aperture = str(_aperture_within(name, conditions))
    rest = name.replace(aperture, " ", 1)
    fixation, scene = None, []
    for theirs, ours in conditions.items():
        if ours in ("nearest", "farthest") and theirs in rest:
            fixation, rest = ours, rest.replace(theirs, " ", 1)
    for word in re.split(r"[\s_,;.:()\-]+", rest):
        if fixation is None and word.lower() in FIXED:
            fixation = word
        elif word and word.lower() not in ("rating", "resp", "response"):
            scene.append(word)
    return fixation, aperture, " ".join(scene)


def _checked_cells(path: Path, table: pd.DataFrame, conditions: dict[str, str], notes: list[str]) -> pd.DataFrame:
    """Cells as what they stand for; what was assumed goes into the notes."""
    for role in ("participant_id", "aperture", "fixation"):
        if role not in table:
            plain = "participant" if role == "participant_id" else role
            raise InputError(f"{printable(path)} has no column for {plain}: name it with --columns {plain}=NAME.")
    if any(table["participant_id"] != table["participant_id"].str.strip()):
        notes.append("Spaces at the ends of participants’ names were removed.")
    for role in ("participant_id", "session", "scene"):
        if role in table:
            table[role] = table[role].str.strip()
    unnamed = table["participant_id"].str.lower().isin(ABSENT)
    if unnamed.any():
        raise InputError(f"{_place(table, unnamed)}: the participant is missing: name it.")
    rating = table["rating"].str.strip()
    absent = rating.str.lower().isin(ABSENT)
    if absent.all():
        raise InputError(f"{printable(path)} holds no rating: the column given for ratings is empty.")
    if absent.any():
        who = ", ".join(sorted(set(table["participant_id"][absent]))[:10])
        notes.append(f"{int(absent.sum())} rows without a rating were left out (participants {who}).")
        table, rating = table[~absent].copy(), rating[~absent]
    table["rating"] = _numbers(table, "rating", rating)
    table["aperture"] = [_aperture(cell, table, place, conditions) for place, cell in enumerate(table["aperture"])]
    table["fixation"] = [_fixation(cell, table, place, conditions) for place, cell in enumerate(table["fixation"])]
    for role in ("aperture_mm", "response_time", "dropped_frames"):
        if role in table:
            table[role] = _numbers(table, role, table[role].str.strip(), empty=role != "aperture_mm")
    if "scene" not in table:
        table["scene"] = "all"
        notes.append("There is no column of scenes: all ratings count as of one scene, and results hold for it only.")
    return _trials(table, notes)


def _trials(table: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Catch trials and trial numbers, supplied where they are missing."""
    if "catch" in table:
        texts = table["catch"].str.strip().str.lower()
        wrong = ~texts.isin(list(TRUTH))
        if wrong.any():
            raise InputError(f"{_place(table, wrong)}: catch is {table['catch'][wrong].iloc[0]!r}, but must be 0 or 1.")
        table["catch"] = texts.map(TRUTH)
    else:
        table["catch"] = False
        notes.append("There is no column of catch trials: no trial counts as one.")
    by = [name for name in ("participant_id", "session") if name in table]
    if "trial" not in table or table.duplicated([*by, "trial"]).any():
        table["trial"] = table.groupby(by, sort=False).cumcount() + 1
        notes.append("Trials are numbered as they stand in the file.")
    return table


def _place(table: pd.DataFrame, wrong: pd.Series[bool]) -> str:
    file, row = table.index[int(wrong.to_numpy().argmax())]
    return f"{file}, row {row}"


def _numbers(table: pd.DataFrame, role: str, texts: pd.Series[str], *, empty: bool = False) -> pd.Series[float]:
    """Numbers with a decimal point or comma."""
    absent = texts.str.lower().isin(ABSENT)
    values = pd.to_numeric(texts.str.replace(",", ".", regex=False), errors="coerce").astype(float)
    wrong = ~values.map(math.isfinite).astype(bool)
    if empty:
        wrong &= ~absent
    if wrong.any():
        raise InputError(
            f"{_place(table, wrong)}: {role} is {printable(texts[wrong].iloc[0])!r}, but must be a number, like 1.4."
        )
    return values


def _aperture(cell: str, table: pd.DataFrame, place: int, conditions: Mapping[str, str]) -> str:
    text = conditions.get(cell.strip(), cell.strip())
    if text.lower() in SHARP:
        return PINHOLE
    found = F_NUMBER.fullmatch(text)
    number = float(found[1].replace(",", ".")) if found else 0.0
    if not 0 < number < math.inf:
        file, row = table.index[place]
        raise InputError(
            f"{file}, row {row}: aperture is {printable(cell)!r}, but must be a pinhole or an f-number like f/5.6: "
            "give its meaning with --conditions NAME=f/5.6."
        )
    return PINHOLE if number == 0 else f"f/{number:g}"


def _fixation(cell: str, table: pd.DataFrame, place: int, conditions: Mapping[str, str]) -> str:
    text = conditions.get(cell.strip(), cell.strip())
    fixed = FIXED.get(text.lower())
    if fixed is None:
        file, row = table.index[place]
        raise InputError(
            f"{file}, row {row}: fixation is {printable(cell)!r}, but must be near or far: give its meaning with "
            "--conditions NAME=near."
        )
    return fixed
