"""Thresholds of adaptive two-alternative experiments: psychometric functions of each participant, fitted by psignifit.

psignifit (Schütt, Harmeling, Macke & Wichmann 2016, Vision Res. 122:105) computes the posterior of threshold, slope and
lapse rate on a grid. The function is a Weibull function of the level that starts at one half.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_installed, checked
from focalgradient.quantities import Range
from focalgradient.statistics.means import t_interval
from focalgradient.statistics.records import Interval, NotComputed

__all__ = [
    "ATTENDING",
    "LateLevels",
    "SubjectThreshold",
    "ThresholdFit",
    "ThresholdResult",
    "blur_thresholds",
    "fit_threshold",
    "late_levels",
    "log_thresholds",
    "too_few",
]

NEEDED = ("fitting thresholds", "thresholds", "psignifit")
"""Purpose, extra and module for `check_installed`."""

SLOPES = 0.5
"""Standard deviation of the log Weibull slope in its prior, if a median is stated: two thirds of slopes lie within a
factor of 1.65.
"""

SLOPE_RANGE = (1.0, 10.0)
"""Range of slopes. The default prior is log-uniform: with a median of 3.5, that of QUEST (Watson & Pelli 1983), the
threshold of 60 adaptive trials was biased by +11 % for a true slope of 2.
"""

LAPSE = 0.015
"""Mean of the beta(1, b) prior of the lapse rate, within the 0 to 5 % of trained people (Wichmann & Hill 2001). QUEST+
rarely shows levels that everybody detects, so that 60 answers do not determine the lapse rate: its posterior equals the
prior, and the threshold is biased by -1.5 % for each 1 % by which the prior mean exceeds the true rate (simulated:
-4.7, -3.5 and -2.2 % for lapse rates of 0, 1 and 2 % with a mean of 5 %; -2.2, -0.8 and +0.7 % with 1.5 %).
"""

LAPSE_QUANTILE = 0.999
"""Quantile of the prior of the lapse rate at which its grid ends: 10 % for a mean of 1.5 %."""

LARGEST_LAPSE = 0.1
"""Maximum mean of the prior of the lapse rate; beyond it the grid would extend to rates at which all answers are
lapses.
"""

WIDTH = math.log10(math.log(0.05) / math.log(0.95))
"""Width of a Weibull function with slope 1, from 5 to 95 %, in decades."""

NO_OVERDISPERSION = 1e-4
"""Overdispersion, in effect none: single trials carry no information on it."""

GRID = {"threshold": 100, "width": 25, "lambda": 8}
"""Number of grid points per parameter of the posterior."""

MIN_TRIALS = 20
"""Minimum number of trials of a fit: with fewer, the interval would be that of the prior."""

ATTENDING = 0.8
"""Minimum proportion of correct catch trials (at the largest level): five of six. A participant who guesses passes 1 in
9 times.
"""


@dataclass(frozen=True, slots=True)
class ThresholdFit:
    """Fitted psychometric function.

    Parameters
    ----------
    threshold, low, high
        Level detected in half of the trials that are not guessed (75 % correct with two alternatives, without lapses):
        posterior median of its logarithm and 95 % interval, in the unit of the levels.
    slope
        Weibull slope, posterior median.
    lapse
        Lapse rate, posterior mean.
    levels, right, shown
        Levels, with the number of correct answers and of trials at each.
    guess
        Guess rate.
    """

    threshold: float
    low: float
    high: float
    slope: float
    lapse: float
    levels: tuple[float, ...]
    right: tuple[int, ...]
    shown: tuple[int, ...]
    guess: float = 0.5

    @property
    def trials(self) -> int:
        """Number of trials."""
        return sum(self.shown)

    @property
    def correct_at_threshold(self) -> float:
        """Probability of a correct answer at the threshold, without lapses."""
        return self.guess + (1 - self.guess) / 2

    def correct(self, level: ArrayLike) -> FloatArray:
        """Return the probability of a correct answer at levels.

        >>> fit = ThresholdFit(0.2, 0.1, 0.3, 3.5, 0.0, (0.2,), (8,), (10,))
        >>> fit.correct([0.01, 0.2, 2.0]).round(3).tolist()
        [0.5, 0.75, 1.0]
        """
        detected = 1 - 0.5 ** ((np.asarray(level, float) / self.threshold) ** self.slope)
        return np.asarray(self.guess + (1 - self.guess - self.lapse) * detected, float)


@dataclass(frozen=True, slots=True)
class LateLevels:
    """Threshold without a fitted function: where a procedure kept the level.

    Parameters
    ----------
    threshold
        Geometric mean of the levels in the second half of the trials.
    trials
        Number of trials.
    """

    threshold: float
    trials: int


@dataclass(frozen=True, slots=True)
class SubjectThreshold:
    """Threshold of one participant in one session.

    Parameters
    ----------
    participant, session
        Participant and session; "" where each participant has one.
    catch_right, catch_trials
        Number of correct catch trials, and of catch trials (at the largest level).
    kept
        True if the proportion correct is at least `ATTENDING`. Failure may indicate inattention, or a threshold near or
        above the largest level; therefore nobody is excluded from the mean, and a second mean is computed without
        failures.
    fit
        Fitted function, or a threshold without one, or the reason why there is none.
    known
        True threshold of a simulated observer.
    """

    participant: str
    session: str
    catch_right: int
    catch_trials: int
    kept: bool
    fit: ThresholdFit | LateLevels | NotComputed
    known: float | None = None

    @property
    def name(self) -> str:
        """Participant, and session if labelled: "01, session 2"."""
        return ", session ".join(filter(None, [self.participant, self.session]))

    @property
    def interval(self) -> Interval | NotComputed:
        """Threshold with its interval, or the reason why there is none."""
        if isinstance(self.fit, NotComputed):
            return self.fit
        return Interval(self.fit.threshold, *(getattr(self.fit, end, None) for end in ("low", "high")))


@dataclass(frozen=True, slots=True, repr=False)
class ThresholdResult:
    """Thresholds of all participants.

    Parameters
    ----------
    unit
        Unit of the levels: "D" or "mm".
    subjects
        Threshold of each participant and session.
    """

    unit: str
    subjects: tuple[SubjectThreshold, ...]

    @property
    def mean(self) -> Interval | NotComputed:
        """Geometric mean over all, with a 95 % interval by Student's t on the logarithms."""
        return _mean(self.subjects)

    @property
    def mean_attending(self) -> Interval | NotComputed:
        """The same mean over participants who passed the catch trials."""
        return _mean([session for session in self.subjects if session.kept])

    def __repr__(self) -> str:
        """Return a one-line description; `summary` gives the results."""
        return f"<ThresholdResult: {len(self.subjects)} sessions, in {self.unit}>"

    def summary(self) -> str:
        """Return the mean, then the threshold of each session as text, one per line.

        >>> fit = ThresholdFit(0.2, 0.1, 0.3, 3.5, 0.0, (0.2,), (8,), (10,))
        >>> one = SubjectThreshold("01", "", 5, 6, True, fit)
        >>> print(ThresholdResult("D", (one,)).summary())  # doctest: +ELLIPSIS
        geometric mean: 0.2 D...
        01: 0.2 D, 95 % interval 0.1 to 0.3
        """
        lines = [f"geometric mean: {self._told(self.mean)}"]
        for one in self.subjects:
            missed = isinstance(one.interval, Interval) and not one.kept
            lines.append(f"{one.name}: {self._told(one.interval)}{'; catch trials were missed' * missed}")
        return "\n".join(lines)

    def _told(self, found: Interval | NotComputed) -> str:
        return found.reason if isinstance(found, NotComputed) else found.summary(f" {self.unit}")


@checked
def fit_threshold(
    levels: ArrayLike,
    right: ArrayLike,
    *,
    least: float,
    most: float,
    lapse: Annotated[float, Range("mean rates", 0, LARGEST_LAPSE)] = LAPSE,
    slope: Annotated[float, Range("exponents", *SLOPE_RANGE)] | None = None,
    guess: float = 0.5,
) -> ThresholdFit:
    """Fit a psychometric function for two alternatives, or for another guess rate.

    Parameters
    ----------
    levels
        Level of each trial, above 0.
    right
        True for each correct answer.
    least, most
        Range of the threshold, within which its prior is log-uniform: that of the design.
    lapse
        Mean of the prior of the lapse rate, from 0 (no lapses) to 0.1. Sixty adaptive trials do not determine the rate:
        the threshold is biased by -1.5 % for each 1 % by which this mean exceeds the true rate.
    slope
        Median of the prior of the Weibull slope, from 1 to 10 (SD of its logarithm 0.5); None: log-uniform from 1 to
        10. It also biases the threshold of sixty adaptive trials if the true slope differs: see `docs/thresholds.md`.
    guess
        Guess rate, from 0 to below 1: 1 / m for m alternatives.

    Raises
    ------
    InputError
        If psignifit is not installed, levels and answers differ in length, or an option is out of range.

    Examples
    --------
    >>> levels = np.repeat([0.05, 0.1, 0.2, 0.4], 20)
    >>> right = np.concatenate([np.arange(20) < count for count in (10, 12, 15, 20)])
    >>> fit = fit_threshold(levels, right, least=0.02, most=2.0)
    >>> bool(fit.low < 0.18 < fit.threshold < 0.21 < fit.high)
    True
    """
    check_installed(*NEEDED)
    import psignifit
    from scipy.stats import beta

    level, answered = np.asarray(levels, float), np.asarray(right, bool)
    if level.ndim != 1 or level.shape != answered.shape or not level.size:
        raise InputError(f"levels has shape {level.shape} and right {answered.shape}, but both must be one list.")
    if not ((level > 0).all() and 0 < least < most):
        raise InputError("levels, least and most must be above 0, and most above least.")
    if not 0 <= guess < 1:
        raise InputError(f"guess is {guess}, but must be a rate from 0 to below 1.")
    there, place = np.unique(level, return_inverse=True)
    shown = np.bincount(place)
    hits = np.bincount(place, weights=answered).astype(int)

    def width_prior(width: ArrayLike) -> FloatArray:
        wide = np.maximum(np.asarray(width, float), 1e-6)  # psignifit may evaluate widths outside the bounds
        about = 0.0 if slope is None else np.log(WIDTH / wide / slope) / SLOPES
        return np.asarray(np.exp(-0.5 * about**2) / wide)

    fixed = {"eta": NO_OVERDISPERSION, "gamma": guess}
    bounds = {"width": (WIDTH / SLOPE_RANGE[1], WIDTH / SLOPE_RANGE[0])}
    priors: dict[str, Any] = {"width": width_prior}
    if lapse:
        rates = beta(1, 1 / lapse - 1)
        bounds["lambda"] = (0.0, min(float(rates.ppf(LAPSE_QUANTILE)), 0.5))
        priors["lambda"] = lambda rate: rates.pdf(np.asarray(rate, float))
    else:
        fixed["lambda"] = 0.0
    ends = (math.log10(least), math.log10(most))
    with np.errstate(all="ignore"), warnings.catch_warnings():
        # psignifit warns of guess rates above .2 in "yes/no" experiments; here the rate is that of the alternatives.
        warnings.filterwarnings("ignore", "You have fixed the guess rate", UserWarning)
        found = psignifit.psignifit(
            np.column_stack([np.log10(there), hits, shown]),
            experiment_type="yes/no",  # the type with a fixed guess rate
            sigmoid="gumbel",  # Weibull function on a logarithmic scale
            stimulus_range=ends,
            bounds={"threshold": ends, **bounds},
            priors=priors,
            fixed_parameters=fixed,
            grid_steps=GRID,
            verbose=False,
        )
    low, high = (10.0**end for end in found.confidence_intervals["threshold"]["0.95"])
    means = found.parameter_estimate_mean
    return ThresholdFit(
        threshold=10.0 ** _median(found.parameter_values["threshold"], found.marginal_posterior_values["threshold"]),
        low=float(low),
        high=float(high),
        slope=WIDTH / _median(found.parameter_values["width"], found.marginal_posterior_values["width"]),
        lapse=float(means["lambda"]),
        levels=tuple(there.tolist()),
        right=tuple(hits.tolist()),
        shown=tuple(shown.tolist()),
        guess=guess,
    )


def _median(values: Any, density: Any) -> float:
    """Return the median of a posterior on a grid."""
    share = np.cumsum(np.asarray(density, float))
    return float(np.interp(0.5, (share - np.asarray(density, float) / 2) / share[-1], np.asarray(values, float)))


def blur_thresholds(
    table: pd.DataFrame,
    *,
    least: float,
    most: float,
    unit: str = "D",
    known: Mapping[str, float] | None = None,
    lapse: float = LAPSE,
    slope: float | None = None,
    guess: float = 0.5,
) -> ThresholdResult:
    """Fit the threshold of each participant, and average them.

    Parameters
    ----------
    table
        One row per trial, with participant_id, session, level, correct and catch, as in
        `focalgradient.dataset.DataSet.blur_threshold`.
    least, most, unit
        Range and unit of the levels of the design.
    known
        True thresholds of simulated observers, by participant.
    lapse, slope, guess
        Prior mean of the lapse rate, prior median of the slope, and guess rate, as in `fit_threshold`.

    Raises
    ------
    InputError
        If psignifit is not installed, or an option is out of range.
    """
    check_installed(*NEEDED)
    subjects = []
    several = (table.groupby("participant_id")["session"].nunique() > 1).any()
    table = table if several else table.assign(session="")
    for (participant, session), rows in table.groupby(["participant_id", "session"], sort=True):
        catch = rows["catch"].to_numpy(bool)
        right = rows["correct"].to_numpy(bool)
        caught, catches = int(right[catch].sum()), int(catch.sum())
        counted = int((~catch).sum())
        fit: ThresholdFit | NotComputed = too_few(counted)
        if counted >= MIN_TRIALS:
            level = rows["level"].to_numpy(float)[~catch]
            fit = fit_threshold(level, right[~catch], least=least, most=most, lapse=lapse, slope=slope, guess=guess)
        kept = not catches or caught >= ATTENDING * catches
        name = str(participant)
        subjects.append(SubjectThreshold(name, str(session), caught, catches, kept, fit, (known or {}).get(name)))
    return ThresholdResult(unit, tuple(subjects))


def too_few(trials: int) -> NotComputed:
    """Return the reason why so few trials have no threshold."""
    there = "is" if trials == 1 else "are"
    return NotComputed(f"A threshold needs {MIN_TRIALS} trials or more, and there {there} {trials}.")


def late_levels(levels: ArrayLike) -> LateLevels | NotComputed:
    """Return the geometric mean of the levels in the second half of the trials, which are in the order shown.

    >>> late_levels([8.0] * 10 + [1.0, 4.0] * 5).threshold
    2.0
    """
    shown = np.asarray(levels, float)
    if len(shown) < MIN_TRIALS:
        return too_few(len(shown))
    return LateLevels(math.exp(float(np.log(shown[len(shown) // 2 :]).mean())), len(shown))


def _mean(subjects: Sequence[SubjectThreshold]) -> Interval | NotComputed:
    """Return the geometric mean over participants."""
    logs = [*log_thresholds(subjects).values()]
    return t_interval(logs).ratio if logs else NotComputed("No participant has a threshold.")


def log_thresholds(subjects: Sequence[SubjectThreshold]) -> dict[str, float]:
    """Return the log threshold of each participant, averaged over sessions."""
    by_participant: dict[str, list[float]] = {}
    for one in subjects:
        if not isinstance(one.fit, NotComputed):
            by_participant.setdefault(one.participant, []).append(math.log(one.fit.threshold))
    return {name: float(np.mean(values)) for name, values in by_participant.items()}
