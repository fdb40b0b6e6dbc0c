"""Orders of conditions: balanced Latin squares, blocks, and constrained random orders."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field

from focalgradient.design.draws import Draws, digest
from focalgradient.design.order import spans_of
from focalgradient.design.plan import Plan, Trial
from focalgradient.errors import InputError

__all__ = ["Counterbalanced", "balanced_latin_square", "constrained"]

Item = TypeVar("Item")
Kind = TypeVar("Kind", bound=Trial)

MOST_SHUFFLES = 20
"""Maximum number of initial shuffles in the search for an order that meets the constraints."""

MOST_SWEEPS = 200
"""Maximum number of passes per shuffle; each exchanges the trials that violate a constraint for random ones."""


def balanced_latin_square(count: int) -> tuple[tuple[int, ...], ...]:
    """Return the rows of a balanced Latin square (Williams 1949, Aust. J. Sci. Res. A 2:149).

    Over all rows, each of the `count` conditions (numbered from 0) occurs equally often in each position, and equally
    often directly after each other condition. There are `count` rows if it is even, and twice as many if it is odd.

    Parameters
    ----------
    count
        Number of conditions, at least 1.

    Examples
    --------
    >>> balanced_latin_square(4)
    ((0, 3, 1, 2), (1, 0, 2, 3), (2, 1, 3, 0), (3, 2, 0, 1))
    >>> len(balanced_latin_square(3))
    6
    """
    if count < 1:
        raise InputError(f"count is {count}, but must be 1 or more.")
    first = [(number + 1) // 2 if number % 2 == 0 else count - (number + 1) // 2 for number in range(count)]
    rows = [tuple((one + shift) % count for one in first) for shift in range(count)]
    return tuple(rows if count % 2 == 0 else [*rows, *(row[::-1] for row in rows)])


def constrained(
    blocks: Sequence[Sequence[Item]],
    levels: Sequence[Mapping[str, Hashable]],
    *,
    runs: Mapping[str, int],
    distances: Mapping[str, int],
    draws: Draws,
) -> list[Item]:
    """Shuffle each block so that constraints on the order hold over the whole list.

    Parameters
    ----------
    blocks
        Items shuffled within each block; the order of the blocks is kept.
    levels
        Levels of each item by factor, in the order of the blocks.
    runs
        Maximum number of consecutive trials with the same level, by factor.
    distances
        Minimum number of other trials between two with the same level, by factor.
    draws
        Random stream.

    Raises
    ------
    InputError
        If no such order was found.

    Examples
    --------
    >>> levels = [{"side": side} for side in "aabb"]
    >>> "".join(constrained([list("aabb")], levels, runs={"side": 1}, distances={}, draws=Draws("a")))
    'baba'
    """
    of_item = iter(levels)
    items = [[(item, next(of_item)) for item in block] for block in blocks]
    spans = spans_of(blocks)
    reach = max([*runs.values(), *distances.values()], default=0)

    def wrong(order: list[Any], place: int) -> int:
        """Count violated constraints that start at a position, or within reach before it."""
        found = 0
        for at in range(max(place - reach, 0), place + 1):
            own = order[at][1]
            for name, most in runs.items():
                row = order[at : at + most + 1]
                found += len(row) > most and all(one[1][name] == own[name] for one in row)
            for name, least in distances.items():
                found += sum(one[1][name] == own[name] for one in order[at + 1 : at + 1 + least])
        return found

    for _ in range(MOST_SHUFFLES):
        order = [item for block in items for item in draws.shuffled(block)]
        for _ in range(MOST_SWEEPS):
            broken = [place for place in range(len(order)) if wrong(order, place)]
            if not broken:
                return [item for item, _ in order]
            for place in broken:
                first, size = spans[place]
                other = first + draws.below(size)
                before = wrong(order, place) + wrong(order, other)
                order[place], order[other] = order[other], order[place]
                if wrong(order, place) + wrong(order, other) > before:
                    order[place], order[other] = order[other], order[place]
    limits = ", ".join([*(f"{name} at most {n} in a row" for name, n in runs.items())])
    limits += ", " * bool(limits and distances) + ", ".join(f"{name} {n} apart" for name, n in distances.items())
    raise InputError(
        f"no order of the {len(levels)} trials was found with {limits}: relax the constraints, or balance the "
        "conditions."
    )


Fields = Annotated[tuple[str, ...], Field(description="a list of settings of a trial")]
Counts = Annotated[dict[str, int], Field(description="a table of numbers of trials, by setting of a trial")]


class Counterbalanced(Plan):
    """Base class of user-defined designs whose `ordered` counterbalances by the participant's number.

    Settings
    --------
    blocked
        Fields of a trial whose levels are blocked, outermost first; all others are mixed within blocks.
    block_order
        "latin-square": participants take the block orders of a balanced Latin square in turn. "random": drawn for each
        participant.
    condition_order
        "random": conditions are shuffled within each repetition. "latin-square": conditions follow the rows of a
        square, the next row in each repetition and for each participant, so that every row occurs with every order of
        blocks.
    runs, distances
        Constraints on a random order, by field of a trial: maximum number of consecutive trials with the same level;
        minimum number of other trials between two with the same level.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, slots=True, kw_only=True)
    ... class SideTrial(Trial):
    ...     side: str
    ...     size: int
    >>> class Sides(Counterbalanced):
    ...     task: str = "sides"
    ...     def trials(self, participant, session=None):
    ...         return self.ordered(participant, session, [SideTrial(side=s, size=n) for s in "lr" for n in (1, 2)])
    >>> [[one.side for one in Sides(blocked=["side"]).trials(label)] for label in ("01", "02")]
    [['l', 'l', 'r', 'r'], ['r', 'r', 'l', 'l']]
    """

    blocked: Fields = ()
    block_order: Literal["latin-square", "random"] = "latin-square"
    condition_order: Literal["random", "latin-square"] = "random"
    runs: Counts = Field(default_factory=dict)
    distances: Counts = Field(default_factory=dict)

    def ordered(self, participant: str, session: str | None, conditions: Sequence[Kind]) -> tuple[Kind, ...]:
        """Return conditions, each `repetitions` times, in a participant's order, preceded by `practice_trials` of them.

        Raises
        ------
        InputError
            If a setting names an unknown field of the trials, or no order meets the constraints.
        """
        self._check_names(conditions[0])
        number = int(participant) if participant.isdigit() else digest("place", participant) % 1000
        draws = self.draws(participant, session, f"order {participant.lstrip('0')}")
        blocks = self._blocks(list(conditions), self.blocked, number, draws)
        order = self._within(blocks, number, draws)
        practice = draws.rounds(conditions, self.practice_trials)
        return self.numbered(practice, order)

    def _check_names(self, trial: Trial) -> None:
        for setting in ("blocked", "runs", "distances"):
            for name in getattr(self, setting):
                if not hasattr(trial, name):
                    raise InputError(f"{setting} names {name!r}, which is not a field of a trial: name one that is.")
        if self.condition_order == "latin-square" and (self.runs or self.distances):
            raise InputError("runs and distances constrain random orders only: leave them out of a Latin square.")

    def _blocks(self, conditions: list[Kind], fields: Sequence[str], number: int, draws: Draws) -> list[list[Kind]]:
        """Divide conditions by the levels of the blocked fields, in the participant's order of blocks."""
        if not fields:
            return [conditions]
        levels = [*dict.fromkeys(getattr(one, fields[0]) for one in conditions)]
        rows = balanced_latin_square(len(levels))
        order = [levels[one] for one in rows[(number - 1) % len(rows)]]
        if self.block_order == "random":
            order = draws.shuffled(levels)
        apart = [[one for one in conditions if getattr(one, fields[0]) == level] for level in order]
        # The next field takes its next row after all rows of this field, so that all combinations occur.
        inner = (number - 1) // len(rows) + 1
        return [block for own in apart for block in self._blocks(own, fields[1:], inner, draws)]

    def _within(self, blocks: list[list[Kind]], number: int, draws: Draws) -> list[Kind]:
        if self.condition_order == "latin-square":
            order = []
            levels = [{getattr(one, name) for block in blocks for one in block} for name in self.blocked]
            block_orders = math.prod(len(balanced_latin_square(len(own))) for own in levels)
            for block in blocks:
                rows = balanced_latin_square(len(block))
                # Where both cycles return together, one row is skipped: otherwise each order of blocks would meet only
                # some of the rows.
                common = math.gcd(block_orders, len(rows))
                skipped = (number - 1) // math.lcm(block_orders, len(rows)) % common
                for repetition in range(self.repetitions):
                    order += [block[one] for one in rows[(number - 1 + skipped + repetition) % len(rows)]]
            return order
        repeated = [block for block in blocks for _ in range(self.repetitions)]
        names = {*self.runs, *self.distances}
        own = [{name: getattr(one, name) for name in names} for block in repeated for one in block]
        return constrained(repeated, own, runs=self.runs, distances=self.distances, draws=draws)
