"""A folder of files that are whole or not there: made one by one, resumed after a kill, verified when finished.

What has been finished is listed with its SHA-256 in ``unfinished.json`` until the manifest takes its place. A file is
written whole or not at all (`focalgradient.files`): whatever cuts that off, what the list names is valid.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files import inner_name, printable, read_bytes, read_json, sweep, write_whole

__all__ = ["MANIFEST", "UNFINISHED", "Folder", "dumped"]

MANIFEST, UNFINISHED = "manifest.json", "unfinished.json"


class Folder:
    """The folder of one set.

    `content` is what its list says beside that: whoever makes the set fills it.

    Parameters
    ----------
    path
        Where it is, or is to be.
    settings
        What makes the set the one it is, as plain JSON. A folder that holds another one is refused.
    versions
        Of the programs that make it: a set is not finished by others than those that began it.

    Raises
    ------
    InputError
        If the folder holds another set, or one begun by other versions, or its list cannot be read.
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
                f"{printable(path / name)} is no list of a set of this kind: choose another folder, or remove the file."
            ) from error
        other = [key for key in settings if held[key] != json.loads(dumped(settings[key]))]
        if other:
            raise InputError(
                f"{path} holds another set, which differs in {' and '.join(_differing(settings, held, other))}: "
                "give the same settings, or choose another folder."
            )
        self.damaged = [file for file, sha256 in files.items() if _sha256(path / file) != sha256]
        for file in self.damaged:
            del files[file]
        self.files = files
        self.content = {key: value for key, value in found.items() if key not in {*settings, "versions", "files"}}
        if not (self.complete or by == versions):
            raise InputError(
                f"{path} was begun by other versions of programs ({_named(by)}; now {_named(versions)}): go on with "
                "those, or choose another folder."
            )

    @property
    def complete(self) -> bool:
        """Whether the set was finished, and is still as it was."""
        return self.finished and not self.damaged

    def has(self, *names: str) -> bool:
        """Whether all these files are finished and unchanged."""
        return all(name in self.files for name in names)

    def put(self, contents: Mapping[str, bytes]) -> None:
        """Write files, and the list with all that `content` holds by now."""
        for name, data in contents.items():
            self._write(name, data)
            self.files[name] = hashlib.sha256(data).hexdigest()
        self._write(UNFINISHED, self._listed())

    def finish(self) -> None:
        """Make the list the manifest."""
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
                f"{printable(place)} is there already and belongs to no set of this kind: move it, or choose another "
                "folder."
            )
        going_on = (
            "make room or give a folder that you may write in; "
            f"the {len(self.files)} files finished before are valid, and the same command goes on from them"
        )
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{printable(place)} cannot be written ({error.strerror}): {going_on}.") from error
        write_whole(place, content, remedy=going_on)


def dumped(content: Any) -> bytes:
    r"""Strict JSON, as bytes.

    >>> dumped({"a": (1, 2)})
    b'{\n "a": [\n  1,\n  2\n ]\n}\n'
    """
    return (json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _differing(settings: Mapping[str, Any], held: Mapping[str, Any], keys: list[str]) -> list[str]:
    """What differs, by name."""
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


def _sha256(path: Path) -> str | None:
    try:
        return hashlib.sha256(read_bytes(path)).hexdigest()
    except InputError:
        return None
