"""Single changes of the code of a room, drawn at random: what `mutants.py` runs the tests on."""

from __future__ import annotations

import ast
import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

PACKAGE = Path("src/focalgradient")

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
REVERSED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    **COMPARISONS,
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
}
"""For two measured quantities: they are equal with probability 0, so that < and <= are one."""

COUNTING = ("len", "size", "shape", "ndim", "count_nonzero")
"""Names of functions and attributes whose values are counts."""

STOPPING = (
    *("maxiter", "maxfev", "maxfun", "maxls", "tol", "xtol", "ftol", "gtol", "rtol", "atol", "xatol", "fatol"),
    *("epsabs", "epsrel", "limit", "optimize"),
)
"""Arguments at which an iteration stops, or by which only speed changes: another value gives the same result."""

GUARD = 1e-9
"""Floats up to this size keep divisions and logarithms finite, and stay as they are."""

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

Site = tuple[ast.AST, Sequence[str], Callable[[], None], "range | None"]
"""A node, the functions around it, what changes the tree there, and the lines that execute it (None: the import)."""


@dataclass(frozen=True)
class Mutant:
    """One change: where, the old text and the new one, around the change alone."""

    room: str
    file: str
    line: int
    function: str
    was: str
    becomes: str


class _Sites(ast.NodeVisitor):
    """Every place of a tree that can be changed, in the order of the source."""

    def __init__(self) -> None:
        self.found: list[Site] = []
        self.around: list[str] = []
        self.lines: range | None = None
        self.inside = False

    def visit(self, node: ast.AST) -> None:
        """Know the lines of the statement that is visited: of one that holds others, those before them."""
        if not isinstance(node, ast.stmt):
            super().visit(node)
            return
        before = self.lines, self.inside
        function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        body = getattr(node, "body", [])
        first = body[0].lineno if function else node.lineno
        last = body[0].lineno if body and not function else (node.end_lineno or node.lineno) + 1
        self.inside = self.inside or function
        self.lines = range(first, max(last, first + 1)) if self.inside else None
        super().visit(node)
        self.lines, self.inside = before

    def add(self, node: ast.AST, change: Callable[[], None]) -> None:
        self.found.append((node, tuple(self.around), change, self.lines))

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
        if node.arg not in ("strict", "stacklevel", *STOPPING):
            self.visit(node.value)

    def visit_Dict(self, node: ast.Dict) -> None:
        """Leave options of an optimiser at which it stops as they are."""
        for key, value in zip(node.keys, node.values, strict=True):
            if not (isinstance(key, ast.Constant) and key.value in STOPPING):
                self.visit_all([key, value])

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
        elif isinstance(value, float) and not 0 < value <= GUARD:
            self.add(node, lambda: setattr(node, "value", FACTOR * value if value else 1.0))


def _compare_otherwise(node: ast.Compare, place: int) -> None:
    sides = [node.left, *node.comparators][place : place + 2]
    change = COMPARISONS if any(map(_is_count, sides)) else REVERSED
    node.ops[place] = change[type(node.ops[place])]()


def _is_count(node: ast.expr) -> bool:
    """Return whether a side of a comparison is a whole number, or computed of a count."""
    return any(
        (isinstance(part, ast.Constant) and type(part.value) is int)
        or getattr(part, "id", getattr(part, "attr", None)) in COUNTING
        for part in ast.walk(node)
    )


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


@dataclass(frozen=True)
class Change:
    """A mutant, the new source of its file, and the lines that execute what is changed (None: the import does)."""

    mutant: Mutant
    source: str
    lines: range | None


def change(root: Path, file: Path, index: int) -> Change:
    """The change at the place of that index in a file."""
    tree, found = sites(file.read_text(encoding="utf-8"))
    node, around, apply, lines = found[index]
    before = ast.unparse(tree)
    apply()
    after = ast.unparse(tree)
    was, becomes = _difference(before, after)
    place = file.relative_to(root / PACKAGE)
    line: int = node.lineno  # type: ignore[attr-defined]
    return Change(Mutant(place.parts[0], place.as_posix(), line, ".".join(around), was, becomes), after, lines)


def files(root: Path, room: str) -> list[Path]:
    return sorted((root / PACKAGE / room).rglob("*.py"))


def draw(root: Path, room: str, number: int, seed: int) -> Iterator[Change]:
    """The number of mutants of a room asked for; a larger number begins with the same."""
    places = [
        (file, index) for file in files(root, room) for index in range(len(sites(file.read_text(encoding="utf-8"))[1]))
    ]
    random.Random(seed).shuffle(places)
    print(f"{room}: {len(places)} mutants, {min(number, len(places))} drawn", flush=True)
    for file, index in places[:number]:
        yield change(root, file, index)


def found_again(root: Path, row: Mutant) -> Change | None:
    """A mutant at its present line; None if the code is no longer there."""
    file = root / PACKAGE / row.file
    there = sites(file.read_text(encoding="utf-8"))[1] if file.exists() else []
    for index, (_, around, _, _) in enumerate(there):
        if ".".join(around) == row.function:
            present = change(root, file, index)
            if (present.mutant.was, present.mutant.becomes) == (row.was, row.becomes):
                return present
    return None
