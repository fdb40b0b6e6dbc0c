"""How loops over pixels are compiled: without the GIL, and kept beside their source for the next process."""

from __future__ import annotations

from numba import njit

__all__ = ["compiled", "inlined", "reordered"]

compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
"""Compile a loop whose sums keep their order."""

inlined = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
"""The same for a function called once for each pixel or ray: inlining doubles the speed."""

reordered = njit(nogil=True, cache=True, error_model="numpy", fastmath=True)
"""Compile a loop whose sums may be reordered, and whose values are finite."""
