"""Random draws that are identical on every machine and with every version of every library.

NumPy guarantees stable streams for its bit generators, but not for the distributions: shuffles are implemented here.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import TypeVar

from numpy.random import PCG64, SeedSequence

__all__ = ["Draws", "digest"]

Item = TypeVar("Item")

WORD_LIMIT = 2**64
"""Upper limit of the bit generator's integers (exclusive)."""


def digest(*names: object) -> int:
    """Return a 256-bit number that identifies a stream by its names.

    >>> digest("a", "bc") == digest("ab", "c")
    False
    """
    text = "".join(f"{len(str(name))}:{name}," for name in names)
    return int.from_bytes(hashlib.sha256(text.encode()).digest(), "big")


class Draws:
    """Stream of random draws, identified by its names.

    >>> Draws("depthrating", 1987, "pair 1").shuffled("abcdef")
    ['c', 'f', 'e', 'a', 'd', 'b']
    """

    def __init__(self, *names: object):
        self._words = PCG64(SeedSequence(digest(*names)))

    def below(self, count: int) -> int:
        """Draw a uniformly distributed whole number from 0 to `count` - 1."""
        fair = WORD_LIMIT - WORD_LIMIT % count
        while (word := int(self._words.random_raw())) >= fair:
            pass
        return word % count

    def shuffled(self, items: Iterable[Item]) -> list[Item]:
        """Return the items in random order."""
        order = list(items)
        for last in range(len(order) - 1, 0, -1):
            other = self.below(last + 1)
            order[last], order[other] = order[other], order[last]
        return order

    def rounds(self, items: Iterable[Item], count: int) -> list[Item]:
        """Return `count` items in rounds: each round has all of them, in a new random order.

        >>> sorted(Draws("practice").rounds("ab", 4)[:2])
        ['a', 'b']
        """
        whole, drawn = list(items), list[Item]()
        while whole and len(drawn) < count:
            drawn += self.shuffled(whole)
        return drawn[:count]
