"""Names in the user's own table: spelling variants are merged, and summary rows are detected.

Two spellings are the same name if they differ only in case, in spaces (including non-breaking and invisible ones), in
hyphens or underscores between a letter and a digit, in leading zeros, in the prefix "sub-", in a final ".0", or in
look-alike letters of other alphabets. "S1" and "S10", and "1-1" and "11", remain distinct. A wrong merge makes tests
less powerful; missing one would count a subject twice.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Collection, Iterable

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable

__all__ = [
    "UNIT",
    "clean",
    "few",
    "heading",
    "in_several",
    "invalid",
    "is_summary",
    "maybe_summary",
    "missing_as",
    "place",
    "rows_named",
    "same_name",
    "stem_of",
    "united",
    "with_article",
]

LOOKALIKES = str.maketrans(
    "аеорсухіјѕԁһԛԝвкмнт" + "αβεικνορτυχ" + "ıℓ",
    "aeopcyxijsdhqwbkmht" + "abeikvoptux" + "il",
)
"""Lower-case Cyrillic, Greek and other letters that look like Latin ones (Unicode Technical Standard 39, confusables).
"""

UNIT = re.compile(r"(?:[\s_(\[]|^)(dioptres?|diopters?|D|mm|deg|arcmin|arcsec|px|pixels?|%|cpd|ms|s)[\s)\]]*$")
"""Unit at the end of a column name."""

DASHES = str.maketrans({**dict.fromkeys("‐‑‒–—―−﹣－", "-"), "ƒ": "f"})

_SUMMARIES = (
    "mean|means|average|avg|total|totals|grand total|subtotal|median|std dev|stdev|st dev|standard deviation|"
    "standard error|std error|grand mean|overall|overall mean|variance|"
    "mittel|mittelwert|mittelwerte|mw|durchschnitt|summe|gesamt|gesamtergebnis|gesamtsumme|teilergebnis|ergebnis|"
    "standardabweichung|standardfehler|stabw|varianz|"
    "moyenne|moyennes|somme|total général|sous-total|écart type|écart-type|ecart type|ecart-type|médiane|"
    "media|promedio|suma|suma total|total general|desviación|desviación estándar|desviación típica|mediana|"
    "totale|somma|deviazione standard|gemiddelde|totaal|eindtotaal|standaarddeviatie|standaardafwijking|mediaan|"
    "média|soma|total geral|desvio padrão|medelvärde|medel|summa|totalt|standardavvikelse|"
    "gjennomsnitt|gennemsnit|snit|standardafvigelse|standardavvik|keskiarvo|keskihajonta|mediaani|yhteensä|"
    "średnia|suma końcowa|odchylenie standardowe|průměr|součet|celkem|směrodatná odchylka|átlag|összesen|szórás|"
    "ortalama|toplam|standart sapma|среднее|среднее значение|итого|всего|сумма|общий итог|медиана|"
    "стандартное отклонение|μέσος όρος|σύνολο|τυπική απόκλιση|"
    "平均|平均值|平均値|合计|合計|总计|總計|总和|標準偏差|标准差|標準差|中央値|中位数|평균|합계|총합계|표준편차|중앙값|"
    "المتوسط|المجموع|ממוצע|סך הכל"
)
SUMMARIES = frozenset(unicodedata.normalize("NFKC", name).casefold() for name in _SUMMARIES.split("|"))
"""Names of summary rows (means, sums, standard deviations), in lower case, in several languages."""

AMBIGUOUS_SUMMARIES = frozenset(
    ("sum", "som", "min", "max", "n", "m", "sd", "se", "sem", "std", "count", "all", "var", "mode", "med")
)
"""Summary labels that may also be a person's name or initials."""


def clean(text: str) -> str:
    r"""Return text in Unicode's compatibility form, without invisible characters, and with single spaces.

    >>> clean("\u200bＰ０１\u00a0 "), clean("\u22121,5")
    ('P01', '-1,5')
    """
    if text.isascii() and text.isprintable() and "  " not in text and text == text.strip():
        return text
    plain = unicodedata.normalize("NFKC", text)
    visible = "".join(sign for sign in plain if unicodedata.category(sign) not in ("Cf", "Cc") or sign.isspace())
    return " ".join(visible.split()).translate(DASHES)


def stem_of(header: str) -> str:
    """Remove unit and logarithm from a column name.

    >>> stem_of("Level (D)"), stem_of("blur_mm"), stem_of("log10_level"), stem_of("level (dB)")
    ('level', 'blur', 'level', 'level')
    """
    name = (UNIT.sub("", clean(header)) or header).strip(" _([").casefold()
    return re.sub(r"^(log10|log|ln|db)[ _-]+|[ _(\[]+(db|log10|log|ln)[\])]*$", "", name)


def heading(name: str) -> str:
    """Return a column name in lower case, with "_" between its words.

    >>> heading("Participant.ID"), heading("responseTime"), heading("f-stop"), heading("Trial #"), heading("Correct?")
    ('participant_id', 'response_time', 'f_stop', 'trial_nr', 'correct')
    """
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", clean(name)).replace("#", " nr")
    return re.sub(r"[\s_.?\-]+", "_", words).rstrip("_").casefold() or name


def same_name(name: str) -> str:
    """Return a canonical form that all spelling variants of a name share.

    >>> {same_name(name) for name in ("SUB-01 ", "sub-01", "1", "01", "1.0", "Sub_1")}
    {'1'}
    >>> [same_name(name) for name in ("S1", "S10", "s-01", "1-1", "0.5", "Аnna")]
    ['s1', 's10', 's1', '1-1', '0.5', 'anna']
    """
    found = clean(name).casefold().translate(LOOKALIKES)
    found = re.sub(r"[\s_\-]+", "-", found).strip("-")
    found = re.sub(r"^sub-(?=.)", "", found)
    found = re.sub(r"^(\d+)[.,]0+$", r"\1", found)
    found = re.sub(r"(?<![\d.,])0+(?=\d)(?!0[.,])", "", found)
    return re.sub(r"(?<=[^\W\d_])-(?=\d)", "", found) or found


def _bare(name: str) -> str:
    """Return a name in lower case without surrounding brackets, colons and equals signs."""
    return re.sub(r"\(.*?\)|[:=.,*]", " ", clean(name).casefold()).strip()


def is_summary(name: str, others: Iterable[str] = ()) -> bool:
    """Return whether a name denotes a summary row, alone or combined with one of the bare names `others`.

    >>> is_summary("Mittelwert:"), is_summary("01 Total", ["01", "02"]), is_summary("Max"), is_summary("Total recall")
    (True, True, False, False)
    """
    bare = _bare(name)
    if bare in SUMMARIES:
        return True
    first, _, rest = bare.partition(" ")
    start, _, last = bare.rpartition(" ")
    known = {same_name(other) for other in others}
    return (first in SUMMARIES and same_name(rest) in known) or (last in SUMMARIES and same_name(start) in known)


def maybe_summary(name: str) -> bool:
    """Return whether a name denotes a summary row but may also be a person's.

    >>> maybe_summary("SD"), maybe_summary("Max"), maybe_summary("Mia")
    (True, True, False)
    """
    return _bare(name) in AMBIGUOUS_SUMMARIES


def rows_named(table: pd.DataFrame, chosen: pd.Series[bool]) -> str:
    """Format the row numbers for a message: "row 3", "rows 2 to 9", "rows 2, 5, 8 and 4 more"; of several files theirs.

    >>> index = pd.MultiIndex.from_tuples([("a.csv", row) for row in range(2, 9)])
    >>> rows_named(pd.DataFrame(index=index), pd.Series([True] * 3 + [False] * 4))
    'rows 2 to 4'
    """
    labels = table.index[chosen.to_numpy(bool)]
    by_file = {file: _rows(sorted({int(label[1]) for label in labels if label[0] == file})) for file, *_ in labels}
    if table.index.get_level_values(0).nunique() == 1:
        return next(iter(by_file.values()))
    return few(f"{rows} of {file}" for file, rows in by_file.items())


def _rows(numbers: list[int]) -> str:
    """Format the sorted numbers of rows of one file."""
    if len(numbers) == 1:
        return f"row {numbers[0]}"
    if numbers[-1] - numbers[0] == len(numbers) - 1:
        return f"rows {numbers[0]} to {numbers[-1]}"
    more = f" and {len(numbers) - 3:,} more" if len(numbers) > 3 else ""
    return f"rows {', '.join(str(number) for number in numbers[:3])}{more}"


def few(names: Iterable[str], comma: str = ", ", most: int | None = None) -> str:
    """Join up to ten distinct names that are not empty, in printable characters, and count the others.

    Parameters
    ----------
    names
        Names.
    comma
        Separator.
    most
        Maximum number of characters, but for the first name.

    >>> few(["0,76", "1,05", "0,71", "0,88"], "; ", 12)
    '0,76; 1,05 and 2 more'
    """
    several = list(dict.fromkeys(printable(name) for name in names if name))
    count = min(len(several), 10)
    while most is not None and count > 1 and len(comma.join(several[:count])) > most:
        count -= 1
    first = comma.join(several[:count])[:most]
    return first + (f" and {len(several) - count:,} more" if len(several) > count else "")


def place(table: pd.DataFrame, wrong: pd.Series[bool]) -> str:
    """Return file, row, and in a wide table column, of the first invalid row."""
    file, row, *column = table.index[int(wrong.to_numpy().argmax())]
    return f"{file}, row {row}" + (f", column {printable(column[0])}" if column else "")


def invalid(table: pd.DataFrame, role: str, wrong: pd.Series[bool], expected: str) -> InputError:
    """Return the error for the first invalid cell of a column: its place, its value, and `expected`."""
    value = table[role][wrong].iloc[0]
    shown = repr(printable(value)) if isinstance(value, str) else f"{value:g}"
    return InputError(f"{place(table, wrong)}: {role} is {shown}, {expected}.")


def united(table: pd.DataFrame, role: str, noun: str, notices: list[str]) -> pd.DataFrame:
    """Replace each name by its most frequent spelling; report the merged spellings in `notices`."""
    names = table[role]
    spelt = names.map({name: clean(name) for name in names.unique()})
    by_name: dict[str, list[str]] = {}
    for spelling in names.value_counts(sort=False).index:
        by_name.setdefault(same_name(spelling), []).append(str(spelling))
    counted = spelt.value_counts()
    chosen = {
        name: max((clean(spelling) for spelling in spellings), key=lambda text: (counted[text], text))
        for spellings in by_name.values()
        for name in spellings
    }
    several = [spellings for spellings in by_name.values() if len(spellings) > 1]
    if several:
        spelled = [
            f"{' and '.join(f'“{name}” ({rows_named(table, names == name)})' for name in group)} as {chosen[group[0]]}"
            for group in several
        ]
        more = f"; and {len(spelled) - 5} more" if len(spelled) > 5 else ""
        notices.append(
            f"Spellings of one {noun} were united, {sum(map(len, several))} to {len(several)}: {'; '.join(spelled[:5])}"
            f"{more}. They differ only in case, spaces, hyphens, leading zeros or look-alike letters: give names that "
            "differ otherwise where they are not one."
        )
    return table.assign(**{role: names.map(chosen)})


def in_several(people: Iterable[Collection[str]]) -> list[str]:
    """Return the names that occur in more than one collection; case does not count.

    >>> in_several([{"AB", "gh"}, {"GH", "IJ"}])
    ['GH']
    """
    spelt = {name.casefold(): name for names in people for name in names}
    counts = Counter(folded for names in people for folded in {name.casefold() for name in names})
    return sorted(spelt[folded] for folded, count in counts.items() if count > 1)


def missing_as(text: str) -> str:
    """Return the remedy for a cell that may stand for a missing answer."""
    return f'leave it empty, or NA, where it is missing, or state so with conditions={{"{printable(text)}": "NA"}}'


def with_article(noun: str) -> str:
    """Return a noun with its article.

    >>> with_article("rating"), with_article("eye")
    ('a rating', 'an eye')
    """
    return f"{'an' if noun[:1].casefold() in 'aeiou' else 'a'} {noun}"
