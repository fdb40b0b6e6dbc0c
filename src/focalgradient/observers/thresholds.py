"""Observers of the adaptive experiment, who look at pictures or have a known psychometric function.

The threshold of observers who look follows from the discrimination rule and the blur that remains in the pixels. Known
thresholds without pictures serve to test procedure, records, fit and interval.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from focalgradient.dataset import Chosen
from focalgradient.design import BlurThresholdDesign, BlurTrial, Procedure
from focalgradient.observers.answers import BREAK, DECISION, DECISIONS, PAUSE, random_stream
from focalgradient.observers.observer import Observer

if TYPE_CHECKING:
    from focalgradient.observers.intervals import SeenLevels

__all__ = ["SLOPE", "choose", "known_threshold", "right_share", "seen_threshold"]

THRESHOLDS = {"D": 0.14, "mm": 1.0}
"""Median threshold over observers, by the unit of the levels: for detecting blur, the centre of 0.10 to 0.18 D
(Campbell & Westheimer 1958; Walsh & Charman 1988); for depth, our choice.
"""

THRESHOLD_LOG_SD = 0.4
"""SD over observers of the log threshold (our choice, similar to that of Weber fractions)."""

SLOPE = 3.5
"""Weibull slope of QUEST (Watson & Pelli 1983)."""

CRITERION = 0.75
"""Proportion correct at threshold."""

MIN_RESPONSE_TIME = 0.2
"""Minimum response time, in seconds."""


def known_threshold(design: BlurThresholdDesign, participant: str, seed: int) -> float:
    """Return the known threshold of a simulated observer, in the unit of the levels.

    >>> known_threshold(BlurThresholdDesign(), "01", 1) == known_threshold(BlurThresholdDesign(), "01", 1)
    True
    """
    normal = random_stream(seed, design.task, participant).standard_normal()
    threshold = THRESHOLDS[design.unit] * math.exp(THRESHOLD_LOG_SD * normal)
    return round(float(min(max(threshold, 2 * design.least_level), design.most_level / 2)), 6)


def seen_threshold(
    design: BlurThresholdDesign, observer: Observer, participant: str, seed: int, seen: Mapping[str, SeenLevels]
) -> float | None:
    """Return the level with 75 % correct, apart from lapses, for a person who looks; None if outside the levels."""
    person = replace(observer.person(random_stream(seed, design.task, participant)), lapses=0.0)
    levels = next(iter(seen.values())).levels
    share = np.maximum.accumulate(np.mean([levels.right_shares(person) for levels in seen.values()], axis=0))
    if not share[0] < CRITERION <= share[-1]:
        return None
    return round(math.exp(float(np.interp(CRITERION, share, np.log(levels)))), 6)


def right_share(level: float, threshold: float, slope: float = SLOPE, lapses: float = 0.01) -> float:
    """Return the probability of a correct answer with two intervals: 75 % at threshold, without lapses.

    >>> right_share(0.2, 0.2, lapses=0.0), round(right_share(2.0, 0.2, lapses=0.02), 6)
    (0.75, 0.98)
    """
    return 0.5 + (0.5 - lapses) * (1 - 0.5 ** ((level / threshold) ** slope))


def choose(
    design: BlurThresholdDesign,
    observer: Observer,
    participant: str,
    seed: int,
    threshold: float | None = None,
    slope: float = SLOPE,
    seen: Mapping[str, SeenLevels] | None = None,
) -> tuple[Chosen, ...]:
    """Answer every trial of a participant's list, at the levels that the adaptive procedure chooses.

    Parameters
    ----------
    design, participant
        Design and participant of the trial list.
    observer
        Observer, with its lapse rate; observers who guess, or for whom blur is uninformative, guess.
    seed
        Random seed.
    threshold, slope
        Threshold and slope of the psychometric function; None: `known_threshold`.
    seen
        Encoded levels by scene (`encoded_levels`); None: no pictures, the psychometric function is used instead.
    """
    person = observer.person(random_stream(seed, design.task, participant))
    known = known_threshold(design, participant, seed) if threshold is None else threshold
    shares = {scene: (levels.levels, levels.right_shares(person)) for scene, levels in (seen or {}).items()}
    guesses = observer.guesses or observer.prior == 0
    procedure: Any = Procedure(design)
    clock = 0.0
    given: list[Chosen] = []
    for number, trial in enumerate(design.trials(participant), start=1):
        assert isinstance(trial, BlurTrial)
        random: np.random.Generator = random_stream(seed, design.task, participant, number)
        easy = trial.catch or trial.phase == "practice"
        level = design.levels[-1] if easy else procedure.level()
        if guesses:
            share = 0.5
        elif seen is None:
            share = right_share(level, known, slope, observer.lapses)
        else:
            levels, at_levels = shares[trial.scene]
            share = float(np.interp(math.log(level), np.log(levels), at_levels))
        right = bool(random.random() < share)
        if not easy:
            procedure.learn([*procedure.learnt, (level, right)])
        time = max(DECISION * math.exp(DECISIONS * random.standard_normal()), MIN_RESPONSE_TIME)
        clock += BREAK * trial.break_before + design.pause_s + design.mark_s
        answer = trial.interval if right else 3 - trial.interval
        given.append(
            Chosen(
                onset=round(clock, 4),
                level=level,
                answer=answer,
                correct=right,
                response_time=round(time, 4),
                stimulus=seen[trial.scene].picture if seen is not None else None,
            )
        )
        clock += design.shown_s + time + PAUSE
    return tuple(given)
