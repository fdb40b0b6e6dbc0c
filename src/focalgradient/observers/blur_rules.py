"""Observer models of depth ratings and choices that differ in how blur outside the fixated object is interpreted.

All models are given the same blur, a defocus proportional to the aperture. Its effect on the answer is linear for
little blur and logarithmic for much, arcsinh(c a) / arcsinh(c) with a the aperture as a fraction of the largest, and is
expressed as the change at the largest aperture. The rules differ in the sign of this change with the nearest and with
the farthest object in focus. Level and change vary between people with normal distributions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from focalgradient.arrays import FloatArray
from focalgradient.observers.likelihood import Answers, Choices, Conditions, Values

__all__ = ["BLUR_RULES", "BlurRatings", "BlurRule", "blur_choices", "blur_ratings"]


LAPSES = 0.02
"""Lapse rate of choices, fixed (Wichmann & Hill 2001)."""

FEWEST_APERTURES = 3
"""Minimum number of apertures, including the pinhole, for fitting the compression of the response."""

LINEAR = 1e-4
"""Compression below which the response is computed as linear (error below 1e-9)."""

SPREADS = frozenset({"people", "sensitivity", "noise"})


@dataclass(frozen=True)
class BlurRule:
    """Effect of blur on perceived depth: the parameter that it follows at each fixation, and its sign.

    Parameters
    ----------
    nearest, farthest
        Parameter of the change with that object in focus, and its sign; None: no change.
    """

    nearest: tuple[str, float] | None
    farthest: tuple[str, float] | None

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the change parameters."""
        return tuple(dict.fromkeys(name for name, _ in filter(None, (self.nearest, self.farthest))))


BLUR_RULES: Mapping[str, BlurRule] = {
    "blind to blur": BlurRule(None, None),
    "any blur deepens": BlurRule(("rise", 1.0), ("rise", 1.0)),
    "blurred is farther, or ignored": BlurRule(("rise", 1.0), None),
    "blurred is farther, or flattens": BlurRule(("rise", 1.0), ("rise", -1.0)),
    "blurred is nearer, or ignored": BlurRule(None, ("rise", 1.0)),
    "a change of its own for each focus": BlurRule(("rise_nearest", 1.0), ("rise_farthest", 1.0)),
}
"""Rules to be compared, by the sign of depth from blur and by the treatment of blur that contradicts the layout."""


def _rules(nearest: FloatArray) -> dict[str, BlurRule]:
    """Return the rules with distinct predictions; with a single fixation some coincide."""
    seen: dict[tuple[object, ...], tuple[str, BlurRule]] = {}
    for name, rule in BLUR_RULES.items():
        sides = ((True, rule.nearest), (False, rule.farthest))
        used = [effect for at, effect in sides if (nearest.astype(bool) == at).any()]
        fitted = rule.parameters if len(used) > 1 else ()
        key = tuple(None if effect is None else (fitted, effect[1]) for effect in used)
        if len(used) < 2 and used[0] is not None and used[0][1] < 0:
            continue  # the sign of a change is a free parameter
        seen.setdefault(key, (name, rule))
    return dict(seen.values())


def _start(rule: BlurRule, apertures: FloatArray) -> dict[str, float]:
    start = dict.fromkeys(rule.parameters, 0.1)
    if start:
        start["sensitivity"] = 0.1
    if start and len(np.unique(apertures)) >= FEWEST_APERTURES:
        start["compression"] = 2.0
    return start


def _change(rule: BlurRule, conditions: Conditions, values: Values, largest: float) -> tuple[FloatArray, FloatArray]:
    """Return the change in the average person's answer due to blur, and its derivative by the person's deviation."""
    share, compression = conditions["aperture"] / largest, abs(values.get("compression", 0.0))
    size = np.arcsinh(compression * share) / math.asinh(compression) if compression > LINEAR else share
    signs = [0.0 if effect is None else effect[1] for effect in (rule.nearest, rule.farthest)]
    rises = [0.0 if effect is None else values[effect[0]] for effect in (rule.nearest, rule.farthest)]
    nearest = conditions["nearest"] > 0.5
    derivative = np.asarray(size * np.where(nearest, *signs))
    return derivative * np.where(nearest, *rises), derivative


@dataclass(frozen=True)
class BlurRatings:
    """Normally distributed ratings (or log ratings) under a rule; level and sensitivity are integrated in closed form.

    The conditions are `aperture` (mm) and `nearest`: 1 with the nearest object in focus, 0 with the farthest. The
    parameters are `level` (average person without blur), `people` (SD of the level over people), the changes of the
    rule, `sensitivity` (SD of the change over people), `noise` (SD of one answer) and `compression` (c).
    """

    rule: BlurRule
    largest: float
    start: Mapping[str, float]
    positive: frozenset[str] = SPREADS

    def log_likelihoods(self, answers: Answers, values: Values) -> dict[str, float]:
        """Return the log likelihood of each person's ratings: normal, with covariance due to level and sensitivity."""
        change, derivative = _change(self.rule, answers.conditions, values, self.largest)
        left = answers.answer - values["level"] - change
        names, who = np.unique(answers.participant, return_inverse=True)

        def total(array: FloatArray) -> FloatArray:
            return np.asarray(np.bincount(who, array, len(names)), float)

        count, variance = total(np.ones(len(who))), values["noise"] ** 2
        scales = np.array([values["people"], values.get("sensitivity", 0.0)])
        ones = np.ones_like(derivative)
        design = np.array([[total(a * b) for a in (ones, derivative)] for b in (ones, derivative)])
        inner = np.eye(2) + np.einsum("ijp,i,j->pij", design, scales, scales) / variance
        along = np.stack([total(left), total(left * derivative)], axis=1) * scales
        explained = np.einsum("pi,pi->p", along, np.linalg.solve(inner, along[..., None])[..., 0]) / variance
        log_likelihood = -(total(left**2) - explained) / variance / 2 - count * math.log(2 * math.pi * variance) / 2
        log_likelihood -= np.linalg.slogdet(inner)[1] / 2
        return dict(zip(names.tolist(), log_likelihood.tolist(), strict=True))


def blur_ratings(apertures: ArrayLike, nearest: ArrayLike, answers: ArrayLike) -> dict[str, BlurRatings]:
    """Return the rating observers of all rules that the trials can distinguish.

    Parameters
    ----------
    apertures
        Aperture diameter (mm) of each trial; 0 for the pinhole.
    nearest
        1 if the nearest object was in focus, 0 if the farthest was.
    answers
        Ratings or log ratings, from which start values are computed.

    Examples
    --------
    >>> observers = blur_ratings([0.0, 4.5, 8.9], [1, 1, 1], [0.0, 0.1, 0.3])
    >>> list(observers)
    ['blind to blur', 'any blur deepens']
    """
    aperture, rated = np.asarray(apertures, float), np.asarray(answers, float)
    spread = max(float(rated.std()), 1e-3)
    general = {"level": float(rated.mean()), "people": spread / 2, "noise": spread}
    largest = max(float(aperture.max()), 1e-9)
    return {
        name: BlurRatings(rule, largest, general | _start(rule, aperture))
        for name, rule in _rules(np.asarray(nearest, float)).items()
    }


def blur_choices(apertures: ArrayLike, nearest: ArrayLike) -> dict[str, Choices]:
    """Return the choice observers of all rules that the trials can distinguish.

    The answer is 1 if the picture is chosen over its reference. Parameters: `bias` (in standard deviations of the
    decision), the changes of the rule (d' at the largest aperture), and `sensitivity` and `compression` as in
    `BlurRatings`. The conditions and arguments are the same as well.
    """
    aperture = np.asarray(apertures, float)
    largest = max(float(aperture.max()), 1e-9)

    def of(rule: BlurRule) -> Choices:
        def probability(conditions: Conditions, values: Values, own: FloatArray) -> FloatArray:
            change, slope = _change(rule, conditions, values, largest)
            change = values["bias"] + change + values.get("sensitivity", 0.0) * slope * own
            return np.asarray(LAPSES / 2 + (1 - LAPSES) * ndtr(change / math.sqrt(2)))

        return Choices(probability, {"bias": 0.0} | _start(rule, aperture), SPREADS)

    return {name: of(rule) for name, rule in _rules(np.asarray(nearest, float)).items()}
