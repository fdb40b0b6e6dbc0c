"""Import of depth ratings from the user's own table, wide or long, with any column names; assumptions are noted."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number
from focalgradient.scales.analyses import Choices, Ratios
from focalgradient.statistics.own_files import Paths
from focalgradient.statistics.own_names import ABSENT, few, place, rows_named
from focalgradient.statistics.own_rows import check_seconds, in_steps, without_codes, without_copies
from focalgradient.statistics.own_tables import (
    PARTICIPANT,
    Source,
    Where,
    answered,
    catch_trials,
    completed,
    renamed,
    unused,
    where_like,
)
from focalgradient.statistics.own_words import FIXED, SHARP, Words, given_words, meant, whole_steps, with_diameters
from focalgradient.statistics.tables import PINHOLE, rating_table

__all__ = ["OwnRatings", "check_rating", "long_columns", "numbered", "rated", "read_ratings"]

FOCAL_LENGTH_MM = 50.0
"""Default focal length in mm, that of the paper's pictures, without a column aperture_mm or a value from the caller."""

ROLES = {
    "participant_id": PARTICIPANT,
    "aperture": ("f_number", "fnumber", "fstop", "f-stop"),
    "aperture_mm": ("aperture (mm)", "aperture [mm]", "diameter", "diameter_mm", "diameter (mm)", "pupil_mm"),
    "fixation": ("focus", "fixated"),
    "rating": (
        *("answer", "response", "resp", "choice", "chosen", "chosen_interval", "slider"),
        *("depth_rating", "depth rating", "rating_depth", "rated_depth", "perceived_depth", "perceived depth"),
        *("depth_judgment", "depth_judgement", "judgment", "judgement", "bewertung", "urteil"),
    ),
    "interval": ("picture_interval", "target_interval"),
    "scene": ("picture", "image", "item", "stimulus"),
    "trial": ("trial_number", "trial number", "trial_index", "trial_nr", "trial_no", "trials.thisn"),
    "session": (),
    "catch": (),
    "response_time": ("rt", "reaction_time"),
    "repetition": ("rep", "repeat", "replicate", "replication", "repetition_number", "wiederholung"),
    "dropped_frames": (),
    "kind": (),
}
"""Required and optional columns, each with the names recognised automatically."""

NUMERIC = ("rating", "aperture_mm", "response_time", "dropped_frames")
"""Roles of numbers."""

SHOWN = ("aperture", "aperture_mm", "fixation", "scene")
"""Roles that say what was shown."""

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
WITHIN = re.compile(r"pinhole|f/?(?:(?:1_[248]|2_[58]|3_[25]|4_5|5_6|6_3|7_1)(?!\d)|\d+(?:[.,]\d+)?)", re.IGNORECASE)
"""Aperture within a column name; "f5_6" for programs that allow no point in names."""

BARE = re.compile(r"(?<![^\s_,;:()\-])\d+(?:[.,]\d+)?(?![^\s_,;:()\-])")
"""Isolated number in a column name, read as an aperture if the name also contains a fixation."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnRatings:
    """Imported ratings, in the form that `depth_rating` accepts.

    Parameters
    ----------
    table
        One row per trial: see `focalgradient.statistics.tables.rating_table`. The index contains file and row.
    notes
        Assumptions, omissions and changes, one sentence each.
    problems
        Omitted data that may be ratings, one sentence each.
    notices
        Interpretations that change the results, one sentence each, shown at the top of a report.
    choices
        True if ratings are choices between a picture and a reference: 1 if the picture was chosen, else 0.
    """

    table: pd.DataFrame
    notes: tuple[str, ...]
    problems: tuple[str, ...] = ()
    notices: tuple[str, ...] = ()
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
    >>> from focalgradient.statistics.own_files import text_table
    >>> own = read_ratings(text_table("subject;fstop;focus;resp\nA ;5,6;near;1,4\nA ;0;near;1,0\n"))
    >>> own.table[["participant_id", "aperture", "fixation", "rating"]].values.tolist()
    [['A', 'f/5.6', 'nearest', 1.4], ['A', 'pinhole', 'nearest', 1.0]]
    """
    own = Source.read(path, ROLES, long_columns(columns), where)
    check_rating(own)
    headers, notes, notices = list(own.cells), own.notes, own.notices
    words = given_words(conditions or {})
    if "rating" not in own.columns:
        others = [str(name) for name in own.cells if name not in own.columns.values()]
        own.problems.extend(_without_aperture(others, conditions or {}))
        table = own.cleaned(_long(own, conditions or {}, (columns or {}).get("rating")), NUMERIC, [])
    else:
        _check_columns(own)
        table = own.rows(NUMERIC, SHOWN)
    if "aperture" in table and "aperture_mm" not in table:
        table = with_diameters(table, own.columns.get("aperture", ""), words, notices)
    table = _checked_cells(own, table, words, focal_length_mm)
    table = _of_intervals(table, notes)
    table = rated(own, table, order)
    steps = steps or bool(order)
    if "aperture_mm" in table:
        table["aperture_mm"] = own.numbers(table, "aperture_mm")
    table = meant(table, words, " ".join(map(str, headers)), notices)
    choices = not steps and set(table["rating"]) == {0.0, 1.0}
    if choices:
        notices.append("All answers are 0 or 1: they are taken for choices of the picture (1) or of a reference (0).")
    elif not steps:
        notices += whole_steps(table["rating"])
    if "scene" not in table:
        table["scene"] = "all"
        notes.append("No scene column: all ratings are treated as one scene, so results do not generalise.")
    table = numbered(own, catch_trials(table, notes), ("scene", "aperture", "fixation"))
    lens = FOCAL_LENGTH_MM if focal_length_mm is None else focal_length_mm
    if "aperture_mm" not in table:
        if focal_length_mm is None:
            notes.append(f"The apertures’ diameters are for a lens of {lens:g} mm: state another (the focal length).")
        table["aperture_mm"] = [0.0 if name == PINHOLE else lens / float(name[2:]) for name in table["aperture"]]
    table = completed(table, "kind")
    checked = rating_table(table, Choices() if choices else Ratios())
    return OwnRatings(checked, tuple(notes), tuple(own.problems), tuple(notices), choices)


RATINGS = frozenset(("rating", "ratings", "depth", "perceived", "reported", "judgment", "judgement", "slider"))
"""Words of which names of columns of ratings consist."""


def check_rating(own: Source) -> None:
    """Raise `InputError` if rows hold several measures, or a column of answers was taken for the ratings beside one."""
    column = own.columns.get("rating", "")
    measures = MEASURES | OTHER_MEASURES
    for name in own.cells:
        values = [value for value in own.cells[name].unique() if value.strip()]
        if 1 < len(values) <= len(measures) and name not in own.columns.values():
            spoken = [{word.casefold() for word in PARTS.split(value) if word} for value in values]
            if all(word and word <= measures for word in spoken) and not all(
                word <= {"n", "sd", "se"} for word in spoken
            ):
                chosen = next((value for value in values if value.strip().casefold() in MEASURES), values[0])
                raise InputError(
                    f"{own.name}: {printable(str(name))} says that rows hold several measures ({few(values)}): choose "
                    f"one with {where_like(str(name), chosen)}."
                )
    if not column or "rating" in own.given or "interval" in own.columns or "rating" in column.casefold():
        return
    for name in own.cells:
        words = {word.casefold() for word in PARTS.split(str(name)) if word}
        cells = [cell.replace(",", ".") for cell in own.cells[name].unique() if cell.strip()]
        if name in own.columns.values() or not words or not words <= RATINGS or not cells:
            continue
        if all(as_number(cell) is not None for cell in cells):
            raise InputError(
                f"{own.name} has two columns that may hold ratings, {printable(column)} and {printable(str(name))}: "
                f'say which with columns={{"rating": "{printable(str(name))}"}}.'
            )


def _check_columns(own: Source, *present: str) -> None:
    """Raise `InputError` that names the missing columns of ratings; roles in `present` need none."""
    here = {*own.columns, *present, *(["aperture"] if "aperture_mm" in own.columns else [])}
    missing = [role for role in ("participant_id", "aperture", "fixation", "rating") if role not in here]
    otherwise = ""
    if "rating" in missing:
        otherwise = ", or give each condition a column whose name holds its aperture, like near_f5.6"
    elif shown := [word for role, word in EXAMPLES.items() if role in missing]:
        add = f"add {'one that says' if len(shown) == 1 else 'columns that say'} {' and '.join(shown)} in each row"
        otherwise = f', {add}, or say what was varied with by=["NAME"]'
    own.require(*missing, otherwise=otherwise)


EXAMPLES = {"aperture": "pinhole or f/5.6", "fixation": "near or far"}
"""Cells of the columns of what was shown, for messages."""


def long_columns(columns: Mapping[str, str] | None) -> Mapping[str, str] | None:
    """Return `columns` without a rating given as a word that names of wide columns hold, like rating=depth_*."""
    return {role: name for role, name in (columns or {}).items() if role != "rating" or not name.endswith("*")}


def _long(own: Source, conditions: Mapping[str, str], measure: str | None) -> pd.DataFrame:
    """Convert a wide table to one row per rating; the index is (file, row, column)."""
    others = [str(name) for name in own.cells if name not in own.columns.values()]
    wide = [name for name in others if _aperture_within(name, conditions)]
    wide = _one_measure(own, wide, conditions, measure)
    if not wide:
        _check_columns(own)
    parts, scenes = [], []
    for name in wide:
        fixation, aperture, scene = _named(name, conditions)
        part = renamed(own.cells, own.columns)
        part = part.assign(aperture=aperture.replace("_", "."), rating=own.cells[name], column=name)
        if fixation is not None:
            part["fixation"] = fixation
        if scene and "scene" not in own.columns:
            part["scene"] = scene
            scenes.append(scene)
        parts.append(part.set_index("column", append=True))
    own.notes.extend(unused([name for name in others if name not in wide]))
    if scenes:
        own.notices.append(f"The remaining parts of the column names are treated as scenes: {few(scenes)}.")
    whole = pd.concat(parts).drop(columns="trial", errors="ignore")
    _check_columns(own, *whole)
    again = own.cells[own.columns["participant_id"]].duplicated()
    if again.any() and "session" not in own.columns:
        own.notices.append(
            f"{few([*own.cells[own.columns['participant_id']][again]])} has several rows of this wide table, which are "
            "taken for repetitions by one person."
        )
    return whole.sort_index(level=["file", "row"], sort_remaining=False, kind="stable")


def _one_measure(own: Source, wide: list[str], conditions: Mapping[str, str], measure: str | None) -> list[str]:
    """Return the wide columns of ratings, where the table has further measures of each condition."""
    words = {name: [word.lower() for word in PARTS.split(name) if word] for name in wide}
    if measure is not None and measure.endswith("*"):
        stem = measure.rstrip("*_-. ").lower()
        return [name for name in wide if stem in words[name] or name.lower().startswith(stem)]
    other = [name for name in wide if not OTHER_MEASURES.isdisjoint(words[name])]
    if other and len(other) < len(wide):
        own.notices.append(f"These columns were not taken for ratings, but for other measures: {few(other)}.")
        wide = [name for name in wide if name not in other]
    rests = {name: _named(name, conditions) for name in wide}
    for at in (0, -1):
        groups: dict[str, dict[tuple[str | None, str, str], str]] = {}
        for name in wide:
            fixation, aperture, _ = rests[name]
            rest = [
                word for word in PARTS.split(" ".join(name.rsplit(aperture, 1))) if word.lower() not in FIXED and word
            ]
            if rest:
                key = rest.pop(at)
                groups.setdefault(key.lower(), {})[fixation, aperture, " ".join(rest)] = name
        if len(groups) < 2 or len({frozenset(group) for group in groups.values()}) > 1 or "scene" in own.columns:
            continue
        named = [word for word in groups if word in MEASURES]
        middles = {
            word: pd.to_numeric(own.cells[[*group.values()]].stack().str.replace(",", "."), errors="coerce").median()
            for word, group in groups.items()
        }
        unlike = max(middles.values()) > 3 * max(min(middles.values()), 1e-9)
        if len(named) == 1 or unlike:
            raise InputError(
                f"{own.name} has {len(groups)} columns for each condition, which begin or end with {few([*groups])}: "
                f'say which measure is the rating with columns={{"rating": "{(named or [*groups])[0]}_*"}}.'
            )
    return wide


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
    """Report columns that name a fixation, as rating columns do, but no recognised aperture."""
    lost = [
        printable(one) for one in names if _fixation_within(one, conditions) and not _aperture_within(one, conditions)
    ]
    if not lost:
        return []
    return [
        f"Columns that were skipped: {few(lost)}. They name a fixation but no known aperture: if they contain ratings, "
        "map them with conditions, as in blurred=f/5.6,clear=pinhole."
    ]


def _fixation_within(name: str, conditions: Mapping[str, str]) -> bool:
    words = {theirs for theirs, ours in conditions.items() if ours in ("nearest", "farthest")}
    return any(word in name for word in words) or any(word.lower() in FIXED for word in PARTS.split(name))


def _named(name: str, conditions: Mapping[str, str]) -> tuple[str | None, str, str]:
    """Return the fixation, aperture and scene given by a column name."""
    aperture = str(_aperture_within(name, conditions))
    rest = " ".join(name.rsplit(aperture, 1))
    fixation, scene = None, []
    for theirs, ours in conditions.items():
        if ours in ("nearest", "farthest") and theirs in rest:
            fixation, rest = ours, rest.replace(theirs, " ", 1)
    for word in PARTS.split(rest):
        if fixation is None and word.lower() in FIXED:
            fixation = word
        elif word and word.lower() not in MEASURES:
            scene.append(word)
    return fixation, aperture, " ".join(scene)


def _checked_cells(own: Source, table: pd.DataFrame, words: Words, lens: float | None) -> pd.DataFrame:
    """Return the table with apertures and fixations; append assumptions to the notes."""
    if "aperture" not in table and "aperture_mm" in table:
        diameters = own.numbers(table, "aperture_mm")
        table["aperture"] = [f"{(lens or FOCAL_LENGTH_MM) / mm:.3g}" if mm > 0 else PINHOLE for mm in diameters]
        own.notes.append(f"Apertures are named by their f-numbers with a lens of {lens or FOCAL_LENGTH_MM:g} mm.")
    return table


def _of_intervals(table: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
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


LONGEST_RESPONSE_S, SHORTEST_RESPONSE_S = 60.0, 0.05
"""Maximum (as in `Rules`) and minimum median response time in seconds; others indicate another unit."""


MAX_PEOPLE_RATIO = 20.0
"""Maximum ratio of a person's median rating to that of the others: percentages are 100 times ratios."""


def rated(own: Source, table: pd.DataFrame, order: Sequence[str] = ()) -> pd.DataFrame:
    """Return the rows with a rating, with numbers parsed and times in seconds."""
    table = without_codes(in_steps(table, "rating", order, own.notes), "rating", own.notices)
    table = answered(own, table, "rating", "rating")
    table["rating"] = own.numbers(table, "rating")
    middles = table["rating"].abs().groupby(table["participant_id"]).median()
    if (far := middles[middles > MAX_PEOPLE_RATIO * middles.median()]).size:
        own.notices.append(
            f"The ratings of {few([*map(str, far.index)])} are {far.min() / middles.median():.0f} times those of the "
            "others: check that the units are the same."
        )
    table = own.optional(without_codes(table, "response_time", own.notices), "response_time")
    table = own.optional(table, "dropped_frames")
    if "response_time" in table:
        try:
            check_seconds(table, "response_time", LONGEST_RESPONSE_S, SHORTEST_RESPONSE_S)
        except InputError as error:
            if "response_time" in own.given:
                raise
            own.notices.append(f"The column {own.columns['response_time']} was not used: {error}")
            table = table.drop(columns="response_time")
    return table


MIN_REPEATED_NUMBERS = 0.3
"""Fraction of repeated trial numbers above which they count within blocks; below it, trials are duplicates."""

MIN_SHARED_CONDITION = 0.9
"""Fraction of rows with a repeated trial number that repeat its condition, above which a trial has several rows."""


def numbered(own: Source, table: pd.DataFrame, conditions: Sequence[str]) -> pd.DataFrame:
    """Return the table without copies, with valid trial numbers: the trials are numbered if necessary."""
    table = without_copies(table, conditions, own.notices, own.notes)
    by = [name for name in ("participant_id", "session") if name in table]
    condition = [*conditions]
    if "trial" in table:
        again, same = table.duplicated([*by, "trial"]), table.duplicated()
        if not again.any():
            return table
        if same.equals(again):
            raise InputError(f"{place(table, same)}: a row above is the same in every cell: leave one of them out.")
        shown = table.duplicated([*by, "trial", *condition])
        keys = table[[*by, "trial", *condition]]
        after = (keys == keys.shift()).all(axis=1)
        beside = shown.sum() >= MIN_SHARED_CONDITION * again.sum() and after.sum() >= shown.sum() / 2
        if shown.any() and (again.mean() < MIN_REPEATED_NUMBERS or beside):
            raise InputError(
                f"{place(table, shown)}: trial {printable(str(table['trial'][shown].iloc[0]))} of participant "
                f"{table['participant_id'][shown].iloc[0]} occurs in a row above with another answer: leave one of "
                f"them out ({rows_named(table, shown)}){_distinguished(own, table, keys)}."
            )
        own.notices.append(
            "The column of trials does not tell all trials apart and was not used: where each trial has several rows, "
            "choose one of them (where)."
        )
    else:
        keys = table[[*by, *condition]]
        if remedy := _distinguished(own, table, keys):
            own.notices.append(f"Rows come in groups of one condition, as several rows of one trial do{remedy}.")
        elif start := _same_start(table["rating"], keys):
            own.notices.append(start)
    table["trial"] = table.groupby(by, sort=False).cumcount() + 1
    own.notes.append("Trials are numbered in the order of the file.")
    return table


def _same_start(ratings: pd.Series[float], keys: pd.DataFrame) -> str:
    """Return a notice if rows come in groups of one condition, of which one row always has the same rating."""
    group = (keys != keys.shift()).any(axis=1).cumsum()
    sizes = group.value_counts()
    if len(sizes) < 4 or sizes.nunique() != 1 or sizes.iloc[0] < 2:
        return ""
    values = ratings.groupby(group.groupby(group).cumcount().to_numpy()).agg(["nunique", "first"])
    same = values["nunique"] == 1
    if not same.any() or same.all():
        return ""
    return (
        f"Rows come in groups of {sizes.iloc[0]} of one condition, and row {int(np.argmax(same)) + 1} of each group "
        f"always has the rating {values['first'][same].iloc[0]:g}, as the start of a slider has: leave such rows out."
    )


def _distinguished(own: Source, table: pd.DataFrame, keys: pd.DataFrame) -> str:
    """Return the remedy that names a column which distinguishes the rows of each trial; "" if none does.

    Such a column has a few words, each once in every group of consecutive rows of one condition.
    """
    if table.index.nlevels != 2:
        return ""
    group = (keys != keys.shift()).any(axis=1).cumsum().to_numpy()
    size, count = len(table), int(group[-1]) if len(group) else 0
    if count < 2 or size % count or size == count:
        return ""
    cells = own.cells.loc[table.index]
    for name in cells:
        values = cells[name]
        if (
            name not in own.columns.values()
            and values.nunique() == size // count
            and not pd.DataFrame({"group": group, "value": values.to_numpy()}).duplicated().any()
        ):
            words = [*dict.fromkeys(values)]
            likely = next((word for word in words if word.casefold() in MEASURES), values.iloc[-1])
            return (
                f"; {printable(str(name))} ({few(words)}) separates them: choose with {where_like(str(name), likely)}"
            )
    return ""
