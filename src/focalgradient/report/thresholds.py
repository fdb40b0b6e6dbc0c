"""Section of the report on thresholds: functions of each person, means, and conditions."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from focalgradient.dataset import DataSet, read_dataset
from focalgradient.errors import InputError
from focalgradient.plotting.thresholds import person_figure, threshold_figure
from focalgradient.report.choices import THRESHOLDS
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.exclusions import WITHOUT
from focalgradient.report.export import r_script, table_files
from focalgradient.report.parts import Asked, Output, Part
from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet, answer_tables
from focalgradient.statistics import (
    Interval,
    NotComputed,
    SubjectThreshold,
    ThresholdFit,
    ThresholdResult,
    blur_thresholds,
)
from focalgradient.statistics.questions import Analysis, Answers
from focalgradient.statistics.thresholds import ATTENDING, attending, threshold_questions
from focalgradient.statistics.wording import many, number, with_interval
from focalgradient.user_tables.thresholds import OwnThresholds

__all__ = ["ThresholdPart", "methods_thresholds", "unit_of"]

GROUPS = (
    "Left: each person’s function, with the share of right answers at each level (disc: larger for more trials). "
    "Right: thresholds with 95 % intervals, those of the table; geometric means bold."
)
MISSED = " Dotted and open: too few catch trials right."
PEOPLE = "Each person’s share of right answers at each level (disc: larger for more trials) and function."


@dataclass(frozen=True, slots=True, eq=False)
class ThresholdPart(Part):
    """Analysed threshold experiment, or threshold data of the user's own table.

    Parameters
    ----------
    table
        All trials.
    results
        Thresholds of each person, by condition.
    unit, guess
        Unit of the levels, and guess rate.
    simulated, data
        As in every section.
    design
        Design settings of the first session, as recorded; empty for a table.
    """

    table: pd.DataFrame
    results: Mapping[str, ThresholdResult]
    unit: str
    guess: float
    simulated: bool
    data: DataSet | None
    design: Mapping[str, Any]

    @classmethod
    def of(cls, own: OwnThresholds) -> ThresholdPart:
        """Fit each person of a table in each condition."""
        table = own.table
        least, most = float(table["level"].min()), float(table["level"].max())
        results = {
            str(name): blur_thresholds(rows, least=least, most=most, unit=own.unit, guess=own.guess)
            for name, rows in table.groupby("condition", sort=True)
        }
        return cls(table, results, own.unit, own.guess, bool((table["kind"] == "simulated").any()), None, {})

    @classmethod
    def of_dataset(cls, root: str | os.PathLike[str], asked: Asked | None = None) -> ThresholdPart:
        """Read and fit all sessions of a data set; damaged ones are excluded and named in `data`.

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
        least, most = float(first["least_level"]), float(first["most_level"])
        result = blur_thresholds(table, least=least, most=most, unit=unit_of(first), known=known)
        return cls(table, {"": result}, result.unit, 0.5, data.simulated, data, first)

    @property
    def title(self) -> str:
        return "Blur thresholds" if self.design else "Thresholds"

    @property
    def name(self) -> str:
        return "blur_threshold" if self.design else "threshold"

    @property
    def choices(self) -> tuple[str, ...]:
        return THRESHOLDS

    @property
    def levels(self) -> tuple[float, float]:
        """Least and greatest level, of the design or in the table."""
        if self.design:
            return float(self.design["least_level"]), float(self.design["most_level"])
        return float(self.table["level"].min()), float(self.table["level"].max())

    @property
    def questions(self) -> Analysis:
        """Questions about thresholds."""
        return threshold_questions(self.unit, self.results, self.guess)

    def answers(self) -> Answers:
        everyone = self.questions.answers(self.results)
        if not self.design:
            return everyone
        main = self.questions.answers(attending(self.results)[0]).of_roles("main")
        return Answers((*main, *everyone.of_roles("description"), *everyone.variant(WITHOUT)))

    def findings(self, output: Output) -> Iterator[Block]:
        ends = " to ".join(f"{number(level)} {self.unit}".strip() for level in self.levels)
        people, who = self.table["participant_id"].nunique(), "simulated observer" if self.simulated else "person"
        several = f" in {len(self.results)} conditions" if len(self.results) > 1 else ""
        yield Paragraph(
            f"Thresholds of {many(people, who).replace('persons', 'people')}{several}, of "
            f"{many(len(self.table), 'trial')} at levels from {ends}."
        )
        sessions = [(name, one) for name, result in self.results.items() for one in result.subjects]
        for name, one in sessions:
            yield from self._notices(" ".join(filter(None, [one.participant, one.session, name])), one, ends)
        answers = self.questions.answers(self.results)
        yield from self.said(answers)
        if self.design:
            yield self._attending()
        if any(isinstance(one.fit, ThresholdFit) for _, one in sessions):
            level = None if self.design else f"level ({self.unit})" if self.unit else "level"
            caption = GROUPS + MISSED * any(not one.kept for _, one in sessions)
            name = "blur_thresholds" if self.design else "thresholds"
            yield output.figure(name, threshold_figure(self.results, simulated=self.simulated, level=level), caption)
            drawn = person_figure(self.results, simulated=self.simulated, level=level)
            yield output.figure("threshold_people", drawn, PEOPLE)
        if len(self.results) > 1:
            yield from answer_tables(answers, "Geometric mean thresholds, and their ratios between conditions")
        yield from output.tables([self._sheet()])

    def _notices(self, who: str, one: SubjectThreshold, ends: str) -> Iterator[Block]:
        least, most = self.levels
        if isinstance(one.fit, NotComputed):
            yield Notice(f"{who}: {one.fit.reason}")
        elif one.fit.low < 1.1 * least or one.fit.high > most / 1.1:
            yield Notice(
                f"{who}: the interval reaches the end of the levels, which go from {ends}: the threshold may lie "
                "beyond."
            )
        if not one.kept:
            yield Notice(
                f"{who} was right in {one.catch_right} of {one.catch_trials} catch trials, fewer than {ATTENDING:.0%}: "
                "by inattention, or because the threshold is high."
            )

    def _attending(self) -> Paragraph:
        """Return the mean without those who missed catch trials."""
        (result,) = self.results.values()
        if all(one.kept for one in result.subjects):
            return Paragraph("None missed the catch trials: the mean with exclusions is the same.")
        if not isinstance(result.mean_attending, Interval):
            return Paragraph("All missed the catch trials: there is no mean with exclusions.")
        return Paragraph(
            f"Without the {sum(not one.kept for one in result.subjects)} who missed catch trials: "
            f"{with_interval(result.mean_attending, self.unit)}. People with a high threshold miss them as well: this "
            "mean is too low if thresholds reach the greatest level."
        )

    def _sheet(self) -> Sheet:
        """Return the threshold of each session; columns about catch trials and truth where there are any."""
        unit, design = f" ({self.unit})" if self.unit else "", bool(self.design)
        rows = []
        for name, result in self.results.items():
            for one in result.subjects:
                fit = one.fit if isinstance(one.fit, ThresholdFit) else None
                row: dict[str, Any] = {"participant": one.participant, "session": one.session}
                row |= {} if design else {"condition": name}
                row["threshold" + unit * design] = None if fit is None else fit.threshold
                row |= {key: getattr(fit, key, None) for key in ("low", "high", "slope")}
                row |= {"lapses": getattr(fit, "lapse", None), "trials": 0 if fit is None else fit.trials}
                if one.catch_trials:
                    row["catch trials right"] = f"{one.catch_right} of {one.catch_trials}"
                    row["enough of them"] = "yes" if one.kept else "no"
                rows.append(row if one.known is None else row | {"known": one.known})
        file = "blur_thresholds.csv" if design else "thresholds.csv"
        head = list(dict.fromkeys(name for row in rows for name in row))
        cells = [[row.get(name) for name in head] for row in rows]
        return listed(file, f"Each person’s threshold{unit} with its 95 % interval", head, cells)

    def methods(self, output: Output) -> Iterator[Block]:
        yield from map(Paragraph, methods_thresholds(self.design) if self.design else [self.questions.method])
        yield from output.tables(self.design_table())

    def exports(self) -> Mapping[str, bytes]:
        script = {"thresholds.R": r_script("thresholds", self.answers())}
        return table_files(f"{self.name}_trials", self.table) | script


def unit_of(design: Mapping[str, Any]) -> str:
    """Return the unit of a design's levels.

    >>> unit_of({"judged": "blur"}), unit_of({"judged": "depth"})
    ('D', 'mm')
    """
    return "D" if design["judged"] == "blur" else "mm"


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
    yield threshold_questions(unit).method
