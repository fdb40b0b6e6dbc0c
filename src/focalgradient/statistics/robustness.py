"""Multiverse analysis: re-analysis under other exclusion rules, transformations and tests, and without each person.

It shows how much a result depends on arbitrary choices (Steegen, Tuerlinckx, Gelman and Vanpaemel 2016; Simonsohn,
Simmons and Nelson 2020). The variants share their data and are not independent evidence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from focalgradient.scales import Analysis, Choices, Slopes, analysis_named
from focalgradient.scales.analyses import AS_GIVEN, LOGARITHM, RANKS
from focalgradient.statistics.cells import Cells, cells
from focalgradient.statistics.comparisons import own_slopes
from focalgradient.statistics.criteria import OF_RATINGS, Rules
from focalgradient.statistics.crossed import crossed_effect, own_means
from focalgradient.statistics.exclusions import kept_rows, quality
from focalgradient.statistics.records import ALPHA, Effect, NotComputed
from focalgradient.statistics.tables import fixations_of, rating_table

__all__ = ["ALL_RULES", "LOGARITHM", "NO_RULES", "TESTS", "Variant", "most_influential", "robustness", "sign_flips"]

FloatArray = NDArray[np.float64]

ALL_RULES, NO_RULES = "all", "none"
STUDENT, FLIPS = "Student's t", "sign flips"
TESTS = (STUDENT, FLIPS)

JUDGING = ("catch_factor", "lapse_factor")
"""Fields of `Rules` that exclude nobody by themselves."""

EXACT = 12
"""Maximum number of subjects for which all sign flips (4096) are enumerated."""

DRAWS = 4095
"""Number of random sign flips with more subjects, in addition to the identity: p = .05 is accurate to 0.003."""


@dataclass(frozen=True, slots=True)
class Variant:
    """Result of one re-analysis.

    Parameters
    ----------
    fixation
        Object in focus.
    rules
        `ALL_RULES`, `NO_RULES`, or the field of `Rules` that was switched off.
    transformation
        Transformation of the answers, one of `Analysis.transformations`.
    test
        One of `TESTS`. The sign-flip test is over subjects, for these scenes; Student's t over subjects and scenes.
    without
        Participant excluded from this variant; empty with everybody.
    estimate, low, high, p
        Effect with its 95 % interval and two-sided p value, not corrected for multiple tests; None if not computed. The
        effect is the largest aperture minus the pinhole, or the slope per millimetre in analyses by slopes, of the
        transformed answers. Infinite ends: too few subjects for any test at .05.
    subjects, trials
        Number of subjects and of trials, without catch trials.
    main
        True for the main analysis: all rules, its transformation, and its test.
    distinct
        False if an earlier set of rules keeps the same data.
    reason
        Reason why the effect was not computed.
    """

    fixation: str
    rules: str
    transformation: str
    test: str
    without: str
    estimate: float | None
    low: float | None
    high: float | None
    p: float | None
    subjects: int
    trials: int
    main: bool
    distinct: bool
    reason: str = ""

    @property
    def significant(self) -> bool:
        """True if p is below .05."""
        return self.p is not None and self.p < ALPHA


def _ranks(rows: pd.DataFrame) -> FloatArray:
    """Return midranks of the answers within each subject, divided by their number."""
    own = rows["rating"].groupby(rows["participant_id"].to_numpy())
    return own.rank(pct=True).to_numpy(float)


TRANSFORMED: Mapping[str, Callable[[pd.DataFrame], FloatArray]] = {
    LOGARITHM: lambda rows: np.log(rows["rating"].to_numpy(float)),
    AS_GIVEN: lambda rows: rows["rating"].to_numpy(float),
    RANKS: _ranks,
}


def robustness(table: pd.DataFrame, rules: Rules | None = None, scale: Analysis | str = "ratio") -> tuple[Variant, ...]:
    """Re-analyse ratings under each rule left out, each transformation and test, and without each person.

    Parameters
    ----------
    table
        One row per trial: see `focalgradient.statistics.tables.rating_table`.
    rules
        Exclusion rules; None: the defaults.
    scale
        Analysis of the ratings, or its name. The ordinal model is not refitted: mean steps are compared, and no variant
        is the main analysis.

    Returns
    -------
    tuple
        For each fixation: every set of rules with every transformation and test, then the main analysis without each
        person.

    Raises
    ------
    InputError
        If the table is invalid.

    Examples
    --------
    >>> rows = [{"participant_id": f"{who:02}", "trial": trial, "scene": "room", "fixation": "nearest", "catch": False,
    ...          "aperture": name, "aperture_mm": mm, "rating": 1 + (0.05 + 0.01 * who) * mm}
    ...         for who in range(6) for trial, (name, mm) in enumerate([("pinhole", 0.0), ("f/11", 4.5)])]
    >>> found = robustness(pd.DataFrame(rows))
    >>> [main] = [each for each in found if each.main]
    >>> round(main.estimate, 3), round(main.p, 4), main.subjects, len({each.without for each in found}) - 1
    (0.289, 0.0001, 6, 6)
    """
    analysis = analysis_named(scale)
    rules = rules or Rules()
    table = rating_table(table, analysis)
    judged = quality(table, rules, analysis)[1]
    unjudged = {one.rule for one in judged.unjudged}
    stated = [
        name for name in OF_RATINGS if name not in JUDGING and name not in unjudged and getattr(rules, name) is not None
    ]
    sets = {ALL_RULES: rules, **{name: _off(rules, [name]) for name in stated}, NO_RULES: _off(rules, stated)}
    answers = ~table["catch"].to_numpy(bool)
    kept = {name: kept_rows(table, judged.subjects, each) & answers for name, each in sets.items()}
    found: list[Variant] = []
    for fixation in fixations_of(table[answers]):
        own = (table["fixation"] == fixation).to_numpy()
        done: dict[bytes, list[Variant]] = {}
        for name, keep in kept.items():
            key, whole = keep.tobytes(), name == ALL_RULES
            distinct = key not in done
            if distinct:
                done[key] = list(_analysed(table[keep], own[keep], fixation, analysis, whole=whole))
            found += [
                replace(each, rules=name, distinct=distinct, main=each.main and whole)
                for each in done[key]
                if whole or not each.without  # rule sets that change nothing share these variants
            ]
    return tuple(found)


def _off(rules: Rules, names: Iterable[str]) -> Rules:
    """Switch some rules off."""
    off: dict[str, Any] = dict.fromkeys(names)
    return replace(rules, **off)


def _analysed(
    rows: pd.DataFrame, own: NDArray[np.bool_], fixation: str, analysis: Analysis, *, whole: bool
) -> Iterator[Variant]:
    """Yield all transformations and tests of the rows; with `whole`, also the main one without each person."""
    used = rows[own]
    for transformation in analysis.transformations:
        label = Variant(fixation, ALL_RULES, transformation, "", "", None, None, None, None, 0, len(used), False, True)
        first = transformation == analysis.transformations[0]
        if used.empty:
            for test in TESTS:
                yield replace(label, test=test, reason="No trials are left.")
            continue
        effects = cells(used.assign(answer=TRANSFORMED[transformation](rows)[own]))
        table = _contrast(effects, analysis)
        for each in _tested(label, table, TESTS):
            yield replace(each, main=first and each.test == STUDENT and not analysis.latent)
        if not (first and whole) or isinstance(table, NotComputed):
            continue
        trials = used["participant_id"].astype(str).value_counts()
        for place, who in enumerate(effects.subjects):
            if np.isfinite(table[place]).any():
                left = replace(label, without=who, trials=len(used) - int(trials[who]))
                yield from _tested(left, np.delete(table, place, axis=0), [STUDENT])


def _contrast(own: Cells, analysis: Analysis) -> FloatArray | NotComputed:
    """Return the effect in each subject and scene: a slope, or the largest aperture minus the pinhole."""
    if isinstance(analysis, Slopes | Choices):
        return own_slopes(own)
    if own.amounts[0] != 0 or len(own.amounts) < 2:
        return NotComputed("There are no answers to the pinhole and to a larger aperture.")
    return own.against_smallest(-1)


def _tested(label: Variant, table: FloatArray | NotComputed, tests: Sequence[str]) -> Iterator[Variant]:
    """Apply each test to a table of subjects x scenes."""
    effect = table if isinstance(table, NotComputed) else crossed_effect(table)
    for test in tests:
        if isinstance(effect, NotComputed) or isinstance(table, NotComputed):
            reason = effect.reason if isinstance(effect, NotComputed) else ""
            yield replace(label, test=test, reason=reason)
            continue
        low, high, p = _ends(effect, table, test)
        found = replace(label, test=test, estimate=effect.estimate, low=low, high=high, p=p)
        yield replace(found, subjects=effect.subjects)


def _ends(effect: Effect, table: FloatArray, test: str) -> tuple[float, float, float]:
    """Return the interval and p value of one test."""
    if test == FLIPS:
        people = table[np.isfinite(table).any(axis=1)]
        return sign_flips(own_means(people[:, np.isfinite(people).any(axis=0)]))
    return effect.low, effect.high, effect.p


def sign_flips(values: ArrayLike) -> tuple[float, float, float]:
    """Test a mean by flipping the signs of the values; the test is exact for symmetric distributions.

    Parameters
    ----------
    values
        One value per subject. All flips are enumerated for up to 12 values, else 4095 random ones with a fixed seed.

    Returns
    -------
    tuple
        Ends of the 95 % interval, which contains the means that are not rejected, and the two-sided p value of a zero
        mean. The ends are infinite with fewer than six values, for which no p value is below .05.

    Examples
    --------
    >>> [round(each, 3) for each in sign_flips([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])]
    [0.1, 0.6, 0.031]
    """
    own = np.asarray(values, dtype=float)
    count = len(own)
    if count <= EXACT:
        signs = 1.0 - 2.0 * ((np.arange(2**count)[:, None] >> np.arange(count)) & 1)
    else:
        signs = np.random.default_rng(1).choice([-1.0, 1.0], (DRAWS, count))
        signs = np.vstack([np.ones(count), signs])
    mean, flipped, balance = own.mean(), signs @ own / count, signs.mean(axis=1)
    reached = np.abs(flipped) >= abs(mean) - 1e-12 * np.abs(own).max(initial=0)
    # A flipped sample is as extreme as the observed one, |flipped - balance m| >= |mean - m|, for m between two values.
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.array([(mean - flipped) / (1 - balance), (mean + flipped) / (1 + balance)])
    always = np.abs(balance) > 1 - 1e-12
    low, high = (
        np.sort(np.where(always, far, end)) for far, end in ((-math.inf, ends.min(0)), (math.inf, ends.max(0)))
    )
    allowed = math.floor(ALPHA * len(signs))
    return float(low[allowed]), float(high[-1 - allowed]), float(reached.mean())


def most_influential(variants: Sequence[Variant], fixation: str) -> Variant | None:
    """Return the variant without the most influential person at a fixation; None if there is none.

    Examples
    --------
    >>> one = Variant("nearest", "all", "logarithm", "Student's t", "", 0.3, 0.1, 0.5, 0.02, 8, 96, True, True)
    >>> without = [replace(one, without=who, estimate=end, main=False) for who, end in (("a", 0.31), ("b", 0.2))]
    >>> most_influential([one, *without], "nearest").without
    'b'
    """
    own = [each for each in variants if each.fixation == fixation and each.estimate is not None]
    left = [each for each in own if each.without]
    whole = [each for each in own if not each.without and each.rules == ALL_RULES]
    same = [each for each in whole if left and each.transformation == left[0].transformation]
    if not same:
        return None
    everybody = same[0].estimate or 0.0
    return max(left, key=lambda each: abs((each.estimate or 0.0) - everybody))
