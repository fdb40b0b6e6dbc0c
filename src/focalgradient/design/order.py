"""Trial order: random, without long runs of one condition, and counterbalanced between participants.

Participants form pairs, 01 with 02, 03 with 04 and so on: the second has the first's order reversed. Over a pair, the
mean position of each trial is thus the middle, and linear trends over a session (practice, fatigue) affect all
conditions equally.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, TypeVar

from focalgradient.design.draws import Draws, digest
from focalgradient.errors import InputError

__all__ = ["Place", "check_label", "in_order", "scatter", "spans_of"]

Item = TypeVar("Item")

MOST_SHUFFLES = 8
"""Maximum number of initial shuffles in the search for an order without long runs."""

NAMED_PLACES = 2 * 55_440
"""Number of places for participants whose label is not a number: two for each of 55440 pairs. 55440 is a multiple of 1
to 12, so that up to 12 combinations of between-participant levels are equally probable."""

MOST_EXCHANGES = 40
"""Number of exchanges tried for each trial in a long run."""


def check_label(what: str, label: str) -> None:
    """Raise `InputError` for a label that cannot be part of a BIDS file name.

    Raises
    ------
    InputError
        If `label` does not consist of letters and digits only.

    Examples
    --------
    >>> check_label("participant", "07")
    >>> check_label("participant", "0_7")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: participant label is '0_7', but must be letters and digits only, ...
    """
    if not (label.isascii() and label.isalnum()):
        raise InputError(
            f"{what} label is {label!r}, but must be letters and digits only, such as '01': leave out other characters."
        )


@dataclass(frozen=True, slots=True)
class Place:
    """A participant's position in the counterbalancing: random stream, and variants of order and keys.

    Numeric labels ("1", "01" and "001" are the same) are balanced exactly over four in a row; others on average.

    >>> [Place.of(label).mirrored for label in ("01", "02", "03", "04")]
    [False, True, False, True]
    >>> [Place.of(label).swapped for label in ("01", "02", "03", "04")]
    [False, False, True, True]
    """

    stream: str
    mirrored: bool
    """Whether the order is that of the pair's other participant, reversed."""
    swapped: bool
    """Whether the response keys are exchanged."""
    pair: int = 1
    """Number of the pair, from 1, which determines the levels of between-participant factors."""

    @classmethod
    def of(cls, participant: str) -> Place:
        """Return the position of a participant, by label.

        Raises
        ------
        InputError
            If the label is not alphanumeric.
        """
        check_label("the participant", participant)
        numbered = participant.isdigit()
        number = int(participant) if numbered else digest("place", participant) % NAMED_PLACES + 1
        pair = (number + 1) // 2
        return cls(f"pair {pair}" if numbered else f"label {participant}", number % 2 == 0, pair % 2 == 0, pair)


def in_order(
    blocks: Sequence[Sequence[Item]],
    factors: Callable[[Item], Sequence[Hashable]],
    *,
    longest: int,
    draws: Draws,
) -> list[Item]:
    """Shuffle each block so that no level of any factor occurs more than `longest` times in a row.

    Parameters
    ----------
    blocks
        Items shuffled within each block; the order of the blocks is kept.
    factors
        Function that returns the levels of an item, always the same number. Factors with a single level are ignored.
    longest
        Maximum number of consecutive items with the same level, also across block boundaries.
    draws
        Random stream.

    Raises
    ------
    InputError
        If no such order exists, or none was found.

    Examples
    --------
    >>> in_order([["near", "near", "far", "far"]], lambda item: [item], longest=1, draws=Draws("a"))
    ['far', 'near', 'far', 'near']
    """
    spans = spans_of(blocks)
    for _ in range(MOST_SHUFFLES):
        order = [item for block in blocks for item in draws.shuffled(block)]
        columns = [list(column) for column in zip(*(factors(item) for item in order), strict=True)]
        columns = [column for column in columns if len(set(column)) > 1]
        for column in columns:
            _check_possible(Counter(column), longest)
        if _break_runs(order, columns, spans, longest, draws):
            return order
    raise InputError(
        f"no order of the {sum(map(len, blocks))} trials was found with each condition at most {longest} times "
        "in a row: raise longest_run."
    )


def spans_of(blocks: Sequence[Sequence[object]]) -> list[tuple[int, int]]:
    """Return place of the first item and number of items of each item's block.

    >>> spans_of(["ab", "c"])
    [(0, 2), (0, 2), (2, 1)]
    """
    starts = accumulate((len(block) for block in blocks), initial=0)
    return [(start, len(block)) for start, block in zip(starts, blocks, strict=False) for _ in block]


def _check_possible(counts: Counter[Hashable], longest: int) -> None:
    level, most = counts.most_common(1)[0]
    others = sum(counts.values()) - most
    if most > longest * (others + 1):
        raise InputError(
            f"{most} trials have {level!r} and only {others} another level, which cannot be ordered with "
            f"at most {longest} in a row: raise longest_run, or balance the conditions."
        )


def _break_runs(
    order: list[Item], columns: list[list[Hashable]], spans: list[tuple[int, int]], longest: int, draws: Draws
) -> bool:
    """Exchange trials in long runs with others of their block, in place; return whether no long run is left."""

    def excess(place: int) -> int:
        """Return the excess length of the runs through a position, summed over factors."""
        found = 0
        for column in columns:
            level, first, last = column[place], place, place
            while first and column[first - 1] == level:
                first -= 1
            while last + 1 < len(column) and column[last + 1] == level:
                last += 1
            if last - first >= longest:
                found += last - first + 1 - longest
        return found

    def exchange(one: int, other: int) -> None:
        for row in rows:
            row[one], row[other] = row[other], row[one]

    rows: list[list[Any]] = [order, *columns]
    wrong = sum(map(excess, range(len(order))))
    while wrong:
        before = wrong
        for place in range(len(order)):
            start, size = spans[place]
            for _ in range(MOST_EXCHANGES):
                now = excess(place)
                if not now:
                    break
                other = start + draws.below(size)
                now += excess(other)
                exchange(place, other)
                if excess(place) + excess(other) > now:
                    exchange(place, other)
        wrong = sum(map(excess, range(len(order))))
        if wrong >= before:
            return False
    return True


def scatter(items: Sequence[Item], among: Sequence[Item], draws: Draws) -> list[Item]:
    """Insert `items` among the others, one at random in each of equally long stretches, never first.

    >>> scatter(["catch"] * 2, ["a"] * 6, Draws("b")).count("catch")
    2
    """
    mixed = list(among)
    edges = [round(number * len(among) / len(items)) for number in range(len(items) + 1)] if items else []
    for number in reversed(range(len(items))):
        start, end = max(edges[number], 1), edges[number + 1]
        mixed.insert(start + draws.below(max(end - start, 1)), items[number])
    return mixed
