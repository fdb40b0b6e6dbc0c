"""Signature of progress callbacks."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress"]

Progress = Callable[[float, str], object]
"""Callback that receives the fraction of the work done, 0 to 1, and a short description of the current step."""
