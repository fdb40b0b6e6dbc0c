"""Import of ratings by any condition from the user's own table: no fixation, scene or repetition is needed."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number, is_date
from focalgradient.user_tables.cleaning import few_levels, note_groups
from focalgradient.user_tables.files import Paths, read_table
from focalgradient.user_tables.imported import ImportedAnswers
from focalgradient.user_tables.names import clean, few, invalid
from focalgradient.user_tables.ratings import are_choices, check_rating, of_intervals, rated
from focalgradient.user_tables.schema import RATINGS, Column, found_columns
from focalgradient.user_tables.source import Source, Where, choice_like, completed
from focalgradient.user_tables.trials import numbered
from focalgradient.user_tables.wide import GRID, long_columns, long_form, stacked, stem_of_columns
from focalgradient.user_tables.words import (
    FIXED,
    MOST_STEPS,
    Words,
    given_words,
    level_names,
    whole_steps,
    with_diameters,
)

__all__ = ["STEPS", "OwnConditions", "holds_conditions", "name_and_reference", "read_conditions"]

KEPT = (
    *("participant_id", "rating", "scene", "catch", "kind", "session", "trial", "repetition", "interval"),
    *("response_time", "dropped_frames"),
)
"""Roles that are read besides the conditions."""

NO_CONDITIONS = ("participant_id", "rating", "catch", "kind")
"""Roles whose columns are not conditions."""

CONDITION = Column(shown=True, compared=True, answer="condition", absent=frozenset({"", "na", "n/a", "nan", "null"}))
"""Column of a condition whose levels are names."""

SHARP = frozenset(("pinhole", "ph", "sharp", "0", "f/inf"))
"""Names of levels without blur, which stand first."""

DEGREES = (
    *("pinhole", "sharp", "dim", "none", "without", "no", "off", "pre", "before"),
    *("low", "weak", "slight", "mild", "small", "short"),
    *("medium", "moderate", "middle", "with", "yes", "on", "post", "after"),
    *("high", "strong", "large", "long", "bright", "severe"),
)
"""Words of levels from the least to the most, the order of conditions all of whose levels are among them."""

STEPS = "Answers are averaged as they stand, not as ratios: effects are tested without an ordinal model."
"""Statement on ratings that are steps of a scale, or positions on a line."""

ORDINAL = (
    "An ordinal model needs the object in focus: add a column fixation, with nearest in each row if it was always the "
    "nearest."
)
"""Notice on steps by apertures."""

MOST_LEVELS = 50
"""Maximum number of levels of a condition that is not numeric."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnConditions(ImportedAnswers):
    """Imported ratings with their conditions.

    The columns are participant_id, rating, catch, kind, the conditions, and scene if there is one.

    Parameters
    ----------
    conditions
        Columns of the conditions, each with its levels: the reference first, then in ascending order.
    log
        True if all ratings are above 0 and are analysed on their logarithm.
    steps
        True if ratings are steps of a scale.
    """

    conditions: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    log: bool = False
    steps: bool = False


def holds_conditions(path: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table has ratings and apertures, but no fixation: conditions are then its other columns."""
    columns = columns or {}
    if columns.get("rating", "").endswith("*") or not {*columns} <= {"participant", *RATINGS.columns}:
        return False
    table = read_table(path)
    found = found_columns(table.name, table.cells, RATINGS, columns)
    return "rating" in found and "fixation" not in found and bool({"aperture", "aperture_mm"} & set(found))


def read_conditions(
    path: Paths,
    columns: Mapping[str, str] | None = None,
    by: Sequence[str] = (),
    where: Where | None = None,
    *,
    steps: bool = False,
    order: Sequence[str] = (),
    conditions: Mapping[str, str] | None = None,
) -> OwnConditions:
    r"""Read ratings by condition from a CSV, TSV, XLSX or JSON file, with one row per trial or column per condition.

    Parameters
    ----------
    path
        The file, or several of one data set.
    columns
        Name in the file of each column: participant and rating; optionally scene, catch and aperture_mm.
    by
        Columns of the conditions, or their roles; none: that of the apertures. Numbers are amounts, whose slope is
        tested; those of "NAME=factor", and f-numbers, are names of levels. "NAME=LEVEL" states the reference, with
        which the others are compared; by default it is the one without blur ("pinhole", "sharp", "0"), else the largest
        f-number, the smallest number, the least word of degree (`DEGREES`), or the first word of the alphabet.
    where
        Values by column: only rows that have one of them are read.
    steps
        True if the ratings are steps of a scale, which are not analysed on their logarithm.
    order
        Words of the answers, from the least to the most: see `focalgradient.statistics.read_ratings`.
    conditions
        Meanings of the file's own words: {"scharf": "pinhole"}.

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid; the message names it.

    Examples
    --------
    >>> from focalgradient.user_tables.files import text_table
    >>> ratings = read_conditions(text_table("subject,aperture_mm,rating\nA,2,1.1\nA,8,1.4\nB,2,1.0\nB,8,1.3\n"))
    >>> dict(ratings.conditions), ratings.log
    ({'aperture_mm': [2.0, 8.0]}, True)
    """
    source = Source.read(path, RATINGS, long_columns(columns), where, conditions)
    check_rating(source)
    file = source.cells
    if "rating" not in source.columns:
        headers = {clean(str(name)).casefold() for name in (*source.cells, *source.columns)}
        named = [name_and_reference(stated, headers)[0] for stated in by]
        absent = [name for name in named if clean(name).casefold() not in headers]
        measure = (columns or {}).get("rating") or _implied_measure(source, absent)
        condition = stem_of_columns(measure or "") or (absent or named or ["level"])[0]
        is_stated = any(name_and_reference(name, [condition])[0] == condition for name in by)
        if not (measure and is_stated):
            source = _melted(source, conditions or {}, measure)
        if "rating" not in source.columns and measure is not None:
            source = _levels_in_columns(source, measure, condition)
            by = by if is_stated else [condition, *by]
    source.require("participant_id", "rating")
    by = by or [source.columns[role] for role in ("aperture_mm", "aperture") if role in source.columns][:1]
    by_name = source.columns | {clean(str(name)).casefold(): str(name) for name in source.cells}
    stated = [name_and_reference(name, by_name) for name in by]
    theirs = [by_name.get(clean(name).casefold(), "") for name, _ in stated]
    references = {column: level for column, (_, level) in zip(theirs, stated, strict=True) if level}
    if not by or not all(theirs):
        missing = f"no column {stated[theirs.index('')][0]}" if by else "no column of conditions"
        raise InputError(f"{source.name} has {missing}: give by, one or more of {few([*map(str, source.cells)])}.")
    source = _with_meanings(source, theirs, references, given_words(conditions or {}))
    for role, name in [*source.columns.items()]:
        if role in NO_CONDITIONS and (name in theirs or role in theirs):
            raise InputError(f"by names {name}, which is the column of the {role}: give a condition.")
        if name in theirs or role not in KEPT:
            del source.columns[role]
    source.columns.update({name: name for name in theirs})
    defined = {role: column._replace(shown=False) for role, column in RATINGS.columns.items() if role not in theirs}
    for name in theirs:
        is_number = name not in references and _is_numeric(source.cells[name])
        defined[name] = CONDITION._replace(number=True, codes="signed") if is_number else CONDITION
    source = replace(source, schema=RATINGS._replace(columns=defined)).without_pictures(theirs)
    table = rated(source, of_intervals(source.rows(), source.notes), order)
    levels: dict[str, Sequence[Any]] = {}
    for name in theirs:
        table = source.answers(table, name)
        if defined[name].number:
            levels[name] = _numeric_levels(source, table[name])
        else:
            levels[name] = _named_levels(source, table, name, references.get(name, ""))
        if len(levels[name]) < 2:
            only = f"{printable(name)} has the one level {levels[name][0]}: give a condition that varies."
            raise InputError(" ".join([only, *source.problems]))
    table = source.with_catch(table, note=False)
    table = completed(numbered(source, table, [*(["scene"] if "scene" in table else []), *theirs]), "kind")
    low = int((table["rating"] <= 0).sum())
    log = not (low or steps or order)
    if low and not (steps or order or are_choices(table, source.notices)):
        source.notices.append(
            f"Ratings of 0 or less ({low:,} of {len(table):,}) have no logarithm: ratings are analysed as they stand, "
            "not as ratios."
        )
    if steps or order:
        source.notices.append(STEPS)
        by_aperture = {*theirs} & {source.columns.get("aperture"), source.columns.get("aperture_mm")}
        if by_aperture and table["rating"].max() <= MOST_STEPS:
            source.notices.append(ORDINAL)
    elif log:
        source.notices.extend(whole_steps(table["rating"]))
    cells = source.cells.loc[table.index]
    people = cells[source.columns["participant_id"]]
    note_groups(cells[source.unused], people, source.notices, theirs)
    for name, values in few_levels(cells[source.unused], [people, *(cells[by] for by in theirs)]).items():
        shown = printable(name)
        is_scene = "scene" not in table and name not in RATINGS.columns
        scenes = f'; if it names the scenes, give columns={{"scene": "{shown}"}}' if is_scene else ""
        source.notices.append(
            f'Ratings are means over {shown} ({values}): if it is a condition, add by=["{shown}"], or choose a level '
            f"with {choice_like(cells, name, min(cells[name]))}{scenes}."
        )
    return OwnConditions.of(replace(source, cells=file), table, conditions=levels, log=log, steps=steps or bool(order))


def _melted(source: Source, conditions: Mapping[str, str], measure: str | None) -> Source:
    """Return a wide table with a row for each rating; one without columns of ratings as it is."""
    table = long_form(replace(source, notes=[]), conditions, measure)  # unused columns are noted later
    if table.index.nlevels < 3:
        return source
    stated = {role: role for role in ("aperture", "fixation", "scene", "rating") if role in table}
    stated = {role: role for role in stated if role not in source.columns}
    cells = source.cells.loc[table.index.droplevel(2)].set_axis(table.index)  # type: ignore[arg-type]
    cells = cells.drop(columns=table.index.get_level_values(2).unique()).assign(**table[[*stated]].fillna(""))
    cells.attrs = source.cells.attrs
    columns = {role: name for role, name in source.columns.items() if role != "trial"}  # one for all ratings of a row
    return replace(source, cells=cells, columns=columns | stated)


SEPARATOR = re.compile(r"^(?:\s*-\s+|[_ (:=]+|[-.])|[_\-. )]+$")
"""What stands between condition and level in the name of a wide column, and after it; a minus of the level stays."""


def _implied_measure(source: Source, absent: Sequence[str]) -> str | None:
    """Return the mark of wide columns that begin with the one `absent` condition, or are named by its levels alone."""
    marks = (f"{absent[0]}_*", "*", GRID) if len(absent) == 1 else ()
    return next((mark for mark in marks if len(_levels_by_column(source, mark)) > 1), None)


def _levels_by_column(source: Source, measure: str) -> dict[str, str]:
    """Return the level that each wide column of a measure names; of "*" those named by numbers alone.

    Of `GRID` it stands in brackets at the end; the rest, but for codes in brackets, must be one question.
    """
    if measure == GRID:
        grid = {name: found[1] for name in source.unused if (found := re.search(r"\[([^][]+)\]$", name.strip()))}
        return grid if len({re.sub(r"\[[^][]*\]", "", name) for name in grid}) == 1 else {}
    stem = stem_of_columns(measure)
    if not stem:
        return {name: name for name in source.unused if as_number(name) is not None}
    levels = {name: SEPARATOR.sub("", name[len(stem) :]) for name in source.unused if name.startswith(stem)}
    return {name: level for name, level in levels.items() if level}


def _levels_in_columns(source: Source, measure: str, condition: str) -> Source:
    r"""Return a wide table with a row for each rating and a column for its condition.

    >>> from focalgradient.user_tables.files import text_table
    >>> table = text_table("subject,depth_low,depth_high\nA,1.1,1.4\nB,1.0,1.3\n")
    >>> dict(read_conditions(table, {"rating": "depth_*"}, ["depth=low"]).conditions)
    {'depth': ['low', 'high']}
    >>> dict(read_conditions(text_table("subject,0,2\nA,1.1,1.4\nB,1.0,1.3\n"), by=["blur"]).conditions)
    {'blur': [0.0, 2.0]}
    >>> survey = text_table("subject,How deep? [blur 0],How deep? [blur 2]\nA,1,4\nB,2,3\n")
    >>> dict(read_conditions(survey, by=["blur"]).conditions)
    {'blur': [0.0, 2.0]}
    """
    named = re.compile(rf"^{re.escape(condition)}(?=[\W\d_])(.+)", re.IGNORECASE)
    levels = {
        name: SEPARATOR.sub("", found[1]) if (found := named.match(level)) else level
        for name, level in _levels_by_column(source, measure).items()
    }
    if not levels:
        raise InputError(f"{source.name} has no columns {measure}: it has {few([*map(str, source.cells)])}.")
    source.notices.append(f"Ratings were read from a column for each level of {condition}: {few([*levels])}.")
    stated = {name: {condition: level, "rating": source.cells[name]} for name, level in levels.items()}
    if "participant_id" not in source.columns:
        rows = [f"row {row}" for _, row in source.cells.index]
        source = replace(source, cells=source.cells.assign(**{"participant (row)": rows}))
        source.columns["participant_id"] = "participant (row)"
        source.notices.append("No participant column: each row is treated as one participant.")
    cells = stacked(source.cells.drop(columns=[*levels]), stated)
    cells.attrs = source.cells.attrs
    columns = {role: name for role, name in source.columns.items() if role != "trial"}  # one for all ratings of a row
    return replace(source, cells=cells, columns=columns | {"rating": "rating"})


def _with_meanings(source: Source, by: Sequence[str], references: dict[str, str], words: Words) -> Source:
    """Return the table with the meanings of the caller's words, and standard names of apertures, as levels of `by`.

    The `references` are renamed, too; words that do not occur are noted.
    """
    cells, used = source.cells, set[str]()
    for name in by:
        is_aperture = source.columns.get("aperture") == name and references.get(name) != "factor"
        shown = cells[name][~cells[name].str.strip().str.casefold().isin([*CONDITION.absent])]
        used |= {clean(cell).casefold() for cell in shown.unique()}
        if is_aperture:
            sized = with_diameters(shown.to_frame("aperture"), name, words, source.notices)
            if "aperture_mm" in sized and name in references:
                continue  # diameters are levels by their own names
            if "aperture_mm" in sized:
                cells = cells.assign(**{name: cells[name].mask(cells.index.isin(sized.index), sized["aperture_mm"])})
                continue
        names = level_names(shown, words, apertures=is_aperture)
        cells = cells.assign(**{name: cells[name].map(lambda cell, names=names: names.get(cell, cell))})
        if name in references:
            alike = {clean(cell).casefold(): level for cell, level in names.items()}
            references[name] = alike.get(clean(references[name]).casefold(), references[name])
    headers = clean(source.spoken).casefold()
    if absent := [
        word
        for key, (word, meaning) in words.items()
        if not (key in used or key in headers or clean(meaning).casefold() in FIXED)
    ]:
        source.notices.append(f"The conditions name words that do not occur in {few(by)}: {few(absent)}.")
    return replace(source, cells=cells)


def _numeric_levels(source: Source, values: pd.Series[float]) -> list[float]:
    """Return the levels in ascending order; a notice tells that integers may be codes."""
    levels = sorted(values.unique().tolist())
    if len(levels) > 2 and levels in ([*range(len(levels))], [*range(1, len(levels) + 1)]):
        source.notices.append(
            f"The levels of {values.name} are {few([f'{level:g}' for level in levels])}, which were taken for "
            f'amounts: if they are codes, give by=["{values.name}=factor"].'
        )
    return levels


def name_and_reference(name: str, columns: Collection[str]) -> tuple[str, str]:
    """Split "NAME=LEVEL" into the column and its level of reference, "factor" for the default one.

    >>> name_and_reference("group=young", ["group"]), name_and_reference("a=b", ["a=b"])
    (('group', 'young'), ('a=b', ''))
    """
    column, _, level = name.rpartition("=")
    return (column, level.strip()) if column and clean(name).casefold() not in columns else (name, "")


def _named_levels(source: Source, table: pd.DataFrame, name: str, reference: str) -> list[str]:
    """Return the levels, the reference first: the one given unless "factor", else in the order of `_place_of_level`.

    Without a reference a notice tells that levels may be numbers.
    """
    levels, is_factor = list(map(str, table[name].unique())), bool(reference)
    dates = table[name].map(is_date).astype(bool)
    if dates.any() and not dates.all():
        why = (
            "but other levels are not dates: a spreadsheet program may have made it of a number; enter it again as text"
        )
        raise invalid(table, name, dates, why)
    if not is_factor and any(level[:1].isdigit() for level in levels):
        source.notices.append(
            f"The levels of {name} are not all numbers ({few(levels)}), and were taken for names: give "
            f'by=["{name}=factor"] if they are, conditions={{"NAME": "f/5.6"}} for apertures, or numbers with the unit '
            "in the heading."
        )
    alike = [level for level in levels if [*map(str.casefold, levels)].count(level.casefold()) > 1]
    if alike and not is_factor:
        raise InputError(
            f"{printable(name)} has levels that differ only in case ({few(alike)}): give them one spelling, or "
            f'by=["{printable(name)}=factor"] if they are different.'
        )
    if len(levels) > MOST_LEVELS:
        raise InputError(f"{printable(name)} has {len(levels)} levels that are not numbers: give a condition.")
    if {level.casefold() for level in levels} <= {*DEGREES}:
        levels.sort(key=lambda level: DEGREES.index(level.casefold()))
    else:
        levels.sort(key=_place_of_level)
    first = [level for level in levels if clean(level).casefold() == clean(reference).casefold()]
    if reference not in ("", "factor") and not first:
        raise InputError(
            f"by states {printable(name)}={printable(reference)}, but no level is {printable(reference)}: give one of "
            f"{few(levels)} as the reference."
        )
    return [*first, *(level for level in levels if level not in first)]


def _place_of_level(level: str) -> tuple[bool, float, str, str]:
    """Return by what levels are sorted: those without blur, f-numbers from the largest, numbers, words.

    >>> sorted(["slight", "f/5.6", "10", "pinhole", "f/11", "2 D", "none"], key=_place_of_level)
    ['pinhole', 'f/11', 'f/5.6', '2 D', '10', 'none', 'slight']
    """
    number = re.match(r"(f/?)?(-?\d+(?:[.,]\d+)?)", level.casefold())
    size = math.inf if number is None else float(number[2].replace(",", ".")) * (-1 if number[1] else 1)
    return level.casefold() not in SHARP, size, level.casefold(), level


def _is_numeric(cells: pd.Series[str]) -> bool:
    """Return whether all cells are numbers with either decimal mark, or empty, or repeat the heading."""
    others = ("", "na", "n/a", clean(str(cells.name)).casefold())
    texts = [cell.strip() for cell in cells.unique() if clean(cell).casefold() not in others]
    return bool(texts) and all(as_number(clean(text).replace(",", ".")) is not None for text in texts)
