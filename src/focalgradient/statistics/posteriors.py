"""Priors of the rises, and what Bayes' rule makes of them with the answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from focalgradient.scales import Analysis
from focalgradient.statistics.records import NotComputed

__all__ = ["ORDINAL_PRIORS", "RATIO_PRIORS", "BayesResult", "Name", "Posterior", "Prior"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Prior:
    """Prior distribution of a parameter: normal about 0, or the half of it above 0.

    Parameters
    ----------
    sd
        Standard deviation of the normal distribution.
    half
        Whether only values above 0 are possible: of standard deviations.
    why
        Where the number comes from.
    """

    sd: float
    half: bool
    why: str

    def __str__(self) -> str:
        """As papers write it.

        >>> str(RATIO_PRIORS["rise"])
        'Normal(0, 0.5)'
        """
        return f"HalfNormal({self.sd:g})" if self.half else f"Normal(0, {self.sd:g})"

    def density(self, values: FloatArray) -> FloatArray:
        """Density at `values`."""
        law = stats.halfnorm(scale=self.sd) if self.half else stats.norm(scale=self.sd)
        return np.asarray(law.pdf(values))

    def draw(self, rng: np.random.Generator) -> float:
        """One value."""
        value = float(rng.normal(0, self.sd))
        return abs(value) if self.half else value


RATIO_PRIORS: Final[Mapping[str, Prior]] = {
    "rise": Prior(0.5, False, "no rise most likely; 95 % between ratios of 0.38 and 2.7, the paper's axis ends at 3"),
    "subjects": Prior(0.3, True, "twice the 0.15 that a power analysis assumes"),
    "scenes": Prior(0.2, True, "scenes differ less than subjects: four times the 0.05 of a power analysis"),
    "residual": Prior(0.5, True, "of a log ratio of single answers that scatter by 0.3: 0.42"),
}
"""Of the logarithm of ratios: weakly informative, our choice."""

ORDINAL_PRIORS: Final[Mapping[str, Prior]] = {
    "rise": Prior(1.5, False, "no rise most likely; 95 % between odds ratios of 0.05 and 19"),
    "fixation": Prior(1.5, False, "as the rise"),
    "subjects": Prior(1.0, True, "the logistic distribution's own standard deviation is 1.8"),
    "scenes": Prior(1.0, True, "as the subjects"),
    "thresholds": Prior(3.0, False, "in order; even shares of all steps most likely"),
}
"""Of the latent scale in log odds: weakly informative, our choice."""

Name = Literal["nearest", "farthest", "difference"]


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Posterior distribution of one rise.

    Parameters
    ----------
    name
        The object in focus, or "difference": the rise with the nearest in focus less that with the farthest.
    median, low, high
        Of the logarithm (of the ratio, or of the odds ratio): median and central 95 %.
    above
        Probability of a rise above none.
    within
        Probability that it lies within the bound, on both sides.
    subjects, scenes
        Medians of the standard deviations over subjects and over scenes; None for scenes where there is one only, and
        for the difference of answers in steps, which comes from the two rises.
    draws
        Of the rise, from all chains.
    spread
        Draws of the standard deviations by the name of their prior.
    r_hat, effective
        Largest R-hat, and least effective number of draws (bulk and tails), over the model's parameters.
    divergences
        Transitions that diverged.
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
        """Whether the chains agree: R-hat below 1.01, 400 effective draws (Vehtari et al. 2021), no divergences."""
        return self.r_hat < 1.01 and self.effective >= 400 and self.divergences == 0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BayesResult:
    """The rises of both fixations and their difference, by Bayes' rule.

    Parameters
    ----------
    analysis
        That of the ratings: `focalgradient.scales.Ratios` or `OrdinalSteps`.
    bound
        Ratio, or odds ratio, within which a rise counts as none.
    formula
        Of the model, as bambi writes it.
    priors
        By the name of what they are of.
    posteriors
        Nearest, farthest, difference; what could not be computed is a `NotComputed`.
    sampler
        Chains and draws, in words.
    versions
        Of the software.

    Examples
    --------
    >>> from focalgradient.scales import Ratios
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
        """In short; `summary` has the results."""
        return f"<BayesResult: {self.formula}>"

    def summary(self) -> str:
        """The rises and their difference, in logarithms, a line each."""
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
