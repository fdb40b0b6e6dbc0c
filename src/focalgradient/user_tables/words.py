"""Interpretation of aperture and fixation words in the user's own table."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import is_date, name_and_unit
from focalgradient.user_tables.names import clean, few, place, rows_named
from focalgradient.user_tables.numbers import factor_of
from focalgradient.user_tables.schema import LENGTHS
from focalgradient.user_tables.source import conditions_like
from focalgradient.user_tables.tidy import PINHOLE

__all__ = ["FIXED", "SHARP", "given_words", "level_names", "meant", "not_understood", "whole_steps", "with_diameters"]

FIXED = {
    **dict.fromkeys(("near", "nearest", "front", "foreground"), "nearest"),
    **dict.fromkeys(("far", "farthest", "back", "background"), "farthest"),
}
"""Recognised names of fixations."""

MIN_F_NUMBER = 0.5
"""Minimum f-number of a lens in air, by Abbe's sine condition."""

MAX_F_NUMBER = 1000
"""Maximum f-number; a larger one is not a lens's, but a spreadsheet's number of a day, such as 46178."""

USER_FIXATION = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
"""Name of a user-defined fixation."""

SHARP = {"pinhole", "ph", "sharp", "0", "inf", "f/inf", "none"}
F_NUMBER = re.compile(r"(?:f?\s*[/:]?\s*|1\s*:\s*)(\d+(?:[.,]\d+)?)", re.IGNORECASE)
"""f-number, like f/5.6, F5.6, 5,6 or as engraved on lenses, 1:5.6."""

NUMBER = re.compile(r"\d+(?:[.,]\d+)?")
MILLIMETRES = re.compile(r"(\d+(?:[.,]\d+)?)\s*mm", re.IGNORECASE)

STOPS = frozenset(
    (
        *(0.7, 0.8, 0.85, 0.9, 0.95, 1.0, 1.1, 1.2, 1.25, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9),
        *(2.0, 2.2, 2.4, 2.5, 2.7, 2.8, 3.2, 3.3, 3.5, 3.6, 4.0, 4.5, 4.8, 5.0, 5.6, 6.3),
        *(6.7, 7.1, 8.0, 9.0, 9.5, 10.0, 11.0, 12.7, 13.0, 14.0, 16.0, 18.0, 19.0, 20.0, 22.0, 25.0),
        *(27.0, 29.0, 32.0, 36.0, 38.0, 40.0, 45.0, 50.0, 54.0, 57.0, 64.0, 90.0, 128.0),
    )
)
"""Common f-numbers of lenses: full, half and third stops, and the largest apertures."""

MOST_STEPS = 21
"""Maximum number of steps of a scale, as in designs."""

LINE = 100
"""Maximum place on a line."""

MIN_MEDIAN_ON_LINE = 10
"""Minimum median of ratings with decimals that are noted as places on a line: ratios to 1 lie near 1."""

Words = Mapping[str, tuple[str, str]]


def _fold(word: str) -> str:
    return clean(word).casefold()


def given_words(conditions: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """Return the caller's words by their normalised form, ignoring case and spaces.

    Returns
    -------
    dict
        For each normalised word, the original word and its meaning.

    Raises
    ------
    InputError
        If a word has two meanings, or a meaning is itself a word with another meaning.

    Examples
    --------
    >>> given_words({"Vorn": "nearest"})
    {'vorn': ('Vorn', 'nearest')}
    """
    words: dict[str, tuple[str, str]] = {}
    for word, meaning in conditions.items():
        before = words.setdefault(_fold(word), (word, meaning))
        if before[1] != meaning:
            raise InputError(f"conditions: {word} is given as {before[1]} and as {meaning}: give it once.")
    for folded, (word, meaning) in words.items():
        other = words.get(_fold(meaning))
        if other and _fold(meaning) != folded and not _known(meaning):
            raise InputError(
                f"conditions: {word} is given as {meaning}, which is itself given as {other[1]}: give each word its "
                "meaning, like near, pinhole or f/5.6."
            )
    return words


def _known(meaning: str) -> bool:
    folded = _fold(meaning)
    return folded in FIXED or folded in SHARP or bool(F_NUMBER.fullmatch(folded))


EACH_FIXATION = (
    "the pinhole is the reference of each object in focus: repeat its rows with near and with far, or compare all "
    'apertures alike with by=["aperture"]'
)
"""Remedy for ratings of the pinhole without an object in focus."""


def meant(table: pd.DataFrame, words: Words, headers: str, notices: list[str]) -> pd.DataFrame:
    """Translate apertures and fixations to the standard names.

    Parameters
    ----------
    table
        Table with text cells.
    words
        Words given by the caller: see `given_words`.
    headers
        Names of all columns, which in a wide table contain the words, and other cells that may.
    notices
        List to which user-defined fixations, and given words that do not occur, are appended.

    Raises
    ------
    InputError
        If words are unknown; the message lists all of them.
    """
    wrong: list[tuple[str, str, str]] = []
    used: set[str] = set()
    for role, read in (("aperture", _aperture), ("fixation", _fixation)):
        meanings = {}
        for cell in table[role].unique():
            folded = _fold(cell)
            used |= {folded} & set(words)
            found, expected = read(words[folded][1] if folded in words else cell, folded in words)
            meanings[cell] = found
            if found is None:
                is_pinhole = role == "fixation" and (table["aperture"][table[role] == cell] == PINHOLE).all()
                wrong.append((role, cell, EACH_FIXATION if is_pinhole else expected))
            elif role == "fixation" and found not in FIXED.values():
                rows = rows_named(table, table[role] == cell)
                notices.append(
                    f"“{found}” is taken for a fixation of its own, neither near nor far: it was given for "
                    f"“{printable(cell)}” ({rows})."
                )
        if None not in meanings.values():
            table = table.assign(**{role: table[role].map(meanings)})
    if wrong:
        raise not_understood(table, wrong)
    absent = [word for folded, (word, _) in words.items() if folded not in used and folded not in _fold(headers)]
    if absent:
        notices.append(f"The conditions name words that do not occur in the table: {few(absent)}.")
    return table


def not_understood(table: pd.DataFrame, wrong: list[tuple[str, str, str]], remedy: str = "") -> InputError:
    """Return one error for all unknown words (role, word, and what is expected), with the first row of each."""
    parts = [
        f"{place(table, table[role] == cell) if number == 0 else rows_named(table, table[role] == cell)}: "
        f"{role} is {printable(cell)!r}"
        for number, (role, cell, _) in enumerate(wrong[:20])
    ]
    expected = list(dict.fromkeys(f"{role} {text}" if len(wrong) > 1 else text for role, _, text in wrong))
    more = f"; and {len(wrong) - 20} more" if len(wrong) > 20 else ""
    return InputError(f"{'; '.join(parts)}{more}, but {'; '.join(expected)}{remedy}.")


def _aperture(text: str, given: bool) -> tuple[str | None, str]:
    """Return the standard name of an aperture, or None and the expected form."""
    if _fold(text) in SHARP or _is_zero(text):
        return PINHOLE, ""
    found = F_NUMBER.fullmatch(text)
    number = float(found[1].replace(",", ".")) if found else 0.0
    if is_date(text) or number > MAX_F_NUMBER:
        return None, (
            "no lens has such an f-number: a spreadsheet program may have made a date of it, like 5 June of 5.6; "
            "format the column as text and enter the f-numbers again"
        )
    if found and 0 < number < MIN_F_NUMBER:
        return None, (
            f"no lens has an f-number below {MIN_F_NUMBER:g}: give the f-number, or name the column aperture_mm if "
            "these are diameters"
        )
    if not 0 < number < math.inf:
        return None, f"must be a pinhole or an f-number like f/5.6: {conditions_like('f/5.6')}"
    return f"f/{number:g}", ""


def level_names(cells: pd.Series[str], words: Words, *, apertures: bool) -> dict[str, str]:
    """Return the name of each level of a condition: the caller's meaning; and if all are apertures, the standard name.

    Parameters
    ----------
    cells
        Levels as the file has them, without empty cells.
    words
        Words given by the caller: see `given_words`.
    apertures
        True for the column of the apertures; another is one if a level is a pinhole or has the form f/5.6.

    Examples
    --------
    >>> level_names(pd.Series(["Loch", "2,8", "8"]), given_words({"Loch": "pinhole"}), apertures=False)
    {'Loch': 'pinhole', '2,8': 'f/2.8', '8': 'f/8'}
    """
    given = {cell: words[_fold(cell)][1] if _fold(cell) in words else cell for cell in cells.unique()}
    if apertures or any(re.fullmatch(r"pinhole|f/?\d.*", _fold(text)) for text in given.values()):
        found = {cell: _aperture(clean(text), given=True)[0] for cell, text in given.items()}
        if None not in found.values():
            return {cell: str(name) for cell, name in found.items()}
    return given


def _fixation(text: str, given: bool) -> tuple[str | None, str]:
    """Return the standard name of a fixation, or None and the expected form."""
    fixed = FIXED.get(_fold(text))
    if fixed is None and given and USER_FIXATION.fullmatch(text):
        return text, ""
    return fixed, f"must be near or far: {conditions_like('near')}, or its own name for a fixation of your own"


def with_diameters(table: pd.DataFrame, header: str, words: Words, notices: list[str]) -> pd.DataFrame:
    """Move diameters to a column of their own if the cells or the header state millimetres.

    `header` is the name of the column in the file. Bare numbers that are not f-numbers of any lens, and a mixture of
    cells with and without millimetres, raise `InputError`; other bare numbers are taken as f-numbers, which is noted.
    """
    folded = _fold(header)
    cells = {cell: _fold(cell) for cell in table["aperture"].unique() if _fold(cell) not in words}
    open_cells = {cell: text for cell, text in cells.items() if text not in SHARP and not _is_zero(text)}
    sizes = {cell: found[1] for cell, text in open_cells.items() if (found := MILLIMETRES.fullmatch(text))}
    factor = factor_of("aperture_mm", LENGTHS, header)
    if name_and_unit(header)[1] in LENGTHS or "mm" in re.split(r"[^a-z]+", folded) or "diameter" in folded:
        sizes |= {cell: text for cell, text in open_cells.items() if NUMBER.fullmatch(text)}
    if sizes:
        if others := [repr(printable(cell)) for cell in open_cells if cell not in sizes]:
            raise InputError(
                f"aperture is given in millimetres in some rows, but as {few(others)} in others: give all alike."
            )
        sizes = {cell: f"{float(size.replace(',', '.')) * factor:.12g}" for cell, size in sizes.items()}
        notices.append(f"Apertures are diameters in millimetres: {few(sorted(sizes.values()))}.")
        return table.assign(aperture_mm=table["aperture"].map(lambda cell: sizes.get(cell, "0"))).drop(
            columns="aperture"
        )
    bare = sorted(text for text in open_cells.values() if NUMBER.fullmatch(text))
    if not bare or re.search(r"stop|number|blende|^f\W*$|^f/", folded):
        return table
    unknown = [text for text in bare if float(text.replace(",", ".")) not in STOPS]
    if unknown:
        serial = any(30000 < float(text.replace(",", ".")) < 60000 for text in unknown)
        days = "; a spreadsheet program may have made dates of them, like 46178 of 5.6" if serial else ""
        raise InputError(
            f"aperture holds numbers that no lens has as its f-number, {few(unknown)}: name the column aperture_mm "
            f"where they are diameters in millimetres, write f/ before f-numbers, or compare other conditions as they "
            f'are with by=["NAME"]{days}.'
        )
    notices.append(
        f"The numbers {few(bare)} in the column of apertures were taken for f-numbers: name the column aperture_mm "
        "where they are diameters in millimetres."
    )
    return table


def _is_zero(text: str) -> bool:
    return bool(NUMBER.fullmatch(text)) and float(text.replace(",", ".")) == 0


def whole_steps(ratings: pd.Series[float], by: str = "") -> list[str]:
    """Return a notice if ratings look like ordinal steps, at least three small integers from 1, or places on a line.

    `by` is the role of the apertures, which a remedy compares; "" if it is stated already.

    >>> whole_steps(pd.Series([1.0, 4.0, 7.0]))[0].split(":")[0]
    'All ratings are whole numbers from 1 to 7, as answers in steps are'
    >>> whole_steps(pd.Series([1.0, 1.4, 2.0]))
    []
    """
    low, high, is_whole = ratings.min(), ratings.max(), (ratings % 1 == 0).all() and ratings.min() >= 1
    if ratings.nunique() < 3 or not 3 <= high <= LINE or not (is_whole or ratings.median() >= MIN_MEDIAN_ON_LINE):
        return []
    kind, remedy = "answers in steps", "where they are steps"
    if high > MOST_STEPS or not is_whole:
        kind, remedy = "places on a line", "where differences, not ratios, are to be compared"
        remedy = f'and by=["{by}"] {remedy}' if by else remedy
    return [
        f"All ratings are {'whole ' if is_whole else ''}numbers from {low:g} to {high:g}, as {kind} are: they were "
        f'taken for ratios to a standard of 1. Give scale="ordinal" {remedy}.'
    ]
