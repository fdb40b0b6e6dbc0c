"""Rationale of the analysis: one paragraph per methodological choice, linked from the methods.

`choices.toml` has title and paragraph of each, by anchor.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

from focalgradient.report.document import Anchored, Block, Details, Links

__all__ = ["chosen", "explained"]


@cache
def _choices() -> dict[str, dict[str, str]]:
    return tomllib.loads(Path(__file__).with_name("choices.toml").read_text(encoding="utf-8"))


def chosen(keys: Sequence[str]) -> Links:
    """Return the links from the methods to the paragraphs of their choices."""
    return Links("Why:", [(f"why-{key}", _choices()[key]["title"]) for key in keys])


def explained(keys: Sequence[str]) -> Iterator[Block]:
    """Yield the paragraphs of the choices, each once, folded."""
    paragraphs = [Anchored(f"why-{key}", **_choices()[key]) for key in dict.fromkeys(keys)]
    yield Details("Choices and their reasons", paragraphs)
