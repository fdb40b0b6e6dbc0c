"""Contrasts of apertures within each subject and scene: a table of subjects by scenes, for `crossed_effect`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.statistics.records import NotComputed

__all__ = ["Cells", "cells", "curvature_weights", "slope_weights"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Means of the answers.

    Parameters
    ----------
    values
        Subjects x scenes x apertures; NaN where there is no answer. Where no scene was shown to one subject with two
        apertures, the scenes are averaged over, and `scenes` is empty.
    subjects, scenes
        Names, in the order of the axes.
    amounts
        Apertures in mm, ascending.
    """

    values: FloatArray
    subjects: tuple[str, ...]
    scenes: tuple[str, ...]
    amounts: FloatArray

    def contrast(self, weights: FloatArray) -> FloatArray:
        """Weighted sum over apertures, a row a subject and a column a scene; NaN where one that counts is missing."""
        used = weights != 0
        return self.values[:, :, used] @ weights[used]

    def against_smallest(self, aperture: int) -> FloatArray:
        """An aperture less the smallest one."""
        return self.values[:, :, aperture] - self.values[:, :, 0]


def cells(rows: pd.DataFrame) -> Cells:
    """Means of the column `answer` of a table of trials with one fixation.

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


def slope_weights(amounts: FloatArray) -> FloatArray | NotComputed:
    """Weights of the least-squares slope on the amounts.

    Examples
    --------
    >>> slope_weights(np.array([0.0, 1.0, 2.0]))
    array([-0.5,  0. ,  0.5])
    """
    if len(amounts) < 2:
        return NotComputed("A slope needs two or more apertures.")
    off = amounts - amounts.mean()
    return off / (off**2).sum()


def curvature_weights(amounts: FloatArray) -> FloatArray | NotComputed:
    """Weights of what the fitted parabola has at half the largest amount beyond the straight line to its end.

    Positive where the curve saturates. Orthogonal to the line's level and slope.

    Examples
    --------
    >>> amounts = np.array([0.0, 1.0, 2.0])
    >>> float((curvature_weights(amounts) @ -(amounts - 1.0)**2).round(6))
    1.0
    """
    if len(amounts) < 3:
        return NotComputed("Lack of fit to a straight line needs three or more apertures.")
    design = np.column_stack([np.ones(len(amounts)), amounts, amounts**2])
    square = np.linalg.pinv(design)[2]
    return np.asarray(-square * (np.ptp(amounts) / 2) ** 2, dtype=float)
