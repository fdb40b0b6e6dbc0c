"""Compare observers by how well they predict people who were held out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

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

FloatArray = NDArray[np.float64]

DIRICHLET_SAMPLES = 200_000
"""Samples from which exceedance probabilities are counted: standard error at most 0.001."""


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
    answers: Answers,
    observers: Mapping[str, AnswerModel | PersonModel],
    seed: int = 0,
    progress: Progress | None = None,
) -> tuple[ObserverComparison, ...]:
    """Fit each observer and predict each person from the others; best held-out log likelihood first.

    Parameters
    ----------
    answers
        Of 3 people at least.
    observers
        By name.
    seed
        Of the samples for exceedance probabilities.
    progress
        Called with the share of fits that is done.

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
    evidence = np.array([[one.held_out[person] for one in compared] for person in people])
    exceedance = exceedance_probabilities(evidence, seed)
    rated = [replace(one, exceedance=float(p)) for one, p in zip(compared, exceedance, strict=True)]
    return tuple(sorted(rated, key=lambda one: -one.held_out_total))


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
