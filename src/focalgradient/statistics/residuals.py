"""Subject effects and residuals, for diagnostic plots of the assumptions of the tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.scales.analyses import Analysis
from focalgradient.statistics.cells import cells, slope_weights
from focalgradient.statistics.records import NotComputed
from focalgradient.statistics.tables import fixations_of

__all__ = ["Residuals", "rating_residuals"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """Effects and residuals of one fixation.

    Parameters
    ----------
    fixation
        Object in focus.
    subjects
        Mean effect of each subject over scenes.
    fitted, residual
        Fitted value (mean + subject + scene) and residual of each subject and scene, one array each. Empty with one
        scene.
    what
        Description of the effect.
    """

    fixation: str
    subjects: FloatArray
    fitted: FloatArray
    residual: FloatArray
    what: str


def rating_residuals(table: pd.DataFrame, analysis: Analysis) -> tuple[Residuals, ...]:
    """Return the effects that are tested: log ratios of the largest to the smallest aperture, or slopes.

    Parameters
    ----------
    table
        Ratings as for `focalgradient.statistics.analyse`; catch trials are excluded.
    analysis
        Analysis of the answers.

    Examples
    --------
    >>> rows = [{"participant_id": who, "scene": scene, "aperture_mm": mm, "fixation": "nearest", "catch": False,
    ...          "rating": np.exp(mm * (0.1 + 0.01 * who))} for who in range(3) for scene in "ab" for mm in (0.0, 10.0)]
    >>> from focalgradient.scales.analyses import Ratios
    >>> [found] = rating_residuals(pd.DataFrame(rows), Ratios())
    >>> found.subjects.round(2).tolist(), bool(np.allclose(found.residual, 0))
    ([1.0, 1.1, 1.2], True)
    """
    rows = table[~table["catch"].astype(bool)]
    answer = np.log(rows["rating"].to_numpy(float)) if analysis.ratios else rows["rating"].to_numpy(float)
    rows = rows.assign(answer=answer)
    if "scene" not in rows:
        rows = rows.assign(scene="")
    found = []
    for fixation in fixations_of(rows):
        own = cells(rows[rows["fixation"] == fixation])
        weights = slope_weights(own.amounts)
        if isinstance(weights, NotComputed):
            continue
        effect = own.against_smallest(-1) if analysis.ratios else own.contrast(weights)
        what = "log ratio, largest aperture to smallest" if analysis.ratios else "slope of the answer (per mm)"
        whole = effect[np.isfinite(effect).any(axis=1)]
        if not whole.size:
            continue
        subjects = np.nanmean(whole, axis=1)
        fitted = residual = np.empty(0)
        if whole.shape[1] > 1:
            scenes = np.array(
                [column[np.isfinite(column)].mean() if np.isfinite(column).any() else np.nan for column in whole.T]
            )
            expected = subjects[:, None] + scenes - np.nanmean(whole)
            there = np.isfinite(whole) & np.isfinite(expected)
            fitted, residual = expected[there], (whole - expected)[there]
        found.append(Residuals(fixation, subjects, fitted, residual, what))
    return tuple(found)
