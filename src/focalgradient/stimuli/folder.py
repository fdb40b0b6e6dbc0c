"""Resumable output folder of a set: files are written atomically and verified by checksum.

Finished files are listed with their SHA-256 in ``unfinished.json``, which the manifest replaces at the end. Writing is
atomic (`focalgradient.files`), so that every listed file is valid even after an interruption.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files import inner_name, printable, read_bytes, read_json, sweep, write_whole

__all__ = ["MANIFEST", "UNFINISHED", "Folder", "dumped", "versions_of"]

MANIFEST, UNFINISHED = "manifest.json", "unfinished.json"


class Folder:
    """Output folder of one set.

        `content` is the rest of the list's content, which the maker of the set fills in.

    Parameters
    ----------
    path
        Path of the folder, which may not exist yet.
    settings
        Settings that identify the set, as plain JSON. A folder with another set is rejected.
    versions
        Program versions: a set must be finished by the same versions that began it.

    Raises
    ------
    InputError
        If the folder contains another set, or one begun by other versions, or its list cannot be read.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any], versions: Mapping[str, Any]) -> None:
        self.path, self.settings, self.versions = path, settings, versions
        self.files: dict[str, str] = {}
        self.content: dict[str, Any] = {}
        self.damaged: list[str] = []
        self.finished = (path / MANIFEST).exists()
        name = MANIFEST if self.finished else UNFINISHED
        sweep(path)
        if not (path / name).exists():
            return
        try:
            found = read_json(path / name)
            held = {key: found[key] for key in settings}
            files = {inner_name(file): sha256 for file, sha256 in found["files"].items()}
            by = dict(found["versions"])
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise InputError(
                f"{printable(path / name)} is not the list of a set of this kind: choose another folder, or remove "
                "the file."
            ) from error
        other = [key for key in settings if held[key] != json.loads(dumped(settings[key]))]
        if other:
            raise InputError(
                f"{path} contains another set, which differs in {' and '.join(_differing(settings, held, other))}: "
                "give the same settings, or choose another folder."
            )
        self.damaged = [file for file, sha256 in files.items() if _sha256(path / file) != sha256]
        for file in self.damaged:
            del files[file]
        self.files = files
        self.content = {key: value for key, value in found.items() if key not in {*settings, "versions", "files"}}
        if not (self.complete or by == versions):
            raise InputError(
                f"{path} was begun by other versions of programs ({_named(by)}; now {_named(versions)}): continue with "
                "those, or choose another folder."
            )

    @property
    def complete(self) -> bool:
        """Whether the set is finished and unchanged."""
        return self.finished and not self.damaged

    def has(self, *names: str) -> bool:
        """Return whether all these files are finished and unchanged."""
        return all(name in self.files for name in names)

    def put(self, contents: Mapping[str, bytes]) -> None:
        """Write files, then the list with the current `content`."""
        for name, data in contents.items():
            self._write(name, data)
            self.files[name] = hashlib.sha256(data).hexdigest()
        self._write(UNFINISHED, self._listed())

    def finish(self) -> None:
        """Replace the list by the manifest."""
        self._write(MANIFEST, self._listed())
        (self.path / UNFINISHED).unlink(missing_ok=True)
        self.finished, self.damaged = True, []

    def _listed(self) -> bytes:
        files = dict(sorted(self.files.items()))
        return dumped({**self.settings, "versions": self.versions, **self.content, "files": files})

    def _write(self, name: str, content: bytes) -> None:
        place = self.path / name
        known = name in self.files or name in self.damaged or name in (MANIFEST, UNFINISHED)
        if not known and os.path.lexists(place) and _sha256(place) != hashlib.sha256(content).hexdigest():
            raise InputError(
                f"{printable(place)} already exists and does not belong to a set of this kind: move it, or choose "
                "another folder."
            )
        going_on = (
            "free disk space or give a writable folder; "
            f"the {len(self.files)} files finished so far are valid, and the same command resumes from them"
        )
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{printable(place)} cannot be written ({error.strerror}): {going_on}.") from error
        write_whole(place, content, remedy=going_on)


def dumped(content: Any) -> bytes:
    r"""Return strict JSON as bytes.

    >>> dumped({"a": (1, 2)})
    b'{\n "a": [\n  1,\n  2\n ]\n}\n'
    """
    return (json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _differing(settings: Mapping[str, Any], held: Mapping[str, Any], keys: list[str]) -> list[str]:
    """Return the names of the settings that differ."""
    changed = []
    for key in keys:
        new, old = json.loads(dumped(settings[key])), held[key]
        if isinstance(new, dict) and isinstance(old, dict):
            changed += [name for name in {**new, **old} if new.get(name) != old.get(name)]
        else:
            changed.append(key)
    return changed


def _named(versions: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {number}" for name, number in versions.items())


def versions_of(*names: str) -> dict[str, str]:
    """Return the versions of Python and of the named distributions."""
    return {"python": platform.python_version(), **{name: version(name) for name in names}}


def _sha256(path: Path) -> str | None:
    try:
        return hashlib.sha256(read_bytes(path)).hexdigest()
    except InputError:
        return None
