"""Table of predictions of a simulated observer next to published findings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import pandas as pd

from focalgradient.observers import Observer
from focalgradient.progress import Progress
from focalgradient.published.experiments import EXPERIMENTS
from focalgradient.published.record import Finding, Prediction, Published, simulate

__all__ = ["Row", "csv_of", "markdown", "predicted_beside_published"]


TWO_DIGITS_BELOW = 0.095
"""Absolute value below which numbers are shown with two significant digits instead of two decimals."""


@dataclass(frozen=True, slots=True)
class Row:
    """Finding with the prediction of a simulated observer; None if it cannot be asked."""

    experiment: Published
    finding: Finding
    predicted: Prediction | None

    @property
    def score(self) -> str:
        """Score by the rule of `Finding`."""
        return self.finding.score(self.predicted)

    @property
    def range(self) -> str:
        """Range of agreement in words."""
        low, high = self.finding.low, self.finding.high
        if math.isinf(low):
            return f"below {high:g}"
        return f"above {low:g}" if math.isinf(high) else f"{low:g} to {high:g}"

    @property
    def independent(self) -> str:
        """Independence of prediction and finding: "yes", or the property that was taken from the finding."""
        return f"no: {self.finding.taken}" if self.finding.taken else "yes"

    @property
    def stated(self) -> str:
        """Predicted value with its standard error, if any; a dash without a prediction."""
        if self.predicted is None:
            return "-"
        error = self.predicted.standard_error
        return _number(self.predicted.value) + (f" ± {_number(error)}" if error else "")


def _number(value: float) -> str:
    """Format with two decimals, or with two significant digits if small.

    >>> _number(0.41), _number(-12.3), _number(0.0031)
    ('0.41', '-12.30', '0.0031')
    """
    return f"{value:.2f}" if abs(value) >= TWO_DIGITS_BELOW or value == 0 else f"{value:.2g}"


def predicted_beside_published(
    observer: Observer, experiments: Sequence[Published] = (*EXPERIMENTS.values(),), progress: Progress | None = None
) -> list[Row]:
    """Predict every finding of the experiments with a simulated observer.

    Parameters
    ----------
    observer
        Simulated observer.
    experiments
        Experiments; default: all.
    progress
        Function called with the completed fraction and a description of the work.

    Examples
    --------
    >>> from focalgradient.observers import OBSERVERS
    >>> rows = predicted_beside_published(OBSERVERS["default"], [EXPERIMENTS["jacobs1989"]])
    >>> [(row.stated, row.range, row.score) for row in rows][:2]
    [('0.13', '0.1 to 0.18', 'agrees'), ('0.41', '0.05 to 0.07', 'differs')]
    """
    rows = []
    for number, experiment in enumerate(experiments):
        predicted = simulate(experiment, observer)
        rows += [Row(experiment, finding, predicted[finding.quantity]) for finding in experiment.findings]
        if progress is not None:
            progress((number + 1) / len(experiments), experiment.citation)
    return rows


def csv_of(rows: Iterable[Row]) -> str:
    """Format as comma-separated values, one row per finding; the names of prediction columns contain "simulated".

    Examples
    --------
    >>> row = Row(EXPERIMENTS["held2012"], EXPERIMENTS["held2012"].findings[0], None)
    >>> csv_of([row]).splitlines()[0].split(",")[:4]
    ['experiment', 'quantity', 'units', 'published']
    """
    cells = [
        {
            "experiment": row.experiment.citation,
            "quantity": row.finding.quantity,
            "units": row.finding.units,
            "published": row.finding.printed,
            "range of agreement": row.range,
            "read from": row.finding.source,
            "predicted (simulated)": row.predicted and f"{row.predicted.value:.4g}",
            "standard error (simulated)": row.predicted and f"{row.predicted.standard_error:.4g}",
            "score": row.score,
            "independent": row.independent,
            "remark": row.finding.remark,
            "doi": row.experiment.doi,
        }
        for row in rows
    ]
    return pd.DataFrame(cells).to_csv(index=False, lineterminator="\n")


def markdown(rows: Iterable[Row]) -> str:
    """Format as the Markdown table of the documents, one row per finding.

    Examples
    --------
    >>> row = Row(EXPERIMENTS["held2012"], EXPERIMENTS["held2012"].findings[0], None)
    >>> markdown([row]).splitlines()[0].count("|")
    9
    """
    cells = [
        {
            "experiment": row.experiment.citation,
            "quantity": row.finding.quantity + (f" ({row.finding.units})" if row.finding.units != "1" else ""),
            "published": row.finding.printed,
            "range of agreement": row.range,
            "read from": row.finding.source,
            "simulated": row.stated,
            "score": row.score,
            "independent": row.independent,
        }
        for row in rows
    ]
    lines = [f"| {' | '.join(line)} |" for line in (cells[0], *(row.values() for row in cells))]
    lines.insert(1, "|" + "---|" * len(cells[0]))
    return "\n".join(lines) + "\n"
