"""Depth ratings from a table of one's own, wide or long, with any names; what had to be assumed is noted."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.scales import Choices, Ratios
from focalgradient.statistics.own_names import rows_named
from focalgradient.statistics.own_rows import in_seconds, without_codes, without_copies
from focalgradient.statistics.own_tables import (
    ABSENT,
    PARTICIPANT,
    answered,
    catch_trials,
    columns_like,
    few,
    found_columns,
    no_column,
    numbers,
    place,
    read_table,
    unused,
    with_participants,
)
from focalgradient.statistics.own_words import FIXED, SHARP, Words, given_words, meant, whole_steps, with_diameters
from focalgradient.statistics.tables import PINHOLE, rating_table

__all__ = ["OwnRatings", "read_ratings"]

FOCAL_LENGTH_MM = 50.0
"""Of the lens, where neither a column aperture_mm nor the caller gives it: that of the paper's pictures."""

ROLES = {
    "participant_id": PARTICIPANT,
    "aperture": ("f_number", "fnumber", "fstop", "f-stop"),
    "aperture_mm": ("aperture (mm)", "aperture [mm]", "diameter", "diameter_mm", "diameter (mm)", "pupil_mm"),
    "fixation": ("focus", "fixated"),
    "rating": ("answer", "response", "resp", "choice", "chosen", "chosen_interval"),
    "interval": ("picture_interval", "target_interval"),
    "scene": ("picture", "image", "item", "stimulus"),
    "trial": (),
    "session": (),
    "catch": (),
    "response_time": ("rt", "reaction_time", "response_time_ms", "rt_ms", "reaction_time_ms", "rt (ms)", "rt [ms]"),
    "repetition": (),
    "dropped_frames": (),
    "kind": (),
}
"""Our columns, and the names by which they are found where the caller does not give them."""

PARTS = re.compile(r"[\s_,;.:()\-]+")
WITHIN = re.compile(r"pinhole|f/?(?:(?:1_[248]|2_[58]|3_[25]|4_5|5_6|6_3|7_1)(?!\d)|\d+(?:[.,]\d+)?)", re.IGNORECASE)
"""An aperture within a column's name; "f5_6" where names may not hold a point."""

BARE = re.compile(r"(?<![^\s_,;:()\-])\d+(?:[.,]\d+)?(?![^\s_,;:()\-])")
"""A number alone between the parts of a column's name: an aperture where a fixation stands beside it."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnRatings:
    """A table of one's own as `depth_rating` takes it.

    Parameters
    ----------
    table
        One row a trial: see `focalgradient.statistics.tables.rating_table`. The index gives file and row.
    notes
        What was assumed, left out or changed, a sentence each.
    problems
        What was left out though it may be ratings, a sentence each.
    notices
        What was taken otherwise than it stands, and changes the results, a sentence each: for the top of a report.
    choices
        Whether ratings are choices between a picture and a reference: 1 where the picture was chosen, else 0.
    """

    table: pd.DataFrame
    notes: tuple[str, ...]
    problems: tuple[str, ...] = ()
    notices: tuple[str, ...] = ()
    choices: bool = False


def read_ratings(
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    *,
    focal_length_mm: float | None = None,
    steps: bool = False,
) -> OwnRatings:
    r"""Read depth ratings from a CSV, TSV or XLSX file, a row a trial (long) or a column a condition (wide).

    Parameters
    ----------
    path
        Commas, semicolons or tabs between the cells; decimal points or commas.
    columns
        The file's name of each of our columns: participant, aperture, fixation, rating, and, where there are such,
        scene, trial, catch, session, response_time, aperture_mm; and interval, the one of two in which the picture
        was shown, where ratings are the interval chosen. Without a column of ratings, every column whose name
        holds an aperture ("near_f5.6", "pinhole, far") is one: what else stands in the name is fixation and scene.
    conditions
        Our name of each of the file's conditions: {"vorn": "nearest", "weit offen": "f/5.6", "scharf": "pinhole"}.
        "near", "far", "f5.6", "5.6", "0" are understood without.
    focal_length_mm
        Of the lens in millimetres: the aperture's diameter is this over the f-number. 50 without, and a note states it.
    steps
        Whether ratings are known to be steps of a scale: else whole numbers from 1 to few are noted.

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
    table = read_table(path)
    headers = list(table)
    notes: list[str] = []
    problems: list[str] = []
    notices: list[str] = []
    words = given_words(conditions or {})
    theirs = found_columns(path, table, ROLES, columns or {})
    if "rating" not in theirs:
        others = [str(name) for name in table if name not in theirs.values()]
        problems += _without_aperture(others, conditions or {})
        table = _long(path, table, theirs, conditions or {}, notes)
    else:
        notes += unused([str(name) for name in table if name not in theirs.values()])
        table = _renamed(table, theirs)
    table = with_participants(path, table, theirs, notes, notices)
    if "aperture" in table and "aperture_mm" not in table:
        table = with_diameters(table, theirs.get("aperture", ""), words, notices)
    table = _checked_cells(path, table, words, focal_length_mm, notes)
    table = _of_intervals(table, notes)
    table = _answers(path, table, theirs, notes, notices)
    table = meant(table, words, " ".join(map(str, headers)), notices)
    choices = not steps and set(table["rating"]) == {0.0, 1.0}
    if choices:
        notices.append("All answers are 0 or 1: they are taken for choices of the picture (1) or of a reference (0).")
    elif not steps:
        notices += whole_steps(table["rating"])
    if "scene" not in table:
        table["scene"] = "all"
        notes.append("There is no column of scenes: all ratings count as of one scene, and results hold for it only.")
    table = _trials(without_copies(catch_trials(table, notes), notices, notes), notes)
    lens = FOCAL_LENGTH_MM if focal_length_mm is None else focal_length_mm
    if "aperture_mm" not in table:
        if focal_length_mm is None:
            notes.append(f"The apertures’ diameters are for a lens of {lens:g} mm: state another (the focal length).")
        table["aperture_mm"] = [0.0 if name == PINHOLE else lens / float(name[2:]) for name in table["aperture"]]
    table["kind"] = table["kind"].str.strip() if "kind" in table else "human"
    checked = rating_table(table, Choices() if choices else Ratios())
    return OwnRatings(checked, tuple(notes), tuple(problems), tuple(notices), choices)


def _renamed(table: pd.DataFrame, theirs: Mapping[str, str]) -> pd.DataFrame:
    return pd.DataFrame({role: table[name] for role, name in theirs.items()}, index=table.index)


def _long(
    path: Path, table: pd.DataFrame, theirs: Mapping[str, str], conditions: Mapping[str, str], notes: list[str]
) -> pd.DataFrame:
    """A wide table with a row for each of its ratings; the index is (file, row, column)."""
    others = [str(name) for name in table if name not in theirs.values()]
    wide = [name for name in others if _aperture_within(name, conditions)]
    if not wide:
        raise InputError(
            f"{printable(path)} has no column of ratings, only {few([*map(str, table)])}: {columns_like('rating')}, or "
            "give each condition a column whose name holds its aperture, like near_f5.6."
        )
    parts, scenes = [], []
    for name in wide:
        fixation, aperture, scene = _named(name, conditions)
        part = _renamed(table, theirs).assign(aperture=aperture.replace("_", "."), rating=table[name], column=name)
        if fixation is not None:
            part["fixation"] = fixation
        if scene and "scene" not in theirs:
            part["scene"] = scene
            scenes.append(scene)
        parts.append(part.set_index("column", append=True))
    notes += unused([name for name in others if name not in wide])
    if scenes:
        notes.append(f"What else stands in the names of the columns is taken for scenes: {few(scenes)}.")
    whole = pd.concat(parts).drop(columns="trial", errors="ignore")
    return whole.sort_index(level=["file", "row"], sort_remaining=False, kind="stable")


def _aperture_within(name: str, conditions: Mapping[str, str]) -> str | None:
    for theirs, ours in conditions.items():
        if theirs in name and (ours == PINHOLE or ours.startswith("f/")):
            return theirs
    found = WITHIN.search(name)
    if found is None and _fixation_within(name, conditions):
        *_, found = [None, *BARE.finditer(name)]
        sharp = [word for word in PARTS.split(name) if word.lower() in SHARP]
        return found.group() if found else next(iter(sharp), None)
    return found.group() if found else None


def _without_aperture(names: Sequence[str], conditions: Mapping[str, str]) -> list[str]:
    """A problem of columns that name a fixation, as columns of ratings do, and no aperture that is understood."""
    lost = [
        printable(one) for one in names if _fixation_within(one, conditions) and not _aperture_within(one, conditions)
    ]
    if not lost:
        return []
    return [
        f"Columns that were left out: {few(lost)}. They name a fixation, but no aperture that is understood: where "
        "they hold ratings, give the words' meaning (conditions), as in blurred=f/5.6,clear=pinhole."
    ]


def _fixation_within(name: str, conditions: Mapping[str, str]) -> bool:
    words = {theirs for theirs, ours in conditions.items() if ours in ("nearest", "farthest")}
    return any(word in name for word in words) or any(word.lower() in FIXED for word in PARTS.split(name))


def _named(name: str, conditions: Mapping[str, str]) -> tuple[str | None, str, str]:
    """Fixation, aperture and scene that a column's name holds."""
    aperture = str(_aperture_within(name, conditions))
    rest = " ".join(name.rsplit(aperture, 1))
    fixation, scene = None, []
    for theirs, ours in conditions.items():
        if ours in ("nearest", "farthest") and theirs in rest:
            fixation, rest = ours, rest.replace(theirs, " ", 1)
    for word in PARTS.split(rest):
        if fixation is None and word.lower() in FIXED:
            fixation = word
        elif word and word.lower() not in ("rating", "resp", "response"):
            scene.append(word)
    return fixation, aperture, " ".join(scene)


def _checked_cells(
    path: Path,
    table: pd.DataFrame,
    words: Words,
    lens: float | None,
    notes: list[str],
) -> pd.DataFrame:
    """The table with a column of apertures and one of fixations; what was assumed goes into the notes."""
    if "aperture" not in table and "aperture_mm" in table:
        diameters = numbers(table, "aperture_mm", table["aperture_mm"].str.strip())
        table["aperture"] = [f"{(lens or FOCAL_LENGTH_MM) / mm:.3g}" if mm > 0 else PINHOLE for mm in diameters]
        notes.append(f"Apertures are named by their f-numbers with a lens of {lens or FOCAL_LENGTH_MM:g} mm.")
    for role, add in (("aperture", "pinhole or f/5.6"), ("fixation", "near or far")):
        if role not in table:
            raise no_column(path, role, f", or add one that says {add} in each row")
    return table


def _of_intervals(table: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """The table with 1 where the interval of the picture was chosen, and 0 else, where ratings are intervals chosen."""
    if "interval" not in table:
        return table
    shown, chosen = (table[role].str.strip().str.casefold() for role in ("interval", "rating"))
    both = set(shown) - ABSENT
    if len(both) != 2 or not set(chosen) <= both | ABSENT or not set(shown) <= both:
        notes.append("The column of intervals was not used: answers are not intervals.")
        return table.drop(columns="interval")
    notes.append("Answers are intervals: 1 where the picture's was chosen, 0 where the reference's was.")
    answer = (shown == chosen).map({True: "1", False: "0"}).where(~chosen.isin(list(ABSENT)), "")
    return table.assign(rating=answer).drop(columns="interval")


LONGEST_RESPONSE_S = 60.0
"""Median response time (s) from which times are not in seconds: the longest that `Rules` keep."""


def _answers(
    path: Path, table: pd.DataFrame, theirs: Mapping[str, str], notes: list[str], notices: list[str]
) -> pd.DataFrame:
    """The rows with a rating, numbers as numbers and times in seconds."""
    table = without_codes(table, "rating", notices)
    table = answered(path, table, "rating", "rating", notes)
    table["rating"] = numbers(table, "rating", table["rating"])
    table = without_codes(table, "response_time", notices)
    for role in ("aperture_mm", "response_time", "dropped_frames"):
        if role in table:
            table[role] = numbers(table, role, table[role], empty=role != "aperture_mm")
    return in_seconds(table, "response_time", theirs.get("response_time", ""), LONGEST_RESPONSE_S, notices)


RENUMBERED = 0.3
"""Share of trials with the number of another from which numbers count within blocks; below, some trial stands twice."""


def _trials(table: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Trial numbers, supplied where they are missing."""
    by = [name for name in ("participant_id", "session") if name in table]
    if "trial" in table:
        again, same = table.duplicated([*by, "trial"]), table.duplicated()
        if not again.any():
            return table
        if same.equals(again):
            raise InputError(f"{place(table, same)}: a row above is the same in every cell: leave one of them out.")
        shown = table.duplicated([*by, "trial", "scene", "aperture", "fixation"])
        if shown.any() and again.mean() < RENUMBERED:
            raise InputError(
                f"{place(table, shown)}: trial {printable(str(table['trial'][shown].iloc[0]))} of participant "
                f"{table['participant_id'][shown].iloc[0]} stands in a row above with another answer: leave one of "
                f"them out ({rows_named(table, shown)})."
            )
        notes.append("The column of trials does not tell all trials apart and was not used.")
    table["trial"] = table.groupby(by, sort=False).cumcount() + 1
    notes.append("Trials are numbered as they stand in the file.")
    return table
