"""Consent: a text of the laboratory with its version, read page by page and agreed to before all else."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files import read_text

__all__ = ["Consent", "read_consent"]

VERSION = re.compile(r"version\s*[:=]?\s*(\S.*)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Consent:
    """A text to agree to.

    Parameters
    ----------
    file, version, sha256
        Name of its file, what its first line says after "Version", and the SHA-256 of the file.
    texts
        Its pages, the first line of each its title.
    """

    file: str
    version: str
    sha256: str
    texts: tuple[str, ...]

    def stated(self, time: str) -> dict[str, Any]:
        """Return what the journal keeps of an agreement at a time (ISO 8601)."""
        return {"file": self.file, "version": self.version, "sha256": self.sha256, "time": time}


def read_consent(path: Path) -> Consent:
    """Read the text of a file: pages divided by form feeds, the first line of each its title.

    A first line such as "Version: 2.1, March 2026" is kept, and not shown.

    Raises
    ------
    InputError
        If it cannot be read or is empty.
    """
    whole = read_text(path, "a text to agree to")
    first, _, after = whole.strip().partition("\n")
    match = VERSION.fullmatch(first.strip())
    text = after if match else whole
    texts = tuple(page.strip() for page in text.split("\f") if page.strip())
    if not texts:
        raise InputError(f"{path} is empty: give the text that participants are to agree to.")
    return Consent(path.name, match[1] if match else "", hashlib.sha256(whole.encode()).hexdigest(), texts)
