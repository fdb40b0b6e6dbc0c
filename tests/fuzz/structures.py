"""Damage to a file by its structure: leaves of other types, tables wide, long or ragged, other encodings."""

from __future__ import annotations

import codecs
import contextlib
import copy
import io
import json
import random
import tomllib
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
from mutations import as_json, as_toml, damaged_bytes, damaged_tree

__all__ = ["is_text", "workbook", "wrong_file"]

LEAVES: tuple[Any, ...] = (
    *(0, 1, -1, 2, 0.5, -0.5, 1e308, -1e308, 1e-320, 10**19, -(10**19), 10**400, 2**53 + 1, float("inf")),
    *(float("-inf"), float("nan"), True, False, None, "", " ", "1", "0.9", "nan", "true", "é", "a\0b", "\ud800"),
    *("x" * 3000, "../x", "a/b", "n/a", [], {}, [1], ["1"], [[1, 2], [3]], {"a": 1}, [None], [[]], [{}], "1e400"),
)
CELLS = (
    *("", "n/a", "nan", "inf", "-1", "0", "1e400", "9" * 5000, "x" * 70_000, "=1+1", '"', "é", "\0", "1,5", "1;5"),
    *("\t", "999", "TRUE", "f/0", "f/-1", "f/inf", "pinhole ", "Pinhole", "\ufeff", "-0", "1e-320", "\u2028", "a\rb"),
)


def wrong_file(path: Path, others: Path, chance: random.Random) -> None:
    """Damage a file by what it is, or put another of the folder `others` in its place."""
    data = path.read_bytes()
    pick = chance.random()
    if pick < 0.06:
        other = chance.choice([one for one in others.rglob("*") if one.is_file()])
        content = other.read_bytes()
    elif pick < 0.2 or not is_text(path):
        content = damaged_bytes(data, chance)
        if path.suffix == ".xlsx" and chance.random() < 0.8:
            content = _workbook(data, chance)
        if path.suffix == ".npy" and chance.random() < 0.6:
            content = _array(chance)
    elif pick < 0.3:
        content = _encoded(data, chance)
    elif path.suffix in (".toml", ".json"):
        content = _tree(path, data, chance)
    elif path.suffix in (".csv", ".tsv"):
        content = _table(data, "\t" if path.suffix == ".tsv" else ",", chance)
    elif path.suffix == ".jsonl" or path.name == "answers.txt":
        content = _json_lines(data, chance)
    else:
        content = damaged_bytes(data, chance)
    path.unlink()
    path.write_bytes(content)


def is_text(path: Path) -> bool:
    return path.suffix in (".toml", ".json", ".jsonl", ".csv", ".tsv", ".txt", "")


def workbook(rows: list[list[str]]) -> bytes:
    """A workbook of one sheet."""
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


def _zipped(parts: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return file.getvalue()


def _workbook(data: bytes, chance: random.Random) -> bytes:
    """A workbook with damage in one of its parts."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    name = chance.choice(sorted(parts))
    text = parts[name].decode()
    strange = chance.choice(("²", "9" * 5000, "-1", "x"))
    ways: tuple[Callable[[], bytes], ...] = (
        lambda: damaged_bytes(parts[name], chance),
        lambda: text.replace("inlineStr", chance.choice(("s", "n", "b", "e", "")), 9).encode(),
        lambda: text.replace('r="A2"', f'r="{chance.choice(("XFD1048576", "A0", "ZZZ9999999", "2A", ""))}"').encode(),
        lambda: text.replace("<t>", f"<t>{chance.choice(CELLS[:6])}", 40).encode(),
        lambda: text.replace("1.0", f'1.0" encoding="{chance.choice(("foo", "utf-16", "utf-7", "cp037"))}', 1).encode(),
        lambda: text.replace("<c ", "<c>" * 3000 + "<c ", 1).encode(),
        lambda: (text[:-20] + text).encode(),
        lambda: text.replace('t="inlineStr"><is><t>', f't="s"><v>{strange}').encode(),
    )
    parts[name] = chance.choice(ways)()
    if chance.random() < 0.2:
        parts["xl/worksheets/sheet2.xml"] = parts["xl/worksheets/sheet1.xml"]
    return _zipped(parts)


def _encoded(data: bytes, chance: random.Random) -> bytes:
    text = data.decode("utf-8", "replace")
    ways: tuple[Callable[[], bytes], ...] = (
        lambda: text.encode("utf-16"),
        lambda: text.encode("utf-32"),
        lambda: codecs.BOM_UTF8 + data,
        lambda: codecs.BOM_UTF16_LE + data,
        lambda: codecs.BOM_UTF8 * 2 + data,
        lambda: text.replace("e", "é", 3).encode("latin-1", "replace"),
        lambda: data.replace(b"\n", b"\r"),
        lambda: data.replace(b"\n", b"\r\n"),
        lambda: data.replace(b"\n", b"\0\n", 2),
        lambda: data + b"\x1a",
        lambda: data * 2,
        lambda: data.replace(b"\n", b" "),
    )
    return chance.choice(ways)()


def _array(chance: random.Random) -> bytes:
    kind = chance.choice(("f2", "f4", ">f8", "f8", "u1", "i8", "?", "c16", "U3", "M8[s]", "V4", "longdouble"))
    shape = chance.choice(((96, 96), (96, 96, 3), (0, 0), (96,), (), (1, 96), (96, 95), (96, 96, 1, 1), (2, 2)))
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        array = np.full(shape, chance.choice((0, 1, -1, 1e30, 1e-30, np.nan, np.inf, 0.8))).astype(kind)
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def _leaf(tree: Any, chance: random.Random) -> Any:
    """A tree in which one leaf, chosen among all, is of another type."""
    tree = json.loads(json.dumps(tree, default=str))
    places: list[tuple[Any, Any]] = []

    def walk(node: Any) -> None:
        for key in node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ():
            places.append((node, key))
            walk(node[key])

    walk(tree)
    for _ in range(chance.choice((1, 1, 2))):
        if places:
            node, key = chance.choice(places)
            with contextlib.suppress(IndexError):
                node[key] = chance.choice(LEAVES) if chance.random() < 0.9 else copy.deepcopy(chance.choice(places)[0])
    return tree


def _tree(path: Path, data: bytes, chance: random.Random) -> bytes:
    toml = path.suffix == ".toml"
    tree = tomllib.loads(data.decode()) if toml else json.loads(data)
    try:
        damaged = _leaf(tree, chance) if chance.random() < 0.7 else damaged_tree(tree, chance)
        if not toml:
            return as_json(damaged)
        return as_toml(damaged if isinstance(damaged, dict) else {"a": damaged})
    except RecursionError:  # a tree within itself
        return b"[" * 100_000


def _table(data: bytes, delimiter: str, chance: random.Random) -> bytes:
    rows = [line.split(delimiter) for line in data.decode("utf-8", "replace").splitlines()] or [[]]
    for _ in range(chance.choice((1, 1, 2, 4))):
        at, column = chance.randrange(len(rows)), chance.randrange(max(len(rows[0]), 1))
        way = chance.randrange(12)
        if way < 4:
            for row in rows[at : at + 1] if way < 3 else rows[1:]:
                if column < len(row):
                    row[column] = chance.choice(CELLS)
        elif way == 4:
            for row in rows:
                del row[column : column + 1]
        elif way == 5:
            for row in rows:
                row.insert(column, row[column] if column < len(row) else "")
        elif way == 6:
            rows.insert(at, list(chance.choice(rows)))
        elif way == 7:
            del rows[at]
            rows = rows or [[]]
        elif way == 8:
            rows[at] = rows[at] * chance.choice((2, 3000))
        elif way == 9:
            rows = rows + rows[1:] * chance.choice((1, 20))
        elif way == 10:
            chance.shuffle(rows[0])
        else:
            rows = [list(column) for column in zip(*rows, strict=False)] or [[]]
    delimiter = chance.choice((delimiter,) * 8 + (";", "\t", "|", " "))
    return "\n".join(delimiter.join(row) for row in rows).encode("utf-8", "surrogatepass")


def _json_lines(data: bytes, chance: random.Random) -> bytes:
    lines = data.splitlines() or [b""]
    at = chance.randrange(len(lines))
    way = chance.randrange(5)
    if way == 0:
        lines[at] = chance.choice((b"", b"[" * 50_000, b"1", b"null", b'{"a":1,"a":2}', b"\xff\xfe", b'"' * 99))
    elif way == 1:
        lines.insert(at, chance.choice(lines))
    elif way == 2:
        del lines[at]
    else:
        with contextlib.suppress(ValueError):
            lines[at] = as_json(_leaf(json.loads(lines[at]), chance))
    return b"\n".join(lines) + b"\n" * chance.randrange(3)
