"""Table of the log-normal model of percept durations over subjects."""

from __future__ import annotations

import pandas as pd

from focalgradient.report.document import Table
from focalgradient.report.tables import Sheet
from focalgradient.statistics import DominanceModel, NotComputed
from focalgradient.statistics.wording import number

__all__ = ["dominance_sheet"]

FILE = "necker_durations_lognormal.csv"

MEANINGS = {
    "median": "median duration (s) in a first trial, geometric mean over subjects",
    "median_log_sd": "SD over subjects of log median",
    "spread": "SD of log duration, geometric mean over subjects",
    "spread_log_sd": "SD over subjects of its logarithm",
    "preference": "log ratio of medians, rigid over nonrigid, mean over subjects",
    "preference_sd": "SD of it over subjects",
    "first_ratio": "first percept of a trial over later ones (ratio of medians)",
    "drift": "exponent of the trial's number",
    "serial": "correlation with the percept before",
}


def dominance_sheet(model: DominanceModel | NotComputed) -> Sheet:
    """Return the parameters with standard errors, on the scale that `DominanceModel` states."""
    caption = "Durations over subjects: log-normal model with each subject's own median, spread and preference"
    header = ["parameter", "estimate", "SE (of the logarithm; of atanh for the correlation; else as it stands)"]
    if isinstance(model, NotComputed):
        table = Table(caption, header, [["all", "not computed", ""]], (model.reason,), FILE)
        return Sheet(FILE, table, pd.DataFrame([{"not_computed": model.reason}]))
    named = [(name, getattr(model, name), model.standard_errors.get(name)) for name in MEANINGS]
    rows = [[MEANINGS[name], number(value), "–" if se is None else number(se)] for name, value, se in named]
    note = (
        f"{model.people} subjects, {model.percepts} percepts, {model.censored} cut off (censored); log likelihood "
        f"{model.log_likelihood:.1f}. A parameter without a standard error was not fitted."
    )
    return Sheet(FILE, Table(caption, header, rows, (note,), FILE), pd.DataFrame(named, columns=[*header[:2], "se"]))
