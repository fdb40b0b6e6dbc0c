"""Verification of a session's pictures against their manifest."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from focalgradient.errors import InputError
from focalgradient.files import inner_name, parse_json, read_bytes

__all__ = ["Manifest", "check_stimuli", "read_manifest"]


LARGEST_MANIFEST = 256 << 20
"""Maximum size of a manifest in bytes: one of ten thousand pictures has some 10 MB."""


@dataclass(frozen=True, slots=True)
class Manifest:
    """Manifest of stimuli.

    Parameters
    ----------
    content
        Content of its file.
    sha256
        SHA-256 of the content, in hexadecimal.
    files
        SHA-256 of each file, by its path relative to the manifest.
    """

    content: bytes
    sha256: str
    files: Mapping[str, str]


def read_manifest(path: Path) -> Manifest:
    """Read a manifest: JSON whose key "files" gives the SHA-256 of every file.

    Raises
    ------
    InputError
        If it cannot be read or is not a manifest.
    """
    content = read_bytes(path, "a folder written by 'focalgradient stimuli'", LARGEST_MANIFEST)
    found = parse_json(content, str(path), "a manifest of stimuli")
    files = found.get("files") if isinstance(found, dict) else None
    if not (isinstance(files, dict) and all(isinstance(sha, str) for sha in files.values())):
        raise InputError(
            f'{path} is not a manifest of stimuli: its key "files" must give each file\'s SHA-256; make the stimuli '
            "again."
        )
    for name in files:
        inner_name(name, f"{path}: a file's name")
    return Manifest(content, hashlib.sha256(content).hexdigest(), files)


def check_stimuli(folder: Path) -> Manifest:
    """Check every file of a folder of stimuli against its ``manifest.json``.

    Raises
    ------
    InputError
        If the manifest cannot be read, or a file is missing or changed: the first is named.
    """
    manifest = read_manifest(folder / "manifest.json")
    for name, sha256 in manifest.files.items():
        try:
            found = hashlib.sha256(read_bytes(folder / name, "a picture")).hexdigest()
        except InputError as error:
            raise InputError(
                f"{folder / name} is in the manifest but cannot be read ({error.__cause__ or error}): make the stimuli "
                "again."
            ) from error
        if found != sha256:
            raise InputError(f"{folder / name} has changed since the manifest was written: make the stimuli again.")
    return manifest
