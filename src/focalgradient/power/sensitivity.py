"""Sensitivity of the power to the assumed standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import pandas as pd

from focalgradient.parallel import in_order
from focalgradient.power.running import experiment, power
from focalgradient.power.study import Study

__all__ = ["FACTORS", "sensitivity"]

FACTORS = (0.5, 2.0)
"""Factors applied to each standard deviation: assumptions are rarely more precise than a factor of 2."""


def sensitivity(
    study: Study, subjects: Sequence[int], experiments: int, *, executor: Executor | None = None
) -> pd.DataFrame:
    """Return the power with each assumed standard deviation halved and doubled in turn.

    Parameters
    ----------
    study
        Power study.
    subjects, experiments
        Numbers of subjects; and number of experiments for each of them.
    executor
        Executor of the simulations. None: this process.

    Returns
    -------
    DataFrame
        Columns `assumed` (name of the standard deviation), `factor`, `subjects`, `test` (one of the study's tests, or
        "joint"), `power` and its `standard_error`. Empty if nothing is assumed.
    """
    variants = [(name, factor) for name in study.model.spreads for factor in FACTORS]
    counts = sorted(set(subjects))
    jobs = [
        (study.varied(name, factor), count, number)
        for name, factor in variants
        for count in counts
        for number in range(experiments)
    ]
    outcomes = iter(in_order(executor, experiment, jobs))
    rows = []
    for name, factor in variants:
        found = [{"subjects": count} | next(outcomes) for count in counts for _ in range(experiments)]
        for one in power(pd.DataFrame(found), logs=False):
            shares = {test: (one.found[test], one.standard_error[test]) for test in study.tests}
            shares["joint"] = (one.joint, one.joint_error)
            rows += [(name, factor, one.subjects, test, *share) for test, share in shares.items()]
    return pd.DataFrame(rows, columns=["assumed", "factor", "subjects", "test", "power", "standard_error"])
