"""Storage of a series' pictures: each is written when made, so that an interrupted run can be resumed."""

from __future__ import annotations

import hashlib
import json
import pickle
from collections.abc import Callable, Iterable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError, described
from focalgradient.files import printable, read_array, read_json, write_whole

__all__ = ["INPUTS", "MARK", "SUMMARY", "Kept", "digest_of", "plane_name"]

SUMMARY, INPUTS = "series.json", "inputs.json"
"""File names of the summary (written last) and of the digest of the inputs (written first)."""

MARK = "focalgradient focus-series, with distance.npy"
"""Mark by which the command recognises its own files: see `focalgradient.files.mark`."""

Half = NDArray[np.float16]


def plane_name(vergence: float) -> str:
    """Return the file name of the picture focused at a vergence in dioptres.

    >>> plane_name(0.5)
    'focus-0.5D.npy'
    """
    return f"focus-{vergence!r}D.npy"


def digest_of(optics: Any, arrays: Iterable[NDArray[Any]], **settings: Any) -> str:
    """Return a digest of all inputs of a series, including this package's version.

    Raises
    ------
    InputError
        If the optics cannot be pickled and so cannot be identified.
    """
    try:
        pickled = pickle.dumps(optics, protocol=4)
    except Exception as error:
        raise InputError(
            f"optics is {described(optics)}, which cannot be pickled, so that a stored series could not identify it: "
            "define its class in a module, or omit folder."
        ) from error
    digest = hashlib.sha256(pickled)
    for array in arrays:
        digest.update(f"{array.shape}{array.dtype}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(json.dumps([version("focalgradient"), settings], sort_keys=True).encode())
    return digest.hexdigest()


class Kept:
    """Pictures by focus, in memory and, if a folder is given, on disk.

    Parameters
    ----------
    folder
        Folder for storage, created if necessary. None: in memory only.
    digest
        Digest of the inputs: pictures with another digest are removed first.
    make
        Function that makes the linear picture focused at a vergence.
    """

    def __init__(self, folder: Path | None, digest: str, make: Callable[[float], NDArray[np.floating]]):
        self.folder, self._make = folder, make
        self._pictures: dict[float, Half] = {}
        self.made = 0
        if folder is None:
            return
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{printable(folder)} cannot be made ({error.strerror}): give a writable folder."
            ) from error
        path = folder / INPUTS
        if path.exists() and read_json(path, "the inputs of a focus series").get("sha256") == digest:
            return
        for old in (folder / SUMMARY, path, *folder.glob("focus-*D.npy")):
            old.unlink(missing_ok=True)
        write_whole(path, json.dumps({"written_by": MARK, "sha256": digest}).encode())

    def __call__(self, vergence: float) -> Half:
        """Return the picture at a focus, made or read once."""
        if vergence not in self._pictures:
            path = None if self.folder is None else self.folder / plane_name(vergence)
            if path is not None and path.exists():
                self._pictures[vergence] = read_array(path, "a picture of a focus series")
            else:
                made = np.asarray(self._make(vergence), np.float16)
                self.made += 1
                if path is not None:
                    write_whole(path, partial(np.save, arr=made))
                self._pictures[vergence] = made
        return self._pictures[vergence]

    def forget(self, vergence: float) -> None:
        """Free the memory of a picture that is not a plane; it remains on disk until the series is finished."""
        self._pictures.pop(vergence, None)

    def finish(self, chosen: Iterable[float]) -> None:
        """Remove the stored pictures that only served to measure the error."""
        if self.folder is not None:
            names = {plane_name(vergence) for vergence in chosen}
            for path in self.folder.glob("focus-*D.npy"):
                if path.name not in names:
                    path.unlink()
