"""Observers at threshold, who differ in how sensitivity grows with the level.

With two intervals an answer is right with the probability Phi(d' / sqrt 2), and d' is 0.954 (level / threshold) to the
power of the exponent, so that 75 % are right at the threshold. With another guess rate g that probability is scaled to
run from g.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, ndtri

from focalgradient.observers.likelihood import Choices, Conditions, Values

__all__ = ["transducer_observers"]

FloatArray = NDArray[np.float64]

LAPSES = 0.02
"""Share of answers without looking (Wichmann & Hill 2001); fixed."""

EXPONENTS: Mapping[str, float | None] = {"linear transducer": 1.0, "square transducer": 2.0, "power transducer": None}
"""Exponent of d' by the level, None where it is fitted: linear, of energy (the square), and any (Nachmias 1981)."""


def transducer_observers(levels: ArrayLike, conditions: ArrayLike, guess: float = 0.5) -> dict[str, Choices]:
    """Observers of detection or discrimination at levels.

    The conditions of their answers are `level`, and `condition`, a number from 0; the answer is 1 where right.
    Parameters: `threshold` (in the unit of the levels; geometric mean over people), with several conditions
    `threshold_1` and so on, `people` (SD over people of its logarithm), and `exponent`.

    Parameters
    ----------
    levels
        Of each trial, above 0: their geometric mean is where the search starts.
    conditions
        Number of each trial's condition.
    guess
        Share of right answers without a stimulus.

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
            names = [name for name in (f"threshold_{one}" for one in range(1, several)) if name in values]
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
    found = {"guessing": Choices(guessing, {})}
    for name, exponent in EXPONENTS.items():
        found[name] = of(shared | ({} if exponent else {"exponent": 1.5}), exponent)
    if several > 1:
        own = {f"threshold_{one}": middle for one in range(1, several)}
        found["power transducer, a threshold for each condition"] = of(shared | own | {"exponent": 1.5}, None)
    return found
