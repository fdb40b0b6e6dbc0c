"""Seeded damage to files by what they are: leaves of other types, ragged tables, other encodings, bytes."""

from __future__ import annotations

import codecs
import contextlib
import copy
import io
import json
import math
import random
import tomllib
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl

NUMBERS = (
    *(0, -0.0, 1, -1, 2, 2**31, -(2**63), 2**64, 2**53 + 1, 10**400, 0.5, -0.5, 1e-5, 1e-9, 1e-38, 1e-320),
    *(1e9, 1e38, 1e308, -1e308, math.inf, -math.inf, math.nan),
)
LEAVES: tuple[Any, ...] = (
    *(*NUMBERS, True, False, None, "", " ", "x", "1", "0.9", "NaN", "true", "é", "a\0b", "a\nb", "\ud800", "=1+1"),
    *("../x", "/etc/passwd", "a/b", "n/a", "1e400", "9" * 5000, "x" * 70_000),
    *([], {}, [1], ["1"], [[1, 2], [3]], {"a": 1}, [None], [[]], [{}]),
)
KEYS = ("", "a", "../x", "x" * 300, "__class__", "é", "a.b", "Seed", "view", "camera")
CELLS = (
    *("", "n/a", "nan", "inf", "-1", "0", "1e400", "9" * 5000, "x" * 70_000, "=1+1", '"', "é", "\0", "1,5", "1;5"),
    *("\t", "999", "TRUE", "f/0", "f/-1", "f/inf", "pinhole ", "Pinhole", "\ufeff", "-0", "1e-320", "\u2028", "a\rb"),
)
LINES = ("[", "]", "{", "= ", '"', "'''", "[[a]]", "a = " + "[" * 3000, "b" + ".b" * 3000 + " = 1", "c = " + "9" * 5000)


def wrong_file(path: Path, others: Path, chance: random.Random) -> None:
    """Damage a file by what it is, or put another of the folder `others` in its place."""
    data = path.read_bytes()
    pick = chance.random()
    if pick < 0.06:
        content = chance.choice([file for file in others.rglob("*") if file.is_file()]).read_bytes()
    elif path.suffix in (".xlsx", ".npy") and chance.random() < 0.7:
        content = _workbook(data, chance) if path.suffix == ".xlsx" else _array(chance)
    elif pick < 0.2 or not is_text(path):
        content = damaged_bytes(data, chance)
    elif pick < 0.3:
        content = _encoded(data, chance)
    elif pick < 0.4:
        content = _lines(data, chance)
    elif path.suffix in (".toml", ".json"):
        content = _tree(path, data, chance)
    elif path.suffix in (".csv", ".tsv"):
        content = _table(data, "\t" if path.suffix == ".tsv" else ",", chance)
    else:
        content = _json_lines(data, chance)
    path.unlink()
    path.write_bytes(content)


def is_text(path: Path) -> bool:
    return path.suffix in (".toml", ".json", ".jsonl", ".csv", ".tsv", ".txt", "")


def odd(chance: random.Random) -> Any:
    """A value that nobody expects, at times nested deeply."""
    value = copy.deepcopy(chance.choice(LEAVES))
    for _ in range(chance.choice((0,) * 9 + (3, 100, 5000))):
        value = [value]
    return value


def damaged_tree(tree: Any, chance: random.Random) -> Any:
    """A copy of a tree of tables and lists, of which some places hold something else, twice, or nothing."""
    tree = json.loads(json.dumps(tree, default=str))
    for _ in range(chance.choice((1, 1, 1, 2, 5))):
        places: list[tuple[Any, Any]] = []

        def walk(node: Any, found: list[tuple[Any, Any]] = places) -> None:
            for key in node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ():
                if len(found) < 5000:
                    found.append((node, key))
                    if not _is_deep(node[key]):
                        walk(node[key])

        walk(tree)
        if not places:
            return odd(chance)
        node, key = chance.choice(places)
        way = chance.randrange(5)
        if way < 2:
            node[key] = odd(chance)
        elif way == 2:
            del node[key]
        elif isinstance(node, dict):
            node[chance.choice(KEYS)] = node[key] if way == 3 else odd(chance)
        else:
            node.insert(key, node[key])
    return tree


def _is_deep(value: Any) -> bool:
    """Whether a value is nested further than this walks."""
    for _ in range(50):
        if not isinstance(value, list) or len(value) != 1:
            return False
        value = value[0]
    return True


def as_json(value: Any) -> bytes:
    """JSON, also of what JSON has no word for."""
    return text_of(value, ("null", "true", "false"), json.dumps).encode("utf-8", "surrogatepass")


def as_toml(tree: dict[str, Any]) -> bytes:
    """TOML of tables, lists of tables and values; None becomes a text."""
    lines: list[str] = []
    tables: list[str] = []
    for key, value in tree.items():
        if isinstance(value, dict):
            tables += [f"[{_key(key)}]", *(f"{_key(k)} = {_value(v)}" for k, v in value.items())]
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            for item in value:
                tables += [f"[[{_key(key)}]]", *(f"{_key(k)} = {_value(v)}" for k, v in item.items())]
        else:
            lines.append(f"{_key(key)} = {_value(value)}")
    return "\n".join([*lines, *tables, ""]).encode("utf-8", "surrogatepass")


def _key(key: str) -> str:
    return key if key.isascii() and key.replace("_", "a").isalnum() else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
    return text_of(value, ('"none"', "true", "false"), lambda text: json.dumps(text, ensure_ascii=False))


def text_of(value: Any, words: tuple[str, str, str], quoted: Any) -> str:
    """A value as JSON or TOML write it; without recursion where it is a list in a list in a list."""
    depth = 0
    while isinstance(value, list) and len(value) == 1:
        value, depth = value[0], depth + 1
    if value is None or isinstance(value, bool):
        text = words[0 if value is None else 1 if value else 2]
    elif isinstance(value, str):
        text = quoted(value)
    elif isinstance(value, float):
        text = {math.inf: "inf", -math.inf: "-inf"}.get(value, repr(value))
    elif isinstance(value, int):
        text = str(value)
    elif isinstance(value, dict):
        text = "{" + ", ".join(f"{json.dumps(str(k))}: {text_of(v, words, quoted)}" for k, v in value.items()) + "}"
    else:
        text = "[" + ", ".join(text_of(item, words, quoted) for item in value) + "]"
    return "[" * depth + text + "]" * depth


def damaged_bytes(data: bytes, chance: random.Random) -> bytes:
    """A copy of some bytes with places changed, cut, repeated or lost."""
    content = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 8, 40))):
        if not content:
            return bytes(content)
        at = chance.randrange(len(content)) if chance.random() < 0.6 else chance.randrange(min(len(content), 200))
        way = chance.randrange(7)
        if way < 2:
            content[at] = chance.randrange(256)
        elif way == 2:
            word = chance.choice((0, 2**31 - 1, 2**32 - 1))
            content[at : at + 4] = word.to_bytes(4, "little" if chance.random() < 0.5 else "big")
        elif way == 3:
            del content[at : at + chance.choice((1, 7, 100, 10_000))]
        elif way == 4:
            del content[at:]
        elif way == 5:
            content[at:at] = chance.randbytes(chance.choice((1, 7, 100)))
        else:
            content[at:at] = content[at : at + chance.choice((10, 1000))]
    return bytes(content)


def _lines(data: bytes, chance: random.Random) -> bytes:
    """A copy of a text with lines lost, exchanged, or odd ones between."""
    lines = data.split(b"\n")
    for _ in range(chance.choice((1, 1, 3))):
        at = chance.randrange(len(lines))
        way = chance.randrange(3)
        if way == 0 and len(lines) > 1:
            del lines[at]
        elif way == 1:
            lines.insert(at, chance.choice(lines))
        else:
            lines.insert(at, chance.choice(LINES).encode())
    return b"\n".join(lines)


def workbook(rows: list[list[str]]) -> bytes:
    """A workbook of one sheet."""
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(row)
    file = io.BytesIO()
    book.save(file)
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
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for part, content in parts.items():
            archive.writestr(part, content)
    return file.getvalue()


def _encoded(data: bytes, chance: random.Random) -> bytes:
    text = data.decode("utf-8", "replace")
    ways: tuple[Callable[[], bytes], ...] = (
        lambda: text.encode(chance.choice(("utf-16", "utf-32"))),
        lambda: chance.choice((codecs.BOM_UTF8, codecs.BOM_UTF16_LE, codecs.BOM_UTF8 * 2)) + data,
        lambda: text.replace("e", "é", 3).encode("latin-1", "replace"),
        lambda: data.replace(b"\n", chance.choice((b"\r", b"\r\n", b" ", b"\0\n"))),
        lambda: data + b"\x1a",
        lambda: data * 2,
    )
    return chance.choice(ways)()


def _array(chance: random.Random) -> bytes:
    """An array of any type and shape, or a texture of which some rows are of another size."""
    kind = chance.choice(("f2", "f4", ">f8", "f8", "u1", "u2", "i8", "?", "c16", "U3", "M8[s]", "V4", "longdouble"))
    shape = chance.choice(((96, 96), (96, 96, 3), (0, 0), (96,), (), (1, 96), (96, 95), (96, 96, 1, 1), (2, 2)))
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        array = np.full(shape, chance.choice((0, 1, -1, 1e30, 1e-30, np.nan, np.inf, 0.8)))
        if chance.random() < 0.4:
            array = np.random.default_rng(1).uniform(0.05, 0.95, (48, 48))
            array[: chance.randrange(1, 48)] *= float(chance.choice(NUMBERS[-8:]))
        array = array.astype(kind)
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def _tree(path: Path, data: bytes, chance: random.Random) -> bytes:
    toml = path.suffix == ".toml"
    damaged = damaged_tree(tomllib.loads(data.decode()) if toml else json.loads(data), chance)
    if not toml:
        return as_json(damaged)
    return as_toml(damaged if isinstance(damaged, dict) else {"a": damaged})


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
            lines[at] = as_json(damaged_tree(json.loads(lines[at]), chance))
    return b"\n".join(lines) + b"\n" * chance.randrange(3)
