"""How often, over subjects: a marginal logistic model with few subjects' standard errors."""

from __future__ import annotations

import math
import warnings

import numpy as np
from numpy.typing import NDArray
from scipy import special

from focalgradient.statistics.crossed import generalised
from focalgradient.statistics.means import student_effect
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["marginal_slope"]


def marginal_slope(
    answers: NDArray[np.float64], amount: NDArray[np.float64], subject: NDArray[np.int_], scene: NDArray[np.int_]
) -> tuple[Effect | NotComputed, Effect | NotComputed]:
    """Change of the log odds of an answer for a unit of some amount: over subjects and scenes, and for these scenes.

    Answers of one subject may go together in any way: the standard error is taken between subjects, and corrected for
    there being few of them (Mancl and DeRouen 2001); the test is on Student's t with a degree of freedom less than
    subjects. That is the second. The first adds what scenes differ by, as `generalised` has it of
    the trials' influence on the estimate, where there are five scenes or more.

    Parameters
    ----------
    answers, amount
        Of each trial.
    subject, scene
        Number of each trial's, from 0 up.

    Examples
    --------
    >>> answers = np.array([0, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 1], float)
    >>> subject = np.repeat(np.arange(4), 3)
    >>> effect, _ = marginal_slope(answers, np.tile([0.0, 1.0, 2.0], 4), subject, np.zeros(12, int))
    >>> round(effect.estimate, 2)  # as a logistic regression of all answers has it
    2.06
    """
    subjects = len(np.unique(subject))
    missing = None
    if subjects < 2:
        missing = NotComputed("A test over subjects needs two or more, and there is 1.")
    elif np.ptp(amount) == 0 or np.ptp(answers) == 0:
        what = "answers" if np.ptp(answers) == 0 else "amounts"
        missing = NotComputed(f"All {what} are the same: there is no slope.")
    elif answers[amount > amount.min()].min() == 1 and answers[amount == amount.min()].max() == 0:
        missing = NotComputed("The answers follow the amount without exception: the slope has no bound.")
    if missing is not None:
        return missing, missing
    fixed, influence = _fitted(answers, amount, subject)
    return generalised(fixed, influence, subject, scene), fixed


def _fitted(
    answers: NDArray[np.float64], amount: NDArray[np.float64], subject: NDArray[np.int_]
) -> tuple[Effect | NotComputed, NDArray[np.float64]]:
    """The slope, and each answer's influence on it."""
    from statsmodels.genmod.cov_struct import Independence  # type: ignore[import-untyped]
    from statsmodels.genmod.families import Binomial  # type: ignore[import-untyped]
    from statsmodels.genmod.generalized_estimating_equations import GEE  # type: ignore[import-untyped]

    design = np.column_stack([np.ones(len(answers)), amount])
    order = np.argsort(subject, kind="stable")
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # what matters of them is asked of the result
        model = GEE(answers[order], design[order], subject[order], family=Binomial(), cov_struct=Independence())
        fit = model.fit(cov_type="bias_reduced")
        estimate, error = float(fit.params[1]), float(fit.bse[1])
    if not (fit.converged and math.isfinite(estimate) and math.isfinite(error) and error > 0):
        return NotComputed("The marginal model did not converge."), np.zeros(len(answers))
    expected = special.expit(design @ np.asarray(fit.params))
    information = (design.T * (expected * (1 - expected))) @ design
    influence = (design * (answers - expected)[:, None]) @ np.linalg.inv(information)[1]
    method = "marginal logistic model (GEE), bias-reduced standard errors, t on subjects - 1"
    return student_effect(estimate, error, len(np.unique(subject)), method), influence
