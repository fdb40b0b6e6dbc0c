"""Subject effects and residuals, for diagnostic plots of the assumptions of the tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.arrays import FloatArray
from focalgradient.statistics.cells import cells, slopes
from focalgradient.statistics.questions import Answers
from focalgradient.statistics.rating_questions import EFFECT
from focalgradient.statistics.records import NotComputed

__all__ = ["Residuals", "rating_residuals"]


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


def rating_residuals(answers: Answers, table: pd.DataFrame) -> tuple[Residuals, ...]:
    """Return the values that were tested: log ratios of the largest aperture to the pinhole, or slopes.

    Parameters
    ----------
    answers
        Answers of the analysis of ratings.
    table
        Ratings, of which the slopes are taken where the answers have no values of each subject and scene, as those of a
        mixed model; catch trials are excluded.

    Examples
    --------
    >>> rows = [{"participant_id": who, "scene": scene, "aperture": name, "aperture_mm": mm, "fixation": "nearest",
    ...          "trial": mm, "catch": False, "rating": np.exp(mm * (0.1 + 0.01 * who))}
    ...         for who in range(3) for scene in "ab" for name, mm in (("pinhole", 0.0), ("f/5", 10.0))]
    >>> from focalgradient.statistics import analyse
    >>> [found] = rating_residuals(analyse(pd.DataFrame(rows).assign(trial=range(12)), "ratio").answers, None)
    >>> found.subjects.round(2).tolist(), bool(np.allclose(found.residual, 0)), found.what
    ([1.0, 1.1, 1.2], True, 'log ratio, largest aperture to pinhole')
    """
    found = []
    for answer in answers.primary:
        tested = _slopes(table, answer.level) if answer.values is None else answer.values
        if isinstance(tested, NotComputed) or not np.isfinite(values := tested.to_numpy(float)).any():
            continue
        whole = values[np.isfinite(values).any(axis=1)]
        subjects = np.nanmean(whole, axis=1)
        fitted = residual = np.empty(0)
        if whole.shape[1] > 1:
            scenes = pd.DataFrame(whole).mean().to_numpy()
            expected = subjects[:, None] + scenes - np.nanmean(whole)
            there = np.isfinite(whole) & np.isfinite(expected)
            fitted, residual = expected[there], (whole - expected)[there]
        what = "log ratio, largest aperture to pinhole" if answer.name == EFFECT else "slope of the answer (per mm)"
        found.append(Residuals(answer.level, subjects, fitted, residual, what))
    return tuple(found)


def _slopes(table: pd.DataFrame, fixation: str) -> pd.DataFrame | NotComputed:
    """Return the slopes of the answers with one object in focus (subjects x scenes)."""
    rows = table[~table["catch"] & (table["fixation"] == fixation)]
    return slopes(cells(rows.rename(columns={"rating": "answer"})))
