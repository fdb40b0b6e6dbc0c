"""Compare two files of numbers: `python analysis/compare_numbers.py OLD NEW [--relative 1e-6] [--only fig4 ...]`.

Reports numbers that differ by more than a relative tolerance or occur in one file only, with exit code 1 if there are
any. Computation times are ignored.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

TIMING = re.compile(r"\bmilliseconds per\b")
"""Pattern of names of computation times."""

SHOWN = 40
"""Maximum number of differences listed."""


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield each number, text or null of nested JSON with its path, without computation times."""
    if isinstance(value, dict):
        for key, item in value.items():
            if not TIMING.search(key):
                yield from leaves(item, f"{path}/{key}")
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield from leaves(item, f"{path}[{number}]")
    else:
        yield path, value


def differences(old: Any, new: Any, relative: float) -> list[str]:
    """Return the differences between two JSON values as lines of text.

    >>> differences({"a": [1.0, 2.0], "b": 1}, {"a": [1.0, 2.002], "c": 1}, 1e-6)
    ['/a[1]: 2.0 -> 2.002 (relative 0.001)', '/b: only in the old', '/c: only in the new']
    """
    before, after = dict(leaves(old)), dict(leaves(new))
    found = []
    for path, one in before.items():
        if path not in after:
            found.append(f"{path}: only in the old")
            continue
        other = after[path]
        numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in (one, other))
        if numbers and not math.isclose(one, other, rel_tol=relative, abs_tol=1e-12):
            share = abs(other - one) / max(abs(one), 1e-300)
            found.append(f"{path}: {one} -> {other} (relative {share:.2g})")
        elif not numbers and one != other:
            found.append(f"{path}: {one!r} -> {other!r}")
    return found + [f"{path}: only in the new" for path in after if path not in before]


def main() -> int:
    parser = argparse.ArgumentParser(description="Compare two files of numbers.")
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--relative", type=float, default=1e-6, help="tolerance (default: 1e-6)")
    parser.add_argument("--only", nargs="*", metavar="FIGURE", help="compare these figures only")
    options = parser.parse_args()
    old, new = (json.loads(path.read_text(encoding="utf-8")) for path in (options.old, options.new))
    if options.only is not None:
        old, new = ({name: numbers[name] for name in options.only if name in numbers} for numbers in (old, new))
    found = differences(old, new, options.relative)
    for line in found[:SHOWN]:
        print(line)
    if len(found) > SHOWN:
        print(f"... and {len(found) - SHOWN} more")
    count = sum(1 for _ in leaves(new))
    print(f"{count} numbers and texts in {', '.join(new)}: {len(found)} differ by more than {options.relative:g}.")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
