"""MATLAB files of version 7 and before."""

from __future__ import annotations

import os
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files.names import printable

__all__ = ["read_matlab"]


def read_matlab(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the variables of a MATLAB file by name; structures have attributes.

    Raises
    ------
    InputError
        If it cannot be read, as a file of version 7.3 (HDF5).
    """
    from scipy.io import loadmat  # deferred: slow to import
    from scipy.io.matlab import MatReadError

    try:
        content: dict[str, Any] = loadmat(path, squeeze_me=True, struct_as_record=False)
    except (OSError, ValueError, TypeError, NotImplementedError, MatReadError) as error:
        raise InputError(
            f"{printable(path)} cannot be read as a MATLAB file of version 7 or before: save it with -v7."
        ) from error
    return content
