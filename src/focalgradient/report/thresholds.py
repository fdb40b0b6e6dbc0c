"""Section of the report on blur thresholds."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import pandas as pd

from focalgradient.dataset import DataSet, read_dataset
from focalgradient.errors import InputError
from focalgradient.plotting.thresholds import threshold_figure
from focalgradient.report.choices import THRESHOLDS
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.exclusions import WITHOUT
from focalgradient.report.export import table_files
from focalgradient.report.parts import Output, Part
from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet
from focalgradient.statistics import (
    Interval,
    NotComputed,
    ThresholdFit,
    ThresholdResult,
    blur_thresholds,
)
from focalgradient.statistics.questions import Answer, stated
from focalgradient.statistics.thresholds import ATTENDING, SubjectThreshold
from focalgradient.statistics.wording import many, number

__all__ = ["Thresholds", "analyse_thresholds", "fitted_values", "methods_thresholds", "threshold_answers", "unit_of"]

CAPTION = (
    "Left: share of right answers at each level (disc: larger for more trials) and each participant’s fitted function; "
    "dashed the share at threshold. Right: thresholds with 95 % intervals, geometric mean of all bold; dotted and "
    "open: too few catch trials right."
)

BIAS = (
    "In simulated adaptive sessions of 60 trials the bias of such a threshold is −4 % (slope 5, no lapses) to "
    "+12 % (slope 2, 4 % lapses), as answers near threshold do not determine slope and lapse rate. A bias that "
    "conditions have in common cancels in the ratio of their thresholds."
)
"""Bias of the estimate: docs/report/thresholds.md."""


@dataclass(frozen=True, slots=True, eq=False)
class Thresholds(Part):
    """Analysed threshold experiment.

    Parameters
    ----------
    data
        The data set.
    table
        All trials.
    result
        Thresholds.
    design
        Design settings of the first session, as recorded.
    simulated
        True for simulated observers.
    """

    title: ClassVar[str] = "Blur thresholds"
    name: ClassVar[str] = "blur_threshold"
    choices: ClassVar[tuple[str, ...]] = THRESHOLDS

    data: DataSet
    table: pd.DataFrame
    result: ThresholdResult
    design: Mapping[str, Any]
    simulated: bool

    def findings(self, output: Output) -> Iterator[Block]:
        result = self.result
        people = "simulated observers" if self.simulated else "sessions"
        what = "of blur" if self.design["judged"] == "blur" else "of depth from blur"
        yield Paragraph(f"Thresholds {what} were measured in {len(result.subjects)} {people}.")
        for one in result.subjects:
            if not one.kept:
                yield Notice(
                    f"{one.participant} {one.session}".strip() + f" was right in {one.catch_right} of "
                    f"{one.catch_trials} trials with the greatest level, fewer than {ATTENDING:.0%}: because of "
                    "inattention, or because the threshold lies near or above that level."
                )
            if isinstance(one.fit, NotComputed):
                yield Notice(f"{one.participant}: {one.fit.reason}")
            elif one.fit.low < 1.1 * self.design["least_level"] or one.fit.high > self.design["most_level"] / 1.1:
                yield Notice(
                    f"{one.participant}: the interval reaches the end of the levels, which go from "
                    f"{self.design['least_level']:g} to {self.design['most_level']:g} {result.unit}: the threshold may "
                    "lie beyond."
                )
        yield from _means(result)
        if any(isinstance(one.fit, ThresholdFit) for one in result.subjects):
            yield output.figure("blur_thresholds", threshold_figure(result, simulated=self.simulated), CAPTION)
        yield from output.tables([_sheet(result)])

    def answers(self) -> Iterator[Answer]:
        result = self.result
        kept = [one for one in result.subjects if one.kept]
        yield from threshold_answers(result, "", WITHOUT)
        yield stated(MEAN, "", result.mean_attending, "main", result.unit, averaged(kept), _head(result.unit))

    def methods(self, output: Output) -> Iterator[Block]:
        yield from map(Paragraph, methods_thresholds(self.design))
        yield from output.tables(self.design_table())

    def exports(self) -> Mapping[str, bytes]:
        return table_files(f"{self.name}_trials", self.table)


def analyse_thresholds(root: str | os.PathLike[str]) -> Thresholds:
    """Read and fit the thresholds of a data set; damaged sessions are excluded and named in `data`.

    Raises
    ------
    InputError
        If there are none, psignifit is not installed, or sessions differ in task or levels.
    """
    data = read_dataset(root, ["blurthreshold"], damaged="leave out")
    table = data.blur_threshold
    if table.empty:
        raise InputError(data.problems[0] if data.problems else f"{root} holds no trials of blur thresholds.")
    designs = [sidecar["Design"] for sidecar in data.sidecars.values()]
    first = designs[0]
    for key in ("judged", "least_level", "most_level", "pedestal", "pupil_mm"):
        if len({str(design.get(key)) for design in designs}) > 1:
            raise InputError(f"{root} has sessions that differ in {key}: keep designs in data sets of their own.")
    known = {
        f"sub-{files.participant}": float(sidecar["Participant"]["threshold"])
        for files, sidecar in data.sidecars.items()
        if sidecar.get("Simulated") and "threshold" in sidecar.get("Participant", {})
    }
    result = blur_thresholds(
        table,
        least=float(first["least_level"]),
        most=float(first["most_level"]),
        unit=unit_of(first),
        known=known,
    )
    return Thresholds(data, table, result, first, data.simulated)


def unit_of(design: Mapping[str, Any]) -> str:
    """Return the unit of a design's levels.

    >>> unit_of({"judged": "blur"}), unit_of({"judged": "depth"})
    ('D', 'mm')
    """
    return "D" if design["judged"] == "blur" else "mm"


def _means(result: ThresholdResult) -> Iterator[Block]:
    """Yield the mean over all participants, and that without those who missed catch trials."""
    missed = sum(not one.kept for one in result.subjects)
    if isinstance(result.mean, NotComputed):
        yield Notice(result.mean.reason)
        return
    yield Paragraph(f"Geometric mean of all: {_interval(result.mean, result.unit)}.")
    if not missed:
        yield Paragraph("None missed the catch trials: the mean with exclusions is the same.")
    elif isinstance(result.mean_attending, Interval):
        yield Paragraph(
            f"Without the {missed} who missed catch trials: {_interval(result.mean_attending, result.unit)}. People "
            "with a high threshold miss them as well: this mean is too low if thresholds reach the greatest level."
        )
    else:
        yield Paragraph("All missed the catch trials: there is no mean with exclusions.")


MEAN = "geometric mean threshold"


def threshold_answers(result: ThresholdResult, condition: str, role: str) -> Iterator[Answer]:
    """Yield the mean over all participants, with a role, and the threshold of each session."""
    head = _head(result.unit) + (f", {condition}" if condition else "")
    mean = stated(MEAN, condition, result.mean, "main", result.unit, averaged(result.subjects), head)
    yield replace(mean, role=role)
    for one in result.subjects:
        fit = one.fit
        level = ", ".join(filter(None, [one.participant, one.session, condition]))
        outcome = fit if isinstance(fit, NotComputed) else Interval(fit.threshold, fit.low, fit.high)
        yield stated("threshold", level, outcome, "description", result.unit, 1)


def _head(unit: str) -> str:
    return f"{MEAN} ({unit})" if unit else MEAN


def averaged(subjects: Sequence[SubjectThreshold]) -> int:
    """Return the number of participants in a mean threshold: sessions of a participant count as one."""
    return len({one.participant for one in subjects if isinstance(one.fit, ThresholdFit)})


def _interval(found: Interval, unit: str) -> str:
    ends = "" if found.low is None else f" (95 % interval {number(found.low)} to {number(found.high)} {unit})"
    return f"{number(found.estimate)} {unit}{ends}"


def fitted_values(fit: ThresholdFit | NotComputed) -> list[float | None]:
    """Return threshold, the ends of its interval, slope and lapses of a fit, and its trials; none without one."""
    if isinstance(fit, ThresholdFit):
        return [fit.threshold, fit.low, fit.high, fit.slope, fit.lapse, fit.trials]
    return [*[None] * 5, 0]


def _sheet(result: ThresholdResult) -> Sheet:
    """Return the threshold of each session, one row each."""
    head = ["participant", "session", f"threshold ({result.unit})", "low", "high", "slope", "lapses", "trials"]
    head += ["catch trials right", "enough of them", "known"]
    rows: list[list[str | float | None]] = []
    for one in result.subjects:
        caught = f"{one.catch_right} of {one.catch_trials}"
        kept = "yes" if one.kept else "no"
        rows.append([one.participant, one.session, *fitted_values(one.fit), caught, kept, one.known])
    if all(row[-1] is None for row in rows):
        head, rows = head[:-1], [row[:-1] for row in rows]
    return listed("blur_thresholds.csv", "Thresholds with 95 % intervals", head, rows)


def methods_thresholds(design: Mapping[str, Any]) -> Iterator[str]:
    """Yield the methods of measurement and fit for a paper, identical in preregistration and report."""
    unit = unit_of(design)
    question = "which of the two was more blurred" if design["judged"] == "blur" else "which of the two looked deeper"
    how = (
        f"the whole picture was defocused for a pupil of {design['pupil_mm']:g} mm"
        if design["judged"] == "blur"
        else "it was seen through a lens focused on the fixated object, by the depth of its scene"
    )
    yield (
        f"Each trial showed one scene in two intervals of {design['picture_s']:g} s and asked {question}; in one of "
        f"them {how}, by a level above the {design['pedestal']:g} {unit} of both. The level was chosen before each "
        f"trial by QUEST+ (Watson, 2017; questplus) from {design['level_steps']} between {design['least_level']:g} and "
        f"{design['most_level']:g} {unit}. {many(design['catch_trials'], 'catch trial')} showed the greatest level. "
        f"Participants with less than {ATTENDING:.0%} of them right are named; as a high threshold has the same effect "
        "as inattention, the mean is over all participants, and that without them is also reported."
    )
    yield (
        "Each participant’s answers were fitted by psignifit (Schütt, Harmeling, Macke & Wichmann, 2016): a Weibull "
        "function of the level that starts at one half, threshold log-uniform over the levels, "
        "slope log-uniform from 1 to 10, lapse rate beta (1, 66) up to 10 %, no overdispersion. Reported are "
        "the median of the posterior and its central 95 %. At threshold 75 % are right, without lapses. The mean is "
        f"geometric, its interval by Student’s t over participants. {BIAS}"
    )
