"""The two experiments of Pentland (1987): depth ratings, and the rotating Necker cube."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache, partial
from math import inf
from typing import Any

import numpy as np

from focalgradient.dataset.percepts import percepts
from focalgradient.design import DepthRatingDesign, NeckerDesign
from focalgradient.observers import Observer, seen_pictures
from focalgradient.observers.answers import observe
from focalgradient.observers.rotation import encoded_cubes
from focalgradient.published.record import Finding, Prediction, Published, mean_of, ratio_of
from focalgradient.tasks import task_named

__all__ = ["RECORDS", "nonrigid_change", "rise"]

PEOPLE, SEED = 20, 1987
"""Number of simulated people per observer, and random seed (our choice)."""

SCENES = ("spheres-01", "spheres-02", "spheres-03", "spheres-04")
"""Scenes of the small pictures that are rated (our choice)."""

OWN_LAYOUT = "that blurred is farther, and that blur contradicting the layout's order is discounted"
OWN_ODDS = "that blur favours the reading in which blurred is farther"
SMALL = (
    "20 simulated people rate 4 scenes of plain spheres in small pictures; the largest aperture is that of the design "
    "`depth-rating`, not that of the paper."
)
CUBE = "20 simulated people watch the cubes of the design `necker`; the strongest gradient is compared."


def _people(observer: Observer, design: DepthRatingDesign | NeckerDesign, encoded: Any) -> list[tuple[Any, ...]]:
    task = task_named(design.task)
    return [observe(task, design, observer, _label(person), SEED, encoded) for person in range(PEOPLE)]


def _label(person: int) -> str:
    return f"{person + 1:02}"


@lru_cache(maxsize=8)
def _ratings(observer: Observer) -> Mapping[tuple[str, str], np.ndarray]:
    """Return the log geometric mean rating of each simulated person, by aperture and fixation."""
    design = DepthRatingDesign(scenes=SCENES, catch_trials=0, practice_trials=0)
    encoded = seen_pictures(design, None, None, lambda share, words: None)["encoded"]
    found: dict[tuple[str, str], list[float]] = {}
    for person, answers in enumerate(_people(observer, design, encoded)):
        own: dict[tuple[str, str], list[float]] = {}
        for trial, answer in zip(design.trials(_label(person)), answers, strict=True):
            own.setdefault((trial.aperture, trial.fixation), []).append(math.log(answer.rating))
        for condition, logs in own.items():
            found.setdefault(condition, []).append(float(np.mean(logs)))
    return {condition: np.array(logs) for condition, logs in found.items()}


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
            if trial.phase == "main" and trial.shape == "ambiguous":
                held = {"rigid": 0.0, "nonrigid": 0.0}
                for seen in percepts(answer.presses, keys, answer.trial_duration):
                    if seen.percept in held:
                        held[seen.percept] += seen.end - seen.onset
                shares.setdefault((trial.gradient, trial.strength), []).append(held["nonrigid"] / sum(held.values()))
        changes.append(float(np.mean(shares["nonrigid", strongest]) - np.mean(shares["none", 0.0])))
    return mean_of(changes)


RECORDS = (
    Published(
        key="pentland1987",
        citation="Pentland 1987, IEEE PAMI 9, first experiment",
        doi="",
        design="Pictures of naturalistic scenes with focal gradients of several magnitudes were rated for "
        "three-dimensionality while people fixated the nearest or the farthest object.",
        conditions=("nearest fixated", "farthest fixated"),
        settings={"task": "depthrating"},
        findings=(
            Finding(
                quantity="rating at the largest aperture over the pinhole, nearest fixated",
                units="1",
                printed="increases strongly with increasing magnitude of the focal gradient",
                low=1.0,
                high=inf,
                source="full text",
                taken=OWN_LAYOUT,
                ask=partial(rise, fixation="nearest"),
                remark=SMALL,
            ),
            Finding(
                quantity="rating at the largest aperture over the pinhole, farthest fixated",
                units="1",
                printed="no increase in subjective impression of depth results",
                low=-inf,
                high=1.0,
                source="full text",
                taken=OWN_LAYOUT,
                ask=partial(rise, fixation="farthest"),
                remark=SMALL,
            ),
        ),
    ),
    Published(
        key="pentland1987-necker",
        citation="Pentland 1987, IEEE PAMI 9, second experiment",
        doi="",
        design="A wireframe cube that rotates in perspective was seen as rigid or as wobbling, with and without a "
        "focal gradient that favours the nonrigid reading.",
        conditions=("no focal gradient", "gradient that favours the nonrigid reading"),
        settings={"task": "necker"},
        findings=(
            Finding(
                quantity="share of time nonrigid with the gradient less that without",
                units="1",
                printed="seen almost as often as the rigid one",
                low=0.0,
                high=inf,
                source="full text",
                taken=OWN_ODDS,
                ask=nonrigid_change,
                remark=CUBE,
            ),
        ),
    ),
)
