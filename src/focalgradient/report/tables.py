"""Tables of result records for reading: effects with intervals and tests; reasons for missing results in notes.

Numbers follow the APA manual: two decimals for t, d and ratios, no zero before numbers that cannot exceed 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import pandas as pd

from focalgradient.report.document import Table
from focalgradient.statistics import (
    Components,
    DepthRatingResult,
    DurationFit,
    DurationsOfPeople,
    Effect,
    Equivalence,
    Interval,
    NeckerResult,
    NotComputed,
    OrdinalResult,
    Quality,
    as_table,
)
from focalgradient.statistics.bootstrap import BootstrapT
from focalgradient.statistics.crossed import random_scenes
from focalgradient.statistics.cube import READINGS

__all__ = [
    "SPACE",
    "Sheet",
    "decimals",
    "effect_sheet",
    "freedom",
    "interval",
    "many",
    "necker_sheets",
    "number",
    "probability",
    "quality_sheets",
    "rating_sheets",
    "sheet",
]

NONE = "–"

SPACE = "\N{NO-BREAK SPACE}"

RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Digits as exponents."""


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Table for display, and the same with full precision for a file; `table` is None for file-only tables."""

    file: str
    table: Table | None
    digits: pd.DataFrame


def number(value: float | None, digits: int = 3) -> str:
    r"""Format a number with a given number of significant digits.

    >>> number(0.12345), number(1234.5), number(-0.0000456), number(None)
    ('0.123', '1230', '−4.56\xa0×\xa010⁻⁵', '–')
    """
    if value is None or not math.isfinite(value):
        return NONE
    if value == 0:
        return "0"
    text = f"{value:#.{digits}g}"
    if "e-" in text:
        shown, power = text.split("e-")
        text = f"{shown}{SPACE}×{SPACE}10⁻{power.lstrip('0').translate(RAISED)}"
    return (f"{float(text):.0f}" if "e" in text else text).rstrip(".").replace("-", "−")


def probability(p: float | None) -> str:
    r"""Format a p value in APA style.

    >>> probability(0.00004), probability(0.0312), probability(1.0)
    ('<\xa0.001', '.031', '1.000')
    """
    if p is None:
        return NONE
    return f"<{SPACE}.001" if p < 0.001 else f"{p:.3f}".removeprefix("0")


def decimals(value: float | None, places: int = 2) -> str:
    """Format a number with a given number of decimals; without decimals from 1000.

    >>> decimals(-0.123), decimals(14.2), decimals(16545.47), decimals(None)
    ('−0.12', '14.20', '16,545', '–')
    """
    if value is None or not math.isfinite(value):
        return NONE
    if abs(value) >= 1000:
        text = f"{value:,.0f}" if abs(value) < 1e6 else f"{value:.2g}"
        return text.replace("-", "−").replace("e+0", "e").replace("e+", "e")
    text = f"{value:.{places}f}"
    return (text.removeprefix("-") if float(text) == 0 else text).replace("-", "−")


def freedom(df: float) -> str:
    """Format degrees of freedom: integers without decimals.

    >>> freedom(7), freedom(14.2)
    ('7', '14.20')
    """
    return f"{df:.0f}" if float(df).is_integer() else f"{df:.2f}"


def interval(low: float | None, high: float | None, places: int | None = None) -> str:
    """Format an interval in brackets, with three significant digits or a number of decimals."""
    if low is None or high is None:
        return NONE
    ends = (number(low), number(high)) if places is None else (decimals(low, places), decimals(high, places))
    return f"[{ends[0]},{SPACE}{ends[1]}]"


def many(count: int, thing: str) -> str:
    """Format a count with its noun.

    >>> many(1, "scene"), many(1200, "trial")
    ('1 scene', '1,200 trials')
    """
    return f"{count:,} {thing}{'' if count == 1 else 's'}"


class _Cells:
    """Cells of the rows of one table; missing results are dashes, and their reasons are collected for the notes."""

    def __init__(self) -> None:
        self.notes: dict[str, None] = {}

    def missing(self, result: NotComputed, cells: int) -> list[str]:
        self.notes[f"{NONE}: {result.reason}"] = None
        return [NONE] * cells

    def interval(self, result: Interval | NotComputed, factor: float = 1.0, places: int = 2) -> list[str]:
        """Return estimate and interval."""
        if isinstance(result, NotComputed):
            return self.missing(result, 2)
        low, high = (None if end is None else factor * end for end in (result.low, result.high))
        return [decimals(factor * result.estimate, places), interval(low, high, places)]

    def effect(self, result: Effect | NotComputed, factor: float = 1.0, *, ratio: bool = False) -> list[str]:
        """Return estimate, interval, test, p and Holm's p; with `ratio`, the effect is on a logarithm."""
        if isinstance(result, NotComputed):
            return self.missing(result, 5)
        self.notes.update(dict.fromkeys(result.remarks))
        if ratio:
            ends = result.ratio
            return [decimals(ends.estimate), interval(ends.low, ends.high, 2), *self.test(result)]
        low, high = (None if end is None else factor * end for end in (result.low, result.high))
        return [number(factor * result.estimate), interval(low, high), *self.test(result)]

    def size(self, result: Effect | NotComputed) -> list[str]:
        """Return the effect size (d over subjects and scenes, or d_z over subjects) and its interval."""
        found = (result.d or result.dz_interval) if isinstance(result, Effect) else None
        return [NONE, NONE] if found is None else [decimals(found.estimate), interval(found.low, found.high, 2)]

    def test(self, result: Effect | NotComputed) -> list[str]:
        """Return the test statistic, p and Holm's p."""
        if isinstance(result, NotComputed):
            return self.missing(result, 3)
        statistic = f"t({freedom(result.df)}){SPACE}={SPACE}{decimals(result.statistic)}"
        return [statistic, probability(result.p), probability(result.p_holm)]


def quality_sheets(found: Quality, name: str) -> list[Sheet]:
    """Return tables of data quality and exclusions."""
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
        sheet(
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
        sheets.append(sheet(f"{name}_exclusions.csv", "Exclusions", header, rows, found.exclusions))
    return sheets


def rating_sheets(result: DepthRatingResult) -> list[Sheet]:
    """Return the tables of experiment 1."""
    sheets = [Sheet("depth_rating_subjects.csv", None, as_table(result.subject_means))]
    if isinstance(result.ordinal, OrdinalResult):
        return [*sheets, *_ordinal(result.ordinal)]
    if result.scene_means:
        sheets.append(Sheet("depth_rating_scenes.csv", None, as_table(result.scene_means)))
    sheets += _sensitivity(result)
    return [*sheets, _rises(result), _equivalence(result), _means(result), _slopes(result), _components(result)]


def _sensitivity(result: DepthRatingResult) -> list[Sheet]:
    """Return the bootstrap-t of the primary effect as a file, if there is one."""
    rows = [
        {"fixation": each.fixation, "estimate": each.rise_these_scenes.estimate}
        | as_table([each.bootstrap]).iloc[0].to_dict()
        | {"method": "bootstrap-t over subjects"}
        for each in result.fixations
        if isinstance(each.bootstrap, BootstrapT) and isinstance(each.rise_these_scenes, Effect)
    ]
    return [Sheet("depth_rating_sensitivity.csv", None, pd.DataFrame(rows))] if rows else []


def _rises(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    tests: list[tuple[str, str, Effect | NotComputed]] = []
    tested = [(each.fixation, each.rise, each.rise_these_scenes) for each in result.fixations]
    pairs = [(f"{one} / {other}", *tests) for (one, other), tests in result.differences.items()]
    tested += pairs or [("nearest / farthest", result.interaction, result.interaction_these_scenes)]
    for name, test, fixed in tested:
        tests += [(name, "subjects and scenes", test), (name, THESE, fixed)]
    rows = [
        [fixation, over, *cells.effect(test, ratio=True), *cells.size(test)]
        for fixation, over, test in tests
        if over == THESE or not isinstance(test, Effect) or random_scenes(test)  # with few scenes the tests coincide
    ]
    digits = [
        {"fixation": fixation, "generalises_over": over} | as_table([test]).iloc[0].to_dict()
        for fixation, over, test in tests
    ]
    header = ["in focus", "holds for other", "depth effect (ratio to pinhole)", "95 %"]
    header += ["test", "p", "p (Holm)", *SIZE]
    caption = (
        f"Depth effect: ratings at the largest aperture ({result.largest_mm:.3g} mm) over the pinhole; the first is "
        "primary. p (Holm): over all secondary comparisons"
    )
    return sheet("depth_rating_rises.csv", caption, header, rows, digits, cells)


THESE = "subjects; these scenes"

SIZE = ("d (over subjects: d_z)", "95 %")
"""Headings of the effect size."""


def _means(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    rows = [
        [
            mean.fixation,
            mean.aperture,
            number(mean.aperture_mm),
            str(mean.subjects),
            *cells.interval(mean.rating),
            *(cells.interval(mean.ratio) if mean.aperture_mm else ["1", NONE]),
            *(cells.test(mean.against_pinhole) if mean.aperture_mm else [NONE] * 3),
            *(cells.size(mean.against_pinhole) if mean.aperture_mm else [NONE] * 2),
        ]
        for mean in result.means
    ]
    header = ["in focus", "aperture", "mm", "N", "rating", "95 % within subjects", "ratio to pinhole", "95 %"]
    header += ["test of the ratio", "p", "p (Holm)", *SIZE]
    caption = (
        "Ratings and their ratio to the pinhole: geometric means; at the largest aperture the test is that of "
        "the depth effect. p (Holm): over all secondary comparisons"
    )
    return sheet("depth_rating_means.csv", caption, header, rows, result.means, cells)


def _slopes(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    tests: list[tuple[str, str, Effect | NotComputed]] = []
    for each in result.fixations:
        tests.append((each.fixation, "slope (log ratio / mm)", each.slope))
    rows = [[fixation, what, *cells.effect(test), *cells.size(test)] for fixation, what, test in tests]
    digits = [
        {"fixation": fixation, "what": what} | as_table([test]).iloc[0].to_dict() for fixation, what, test in tests
    ]
    header = ["in focus", "of the logarithm of the rating", "estimate", "95 %", "test", "p", "p (Holm)", *SIZE]
    caption = "Trend: straight line through the apertures. p (Holm): over all secondary comparisons"
    return sheet("depth_rating_slopes.csv", caption, header, rows, digits, cells)


def _components(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    rows, digits = [], []
    for each in result.fixations:
        found = each.components
        digits.append({"fixation": each.fixation} | as_table([found]).iloc[0].to_dict())
        if isinstance(found, Components):
            parts = [decimals(sd, 3) for sd in (found.subjects, found.scenes, found.residual)]
            check = [decimals(found.shapiro_w, 3), probability(found.shapiro_p), decimals(found.largest)]
            check += [decimals(found.skewness), decimals(found.subjects_w, 3), probability(found.subjects_p)]
            rows.append([each.fixation, found.formula, *parts, *check])
        else:
            rows.append([each.fixation, *cells.missing(found, 10)])
    header = ["in focus", "model", "SD of subjects", "SD of scenes", "SD of residuals"]
    header += ["Shapiro-Wilk W", "p", "largest residual (SD)"]
    header += ["skewness of subjects’ depth effects", "their Shapiro-Wilk W", "p"]
    caption = "Model of the depth effect (log ratio of each subject and scene), its variance components and residuals"
    return sheet("depth_rating_components.csv", caption, header, rows, digits, cells)


def _equivalence(result: DepthRatingResult) -> Sheet:
    cells = _Cells()
    rows = []
    for each in result.fixations:
        test = each.equivalence
        if isinstance(test, Equivalence):
            bound = math.exp(test.bound)
            ends = interval(math.exp(test.low), math.exp(test.high), 2)
            first = [f"{decimals(1 / bound)} to {decimals(bound)}", decimals(math.exp(test.estimate)), ends]
            ps = [probability(p) for p in (test.p_below, test.p_above, test.p)]
            rows.append([each.fixation, *first, *ps, "yes" if test.equivalent else "not shown"])
        else:
            rows.append([each.fixation, *cells.missing(test, 7)])
    header = ["in focus", "bounds", "depth effect at the largest aperture", "90 %"]
    header += ["p against less", "p against more", "p"]
    digits = [{"fixation": each.fixation} | as_table([each.equivalence]).iloc[0].to_dict() for each in result.fixations]
    crossed = any(isinstance(each.rise, Effect) and random_scenes(each.rise) for each in result.fixations)
    over = "over subjects and scenes" if crossed else "over subjects, for these scenes"
    caption = f"Whether the depth effect is equivalent to zero (two one-sided tests, {over})"
    return sheet("depth_rating_equivalence.csv", caption, [*header, "equivalent to zero"], rows, digits, cells)


def _ordinal(result: OrdinalResult) -> list[Sheet]:
    """Return slopes, odds ratios, thresholds and proportions of the cumulative-link mixed model."""
    cells = _Cells()
    named: list[tuple[str, str, Effect | NotComputed]] = []
    for fixation, slope, rise in zip(result.fixations, result.slopes, result.rises, strict=True):
        named.append((fixation, "slope (log odds of a higher answer / mm)", slope))
        named.append((fixation, "odds ratio at the largest aperture", rise))
    what = "ratio of the odds ratios"
    pairs = [(f"{one} / {other}", what, test) for (one, other), test in result.differences.items()]
    named += pairs or [("nearest / farthest", what, result.interaction)]
    rows, digits = [], []
    random = [isinstance(test, Effect) and random_scenes(test) for _, _, test in named]
    overs = ["subjects and scenes" if each else THESE for each in random]
    fixed = _here(result) if any(random) else []
    for (name, what, test), over in zip([*named, *fixed], [*overs, *[THESE] * len(fixed)], strict=True):
        rows.append([name, what, over, *cells.effect(test, ratio="ratio" in what)])
        meant = {"fixation": name, "what": f"logarithm of the {what}" if "ratio" in what else what}
        digits.append(meant | {"generalises_over": over} | as_table([test]).iloc[0].to_dict())
    header = ["in focus", "of a higher answer", "holds for other", "estimate", "95 %", "test", "p", "p (Holm)"]
    caption = f"Cumulative-link mixed model: {result.formula}"
    sheets = [sheet("depth_rating_ordinal.csv", caption, header, rows, digits, cells)]
    if result.thresholds:
        rows = [
            [
                f"{each.below} | {each.above}",
                decimals(each.place.estimate),
                interval(each.place.low, each.place.high, 2),
            ]
            for each in result.thresholds
        ]
        caption = "Thresholds between the steps, in log odds; the pinhole with the first scene is 0"
        header = ["between", "threshold", "95 %"]
        sheets.append(sheet("depth_rating_thresholds.csv", caption, header, rows, result.thresholds))
    sheets.append(Sheet("depth_rating_shares.csv", None, as_table(result.shares)))
    return sheets


def _here(result: OrdinalResult) -> list[tuple[str, str, Effect | NotComputed]]:
    """Return the odds ratios for these scenes only."""
    pairs = list(combinations(result.fixations, 2))
    names = [*((name, "odds ratio at the largest aperture") for name in result.fixations)]
    names += [(f"{one} / {other}", "ratio of the odds ratios") for one, other in pairs]
    return [(*name, test) for name, test in zip(names, result.these_scenes, strict=False)]


def necker_sheets(result: NeckerResult) -> list[Sheet]:
    """Return the tables of experiment 2."""
    cells = _Cells()
    rows = []
    for share in result.shares:
        reports = [NONE, NONE] if share.percept == "none" else cells.interval(share.reports, 100, 1)
        readings = cells.interval(share.of_readings, 100, 1) if share.percept in READINGS else [NONE, NONE]
        first = [share.gradient, number(share.strength), share.percept]
        rows.append([*first, *readings, *cells.interval(share.time, 100, 1), *reports])
    header = ["blur agrees with", "mm", "percept", "share of both readings' time (%)", "95 %", "share of all time (%)"]
    header += ["95 %", "share of reports (%)", "95 %"]
    shares = sheet("necker_shares.csv", "Reported percepts, means over subjects", header, rows, result.shares, cells)
    sheets = [Sheet("necker_subjects.csv", None, as_table(result.subject_shares))]
    cells = _Cells()
    rows = []
    for effect in result.effects:
        test = effect.odds_of_time
        odds = [*cells.effect(test, ratio=True), *cells.size(test)]
        rows.append([effect.gradient, number(effect.strength), *odds])
    header = ["blur agrees with", "mm", "odds ratio", "95 %", "test", "p", "p (Holm)", "d_z", "95 %"]
    caption = (
        "Odds of the nonrigid reading (time), each gradient against none; first row: primary. p (Holm): over all "
        "secondary comparisons"
    )
    if result.effects:
        sheets.append(sheet("necker_effects.csv", caption, header, rows, result.effects, cells))
    sheets.append(shares)
    cells = _Cells()
    rows = []
    for each in result.dominance:
        first = [each.gradient, number(each.strength), each.percept, f"{each.reports} ({each.censored})"]
        fits = []
        for fit in (each.gamma, each.lognormal):
            if isinstance(fit, DurationFit):
                fits += [number(fit.mean), number(fit.cv), number(fit.log_likelihood, 5)]
            else:
                fits += cells.missing(fit, 3)
        rows.append([*first, *fits, {"lognormal": "log-normal"}.get(str(each.better), each.better or NONE)])
    header = ["blur agrees with", "mm", "percept", "reports (cut off)"]
    header += [f"{family}: {what}" for family in ("gamma", "log-normal") for what in ("mean (s)", "CV", "log L")]
    caption = "Percept durations (right-censored at trial end)"
    sheets.append(sheet("necker_durations.csv", caption, [*header, "better"], rows, result.dominance, cells))
    sheets.append(_durations_of_people(result))
    return sheets


def _durations_of_people(result: NeckerResult) -> Sheet:
    """Return the distribution over subjects of each reading's durations without a gradient."""
    cells = _Cells()
    rows, digits = [], []
    for each in result.people:
        names = {"gradient": each.gradient, "strength": each.strength, "percept": each.percept}
        first = [each.gradient, number(each.strength), each.percept]
        fit = each.fit
        if not isinstance(fit, DurationsOfPeople):
            rows.append([*first, *cells.missing(fit, 7)])
            digits.append(names | {"not_computed": fit.reason})
            continue
        of_people = [number(value) for value in (fit.geometric_mean, fit.shape, fit.log_sd)]
        errors = [NONE if se is None else number(se) for se in (fit.geometric_mean_log_se, fit.shape_se, fit.log_sd_se)]
        paired = [cell for pair in zip(of_people, errors, strict=True) for cell in pair]
        rows.append([*first, str(len(fit.people)), *paired])
        digits.append(
            names
            | {
                "subjects": len(fit.people),
                "geometric_mean": fit.geometric_mean,
                "geometric_mean_log_se": fit.geometric_mean_log_se,
                "shape": fit.shape,
                "shape_se": fit.shape_se,
                "log_sd": fit.log_sd,
                "log_sd_se": fit.log_sd_se,
            }
        )
    header = ["blur agrees with", "mm", "percept", "subjects"]
    header += ["geometric mean (s)", "SE of its log", "gamma shape", "SE"]
    header += ["SD of log mean", "SE"]
    caption = (
        "Durations over subjects: gamma distributions of one shape and each subject’s own mean, the cut-off censored"
    )
    return sheet("necker_durations_of_people.csv", caption, header, rows, digits, cells)


def effect_sheet(file: str, caption: str, what: str, found: Iterable[tuple[str, Effect | NotComputed]]) -> Sheet:
    """Return named effects as a table, and with full precision; `what` heads the column of names."""
    cells = _Cells()
    found = list(found)
    rows = [[name, *cells.effect(test)] for name, test in found]
    digits = [{what: name} | as_table([test]).iloc[0].to_dict() for name, test in found]
    return sheet(file, caption, [what, "estimate", "95 %", "test", "p", "p (Holm)"], rows, digits, cells)


def sheet(
    file: str,
    caption: str,
    header: list[str],
    rows: list[list[str]],
    records: Iterable[Any],
    cells: _Cells | None = None,
) -> Sheet:
    """Return a table of `rows` for display, and for the file its `records` (dictionaries, or results of one kind)."""
    records = list(records)
    digits = pd.DataFrame(records) if isinstance(records[0], dict) else as_table(records)
    notes = () if cells is None else tuple(cells.notes)
    return Sheet(file, Table(caption, header, rows, notes, file), digits)
