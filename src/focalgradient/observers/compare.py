"""Comparison of observer models by leave-one-person-out cross-validation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.observers.likelihood import (
    AnswerModel,
    Answers,
    ObserverFit,
    PersonModel,
    fit_observer,
    log_likelihood_by_person,
    values_near,
)
from focalgradient.progress import Progress

__all__ = ["ObserverComparison", "compare_observers", "exceedance_probabilities"]


DIRICHLET_SAMPLES = 200_000
"""Number of Dirichlet samples for the exceedance probabilities: their standard error is at most 0.001."""


@dataclass(frozen=True, slots=True)
class ObserverComparison:
    """Result of one observer in the comparison.

    Parameters
    ----------
    name
        Name of the observer.
    fit
        Fit to all people.
    held_out
        Log likelihood of each person under the fit to all others.
    exceedance
        Probability that this observer is the most frequent one (random-effects model selection, Stephan et al. 2009,
        with the held-out log likelihood as each person's evidence).
    """

    name: str
    fit: ObserverFit
    held_out: dict[str, float]
    exceedance: float = math.nan

    @property
    def held_out_total(self) -> float:
        """Sum of the held-out log likelihood over people."""
        return sum(self.held_out.values())


def compare_observers(
    answers: Answers,
    observers: Mapping[str, AnswerModel | PersonModel],
    seed: int = 0,
    progress: Progress | None = None,
) -> tuple[ObserverComparison, ...]:
    """Fit and cross-validate observers; return them by held-out log likelihood, highest first.

    Parameters
    ----------
    answers
        Answers of at least 3 people.
    observers
        Observers by name.
    seed
        Random seed of the samples for exceedance probabilities.
    progress
        Function called with the completed fraction of the fits.

    Raises
    ------
    InputError
        With fewer than 3 people.
    """
    people = np.unique(answers.participant)
    if len(people) < 3:
        raise InputError(f"Observers are compared by people held out, which needs 3, and there are {len(people)}.")
    compared = []
    for number, (name, observer) in enumerate(observers.items()):
        fit = fit_observer(answers, observer)
        held_out: dict[str, float] = {}
        for count, person in enumerate(people):
            if progress is not None:
                progress((number + count / len(people)) / len(observers), f"observer {name!r}")
            own = answers.participant == person
            values = values_near(answers.of(~own), observer, fit.values)
            held_out |= log_likelihood_by_person(answers.of(own), observer, values)
        compared.append(ObserverComparison(name, fit, held_out))
    evidence = np.array([[model.held_out[person] for model in compared] for person in people])
    exceedance = exceedance_probabilities(evidence, seed)
    rated = [replace(model, exceedance=float(p)) for model, p in zip(compared, exceedance, strict=True)]
    return tuple(sorted(rated, key=lambda model: -model.held_out_total))


def exceedance_probabilities(log_evidence: FloatArray, seed: int = 0) -> FloatArray:
    """Return the probability that each observer is the most frequent one (Stephan et al. 2009, NeuroImage 46).

    Parameters
    ----------
    log_evidence
        Log evidence, people x observers.
    seed
        Random seed of the samples from the Dirichlet posterior.

    Examples
    --------
    Nine of ten people are described better by the first observer.

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
