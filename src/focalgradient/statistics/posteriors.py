"""Prior and posterior distributions of the depth effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy import stats

from focalgradient.analyses import Analysis
from focalgradient.arrays import FloatArray
from focalgradient.statistics.records import NotComputed

__all__ = ["ORDINAL_PRIORS", "RATIO_PRIORS", "BayesResult", "Name", "Posterior", "Prior"]


@dataclass(frozen=True, slots=True)
class Prior:
    """Prior distribution of a parameter: normal with mean 0, or half-normal.

    Parameters
    ----------
    sd
        Standard deviation of the normal distribution.
    half
        True for a half-normal distribution (standard deviations).
    why
        Source of the value.
    """

    sd: float
    half: bool
    why: str

    def __str__(self) -> str:
        """Return the distribution in mathematical notation.

        >>> str(RATIO_PRIORS["rise"])
        'Normal(0, 0.5)'
        """
        return f"HalfNormal({self.sd:g})" if self.half else f"Normal(0, {self.sd:g})"

    def density(self, values: FloatArray) -> FloatArray:
        """Return the density at `values`."""
        law = stats.halfnorm(scale=self.sd) if self.half else stats.norm(scale=self.sd)
        return np.asarray(law.pdf(values))

    def draw(self, rng: np.random.Generator) -> float:
        """Draw one value."""
        value = float(rng.normal(0, self.sd))
        return abs(value) if self.half else value


RATIO_PRIORS: Final[Mapping[str, Prior]] = {
    "rise": Prior(0.5, False, "no effect most likely; 95 % between ratios of 0.38 and 2.7; the paper's axis ends at 3"),
    "subjects": Prior(0.3, True, "twice the 0.15 that a power analysis assumes"),
    "scenes": Prior(0.2, True, "scenes differ less than subjects: four times the 0.05 of a power analysis"),
    "residual": Prior(0.5, True, "0.42 for a log ratio of single answers with SD 0.3"),
}
"""Priors of log ratios: weakly informative (our choice)."""

ORDINAL_PRIORS: Final[Mapping[str, Prior]] = {
    "rise": Prior(1.5, False, "no effect most likely; 95 % between odds ratios of 0.05 and 19"),
    "fixation": Prior(1.5, False, "as the effect"),
    "subjects": Prior(1.0, True, "the SD of the logistic distribution itself is 1.8"),
    "scenes": Prior(1.0, True, "as the subjects"),
    "thresholds": Prior(3.0, False, "ordered; equal proportions of all steps most likely"),
}
"""Priors of the latent scale, in log odds: weakly informative (our choice)."""

Name = Literal["nearest", "farthest", "difference"]


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Posterior distribution of one depth effect.

    Parameters
    ----------
    name
        Object in focus, or "difference": effect with the nearest in focus minus effect with the farthest.
    median, low, high
        Median and central 95 % interval of the log ratio (or log odds ratio).
    above
        Probability of an effect above zero.
    within
        Probability that the effect lies within the bound on both sides.
    subjects, scenes
        Posterior medians of the standard deviations over subjects and over scenes; None for a single scene, and for the
        difference of ordinal effects, which is derived from the two effects.
    draws
        Draws of the effect from all chains.
    spread
        Draws of the standard deviations, by the name of their prior.
    r_hat, effective
        Largest R-hat, and smallest effective sample size (bulk and tail), over all parameters.
    divergences
        Number of divergent transitions.
    """

    name: Name
    median: float
    low: float
    high: float
    above: float
    within: float
    subjects: float | None
    scenes: float | None
    draws: FloatArray
    spread: Mapping[str, FloatArray]
    r_hat: float
    effective: float
    divergences: int

    @property
    def sound(self) -> bool:
        """True if R-hat < 1.01 and effective sample size >= 400 (Vehtari et al. 2021), without divergences."""
        return self.r_hat < 1.01 and self.effective >= 400 and self.divergences == 0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BayesResult:
    """Bayesian estimates of the depth effects at both fixations and of their difference.

    Parameters
    ----------
    analysis
        Analysis of the ratings: `focalgradient.scales.Ratios` or `OrdinalSteps`.
    bound
        Equivalence bound: ratio, or odds ratio, within which an effect counts as none.
    formula
        Model formula in the notation of bambi.
    priors
        Priors by parameter name.
    posteriors
        Posteriors by name: nearest, farthest, difference; `NotComputed` if not available.
    sampler
        Chains and draws in words.
    versions
        Versions of the packages.

    Examples
    --------
    >>> from focalgradient.analyses import Ratios
    >>> alone = {"nearest": NotComputed("one subject only")}
    >>> result = BayesResult(Ratios(), 1.2, "log_rating ~ amount", RATIO_PRIORS, alone, "4 chains", {})
    >>> result, result.summary()
    (<BayesResult: log_rating ~ amount>, 'nearest: one subject only')
    """

    analysis: Analysis
    bound: float
    formula: str
    priors: Mapping[str, Prior]
    posteriors: Mapping[Name, Posterior | NotComputed]
    sampler: str
    versions: Mapping[str, str]

    def __repr__(self) -> str:
        """Return a one-line description; `summary` gives the results."""
        return f"<BayesResult: {self.formula}>"

    def summary(self) -> str:
        """Return the log effects and their difference as text, one per line."""
        lines = []
        for name, one in self.posteriors.items():
            if isinstance(one, NotComputed):
                lines.append(f"{name}: {one.reason}")
                continue
            lines.append(
                f"{name}: {one.median:.3g}, 95 % {one.low:.3g} to {one.high:.3g}; above none with probability "
                f"{one.above:.3f}, within the bound with {one.within:.3f}{'' if one.sound else '; chains disagree'}"
            )
        return "\n".join(lines)
