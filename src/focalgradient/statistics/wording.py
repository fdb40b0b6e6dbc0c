"""Wording of results: numbers as the APA manual formats them, and the parts of sentences that several findings share.

Two decimals for t, d and ratios, no zero before numbers that cannot exceed 1.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

from focalgradient.statistics.crossed import random_scenes
from focalgradient.statistics.records import Effect, Interval, NotComputed
from focalgradient.user_tables.tidy import FIXATIONS

__all__ = [
    "NONE",
    "SPACE",
    "ci",
    "decimals",
    "difference",
    "direction",
    "expected_differences",
    "expected_rise",
    "freedom",
    "in_focus",
    "interval",
    "listed",
    "many",
    "number",
    "over",
    "p_is",
    "probability",
    "ratio_ci",
    "size",
    "statistic",
    "summary",
    "with_interval",
]

NONE = "–"

SPACE = "\N{NO-BREAK SPACE}"

RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Digits as exponents."""


def number(value: float | None, digits: int = 3) -> str:
    r"""Format a number with a given number of significant digits.

    >>> number(0.12345), number(1234.5), number(-0.0000456), number(None), number(0.0), number(1.0)
    ('0.123', '1230', '−4.56\xa0×\xa010⁻⁵', '–', '0', '1.00')
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

    >>> many(1, "scene"), many(1200, "trial"), many(2, "person")
    ('1 scene', '1,200 trials', '2 people')
    """
    things = "people" if thing == "person" else f"{thing}s"
    return f"{count:,} {thing if count == 1 else things}"


def p_is(p: float | None) -> str:
    r"""Format a p value as it follows "p".

    >>> p_is(0.0312), p_is(0.00004)
    ('=\xa0.031', '<\xa0.001')
    """
    text = probability(p)
    return text if text.startswith("<") else f"={SPACE}{text}"


def summary(test: Effect | NotComputed) -> str:
    """Return the one-line summary of an effect with minus signs, or the reason why there is none."""
    return test.reason if isinstance(test, NotComputed) else re.sub(r"(?<!\w)-(?=[\d.])", "−", test.summary())


def listed(things: Iterable[object], nothing: str = "none stated") -> str:
    """Join things by commas and "and"; `nothing` if there are none.

    >>> listed(["a", "b", "c"]), listed([])
    ('a, b and c', 'none stated')
    """
    *first, last = [str(thing) for thing in things] or [nothing]
    return f"{', '.join(first)} and {last}" if first else last


def in_focus(fixation: str) -> str:
    """Describe the object in focus.

    >>> in_focus("nearest"), in_focus("tree")
    ('the nearest object in focus', '“tree” in focus')
    """
    return f"the {fixation} object in focus" if fixation in FIXATIONS else f"“{fixation}” in focus"


def expected_rise(fixations: Sequence[str], what: str, until: str = "with the aperture") -> str:
    """Return the hypothesis that something changes with the first object in focus."""
    return f"With {in_focus(fixations[0])}, {what} {until}; a rise is expected (two-sided test)."


def expected_differences(fixations: Sequence[str]) -> tuple[str, ...]:
    """Return the hypotheses that the change differs between the first object in focus and each other one."""
    first, *others = map(in_focus, fixations)
    return tuple(
        f"That change differs between {first} and {other}; a larger rise with the former is expected (two-sided test)."
        for other in others
    )


def direction(effect: Effect) -> str:
    """Return the verb of a plural whose change an effect is: "rose", "fell" or "were not shown to change"."""
    return "were not shown to change" if not effect.significant else "rose" if effect.estimate > 0 else "fell"


def over(effect: Effect) -> str:
    """Return what an effect generalises over."""
    return "subjects and scenes, both random" if random_scenes(effect) else "subjects, for these scenes"


def ci(low: float | None, high: float | None, level: int = 95) -> str:
    """Format an interval with its coverage in percent."""
    return f"{level}{SPACE}% CI {interval(low, high, 2)}"


def with_interval(found: Interval, unit: str = "") -> str:
    """Format an estimate with its 95 % interval, in a unit.

    >>> with_interval(Interval(0.2, 0.1, 0.3), "D")
    '0.200 D (95 % interval 0.100 to 0.300 D)'
    """
    of = f" {unit}" if unit else ""
    known = found.low is not None and found.high is not None
    ends = f" (95 % interval {number(found.low)} to {number(found.high)}{of})" if known else ""
    return f"{number(found.estimate)}{of}{ends}"


def ratio_ci(effect: Effect) -> str:
    """Format the exponential of an effect with its interval."""
    return f"{decimals(effect.ratio.estimate)}, {ci(effect.ratio.low, effect.ratio.high)}"


def statistic(effect: Effect) -> str:
    """Format the test statistic with its p value, after Holm's correction in a family."""
    name, p = ("p", effect.p) if effect.p_holm is None else ("p_Holm", effect.p_holm)
    return f"t({freedom(effect.df)}){SPACE}={SPACE}{decimals(effect.statistic)}, {name}{SPACE}{p_is(p)}"


def size(effect: Effect) -> str:
    """Format the effect size with its interval, after a comma: d over subjects and scenes, d_z over subjects."""
    found, name = (effect.d, "d") if effect.d is not None else (effect.dz_interval, "d_z")
    if found is None:
        return ""
    return f", {name}{SPACE}={SPACE}{decimals(found.estimate)} {interval(found.low, found.high, 2)}"


def difference(what: str, pair: tuple[str, str], test: Effect | NotComputed, *, only: bool) -> str:
    """Describe the difference of two logarithmic effects; `only` if there are no other effects of that name.

    >>> difference("slopes", ("a", "b"), NotComputed("No subject has both."), only=False)
    'The slopes of “a” and “b” were not compared: No subject has both.'
    """
    named = f"The two {what}" if only else f"The {what} of “{pair[0]}” and “{pair[1]}”"
    if isinstance(test, NotComputed):
        return f"{named} were not compared: {test.reason}"
    differ = "differed" if test.significant else "were not shown to differ"
    return f"{named} {differ} (their ratio {ratio_ci(test)}; {statistic(test)}{size(test)})."
