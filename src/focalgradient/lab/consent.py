"""Consent: a text of the laboratory with its version, read page by page, and agreed to before all else."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focalgradient.errors import InputError
from focalgradient.files import read_text
from focalgradient.lab.experiment import Quit
from focalgradient.lab.forms import pages

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["Consent", "agree", "read_consent"]

VERSION = re.compile(r"version\s*[:=]?\s*(\S.*)", re.IGNORECASE)


@dataclass
class Consent:
    """A text to agree to.

    Parameters
    ----------
    file, version, sha256
        Its file's name, what its first line says after "Version", and the SHA-256 of the file.
    texts
        Its pages.
    agreed
        When the participant agreed, ISO 8601; empty before.
    """

    file: str
    version: str
    sha256: str
    texts: tuple[str, ...]
    agreed: str = ""

    def stated(self) -> dict[str, Any]:
        """What the journal says of it."""
        return {"file": self.file, "version": self.version, "sha256": self.sha256, "time": self.agreed}


def read_consent(path: Path) -> Consent:
    """Read the text of a file: pages divided by form feeds, the first line of each its title.

    A first line such as "Version: 2.1, March 2026" is kept, and not shown.

    Raises
    ------
    InputError
        If it cannot be read or is empty.
    """
    whole = read_text(path, "the text that --consent shows")
    first, _, after = whole.strip().partition("\n")
    match = VERSION.fullmatch(first.strip())
    text = after.strip() if match else whole.strip()
    if not text:
        raise InputError(f"--consent {path} is empty: give the text that participants are to agree to.")
    sha256 = hashlib.sha256(whole.encode()).hexdigest()
    return Consent(path.name, match[1] if match else "", sha256, tuple(text.split("\f")))


def agree(window: Screen, consent: Consent) -> None:
    """Let the participant read, page by page, and agree; who does not agree does not take part."""
    words = window.words
    *first, last = consent.texts
    pages(window, first, "consent")
    foot = words("consent.keys", yes=words.yes.upper(), no=words.no.upper())
    if pages(window, [last], "consent", keys=(words.yes, words.no), foot=foot) == words.no:
        raise Quit
    consent.agreed = datetime.now(UTC).isoformat(timespec="seconds")
