"""Whether a room's tests notice a wrong line: single changes of its code, drawn at random, and the tests run on each.

    python benchmarks/mutants.py ROOM [--number 20] [--seed 0] [--results mutants.csv] [--limit 300] [--slow]
        [--again | --all-again]

A mutant is one change of one expression in ``src/focalgradient/ROOM``: a comparison (== to !=; < to <= where a side is
a count, else to >=, as two measured quantities are equal with probability 0), an operator (+ to -, * to /, & to |, and
to or), a sign, ``not`` or ``~`` dropped, a number (a float times 1.5, a small integer plus 1), True for False.
Docstrings, texts, annotations, decorators, exceptions, assertions, warnings, ``strict=`` of `zip`, and what changes no
result by its kind, stay as they are: tolerances of optimisers (`STOPPING`) and guards against zero (`GUARD`).

The tests that `TESTS` lists for the room and its doctests, without those marked slow (``--slow`` runs them too), run
once on a temporary copy of the repository, and `executed.py` measures which lines each test executes. That table is
kept beside the results (``mutants-ROOM.json``); of tests that changed, and of all if the room's code changed, it is
made anew. Then each mutant runs, in a process forked from one that has loaded the libraries, only the tests that
execute the changed expression, files of little time first, up to the first that fails; after them the tests that start
processes, whose lines are unknown. A changed constant of a module runs the tests that execute functions of its file,
or of files that name it; a changed function that Numba compiles also those in files that name it or its module. A
mutant is caught if a test fails that passes on the unchanged copy. A run that reaches ``--limit`` seconds counts as
neither. The tests of other rooms and of the commands are not run, so the shares are lower bounds.

Each result is a row of the CSV file ``--results``; mutants with a row there are not run again, so that a run continues
where it was stopped. ``--again`` runs those of the room that survived again, after tests were added, and no others;
those whose code is no longer there are dropped. ``--all-again`` runs every mutant of the room that has a row again,
after tests were removed.
"""

from __future__ import annotations

import argparse
import ast
import csv
import hashlib
import importlib
import json
import os
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import pytest
from changes import PACKAGE, Change, Mutant, draw, files, found_again
from executed import Chosen, Executed
from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
TESTS: dict[str, Sequence[str]] = {
    "dataset": (
        "tests/test_dataset.py",
        *(f"tests/test_{name}.py" for name in ("append", "journal", "lock", "markers", "mend", "noted", "gaze")),
        *(f"tests/test_{name}.py" for name in ("trial_times", "session_conduct", "focus_sessions", "cli_validate")),
        "tests/test_counterbalanced.py",
        "tests/web/test_withdrawal.py",
        "tests/web/test_arrival.py",
        "tests/test_damages.py",
        "tests/experiments/test_ready_experiments.py",
    ),
    "depth": ("tests/depth/test_*.py", "tests/test_dual_pixel.py", "tests/test_calibration_pairs.py"),
    "eye": ("tests/eye/test_*.py", "tests/test_cli_eye.py", "tests/test_cli_accommodate.py"),
    "optics": (
        "tests/test_optics.py",
        "tests/test_lenses.py",
        "tests/test_dual_pixel.py",
        "tests/depth/test_own_blur.py",
    ),
    "power": ("tests/test_power.py", "tests/test_cli_power.py", "tests/test_kept_reports.py"),
    "psf": ("tests/test_psf.py", "tests/test_field.py", "tests/depth/test_shapes.py", "tests/render/test_shaped.py"),
    "report": (
        *("tests/test_report*.py", "tests/test_preregistration.py", "tests/test_cli_report.py"),
        *("tests/test_response_scales.py", "tests/test_blur_threshold.py", "tests/test_tasks.py"),
        *("tests/test_meta.py", "tests/test_scales.py", "tests/test_foreign_tables.py", "tests/test_kept_reports.py"),
        "tests/user_tables/test_*.py",
    ),
    "statistics": (
        "tests/statistics/test_*.py",
        *("tests/test_scales.py", "tests/test_power.py", "tests/test_report_own_*.py", "tests/test_kept_reports.py"),
        *("tests/test_meta.py", "tests/test_foreign_tables.py", "tests/test_user_tables.py"),
        *("tests/test_blur_threshold.py", "tests/test_task_file.py", "tests/test_report_adaptive.py"),
    ),
}
"""The tests of a room, besides its doctests: those most likely to fail first."""

HANG = 90
"""Seconds after which a single test counts as hung and fails."""

LOADED = ("PIL", "cv2", "llvmlite", "matplotlib", "numba", "numpy", "pandas", "pydantic", "scipy", "statsmodels")
"""Libraries that are loaded before a process is forked, as that takes seconds, and that work in it."""

COMPILED = re.compile(r"numba|focalgradient\.loops|_compiled\b")
"""What a module names whose functions Numba compiles."""


@dataclass(frozen=True)
class Result(Mutant):
    """A mutant, what became of it (caught, survived, time) and the test that failed."""

    outcome: str
    by: str
    seconds: str


def function_lines(source: str) -> set[int]:
    """The lines of a module inside its functions."""
    functions = [part for part in ast.walk(ast.parse(source)) if isinstance(part, ast.FunctionDef)]
    return {line for part in functions for line in range(part.body[0].lineno, (part.end_lineno or 0) + 1)}


def named_at(source: str, line: int) -> list[str]:
    """The names that a module gives at a line outside functions, or the function or class around it."""
    for part in ast.parse(source).body:
        if part.lineno <= line <= (part.end_lineno or part.lineno):
            targets = getattr(part, "targets", [getattr(part, "target", None)])
            return [part.name] if hasattr(part, "name") else [t.id for t in targets if isinstance(t, ast.Name)]
    return []


class Copy:
    """A copy of the repository in which one file at a time is changed, and tests run."""

    def __init__(self, folder: Path, room: str, table: Path, *, slow: bool, limit: float):
        self.folder, self.room, self.slow, self.limit = folder / "copy", room, slow, limit

        def left(path: str, names: list[str]) -> set[str]:
            caches = ["__pycache__"] if "tests" in path else []
            return shutil.ignore_patterns(".*", "_build", "results", "node_modules", *caches)(path, names)

        shutil.copytree(ROOT, self.folder, symlinks=True, ignore=left)
        self.failing: set[str] = set()
        self.table = table.resolve()
        self.tests: dict[str, dict[str, Any]] = self.measured()
        quickest = min(self.tests, key=lambda test: self.tests[test]["seconds"])
        outcome = self.run([quickest], limit)
        if outcome != ("passed", ""):
            raise SystemExit(f"{quickest} on the unchanged copy: {outcome}")

    def fork(self, seconds: float, work: Callable[[], object]) -> bool:
        """Run pytest in a child process, killed after that time; whether it ended before."""
        child = os.fork()
        if child == 0:
            try:
                os.setsid()
                os.chdir(self.folder)
                said = os.open(self.folder.parent / "said.txt", os.O_CREAT | os.O_WRONLY | os.O_TRUNC)
                os.dup2(said, 1)
                os.dup2(said, 2)
                os.environ["PYTHONPATH"] = str(self.folder / "src")
                os.environ["OPENBLAS_NUM_THREADS"] = "1"
                sys.path.insert(0, str(self.folder / "src"))
                sys.dont_write_bytecode = False
                work()
            except BaseException:
                traceback.print_exc()
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(0)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if os.waitpid(child, os.WNOHANG)[0]:
                return True
            time.sleep(0.02)
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return False

    def options(self) -> list[str]:
        """The options of pytest."""
        options = ["-q", "-rfE", "-n0", "-p", "no:cacheprovider", "--basetemp", str(self.folder.parent / "tests")]
        # A function or class of the package whose name begins with test, as `tested_of`, is not a test.
        options += ["-W", "ignore:Module already imported:pytest.PytestAssertRewriteWarning"]
        options += ["-o", f"faulthandler_timeout={HANG}", "-o", "python_functions=test_*"]
        options += ["-o", "python_classes=Test_*"]
        return options + ([] if self.slow else ["-m", "not slow"])

    def digest(self, test: Path, code: bytes) -> str:
        """What changes when a test or the room's code does."""
        return hashlib.sha256(test.read_bytes() + code + bytes([self.slow])).hexdigest()

    def measured(self) -> dict[str, dict[str, Any]]:
        """What each test of the room executes: of tests that changed measured now, of the others kept."""
        sources = files(self.folder, self.room)
        places = [path for pattern in TESTS[self.room] for path in sorted(self.folder.glob(pattern))]
        code = b"".join(path.read_bytes() for path in sources)
        digests = {
            path.relative_to(self.folder).as_posix(): self.digest(path, code)
            for path in [*sources, *dict.fromkeys(places)]
        }
        table = (
            json.loads(self.table.read_text(encoding="utf-8")) if self.table.exists() else {"files": {}, "modules": []}
        )
        kept = {file: row for file, row in table["files"].items() if row["digest"] == digests.get(file)}
        stale = [file for file in digests if file not in kept]
        self.load(table["modules"])
        if stale:
            began = time.monotonic()
            new = self.folder.parent / "executed.json"

            def work() -> None:
                plugin = Executed(self.folder / PACKAGE / self.room)
                pytest.main([*self.options(), *stale], plugins=[plugin])
                plugin.save(new, self.folder)

            self.fork(3600, work)
            said = json.loads(new.read_text(encoding="utf-8")) if new.exists() else None
            if not said or not said["tests"]:
                raise SystemExit((self.folder.parent / "said.txt").read_text(encoding="utf-8", errors="replace"))
            kept |= {file: {"digest": digests[file], "tests": {}} for file in stale}
            for test, row in said["tests"].items():
                kept[test.partition("::")[0]]["tests"][test] = row
            modules = sorted({*table["modules"], *said["modules"]})
            self.table.write_text(json.dumps({"files": kept, "modules": modules}), encoding="utf-8")
            self.load(modules)
            print(f"measured {len(said['tests'])} tests of {len(stale)} files in {time.monotonic() - began:.0f} s")
            for test in said["failed"]:
                print(f"left out, as it fails on the unchanged copy: {test}", flush=True)
        return {test: row for file in kept.values() for test, row in file["tests"].items()}

    def load(self, modules: Iterable[str]) -> None:
        """Load libraries, so that forked processes have them."""
        for name in modules:
            if name.partition(".")[0] in LOADED:
                with suppress(BaseException):
                    importlib.import_module(name)

    def write(self, file: str, source: str) -> None:
        """Write a module, and remove what was compiled of it; Numba compiles functions into those of other modules."""
        path = self.folder / PACKAGE / file
        path.write_text(source, encoding="utf-8")
        for compiled in path.parent.glob(f"__pycache__/{path.stem}.*"):
            compiled.unlink()
        if COMPILED.search(source):
            for compiled in self.folder.rglob("*.nb[ci]"):
                compiled.unlink()

    def chosen(self, new: Change) -> list[str]:
        """The tests that execute what is changed, and last those that start processes; files of little time first."""
        module = (PACKAGE / new.mutant.file).as_posix()
        source = (self.folder / module).read_text(encoding="utf-8")
        places = {module: set(new.lines or ())}
        seen = {line for row in self.tests.values() for line in row["lines"].get(module, ())}
        compiled = new.lines is not None and not places[module] & seen and bool(COMPILED.search(source))
        users: set[str] = set()
        if new.lines is None or compiled:
            names = "|".join([*named_at(source, new.mutant.line), *([Path(module).stem] if compiled else [])]) or "\0"
            for path in files(self.folder, self.room):
                text = path.read_text(encoding="utf-8")
                file = path.relative_to(self.folder).as_posix()
                if file == module or re.search(rf"\b({names})\b", text):
                    places[file] = function_lines(text)
            for file in {test.partition("::")[0] for test in self.tests} if compiled else ():
                if re.search(rf"\b({names})\b", (self.folder / file).read_text(encoding="utf-8")):
                    users.add(file)

        def executes(row: dict[str, Any]) -> bool:
            return any(not lines.isdisjoint(row["lines"].get(file, ())) for file, lines in places.items())

        executing = [test for test, row in self.tests.items() if executes(row) or test.partition("::")[0] in users]
        unknown = [test for test, row in self.tests.items() if row["starts_processes"] and test not in executing]
        time_of: dict[str, float] = {}
        for test in executing:
            file = test.partition("::")[0]
            time_of[file] = time_of.get(file, 0) + self.tests[test]["seconds"]

        def order(test: str) -> tuple[float, str, float]:
            file = test.partition("::")[0]
            return time_of.get(file, 0), file, self.tests[test]["seconds"]

        return [*sorted(executing, key=order), *sorted(unknown, key=order)]

    def run(self, tests: Sequence[str], seconds: float) -> tuple[str, str]:
        """What became of tests (passed, failed, time), and the first that failed."""
        if not tests:
            return "passed", "no test executes it"
        first, ended = self.folder.parent / "failed.txt", self.folder.parent / "ended.txt"
        first.unlink(missing_ok=True)
        ended.unlink(missing_ok=True)
        paths = list(dict.fromkeys(test.partition("::")[0] for test in tests))

        def work() -> None:
            if pytest.main(["-x", *self.options(), *paths], plugins=[Chosen(list(tests), first)]) == 0:
                ended.touch()

        if not self.fork(seconds, work):
            return "time", ""
        if first.exists() or not ended.exists():
            said = (self.folder.parent / "said.txt").read_text(encoding="utf-8", errors="replace")
            return "failed", first.read_text(encoding="utf-8") if first.exists() else f"hung or crashed: {said[-200:]}"
        return "passed", ""

    def judge(self, new: Change) -> Result:
        """Run the tests on a mutant until one fails that passes without it."""
        began = time.monotonic()
        file = new.mutant.file
        unchanged = (self.folder / PACKAGE / file).read_text(encoding="utf-8")
        while True:
            tests = [test for test in self.chosen(new) if test not in self.failing]
            self.write(file, new.source)
            try:
                outcome, by = self.run(tests, self.limit)
            finally:
                self.write(file, unchanged)
            if outcome != "failed" or by not in self.tests or self.run([by], self.limit)[0] == "passed":
                break
            print(f"left out, as it fails by itself on the unchanged copy: {by}", flush=True)
            self.failing.add(by)
        outcome = {"passed": "survived", "failed": "caught"}.get(outcome, outcome)
        return Result(**asdict(new.mutant), outcome=outcome, by=by, seconds=f"{time.monotonic() - began:.0f}")


def kept(path: Path) -> list[Result]:
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return [Result(**{**row, "line": int(row["line"])}) for row in csv.DictReader(file)]  # type: ignore[arg-type]


def keep(path: Path, results: Iterable[Result]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Result)])
        writer.writeheader()
        writer.writerows(asdict(result) for result in results)


def say(result: Result) -> None:
    print(f"{result.outcome:8} {result.seconds:>4} s  {result.file}:{result.line} {result.function}")
    print(f"    {result.was}\n    {result.becomes}" + (f"\n    {result.by}" if result.by else ""), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("room", choices=sorted(TESTS))
    parser.add_argument("--number", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--results", type=Path, default=Path("mutants.csv"))
    parser.add_argument("--limit", type=float, default=300, help="seconds a mutant")
    parser.add_argument("--slow", action="store_true", help="also the tests marked slow")
    parser.add_argument("--again", action="store_true", help="run those that survived again")
    parser.add_argument("--all-again", action="store_true", help="run all that have a row again")
    given = parser.parse_args()
    results = {Mutant(*list(asdict(row).values())[:6]): row for row in kept(given.results)}

    def judge(new: Change) -> None:
        results[new.mutant] = copy.judge(new)
        keep(given.results, results.values())
        say(results[new.mutant])

    table = given.results.with_name(f"{given.results.stem}-{given.room}.json")
    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder), given.room, table, slow=given.slow, limit=given.limit)
        if given.again or given.all_again:
            judged = [mutant for mutant in results if mutant.room == given.room]
            for before in [m for m in judged if given.all_again or results[m].outcome != "caught"]:
                present = found_again(copy.folder, before)
                del results[before]
                if present is None:
                    print(f"gone: {before.file}:{before.line} {before.was}", flush=True)
                else:
                    judge(present)
            keep(given.results, results.values())
        else:
            for new in draw(copy.folder, given.room, given.number, given.seed):
                if new.mutant not in results:
                    judge(new)
    rows = [row for row in results.values() if row.room == given.room]
    for row in rows:
        if row.outcome != "caught":
            say(row)
    outcomes = [row.outcome for row in rows]
    caught, late = outcomes.count("caught"), outcomes.count("time")
    if len(rows) > late:
        low, high = binomtest(caught, len(rows) - late).proportion_ci(method="exact")
        print(f"{given.room}: caught {caught} of {len(rows) - late}, 95 % interval {low:.0%} to {high:.0%}", end="")
        print(f"; {late} ran out of time")


if __name__ == "__main__":
    main()
