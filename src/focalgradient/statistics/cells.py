"""Cell means by subject, scene and aperture, and contrasts of apertures within each cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pandas as pd

from focalgradient.arrays import FloatArray
from focalgradient.statistics.records import NotComputed
from focalgradient.user_tables.tidy import fixations_of

__all__ = ["ALL_SCENES", "Cells", "cells", "cells_of", "differences", "less", "rises", "slope_weights", "slopes"]


Values = pd.DataFrame | NotComputed
"""Values of subjects (rows) x scenes (columns), or the reason why there are none."""

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
    amounts, apertures
        Aperture diameters in mm, ascending, and their names.
    """

    values: FloatArray
    subjects: tuple[str, ...]
    scenes: tuple[str, ...]
    amounts: FloatArray
    apertures: tuple[str, ...]

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
    >>> rows = pd.DataFrame({"participant_id": list("aabb"), "scene": "room", "aperture": ["pinhole", "f/11"] * 2,
    ...                      "aperture_mm": [0.0, 4.0] * 2, "answer": [0.0, 0.5, 0.1, 0.3]})
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
    names = rows["aperture"].iloc[np.unique(amount, return_index=True)[1]]
    levels = tuple(map(str, subjects)), tuple(map(str, scenes)), np.asarray(amounts, dtype=float)
    return Cells(values, *levels, tuple(map(str, names)))


def cells_of(trials: pd.DataFrame) -> dict[str, Cells]:
    """Return the cells of each fixation of trials that have a column `answer`."""
    return {name: cells(trials[trials["fixation"] == name]) for name in fixations_of(trials)}


def rises(fixation: str, own: Cells, aperture: int = -1) -> Values:
    """Return the differences between an aperture and the pinhole (log ratios, of logarithms) at a fixation."""
    if own.amounts[0] != 0:
        return NotComputed(f"The {fixation} object is fixated in no pinhole trial: there is no ratio to the pinhole.")
    if len(own.amounts) < 2:
        return NotComputed("The pinhole is the only aperture.")
    return own.table(own.against_smallest(aperture))


def less(one: object, other: object) -> str:
    """Name the difference of two levels.

    >>> less("nearest", "farthest")
    'nearest less farthest'
    """
    return f"{one} less {other}"


def differences(of: Mapping[str, Values]) -> dict[str, Values]:
    """Return the differences of each pair of tables within subject and scene; of the means if no scene has both.

    >>> first, second = (pd.DataFrame({"room": values}, ["a", "b"]) for values in ([0.5, 0.2], [0.1, 0.1]))
    >>> differences({"nearest": first, "farthest": second})["nearest less farthest"]["room"].round(3).tolist()
    [0.4, 0.1]
    """
    return {less(*pair): _difference(*(of[name] for name in pair)) for pair in combinations(of, 2)}


def _difference(first: Values, second: Values) -> Values:
    if isinstance(first, NotComputed):
        return first
    if isinstance(second, NotComputed):
        return second
    apart = first - second
    if np.isfinite(apart.to_numpy(dtype=float)).any():
        return apart
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


def slopes(own: Cells) -> Values:
    """Return least-squares slopes per mm of aperture (subjects x scenes; per subject if no scene has all apertures)."""
    weights = slope_weights(own.amounts)
    if isinstance(weights, NotComputed):
        return weights
    found = own.contrast(weights)
    if not np.isfinite(found).any():
        seen = np.isfinite(own.values)
        with np.errstate(invalid="ignore"):
            means = np.where(seen, own.values, 0).sum(axis=1, keepdims=True) / seen.sum(axis=1, keepdims=True)
        found = replace(own, values=means).contrast(weights)
    return own.table(found)
