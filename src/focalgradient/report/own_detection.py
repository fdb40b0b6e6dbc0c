"""Section of the report on signal detection in the user's own table: d', criterion and confidence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

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
from focalgradient.report.tables import Sheet
from focalgradient.statistics import Effect, Interval, NotComputed
from focalgradient.statistics.detection import (
    DetectionGroup,
    RatingRoc,
    detection_by_person,
    rating_roc,
    roc_area,
    type2_area,
)
from focalgradient.statistics.means import family, t_interval
from focalgradient.statistics.own_detection import OwnDetection
from focalgradient.statistics.questions import Answer, less, stated
from focalgradient.statistics.wording import many, number, p_is

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
    areas, type2_areas
        Area under the points of the ROC, and under the type-2 ROC, of each person and condition; empty without
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
    areas: Mapping[tuple[str, str], float]
    type2_areas: Mapping[tuple[str, str], float]
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
        curves, areas, type2_areas = {}, {}, {}
        for (person, condition), rows in kept.groupby(["participant_id", "condition"]) if own.steps else ():
            signal, noise = (_counts(rows[rows["signal"] == there], own.steps) for there in (True, False))
            curves[str(person), str(condition)] = rating_roc(signal, noise)
            areas[str(person), str(condition)] = roc_area(signal, noise)
            type2_areas[str(person), str(condition)] = type2_area(signal, noise)
        simulated = bool((own.table["kind"] == "simulated").any())
        left_out = tuple(map(tuple, without.astype(str).to_numpy().tolist()))
        return cls(own, detection_by_person(kept), curves, areas, type2_areas, left_out, simulated)

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
        for condition in group.d_prime:
            where = f"{condition}: " if condition else ""
            yield Paragraph(
                f"{where}mean d′ {_ends(group.d_prime[condition])}, criterion c {_ends(group.criterion[condition])} "
                "(above 0: a tendency to “no”)."
            )
        first, tests = next(iter(group.d_prime)), family(group.differences.values())
        for condition, test in zip(group.differences, tests, strict=True):
            if isinstance(test, Effect):
                corrected = " by Holm" if len(tests) > 1 else ""
                yield Paragraph(
                    f"d′ in {condition} less that in {first}: {number(test.estimate)} (95 % interval "
                    f"{number(test.low)} to {number(test.high)}), t({test.df:g}) = {number(test.statistic)}, p"
                    f"{corrected} {p_is(test.corrected_p)}."
                )
            else:
                yield Notice(f"{condition} and {first} were not compared: {test.reason}")
        yield from self._confidence()
        known = {who: one for who, one in self.curves.items() if isinstance(one, RatingRoc)}
        yield output.figure("detection", detection_figure(group, known, simulated=self.simulated), CAPTION)
        yield from output.tables([self._each()])

    def _confidence(self) -> Iterator[Block]:
        """Yield means over people of the confidence measures, by condition."""
        for condition in self.group.d_prime if self.own.steps else ():
            where = f"{condition}: " if condition else ""
            said = [f"{what} {_ends(mean)}" for what, mean in self._measures(condition).items()]
            if said:
                yield Paragraph(f"{where}confidence, means over people: {'; '.join(said)}.")
            reasons = {
                one.reason
                for (_, place), one in self.curves.items()
                if place == condition and isinstance(one, NotComputed)
            }
            yield from (Notice(f"{where}of some people there is no estimate: {reason}") for reason in sorted(reasons))

    def _measures(self, condition: str) -> dict[str, Interval]:
        """Return means over people of the confidence measures."""
        curves = [one for (_, at), one in self.curves.items() if at == condition and isinstance(one, RatingRoc)]
        areas = [area for (_, at), area in self.areas.items() if at == condition]
        found = {"area under the ROC": t_interval(areas)} if areas else {}
        if curves:
            found["d_a (unequal variances)"] = t_interval([one.d_a.estimate for one in curves])
            ratios = [one.sd_ratio.estimate for one in curves]
            found["SD of signal over noise"] = t_interval(np.log(ratios)).ratio
        if areas:
            type2 = [area for (_, at), area in self.type2_areas.items() if at == condition]
            found["area under the type-2 curve"] = t_interval(type2)
        return found

    def answers(self) -> Iterator[Answer]:
        for condition in self.group.d_prime:
            count = sum(at == condition for _, at in self.group.people)
            for what, mean in self._all_means(condition).items():
                head = f"mean {what}" + (f", {condition}" if condition else "")
                yield stated(f"mean {what}", condition, mean, "main", n=count, headline=head)
        first = next(iter(self.group.d_prime))
        for condition, test in zip(self.group.differences, family(self.group.differences.values()), strict=True):
            yield stated("difference of d′", less(condition, first), test, "main")
        for (person, condition), one in self.group.people.items():
            level = ", ".join(filter(None, [person, condition]))
            for what, outcome in (("d′", one.d_prime), ("criterion c", one.criterion)):
                yield stated(what, level, outcome, "description", n=1)

    def _all_means(self, condition: str) -> dict[str, Interval]:
        found = {"d′": self.group.d_prime[condition], "criterion c": self.group.criterion[condition]}
        return found | self._measures(condition)

    def _each(self) -> Sheet:
        head = ["participant", "condition", "hit rate", "false-alarm rate", "d′", "low", "high", "c", "low c", "high c"]
        asked = ["area", "d_a", "SD ratio", "type-2 area"] if self.own.steps else []
        rows = []
        for (person, condition), one in self.group.people.items():
            values = [one.hit_rate, one.false_alarm_rate, *_three(one.d_prime), *_three(one.criterion)]
            if asked:
                curve = self.curves[person, condition]
                values += [self.areas[person, condition], *_of_curve(curve), self.type2_areas[person, condition]]
            rows.append([person, condition, *values])
        return listed("detection.csv", "Each person’s d′ and criterion with 95 % intervals", head + asked, rows)

    def methods(self, output: Output) -> Iterator[Block]:
        yield Paragraph(
            "Sensitivity d′ and criterion c of each person and condition follow from the rates of hits and false "
            "alarms, half a trial added to each count (log-linear correction: Hautus, 1995); their intervals are "
            "normal (Gourevitch and Galanter, 1967). Means are over people, with intervals by Student’s t; conditions "
            "were compared with the first by paired t-tests, corrected by Holm’s method. Catch trials do not count."
        )
        if self.own.steps:
            yield Paragraph(
                "Answers with their confidence, from the surest “no” to the surest “yes”, give the ROC: the area "
                "under its points, and the normal model of unequal variances by maximum likelihood (Dorfman and Alf, "
                "1969) of each person. The area under the type-2 curve is the probability that a right answer is given "
                "with more confidence than a wrong one. The mean of the ratio of SDs is geometric."
            )

    def exports(self) -> Mapping[str, bytes]:
        return table_files(f"{self.name}_trials", self.own.table) | {"detection.R": r_script("detection")}


def _counts(rows: pd.DataFrame, steps: int) -> list[int]:
    """Return answer counts from the most confident "no" to the most confident "yes"."""
    sure = rows["confidence"].to_numpy(int)
    place = np.where(rows["answer"].to_numpy(bool), steps - 1 + sure, steps - sure)
    return [int(each) for each in np.bincount(place, minlength=2 * steps)]


def _ends(found: Interval) -> str:
    if found.low is None or found.high is None:
        return number(found.estimate)
    return f"{number(found.estimate)} (95 % interval {number(found.low)} to {number(found.high)})"


def _of_curve(curve: RatingRoc | NotComputed) -> list[float | None]:
    if not isinstance(curve, RatingRoc):
        return [None] * 2
    return [curve.d_a.estimate, curve.sd_ratio.estimate]


def _three(found: Interval) -> list[float | None]:
    return [found.estimate, found.low, found.high]
