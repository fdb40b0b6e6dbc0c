"""Wording of exclusion criteria for preregistrations and reports, and results with and without exclusions."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any

import pandas as pd

from focalgradient.report.document import Block, Notice, Paragraph, Table
from focalgradient.scales import Analysis
from focalgradient.statistics import (
    Effect,
    NotComputed,
    Quality,
    Rules,
    as_table,
)
from focalgradient.statistics.criteria import WORDING
from focalgradient.statistics.judging import MIN_ANSWERS
from focalgradient.statistics.questions import Answer
from focalgradient.statistics.wording import SPACE, decimals, freedom, interval, many, number, probability
from focalgradient.user_tables.names import few

__all__ = [
    "CUBE_CATCH",
    "EFFECT",
    "always_the_same",
    "both_results",
    "catch_answers",
    "criteria",
    "exclusions_table",
    "main_results",
    "with_and_without",
]

CUBE_CATCH = "a truly nonrigid shape, seen so for more than {rules.catch_share:.0%} of the time with a reading"
"""Criterion for passing a catch trial of the cube."""


def catch_answers(analysis: Analysis, catches: Collection[str] = ("standard",)) -> str:
    """Return the criterion for passing a catch trial of depth ratings."""
    near = "within a factor {rules.catch_factor:g} of 1" if analysis.ratios else "within one step of 0"
    kinds = []
    if "standard" in catches and analysis.standard_known:
        kinds.append(f"the standard itself, rated {near}")
    if {"flatter", "deeper"} & set(catches):
        right = "chosen correctly" if analysis.binary else "rated on its side of the scale’s middle"
        kinds.append(f"a clearly flat or deep drawing, {right}")
    return "; ".join(kinds)


def criteria(rules: Rules, unjudged: Mapping[str, str], catch: str) -> list[str]:
    """Return sentences on the rules that are applied and on those that cannot be.

    Parameters
    ----------
    rules
        Rules stated in advance.
    unjudged
        Relevant rules that cannot be applied, with the reasons, by field.
    catch
        Criterion for passing a catch trial: `CUBE_CATCH`, or the result of `catch_answers`.

    Examples
    --------
    >>> criteria(Rules(), {"response_time": "response times were not recorded"}, CUBE_CATCH)[1]
    'Rules that could not be applied: bounds of the response time (response times were not recorded).'
    """
    cube = catch == CUBE_CATCH
    values = {"rules": rules, "catch": catch.format(rules=rules)}
    stated, who = list[str](), list[str]()
    for name, rule in WORDING.items():
        clause = rule.clause_of_cube * cube or rule.clause
        applies = clause and (rule.cube if cube else rule.ratings) and name not in unjudged
        if applies and getattr(rules, name) is not None:
            (who if rule.reason else stated).append(clause.format(**values))
    if who:
        stated.append(f"subjects were left out who {', or '.join(who)}")
    sentences = [
        f"By rules that do not look at the effect, {'; '.join(stated)}." if stated else "No exclusion rule was applied."
    ]
    if unjudged:
        reasons: dict[str, list[str]] = {}
        for name, reason in unjudged.items():
            reasons.setdefault(reason, []).append(WORDING[name].name)
        listed = "; ".join(f"{', '.join(names)} ({reason})" for reason, names in reasons.items())
        sentences.append(f"Rules that could not be applied: {listed}.")
    return sentences


def always_the_same(rows: pd.DataFrame) -> list[str]:
    """Return a notice that names the subjects who gave one and the same answer in all their trials, five or more.

    >>> always_the_same(pd.DataFrame({"participant_id": [*"AAAAABBBBB"], "rating": [3.0] * 9 + [4.0]}))
    ['One and the same answer in all trials: A (3). No rule of exclusion leaves them out.']
    """
    given = rows.groupby("participant_id")["rating"]
    same = given.first()[(given.nunique() == 1) & (given.size() >= MIN_ANSWERS)]
    who = few([f"{name} ({answer:g})" for name, answer in same.items()])
    return [f"One and the same answer in all trials: {who}. No rule of exclusion leaves them out."] if len(same) else []


EFFECT = "_exclusions_effect.csv"
"""Suffix of the files with results with and without exclusions."""


WITH, WITHOUT = "with exclusions", "without exclusions"


def both_results(answers: Iterable[Answer], *, excludes: bool) -> list[tuple[str, Answer]]:
    """Return the main results with and without exclusions; all are without them where nobody `excludes`."""
    main = [answer for answer in answers if answer.headline]
    kept = [answer for answer in main if not answer.role.startswith("without")]
    if not excludes:
        return [(WITHOUT, answer) for answer in kept]
    everyone = [answer for answer in main if answer.role == WITHOUT]
    return [*((WITH, answer) for answer in kept), *((WITHOUT, answer) for answer in everyone or kept)]


def main_results(both: Iterable[tuple[str, Answer]]) -> list[dict[str, Any]]:
    """Return the main results with and without exclusions for JSON, in the unit that `what` names; None if missing."""
    found = []
    for which, answer in both:
        row: dict[str, Any] = {"exclusions": which, "what": answer.headline}
        if isinstance(answer.outcome, Effect):
            ends = zip(("value", "value_low", "value_high"), ("estimate", "low", "high"), strict=True)
            row |= {name: answer.displayed(getattr(answer.outcome, end)) for name, end in ends}
        elif answer.n is not None:
            row["subjects"] = answer.n
        fields = as_table([answer.outcome]).astype(object)
        for key, value in fields.where(fields.notna(), None).to_dict("records")[0].items():
            row[str(key)] = list(value) if isinstance(value, tuple) else value
        found.append(row)
    return found


def with_and_without(found: Quality | None, both: Iterable[tuple[str, Answer]]) -> Iterator[Block]:
    """Yield notices of conclusions that change with exclusions, and sentences on the results without them.

    `found` is None where single trials at most can be excluded.
    """
    if found and not found.exclusions:
        yield Paragraph("The rules left out nobody and no trial.")
        return
    of: dict[str, list[Answer]] = {WITH: [], WITHOUT: []}
    for which, answer in both:
        of[which].append(answer)
    if found or of[WITH]:
        yield from map(Notice, changed(of[WITH], of[WITHOUT]))
    if found and of[WITHOUT]:
        results = "; ".join(f"{answer.headline}: {_in_words(answer)}" for answer in of[WITHOUT])
        counted = f"{many(found.subjects_before, 'subject')}, {many(found.trials_before, 'trial')}"
        yield Paragraph(f"Without exclusions ({counted}): {results}.")


def exclusions_table(both: Iterable[tuple[str, Answer]], name: str) -> Table:
    """Return the main results with and without exclusions for display, each result in two rows."""
    rows = [[answer.headline, which, *_cells(answer)] for which, answer in both]
    order = list(dict.fromkeys(row[0] for row in rows if row[1] == WITHOUT))
    rows.sort(key=lambda row: order.index(row[0]) if row[0] in order else 0)
    header = ["result", "data", "subjects", "estimate", f"95{SPACE}%", "test", "p (p_Holm where corrected)"]
    return Table("Main results with and without exclusions", header, rows, csv=f"{name}{EFFECT}")


def _cells(one: Answer) -> list[str]:
    """Return subjects, estimate, interval, Student's t and p."""
    found = one.outcome
    if isinstance(found, NotComputed):
        return ["–", "–", "–", found.reason, "–"]
    assert isinstance(found, Effect)
    ends = interval(one.displayed(found.low), one.displayed(found.high))
    test = f"t({freedom(found.df)}){SPACE}={SPACE}{decimals(found.statistic)}"
    p = probability(found.corrected_p)
    return [str(found.subjects), number(one.displayed(found.estimate)), ends, test, p]


def _in_words(one: Answer) -> str:
    if isinstance(one.outcome, NotComputed):
        return f"not tested ({one.outcome.reason.rstrip('.')})"
    _, estimate, ends, test, p = _cells(one)
    return f"{estimate}, 95{SPACE}% CI {ends}, {test}, p {p if p.startswith('<') else f'= {p}'}"


def changed(kept: Iterable[Answer], everyone: Iterable[Answer]) -> Iterator[str]:
    """Yield a notice for each conclusion that depends on exclusions."""
    of = {one.headline: one.outcome for one in kept}
    for other in everyone:
        effect = of.get(other.headline)
        tests = [test for test in (effect, other.outcome) if isinstance(test, Effect)]
        if len({test.significant for test in tests}) == 2 or (len(tests) == 1 and tests[0].significant):
            with_, without = (
                f"p {p if p.startswith('<') else f'= {p}'}" if isinstance(test, Effect) else "not tested"
                for test in (effect, other.outcome)
                for p in [probability(test.corrected_p) if isinstance(test, Effect) else ""]
            )
            yield f"Exclusions decide: {other.headline}, {with_} {WITH} and {without} {WITHOUT}."
