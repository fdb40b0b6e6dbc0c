"""How long work reports its progress: one signature in every room."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress"]

Progress = Callable[[float, str], object]
"""Called with the share of the work that is done, 0 to 1, and a few words on what is being done."""
