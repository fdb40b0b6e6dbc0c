"""Malformed input: rows of the tables of wrong statements and of people's data."""

from __future__ import annotations

import dataclasses
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from reruns import Lines

from focalgradient.cli import main
from focalgradient.errors import InputError
from focalgradient.stimuli import read_set

TESTS = Path(__file__).parents[1] / "tests"
sys.path += [str(TESTS), str(TESTS / "fuzz"), str(TESTS / "experiments")]

CASES = 300
"""Number of fuzzer inputs in its row, which take some minutes."""


def _outcomes(tries: list[Callable[[], object]]) -> str:
    """Count calls that end neither in a result nor in an `InputError`."""
    wrong = 0
    for one in tries:
        try:
            one()
        except InputError:
            pass
        except Exception:
            wrong += 1
    return f"{wrong} tracebacks in {len(tries)} calls"


def _wide_table() -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.csv")
        path.write_text(",".join(f"c{n}" for n in range(1_000_000)) + "\n" + "1," * 999_999 + "1\n")
        start = time.perf_counter()
        try:
            main(["report", str(path), "--out", str(Path(folder, "out"))])
        except SystemExit as end:
            return f"exit code {end.code} after {time.perf_counter() - start:.0f} s"
    return "no refusal"


def _manifest() -> str:
    make_set, tests = import_module("headless").make_set, import_module("test_wrong_types")
    with tempfile.TemporaryDirectory() as folder:
        make_set(Path(folder), ["a"], (40, 30))
        path = Path(folder, "manifest.json")
        whole = json.loads(path.read_text())
        whole["pictures"] = whole["pictures"][:1]
        tries: list[Callable[[], object]] = []
        for node, key in list(tests.leaves(whole)):
            kept = node[key]
            for value in tests.VALUES:
                node[key] = value
                tries.append(partial(_read, path, json.dumps(whole)))
            node[key] = kept
        return _outcomes(tries)


def _read(path: Path, text: str) -> None:
    path.write_text(text)
    found = read_set(path.parent)
    for name in found.scenes:
        found.scene(name)


def _constructors() -> str:
    tests = import_module("test_wrong_types")
    tries: list[Callable[[], object]] = []
    for value in tests.WRONG.values():
        for record in tests.RECORDS:
            one: Any = record
            for field in dataclasses.fields(one):
                tries.append(partial(dataclasses.replace, one, **{field.name: value}))
        for factory, given in tests.FACTORIES.items():
            for name in given:
                tries.append(partial(factory, **given | {name: value}))
    return _outcomes(tries)


def _fuzz() -> str:
    os.environ.pop("DISPLAY", None)
    commands = import_module("commands")
    with import_module("doors").silent():
        failed = sum(bool(commands.case(seed)[1]) for seed in range(CASES))
    return f"{failed} of {CASES}"


def register_statements(table: Lines) -> None:
    """Add the rows of section 3."""
    table.line("3.5.1", "`report` on a CSV of 1,000,000 columns", "no end within 150 s")(_wide_table)
    table.line("3.5.2", "`manifest.json`, 8 wrong values in each place", "39 tracebacks in 536 calls")(_manifest)
    table.line("3.5.3", "13 wrong values in each field of scenes and records", "765 tracebacks in 1339 calls")(
        _constructors
    )


def register_data(table: Lines) -> None:
    """Add the rows of section 1."""
    table.line("1.12", f"{CASES} malformed inputs to every command (tests/fuzz/commands.py)", "2 of 300")(_fuzz)
