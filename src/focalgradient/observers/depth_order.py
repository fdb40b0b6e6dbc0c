"""Observer models of depth-order judgements from disparity, rendered blur and accommodation.

Each cue has a sensitivity d' proportional to the difference in distance in dioptres; independent cues add in
quadrature. In displays with fixed focus, the sensitivity of disparity decreases exponentially as the targets come
nearer than 1 D, and the vergence-accommodation conflict biases all answers towards incorrect; blur and accommodation
are in dioptres and thus independent of distance. These forms are assumptions, which are compared by cross-validation.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from focalgradient.arrays import FloatArray
from focalgradient.observers.likelihood import Choices, Conditions, Values

__all__ = ["DEPTH_ORDER_OBSERVERS", "depth_order_observer"]


UNIT = 0.35
"""Difference in distance (D) to which the d' parameters refer, between the differences of 0.2 and 0.5 D shown."""

LAPSES = 0.02
"""Lapse rate, fixed (Wichmann & Hill 2001)."""

CUES = {"blur": "rendered_blur", "accommodation": "focus_follows", "monovision": "monovision"}
"""Sensitivity parameter of each cue, and condition (1 or 0) that states whether the cue is available."""

START = {"disparity": 0.6, "fall": 1.8, "people": 0.5, "near_bias": 0.05}
FIRST = {"conflict": 0.2}


def depth_order_observer(*cues: str) -> Choices:
    """Return an observer that uses disparity and the given cues ("blur", "accommodation", "monovision", "conflict").

    The conditions are `viewing` (D), `relative` (D, of the second target; nonzero), and those of `CUES`. The parameters
    are `disparity` and the names of the cues (d' at 0.35 D), `fall` (per D), `people` (SD over people of the log
    sensitivity), `near_bias` and `conflict` (in standard deviations of the decision).

    Examples
    --------
    >>> observer = depth_order_observer("blur")
    >>> conditions = {"viewing": np.array([2.0]), "relative": np.array([0.5]), "rendered_blur": np.array([1.0])}
    >>> conditions = {name: array[:, None] for name, array in conditions.items()}
    >>> float(observer.probability(conditions, dict(observer.start), np.zeros((1, 1))).round(2)[0, 0])
    0.69
    """
    chosen = {name: condition for name, condition in CUES.items() if name in cues}
    unknown = set(cues) - set(CUES) - set(FIRST)
    if unknown:
        raise ValueError(f"cues must be among {', '.join([*CUES, *FIRST])}, got {', '.join(sorted(unknown))}.")

    def probability(conditions: Conditions, values: Values, own: FloatArray) -> FloatArray:
        size, near = np.abs(conditions["relative"]) / UNIT, conditions["viewing"] - 1.0
        power = (values["disparity"] * size * np.exp(-values["fall"] * near)) ** 2
        for name, condition in chosen.items():
            power = power + conditions[condition] * (values[name] * size) ** 2
        evidence = np.sqrt(power) * np.exp(values["people"] * own)
        bias = values["near_bias"] * np.sign(conditions["relative"]) - values.get("conflict", 0.0) * near
        return np.asarray(LAPSES / 2 + (1 - LAPSES) * ndtr(evidence + bias))

    start = START | dict.fromkeys(chosen, 0.3) | {name: FIRST[name] for name in FIRST if name in cues}
    return Choices(probability, start, frozenset({"disparity", "people", *chosen}))


DEPTH_ORDER_OBSERVERS = {
    " + ".join(("disparity", *cues)): depth_order_observer(*cues)
    for cues in (
        (),
        ("blur",),
        ("accommodation",),
        ("blur", "accommodation"),
        ("blur", "accommodation", "monovision"),
        ("conflict",),
        ("blur", "conflict"),
        ("accommodation", "conflict"),
        ("blur", "accommodation", "conflict"),
        ("blur", "accommodation", "monovision", "conflict"),
    )
}
"""Combinations of cues that are compared."""
