"""Memory limits: detect work that cannot fit into memory and reject it before it begins."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from focalgradient.errors import InputError

__all__ = ["available", "require"]

GB = 1024**3


def available() -> int | None:
    """Return the bytes that this process may still allocate (machine, container, own limit); None if unknown."""
    return min(_limits(), default=None)


def require(needed: float, what: str, remedy: str) -> None:
    """Raise `InputError` for work that needs more memory than is available.

    Parameters
    ----------
    needed
        Estimated memory in bytes.
    what
        Description of the work, with which the message begins.
    remedy
        Remedy, with which the message ends.

    Raises
    ------
    InputError
        If less memory is known to be available.

    Examples
    --------
    >>> require(1e6, "this", "take less")
    """
    there = available()
    if there is not None and needed > there:
        raise InputError(
            f"{what} needs about {needed / GB:.1f} GB of memory, but {max(there, 0) / GB:.1f} GB are available: "
            f"{remedy}."
        )


def _limits() -> Iterator[int]:
    if sys.platform == "linux":
        yield from _linux()
    elif sys.platform == "win32":
        yield from _windows()
    with suppress(ImportError, AttributeError, OSError, ValueError):
        import resource

        soft = resource.getrlimit(resource.RLIMIT_AS)[0]
        if soft != resource.RLIM_INFINITY:
            yield soft - _taken()


def _taken() -> int:
    """Return the bytes of address space that this process uses; 0 if unknown."""
    with suppress(OSError, ValueError, IndexError):
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        return pages * os.sysconf("SC_PAGE_SIZE")
    return 0


def _linux() -> Iterator[int]:
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            name, _, rest = line.partition(":")
            if name == "MemAvailable":
                yield 1024 * int(rest.split()[0])
    # Control groups, version 2, then 1; cached file pages can be dropped and count as free.
    for folder, limit, used, dropped in (
        ("", "memory.max", "memory.current", "inactive_file"),
        ("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    ):
        root = Path("/sys/fs/cgroup", folder)
        with suppress(OSError, ValueError, KeyError):  # "max", not a number, means no limit
            counts = dict(line.split() for line in (root / "memory.stat").read_text().splitlines())
            yield int((root / limit).read_text()) - int((root / used).read_text()) + int(counts[dropped])


def _windows() -> Iterator[int]:
    class Status(ctypes.Structure):
        _fields_ = (
            ("length", ctypes.c_uint32),
            ("load", ctypes.c_uint32),
            *((name, ctypes.c_uint64) for name in ("total", "free", "all_pages", "free_pages")),
            *((name, ctypes.c_uint64) for name in ("all_own", "free_own", "free_extended")),
        )

    status = Status(length=ctypes.sizeof(Status))
    if ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)):  # type: ignore[attr-defined,unused-ignore]
        yield status.free_pages
