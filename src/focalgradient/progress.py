"""Signature of progress callbacks, and their division among the parts of a work."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress", "part_of", "silent"]

Progress = Callable[[float, str], object]
"""Callback that receives the fraction of the work done, 0 to 1, and a short description of the current step."""


def silent(share: float, words: str) -> None:
    """Report no progress."""


def part_of(progress: Progress, number: int, count: int) -> Progress:
    """Return the callback for part `number`, from 0, of `count` equal parts of the work.

    >>> part_of(lambda share, words: print(share, words), 1, 4)(0.5, "blurring")
    0.375 blurring
    """
    return lambda share, words: progress((number + share) / count, words)
