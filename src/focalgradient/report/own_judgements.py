"""Sections of the report on cue combination and on difference scales, for the user's own tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from focalgradient.dataset import DataSet
from focalgradient.plotting.difference_scales import difference_scale_figure
from focalgradient.progress import Progress
from focalgradient.report.choices import CUES, DIFFERENCES
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.export import reader, safe_csv
from focalgradient.report.parts import Output, Part
from focalgradient.report.provenance import listed
from focalgradient.report.tables import decimals, many, number, probability, sheet
from focalgradient.report.words import p_is
from focalgradient.statistics import (
    CueCombination,
    DifferenceScale,
    NotComputed,
    fit_cue_combination,
    fit_difference_scale,
)
from focalgradient.statistics.own_judgements import STIMULI, OwnJudgements

__all__ = ["CuePart", "DifferencePart"]

BOOTSTRAP = 500
"""Number of bootstrap samples for the interval of a scale, whose ends are the 13th values, and for its test."""

CAPTION = "Each person’s difference scale in standard deviations of a judgement, with 95 % intervals."


@dataclass(frozen=True, slots=True, eq=False)
class _Judgements(Part):
    """Section on judgements of a table; `simulated` and `data` are as in every section."""

    own: OwnJudgements
    simulated: bool
    data: DataSet | None

    @property
    def people(self) -> str:
        """Number of people and trials in words."""
        table = self.own.table
        people = many(table["participant_id"].nunique(), "person").replace("persons", "people")
        return f"{many(len(table), 'judgement')} by {people}"

    def exports(self) -> Mapping[str, bytes]:
        file = f"{self.name}_trials.csv"
        return {file: safe_csv(self.own.table), f"read_{file.removesuffix('.csv')}.R": reader(file, self.own.table)}


def _simulated(own: OwnJudgements) -> bool:
    return bool((own.table["kind"] == "simulated").any())


@dataclass(frozen=True, slots=True, eq=False)
class CuePart(_Judgements):
    """Section on judgements by two cues: `found` is the comparison of combination rules, or a reason without it."""

    found: CueCombination | NotComputed

    @classmethod
    def of(cls, own: OwnJudgements) -> CuePart:
        """Fit each combination rule to all people."""
        table = own.table
        found = fit_cue_combination(table["first"], table["second"], table["larger"], table["participant_id"])
        return cls(own, _simulated(own), None, found)

    @property
    def title(self) -> str:
        return "Cue combination"

    @property
    def name(self) -> str:
        return "cues"

    @property
    def choices(self) -> tuple[str, ...]:
        return CUES

    def findings(self, output: Output) -> Iterator[Block]:
        found = self.found
        if isinstance(found, NotComputed):
            yield Notice(found.reason)
            return
        best = found.models[0]
        verb = "rejects" if found.p_optimal < 0.05 else "does not reject"
        yield Paragraph(
            f"{self.people}: of the rules of combination “{best.name}” has the least AIC (weight "
            f"{number(best.weight)}). The test of optimal combination {verb} it (p {p_is(found.p_optimal)})."
        )
        head = ["rule", "log likelihood", "parameters", "AIC", "BIC", "weight", "Bayes factor over optimal"]
        values = [
            (one.name, one.log_likelihood, one.parameters, one.aic, one.bic, one.weight, one.bayes_factor)
            for one in found.models
        ]
        rows = [
            [name, decimals(fit, 1), str(free), decimals(aic, 1), decimals(bic, 1), number(weight), number(factor)]
            for name, fit, free, aic, bic, weight, factor in values
        ]
        names = ["SD first", "SD second", "SD both", "SD predicted", "weight", "weight predicted"]
        measured = [
            [
                *((each.sd, each.sd_se) for each in (one.first, one.second, one.combined, one.predicted.combined)),
                (one.weight, one.weight_se),
                (one.predicted.weights[0], one.predicted.weight_ses[0]),
            ]
            for one in found.people
        ]
        who = [one.participant_id for one in found.people]
        people = [[name, *(_with_error(*pair) for pair in own)] for name, own in zip(who, measured, strict=True)]
        digits = [[name, *(v for pair in own for v in pair)] for name, own in zip(who, measured, strict=True)]
        columns = ["participant", *(each for name in names for each in (name, f"{name} SE"))]
        yield from output.tables(
            [
                sheet("cues_rules.csv", "Rules of combination", head, rows, _records(head, values)),
                sheet(
                    "cues_people.csv",
                    "Each person, with standard errors",
                    ["participant", *names],
                    people,
                    _records(columns, digits),
                ),
            ]
        )

    def methods(self, output: Output) -> Iterator[Block]:
        yield Paragraph(
            "Each rule of combination was fitted to the judgements by single and by both cues in one likelihood of "
            "cumulative normal functions, 2 % of answers counting as given without looking. Optimal combination weighs "
            "the cues in inverse proportion to their variances; it was tested against weights and standard deviations "
            "of each person’s own by the likelihood ratio with Bartlett’s correction, whose factor is from judgements "
            "simulated by the fitted optimal rule."
        )


@dataclass(frozen=True, slots=True, eq=False)
class DifferencePart(_Judgements):
    """Section on comparisons of differences: each person's scale over the `stimuli`, or a reason without it."""

    scales: Mapping[str, DifferenceScale | NotComputed]
    stimuli: tuple[float, ...]

    @classmethod
    def of(cls, own: OwnJudgements, progress: Progress | None = None) -> DifferencePart:
        """Fit a scale to the judgements of each person."""
        table = own.table
        shown = [name for name in STIMULI if name in table]
        stimuli = np.unique(table[shown].to_numpy())
        scales, people = {}, list(table.groupby("participant_id"))
        for count, (person, rows) in enumerate(people):
            if progress is not None:
                progress(count / len(people), "difference scales")
            ranks = np.searchsorted(stimuli, rows[shown].to_numpy())
            scales[str(person)] = fit_difference_scale(ranks, rows["larger"].to_numpy(), bootstrap=BOOTSTRAP)
        return cls(own, _simulated(own), None, scales, tuple(stimuli.tolist()))

    @property
    def title(self) -> str:
        return "Difference scales"

    @property
    def name(self) -> str:
        return "differences"

    @property
    def choices(self) -> tuple[str, ...]:
        return DIFFERENCES

    def findings(self, output: Output) -> Iterator[Block]:
        yield Paragraph(f"{self.people}, of {many(len(self.stimuli), 'stimulus').replace('stimuluss', 'stimuli')}.")
        fitted = {name: one for name, one in self.scales.items() if isinstance(one, DifferenceScale)}
        for name, one in self.scales.items():
            if isinstance(one, NotComputed):
                yield Notice(f"{name}: {one.reason}")
            elif one.six_point_p < 0.05:
                yield Notice(
                    f"{name}: the judgements violate the six-point condition more often than a scale allows (p "
                    f"{p_is(one.six_point_p)})."
                )
        if not fitted:
            return
        figure = difference_scale_figure(
            self.stimuli,
            {name: one for name, one in fitted.items() if len(one.values) == len(self.stimuli)},
            simulated=self.simulated,
        )
        yield output.figure("differences", figure, CAPTION)
        head = ["participant", "stimulus", "value", "low", "high", "from 0 to 1"]
        rows = [
            [name, at, value, low, high, part]
            for name, one in fitted.items()
            for at, value, low, high, part in zip(
                self.stimuli, one.values, one.low, one.high, one.normalised, strict=False
            )
        ]
        digits = [
            (name, one.sigma, one.log_likelihood, one.trials, one.explained, one.six_point_p)
            for name, one in fitted.items()
        ]
        people = [
            [
                *(name, number(sigma), decimals(likelihood, 1), str(trials), number(explained)),
                number(None) if math.isnan(p) else probability(p),
            ]
            for name, sigma, likelihood, trials, explained, p in digits
        ]
        head_people = ["participant", "noise", "log likelihood", "trials", "explained", "p of the six-point test"]
        yield from output.tables(
            [
                listed("differences_scales.csv", "Difference scales", head, rows),
                sheet(
                    "differences_people.csv", "Fit of each scale", head_people, people, _records(head_people, digits)
                ),
            ]
        )

    def methods(self, output: Output) -> Iterator[Block]:
        yield Paragraph(
            "Difference scales were estimated by maximum likelihood (Maloney and Yang, 2003) in the form of a "
            "generalised linear model (Knoblauch and Maloney, 2008). Values are in standard deviations of a judgement; "
            f"intervals are bias-corrected, of {BOOTSTRAP} simulated repetitions, which also give the probability of "
            "the six-point test."
        )


def _records(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[dict[str, Any]]:
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _with_error(value: float, error: float) -> str:
    return number(None) if math.isnan(value) else f"{number(value)} ± {number(error, 2)}"
