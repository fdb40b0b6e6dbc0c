"""Responses of a simulated participant to all trials of a design, in the same form as a person's."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from focalgradient.dataset import Answer, Press, Rated, Watched
from focalgradient.design import DepthRatingDesign, DepthTrial, NeckerDesign, NeckerTrial
from focalgradient.design.depth_rating import EXAMPLES
from focalgradient.design.draws import digest
from focalgradient.observers.encoding import EncodedStimulus
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import relief
from focalgradient.observers.rotation import EncodedCubes, log_odds

__all__ = ["EncodedPictures", "PictureKey", "rate", "watch"]

PictureKey = tuple[str, str, str]
"""Identifier of a picture: scene, aperture and fixation."""

EncodedPictures = Mapping[PictureKey, tuple[str, EncodedStimulus]]
"""File and encoded stimulus of each picture."""

DECISION, DECISIONS = 2.0, 0.4
"""Median response time in seconds, and standard deviation of its logarithm."""

PAUSE = 1.0
"""Interval between an answer and the next trial, in seconds."""

BREAK = 30.0
"""Duration of a break, in seconds."""

REACTION, FINGERS = 0.5, 0.06
"""Delay between a change of percept and its report, and standard deviation of the lag of the other finger, in seconds.
"""

DRAWN = {EXAMPLES["flatter"]: -1.0, EXAMPLES["deeper"]: 1.0}
"""Log ratio of perceived depth of the clearly flat or deep catch drawings, relative to the standard (our choice)."""

SHORTEST = 0.3
"""Minimum duration of a percept, in seconds."""


def random_stream(seed: int, task: str, participant: str, *what: int) -> np.random.Generator:
    """Return a random generator for one cell, such as a participant and trial, independent of all other cells."""
    return np.random.default_rng(np.random.SeedSequence([seed, digest(task, participant), *what]))


def rate(
    design: DepthRatingDesign, observer: Observer, participant: str, seed: int, encoded: EncodedPictures
) -> tuple[Answer, ...]:
    """Rate every picture of a participant's trial list against the standard as last seen, on the design's scale."""
    person = observer.person(random_stream(seed, design.task, participant))
    clock, answers = 0.0, []
    standard, scale = math.nan, design.response_scale
    for number, trial in enumerate(design.trials(participant), start=1):
        assert isinstance(trial, DepthTrial)
        random = random_stream(seed, design.task, participant, number)
        clock += BREAK * trial.break_before
        if trial.standard_before or number == 1:
            _, stimulus = encoded[design.standard_scene, "pinhole", design.fixations[0]]
            standard = relief(stimulus, person, random)
            clock += design.standard_s
        file: str | None = None
        if trial.scene in DRAWN:
            log = DRAWN[trial.scene]
        else:
            file, stimulus = encoded[trial.scene, trial.aperture, trial.fixation]
            against = standard
            if design.reference == "same-scene":
                against = relief(encoded[trial.scene, "pinhole", trial.fixation][1], person, random)
            log = person.scale * math.log(relief(stimulus, person, random) / against)
        log += person.scatter * random.standard_normal()
        least, most = math.log(design.least_rating), math.log(design.most_rating)
        if person.guesses or random.random() < person.lapses:
            log = random.uniform(least, most)
        time = DECISION * math.exp(DECISIONS * random.standard_normal())
        clock += design.mark_s
        rating = scale.simulated(min(max(log, least), most), most)
        answers.append(Rated(onset=round(clock, 4), rating=rating, response_time=round(time, 4), stimulus=file))
        clock += design.shown_s + time + PAUSE
    return tuple(answers)


def watch(
    design: NeckerDesign, observer: Observer, participant: str, seed: int, encoded: EncodedCubes
) -> tuple[Answer, ...]:
    """Observe every cube of a participant's trial list, and return the key presses."""
    person = observer.person(random_stream(seed, design.task, participant))
    keys = design.keys_of(participant)
    clock, answers = 0.0, []
    for number, trial in enumerate(design.trials(participant), start=1):
        assert isinstance(trial, NeckerTrial)
        random = random_stream(seed, design.task, participant, number)
        clock += BREAK * trial.break_before + PAUSE
        absent = person.guesses or random.random() < person.lapses
        odds = 0.0 if absent else person.preference + log_odds(design, trial, encoded, person)
        presses = _presses(trial.trial_s, odds, person, (keys["rigid"], keys["nonrigid"]), random)
        answers.append(Watched(onset=round(clock, 4), presses=presses, trial_duration=trial.trial_s))
        clock += trial.trial_s
    return tuple(answers)


def _presses(
    duration: float, odds: float, person: Observer, keys: tuple[str, str], random: np.random.Generator
) -> list[Press]:
    """Return key presses during alternating percepts with log-normal durations, until the end of the trial.

    Mean durations are proportional to exp(+-odds / 2), so that the ratio of the proportions of time is exp(odds). Log
    duration is correlated with that of the preceding percept.
    """
    means = (person.dominance * math.exp(odds / 2), person.dominance * math.exp(-odds / 2))
    percept = int(random.random() >= 1 / (1 + math.exp(-odds)))
    presses: list[Press] = []
    time = residual = 0.0
    variance = person.duration_spread**2 / (1 - person.serial**2)
    while (report := time + REACTION) < duration:
        late = min(max(FINGERS * random.standard_normal(), -2 * FINGERS), 2 * FINGERS)
        if presses:
            presses.append(Press(report + late, keys[1 - percept], False))
        presses.append(Press(report, keys[percept], True))
        residual = person.serial * residual + person.duration_spread * random.standard_normal()
        time += max(SHORTEST, means[percept] * math.exp(residual - variance / 2))
        percept = 1 - percept
    ordered = sorted(press._replace(time=round(press.time, 4)) for press in presses)
    return [press for press in ordered if press.time < duration]
