"""Section of the report on paired comparisons, and on user-defined factors."""

from __future__ import annotations

import re
from collections.abc import Iterator

from focalgradient.report.plans import in_focus
from focalgradient.statistics import ComparisonResult, Effect, NotComputed
from focalgradient.statistics.comparisons import RANDOM, SLOPE
from focalgradient.statistics.crossed import random_scenes
from focalgradient.statistics.questions import HERE
from focalgradient.statistics.tables import FIXATIONS

__all__ = ["comparison_findings"]

MINUS = re.compile(r"(?<!\w)-(?=[\d.])")
"""Hyphens that stand for a minus."""


def comparison_findings(found: ComparisonResult) -> Iterator[str]:
    """Yield the results in sentences; p values after Holm's correction decide their wording."""
    what = f"the {found.analysis.mean}"
    beside = found.answers.to(SLOPE + (RANDOM if found.analysis.binary else HERE))
    for name, slope, largest in zip(found.fixations, found.slopes, found.against_reference, strict=True):
        focused = f"{'' if name != found.fixations[0] else 'Primary outcome. '}With {in_focus(name)}"
        if isinstance(slope, NotComputed):
            yield f"{focused}, the slope on the aperture was not tested: {slope.reason}"
        else:
            verb = "was not shown to change" if not slope.significant else "rose" if slope.estimate > 0 else "fell"
            unit = f"{found.analysis.unit} per millimetre"
            sentence = f"{focused}, {what} {verb} with the aperture ({unit}: {_worded(slope)}; {_over(slope)})."
            yield sentence + _beside(slope, beside[name])
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


BOTH = "subjects and scenes, both random"


def _worded(effect: Effect | NotComputed) -> str:
    return effect.reason if isinstance(effect, NotComputed) else MINUS.sub("−", effect.summary())
