"""Wide tables: one column of ratings for each condition, which its name states."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.user_tables.names import few
from focalgradient.user_tables.source import Source
from focalgradient.user_tables.tidy import PINHOLE
from focalgradient.user_tables.words import FIXED, SHARP

__all__ = ["GRID", "MEASURES", "OTHER_MEASURES", "PARTS", "long_columns", "long_form", "stacked", "stem_of_columns"]

MEASURES = frozenset(("rating", "ratings", "resp", "response", "depth", "score", "value", "judgment", "judgement"))
"""Words in names of wide columns that say nothing but that these are ratings."""

OTHER_MEASURES = frozenset(
    (
        *("rt", "rts", "time", "times", "ms", "latency", "duration", "onset", "confidence", "conf", "certainty"),
        *("sure", "clicks", "click", "order", "position", "trial", "n", "count", "sd", "se", "sem", "date", "start"),
    )
)
"""Words in names of wide columns of other measures."""

PARTS = re.compile(r"[\s_,;.:()\-]+")
GRID = "[*]"
"""Mark of columns whose names end with a level in brackets, as of grids in Google Forms and LimeSurvey."""

WITHIN = re.compile(r"pinhole|f/?(?:(?:1_[248]|2_[58]|3_[25]|4_5|5_6|6_3|7_1)(?!\d)|\d+(?:[.,]\d+)?)", re.IGNORECASE)
"""Aperture within a column name; "f5_6" for programs that allow no point in names."""

BARE = re.compile(r"(?<![^\s_,;:()\-])\d+(?:[.,]\d+)?(?![^\s_,;:()\-])")
"""Isolated number in a column name, read as an aperture if the name also contains a fixation."""


def long_columns(columns: Mapping[str, str] | None) -> Mapping[str, str] | None:
    """Return `columns` without a rating given as a word that names of wide columns hold, like rating=depth_*."""
    return {role: name for role, name in (columns or {}).items() if role != "rating" or not name.endswith("*")}


def stem_of_columns(measure: str) -> str:
    """Return the beginning of the names of wide columns, without the mark and what separates it from the rest.

    >>> stem_of_columns("depth_*"), stem_of_columns(GRID)
    ('depth', '')
    """
    return "" if measure == GRID else measure.rstrip("*_-. ")


class Heading(NamedTuple):
    """What the name of a wide column states: fixation and aperture if any, the rest, and the rest without measures."""

    fixation: str | None
    aperture: str | None
    rest: list[str]
    scene: str


def _heading(name: str, conditions: Mapping[str, str]) -> Heading:
    """Parse a column name by recognised words and those of the caller."""
    fixations = {theirs: ours for theirs, ours in conditions.items() if ours in FIXED.values()}
    has_fixation = any(word in name for word in fixations) or any(word.lower() in FIXED for word in PARTS.split(name))
    theirs = [word for word, ours in conditions.items() if word in name and (ours == PINHOLE or ours.startswith("f/"))]
    found = [match.group() for match in [*WITHIN.finditer(name)][:1]]
    if not theirs and not found and has_fixation:
        found = [match.group() for match in BARE.finditer(name)][-1:]
        found += [word for word in PARTS.split(name) if word.lower() in SHARP]
    aperture = next(iter(theirs + found), None)
    text = " ".join(name.rsplit(aperture, 1)) if aperture else name
    rest = [word for word in PARTS.split(text) if word and word.lower() not in FIXED]
    fixation = None
    for word, ours in fixations.items():
        if word in text:
            fixation, text = ours, text.replace(word, " ", 1)
    words = [word for word in PARTS.split(text) if word]
    if fixation is None and (fixed := [word for word in words if word.lower() in FIXED]):
        fixation = fixed[0]
        words.remove(fixation)
    return Heading(fixation, aperture, rest, " ".join(word for word in words if word.lower() not in MEASURES))


def long_form(source: Source, conditions: Mapping[str, str], measure: str | None) -> pd.DataFrame:
    """Convert a wide table to one row per rating; the index is (file, row, column).

    A table without columns of ratings is returned as it is.
    """
    headings = {name: _heading(name, conditions) for name in source.unused}
    if lost := [printable(name) for name, heading in headings.items() if heading.fixation and not heading.aperture]:
        source.problems.append(
            f"Columns that were skipped: {few(lost)}. They name a fixation but no known aperture: if they contain "
            'ratings, map their words with conditions={"blurred": "f/5.6", "clear": "pinhole"}.'
        )
    wide = _one_measure(source, {name: heading for name, heading in headings.items() if heading.aperture}, measure)
    stated: dict[str, dict[str, Any]] = {}
    for name, heading in wide.items():
        stated[name] = {"aperture": str(heading.aperture).replace("_", "."), "rating": source.cells[name]}
        if heading.fixation is not None:
            stated[name]["fixation"] = heading.fixation
        if heading.scene and "scene" not in source.columns:
            stated[name]["scene"] = heading.scene
    source.note_unused([name for name in headings if name not in wide])
    if scenes := [of_column["scene"] for of_column in stated.values() if "scene" in of_column]:
        source.notices.append(f"The remaining parts of the column names are treated as scenes: {few(scenes)}.")
    whole = stacked(source.renamed().drop(columns="trial", errors="ignore"), stated)
    keys = [source.cells[source.columns[name]] for name in ("participant_id", "scene") if name in source.columns]
    if keys and (again := pd.concat(keys, axis=1).duplicated()).any() and "session" not in source.columns:
        repeated = few([*keys[0][again].unique()])
        source.notices.append(f"Several rows of this wide table are taken for repetitions by one person: {repeated}.")
    return whole


def stacked(rows: pd.DataFrame, stated: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """Return the rows once for each wide column, with the cells that it states; the index is (file, row, column)."""
    if not stated:
        return rows.iloc[:0]
    parts = [rows.assign(**cells, column=name).set_index("column", append=True) for name, cells in stated.items()]
    return pd.concat(parts).sort_index(level=["file", "row"], sort_remaining=False, kind="stable")


def _one_measure(source: Source, wide: Mapping[str, Heading], measure: str | None) -> Mapping[str, Heading]:
    """Return the wide columns of ratings, where the table has further measures of each condition."""
    words = {name: [word.lower() for word in PARTS.split(name) if word] for name in wide}
    if measure is not None and measure.endswith("*"):
        stem = stem_of_columns(measure).lower()
        return {name: wide[name] for name in wide if stem in words[name] or name.lower().startswith(stem)}
    other = [name for name in wide if not OTHER_MEASURES.isdisjoint(words[name])]
    if other and len(other) < len(wide):
        source.notices.append(f"These columns were not taken for ratings, but for other measures: {few(other)}.")
        wide = {name: heading for name, heading in wide.items() if name not in other}
    for at in (0, -1):
        groups: dict[str, dict[tuple[str | None, str | None, str], str]] = {}
        for name, heading in wide.items():
            if rest := [*heading.rest]:
                key = rest.pop(at).lower()
                groups.setdefault(key, {})[heading.fixation, heading.aperture, " ".join(rest)] = name
        if len(groups) < 2 or len({frozenset(group) for group in groups.values()}) > 1 or "scene" in source.columns:
            continue
        named = [word for word in groups if word in MEASURES]
        texts = (source.cells[[*group.values()]].stack().str.replace(",", ".") for group in groups.values())
        middles = [pd.to_numeric(text, errors="coerce").median() for text in texts]
        if len(named) == 1 or max(middles) > 3 * max(min(middles), 1e-9):
            raise InputError(
                f"{source.name} has {len(groups)} columns for each condition, which begin or end with "
                f"{few([*groups])}: say which measure is the rating with "
                f'columns={{"rating": "{(named or [*groups])[0]}_*"}}.'
            )
    return wide
