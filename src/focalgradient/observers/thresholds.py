"""Observers of the adaptive experiment: a psychometric function whose threshold is known, and so can be recovered.

They do not look at the pictures: what is tried with them is the procedure, the records, the fit and its interval.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from focalgradient.dataset import Chosen
from focalgradient.design import BlurThresholdDesign, BlurTrial, Procedure
from focalgradient.observers.answers import BREAK, DECISION, DECISIONS, PAUSE, random_stream
from focalgradient.observers.observer import Observer

__all__ = ["SLOPE", "choose", "known_threshold", "right_share"]

THRESHOLDS = {"D": 0.14, "mm": 1.0}
"""Median threshold over observers, by the unit of the levels: the middle of 0.10 to 0.18 D for detecting blur
(Campbell & Westheimer 1958; Walsh & Charman 1988), and for depth a choice of ours."""

SPREAD = 0.4
"""Standard deviation of its logarithm over observers; our choice, of the size of the spread of Weber fractions."""

SLOPE = 3.5
"""Weibull slope, that of QUEST (Watson & Pelli 1983)."""

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
    """
    known = known_threshold(design, participant, seed) if threshold is None else threshold
    guesses = observer.guesses or observer.prior == 0
    procedure: Any = Procedure(design)
    clock = 0.0
    given: list[Chosen] = []
    for number, trial in enumerate(design.trials(participant), start=1):
        assert isinstance(trial, BlurTrial)
        random: np.random.Generator = random_stream(seed, design.task, participant, number)
        easy = trial.catch or trial.phase == "practice"
        level = design.levels[-1] if easy else procedure.level()
        right = bool(random.random() < (0.5 if guesses else right_share(level, known, slope, observer.lapses)))
        if not easy:
            procedure.learn([*procedure.learnt, (level, right)])
        time = max(DECISION * math.exp(DECISIONS * random.standard_normal()), LEAST_S)
        clock += BREAK * trial.break_before + design.pause_s + design.mark_s
        answer = trial.interval if right else 3 - trial.interval
        given.append(
            Chosen(onset=round(clock, 4), level=level, answer=answer, correct=right, response_time=round(time, 4))
        )
        clock += design.shown_s + time + PAUSE
    return tuple(given)
