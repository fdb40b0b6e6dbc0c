"""Analysis of data sets for reports: each task is read and analysed separately, so that failures are isolated."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.dataset import DataSet, read_dataset
from focalgradient.design import check_design
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
    necker,
)
from focalgradient.statistics.criteria import AnalysisOptions
from focalgradient.statistics.cube_questions import cube_questions_of
from focalgradient.statistics.effects import has_confidence, questions_of
from focalgradient.statistics.questions import NO_ANSWERS, Answers
from focalgradient.statistics.questions import Analysis as Questions
from focalgradient.tasks import Task, task_named

__all__ = ["Ratings", "Reports", "analyse_necker", "analyse_ratings", "analyse_report_table", "analyse_table"]


def read_task(root: str | os.PathLike[str], task: Task) -> DataSet:
    """Read the sessions of a task; damaged ones are left out.

    Raises
    ------
    InputError
        If there are none, or all are damaged.
    """
    data = read_dataset(root, [task.name], damaged="leave out")
    if task.name not in data.tables or data.tables[task.name].empty:
        nothing = f"{root} holds no trials of {task.called}: nobody took part, or no session has its table."
        raise InputError(data.problems[0] if data.problems else nothing)
    return data


def designs_in(data: DataSet) -> list[dict[str, Any]]:
    """Return the settings of the design that each session recorded."""
    return [sidecar["Design"] for sidecar in data.sidecars.values()]


def design_in(data: DataSet) -> Any:
    """Return the design of the first session."""
    files, sidecar = next(iter(data.sidecars.items()))
    return check_design(files.task, sidecar["Design"])


def asked_in(data: DataSet, options: AnalysisOptions, table: pd.DataFrame) -> Questions:
    """Return the analysis of the task of a data set, of the conditions in a table."""
    design = design_in(data)
    return task_named(design.task).analysis(design, options, table)


def scale_of_sessions(data: DataSet) -> ResponseScale:
    """Return the response scale of a data set's designs.

    Raises
    ------
    InputError
        If sessions differ in scale, or the scale is not registered.
    """
    designs = designs_in(data)
    scales = sorted({str(design.get("scale", "ratio")) for design in designs})
    if len(scales) != 1:
        raise InputError(f"{data.root} has the scales {', '.join(scales)}: keep designs in data sets of their own.")
    return scale_of(designs[0])


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
    also
        Answers of further analyses of the rows kept.
    """

    data: DataSet | None
    table: pd.DataFrame
    kept: pd.DataFrame
    quality: Quality
    main: Any
    everyone: Answers
    also: Answers

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
    fixated
        With recorded gaze: analysis without trials in which gaze left the fixated object, or the reason why there is
        none.
    """

    analysis: Analysis
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
    """Analysed reports of experiment 2.

    Parameters
    ----------
    questions
        Analysis of the reports.
    """

    questions: Questions

    @property
    def result(self) -> NeckerResult | NotComputed:
        """Analysis of the reports, or the reason why there is none."""
        return self.main


def _analysed(table: pd.DataFrame, asked: Questions, analyse: Callable[[pd.DataFrame], Any]) -> dict[str, Any]:
    """Return the fields of `Analysed`: the result with exclusions, and the answers to the same questions without."""
    kept, found = asked.excluded(table)
    assert found is not None
    everyone = asked.asked(table, everyone=True) if found.exclusions and found.subjects_before else NO_ANSWERS
    also = asked.asked_also(kept) if found.subjects_after else NO_ANSWERS
    if not kept["catch"].all():
        main = analyse(kept)
    elif not found.subjects_before:
        main = NotComputed("All trials are catch trials: there is nothing to analyse.")
    else:
        who = "the only subject" if found.subjects_before == 1 else f"all {found.subjects_before} subjects"
        counts = Counter(one.rule for one in found.exclusions)
        reasons = "; ".join(f"{rule}: {count}" for rule, count in counts.most_common())
        main = NotComputed(
            f"The rules of exclusion leave out {who} ({reasons}): there is nothing to analyse, unless 'focalgradient "
            "report --rules' states others."
        )
    return {"table": table, "kept": kept, "quality": found, "main": main, "everyone": everyone, "also": also}


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
    data = read_task(root, task_named("depthrating"))
    return analyse_table(trials_in(data), bound=bound, scale=scale, rules=rules, data=data, progress=progress)


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
    if data is not None:
        response = scale_of_sessions(data)
        # the response scale of the design, unlike its analysis, defines a middle
        meant = response.analysis if stated is None or type(response.analysis) is type(stated) else stated
    options = AnalysisOptions(bound=bound, rules=rules or Rules(), scale=meant)
    found = _analysed(
        table, asked_of_ratings(table, options, data), lambda rows: analyse(rows, meant, bound=bound, progress=progress)
    )
    if data is not None and "gaze_left" in table:
        stayed = table[~table["gaze_left"]].drop(columns="gaze_left")
        found["fixated"] = NotComputed("No trial has gaze on the fixated object.")
        if not stayed["catch"].all():
            found["fixated"] = analyse_table(stayed, bound=bound, scale=scale, rules=rules, data=data)
    return Ratings(data=data, analysis=meant, **found)


def asked_of_ratings(table: pd.DataFrame, options: AnalysisOptions, data: DataSet | None) -> Questions:
    """Return the analysis of a table of ratings: that of the task, or of the user's own table, with a scale."""
    if data is not None:
        return asked_in(data, options, table)
    assert options.scale is not None
    settings = {"confidence": has_confidence(table)}
    shown = {*table["fixation"]}, table["scene"].nunique()
    return questions_of(options.scale, *shown, settings, options.bound, options.rules)


def analyse_necker(root: str | os.PathLike[str], *, rules: Rules | None = None) -> Reports:
    """Read and analyse the reports on the Necker cube of a data set: see `analyse_ratings`."""
    data = read_task(root, task_named("necker"))
    return analyse_report_table(trials_in(data), rules=rules, data=data)


def analyse_report_table(table: pd.DataFrame, *, rules: Rules | None = None, data: DataSet | None = None) -> Reports:
    """Analyse a table of reports on the cube: see `analyse_ratings`, and `focalgradient.statistics.necker`."""
    used = rules or Rules()
    questions = cube_questions_of(table, used) if data is None else asked_in(data, AnalysisOptions(rules=used), table)
    found = _analysed(table, questions, lambda rows: necker(rows, shortest_both=used.shortest_both))
    return Reports(data=data, questions=questions, **found)


def trials_in(data: DataSet) -> pd.DataFrame:
    """Return the table of a data set of one task, with the kind of its participants."""
    table = data.tables[design_in(data).task]
    return table.assign(kind=np.where(table["simulated"], "simulated", "human"))
