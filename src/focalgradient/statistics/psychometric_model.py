"""Hierarchical psychometric function, fitted by restricted maximum likelihood with Laplace's approximation.

P(correct) = guess + (1 - guess - lapse) F(exp(w) (x - t)). Threshold t, log slope w and the log odds of lapse and guess
rate each consist of a mean (fixed effects b, one per condition) and a normal deviation of the person (standard
deviation times v, v standard normal). Fixed effects and deviations are integrated out together around their joint mode,
as in REML for normal data (Laplace's approximation; Tierney & Kadane 1986), and the standard deviations maximise the
result. The fixed effects maximise the integral over the deviations alone: at the joint mode the slopes would be too
steep, as each person's threshold is fitted to the same answers (Neyman & Scott 1948).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special, stats

from focalgradient.statistics.hessian import polished
from focalgradient.statistics.psychometric_shapes import Shape

__all__ = ["Counts", "Layout", "ModelFit", "fit_model"]

FloatArray = NDArray[np.float64]

PARAMETERS = 4
"""Number of parameters: threshold, log slope, log odds of lapse rate and of guess rate, in this order."""

PLACES = {
    "threshold": 0,
    "threshold by condition": 0,
    "log slope": 1,
    "log odds of lapse": 2,
    "log odds of guess": 3,
}
"""Index of the parameter to which each standard deviation over people belongs."""

LAPSE_PRIOR = (1.0, 20.0)
"""Parameters of the beta prior of an estimated lapse or guess rate: mean 5 %, the upper end for trained people in
Wichmann & Hill (2001).
"""

SLOPE_PRIOR = (math.log(2), 1.0)
"""Mean and SD of the normal prior of the log slope, with standardised levels: two thirds of all functions rise from 27
to 73 % of their range within 0.4 to 2.7 level SDs (logistic). The prior bounds the slope of separated answers.
"""

LEAST_PROBABILITY = 1e-9
"""Minimum probability of an answer, which keeps logarithms finite if neither guesses nor lapses are possible."""

LEAST_SD, LARGEST_SD = 1e-3, 5.0
"""Limits of the standard deviations over people, of standardised levels, log slopes and log odds."""

LEAST_CORRELATION, LARGEST_CORRELATION = 1e-4, 0.9
"""Limits of the correlation between answers of one block (overdispersion)."""

RATE_SD_PRIOR = 0.5
"""Scale of the half-normal penalty on the SD over people of the log odds of lapse (and guess) rates, which few lapses
hardly constrain: 95 % of people then lie within a factor of 7.
"""

NEWTON_STEPS = 100
"""Maximum number of Newton steps to the joint mode; 4 to 10 are usual."""

NEWTON_END = 1e-9
"""Newton decrement (in log probability) at which the search for the joint mode ends."""


@dataclass(frozen=True, slots=True, eq=False)
class Counts:
    """Answer counts, one entry per person, condition and level (and block).

    Parameters
    ----------
    x
        Standardised level, or its logarithm.
    right, shown
        Number of correct answers, and number of trials.
    person, condition
        Indices from 0; sorted by person.
    """

    x: FloatArray
    right: FloatArray
    shown: FloatArray
    person: NDArray[np.int_]
    condition: NDArray[np.int_]


@dataclass(frozen=True, slots=True)
class Layout:
    """Layout of the parameters: which are estimated, and which vary over people.

    Parameters
    ----------
    conditions
        Number of conditions.
    within
        True if people took part in several conditions, so that their thresholds also vary by condition.
    people
        True if there are several people.
    guess, lapse
        Fixed rate; None if estimated.
    own_guess, own_lapse
        True if an estimated rate varies over people.
    overdispersed
        True if answers of one block may be correlated (beta-binomial).
    """

    conditions: int
    within: bool
    people: bool
    guess: float | None
    lapse: float | None
    own_guess: bool
    own_lapse: bool
    overdispersed: bool

    @property
    def fixed(self) -> int:
        """Number of fixed effects: thresholds and log slopes by condition, then estimated lapse and guess rates."""
        return 2 * self.conditions + (self.lapse is None) + (self.guess is None)

    @property
    def sds(self) -> tuple[str, ...]:
        """Names of the standard deviations over people."""
        if not self.people:
            return ()
        wanted = {
            "threshold": True,
            "threshold by condition": self.within,
            "log slope": True,
            "log odds of lapse": self.lapse is None and self.own_lapse,
            "log odds of guess": self.guess is None and self.own_guess,
        }
        return tuple(name for name, there in wanted.items() if there)

    def columns(self, condition: NDArray[np.int_]) -> tuple[FloatArray, FloatArray, NDArray[np.int_]]:
        """Return design matrices of fixed effects and deviations (size x 4 x columns), and SD indices of the latter."""
        size, c = len(condition), self.conditions
        place = np.arange(size)
        fixed = np.zeros((size, PARAMETERS, self.fixed))
        fixed[place, 0, condition] = 1
        fixed[place, 1, c + condition] = 1
        if self.lapse is None:
            fixed[:, 2, 2 * c] = 1
        if self.guess is None:
            fixed[:, 3, -1] = 1
        random, which = [np.zeros((size, PARAMETERS, 0))], []
        for number, name in enumerate(self.sds):
            own = condition[:, None] == np.arange(c) if name == "threshold by condition" else np.ones((size, 1))
            columns = np.zeros((size, PARAMETERS, own.shape[1]))
            columns[:, PLACES[name]] = own
            random.append(columns)
            which += [number] * own.shape[1]
        return fixed, np.concatenate(random, axis=2), np.array(which, dtype=int)


@dataclass(frozen=True, slots=True, eq=False)
class ModelFit:
    """Fitted hierarchical model.

    Parameters
    ----------
    fixed, covariance
        Fixed effects as in `Layout.fixed`, and their covariance.
    sds, sd_errors
        Standard deviations over people as in `Layout.sds`, and standard errors of their logarithms (NaN at a limit).
    deviations
        Deviations of each person (people x columns of `Layout.columns`).
    person_covariance
        Joint covariance of fixed effects and deviations, for each person (people x both x both).
    correlation, correlation_error
        Correlation between answers of one block (None if not estimated), and standard error of its log odds.
    log_likelihood
        Maximum of the restricted log likelihood.
    """

    fixed: FloatArray
    covariance: FloatArray
    sds: FloatArray
    sd_errors: FloatArray
    deviations: FloatArray
    person_covariance: FloatArray
    correlation: float | None
    correlation_error: float
    log_likelihood: float


def fit_model(
    counts: Counts, layout: Layout, shape: Shape, watch: Callable[[int], None] = lambda step: None
) -> ModelFit | None:
    """Fit the model by restricted maximum likelihood; return None without a maximum."""
    model = _Model(counts, layout, shape)
    sds = len(layout.sds)
    start = np.zeros(sds)
    low, high = [math.log(LEAST_SD)] * sds, [math.log(LARGEST_SD)] * sds
    if layout.overdispersed:
        start = np.append(start, special.logit(0.05))
        low.append(float(special.logit(LEAST_CORRELATION)))
        high.append(float(special.logit(LARGEST_CORRELATION)))
    tried = [0]

    def cost(free: FloatArray) -> float:
        tried[0] += 1
        watch(tried[0])
        return -model.integrated(free)

    free, best = start, math.inf
    bounds = list(zip(low, high, strict=True))
    for spread in STARTS if len(start) else ():
        at = np.concatenate([np.log(np.full(sds, spread)), start[sds:]])
        for _ in range(2):  # repeated from the joint mode of the first result
            model.anchor_at(at)
            found = optimize.minimize(cost, at, method="L-BFGS-B", bounds=bounds, options={"eps": 1e-3, "ftol": 1e-8})
            at = np.asarray(found.x, float)
            if found.fun < best:
                free, best = at, float(found.fun)
    model.anchor_at(free)
    end = polished(cost, free, low=low, high=high) if len(free) else None
    free = free if end is None else end
    best = cost(free)
    if not math.isfinite(best) or best >= IMPOSSIBLE:
        return None
    errors = _outer_errors(cost, free, np.array(low), np.array(high))
    model.integrated(free)
    covariance, together = model.covariances()
    model.move_to_marginal_mode(np.exp(free[:sds])[model.which], free)
    units = np.concatenate([np.ones(layout.fixed), np.exp(free[:sds])[model.which]])
    return ModelFit(
        model.b.copy(),
        covariance,
        np.exp(free[:sds]),
        errors[:sds],
        model.v * units[layout.fixed :],
        together * units * units[:, None],
        float(special.expit(free[-1])) if layout.overdispersed else None,
        float(errors[-1]) if layout.overdispersed else math.nan,
        -best,
    )


IMPOSSIBLE = 1e10
"""Cost if the joint mode does not exist."""

STARTS = (0.3, 1.0)
"""Start values of the standard deviations: the joint density can have two modes (for functions that rise between two
levels), each with its own maximum of the integral."""

MARGINAL_REACH = 2.0
"""Maximum distance of the fixed effects from the joint mode, in standard errors."""

OUTER_STEP = 0.05
"""Step of the second differences, in log standard deviations."""


def _outer_errors(cost: Callable[[FloatArray], float], at: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the standard errors of the log standard deviations; NaN at a limit."""
    errors = np.full(len(at), math.nan)
    inner = np.flatnonzero((at > low + 2 * OUTER_STEP) & (at < high - 2 * OUTER_STEP))
    if not inner.size:
        return errors
    steps = np.eye(len(at))[inner] * OUTER_STEP
    here = cost(at)
    up, down = [cost(at + step) for step in steps], [cost(at - step) for step in steps]
    second = np.diag([one + other - 2 * here for one, other in zip(up, down, strict=True)])
    for j in range(len(inner)):
        for k in range(j):
            both = cost(at + steps[j] + steps[k]) + cost(at - steps[j] - steps[k])
            second[j, k] = second[k, j] = (both - up[j] - down[j] - up[k] - down[k] + 2 * here) / 2
    second /= OUTER_STEP**2
    with np.errstate(invalid="ignore"):
        found = np.diag(np.linalg.pinv(second, hermitian=True))
        errors[inner] = np.where(found > 0, np.sqrt(np.maximum(found, 0)), math.nan)
    return errors


class _Model:
    """Joint density of answers, fixed effects and deviations, and its Laplace integral over both."""

    def __init__(self, counts: Counts, layout: Layout, shape: Shape):
        self.counts, self.layout, self.shape = counts, layout, shape
        key = counts.person * layout.conditions + counts.condition
        groups, self.entries, self.group = np.unique(key, return_index=True, return_inverse=True)
        self.owner = groups // layout.conditions  # person of each group (one person in one condition)
        self.columns, self.random, self.which = layout.columns(groups % layout.conditions)
        self.people = int(counts.person.max()) + 1
        self.first = np.searchsorted(self.owner, np.arange(self.people))
        self.b = self._start()
        self.v = np.zeros((self.people, len(self.which)))
        self.anchor = self.b, self.v
        self._curvature: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def _start(self) -> FloatArray:
        """Return start thresholds at 75 % correct above guessing, by linear regression over all answers."""
        c = self.counts
        guess = 0.0 if self.layout.guess is None else self.layout.guess
        b = np.zeros(self.layout.fixed)
        for condition in range(self.layout.conditions):
            own = c.condition == condition
            levels = np.unique(c.x[own])
            share = np.array([c.right[own & (c.x == x)].sum() / c.shown[own & (c.x == x)].sum() for x in levels])
            weight = np.array([c.shown[own & (c.x == x)].sum() for x in levels])
            rising = optimize.isotonic_regression(share, weights=weight).x
            middle = guess + (1 - guess) / 2
            b[condition] = levels[min(int(np.searchsorted(rising, middle)), len(levels) - 1)]
        b[self.layout.conditions : 2 * self.layout.conditions] = math.log(1.5)
        b[2 * self.layout.conditions :] = special.logit(0.03)
        return b

    def _eta(self, b: FloatArray, v: FloatArray, sd: FloatArray) -> FloatArray:
        own = self.columns @ b + (self.random @ (v * sd)[self.owner][:, :, None])[:, :, 0]
        return np.asarray(own[self.group])

    def _answers(self, p: FloatArray, free: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return log probability, gradient by p, negative second derivative and its expectation for each entry."""
        k, n = self.counts.right, self.counts.shown
        if not self.layout.overdispersed:
            value = k * np.log(p) + (n - k) * np.log1p(-p)
            curve = k / p**2 + (n - k) / (1 - p) ** 2
            return value, k / p - (n - k) / (1 - p), curve, n / (p * (1 - p))
        rho = special.expit(free[-1])
        m = (1 - rho) / rho
        a, b = m * p, m * (1 - p)
        value = special.betaln(k + a, n - k + b) - special.betaln(a, b)
        slope = m * (special.psi(k + a) - special.psi(a) - special.psi(n - k + b) + special.psi(b))
        tri = special.polygamma
        curve = -(m**2) * (tri(1, k + a) - tri(1, a) + tri(1, n - k + b) - tri(1, b))
        return value, slope, curve, n / (p * (1 - p) * (1 + (n - 1) * rho))

    def _height(self, b: FloatArray, v: FloatArray, sd: FloatArray, free: FloatArray) -> float:
        p = self._probability(self._eta(b, v, sd))[0]
        return float(self._answers(p, free)[0].sum() - (v**2).sum() / 2 + self._prior(b)[0])

    def _prior(self, b: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """Return the log prior of the log odds of the rates, and its first and negative second derivatives."""
        value, first, second = 0.0, np.zeros(len(b)), np.zeros(len(b))
        own = np.arange(2 * self.layout.conditions, len(b))
        one, other = LAPSE_PRIOR
        rate = special.expit(b[own])
        value = float((one * special.log_expit(b[own]) + other * special.log_expit(-b[own])).sum())
        first[own] = one - (one + other) * rate
        second[own] = (one + other) * rate * (1 - rate)
        steep = np.arange(self.layout.conditions, 2 * self.layout.conditions)
        away = (b[steep] - SLOPE_PRIOR[0]) / SLOPE_PRIOR[1]
        value -= float((away**2).sum()) / 2
        first[steep], second[steep] = -away / SLOPE_PRIOR[1], 1 / SLOPE_PRIOR[1] ** 2
        return value, first, second

    def _probability(self, eta: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the probability of a correct answer, with first and second derivatives by the four parameters."""
        lapse = special.expit(eta[:, 2]) if self.layout.lapse is None else np.full(len(eta), self.layout.lapse)
        guess = special.expit(eta[:, 3]) if self.layout.guess is None else np.full(len(eta), self.layout.guess)
        slope = np.exp(np.clip(eta[:, 1], -20, 20))
        z = np.clip(slope * (self.counts.x - eta[:, 0]), -60, 60)
        f, f1, f2 = self.shape.values(z)
        span = 1 - guess - lapse
        p = np.clip(guess + span * f, LEAST_PROBABILITY, 1 - LEAST_PROBABILITY)
        first = np.empty((len(p), PARAMETERS))
        dl, dg = lapse * (1 - lapse), guess * (1 - guess)
        first[:, 0], first[:, 1] = -span * f1 * slope, span * f1 * z
        first[:, 2], first[:, 3] = -dl * f, dg * (1 - f)
        second = np.zeros((len(p), PARAMETERS, PARAMETERS))
        second[:, 0, 0] = span * f2 * slope**2
        second[:, 0, 1] = second[:, 1, 0] = -span * slope * (f2 * z + f1)
        second[:, 1, 1] = span * (f2 * z**2 + f1 * z)
        second[:, 2, 2], second[:, 3, 3] = -dl * (1 - 2 * lapse) * f, dg * (1 - 2 * guess) * (1 - f)
        for rate, by in ((2, dl), (3, dg)):
            second[:, rate, 0] = second[:, 0, rate] = by * f1 * slope
            second[:, rate, 1] = second[:, 1, rate] = -by * f1 * z
        return p, first, second

    def _derivatives(
        self, sd: FloatArray, free: FloatArray, exact: bool
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return gradients by b and v, and negative second derivatives by b, by b and v, and by v, for each person.

        With `exact` False, return their expectation instead (Fisher information), which is always positive definite.
        """
        p, first, second = self._probability(self._eta(self.b, self.v, sd))
        _, slope, curve, expected = self._answers(p, free)
        inner = (curve if exact else expected)[:, None, None] * first[:, :, None] * first[:, None, :]
        if exact:
            inner = inner - slope[:, None, None] * second
        inner = np.add.reduceat(inner, self.entries)
        outer = np.add.reduceat(slope[:, None] * first, self.entries)[:, None, :]
        columns = np.concatenate([self.columns, self.random * sd], axis=2)
        gradient = np.add.reduceat((outer @ columns)[:, 0], self.first)
        curved = np.add.reduceat(columns.transpose(0, 2, 1) @ inner @ columns, self.first)
        size = self.layout.fixed
        _, prior_slope, prior_curve = self._prior(self.b)
        return (
            gradient[:, :size].sum(axis=0) + prior_slope,
            gradient[:, size:] - self.v,
            curved[:, :size, :size].sum(axis=0) + np.diag(prior_curve),
            curved[:, :size, size:],
            curved[:, size:, size:] + np.eye(len(self.which)),
        )

    def anchor_at(self, free: FloatArray) -> None:
        """Start all later searches from the mode at `free`."""
        self.anchor = self._start(), np.zeros_like(self.v)
        if self.integrated(free) > -IMPOSSIBLE:
            self.anchor = self.b, self.v

    def integrated(self, free: FloatArray) -> float:
        """Return the log of the integral over fixed effects and deviations, including penalties on the SDs of rates.

        `free` contains the log standard deviations and, if estimated, the log odds of the correlation.
        """
        sds = np.exp(free[: len(self.layout.sds)])
        sd = sds[self.which] if len(self.which) else np.zeros(0)
        self.b, self.v = self.anchor  # always the same start, so that the value depends on `free` only
        if not self._find_mode(sd, free):
            return -IMPOSSIBLE
        _, _, bb, bv, vv = self._derivatives(sd, free, exact=False)
        own = np.linalg.slogdet(vv)[1]
        schur = bb - (bv @ np.linalg.solve(vv, bv.transpose(0, 2, 1))).sum(axis=0)
        self._curvature = (schur, bv, vv)
        penalty = sum(
            float(stats.halfnorm.logpdf(value, scale=RATE_SD_PRIOR)) + math.log(value)
            for name, value in zip(self.layout.sds, sds, strict=True)
            if "odds" in name
        )
        height = self._height(self.b, self.v, sd, free)
        size = self.layout.fixed
        return height - float(own.sum() + np.linalg.slogdet(schur)[1] - size * math.log(2 * math.pi)) / 2 + penalty

    def _find_mode(self, sd: FloatArray, free: FloatArray, *, people_only: bool = False) -> bool:
        """Find the mode by damped Newton steps from the previous one; `people_only` keeps the fixed effects."""
        best = self._height(self.b, self.v, sd, free)
        for _ in range(NEWTON_STEPS):
            for exact in (True, False):
                by_b, by_v, bb, bv, vv = self._derivatives(sd, free, exact)
                solved = np.linalg.solve(vv, np.concatenate([bv.transpose(0, 2, 1), by_v[:, :, None]], axis=2))
                taken = (bv @ solved).sum(axis=0)
                schur, right = bb - taken[:, :-1], by_b - taken[:, -1]
                flat = not people_only and np.linalg.eigvalsh(schur)[0] <= 1e-10
                if flat or (len(self.which) and np.linalg.eigvalsh(vv).min() <= 0):
                    continue
                step_b = np.zeros(len(right)) if people_only else np.linalg.solve(schur, right)
                step_v = solved[:, :, -1] - solved[:, :, :-1] @ step_b
                gain = float(by_b @ step_b + (by_v * step_v).sum())
                if gain > -1e-12:
                    break
            else:
                return False
            if gain < NEWTON_END:
                self.b, self.v = self.b + step_b, self.v + step_v
                return True
            scale = min(1.0, 2.0 / max(1e-12, float(np.abs(step_b).max()), float(np.abs(step_v).max(initial=0.0))))
            for _ in range(30):
                b, v = self.b + scale * step_b, self.v + scale * step_v
                height = self._height(b, v, sd, free)
                if height > best:
                    break
                scale /= 2
            else:
                return gain < 1e-5
            self.b, self.v, best = b, v, height
        return False

    def move_to_marginal_mode(self, sd: FloatArray, free: FloatArray) -> None:
        """Move fixed effects to the maximum of the integral over deviations, and deviations to their mode there.

        The integral is Laplace's, with observed second derivatives; the search is limited to `MARGINAL_REACH`.
        """
        assert self._curvature is not None
        joint = self.b, self.v
        unit = np.sqrt(np.diag(np.linalg.inv(self._curvature[0])))

        def lost(away: FloatArray) -> float:
            self.b, self.v = joint[0] + unit * away, joint[1]
            if not self._find_mode(sd, free, people_only=True):
                return IMPOSSIBLE
            volume = -float(np.linalg.slogdet(self._derivatives(sd, free, exact=True)[-1])[1].sum()) / 2
            return -self._height(self.b, self.v, sd, free) - volume

        reach = [(-MARGINAL_REACH, MARGINAL_REACH)] * len(unit)
        found = optimize.minimize(lost, 0 * unit, method="L-BFGS-B", bounds=reach, options={"eps": 1e-3, "ftol": 1e-8})
        end = polished(lost, found.x, low=-MARGINAL_REACH, high=MARGINAL_REACH)
        lost(end if end is not None else found.x)

    def covariances(self) -> tuple[FloatArray, FloatArray]:
        """Return the covariance of the fixed effects, and the joint covariance with each person's v."""
        assert self._curvature is not None
        schur, bv, vv = self._curvature
        covariance = np.linalg.inv(schur)
        own = np.linalg.inv(vv)
        turn = -own @ bv.transpose(0, 2, 1)  # dv / db
        cross = turn @ covariance
        size = self.layout.fixed
        together = np.empty((self.people, size + len(self.which), size + len(self.which)))
        together[:, :size, :size] = covariance
        together[:, size:, :size] = cross
        together[:, :size, size:] = cross.transpose(0, 2, 1)
        together[:, size:, size:] = own + cross @ turn.transpose(0, 2, 1)
        return np.asarray(covariance, float), together
