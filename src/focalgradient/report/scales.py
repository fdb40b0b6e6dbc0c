"""The part of the report on comparisons of two pictures, and on factors of a laboratory's own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet
from focalgradient.statistics import ComparisonResult, Effect, FactorEffect, NotComputed
from focalgradient.statistics.tables import FIXATIONS

__all__ = ["comparison_findings", "comparison_methods", "comparison_sheets", "factor_sheet"]


def comparison_findings(found: ComparisonResult) -> Iterator[str]:
    """The results in sentences."""
    what, unit = ("The mean step", "step") if found.scale == "bipolar" else ("The share of choices", "log odds")
    for name, slope, largest in zip(found.fixations, found.slopes, found.against_reference, strict=True):
        focused = f"the {name} object" if name in FIXATIONS else f"“{name}”"
        yield (
            f"With {focused} in focus the picture was judged deeper, the larger its aperture, by ({unit} for a "
            f"millimetre): {_worded(slope)}. {what} at the largest aperture differed from alike by: {_worded(largest)}."
        )
    for (one, other), test in found.differences.items():
        yield f"Difference of the slopes of “{one}” and “{other}”: {_worded(test)}."
    if found.scale == "bipolar" and not found.differences:
        yield f"Difference of the slopes of the two fixations: {_worded(found.interaction)}."


def comparison_methods(scale: str, design: Mapping[str, Any]) -> str:
    """How comparisons are analysed, for a paper."""
    same = design.get("reference") == "same-scene"
    reference = "the pinhole picture of the same scene" if same else "the standard, a pinhole picture of another scene"
    if scale == "choice":
        return (
            f"In each trial a picture and {reference} were shown in random order, and the one that looked deeper was "
            "chosen. The log odds of choosing the picture were modelled on the diameter of its aperture by generalised "
            "estimating equations (logit, independence, standard errors corrected for few subjects after Mancl and "
            "DeRouen, t with N − 1 degrees of freedom); the subjects’ shares at the largest aperture were compared "
            "with one half by a t-test. Holm’s method corrects each kind over the fixations. Results hold for other "
            "subjects, with these scenes."
        )
    return (
        f"Pictures were compared with {reference} in {design.get('steps', 7)} steps from much flatter to "
        "much deeper, 0 being alike. A straight "
        "line on the diameter of the aperture was fitted to each subject’s steps; its slopes, "
        "their difference between the fixations, and the mean steps at the largest aperture were tested by Student’s t "
        "over subjects, corrected by Holm’s method within each of these families. Results hold for other subjects, "
        "with these scenes."
    )


def comparison_sheets(found: ComparisonResult) -> Iterator[Sheet]:
    """Means over subjects and tests, as tables."""
    head = ["in focus", "aperture", "mm", "subjects", "mean", "low", "high"]
    rows = [
        [one.fixation, one.aperture, f"{one.aperture_mm:.3g}", str(one.subjects), *_interval(one.mean)]
        for one in found.means
    ]
    what = "steps" if found.scale == "bipolar" else "share of choices"
    yield listed("comparison_means.csv", f"Mean {what} over subjects, 95 % intervals by t", head, rows)
    tests: list[tuple[str, Effect | NotComputed]] = []
    for name, slope, largest in zip(found.fixations, found.slopes, found.against_reference, strict=True):
        tests += [(f"slope, {name} in focus", slope), (f"largest aperture, {name} in focus", largest)]
    pairs = [
        (f"difference of the slopes, {one} less {other}", test) for (one, other), test in found.differences.items()
    ]
    tests += pairs or [("difference of the slopes", found.interaction)]
    yield listed("comparison_tests.csv", "Tests", ["what", "result"], [[name, _worded(test)] for name, test in tests])


def factor_sheet(found: tuple[FactorEffect, ...], scale: str) -> Sheet:
    """Own factors: each level against the first, as a table."""
    rows = [[one.factor, f"{one.level} − {one.against}", one.measure, _worded(one.effect)] for one in found]
    unit = "logarithm of the ratings" if scale == "ratio" else "units of the scale"
    caption = f"Factors of the design: differences between levels, {unit}; Holm within factor and measure"
    return listed("factors.csv", caption, ["factor", "levels", "of", "difference"], rows)


def _worded(effect: Effect | NotComputed) -> str:
    return effect.reason if isinstance(effect, NotComputed) else effect.summary()


def _interval(mean: Any) -> list[str]:
    return ["" if value is None else f"{value:.3f}" for value in (mean.estimate, mean.low, mean.high)]
