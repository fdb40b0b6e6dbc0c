"""The two experiments of Pentland (1987): depth ratings, and the rotating Necker cube."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.design import DepthRatingDesign, NeckerDesign
from focalgradient.observers import Observer, seen_pictures
from focalgradient.observers.rotation import encoded_cubes
from focalgradient.observers.sessions import observe
from focalgradient.progress import silent
from focalgradient.published.record import Prediction, mean_of, ratio_of
from focalgradient.tasks import task_named

__all__ = ["nonrigid_change", "rise"]

PEOPLE, SEED = 20, 1987
"""Number of simulated people per observer, and random seed (our choice)."""

SCENES = ("spheres-01", "spheres-02", "spheres-03", "spheres-04")
"""Scenes of the small pictures that are rated (our choice)."""


def _people(observer: Observer, design: DepthRatingDesign | NeckerDesign, encoded: Any) -> list[tuple[Any, ...]]:
    task = task_named(design.task)
    return [observe(task, design, observer, _label(person), SEED, encoded) for person in range(PEOPLE)]


def _label(person: int) -> str:
    return f"{person + 1:02}"


@lru_cache(maxsize=8)
def _ratings(observer: Observer) -> Mapping[tuple[str, str], np.ndarray]:
    """Return the log geometric mean rating of each simulated person, by aperture and fixation."""
    design = DepthRatingDesign(scenes=SCENES, catch_trials=0, practice_trials=0)
    encoded = seen_pictures(design, None, None, silent)["encoded"]
    rows = [
        (trial.aperture, trial.fixation, person, math.log(answer.rating))
        for person, answers in enumerate(_people(observer, design, encoded))
        for trial, answer in zip(design.trials(_label(person)), answers, strict=True)
    ]
    means = pd.DataFrame(rows).groupby([0, 1, 2])[3].mean().unstack()
    return {condition: means.loc[condition].to_numpy() for condition in means.index}


def rise(observer: Observer, fixation: str) -> Prediction:
    """Return the ratio of ratings at the largest aperture and at the pinhole: geometric mean over simulated people."""
    rated = _ratings(observer)
    largest = DepthRatingDesign().apertures[-1]
    return ratio_of([*(rated[largest, fixation] - rated["pinhole", fixation])])


@lru_cache(maxsize=8)
def nonrigid_change(observer: Observer) -> Prediction:
    """Return the change in the nonrigid proportion of time from no gradient to the strongest nonrigid gradient."""
    design = NeckerDesign()
    encoded = encoded_cubes(design)
    strongest = max(trial.strength for trial in design.trials("01"))
    changes = []
    for person, answers in enumerate(_people(observer, design, encoded)):
        keys = {str(reading): key for reading, key in design.keys_of(_label(person)).items()}
        shares: dict[tuple[str, float], list[float]] = {}
        for trial, answer in zip(design.trials(_label(person)), answers, strict=True):
            if trial.phase == "main" and trial.is_ambiguous:
                held = {percept: answer.share_held(keys, percept) for percept in ("rigid", "nonrigid")}
                shares.setdefault((trial.gradient, trial.strength), []).append(held["nonrigid"] / sum(held.values()))
        changes.append(float(np.mean(shares["nonrigid", strongest]) - np.mean(shares["none", 0.0])))
    return mean_of(changes)
