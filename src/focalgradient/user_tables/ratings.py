"""Import of depth ratings from the user's own table, wide or long, with any column names; assumptions are noted."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.analyses import Choices, OrdinalSteps, Ratios
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number
from focalgradient.user_tables.cleaning import check_seconds, note_groups
from focalgradient.user_tables.files import Paths
from focalgradient.user_tables.imported import ImportedAnswers
from focalgradient.user_tables.names import few
from focalgradient.user_tables.schema import ABSENT, RATINGS
from focalgradient.user_tables.source import Source, Where, choice_like, completed, conditions_like, where_like
from focalgradient.user_tables.tidy import FIXATIONS, PINHOLE, rating_table
from focalgradient.user_tables.trials import numbered
from focalgradient.user_tables.wide import MEASURES, OTHER_MEASURES, PARTS, long_columns, long_form, stem_of_columns
from focalgradient.user_tables.words import given_words, meant, whole_steps, with_diameters

__all__ = ["OwnRatings", "are_choices", "check_rating", "of_intervals", "rated", "read_ratings"]

FOCAL_LENGTH_MM = 50.0
"""Default focal length in mm, that of the paper's pictures, without a column aperture_mm or a value from the caller."""

LONGEST_RESPONSE_S, SHORTEST_RESPONSE_S = 60.0, 0.05
"""Maximum (as in `Rules`) and minimum median response time in seconds; others indicate another unit."""

MAX_PEOPLE_RATIO = 20.0
"""Maximum ratio of a person's median rating to that of the others: percentages are 100 times ratios."""

STANDARDS = (1, 10, 100)
"""Numbers of the standard that ratings in catch trials tell."""

NEAR_STANDARD = 2.0
"""Factor within which a median rating of the standard is near its number, as a rating that passes (`Rules`)."""

EXAMPLES = {"aperture": "pinhole or f/5.6", "fixation": "near or far"}
"""Cells of the columns of the conditions, for messages."""

RATING_WORDS = frozenset(("rating", "ratings", "depth", "perceived", "reported", "judgment", "judgement", "slider"))
"""Words of which names of columns of ratings consist."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnRatings(ImportedAnswers):
    """Imported ratings, in the form that `depth_rating` accepts: see `focalgradient.user_tables.tidy.rating_table`.

    Parameters
    ----------
    choices
        True if ratings are choices between a picture and a reference: 1 if the picture was chosen, else 0.
    """

    choices: bool = False


def read_ratings(
    path: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    *,
    where: Where | None = None,
    focal_length_mm: float | None = None,
    steps: bool = False,
    order: Sequence[str] = (),
) -> OwnRatings:
    r"""Read depth ratings from a CSV, TSV or XLSX file, one row per trial (long) or column per condition (wide).

    Parameters
    ----------
    path
        CSV, TSV, XLSX or JSON file, or several of one data set (one per participant), recognised by content.
    columns
        Name in the file of each column: participant, aperture, fixation, rating; optionally scene, trial, catch,
        session, response_time, aperture_mm; and interval (1 or 2, in which the picture was shown) if the ratings are
        the chosen interval. Without a column of ratings, every column whose name contains an aperture ("near_f5.6",
        "pinhole, far") is read as ratings; the rest of its name gives fixation and scene.
    conditions
        Meanings of the file's own words: {"vorn": "nearest", "weit offen": "f/5.6", "scharf": "pinhole"}. "near",
        "far", "f5.6", "5.6" and "0" are recognised automatically.
    where
        Values by column: only rows that have one of them are read, as in {"trial_type": ["slider"]}.
    focal_length_mm
        Focal length in millimetres, from which diameters follow by the f-number; None: 50, which is noted.
    steps
        True if the ratings are known to be ordinal steps; otherwise small integers from 1 are noted.
    order
        Words of the answers, from the least to the most, that become the steps 1, 2, ...

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid; the message names it.

    Examples
    --------
    >>> from focalgradient.user_tables.files import text_table
    >>> ratings = read_ratings(text_table("subject;fstop;focus;resp\nA ;5,6;near;1,4\nA ;0;near;1,0\n"))
    >>> ratings.table[["participant_id", "aperture", "fixation", "rating"]].values.tolist()
    [['A', 'f/5.6', 'nearest', 1.4], ['A', 'pinhole', 'nearest', 1.0]]
    """
    source = Source.read(path, RATINGS, long_columns(columns), where, conditions)
    check_rating(source)
    notes, notices = source.notes, source.notices
    words = given_words(conditions or {})
    if "rating" in source.columns:
        _require(source)
        source = source.without_pictures()
        table = source.rows()
    else:
        measure = (columns or {}).get("rating")
        table = long_form(source, conditions or {}, measure)
        if measure is not None and table.index.nlevels < 3:
            raise InputError(
                f"{source.name} has no column {printable(measure)} whose name holds an aperture, like near_f5.6: "
                f'{conditions_like("f/5.6")}, or compare these columns as they are with by=["'
                f'{printable(stem_of_columns(measure)) or "NAME"}"].'
            )
        _require(source, *table)
        table = source.cleaned(table)
    if "aperture" in table and "aperture_mm" not in table:
        table = with_diameters(table, source.columns.get("aperture", ""), words, notices)
    lens = FOCAL_LENGTH_MM if focal_length_mm is None else focal_length_mm
    if "aperture" not in table:
        diameters = source.numbers(table, "aperture_mm")
        table["aperture"] = [f"{lens / mm:.3g}" if mm > 0 else PINHOLE for mm in diameters]
        notes.append(f"Apertures are named by their f-numbers with a lens of {lens:g} mm.")
    table = rated(source, of_intervals(table, notes), order)
    steps = steps or bool(order)
    if "aperture_mm" in table:
        table["aperture_mm"] = source.numbers(table, "aperture_mm")
    table = meant(table, words, source.spoken, notices)
    choices = not steps and are_choices(table, notices)
    if "scene" not in table:
        table["scene"] = "all"
        notes.append("No scene column: all ratings are treated as one scene, so results do not generalise.")
    table = source.with_catch(table)
    if not (steps or choices):
        table = _to_standard(table, notices)
        by = "aperture_mm" if {"aperture", "aperture_mm"} & {*source.columns} == {"aperture_mm"} else "aperture"
        notices += whole_steps(table["rating"], by)
    table = numbered(source, table, ("scene", "aperture", "fixation"))
    if "aperture_mm" not in table:
        if focal_length_mm is None:
            notes.append(
                f"The apertures’ diameters are for a lens of {lens:g} mm: state another by focal_length_mm, or "
                "'focalgradient report --focal-length'."
            )
        table["aperture_mm"] = [0.0 if name == PINHOLE else lens / float(name[2:]) for name in table["aperture"]]
    if not (steps or choices):
        _note_no_pinhole(source, table)
    _note_groups(source, table, conditions or {})
    _note_scenes(table[~table["catch"]], notices)
    table = table.rename(columns={"slider_start": "start"})
    checked = rating_table(completed(table, "kind"), Choices() if choices else OrdinalSteps() if steps else Ratios())
    return OwnRatings.of(source, checked, choices=choices)


def _note_scenes(table: pd.DataFrame, notices: list[str]) -> None:
    """Note apertures, and objects in focus, that were shown in different scenes."""
    for of, varied, what in (
        (["scene", "fixation"], "aperture", "depth effects"),
        (["scene"], "fixation", "the difference of their depth effects"),
    ):
        levels = table.groupby(of)[varied].nunique()
        if table[varied].nunique() > 1 == levels.max() and table["scene"].nunique() > 1:
            notices.append(f"No scene was shown at two {varied}s: {what} cannot be separated from those of scenes.")


def _to_standard(table: pd.DataFrame, notices: list[str]) -> pd.DataFrame:
    """Return ratings as ratios to the standard, whose number catch trials tell if most people rate it near 10 or 100.

    A notice says so, or that most people rate it by another number than 1.
    """
    given = table[table["catch"] & (table["aperture"] == PINHOLE)]
    middles = given.groupby("participant_id")["rating"].median()
    for standard in STANDARDS:
        if (abs(np.log(middles.where(middles > 0) / standard)) < math.log(NEAR_STANDARD)).mean() > 0.5:
            if standard == 1:
                return table
            notices.append(
                f"Ratings were divided by {standard}, the standard, as ratings in catch trials are (their median: "
                f"{middles.median():g})."
            )
            return table.assign(
                **{role: table[role] / standard for role in ("rating", "slider_start") if role in table}
            )
    if len(middles):
        notices.append(
            f"The median rating of the standard, in catch trials, is {middles.median():g}, where 1 is right: divide "
            "all ratings by the number of the standard."
        )
    return table


def _note_no_pinhole(source: Source, table: pd.DataFrame) -> None:
    """Note that no aperture is the pinhole, with the call that compares apertures or takes the smallest for one."""
    least = int(table["aperture_mm"].to_numpy().argmin())
    column, name = source.columns.get("aperture"), str(table["aperture"].iloc[least])
    if name != PINHOLE and column is not None:
        name = source.cells.loc[table.index[least], column]
        source.notices.append(
            "No aperture is the pinhole, to which depth effects are ratios: compare apertures with "
            f'by=["{printable(column)}={printable(name)}"], or take {printable(name)} for the pinhole with '
            f'conditions={{"{printable(name)}": "{PINHOLE}"}}.'
        )


def _note_groups(source: Source, table: pd.DataFrame, conditions: Mapping[str, str]) -> None:
    """Note groups of people, whose near depth effects are not compared, with the options that compare them."""
    near = table[table["fixation"] == FIXATIONS[0]]
    index, near_index = (
        (of.index.droplevel(2) if of.index.nlevels > 2 else of.index).unique()  # type: ignore[arg-type]
        for of in (table, near)
    )
    cells, columns, options = source.cells.loc[index], source.columns, list[str]()
    if "fixation" in columns and not near.empty:
        options.append(where_like(columns["fixation"], str(cells.loc[near_index, columns["fixation"]].mode()[0])))
    elif table.index.nlevels > 2 and not near.empty:
        options.append(choice_like(table, "fixation", FIXATIONS[0]))
    if conditions:
        options.append(f"conditions={json.dumps(dict(conditions), ensure_ascii=False)}")
    by = [columns.get("aperture", columns.get("aperture_mm", "aperture"))]
    note_groups(cells[source.unused], cells[columns["participant_id"]], source.notices, by, options)


def check_rating(source: Source) -> None:
    """Raise `InputError` if rows hold several measures, or a column of answers was taken for the ratings beside one."""
    column, measures = source.columns.get("rating", ""), MEASURES | OTHER_MEASURES
    for name in source.unused:
        values = [value for value in source.cells[name].unique() if value.strip()]
        if not 1 < len(values) <= len(measures):
            continue
        spoken = [{word.casefold() for word in PARTS.split(value) if word} for value in values]
        if all(words and words <= measures for words in spoken) and not set.union(*spoken) <= {"n", "sd", "se"}:
            chosen = next((value for value in values if value.strip().casefold() in MEASURES), values[0])
            raise InputError(
                f"{source.name}: {printable(name)} says that rows hold several measures ({few(values)}): choose "
                f"one with {where_like(name, chosen)}."
            )
    if not column or "rating" in source.given or "interval" in source.columns or "rating" in column.casefold():
        return
    for name in source.unused:
        words = {word.casefold() for word in PARTS.split(name) if word}
        cells = [cell.replace(",", ".") for cell in source.cells[name].unique() if cell.strip()]
        if words and words <= RATING_WORDS and cells and all(as_number(cell) is not None for cell in cells):
            raise InputError(
                f"{source.name} has two columns that may hold ratings, {printable(column)} and {printable(name)}: "
                f'say which with columns={{"rating": "{printable(name)}"}}.'
            )


OTHERS = (
    "without ratings, thresholds need columns for level and correct (or level, interval and response), detection for "
    "signal and response, the cube for percept, gradient, trial and duration"
)
"""Roles of the columns of tables without ratings."""


def _require(source: Source, *present: str) -> None:
    """Raise `InputError` that names the missing columns of ratings; roles in `present` need none."""
    here = {*source.columns, *present}
    shown = [words for role, words in EXAMPLES.items() if not {role, f"{role}_mm"} & here]
    otherwise = ""
    if "rating" not in here:
        otherwise = (
            ", or give each condition a column whose name holds its aperture, like near_f5.6, or name with "
            f'by=["NAME"] the condition whose levels name the columns, like NAME_2 or [NAME 2]; {OTHERS}'
        )
    elif shown:
        add = f"add {'one that says' if len(shown) == 1 else 'columns that say'} {' and '.join(shown)} in each row"
        name = "NAME"
        if "aperture" in present:  # of the names of wide columns
            name, words = "aperture", conditions_like("near").replace("its", "their words'")
            add = f"{add}, {words}"
        otherwise = f', {add}, or name the conditions with by=["{name}"]'
    roles = [role for role in RATINGS.required if role != "fixation" or "rating" in here]  # optional in a report
    source.require(*roles, also=present, otherwise=otherwise)


def of_intervals(table: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Convert chosen intervals to 1 if the picture was chosen, else 0; other answers are unchanged."""
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


def are_choices(table: pd.DataFrame, notices: list[str]) -> bool:
    """Return whether all answers are 0 or 1, which is noted: they are choices between a picture and a reference."""
    choices = set(table["rating"]) == {0.0, 1.0}
    if choices:
        notices.append("All answers are 0 or 1: they are taken for choices of the picture (1) or of a reference (0).")
    return choices


def rated(source: Source, table: pd.DataFrame, order: Sequence[str] = ()) -> pd.DataFrame:
    """Return the rows with a rating, with numbers parsed and times in seconds."""
    table = source.answers(table, "rating", order)
    _note_units(source, table, "rating")
    role = "response_time"
    table = source.optional(
        table, role, lambda parsed: check_seconds(parsed, role, LONGEST_RESPONSE_S, SHORTEST_RESPONSE_S)
    )
    if role in table:
        _note_units(source, table, role)
    return source.optional(source.optional(table, "slider_start"), "dropped_frames")


def _note_units(source: Source, table: pd.DataFrame, role: str) -> None:
    """Add a notice if the values of some people are so large that their unit must be another."""
    middles = table[role].abs().groupby(table["participant_id"]).median()
    if middles.median() and (far := middles[middles > MAX_PEOPLE_RATIO * middles.median()]).size:
        source.notices.append(
            f"The {role.replace('_', ' ')}s of {few([*map(str, far.index)])} are {far.min() / middles.median():.0f} "
            "times those of the others: check that the units are the same."
        )
