"""Analysis of data sets for reports: each task is read and analysed separately, so that failures are isolated."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.dataset import DataSet, read_dataset
from focalgradient.errors import InputError
from focalgradient.progress import Progress
from focalgradient.report.exclusions import WITHOUT
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
)
from focalgradient.statistics.cube_questions import cube_questions
from focalgradient.statistics.effects import questions_of
from focalgradient.statistics.questions import NO_ANSWERS, Answers
from focalgradient.statistics.questions import Analysis as Questions

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


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Analysed:
    """Answers with exclusions applied, and their analysis.

    Parameters
    ----------
    data
        The data set; None for the user's own table.
    table
        All rows.
    kept, quality
        Rows kept by the rules, and the data quality with the exclusions.
    main
        Analysis of the rows kept, or the reason why there is none.
    everyone
        Answers without exclusions; empty if nothing was excluded.
    """

    data: DataSet | None
    table: pd.DataFrame
    kept: pd.DataFrame
    quality: Quality
    main: Any
    everyone: Answers

    @property
    def answers(self) -> Answers:
        """Answers with exclusions, then the main results without, where anything was excluded."""
        kept = () if isinstance(self.main, NotComputed) else self.main.answers
        return Answers((*kept, *self.everyone.variant(WITHOUT)))

    @property
    def simulated(self) -> bool:
        """True for simulated observers."""
        return bool(self.table["kind"].iloc[0] == "simulated")  # tables of mixed kinds have been rejected


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Ratings(Analysed):
    """Analysed ratings of experiment 1.

    Parameters
    ----------
    analysis
        Statistical analysis of the ratings.
    factors
        Comparisons of user-defined factors.
    fixated
        With recorded gaze: analysis without trials in which gaze left the fixated object, or the reason why there is
        none.
    """

    analysis: Analysis
    factors: Answers = NO_ANSWERS
    fixated: Ratings | NotComputed | None = None

    @property
    def compared(self) -> ComparisonResult | None:
        """Analysis of paired comparisons."""
        return self.main if isinstance(self.main, ComparisonResult) else None

    @property
    def result(self) -> DepthRatingResult | NotComputed:
        """Analysis of ratings, or the reason why there is none."""
        return NotComputed(self.analysis.no_rises) if self.compared else self.main


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Reports(Analysed):
    """Analysed reports of experiment 2."""

    @property
    def result(self) -> NeckerResult | NotComputed:
        """Analysis of the reports, or the reason why there is none."""
        return self.main


def _analysed(table: pd.DataFrame, asked: Questions, analyse: Callable[[pd.DataFrame], Any]) -> dict[str, Any]:
    """Return the fields of `Analysed`: the result with exclusions, and the answers to the same questions without."""
    assert asked.exclusions is not None
    kept, found = asked.exclusions(table)
    everyone = asked.asked(table) if found.exclusions and found.subjects_before else NO_ANSWERS
    if not kept["catch"].all():
        main = analyse(kept)
    elif not found.subjects_before:
        main = NotComputed("All trials are catch trials: there is nothing to analyse.")
    else:
        who = "the only subject" if found.subjects_before == 1 else f"all {found.subjects_before} subjects"
        main = NotComputed(f"The rules of exclusion leave out {who}: there is nothing to analyse.")
    return {"table": table, "kept": kept, "quality": found, "main": main, "everyone": everyone}


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
    asked = questions_of(meant, {*table["fixation"]}, table["scene"].nunique(), {}, bound, rules)
    found = _analysed(table, asked, lambda rows: analyse(rows, meant, bound=bound, progress=progress))
    if found["quality"].subjects_after:
        found["factors"] = factor_effects(found["kept"], factors, ratios=meant.ratios)
    if data is not None and "gaze_left" in table:
        stayed = table[~table["gaze_left"]].drop(columns="gaze_left")
        found["fixated"] = NotComputed("No trial has gaze on the fixated object.")
        if not stayed["catch"].all():
            found["fixated"] = analyse_table(stayed, bound=bound, scale=scale, rules=rules, data=data)
    return Ratings(data=data, analysis=meant, **found)


def analyse_necker(root: str | os.PathLike[str], *, rules: Rules | None = None) -> Reports:
    """Read and analyse the reports on the Necker cube of a data set: see `analyse_ratings`."""
    data = read_dataset(root, ["necker"], damaged="leave out")
    return analyse_report_table(_table(data, data.necker, "reports on the cube"), rules=rules, data=data)


def analyse_report_table(table: pd.DataFrame, *, rules: Rules | None = None, data: DataSet | None = None) -> Reports:
    """Analyse a table of reports on the cube: see `analyse_ratings`, and `focalgradient.statistics.necker`."""
    used = rules or Rules()
    asked = cube_questions([], rules=used)
    found = _analysed(table, asked, lambda rows: necker(rows, shortest_both=used.shortest_both))
    return Reports(data=data, **found)


def _table(data: DataSet, table: pd.DataFrame, kind: str) -> pd.DataFrame:
    if table.empty and data.problems:
        raise InputError(data.problems[0])
    if table.empty:
        raise InputError(f"{Path(data.root)} holds no {kind}: nobody took part, or no session has its table.")
    return table.assign(kind=np.where(table["simulated"], "simulated", "human"))
