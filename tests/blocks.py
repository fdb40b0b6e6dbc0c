"""Blocks of commands and Python of the documents, which the tests run as pasted."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = "README.md"
RUN = {"sh", "python"}
"""Kinds of blocks that are run."""

BLOCK = re.compile(
    r"(?:<!-- not run: (?P<reason>[^\n]+) -->\n)?^```(?P<kind>\w*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE
)


@dataclass(frozen=True)
class Block:
    """A block: its kind, its text, and why it is not run (None if it is)."""

    kind: str
    text: str
    reason: str | None


def blocks(page: str) -> list[Block]:
    """All blocks of a page of the repository."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return [Block(found["kind"], found["text"], found["reason"]) for found in BLOCK.finditer(text)]


def runnable(page: str) -> list[Block]:
    """Blocks of a page that are run."""
    return [block for block in blocks(page) if block.kind in RUN and block.reason is None]
