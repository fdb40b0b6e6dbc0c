"""Cell means by subject, scene and aperture, and contrasts of apertures within each cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.statistics.records import NotComputed

__all__ = ["ALL_SCENES", "Cells", "cells", "paired_differences", "slope_weights"]

FloatArray = NDArray[np.float64]

ALL_SCENES = "all scenes"
"""Scene of values that are averaged over scenes."""


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Mean answers by subject, scene and aperture.

    Parameters
    ----------
    values
        Subjects x scenes x apertures; NaN without answers. If no subject saw any scene with two apertures, the values
        are averages over scenes, and `scenes` is empty.
    subjects, scenes
        Names, in the order of the axes.
    amounts
        Aperture diameters in mm, ascending.
    """

    values: FloatArray
    subjects: tuple[str, ...]
    scenes: tuple[str, ...]
    amounts: FloatArray

    def contrast(self, weights: FloatArray) -> FloatArray:
        """Return the weighted sum over apertures (subjects x scenes); NaN if a value with nonzero weight is missing."""
        used = weights != 0
        return self.values[:, :, used] @ weights[used]

    def against_smallest(self, aperture: int) -> FloatArray:
        """Return the difference between an aperture and the smallest one (subjects x scenes)."""
        return self.values[:, :, aperture] - self.values[:, :, 0]

    def table(self, values: FloatArray) -> pd.DataFrame:
        """Label values of subjects x scenes, or of subjects x 1."""
        scenes = list(self.scenes) if values.shape[1] == len(self.scenes) else [ALL_SCENES]
        return pd.DataFrame(values, list(self.subjects), scenes)


def cells(rows: pd.DataFrame) -> Cells:
    """Average the column `answer` of a table of trials with one fixation.

    Examples
    --------
    >>> rows = pd.DataFrame({"participant_id": list("aabb"), "scene": "room", "aperture_mm": [0.0, 4.0] * 2,
    ...                      "answer": [0.0, 0.5, 0.1, 0.3]})
    >>> cells(rows).against_smallest(1).round(3).tolist()
    [[0.5], [0.2]]
    """
    subject, subjects = pd.factorize(rows["participant_id"], sort=True)
    scene, scenes = pd.factorize(rows["scene"].astype(str), sort=True)
    amount, amounts = pd.factorize(rows["aperture_mm"], sort=True)
    shape = (len(subjects), len(scenes), len(amounts))
    place = np.ravel_multi_index((subject, scene, amount), shape)
    total = np.bincount(place, rows["answer"].to_numpy(dtype=float), np.prod(shape)).reshape(shape)
    count = np.bincount(place, minlength=np.prod(shape)).reshape(shape)
    if len(amounts) > 1 and not ((count > 0).sum(axis=2) > 1).any():
        total, count, scenes = total.sum(axis=1, keepdims=True), count.sum(axis=1, keepdims=True), scenes[:0]
    with np.errstate(invalid="ignore"):
        values = total / count
    return Cells(values, tuple(map(str, subjects)), tuple(map(str, scenes)), np.asarray(amounts, dtype=float))


def paired_differences(first: pd.DataFrame, second: pd.DataFrame) -> pd.DataFrame:
    """Return differences of two tables within subject and scene; of the means over scenes if no scene has both.

    >>> first, second = (pd.DataFrame({"room": values}, ["a", "b"]) for values in ([0.5, 0.2], [0.1, 0.1]))
    >>> paired_differences(first, second)["room"].round(3).tolist()
    [0.4, 0.1]
    """
    differences = first - second
    if np.isfinite(differences.to_numpy(dtype=float)).any():
        return differences
    return (first.mean(axis=1) - second.mean(axis=1)).to_frame(ALL_SCENES)


def slope_weights(amounts: FloatArray) -> FloatArray | NotComputed:
    """Return the weights of the least-squares slope on the amounts.

    Examples
    --------
    >>> slope_weights(np.array([0.0, 1.0, 2.0]))
    array([-0.5,  0. ,  0.5])
    """
    if len(amounts) < 2:
        return NotComputed("A slope needs two or more apertures.")
    off = amounts - amounts.mean()
    return off / (off**2).sum()
