"""Analysis of data sets for reports: each task is read and analysed separately, so that failures are isolated."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.dataset import DataSet, read_dataset
from focalgradient.errors import InputError
from focalgradient.progress import Progress
from focalgradient.report.parts import BOUND
from focalgradient.scales import Analysis, Ratios, ResponseScale, analysis_named, scale_of
from focalgradient.statistics import (
    ComparisonResult,
    DepthRatingResult,
    NeckerResult,
    NotComputed,
    Quality,
    Rules,
    analyse,
    factor_effects,
    necker,
    quality,
)
from focalgradient.statistics.questions import NO_ANSWERS, Answers

__all__ = ["Ratings", "Reports", "analyse_necker", "analyse_ratings", "analyse_report_table", "analyse_table"]


def scale_of_sessions(data: DataSet) -> tuple[ResponseScale, Mapping[str, Any]]:
    """Return the response scale of a data set's designs, and their factors.

    Raises
    ------
    InputError
        If sessions differ in scale, or the scale is not registered.
    """
    designs = [sidecar["Design"] for sidecar in data.sidecars.values()]
    scales = sorted({str(design.get("scale", "ratio")) for design in designs})
    if len(scales) != 1:
        raise InputError(f"{data.root} has the scales {', '.join(scales)}: keep designs in data sets of their own.")
    return scale_of(designs[0]), designs[0].get("factors") or {}


@dataclass(frozen=True, slots=True, eq=False)
class Ratings:
    """Analysed ratings of experiment 1.

    Parameters
    ----------
    data
        The data set; None for the user's own table.
    table
        All rows.
    kept, quality
        Rows kept by the rules, and the data quality with the exclusions.
    result
        Analysis of the ratings, or the reason why there is none.
    simulated
        True for simulated observers.
    analysis
        Statistical analysis of the ratings.
    compared
        Analysis of paired comparisons; then `result` is None.
    factors
        Comparisons of user-defined factors.
    fixated
        With recorded gaze: analysis without trials in which gaze left the fixated object, or the reason why there is
        none.
    everyone
        Main analysis without exclusions.
    """

    data: DataSet | None
    table: pd.DataFrame
    kept: pd.DataFrame
    quality: Quality
    result: DepthRatingResult | NotComputed
    simulated: bool
    analysis: Analysis = field(default_factory=Ratios)
    compared: ComparisonResult | None = None
    factors: Answers = NO_ANSWERS
    fixated: Ratings | NotComputed | None = None
    everyone: DepthRatingResult | ComparisonResult | NotComputed | None = None

    @property
    def main(self) -> DepthRatingResult | ComparisonResult | NotComputed:
        """Analysis of the rows kept, for any scale."""
        return self.compared or self.result


@dataclass(frozen=True, slots=True, eq=False)
class Reports:
    """Analysed reports of experiment 2: see `Ratings`; `shortest_both` is that of `focalgradient.statistics.necker`."""

    data: DataSet | None
    table: pd.DataFrame
    kept: pd.DataFrame
    quality: Quality
    result: NeckerResult | NotComputed
    simulated: bool
    shortest_both: float
    everyone: NeckerResult | NotComputed | None = None


def analyse_ratings(
    root: str | os.PathLike[str],
    *,
    bound: float = BOUND,
    scale: Analysis | str | None = None,
    rules: Rules | None = None,
    progress: Progress | None = None,
) -> Ratings:
    """Read and analyse the depth ratings of a data set; damaged sessions are excluded and named in `data`.

    Parameters
    ----------
    root
        Folder of the data set.
    bound
        Equivalence bound: see `focalgradient.statistics.depth_rating`.
    scale
        Analysis of the ratings; None: that of the designs.
    rules
        Exclusion rules.
    progress
        See `focalgradient.statistics.depth_rating`.

    Raises
    ------
    InputError
        If there are none, or they are invalid; the message states file and row.
    """
    data = read_dataset(root, ["depthrating"], damaged="leave out")
    return analyse_table(
        _table(data, data.depth_rating, "depth ratings"),
        bound=bound,
        scale=scale,
        rules=rules,
        data=data,
        progress=progress,
    )


def analyse_table(
    table: pd.DataFrame,
    *,
    bound: float = BOUND,
    scale: Analysis | str | None = None,
    rules: Rules | None = None,
    data: DataSet | None = None,
    progress: Progress | None = None,
) -> Ratings:
    """Analyse a table of depth ratings: see `analyse_ratings`, and `focalgradient.statistics.depth_rating`."""
    stated = None if scale is None else analysis_named(scale)
    meant: Analysis = stated or Ratios()
    factors: Mapping[str, Any] = {}
    if data is not None:
        response, factors = scale_of_sessions(data)
        # the response scale of the design, unlike its analysis, defines a middle
        meant = response.analysis if stated is None or type(response.analysis) is type(stated) else stated
    kept, found = quality(table, rules, meant)
    main = _main(kept, found, meant, bound, progress)
    everyone = main if not found.exclusions else _main(table, found, meant, bound, None)
    own = NO_ANSWERS
    if found.subjects_after:
        own = factor_effects(kept, factors, ratios=meant.ratios)
    fixated: Ratings | NotComputed | None = None
    if data is not None and "gaze_left" in table:
        stayed = table[~table["gaze_left"]].drop(columns="gaze_left")
        if stayed["catch"].all():
            fixated = NotComputed("No trial has gaze on the fixated object.")
        else:
            fixated = analyse_table(stayed, bound=bound, scale=scale, rules=rules, data=data)
    compared = main if isinstance(main, ComparisonResult) else None
    result: DepthRatingResult | NotComputed
    result = NotComputed(main.analysis.no_rises) if isinstance(main, ComparisonResult) else main
    return Ratings(data, table, kept, found, result, _simulated(table), meant, compared, own, fixated, everyone)


def _main(
    rows: pd.DataFrame, found: Quality, meant: Analysis, bound: float, progress: Progress | None
) -> DepthRatingResult | ComparisonResult | NotComputed:
    """Apply the main analysis that belongs to the answers."""
    if rows["catch"].all():
        return _nobody(found)
    return analyse(rows, meant, bound=bound, progress=progress)


def analyse_necker(root: str | os.PathLike[str], *, rules: Rules | None = None) -> Reports:
    """Read and analyse the reports on the Necker cube of a data set: see `analyse_ratings`."""
    data = read_dataset(root, ["necker"], damaged="leave out")
    return analyse_report_table(_table(data, data.necker, "reports on the cube"), rules=rules, data=data)


def analyse_report_table(table: pd.DataFrame, *, rules: Rules | None = None, data: DataSet | None = None) -> Reports:
    """Analyse a table of reports on the cube: see `analyse_ratings`, and `focalgradient.statistics.necker`."""
    kept, found = quality(table, rules)
    shortest = found.rules.shortest_both

    def analysed(rows: pd.DataFrame) -> NeckerResult | NotComputed:
        return _nobody(found) if rows["catch"].all() else necker(rows, shortest_both=shortest)

    result = analysed(kept)
    everyone = analysed(table) if found.exclusions else result
    return Reports(data, table, kept, found, result, _simulated(table), shortest, everyone)


def _table(data: DataSet, table: pd.DataFrame, kind: str) -> pd.DataFrame:
    if table.empty and data.problems:
        raise InputError(data.problems[0])
    if table.empty:
        raise InputError(f"{Path(data.root)} holds no {kind}: nobody took part, or no session has its table.")
    return table.assign(kind=np.where(table["simulated"], "simulated", "human"))


def _simulated(table: pd.DataFrame) -> bool:
    return bool(table["kind"].iloc[0] == "simulated")  # tables of mixed kinds have been rejected


def _nobody(found: Quality) -> NotComputed:
    if not found.subjects_before:
        return NotComputed("All trials are catch trials: there is nothing to analyse.")
    return NotComputed(
        f"The rules of exclusion leave out all {found.subjects_before} subjects: there is nothing to analyse."
    )
