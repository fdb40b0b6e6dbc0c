"""Observers of the adaptive experiment: they look at the pictures, or have a known psychometric function.

Of those who look the threshold follows from the rule of discrimination and from what is left of blur in the pixels.
With a known threshold and no pictures the procedure, the records, the fit and its interval are tried.
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
"""Median threshold over observers, by the unit of the levels: the middle of 0.10 to 0.18 D for detecting blur
(Campbell & Westheimer 1958; Walsh & Charman 1988), and for depth a choice of ours."""

SPREAD = 0.4
"""Standard deviation of its logarithm over observers; our choice, of the size of the spread of Weber fractions."""

SLOPE = 3.5
"""Weibull slope, that of QUEST (Watson & Pelli 1983)."""

CRITERION = 0.75
"""Share of right answers at threshold."""

LEAST_S = 0.2
"""Seconds that the quickest answer takes."""


def known_threshold(design: BlurThresholdDesign, participant: str, seed: int) -> float:
    """The threshold that a simulated observer has, in the unit of the levels: known, so that it can be recovered.

    >>> known_threshold(BlurThresholdDesign(), "01", 1) == known_threshold(BlurThresholdDesign(), "01", 1)
    True
    """
    normal = random_stream(seed, design.task, participant).standard_normal()
    found = THRESHOLDS[design.unit] * math.exp(SPREAD * normal)
    return round(float(min(max(found, 2 * design.least_level), design.most_level / 2)), 6)


def seen_threshold(
    design: BlurThresholdDesign, observer: Observer, participant: str, seed: int, seen: Mapping[str, SeenLevels]
) -> float | None:
    """Level at which a person who looks is right in 75 % of trials but for lapses; None if at none of them."""
    person = replace(observer.person(random_stream(seed, design.task, participant)), lapses=0.0)
    levels = next(iter(seen.values())).levels
    share = np.maximum.accumulate(np.mean([one.right_shares(person) for one in seen.values()], axis=0))
    if not share[0] < CRITERION <= share[-1]:
        return None
    return round(math.exp(float(np.interp(CRITERION, share, np.log(levels)))), 6)


def right_share(level: float, threshold: float, slope: float = SLOPE, lapses: float = 0.01) -> float:
    """Probability of a right answer between two intervals: 75 % at the threshold, without lapses.

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
    """Answer every trial of a participant's list, at the levels that the procedure chooses from the answers before.

    Parameters
    ----------
    design, participant
        The list.
    observer
        Lapses by its share, guesses if it does; one for whom blur means nothing guesses, too.
    seed
        Of all that is random.
    threshold, slope
        Of the psychometric function; None: `known_threshold`.
    seen
        What is looked at, by scene (`encoded_levels`); None: no pictures, and the psychometric function instead.
    """
    person = observer.person(random_stream(seed, design.task, participant))
    known = known_threshold(design, participant, seed) if threshold is None else threshold
    shares = {scene: (one.levels, one.right_shares(person)) for scene, one in (seen or {}).items()}
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
        time = max(DECISION * math.exp(DECISIONS * random.standard_normal()), LEAST_S)
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
