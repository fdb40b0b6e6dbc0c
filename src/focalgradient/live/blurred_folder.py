"""Reading of focus series: stored ones, or pictures of ``focalgradient blur`` at two or more foci."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from focalgradient.errors import InputError
from focalgradient.files import printable, read_array, read_json
from focalgradient.live.kept import SUMMARY
from focalgradient.live.series import FocusSeries

__all__ = ["read_series"]


def read_series(folder: Path) -> FocusSeries:
    """Read a series made by ``focalgradient focus-series``, or by ``focalgradient blur`` at several foci.

    For the latter, the interpolation error is unknown.

    Raises
    ------
    InputError
        If there is none, or a file is missing or inconsistent with the others.
    """
    if (folder / SUMMARY).exists():
        return FocusSeries.read(folder)
    path = folder / "summary.json"
    summary = read_json(path, "the summary of 'focalgradient focus-series' or 'focalgradient blur'")
    try:
        foci = [float(metres) for metres in summary["settings"]["focus_m"]]
        white = float(summary["settings"].get("white", 1.0))
        several = len(summary["pictures"]) != 1
        if not (all(metres > 0 for metres in foci) and 0 < white < math.inf):
            raise ValueError
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{printable(path)} is not a summary of 'focalgradient blur': give the folder that it made."
        ) from error
    if several or len(set(foci)) < max(len(foci), 2):
        raise InputError(
            f"{printable(folder)} is not a focus series: make one with 'focalgradient focus-series', or with "
            "'focalgradient blur' of one picture in two or more foci."
        )
    distance = read_array(folder / "distance.npy", "the distances that 'focalgradient blur' writes")
    ordered = sorted(foci, reverse=True)
    pictures = [read_array(folder / f"blurred-{metres}m.npy", "a picture of the series") for metres in ordered]
    with np.errstate(over="ignore"):
        planes = tuple(
            (picture / white).astype(np.float16) if picture.dtype.kind == "f" else picture for picture in pictures
        )
    vergences = tuple(1 / metres for metres in ordered)
    return FocusSeries(vergences, planes, distance, np.full((len(ordered) - 1, 2), np.nan)).checked(folder)
