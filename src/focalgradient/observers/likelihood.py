"""Maximum-likelihood fitting of observer models to people's answers.

An observer predicts the distribution of each answer, given a few parameters and one random effect per person (standard
normal, integrated out). Observers that can only be simulated are wrapped by `simulated_choices` or `simulated_ratings`,
which estimate that distribution from repeated responses to the same trials.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.statistics.durations import lognormal_log_density
from focalgradient.statistics.hessian import covariance_at, polished

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

Values = Mapping[str, float]
Conditions = Mapping[str, FloatArray]

NODES = np.linspace(-5.0, 5.0, 25)
"""Integration nodes of a person's random effect, in standard deviations, equally spaced."""

ROUNDS = 4
"""Number of times the nodes are centred on each person's posterior, which is narrow with many answers."""

FIRST_STEP = 0.3
"""Size of the initial simplex, in free parameters, large enough to bridge the steps of simulated proportions."""

LARGEST_LOG = 30.0
"""Maximum absolute logarithm of a positive parameter, which keeps vanishing standard deviations above 0."""

GRADIENT = 1e-3
"""Maximum gradient of the log likelihood by a free parameter at convergence."""


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Answers of several people; arrays with one entry per trial.

    Parameters
    ----------
    participant
        Participant of each answer.
    conditions
        Stimulus conditions: one array for each name that the observer uses.
    answer
        Answers: 1 or 0 for `Choices`, log ratings for `Ratings`, seconds for `Durations`.
    count
        Number of identical answers that an entry represents; empty: 1.

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
        """Return a subset of the trials."""
        conditions = {name: array[chosen] for name, array in self.conditions.items()}
        return Answers(self.participant[chosen], conditions, self.answer[chosen], self.count[chosen])

    def tallied(self) -> Answers:
        """Combine identical trials and answers of a person into counts, which speeds up fits."""
        names, who = np.unique(self.participant, return_inverse=True)
        rows = np.column_stack([who, *self.conditions.values(), self.answer]).astype(float)
        rows, place = np.unique(rows, axis=0, return_inverse=True)
        conditions = dict(zip(self.conditions, rows.T[1:-1], strict=True))
        count = np.asarray(np.bincount(place.ravel(), self.count), float)
        return Answers(names[rows[:, 0].astype(int)], conditions, rows[:, -1], count)


class Parameters(Protocol):
    """Parameters of an observer."""

    @property
    def start(self) -> Values:
        """Initial value of each parameter."""

    @property
    def positive(self) -> frozenset[str]:
        """Names of the positive parameters."""


class AnswerModel(Parameters, Protocol):
    """Distribution of answers predicted by an observer.

    `start` gives the initial value of each parameter; those in `positive` are fitted on their logarithm. `log_density`
    returns the log likelihood of each answer (trials x effects) for standardised random effects of the person: one set
    for all trials, or an array of trials x effects.
    """

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Return the log likelihood of each answer for each random effect."""


@runtime_checkable
class PersonModel(Parameters, Protocol):
    """Distribution of all answers of a person, for observers whose random effects are integrated in closed form.

    `start` and `positive` are as in `AnswerModel`.
    """

    def log_likelihoods(self, answers: Answers, values: Values) -> dict[str, float]:
        """Return the log likelihood of each person's answers."""


@dataclass(frozen=True)
class Choices:
    """Binary answers (1 or 0); `probability(conditions, values, own)` returns the probability of 1.

    Its arguments are arrays of shape (trials, 1) and random effects of shape (1, effects). `smooth` is False if the
    probability changes in steps, as proportions of simulated answers do; a gradient search alone would then fail.
    """

    probability: Callable[[Conditions, Values, FloatArray], FloatArray]
    start: Values
    positive: frozenset[str] = frozenset()
    smooth: bool = True

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Return the log likelihood of each answer for each random effect."""
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        probability = np.clip(self.probability(columns, values, np.atleast_2d(own)), 1e-9, 1 - 1e-9)
        right = answers.answer[:, None] > 0.5
        return np.asarray(np.log(np.where(right, probability, 1 - probability)))


@dataclass(frozen=True)
class Ratings:
    """Normally distributed answers; `moments(conditions, values, own)` returns mean and standard deviation.

    `smooth` is as in `Choices`.
    """

    moments: Callable[[Conditions, Values, FloatArray], tuple[FloatArray, FloatArray]]
    start: Values
    positive: frozenset[str] = frozenset()
    smooth: bool = True

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Return the log likelihood of each answer for each random effect."""
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        mean, sd = self.moments(columns, values, np.atleast_2d(own))
        score = (answers.answer[:, None] - mean) / sd
        return np.asarray(-(score**2) / 2 - np.log(sd) - math.log(2 * math.pi) / 2)


@dataclass(frozen=True)
class Durations:
    """Log-normal durations (s); `law(conditions, values, own)` returns the log median and the SD of log duration.

    The condition `censored` is 1 if the percept was cut off by the end of the trial, else 0. Durations are independent
    given the person's random effect; `focalgradient.statistics.fit_dominance` also models serial correlation and
    person-specific spreads.
    """

    law: Callable[[Conditions, Values, FloatArray], tuple[FloatArray, FloatArray]]
    start: Values
    positive: frozenset[str] = frozenset()

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Return the log likelihood of each duration for each random effect.

        Raises
        ------
        InputError
            If a duration is not positive, or the answers lack the condition `censored`.
        """
        if "censored" not in answers.conditions:
            raise InputError("Durations need the condition censored: 1 where the end of the trial cut one off, else 0.")
        if (answers.answer <= 0).any():
            raise InputError("A duration is not positive; remove that row.")
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        log_median, spread = self.law(columns, values, np.atleast_2d(own))
        return lognormal_log_density(answers.answer[:, None], log_median, spread, columns["censored"] > 0.5)


Respond = Callable[[Conditions, Values, FloatArray, np.random.Generator], FloatArray]
"""Simulated answers to all trials, from conditions, values, random effects (trials x effects) and a generator."""


def _repeated(respond: Respond, conditions: Conditions, values: Values, own: FloatArray, draws: int) -> FloatArray:
    trials = len(next(iter(conditions.values())))
    effects = np.broadcast_to(own, (trials, own.shape[-1]))
    random = np.random.default_rng(0)  # common random numbers, so that likelihoods are comparable
    return np.array([respond(conditions, values, effects, random) for _ in range(draws)], float)


def simulated_choices(
    respond: Respond, start: Values, positive: frozenset[str] = frozenset(), draws: int = 1000
) -> Choices:
    """Wrap a simulated observer as `Choices`: proportions of `draws` answers, half an answer added to each side."""

    def probability(conditions: Conditions, values: Values, own: FloatArray) -> FloatArray:
        answers = _repeated(respond, conditions, values, own, draws)
        return np.asarray((answers.sum(axis=0) + 0.5) / (draws + 1))

    return Choices(probability, start, positive, smooth=False)


def simulated_ratings(
    respond: Respond, start: Values, positive: frozenset[str] = frozenset(), draws: int = 1000
) -> Ratings:
    """Wrap a simulated observer as `Ratings`: a synthetic likelihood (Wood 2010) from `draws` answers."""

    def moments(conditions: Conditions, values: Values, own: FloatArray) -> tuple[FloatArray, FloatArray]:
        answers = _repeated(respond, conditions, values, own, draws)
        return answers.mean(axis=0), np.maximum(answers.std(axis=0, ddof=1), 1e-6)

    return Ratings(moments, start, positive, smooth=False)


@dataclass(frozen=True, slots=True)
class ObserverFit:
    """Maximum-likelihood fit of an observer.

    Parameters
    ----------
    values
        All parameters, including fixed ones.
    standard_errors
        Standard errors of the fitted parameters from the observed information; by the delta method for positive ones.
        Empty if the information is singular.
    log_likelihood
        Maximum of the marginal log likelihood.
    of_people
        Contribution of each person to the log likelihood.
    parameters, answers
        Number of fitted parameters, and of answers.
    """

    values: dict[str, float]
    standard_errors: dict[str, float]
    log_likelihood: float
    of_people: dict[str, float]
    parameters: int
    answers: int

    @property
    def aic(self) -> float:
        """Akaike information criterion: 2 parameters - 2 log likelihood."""
        return 2 * self.parameters - 2 * self.log_likelihood

    @property
    def bic(self) -> float:
        """Bayesian information criterion: parameters x log of the number of answers - 2 log likelihood."""
        return self.parameters * math.log(self.answers) - 2 * self.log_likelihood


def log_likelihood_by_person(answers: Answers, observer: AnswerModel | PersonModel, values: Values) -> dict[str, float]:
    """Return the marginal log likelihood of each person's answers."""
    if isinstance(observer, PersonModel):
        return observer.log_likelihoods(answers, values)
    names, who = np.unique(answers.participant, return_inverse=True)
    centre, width = np.zeros((len(names), 1)), np.ones((len(names), 1))
    for _ in range(ROUNDS):
        deviation = centre + width * NODES
        joint = -(deviation**2) / 2 - math.log(2 * math.pi) / 2
        np.add.at(joint, who, answers.count[:, None] * observer.log_density(answers, values, deviation[who]))
        step = width * (NODES[1] - NODES[0])
        log_likelihood = special.logsumexp(joint, axis=1) + np.log(step[:, 0])
        weight = np.exp(joint - joint.max(axis=1, keepdims=True))
        weight /= weight.sum(axis=1, keepdims=True)
        centre = (weight * deviation).sum(axis=1, keepdims=True)
        width = np.maximum(np.sqrt((weight * (deviation - centre) ** 2).sum(axis=1, keepdims=True)), step / 2)
    return dict(zip(names.tolist(), log_likelihood.tolist(), strict=True))


def fit_observer(
    answers: Answers, observer: AnswerModel | PersonModel, parameters: Sequence[str] | None = None
) -> ObserverFit:
    """Fit the parameters of an observer to people's answers by maximum likelihood.

    Parameters
    ----------
    answers
        Answers of one or several people.
    observer
        `Choices`, `Ratings`, `Durations`, or another `AnswerModel` or `PersonModel`.
    parameters
        Names of the parameters to fit; None: all. The others keep their initial value.

    Raises
    ------
    InputError
        If the observer has no parameter with a given name.

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
    covariance = covariance_at(likelihood.cost, free)
    errors = [] if covariance is None else np.sqrt(np.diag(covariance)).tolist()
    scaled = {
        name: error * (values[name] if name in observer.positive else 1.0)
        for name, error in zip(names, errors, strict=False)
    }
    return ObserverFit(values, scaled, sum(people.values()), people, len(names), int(answers.count.sum()))


def values_near(answers: Answers, observer: AnswerModel | PersonModel, near: Values) -> dict[str, float]:
    """Refit an observer by gradient search from `near`, the fit to similar answers."""
    likelihood = _Likelihood(answers, observer, tuple(observer.start))
    by_simplex = not getattr(observer, "smooth", True)
    return likelihood.values(likelihood.searched(near, by_simplex=by_simplex))


class _Likelihood:
    """Likelihood as a function of an observer's free parameters; positive ones enter by their logarithm."""

    def __init__(self, answers: Answers, observer: AnswerModel | PersonModel, names: tuple[str, ...]):
        self.answers = answers if isinstance(observer, PersonModel) else answers.tallied()
        self.observer, self.names = observer, names

    def values(self, free: FloatArray) -> dict[str, float]:
        """Return all parameters; fixed ones keep their initial value."""
        fitted = {
            name: math.exp(min(max(value, -LARGEST_LOG), LARGEST_LOG)) if name in self.observer.positive else value
            for name, value in zip(self.names, free.tolist(), strict=True)
        }
        return {**self.observer.start, **fitted}

    def cost(self, free: FloatArray) -> float:
        """Return the negative log likelihood."""
        return -sum(log_likelihood_by_person(self.answers, self.observer, self.values(free)).values())

    def searched(self, start: Values, *, by_simplex: bool) -> FloatArray:
        """Return the free parameters with maximum likelihood, by gradient search, optionally after a simplex search."""
        positive = self.observer.positive
        free = np.array([math.log(start[name]) if name in positive else start[name] for name in self.names])
        if not self.names:
            return free
        if by_simplex:
            simplex = np.vstack([free, free + FIRST_STEP * np.eye(len(free))])
            options: Any = {"initial_simplex": simplex, "maxiter": 2000, "xatol": 1e-3, "fatol": 1e-3}

            def height(at: FloatArray) -> float:
                return round(self.cost(at), 9)  # steps of equal height stay equal

            free = np.asarray(optimize.minimize(height, free, method="Nelder-Mead", options=options).x)
        free = np.asarray(optimize.minimize(self.cost, free, method="BFGS", options={"gtol": GRADIENT}).x)
        end = polished(self.cost, free) if getattr(self.observer, "smooth", True) else None
        return free if end is None else end
