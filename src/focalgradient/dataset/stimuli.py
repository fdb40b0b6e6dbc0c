"""The pictures that a session shows: whether they still are what their manifest says."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from focalgradient.errors import InputError

__all__ = ["Manifest", "check_stimuli", "read_manifest"]


@dataclass(frozen=True, slots=True)
class Manifest:
    """A manifest of stimuli.

    Parameters
    ----------
    content
        As it stands in its file.
    sha256
        Of that, in hexadecimal.
    files
        SHA-256 of each file, by its path from the manifest.
    """

    content: bytes
    sha256: str
    files: Mapping[str, str]


def read_manifest(path: Path) -> Manifest:
    """Read a manifest: JSON whose key "files" gives the SHA-256 of every file.

    Raises
    ------
    InputError
        If it cannot be read or is no manifest.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(
            f"{path} cannot be read ({error.strerror}): give a folder that 'focalgradient stimuli' has made."
        ) from error
    try:
        files = json.loads(content)["files"]
        if not all(isinstance(name, str) and isinstance(sha, str) for name, sha in files.items()):
            raise TypeError
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(
            f'{path} is no manifest of stimuli: its key "files" must give each file\'s SHA-256; make the stimuli anew.'
        ) from error
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
            found = hashlib.sha256((folder / name).read_bytes()).hexdigest()
        except OSError as error:
            raise InputError(
                f"{folder / name} is in the manifest but cannot be read ({error.strerror}): make the stimuli anew."
            ) from error
        if found != sha256:
            raise InputError(f"{folder / name} has changed since the manifest was written: make the stimuli anew.")
    return manifest
