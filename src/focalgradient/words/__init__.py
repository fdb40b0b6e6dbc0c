"""Texts shown to participants, one TOML file per language, which can be read and changed without programming.

The package contains English and German. A custom file is a copy with every entry translated; missing, unknown or
mismatched entries raise an `InputError`.
"""

from __future__ import annotations

import difflib
import hashlib
import string
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files import read_toml

__all__ = ["LANGUAGES", "Entry", "Words", "read_words", "words_text"]

LANGUAGES = ("en", "de")
"""Languages contained in the package."""

ARROWS = {"left": "←", "right": "→", "up": "↑", "down": "↓"}
"""Signs of keys in any language."""

Entry = str | tuple[str, ...]

Optional = Callable[[set[str]], dict[str, Entry]]
"""Function of names of sections that returns the English entries that a file of texts may have in them."""


@dataclass(frozen=True, slots=True)
class Words:
    """Texts of one language.

    Parameters
    ----------
    language
        "en", "de", or the name of the file that was read.
    sha256
        SHA-256 of all texts, recorded in the journal to identify them.
    entries
        Texts by section and name, such as "depth.question"; a tuple for a list of pages.

    Examples
    --------
    >>> read_words("de")("common.go_on")
    'Weiter mit der LEERTASTE.'
    >>> read_words("en").number(1.5), read_words("de").number(1.5)
    ('1.50', '1,50')
    """

    language: str
    sha256: str
    entries: Mapping[str, Entry]

    def __call__(self, entry: str, **values: object) -> str:
        """Return a text, with its fields in braces replaced by values."""
        text = self.entries[entry]
        assert isinstance(text, str), f"{entry} is a list of pages"
        return text.format(**values)

    def pages(self, entry: str, **values: object) -> list[str]:
        """Return a list of pages; the first line of each is its title."""
        return [text.format(**values) for text in self.entries[entry]]

    def number(self, value: float, form: str = ".2f") -> str:
        """Format a number in the notation of the language."""
        return format(value, form).replace(".", self("common.decimal"))

    def key(self, name: str) -> str:
        """Return a key's name as participants know it.

        >>> read_words("de").key("space"), read_words("en").key("space"), read_words("de").key("left")
        ('LEERTASTE', 'SPACE', '←')
        """
        return str(self.entries.get(f"keys.{name}", ARROWS.get(name, name.upper())))

    @property
    def yes(self) -> str:
        """Key for "yes"."""
        return self("common.yes_key")

    @property
    def no(self) -> str:
        """Key for "no"."""
        return self("common.no_key")


def words_text(language: str) -> str:
    """Return the text file of a language, as a template.

    Raises
    ------
    InputError
        If the package has no such language.

    Examples
    --------
    >>> words_text("de").splitlines()[4]
    'name = "Deutsch"'
    """
    if language not in LANGUAGES:
        raise InputError(f"there are no texts in {language!r}: give one of {', '.join(LANGUAGES)}.")
    return (files("focalgradient.words") / f"{language}.toml").read_text(encoding="utf-8")


def read_words(language: str, folder: Path | None = None, optional: Optional = lambda sections: {}) -> Words:
    """Read the texts of a language.

    Parameters
    ----------
    language
        "en", "de", or the name of a TOML file.
    folder
        Folder to which the file name is relative; None: the working folder.
    optional
        Entries that a file may have in other sections.

    Raises
    ------
    InputError
        If the file cannot be read, or has missing, unknown or invalid entries; all missing ones are named.
    """
    if language in LANGUAGES:
        return _own(language)
    if not language.endswith(".toml"):
        raise InputError(f"language is {language!r}, but must be one of {', '.join(LANGUAGES)} or a TOML file.")
    path = (folder or Path()) / language
    return _words(language, _checked(path, _flat(read_toml(path)), optional))


@cache
def _own(language: str) -> Words:
    return _words(language, dict(_flat(tomllib.loads(words_text(language)))))


def _words(language: str, entries: Mapping[str, Entry]) -> Words:
    content = repr(sorted(entries.items())).encode()
    return Words(language, hashlib.sha256(content).hexdigest(), entries)


def _flat(data: Mapping[str, Any], section: str = "") -> Iterator[tuple[str, Entry]]:
    for name, value in data.items():
        if isinstance(value, dict) and not section:
            yield from _flat(value, f"{name}.")
        elif isinstance(value, list):
            yield section + name, tuple(value)
        else:
            yield section + name, value


def _checked(path: Path, given: Iterator[tuple[str, Entry]], further: Optional) -> dict[str, Entry]:
    """Compare a custom file's texts with the English ones, entry by entry."""
    entries = dict(given)
    usual = _own("en").entries
    optional = further({name.partition(".")[0] for name in entries.keys() - usual.keys()})
    known = {**usual, **optional}
    for name in entries:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            raise InputError(
                f"{path}: {name} is not an entry of the texts: "
                + (f"did you mean {near[0]}?" if near else "leave it out.")
            )
    missing = [name for name in usual if name not in entries and not name.startswith("keys.")]
    if missing:
        many, are, each = ("entries", "are", "them") if len(missing) > 1 else ("entry", "is", "it")
        raise InputError(
            f"{path}: the {many} {', '.join(missing)} {are} missing: copy {each} from the texts of 'en' and translate "
            f"{each}."
        )
    for name, entry in entries.items():
        usual_entry = known[name]
        if isinstance(usual_entry, tuple) != isinstance(entry, tuple) or not _is_text(entry):
            kind = "a list of pages" if isinstance(usual_entry, tuple) else "a text"
            raise InputError(f"{path}: {name} must be {kind}, and not empty: see the texts of 'en'.")
        try:
            strange = _braces(entry) - _braces(usual_entry) - (ENDS if name in optional else set())
        except ValueError as error:
            raise InputError(f"{path}: {name} has an unmatched brace: write {{{{ for a literal brace.") from error
        if strange:
            filled = ", ".join(sorted(_braces(usual_entry))) or "none"
            raise InputError(f"{path}: {name} has {{{min(strange)}}}, which is unknown: use only {filled}.")
    keys = [str(entries[f"common.{name}_key"]) for name in ("yes", "no")]
    if not all(len(key) == 1 and key.isascii() and key.islower() for key in keys) or keys[0] == keys[1]:
        raise InputError(f"{path}: common.yes_key and common.no_key must be two different letters from a to z.")
    return entries


ENDS = {"least", "most", "example"}
"""Fields that a scale fills in its pages, whether or not its own texts use them."""


def _is_text(entry: object) -> bool:
    parts = entry if isinstance(entry, tuple) else (entry,)
    return bool(parts) and all(isinstance(part, str) and part.strip() for part in parts)


def _braces(entry: Entry) -> set[str]:
    """Return the names of fields in braces in a text or in pages.

    >>> sorted(_braces(("a {b}", "{c} {b}")))
    ['b', 'c']
    """
    parts = entry if isinstance(entry, tuple) else (entry,)
    return {name for part in parts for _, name, _, _ in string.Formatter().parse(part) if name is not None}
