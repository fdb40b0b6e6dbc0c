"""Result records as tables to read: an effect with its interval and test; what was not done says why below."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import pandas as pd

from focalgradient.report.document import Table
from focalgradient.statistics import (
    DepthRatingResult,
    DurationFit,
    Effect,
    Equivalence,
    Interval,
    NeckerResult,
    NotComputed,
    Quality,
    Trend,
    as_table,
)

__all__ = ["SPACE", "Sheet", "interval", "necker_sheets", "number", "probability", "quality_sheets", "rating_sheets"]

NONE = "–"

SPACE = "\N{NO-BREAK SPACE}"


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """A table to read, and the same with all its digits for a file; `table` is None where there is only the file."""

    file: str
    table: Table | None
    digits: pd.DataFrame


def number(value: float | None, digits: int = 3) -> str:
    """A number to so many significant digits.

    >>> number(0.12345), number(1234.5), number(None)
    ('0.123', '1230', '–')
    """
    if value is None or not math.isfinite(value):
        return NONE
    if value == 0:
        return "0"
    text = f"{value:#.{digits}g}"
    return (f"{float(text):.0f}" if "e" in text else text).rstrip(".").replace("-", "−")


def probability(p: float | None) -> str:
    r"""A probability as papers write it.

    >>> probability(0.00004), probability(0.0312), probability(1.0)
    ('<\xa0.001', '.031', '1.000')
    """
    if p is None:
        return NONE
    return f"<{SPACE}.001" if p < 0.001 else f"{p:.3f}".removeprefix("0")


def interval(low: float | None, high: float | None) -> str:
    """Ends in brackets."""
    return NONE if low is None or high is None else f"[{number(low)},{SPACE}{number(high)}]"


class _Cells:
    """Cells of the rows of one table; what was not done is a dash, and its reason is kept to be noted below."""

    def __init__(self) -> None:
        self.notes: dict[str, None] = {}

    def missing(self, result: NotComputed, cells: int) -> list[str]:
        self.notes[f"{NONE}: {result.reason}"] = None
        return [NONE] * cells

    def interval(self, result: Interval | NotComputed, factor: float = 1.0) -> list[str]:
        """Estimate and interval."""
        if isinstance(result, NotComputed):
            return self.missing(result, 2)
        low, high = (None if end is None else factor * end for end in (result.low, result.high))
        return [number(factor * result.estimate), interval(low, high)]

    def effect(self, result: Effect | NotComputed, factor: float = 1.0, *, odds: bool = False) -> list[str]:
        """Estimate, interval, test, p and p by Holm."""
        if isinstance(result, NotComputed):
            return self.missing(result, 5)
        self.notes.update(dict.fromkeys(result.remarks))
        ends = (factor * result.estimate, factor * result.low, factor * result.high)
        told, low, high = map(math.exp, ends) if odds else ends
        return [number(told), interval(low, high), *self.test(result)]

    def test(self, result: Effect | NotComputed) -> list[str]:
        """Test, p and p by Holm."""
        if isinstance(result, NotComputed):
            return self.missing(result, 3)
        statistic = f"t({result.df:g}){SPACE}={SPACE}{number(result.statistic)}"
        return [statistic, probability(result.p), probability(result.p_holm)]


def quality_sheets(found: Quality, name: str) -> list[Sheet]:
    """How good the data are, and what was left out."""
    left = {one.participant_id for one in found.exclusions if one.whole_subject}
    rows = [
        [
            one.participant_id,
            str(one.trials),
            NONE if one.catch_passed is None else f"{one.catch_passed:.0%} of {one.catch_trials}",
            number(one.repeat_factor),
            NONE if one.lapses is None else f"{one.lapses:.1%}",
            f"{one.too_fast} / {one.too_slow}",
            NONE if one.dropped is None else str(one.dropped),
            "no" if one.participant_id in left else "yes",
        ]
        for one in found.subjects
    ]
    header = ["subject", "trials", "catch trials passed", "spread of repeats (factor)", "lapses", "too fast / slow"]
    sheets = [
        _sheet(
            f"{name}_quality.csv",
            "Quality of each subject’s data, before exclusions",
            [*header, "trials with dropped frames", "in the analysis"],
            rows,
            found.subjects,
        )
    ]
    if found.exclusions:
        rows = [
            [one.participant_id, one.rule, "all" if one.whole_subject else str(one.trials)] for one in found.exclusions
        ]
        header = ["subject", "rule", "trials left out"]
        sheets.append(_sheet(f"{name}_exclusions.csv", "Exclusions", header, rows, found.exclusions))
    return sheets


def rating_sheets(result: DepthRatingResult) -> list[Sheet]:
    """Tables of experiment 1."""
    sheets = [Sheet("depth_rating_subjects.csv", None, as_table(result.subject_means))]
    if result.scale == "ratio":
        cells = _Cells()
        rows = [
            [
                mean.fixation,
                mean.aperture,
                number(mean.aperture_mm),
                str(mean.subjects),
                *cells.interval(mean.rating),
                *cells.interval(mean.ratio),
                *(cells.test(mean.against_pinhole) if mean.aperture_mm else [NONE] * 3),
                number(mean.against_pinhole.dz) if isinstance(mean.against_pinhole, Effect) else NONE,
            ]
            for mean in result.means
        ]
        header = ["in focus", "aperture", "mm", "N", "rating", "95 % within subjects", "ratio to pinhole", "95 % (BCa)"]
        header += ["test of the ratio", "p", "p (Holm)", "d_z"]
        caption = "Ratings and their ratio to the pinhole: geometric means over subjects"
        sheets.append(_sheet("depth_rating_means.csv", caption, header, rows, result.means, cells))
        sheets.append(_slopes(result))
    sheets += (
        [_trends(result), _equivalence(result)] if result.scale == "ratio" else [_trends(result), _ordinal(result)]
    )
    return sheets


def _slopes(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    tests: list[tuple[str, str, Effect | NotComputed]] = []
    for each in result.fixations:
        tests += [(each.fixation, "mixed model", each.slope), (each.fixation, "two stages", each.two_stage)]
    tests.append(("nearest − farthest", "two stages", result.interaction))
    rows, digits = [], []
    for fixation, model, test in tests:
        dz = number(test.dz) if isinstance(test, Effect) else NONE
        rises = [NONE, NONE]
        if isinstance(test, Effect):
            ends = (math.exp(result.largest_mm * end) for end in (test.estimate, test.low, test.high))
            rise, low, high = ends
            rises = [number(rise), interval(low, high)]
        rows.append([fixation, model, *cells.effect(test), dz, *rises])
        digits.append({"fixation": fixation, "model": model} | as_table([test]).iloc[0].to_dict())
    header = ["in focus", "model", "slope (log ratio / mm)", "95 %", "test", "p", "p (Holm)", "d_z"]
    header += [f"rise at {result.largest_mm:.3g} mm (ratio)", "95 %"]
    caption = "Change of the ratings with blur; Holm’s correction is over the mixed models’ slopes and their difference"
    return _sheet("depth_rating_slopes.csv", caption, header, rows, digits, cells)


def _trends(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    rows = []
    for each in result.fixations:
        if isinstance(each.trend, Trend):
            page = [number(each.trend.statistic, 5), probability(each.trend.p)]
            rows.append([each.fixation, *page, *cells.effect(each.trend.over_subjects)[:4]])
        else:
            rows.append([each.fixation, *cells.missing(each.trend, 6)])
    header = ["in focus", "Page’s L", "p (one-sided)", "mean rank correlation over subjects", "95 %", "test", "p"]
    digits = [{"fixation": each.fixation} | as_table([each.trend]).iloc[0].to_dict() for each in result.fixations]
    return _sheet(
        "depth_rating_trend.csv", "Whether ratings rise in the order of apertures", header, rows, digits, cells
    )


def _equivalence(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    rows = []
    for each in result.fixations:
        test = each.equivalence
        if isinstance(test, Equivalence):
            bound, rise = math.exp(test.bound), math.exp(test.estimate)
            ends = interval(math.exp(test.low), math.exp(test.high))
            told = [f"{1 / bound:.3g} ... {bound:.3g}", number(rise), ends]
            ps = [probability(p) for p in (test.p_below, test.p_above, test.p)]
            rows.append([each.fixation, *told, *ps, "yes" if test.equivalent else "not shown"])
        else:
            rows.append([each.fixation, *cells.missing(test, 7)])
    header = ["in focus", "bounds", "rise at the largest aperture", "90 %", "p against less", "p against more", "p"]
    digits = [{"fixation": each.fixation} | as_table([each.equivalence]).iloc[0].to_dict() for each in result.fixations]
    caption = "Whether the rise is as good as none (two one-sided tests)"
    return _sheet("depth_rating_equivalence.csv", caption, [*header, "equivalent to none"], rows, digits, cells)


def _ordinal(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    rows = [[each.fixation, *cells.effect(each.ordinal)[:4]] for each in result.fixations]
    header = ["in focus", "slope (log odds of a higher answer / mm)", "95 %", "test", "p"]
    digits = [{"fixation": each.fixation} | as_table([each.ordinal]).iloc[0].to_dict() for each in result.fixations]
    return _sheet("depth_rating_ordinal.csv", "Cumulative-link mixed model", header, rows, digits, cells)


def necker_sheets(result: NeckerResult) -> list[Sheet]:
    """Tables of experiment 2."""
    cells = _Cells()
    rows = []
    for share in result.shares:
        reports = [NONE, NONE] if share.percept == "none" else cells.interval(share.reports, 100)
        told = [share.gradient, number(share.strength), share.percept]
        rows.append([*told, *cells.interval(share.time, 100), *reports])
    header = [
        "blur agrees with",
        "mm",
        "percept",
        "share of time (%)",
        "95 % (BCa)",
        "share of reports (%)",
        "95 % (BCa)",
    ]
    sheets = [
        Sheet("necker_subjects.csv", None, as_table(result.subject_shares)),
        _sheet("necker_shares.csv", "What was seen, means over subjects", header, rows, result.shares, cells),
    ]
    cells = _Cells()
    rows = []
    for effect in result.effects:
        told = [effect.gradient, number(effect.strength)]
        dz = number(effect.share.dz) if isinstance(effect.share, Effect) else NONE
        change = [*cells.effect(effect.share, 100), dz, probability(effect.wilcoxon_p)]
        rows.append([*told, "change of share of time (points)", *change])
        for name, odds in (("time", effect.odds_of_time), ("reports", effect.odds_of_reports)):
            rows.append([*told, f"odds ratio, {name}", *cells.effect(odds, odds=True), NONE, NONE])
    header = ["blur agrees with", "mm", "of the nonrigid reading", "estimate", "95 %", "test", "p", "p (Holm)", "d_z"]
    caption = "Each gradient against none; Holm’s correction is over gradients, for each kind of test"
    sheets.append(_sheet("necker_effects.csv", caption, [*header, "p (Wilcoxon)"], rows, result.effects, cells))
    cells = _Cells()
    rows = []
    for each in result.dominance:
        told = [each.gradient, number(each.strength), each.percept, f"{each.reports} ({each.censored})"]
        fits = []
        for fit in (each.gamma, each.lognormal):
            if isinstance(fit, DurationFit):
                fits += [number(fit.mean), number(fit.cv), number(fit.log_likelihood, 5)]
            else:
                fits += cells.missing(fit, 3)
        rows.append([*told, *fits, {"lognormal": "log-normal"}.get(str(each.better), each.better or NONE)])
    header = ["blur agrees with", "mm", "percept", "reports (cut off)"]
    header += [f"{family}: {what}" for family in ("gamma", "log-normal") for what in ("mean (s)", "CV", "log L")]
    caption = "Durations of each percept: fits with what the end of a trial cut off as lower limits"
    sheets.append(_sheet("necker_durations.csv", caption, [*header, "better"], rows, result.dominance, cells))
    return sheets


def _sheet(
    file: str,
    caption: str,
    header: list[str],
    rows: list[list[str]],
    records: Iterable[Any],
    cells: _Cells | None = None,
) -> Sheet:
    records = list(records)
    digits = pd.DataFrame(records) if isinstance(records[0], dict) else as_table(records)
    notes = () if cells is None else tuple(cells.notes)
    return Sheet(file, Table(caption, header, rows, notes, file), digits)
