"""Safety of people's data against outsiders, full disks and untrue texts.

    python benchmarks/data_safety.py [LINE ...]

Each row is one fault, with the result before it was fixed, and the present result.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path

import data_safety_conduct
import data_safety_server
import files_of_others
from reruns import Lines

TESTS = Path(__file__).parents[1] / "tests"

CASES = 300
"""Number of fuzzer inputs in its row, which take some minutes."""

TABLE = Lines("People's data: what outsiders, full disks and untrue texts could do to them")
data_safety_server.register(TABLE)
data_safety_conduct.register(TABLE)


@TABLE.line("1.12", f"{CASES} malformed inputs to every command (tests/fuzz/commands.py)", "2 of 300")
def _fuzz() -> str:
    os.environ.pop("DISPLAY", None)
    commands = import_module("commands")
    with import_module("doors").silent():
        failed = sum(bool(commands.case(seed)[1]) for seed in range(CASES))
    return f"{failed} of {CASES}"


files_of_others.register(TABLE)


if __name__ == "__main__":
    sys.path += [str(TESTS), str(TESTS / "fuzz")]
    TABLE.main()
