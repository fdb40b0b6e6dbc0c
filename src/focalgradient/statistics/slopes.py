"""How answers change with an amount, over subjects: a mixed model with a slope of each subject's own.

The fixed slope over its standard error is referred to Student's t with a degree of freedom less than subjects. With few
subjects a normal distribution would find too much, and a model without random slopes would find almost anything. Where
subjects hardly differ, this finds too little: `two_stage_slope` keeps its error rate there too.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from focalgradient.statistics.means import paired_effect, student_effect
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["design_matrix", "mixed_slope", "own_slopes", "two_stage_slope"]

FloatArray = NDArray[np.float64]

STARTS: Final = ((1.0, 0.0, 1.0), (0.3, 0.0, 0.3))
"""Of the search, two, since it may stop at a boundary: the random effects' factor over the noise's deviation."""

SINGULAR_BELOW: Final = 1e-3
"""What of that factor is as good as nil."""

FLOOR: Final = 1e-12
"""Noise that is always left, as a share of the answers' variance: answers by rule have none."""

LARGEST: Final = 1e4
"""Standard deviations of the random effects beyond which, over the noise's, there is no noise to speak of."""

TOO_FEW = "A slope over subjects needs two or more subjects with two or more amounts each."


NO_MAXIMUM = "The mixed model did not converge: the slope is from two stages."

SINGULAR = "The mixed model finds that subjects differ in fewer ways than it allows for: its covariance is singular."


def design_matrix(amount: FloatArray, kinds: NDArray[np.object_]) -> FloatArray:
    """Columns 1 and the amount, then one for each kind of material (scene) after the first: its difference to that.

    Examples
    --------
    >>> design_matrix(np.array([0.0, 2.0]), np.array(["room", "terrain"], dtype=object))
    array([[1., 0., 0.],
           [1., 2., 1.]])
    """
    return np.column_stack([np.ones(len(amount)), amount, *(kinds == kind for kind in sorted(set(kinds))[1:])]).astype(
        float
    )


def own_slopes(answers: FloatArray, design: FloatArray, subject: NDArray[np.int_]) -> FloatArray:
    """Least-squares slope (of column 1) of each subject; NaN where the subject's answers do not determine it.

    Examples
    --------
    >>> amount = np.array([0.0, 1.0, 0.0, 1.0])
    >>> answers, design = np.array([0.0, 2.0, 1.0, 1.5]), np.column_stack([np.ones(4), amount])
    >>> own_slopes(answers, design, np.array([0, 0, 1, 1])).round(6)
    array([2. , 0.5])
    """
    slopes = np.full(subject.max() + 1, np.nan)
    for one in range(len(slopes)):
        rows = subject == one
        columns = np.flatnonzero(np.ptp(design[rows], axis=0) > 0)  # a subject may have seen one kind only
        if 1 in columns:
            own = np.column_stack([np.ones(rows.sum()), design[rows][:, columns]])
            solution, _, rank, _ = np.linalg.lstsq(own, answers[rows], rcond=None)
            if rank == own.shape[1]:
                slopes[one] = solution[1 + int(np.flatnonzero(columns == 1)[0])]
    return slopes


def mixed_slope(answers: FloatArray, design: FloatArray, subject: NDArray[np.int_]) -> Effect | NotComputed:
    """Slope of the answers by a linear mixed model with random intercepts and slopes, fitted by REML.

    answer = design . fixed + a_subject + b_subject x amount + noise, with (a, b) normal with any covariance.

    Parameters
    ----------
    answers
        One a trial.
    design
        A row a trial: 1, the amount, then covariates: see `design_matrix`.
    subject
        Number of each trial's subject, from 0 up.

    Returns
    -------
    Effect
        In the answers' unit over the amount's. If the model does not converge, from two stages, and it says so.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> subject, amount = np.repeat(np.arange(8), 6), np.tile([0.0, 1.0, 2.0], 16)
    >>> answers = (rng.normal(0.5, 0.2, 8)[subject]) * amount + rng.normal(0, 0.1, 48)
    >>> effect = mixed_slope(answers, np.column_stack([np.ones(48), amount]), subject)
    >>> round(effect.estimate, 1), effect.df
    (0.5, 7)
    """
    plain = two_stage_slope(answers, design, subject)
    if np.ptp(answers) == 0 or (isinstance(plain, NotComputed) and plain.reason == TOO_FEW):
        return plain
    fitted = _reml(answers, design, subject)
    if fitted is None:
        return plain if isinstance(plain, NotComputed) else replace(plain, remarks=(NO_MAXIMUM,))
    estimate, error, singular = fitted
    return student_effect(
        estimate,
        error,
        len(np.unique(subject)) if isinstance(plain, NotComputed) else plain.subjects,
        "linear mixed model, random intercepts and slopes, REML, t on subjects - 1",
        dz=None if isinstance(plain, NotComputed) else plain.dz,
        remarks=(SINGULAR,) if singular else (),
    )


def two_stage_slope(answers: FloatArray, design: FloatArray, subject: NDArray[np.int_]) -> Effect | NotComputed:
    """Mean of the subjects' own least-squares slopes, by a t-test: exact in a balanced design; see `mixed_slope`.

    Examples
    --------
    >>> answers, design = np.array([0.0, 2.0, 1.0, 1.5]), np.column_stack([np.ones(4), [0.0, 1.0, 0.0, 1.0]])
    >>> round(two_stage_slope(answers, design, np.array([0, 0, 1, 1])).estimate, 6)
    1.25
    """
    own = own_slopes(answers, design, subject)
    told = own[np.isfinite(own)]
    if len(told) < 2:
        return NotComputed(TOO_FEW)
    if np.ptp(answers) == 0:
        return NotComputed("All answers are the same: there is no variation to test a slope against.")
    return paired_effect(told, "least-squares slopes of each subject's own, t-test of their mean")


def _reml(answers: FloatArray, design: FloatArray, subject: NDArray[np.int_]) -> tuple[float, float, bool] | None:
    """Slope, its standard error, and whether the random effects' covariance is singular; None without a maximum.

    The likelihood's only free parameters are the three of the random effects' covariance over the noise's, by its
    Cholesky factor; sums over each subject's trials are all it needs of the data (Bates et al. 2015). The
    general software for Python stops short of the maximum in a third of experiments with six subjects.
    """
    width, height = float(np.ptp(design[:, 1])), float(answers.std())
    x = design / np.where(np.arange(design.shape[1]) == 1, width, 1.0)
    y, random = answers / height, x[:, :2]
    subjects, freedom = subject.max() + 1, len(y) - x.shape[1]
    if freedom < 1:
        return None

    def sums(left: FloatArray, right: FloatArray) -> FloatArray:
        total = np.zeros((subjects, left.shape[1], right.shape[1]))
        np.add.at(total, subject, left[:, :, None] * right[:, None, :])
        return total

    both = np.column_stack([x, y])
    zz, zb, bb = sums(random, random), sums(random, both), both.T @ both
    bb[-1, -1] += FLOOR

    def profiled(theta: FloatArray) -> tuple[float, FloatArray]:
        """Log determinant of the subjects' own, and the sums of squares and products that are left without them."""
        first, other, second = theta
        a, b, c = zz[:, 0, 0], zz[:, 0, 1], zz[:, 1, 1]
        upper = first**2 * a + 2 * first * other * b + other**2 * c + 1
        cross, lower = second * (first * b + other * c), second**2 * c + 1
        determinant = upper * lower - cross**2
        one, two = first * zb[:, 0] + other * zb[:, 1], second * zb[:, 1]
        mixed = one.T @ (two * (cross / determinant)[:, None])
        taken = one.T @ (one * (lower / determinant)[:, None]) + two.T @ (two * (upper / determinant)[:, None])
        return float(np.log(determinant).sum()), bb - (taken - mixed - mixed.T)

    def cost(theta: FloatArray) -> float:
        """Twice the negative logarithm of the likelihood: the last diagonal element is the root of the noise's sum."""
        volume, left = profiled(theta)
        logs = 2 * np.log(np.linalg.cholesky(left).diagonal())
        return float(volume + logs[:-1].sum() + freedom * (logs[-1] - math.log(freedom)))

    try:
        # unbounded: a factor's column may change its sign, and a search that may not would stop where it wants to
        quick = (optimize.minimize(cost, start, method="BFGS", options={"gtol": 1e-2}) for start in STARTS)
        best = min(quick, key=lambda found: found.fun)
        # a maximum for one search is one for another
        sure = optimize.minimize(cost, best.x, method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-9})
        _, left = profiled(sure.x)
        information, projected = left[:-1, :-1], left[:-1, -1]
        coefficients = np.linalg.solve(information, projected)
        covariance = np.linalg.inv(information) * max(float(left[-1, -1] - coefficients @ projected), FLOOR) / freedom
    except np.linalg.LinAlgError:
        return None
    if not (sure.success and covariance[1, 1] > 0) or np.abs(sure.x).max() > LARGEST:
        return None
    singular = np.abs(sure.x[[0, 2]]).min() < SINGULAR_BELOW
    return float(coefficients[1]) * height / width, math.sqrt(covariance[1, 1]) * height / width, singular
