"""Whether a room's tests notice a wrong line: single changes of its code, drawn at random, and the tests run on each.

    python benchmarks/mutants.py ROOM [--number 20] [--seed 0] [--results mutants.csv] [--limit 900] [--slow] [--near]
        [--again]

A mutant is one change of one expression in ``src/focalgradient/ROOM``: a comparison (< to <=, == to !=), an operator
(+ to -, * to /, & to |, and to or), a sign, ``not`` or ``~`` dropped, a number (a float times 1.5, a small integer plus
1), True for False. Docstrings, texts, annotations, decorators, what is raised, asserted or warned, and ``strict=`` of
`zip` stay as they are.

The tests that `TESTS` lists for the room run on a temporary copy of the repository with the change, without those
marked slow (``--slow`` runs them as well): first those whose text names the changed module or its functions, then the
others (not with ``--near``, which is for a first look). A mutant is caught if a test fails that passes on the unchanged
copy. A run that reaches ``--limit`` seconds counts as neither. The tests of other rooms and of the commands are not
run, so the shares are lower bounds.

Each result is a row of the CSV file ``--results``; mutants with a row there are not run again, so that a run continues
where it was stopped. ``--again`` runs those of the room that survived again, after tests were added, and no others;
those whose code is no longer there are dropped.
"""

from __future__ import annotations

import argparse
import ast
import csv
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path

from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = Path("src/focalgradient")
TESTS: dict[str, Sequence[str]] = {
    "dataset": (
        "tests/test_dataset.py",
        *(f"tests/test_{name}.py" for name in ("append", "journal", "lock", "markers", "mend", "noted", "gaze")),
        *(f"tests/test_{name}.py" for name in ("counterbalanced", "trial_times", "focus_sessions", "cli_validate")),
        "tests/web/test_withdrawal.py",
        "tests/web/test_arrival.py",
        "tests/test_damages.py",
    ),
    "depth": ("tests/depth/test_*.py",),
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
        "tests/test_kept_reports.py",
    ),
    "statistics": (
        "tests/statistics/test_*.py",
        *("tests/test_scales.py", "tests/test_power.py", "tests/test_report_own_*.py", "tests/test_kept_reports.py"),
    ),
}
"""The tests of a room, besides its doctests: those most likely to fail first."""

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
FACTOR, SMALL = 1.5, 20
"""Factor on a float and on integers above `SMALL`; smaller integers grow by 1."""

BESIDE = 50
"""Characters shown before and after a change."""

HANG = 180
"""Seconds after which a single test counts as hung and fails; the longest quick test takes a fifth of it."""

Site = tuple[ast.AST, Sequence[str], Callable[[], None]]
"""A node, the functions around it, and what changes the tree there."""


@dataclass(frozen=True)
class Mutant:
    """One change: where, the old text and the new one, around the change alone."""

    room: str
    file: str
    line: int
    function: str
    was: str
    becomes: str


@dataclass(frozen=True)
class Result(Mutant):
    """A mutant, what became of it (caught, survived, time) and the test that failed."""

    outcome: str
    by: str
    seconds: str


class _Sites(ast.NodeVisitor):
    """Every place of a tree that can be changed, in the order of the source."""

    def __init__(self) -> None:
        self.found: list[Site] = []
        self.around: list[str] = []

    def add(self, node: ast.AST, change: Callable[[], None]) -> None:
        self.found.append((node, tuple(self.around), change))

    def visit_all(self, nodes: Iterable[ast.AST | None]) -> None:
        for node in nodes:
            if node is not None:
                self.visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        self.around.append(node.name)
        self.visit_all([*node.args.defaults, *node.args.kw_defaults, *node.body])
        self.around.pop()

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        self.visit_FunctionDef(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.around.append(node.name)
        self.visit_all(node.body)
        self.around.pop()

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        self.visit_all([node.value])

    def visit_Raise(self, node: ast.Raise) -> None:
        """Leave messages as they are."""

    def visit_Assert(self, node: ast.Assert) -> None:
        """Leave what only types ask for as it is."""

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg not in ("strict", "stacklevel"):
            self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        name = ast.unparse(node.func)
        if name in ("warnings.warn", "warn"):
            return
        self.visit_all([node.func, *(node.args[:1] if name == "isinstance" else node.args), *node.keywords])

    def visit_Compare(self, node: ast.Compare) -> None:
        for place in range(len(node.ops)):
            self.add(node, partial(_compare_otherwise, node, place))
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp | ast.AugAssign) -> None:
        texts = any(
            isinstance(part, ast.JoinedStr) or (isinstance(part, ast.Constant) and isinstance(part.value, str))
            for part in ast.walk(node)
        )
        alias = isinstance(node.op, ast.BitOr) and not self.around  # `A | B` of types
        if type(node.op) in OPERATORS and not texts and not alias:
            self.add(node, lambda: setattr(node, "op", OPERATORS[type(node.op)]()))
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self.visit_BinOp(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        new = ast.And() if isinstance(node.op, ast.Or) else ast.Or()
        self.add(node, lambda: setattr(node, "op", new))
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        """Double the operator, which is to drop it."""
        if isinstance(node.op, ast.Not | ast.USub | ast.Invert):
            self.add(node, lambda: setattr(node, "operand", ast.UnaryOp(node.op, node.operand)))
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self.add(node, lambda: setattr(node, "value", not value))
        elif isinstance(value, int):
            self.add(node, lambda: setattr(node, "value", value + 1 if value <= SMALL else int(FACTOR * value)))
        elif isinstance(value, float):
            self.add(node, lambda: setattr(node, "value", FACTOR * value if value else 1.0))


def _compare_otherwise(node: ast.Compare, place: int) -> None:
    node.ops[place] = COMPARISONS[type(node.ops[place])]()


def sites(source: str) -> tuple[ast.Module, list[Site]]:
    tree = ast.parse(source)
    found = _Sites()
    found.visit(tree)
    return tree, found.found


def _difference(before: str, after: str) -> tuple[str, str]:
    """Where two texts differ, with what stands around it in the line."""
    shorter = min(len(before), len(after))
    same = next((place for place in range(shorter) if before[place] != after[place]), shorter)
    rest = next((place for place in range(shorter - same) if before[-1 - place] != after[-1 - place]), shorter - same)
    start = max(before.rfind("\n", 0, same) + 1, same - BESIDE)
    ahead = before[len(before) - rest :].partition("\n")[0][:BESIDE]
    one, other = ((text[start : len(text) - rest] + ahead).strip() for text in (before, after))
    return one, other


def change(root: Path, file: Path, index: int) -> tuple[Mutant, str]:
    """The mutant at the place of that index in a file, and the file's new source."""
    tree, found = sites(file.read_text(encoding="utf-8"))
    node, around, apply = found[index]
    before = ast.unparse(tree)
    apply()
    after = ast.unparse(tree)
    was, becomes = _difference(before, after)
    place = file.relative_to(root / PACKAGE)
    return Mutant(place.parts[0], place.as_posix(), node.lineno, ".".join(around), was, becomes), after  # type: ignore[attr-defined]


def files(root: Path, room: str) -> list[Path]:
    return sorted((root / PACKAGE / room).rglob("*.py"))


def draw(root: Path, room: str, number: int, seed: int) -> Iterator[tuple[Mutant, str]]:
    """The number of mutants of a room asked for, with the new source of each; a larger number begins with the same."""
    places = [
        (file, index) for file in files(root, room) for index in range(len(sites(file.read_text(encoding="utf-8"))[1]))
    ]
    random.Random(seed).shuffle(places)
    print(f"{room}: {len(places)} mutants, {min(number, len(places))} drawn", flush=True)
    for file, index in places[:number]:
        yield change(root, file, index)


def found_again(root: Path, row: Mutant) -> tuple[Mutant, str] | None:
    """A mutant at its present line, with the new source of its file; None if the code is no longer there."""
    file = root / PACKAGE / row.file
    there = sites(file.read_text(encoding="utf-8"))[1] if file.exists() else []
    for index, (_, around, _) in enumerate(there):
        if ".".join(around) == row.function:
            mutant, source = change(root, file, index)
            if (mutant.was, mutant.becomes) == (row.was, row.becomes):
                return mutant, source
    return None


def chosen(root: Path, mutant: Mutant) -> tuple[list[str], list[str]]:
    """Tests that name the changed module or its functions, the changed function first, and the room's others."""
    module = (PACKAGE / mutant.file).as_posix()
    tree = ast.parse((root / module).read_text(encoding="utf-8"))
    defined = [part.name for part in tree.body if isinstance(part, ast.FunctionDef | ast.ClassDef)]
    dotted = mutant.file.removesuffix(".py").replace("/", ".")
    places = [path for pattern in TESTS[mutant.room] for path in sorted(root.glob(pattern))]

    def weight(path: Path) -> int:
        text, own = path.read_text(encoding="utf-8"), Path(mutant.file).stem
        named = [name for name in defined if re.search(rf"\b{name}\b", text)]
        enclosing = any(name in mutant.function.split(".") for name in named)
        return 100 * enclosing + 50 * (own in path.stem) + 10 * (dotted in text) + len(named)

    weights = {path.relative_to(root).as_posix(): weight(path) for path in dict.fromkeys(places)}
    ordered = sorted(weights, key=lambda path: -weights[path])
    return [module, *(path for path in ordered if weights[path])], [
        *(path for path in ordered if not weights[path]),
        *(other.relative_to(root).as_posix() for other in files(root, mutant.room) if other != root / module),
    ]


class Copy:
    """A copy of the repository in which one file at a time is changed, and tests run."""

    def __init__(self, folder: Path, *, slow: bool, near: bool, limit: float):
        self.folder, self.slow, self.near, self.limit = folder / "copy", slow, near, limit
        left = shutil.ignore_patterns(".*", "__pycache__", "_build", "results", "node_modules")
        shutil.copytree(ROOT, self.folder, symlinks=True, ignore=left)
        self.passing: dict[str, bool] = {}

    def write(self, file: str, source: str) -> None:
        """Write a module, and remove what was compiled of it; Numba compiles functions into those of other modules."""
        path = self.folder / PACKAGE / file
        path.write_text(source, encoding="utf-8")
        for compiled in path.parent.glob(f"__pycache__/{path.stem}.*"):
            compiled.unlink()
        if "numba" in source:
            for compiled in self.folder.rglob("*.nb[ci]"):
                compiled.unlink()

    def run(self, tests: Sequence[str], seconds: float) -> tuple[str, str]:
        """What became of tests (passed, failed, time), and the first that failed."""
        if seconds <= 0:
            return "time", ""
        options = ["-x", "-q", "-rfE", "-p", "no:cacheprovider", "--basetemp", str(self.folder.parent / "tests")]
        # A function of the package whose name begins with `test`, as `tested_of`, is no test.
        options += ["-o", f"faulthandler_timeout={HANG}", "-o", "python_functions=test_*"]
        options += [] if self.slow else ["-m", "not slow"]
        paths = os.pathsep.join([str(self.folder / "src"), *filter(None, [os.environ.get("PYTHONPATH")])])
        process = subprocess.Popen(
            [sys.executable, "-m", "pytest", *options, *tests],
            cwd=self.folder,
            env=os.environ | {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        try:
            said, _ = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return "time", ""
        if process.returncode in (0, 5):  # 5: all of them are slow
            return "passed", ""
        if process.returncode == 4:
            raise SystemExit(said)
        failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", said, re.MULTILINE)
        return "failed", failed[1] if failed else "hung or crashed"

    def passes_unchanged(self, test: str) -> bool:
        """Whether a test passes here; what failed before it had a name counts as passing."""
        if test not in self.passing:
            self.passing[test] = test == "hung or crashed" or self.run([test], self.limit)[0] == "passed"
        return self.passing[test]

    def judge(self, mutant: Mutant, source: str) -> Result:
        """Run the tests on a mutant until one fails."""
        began = time.monotonic()
        unchanged = (self.folder / PACKAGE / mutant.file).read_text(encoding="utf-8")
        outcome, by = "passed", ""
        self.write(mutant.file, source)
        try:
            for tests in chosen(self.folder, mutant)[: 1 if self.near else 2]:
                outcome, by = self.run(tests, self.limit - (time.monotonic() - began))
                if outcome != "passed":
                    break
        finally:
            self.write(mutant.file, unchanged)
        if outcome == "failed" and not self.passes_unchanged(by):
            raise SystemExit(f"{by} fails on the unchanged copy: fix it first, or take it out of TESTS.")
        outcome = {"passed": "survived", "failed": "caught"}.get(outcome, outcome)
        return Result(**asdict(mutant), outcome=outcome, by=by, seconds=f"{time.monotonic() - began:.0f}")


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
    parser.add_argument("--limit", type=float, default=900, help="seconds a mutant")
    parser.add_argument("--slow", action="store_true", help="also the tests marked slow")
    parser.add_argument("--near", action="store_true", help="only the tests that name the module or its functions")
    parser.add_argument("--again", action="store_true", help="run those that survived again")
    given = parser.parse_args()
    results = {Mutant(*list(asdict(row).values())[:6]): row for row in kept(given.results)}

    def judge(mutant: Mutant, source: str) -> None:
        results[mutant] = copy.judge(mutant, source)
        keep(given.results, results.values())
        say(results[mutant])

    with tempfile.TemporaryDirectory() as folder:
        copy = Copy(Path(folder), slow=given.slow, near=given.near, limit=given.limit)
        if given.again:
            left = [mutant for mutant, row in results.items() if row.outcome != "caught" and row.room == given.room]
            for before in left:
                found = found_again(copy.folder, before)
                del results[before]
                if found is None:
                    print(f"gone: {before.file}:{before.line} {before.was}", flush=True)
                else:
                    judge(*found)
            keep(given.results, results.values())
        else:
            for mutant, source in draw(copy.folder, given.room, given.number, given.seed):
                if mutant not in results:
                    judge(mutant, source)
    judged = [row for row in results.values() if row.room == given.room]
    for row in judged:
        if row.outcome != "caught":
            say(row)
    outcomes = [row.outcome for row in judged]
    caught, late = outcomes.count("caught"), outcomes.count("time")
    if len(judged) > late:
        low, high = binomtest(caught, len(judged) - late).proportion_ci(method="exact")
        print(f"{given.room}: caught {caught} of {len(judged) - late}, 95 % interval {low:.0%} to {high:.0%}", end="")
        print(f"; {late} ran out of time")


if __name__ == "__main__":
    main()
