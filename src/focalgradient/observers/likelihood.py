"""Fit observers to people's answers by likelihood.

An observer predicts the distribution of each answer, given a few parameters and one number of the person's own (a
standard normal effect, integrated out). Observers that can only be simulated are wrapped by `simulated_choices` or
`simulated_ratings`, which estimate that distribution from repeated answers to the same trials.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from focalgradient.errors import InputError

__all__ = [
    "AnswerModel",
    "Answers",
    "Choices",
    "Durations",
    "ObserverFit",
    "PersonModel",
    "Ratings",
    "fit_observer",
    "simulated_choices",
    "simulated_ratings",
]

FloatArray = NDArray[np.float64]
Values = Mapping[str, float]
Conditions = Mapping[str, FloatArray]

NODES = np.linspace(-5.0, 5.0, 25)
"""Even steps of the integral over a person's own effect, in standard deviations."""

ROUNDS = 4
"""Rounds in which the steps are moved to each person's posterior: many answers leave little doubt about the effect."""

FIRST_STEP = 0.3
"""Size of the first simplex of the search, in free parameters: it crosses the steps of simulated shares."""

LARGEST_LOG = 30.0
"""Largest absolute value of the logarithm of a positive parameter: a spread that vanishes stays above 0."""

GRADIENT = 1e-3
"""Largest derivative of the log likelihood by a free parameter at the end of a search."""

STEP = 1e-3
"""Step of the numerical second derivatives, in units of the free parameters."""


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Answers of several people; arrays of one entry a trial.

    Parameters
    ----------
    participant
        Who answered.
    conditions
        What was shown: an array for each name that the observer uses.
    answer
        The answers: for `Choices` 1 or 0, for `Ratings` the logarithm of the rating, for `Durations` seconds.
    count
        How many identical answers each entry stands for; empty: 1.

    Raises
    ------
    InputError
        If lengths differ or an answer is not a finite number.
    """

    participant: NDArray[Any]
    conditions: Conditions
    answer: FloatArray
    count: FloatArray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        count = np.asarray(self.count, float)
        object.__setattr__(self, "count", count if count.size else np.ones(len(self.participant)))
        object.__setattr__(self, "participant", np.asarray(self.participant).astype(str))
        object.__setattr__(self, "answer", np.asarray(self.answer, float))
        object.__setattr__(self, "conditions", {name: np.asarray(of) for name, of in self.conditions.items()})
        arrays = {"participant": self.participant, "answer": self.answer, **self.conditions}
        for name, array in arrays.items():
            if array.shape != (len(self.answer),):
                raise InputError(f"{name} has the shape {array.shape}, but must have one entry for each answer.")
        if not np.isfinite(self.answer).all():
            raise InputError("An answer is not a finite number: leave out trials without an answer.")

    def of(self, chosen: NDArray[np.bool_]) -> Answers:
        """Some of the trials."""
        conditions = {name: array[chosen] for name, array in self.conditions.items()}
        return Answers(self.participant[chosen], conditions, self.answer[chosen], self.count[chosen])

    def tallied(self) -> Answers:
        """The same with identical trials and answers of a person counted together, which makes fits fast."""
        names, who = np.unique(self.participant, return_inverse=True)
        rows = np.column_stack([who, *self.conditions.values(), self.answer]).astype(float)
        rows, place = np.unique(rows, axis=0, return_inverse=True)
        conditions = dict(zip(self.conditions, rows.T[1:-1], strict=True))
        count = np.asarray(np.bincount(place.ravel(), self.count), float)
        return Answers(names[rows[:, 0].astype(int)], conditions, rows[:, -1], count)


class AnswerModel(Protocol):
    """The distribution of answers that an observer predicts.

    `start` gives each parameter's first value; those in `positive` are searched on their logarithm. `log_density`
    returns the log likelihood of each answer, trials x effects, for own effects (standard normal numbers of the
    person): one set for all trials, or an array of trials x effects.
    """

    @property
    def start(self) -> Values:
        """Each parameter's first value."""

    @property
    def positive(self) -> frozenset[str]:
        """Names of those that must be positive."""

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Log likelihood of each answer for each own effect."""


@runtime_checkable
class PersonModel(Protocol):
    """The distribution of all answers of a person, for observers who integrate people's own effects in closed form.

    `start` and `positive` are as in `AnswerModel`.
    """

    @property
    def start(self) -> Values:
        """Each parameter's first value."""

    @property
    def positive(self) -> frozenset[str]:
        """Names of those that must be positive."""

    def log_likelihoods(self, answers: Answers, values: Values) -> dict[str, float]:
        """Log likelihood of each person's answers."""


@dataclass(frozen=True)
class Choices:
    """Answers 1 (right) or 0, with the probability of 1 that `probability(conditions, values, own)` returns.

    That takes arrays of shape (trials, 1) and own effects of shape (1, effects). `smooth` is False where the
    probability changes in steps, as shares of simulated answers do: a gradient alone would not find the maximum.
    """

    probability: Callable[[Conditions, Values, FloatArray], FloatArray]
    start: Values
    positive: frozenset[str] = frozenset()
    smooth: bool = True

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Log likelihood of each answer for each own effect."""
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        probability = np.clip(self.probability(columns, values, np.atleast_2d(own)), 1e-9, 1 - 1e-9)
        right = answers.answer[:, None] > 0.5
        return np.asarray(np.log(np.where(right, probability, 1 - probability)))


@dataclass(frozen=True)
class Ratings:
    """Normally distributed answers whose mean and standard deviation `moments(conditions, values, own)` returns.

    `smooth` is as in `Choices`.
    """

    moments: Callable[[Conditions, Values, FloatArray], tuple[FloatArray, FloatArray]]
    start: Values
    positive: frozenset[str] = frozenset()
    smooth: bool = True

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Log likelihood of each answer for each own effect."""
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        mean, sd = self.moments(columns, values, np.atleast_2d(own))
        score = (answers.answer[:, None] - mean) / sd
        return np.asarray(-(score**2) / 2 - np.log(sd) - math.log(2 * math.pi) / 2)


@dataclass(frozen=True)
class Durations:
    """Log-normal durations (s), whose log median and spread of log duration `law(conditions, values, own)` returns.

    The condition `censored` is 1 where the end of the trial cut the percept off, else 0. Durations are independent
    given the person's own effect; the correlation with the percept before and people's own spreads are in
    `focalgradient.statistics.fit_dominance`.
    """

    law: Callable[[Conditions, Values, FloatArray], tuple[FloatArray, FloatArray]]
    start: Values
    positive: frozenset[str] = frozenset()

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Log likelihood of each duration for each own effect.

        Raises
        ------
        InputError
            If a duration is not positive, or the answers lack the condition `censored`.
        """
        if "censored" not in answers.conditions:
            raise InputError("Durations need the condition censored: 1 where the end of the trial cut one off, else 0.")
        if (answers.answer <= 0).any():
            raise InputError("A duration is not a positive number of seconds: leave out what has none.")
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        log_median, spread = self.law(columns, values, np.atleast_2d(own))
        logs = np.log(answers.answer)[:, None]
        score = (logs - log_median) / spread
        density = np.asarray(-(score**2) / 2 - np.log(spread) - math.log(2 * math.pi) / 2 - logs)
        cut = answers.conditions["censored"] > 0.5
        density[cut] = special.log_ndtr(-score[cut])
        return density


Respond = Callable[[Conditions, Values, FloatArray, np.random.Generator], FloatArray]
"""Answers to all trials once: takes conditions, values, own effects (trials x effects) and a source of chance."""


def _repeated(respond: Respond, conditions: Conditions, values: Values, own: FloatArray, draws: int) -> FloatArray:
    trials = len(next(iter(conditions.values())))
    effects = np.broadcast_to(own, (trials, own.shape[-1]))
    random = np.random.default_rng(0)  # the same chance for all values, so that the likelihood is comparable
    return np.array([respond(conditions, values, effects, random) for _ in range(draws)], float)


def simulated_choices(
    respond: Respond, start: Values, positive: frozenset[str] = frozenset(), draws: int = 1000
) -> Choices:
    """Choices of an observer that can only be simulated: shares of `draws` answers, half of one added to each side."""

    def probability(conditions: Conditions, values: Values, own: FloatArray) -> FloatArray:
        answers = _repeated(respond, conditions, values, own, draws)
        return np.asarray((answers.sum(axis=0) + 0.5) / (draws + 1))

    return Choices(probability, start, positive, smooth=False)


def simulated_ratings(
    respond: Respond, start: Values, positive: frozenset[str] = frozenset(), draws: int = 1000
) -> Ratings:
    """Ratings of an observer that can only be simulated: a synthetic likelihood (Wood 2010) from `draws` answers."""

    def moments(conditions: Conditions, values: Values, own: FloatArray) -> tuple[FloatArray, FloatArray]:
        answers = _repeated(respond, conditions, values, own, draws)
        return answers.mean(axis=0), np.maximum(answers.std(axis=0, ddof=1), 1e-6)

    return Ratings(moments, start, positive, smooth=False)


@dataclass(frozen=True, slots=True)
class ObserverFit:
    """An observer fitted by maximum likelihood.

    Parameters
    ----------
    values
        All parameters, the fixed ones too.
    standard_errors
        Of the fitted ones, by the observed information; of a positive one by the delta method. Empty where it is
        singular.
    log_likelihood
        At the maximum, people's own effects integrated out.
    of_people
        Its share of each person.
    parameters, answers
        How many were fitted, and to how many answers.
    """

    values: dict[str, float]
    standard_errors: dict[str, float]
    log_likelihood: float
    of_people: dict[str, float]
    parameters: int
    answers: int

    @property
    def aic(self) -> float:
        """Akaike's criterion: 2 parameters - 2 log likelihood."""
        return 2 * self.parameters - 2 * self.log_likelihood

    @property
    def bic(self) -> float:
        """Schwarz's criterion: parameters x log of the number of answers - 2 log likelihood."""
        return self.parameters * math.log(self.answers) - 2 * self.log_likelihood


def log_likelihood_by_person(answers: Answers, observer: AnswerModel | PersonModel, values: Values) -> dict[str, float]:
    """Log likelihood of each person's answers, their own effects integrated over their distribution."""
    if isinstance(observer, PersonModel):
        return observer.log_likelihoods(answers, values)
    names, who = np.unique(answers.participant, return_inverse=True)
    centre, width = np.zeros((len(names), 1)), np.ones((len(names), 1))
    for _ in range(ROUNDS):
        own = centre + width * NODES
        joint = -(own**2) / 2 - math.log(2 * math.pi) / 2
        np.add.at(joint, who, answers.count[:, None] * observer.log_density(answers, values, own[who]))
        step = width * (NODES[1] - NODES[0])
        found = special.logsumexp(joint, axis=1) + np.log(step[:, 0])
        weight = np.exp(joint - joint.max(axis=1, keepdims=True))
        weight /= weight.sum(axis=1, keepdims=True)
        centre = (weight * own).sum(axis=1, keepdims=True)
        width = np.maximum(np.sqrt((weight * (own - centre) ** 2).sum(axis=1, keepdims=True)), step / 2)
    return dict(zip(names.tolist(), found.tolist(), strict=True))


def fit_observer(
    answers: Answers, observer: AnswerModel | PersonModel, parameters: Sequence[str] | None = None
) -> ObserverFit:
    """Fit an observer's parameters to people's answers by maximum likelihood.

    Parameters
    ----------
    answers
        Of one person or several.
    observer
        `Choices`, `Ratings`, `Durations`, or another `AnswerModel` or `PersonModel`.
    parameters
        Names of those to fit; None: all. The others keep their first value.

    Raises
    ------
    InputError
        If the observer has no parameter of a name.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> level = np.repeat([0.5, 1.0, 2.0], 200)
    >>> def probability(conditions, values, own):
    ...     return special.ndtr(values["sensitivity"] * conditions["level"]) + 0 * own
    >>> answers = Answers(np.zeros(600), {"level": level}, rng.random(600) < special.ndtr(0.8 * level))
    >>> fit = fit_observer(answers, Choices(probability, {"sensitivity": 1.0}, frozenset({"sensitivity"})))
    >>> bool(abs(fit.values["sensitivity"] - 0.8) < 2 * fit.standard_errors["sensitivity"])
    True
    """
    names = tuple(observer.start) if parameters is None else tuple(parameters)
    for name in names:
        if name not in observer.start:
            raise InputError(f"The observer has no parameter {name!r}; it has {', '.join(observer.start)}.")

    likelihood = _Likelihood(answers, observer, names)
    free = likelihood.searched(observer.start, by_simplex=True)
    values = likelihood.values(free)
    people = log_likelihood_by_person(likelihood.answers, observer, values)
    errors = _standard_errors(likelihood.cost, free)
    scaled = {
        name: error * (values[name] if name in observer.positive else 1.0)
        for name, error in zip(names, errors, strict=False)
    }
    return ObserverFit(values, scaled, sum(people.values()), people, len(names), int(answers.count.sum()))


def values_near(answers: Answers, observer: AnswerModel | PersonModel, near: Values) -> dict[str, float]:
    """Values of largest likelihood for answers that differ little from those whose values `near` are."""
    likelihood = _Likelihood(answers, observer, tuple(observer.start))
    by_simplex = not getattr(observer, "smooth", True)
    return likelihood.values(likelihood.searched(near, by_simplex=by_simplex))


class _Likelihood:
    """The likelihood of answers by an observer's free parameters: logarithms of those that must be positive."""

    def __init__(self, answers: Answers, observer: AnswerModel | PersonModel, names: tuple[str, ...]):
        self.answers = answers if isinstance(observer, PersonModel) else answers.tallied()
        self.observer, self.names = observer, names

    def values(self, free: FloatArray) -> dict[str, float]:
        """Return all parameters; the fixed ones keep their first value."""
        found = {
            name: math.exp(min(max(value, -LARGEST_LOG), LARGEST_LOG)) if name in self.observer.positive else value
            for name, value in zip(self.names, free.tolist(), strict=True)
        }
        return {**self.observer.start, **found}

    def cost(self, free: FloatArray) -> float:
        """Return minus the log likelihood."""
        return -sum(log_likelihood_by_person(self.answers, self.observer, self.values(free)).values())

    def searched(self, start: Values, *, by_simplex: bool) -> FloatArray:
        """Return the free parameters of largest likelihood, by a gradient, and before that by a simplex."""
        positive = self.observer.positive
        free = np.array([math.log(start[name]) if name in positive else start[name] for name in self.names])
        if not self.names:
            return free
        if by_simplex:
            simplex = np.vstack([free, free + FIRST_STEP * np.eye(len(free))])
            options: Any = {"initial_simplex": simplex, "maxiter": 2000, "xatol": 1e-3, "fatol": 1e-3}
            free = np.asarray(optimize.minimize(self.cost, free, method="Nelder-Mead", options=options).x)
        return np.asarray(optimize.minimize(self.cost, free, method="BFGS", options={"gtol": GRADIENT}).x)


def _standard_errors(cost: Callable[[FloatArray], float], at: FloatArray) -> list[float]:
    n, steps = len(at), STEP * np.eye(len(at))
    second = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            corners = ((1, 1), (1, -1), (-1, 1), (-1, -1))
            found = sum(a * b * cost(at + a * steps[i] + b * steps[j]) for a, b in corners) / (4 * STEP**2)
            second[i, j] = second[j, i] = found
    if n == 0 or not np.isfinite(second).all() or np.linalg.eigvalsh(second)[0] <= 0:
        return []
    return [*np.sqrt(np.diag(np.linalg.inv(second))).tolist()]
