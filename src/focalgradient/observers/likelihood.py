"""Fit observers to people's answers by likelihood, and compare observers by how well they predict people held out.

An observer predicts the distribution of each answer, given a few parameters and one number of the person's own (a
standard normal effect, integrated out). Observers that can only be simulated are wrapped by `simulated_choices` or
`simulated_ratings`, which estimate that distribution from repeated answers to the same trials.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from focalgradient.errors import InputError

__all__ = [
    "AnswerModel",
    "Answers",
    "Choices",
    "Durations",
    "ObserverComparison",
    "ObserverFit",
    "Ratings",
    "compare_observers",
    "exceedance_probabilities",
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

DIRICHLET_SAMPLES = 200_000
"""Samples from which exceedance probabilities are counted: standard error at most 0.001."""

FIRST_STEP = 0.3
"""Size of the first simplex of the search, in free parameters: it crosses the steps of simulated shares."""

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


@dataclass(frozen=True)
class Choices:
    """Answers 1 (right) or 0, with the probability of 1 that `probability(conditions, values, own)` returns.

    That takes arrays of shape (trials, 1) and own effects of shape (1, effects).
    """

    probability: Callable[[Conditions, Values, FloatArray], FloatArray]
    start: Values
    positive: frozenset[str] = frozenset()

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        """Log likelihood of each answer for each own effect."""
        columns = {name: array[:, None] for name, array in answers.conditions.items()}
        probability = np.clip(self.probability(columns, values, np.atleast_2d(own)), 1e-9, 1 - 1e-9)
        right = answers.answer[:, None] > 0.5
        return np.asarray(np.log(np.where(right, probability, 1 - probability)))


@dataclass(frozen=True)
class Ratings:
    """Normally distributed answers whose mean and standard deviation `moments(conditions, values, own)` returns."""

    moments: Callable[[Conditions, Values, FloatArray], tuple[FloatArray, FloatArray]]
    start: Values
    positive: frozenset[str] = frozenset()

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
        whole = -(score**2) / 2 - np.log(spread) - math.log(2 * math.pi) / 2 - logs
        return np.asarray(np.where(columns["censored"] > 0.5, special.log_ndtr(-score), whole))


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

    return Choices(probability, start, positive)


def simulated_ratings(
    respond: Respond, start: Values, positive: frozenset[str] = frozenset(), draws: int = 1000
) -> Ratings:
    """Ratings of an observer that can only be simulated: a synthetic likelihood (Wood 2010) from `draws` answers."""

    def moments(conditions: Conditions, values: Values, own: FloatArray) -> tuple[FloatArray, FloatArray]:
        answers = _repeated(respond, conditions, values, own, draws)
        return answers.mean(axis=0), np.maximum(answers.std(axis=0, ddof=1), 1e-6)

    return Ratings(moments, start, positive)


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


def log_likelihood_by_person(answers: Answers, observer: AnswerModel, values: Values) -> dict[str, float]:
    """Log likelihood of each person's answers, their own effect integrated over the standard normal distribution."""
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


def fit_observer(answers: Answers, observer: AnswerModel, parameters: Sequence[str] | None = None) -> ObserverFit:
    """Fit an observer's parameters to people's answers by maximum likelihood.

    Parameters
    ----------
    answers
        Of one person or several.
    observer
        `Choices`, `Ratings`, `Durations`, or another `AnswerModel`.
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

    answers = answers.tallied()

    def of(free: FloatArray) -> dict[str, float]:
        found = {
            name: math.exp(min(value, 30.0)) if name in observer.positive else value
            for name, value in zip(names, free.tolist(), strict=True)
        }
        return {**observer.start, **found}

    def cost(free: FloatArray) -> float:
        return -sum(log_likelihood_by_person(answers, observer, of(free)).values())

    first = [observer.start[name] for name in names]
    free = np.array([math.log(x) if name in observer.positive else x for name, x in zip(names, first, strict=True)])
    if names:
        simplex = np.vstack([free, free + FIRST_STEP * np.eye(len(free))])
        options: Any = {"initial_simplex": simplex, "maxiter": 2000, "xatol": 1e-3, "fatol": 1e-3}
        free = np.asarray(optimize.minimize(cost, free, method="Nelder-Mead", options=options).x)
        free = np.asarray(optimize.minimize(cost, free, method="BFGS").x)
    people = log_likelihood_by_person(answers, observer, of(free))
    errors = _standard_errors(cost, free)
    values = of(free)
    scaled = {
        name: error * (values[name] if name in observer.positive else 1.0)
        for name, error in zip(names, errors, strict=False)
    }
    return ObserverFit(values, scaled, sum(people.values()), people, len(names), int(answers.count.sum()))


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


@dataclass(frozen=True, slots=True)
class ObserverComparison:
    """One observer among those compared.

    Parameters
    ----------
    name
        Whose.
    fit
        To all people.
    held_out
        Log likelihood of each person by the fit to all the others.
    exceedance
        Probability that this observer is the one of most people (random-effects model selection, Stephan et al. 2009,
        with the held-out log likelihood as each person's evidence).
    """

    name: str
    fit: ObserverFit
    held_out: dict[str, float]
    exceedance: float = math.nan

    @property
    def held_out_total(self) -> float:
        """Sum over people."""
        return sum(self.held_out.values())


def compare_observers(
    answers: Answers, observers: Mapping[str, AnswerModel], seed: int = 0
) -> tuple[ObserverComparison, ...]:
    """Fit each observer and predict each person from the others; best held-out log likelihood first.

    Raises
    ------
    InputError
        With fewer than 3 people.
    """
    people = np.unique(answers.participant)
    if len(people) < 3:
        raise InputError(f"Observers are compared by people held out, which needs 3, and there are {len(people)}.")
    compared = []
    for name, observer in observers.items():
        fit = fit_observer(answers, observer)
        started = _Started(observer, fit.values)
        held_out: dict[str, float] = {}
        for person in people:
            own = answers.participant == person
            found = fit_observer(answers.of(~own), started)
            held_out |= log_likelihood_by_person(answers.of(own), observer, found.values)
        compared.append(ObserverComparison(name, fit, held_out))
    evidence = np.array([[one.held_out[person] for one in compared] for person in people])
    exceedance = exceedance_probabilities(evidence, seed)
    rated = [replace(one, exceedance=float(p)) for one, p in zip(compared, exceedance, strict=True)]
    return tuple(sorted(rated, key=lambda one: -one.held_out_total))


@dataclass(frozen=True)
class _Started:
    """An observer with other first values."""

    observer: AnswerModel
    start: Values

    @property
    def positive(self) -> frozenset[str]:
        return self.observer.positive

    def log_density(self, answers: Answers, values: Values, own: FloatArray) -> FloatArray:
        return self.observer.log_density(answers, values, own)


def exceedance_probabilities(log_evidence: FloatArray, seed: int = 0) -> FloatArray:
    """Probability of each observer to be the most frequent one among people (Stephan et al. 2009, NeuroImage 46).

    Parameters
    ----------
    log_evidence
        People x observers.
    seed
        Of the samples from the Dirichlet posterior.

    Examples
    --------
    Nine people of ten are better described by the first.

    >>> evidence = np.zeros((10, 2))
    >>> evidence[:9, 0], evidence[9, 1] = 5.0, 5.0
    >>> exceedance_probabilities(evidence).round(2).tolist()
    [0.99, 0.01]
    """
    log_evidence = np.asarray(log_evidence, float)
    prior = np.ones(log_evidence.shape[1])
    counts = prior.copy()
    for _ in range(1000):
        share = log_evidence + special.digamma(counts)
        share = np.exp(share - special.logsumexp(share, axis=1, keepdims=True))
        new = prior + share.sum(axis=0)
        if np.abs(new - counts).max() < 1e-8:
            break
        counts = new
    samples = np.random.default_rng(seed).dirichlet(counts, DIRICHLET_SAMPLES)
    return np.bincount(samples.argmax(axis=1), minlength=len(prior)) / DIRICHLET_SAMPLES
