"""Likelihoods of the answers of a data set under simulated observers, for fitting and comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.observers import AnswerModel, Answers, PersonModel
from focalgradient.observers.blur_rules import blur_choices, blur_ratings
from focalgradient.observers.percept_rules import PERCEPT_OBSERVERS
from focalgradient.observers.transducers import transducer_observers
from focalgradient.scales import Analysis
from focalgradient.statistics import NotComputed
from focalgradient.statistics.cube import percepts_in_order

__all__ = ["Observed", "observed_percepts", "observed_ratings", "observed_thresholds"]

FEWEST_PEOPLE = 3
"""Minimum number of people for cross-validation over people with a standard deviation over the others."""


@dataclass(frozen=True, slots=True)
class Observed:
    """Answers of one task, and observers to be fitted to them.

    Parameters
    ----------
    answers
        Answers of all people.
    observers
        Observers by name.
    method
        Description of the observers for the methods.
    """

    answers: Answers
    observers: Mapping[str, AnswerModel | PersonModel]
    method: str


def _too_few(table: pd.DataFrame) -> NotComputed | None:
    people = int(table["participant_id"].nunique())
    if people >= FEWEST_PEOPLE:
        return None
    return NotComputed(
        f"Observers are compared by people held out, which needs {FEWEST_PEOPLE} of them, and there are {people}."
    )


def observed_ratings(kept: pd.DataFrame, analysis: Analysis) -> Observed | NotComputed:
    """Prepare depth ratings or choices; scene means are removed, so that all observers account for scenes equally."""
    if analysis.whole:
        return NotComputed("Steps of a scale have no observer to fit: a normal error of ordinal steps is not assumed.")
    table = kept[~kept["catch"]]
    if other := sorted(set(table["fixation"]) - {"nearest", "farthest"}):
        return NotComputed(f"The observers know the foci nearest and farthest, and these trials have {other[0]}, too.")
    if few := _too_few(table):
        return few
    aperture = table["aperture_mm"].to_numpy(float)
    nearest = (table["fixation"] == "nearest").to_numpy(float)
    if np.ptp(aperture) == 0:
        return NotComputed("All pictures have one aperture: no observer differs from another in what it predicts.")
    who, shown = table["participant_id"].to_numpy(), {"aperture": aperture, "nearest": nearest}
    rules = "They see a defocus in proportion to the aperture and differ in what blur means with each object in focus."
    answer = pd.Series(table["rating"].to_numpy(float))
    if analysis.binary:
        method = f"{rules} Choices follow a cumulative normal; each person’s sensitivity is their own."
        return Observed(Answers(who, shown, np.asarray(answer, float)), blur_choices(aperture, nearest), method)
    rated = pd.Series(np.log(answer.to_numpy())) if analysis.ratios else answer
    rated = rated - rated.groupby(table["scene"].to_numpy()).transform("mean") + rated.mean()
    what = "logarithms of ratings" if analysis.ratios else "ratings as they stand"
    method = (
        f"{rules} The {what}, less the scenes’ means, are normally distributed; each person’s level and sensitivity to "
        "blur are their own."
    )
    answers = Answers(who, shown, np.asarray(rated, float))
    return Observed(answers, blur_ratings(aperture, nearest, answers.answer), method)


def observed_percepts(kept: pd.DataFrame) -> Observed | NotComputed:
    """Prepare percept durations of the cube, for both readings."""
    rows, first = percepts_in_order(kept[~kept["catch"]])
    if rows.empty:
        return NotComputed("No reading was reported for any time: no observer can be fitted.")
    if few := _too_few(rows):
        return few
    reading = rows["reading"].to_numpy()
    strengths = rows["strength"].to_numpy(float)
    size = np.where(rows["gradient"] == "none", 0.0, strengths / max(float(strengths.max()), 1e-9))
    favours = np.where(rows["gradient"] == "rigid", 1.0, -1.0)
    seconds = rows["duration"].to_numpy(float)
    shown = {"reading": reading, "favoured": size * favours * reading, "first": first.astype(float)}
    before = {f"before_{name}": np.where(first, 0.0, np.roll(array, 1)) for name, array in shown.items()}
    before["before_log"] = np.where(first, 0.0, np.roll(np.log(seconds), 1))
    shown |= before | {"censored": rows["censored"].to_numpy(float)}
    observers = {
        name: one for name, one in PERCEPT_OBSERVERS.items() if "gradient" not in one.start or bool((size > 0).any())
    }
    method = (
        "A reading lasts longer by a preference, by a gradient of blur that favours it, or by neither. Durations are "
        "log-normal, the first percept of a trial has a median of its own, and log duration is correlated with that of "
        "the percept before; one observer has percepts without this memory, and one of those has gamma distributions."
    )
    return Observed(Answers(rows["participant_id"].to_numpy(), shown, seconds), observers, method)


def observed_thresholds(table: pd.DataFrame, guess: float = 0.5) -> Observed | NotComputed:
    """Prepare correct and incorrect answers at levels, by condition if there are several."""
    rows = table[~table["catch"]]
    if few := _too_few(rows):
        return few
    names = rows["condition"].astype(str) if "condition" in rows else pd.Series("", index=rows.index)
    condition = pd.factorize(names, sort=True)[0].astype(float)
    level = rows["level"].to_numpy(float)
    method = (
        "They differ in how sensitivity grows with the level: not at all, in proportion, as the square, or as a power "
        "that is fitted; each person’s threshold is their own."
    )
    answers = Answers(
        rows["participant_id"].to_numpy(), {"level": level, "condition": condition}, rows["correct"].to_numpy(float)
    )
    return Observed(answers, transducer_observers(level, condition, guess), method)
