"""Informed consent: a text with its version, which participants read and agree to before anything else."""

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
    """Consent text.

    Parameters
    ----------
    file, version, sha256
        Name of the file, the version stated in its first line, and the file's SHA-256.
    texts
        Pages of the text; the first line of each is its title.
    """

    file: str
    version: str
    sha256: str
    texts: tuple[str, ...]

    def stated(self, time: str) -> dict[str, Any]:
        """Return the journal entry of an agreement at a time (ISO 8601)."""
        return {"file": self.file, "version": self.version, "sha256": self.sha256, "time": time}


def read_consent(path: Path) -> Consent:
    """Read a consent text: pages separated by form feeds, with the first line of each as its title.

    A first line such as "Version: 2.1, March 2026" is recorded, but not shown.

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
        raise InputError(f"{path} is empty: give the consent text.")
    return Consent(path.name, match[1] if match else "", hashlib.sha256(whole.encode()).hexdigest(), texts)
