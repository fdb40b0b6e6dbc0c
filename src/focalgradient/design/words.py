"""Texts of a session in the language of its design, with those of response scales."""

from __future__ import annotations

from pathlib import Path

from focalgradient.scales.registry import scale_class, scale_names
from focalgradient.words import LANGUAGES, Entry, Words, read_words, words_text

__all__ = ["LANGUAGES", "Words", "load_words", "words_text"]


def load_words(language: str, folder: Path | None = None) -> Words:
    """Read the texts of a language: see `focalgradient.words.read_words`; a file may have sections of scales."""
    return read_words(language, folder, _of_scales)


def _of_scales(sections: set[str]) -> dict[str, Entry]:
    scales = {name: scale_class(name).texts.get("en", {}) for name in sections if name in scale_names()}
    return {f"{name}.{entry}": text for name, texts in scales.items() for entry, text in texts.items()}
