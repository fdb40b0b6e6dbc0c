"""Section of the report on paired comparisons, and on user-defined factors."""

from __future__ import annotations

import re
from collections.abc import Iterator

from focalgradient.report.plans import in_focus
from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet
from focalgradient.scales import Analysis
from focalgradient.statistics import ComparisonResult, ComparisonTests, Effect, FactorEffect, NotComputed
from focalgradient.statistics.comparisons import UNLIKE, slope_unit
from focalgradient.statistics.crossed import random_scenes
from focalgradient.statistics.tables import FIXATIONS

__all__ = ["comparison_findings", "comparison_sheets", "factor_sheet"]

MINUS = re.compile(r"(?<!\w)-(?=[\d.])")
"""Hyphens that stand for a minus."""


def comparison_findings(found: ComparisonResult) -> Iterator[str]:
    """Yield the results in sentences; p values after Holm's correction decide their wording."""
    what = f"the {found.analysis.mean}"
    beside = found.scenes_random if found.analysis.binary else found.these_scenes
    for name, slope, second, largest in zip(
        found.fixations, found.slopes, beside.slopes, found.against_reference, strict=True
    ):
        focused = f"{'' if name != found.fixations[0] else 'Primary outcome. '}With {in_focus(name)}"
        if isinstance(slope, NotComputed):
            yield f"{focused}, the slope on the aperture was not tested: {slope.reason}"
        else:
            verb = "was not shown to change" if not slope.significant else "rose" if slope.estimate > 0 else "fell"
            unit = f"{slope_unit(found.analysis)} per millimetre"
            sentence = f"{focused}, {what} {verb} with the aperture ({unit}: {_worded(slope)}; {_over(slope)})."
            yield sentence + _beside(slope, second)
        if found.analysis.alike is None:
            continue
        if isinstance(largest, Effect):
            verb = "differed" if largest.significant else "was not shown to differ"
            ends = f"({_worded(largest)}; {_over(largest)})"
            yield f"At the largest aperture it {verb} from that of pictures that are alike {ends}."
        else:
            yield f"At the largest aperture it was not tested: {largest.reason}"
    usual = found.analysis.compares_slopes and {*found.fixations} <= {*FIXATIONS}
    pairs = found.differences or ({FIXATIONS: found.interaction} if usual else {})
    for (one, other), test in pairs.items():
        if isinstance(test, NotComputed):
            yield f"The slopes of “{one}” and “{other}” were not compared: {test.reason}"
        else:
            verb = "differed" if test.significant else "were not shown to differ"
            yield f"The slopes of “{one}” and “{other}” {verb} ({_worded(test)}; {_over(test)})."


def _over(test: Effect) -> str:
    return "over " + (BOTH if random_scenes(test) else "subjects, for these scenes")


def _beside(deciding: Effect, other: Effect | NotComputed) -> str:
    """Return the same test for these scenes, or for other scenes, too, if it is a different one."""
    if random_scenes(deciding):
        return f" For these scenes alone: {_worded(other)}."
    return f" Over {BOTH}: {_worded(other)}." if isinstance(other, Effect) and random_scenes(other) else ""


def comparison_sheets(found: ComparisonResult) -> Iterator[Sheet]:
    """Yield means over subjects and tests as tables."""
    head = ["in focus", "aperture", "mm", "subjects", "mean", "low", "high"]
    rows = [
        [one.fixation, one.aperture, one.aperture_mm, one.subjects, one.mean.estimate, one.mean.low, one.mean.high]
        for one in found.means
    ]
    by = "by t on the log odds" if found.analysis.binary else "by t"
    yield listed("comparison_means.csv", f"Mean {found.analysis.unit} over subjects, 95 % intervals {by}", head, rows)
    rows = [
        [name, over, _worded(test)]
        for over, tests in (
            ((HERE, found), (BOTH, found.scenes_random))
            if found.analysis.binary
            else ((BOTH, found), (HERE, found.these_scenes))
        )
        for name, test in _named(found.fixations, tests)
        if over == HERE or (random_scenes(test) if isinstance(test, Effect) else tests is found)
    ]
    yield listed("comparison_tests.csv", "Tests", ["what", "holds for other", "result"], rows)


BOTH, HERE = "subjects and scenes, both random", "subjects; these scenes"


def _named(
    fixations: tuple[str, ...], tests: ComparisonResult | ComparisonTests
) -> Iterator[tuple[str, Effect | NotComputed]]:
    for name, slope, largest in zip(fixations, tests.slopes, tests.against_reference, strict=True):
        yield f"slope, {name} in focus", slope
        if largest is not UNLIKE:
            yield f"largest aperture, {name} in focus", largest
    for (one, other), test in tests.differences.items():
        yield f"difference of the slopes, {one} less {other}", test
    if not tests.differences:
        yield "difference of the slopes", tests.interaction


def factor_sheet(found: tuple[FactorEffect, ...], analysis: Analysis) -> Sheet:
    """Return a table of user-defined factors, each level compared with the first."""
    rows = [[one.factor, f"{one.level} − {one.against}", one.measure, _worded(one.effect)] for one in found]
    unit = "logarithm of the ratings" if analysis.ratios else "units of the scale"
    caption = f"Factors of the design: differences between levels, {unit}; Holm within factor and measure"
    return listed("factors.csv", caption, ["factor", "levels", "of", "difference"], rows)


def _worded(effect: Effect | NotComputed) -> str:
    return effect.reason if isinstance(effect, NotComputed) else MINUS.sub("−", effect.summary())
