"""Observer models of threshold data that differ in the growth of sensitivity with level.

With two intervals the probability of a correct answer is Phi(d' / sqrt 2), and d' is 0.954 (level / threshold) to the
power of an exponent, so that 75 % are correct at threshold. For another guess rate g the probability is rescaled to
start at g.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from focalgradient.arrays import FloatArray
from focalgradient.observers.likelihood import Choices, Conditions, Values

__all__ = ["transducer_observers"]


LAPSES = 0.02
"""Lapse rate, fixed (Wichmann & Hill 2001)."""

EXPONENTS: Mapping[str, float | None] = {"linear transducer": 1.0, "square transducer": 2.0, "power transducer": None}
"""Exponent of d' as a function of level: 1 (linear), 2 (energy), or None (fitted; Nachmias 1981)."""


def transducer_observers(levels: ArrayLike, conditions: ArrayLike, guess: float = 0.5) -> dict[str, Choices]:
    """Return observer models of detection or discrimination.

    The conditions are `level`, and `condition`, an index from 0; the answer is 1 if correct. The parameters are
    `threshold` (in the unit of the levels; geometric mean over people), with several conditions `threshold_1` etc.,
    `people` (SD of the log threshold over people), and `exponent`.

    Parameters
    ----------
    levels
        Level of each trial, above 0; the search starts at the geometric mean.
    conditions
        Condition index of each trial.
    guess
        Guess rate: proportion correct without a stimulus.

    Examples
    --------
    >>> list(transducer_observers([0.1, 0.2], [0, 0]))
    ['guessing', 'linear transducer', 'square transducer', 'power transducer']
    """
    middle = float(np.exp(np.log(np.asarray(levels, float)).mean()))
    several = int(np.asarray(conditions).max()) + 1
    unit = ndtri(0.75) * math.sqrt(2)

    def of(start: dict[str, float], exponent: float | None) -> Choices:
        def probability(shown: Conditions, values: Values, own: FloatArray) -> FloatArray:
            names = [name for name in (f"threshold_{number}" for number in range(1, several)) if name in values]
            thresholds = np.log([values["threshold"], *(values[name] for name in names)])
            place = shown["condition"].astype(int) if names else np.zeros_like(shown["level"], dtype=int)
            away = np.log(shown["level"]) - thresholds[place] - values["people"] * own
            sensitivity = unit * np.exp(np.clip((exponent or values.get("exponent", 1.0)) * away, -30, 30))
            share = 2 * ndtr(sensitivity / math.sqrt(2)) - 1
            return np.asarray(LAPSES * guess + (1 - LAPSES) * (guess + (1 - guess) * share))

        return Choices(probability, start, frozenset(start))

    def guessing(shown: Conditions, values: Values, own: FloatArray) -> FloatArray:
        return np.asarray(guess + 0 * shown["level"] * own)

    shared = {"threshold": middle, "people": 0.4}
    observers = {"guessing": Choices(guessing, {})}
    for name, exponent in EXPONENTS.items():
        observers[name] = of(shared | ({} if exponent else {"exponent": 1.5}), exponent)
    if several > 1:
        own = {f"threshold_{one}": middle for one in range(1, several)}
        observers["power transducer, a threshold for each condition"] = of(shared | own | {"exponent": 1.5}, None)
    return observers
