"""Random draws that are the same on every machine, with every version of every library.

NumPy promises this of its bit generators, but not of what is drawn from them: shuffles are made here.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import TypeVar

from numpy.random import PCG64, SeedSequence

__all__ = ["Draws", "digest"]

Item = TypeVar("Item")

WORD = 2**64
"""The bit generator's numbers lie below it."""


def digest(*names: object) -> int:
    """Make a number of 256 bits of what names a stream: another name, another number.

    >>> digest("a", "bc") == digest("ab", "c")
    False
    """
    text = "".join(f"{len(str(name))}:{name}," for name in names)
    return int.from_bytes(hashlib.sha256(text.encode()).digest(), "big")


class Draws:
    """A stream of draws, named by what it is for.

    >>> Draws("depthrating", 1987, "pair 1").shuffled("abcdef")
    ['c', 'f', 'e', 'a', 'd', 'b']
    """

    def __init__(self, *names: object):
        self._words = PCG64(SeedSequence(digest(*names)))

    def below(self, count: int) -> int:
        """Draw a whole number from 0 to `count` - 1, each as likely as the other."""
        fair = WORD - WORD % count
        while (word := int(self._words.random_raw())) >= fair:
            pass
        return word % count

    def shuffled(self, items: Iterable[Item]) -> list[Item]:
        """Put the items in random order."""
        order = list(items)
        for last in range(len(order) - 1, 0, -1):
            other = self.below(last + 1)
            order[last], order[other] = order[other], order[last]
        return order
