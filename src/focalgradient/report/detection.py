"""Section of the report on signal detection in the user's own table: d', criterion and confidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.errors import InputError
from focalgradient.plotting.detection import detection_figure
from focalgradient.report.choices import DETECTION
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.export import r_script, table_files
from focalgradient.report.parts import Output, Part
from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet, answer_tables
from focalgradient.statistics import NotComputed
from focalgradient.statistics.detection import (
    DetectionGroup,
    RatingRoc,
    detection_by_person,
    detection_outcomes,
    detection_questions,
    rating_roc,
    roc_area,
    type2_area,
)
from focalgradient.statistics.questions import Analysis, Answers
from focalgradient.statistics.wording import many
from focalgradient.user_tables.detection import OwnDetection

__all__ = ["DetectionPart"]

CAPTION = (
    "Left: each person’s rates (discs) and, where confidence was asked, ROC (thin); bold: the curve of equal variances "
    "with the mean d′. Right: each person’s d′ and the mean of all (disc), with 95 % intervals."
)


@dataclass(frozen=True, slots=True, eq=False)
class DetectionPart(Part):
    """Analysed detection data of the user's own table.

    Parameters
    ----------
    own
        Imported table.
    group
        d' and criterion of each person and condition, and their means.
    curves
        ROC of each person and condition, or the reason why there is none; empty without confidence ratings.
    areas
        Areas under the points of the ROC and under the type-2 ROC of each person and condition; empty without
        confidence ratings.
    left_out
        Persons and conditions without signal or without noise trials.
    simulated, data
        As in every section.
    """

    title: ClassVar[str] = "Signal detection"
    name: ClassVar[str] = "detection"
    choices: ClassVar[tuple[str, ...]] = DETECTION

    own: OwnDetection
    group: DetectionGroup
    curves: Mapping[tuple[str, str], RatingRoc | NotComputed]
    areas: Mapping[tuple[str, str], tuple[float, float]]
    left_out: tuple[tuple[str, str], ...]
    simulated: bool
    data: DataSet | None = None

    @classmethod
    def of(cls, own: OwnDetection) -> DetectionPart:
        """Compute d' for each person and condition, and the ROC curves of confidence.

        Raises
        ------
        InputError
            If nobody was shown both signal and noise in a condition.
        """
        table = own.table[~own.table["catch"]]
        shown = table.groupby(["participant_id", "condition"])["signal"].transform("mean")
        without = table[(shown == 0) | (shown == 1)][["participant_id", "condition"]].drop_duplicates()
        kept = table[(shown > 0) & (shown < 1)]
        if kept.empty:
            raise InputError(
                "Nobody was shown both signal and noise in one condition: give each person trials with signal and "
                "trials without."
            )
        curves, areas = {}, {}
        for (person, condition), rows in kept.groupby(["participant_id", "condition"]) if own.steps else ():
            who = str(person), str(condition)
            counts = [_counts(rows[rows["signal"] == there], own.steps) for there in (True, False)]
            curves[who], areas[who] = rating_roc(*counts), (roc_area(*counts), type2_area(*counts))
        simulated = bool((own.table["kind"] == "simulated").any())
        left_out = tuple(map(tuple, without.astype(str).to_numpy().tolist()))
        return cls(own, detection_by_person(kept), curves, areas, left_out, simulated)

    @property
    def questions(self) -> Analysis:
        """Questions about detection."""
        return detection_questions([*self.group.d_prime], confidence=bool(self.own.steps))

    def answers(self) -> Answers:
        return self.questions.answers(detection_outcomes(self.group, self.curves, self.areas))

    def findings(self, output: Output) -> Iterator[Block]:
        table, group = self.own.table, self.group
        people = len({name for name, _ in group.people})
        several = f" in {len(group.d_prime)} conditions" if len(group.d_prime) > 1 else ""
        asked = f", with confidence in {self.own.steps} steps" if self.own.steps else ""
        yield Paragraph(
            f"Answers of yes and no by {many(people, 'person').replace('persons', 'people')}{several}: "
            f"{many(len(table), 'trial')}{asked}."
        )
        for person, condition in self.left_out:
            where = f" in {condition}" if condition else ""
            yield Notice(f"{person} was left out{where}: there must be trials with signal and trials without.")
        yield from self.said(self.answers())
        missing = {(place, one.reason) for (_, place), one in self.curves.items() if isinstance(one, NotComputed)}
        for place, reason in sorted(missing):
            yield Notice(f"{place}: of some people there is no estimate: {reason}".removeprefix(": "))
        known = {who: one for who, one in self.curves.items() if isinstance(one, RatingRoc)}
        yield output.figure("detection", detection_figure(group, known, simulated=self.simulated), CAPTION)
        yield from answer_tables(self.answers(), "Means over people, and differences of d′ between conditions")
        yield from output.tables([self._sheet()])

    def _sheet(self) -> Sheet:
        rows: list[list[Any]] = []
        for who, one in self.group.people.items():
            ends = [end for found in (one.d_prime, one.criterion) for end in (found.estimate, found.low, found.high)]
            rows.append([*who, one.hit_rate, one.false_alarm_rate, *ends])
            if self.own.steps:
                (area, type2), curve = self.areas[who], self.curves[who]
                fitted = [curve.d_a.estimate, curve.sd_ratio.estimate] if isinstance(curve, RatingRoc) else [None] * 2
                rows[-1] += [area, *fitted, type2]
        head = ["participant", "condition", "hit rate", "false-alarm rate", "d′", "low", "high", "c", "low c", "high c"]
        head += ["area", "d_a", "SD ratio", "type-2 area"] if self.own.steps else []
        return listed("detection.csv", "Each person’s d′ and criterion with 95 % intervals", head, rows)

    def methods(self, output: Output) -> Iterator[Block]:
        yield Paragraph(self.questions.method)

    def exports(self) -> Mapping[str, bytes]:
        return table_files(f"{self.name}_trials", self.own.table) | {
            "detection.R": r_script("detection", self.answers())
        }


def _counts(rows: pd.DataFrame, steps: int) -> list[int]:
    """Return answer counts from the most confident "no" to the most confident "yes"."""
    sure = rows["confidence"].to_numpy(int)
    place = np.where(rows["answer"].to_numpy(bool), steps - 1 + sure, steps - sure)
    return [int(each) for each in np.bincount(place, minlength=2 * steps)]
