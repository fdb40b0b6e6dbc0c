"""Seeded ways to damage a text, bytes, or a tree of settings."""

from __future__ import annotations

import json
import math
import random
from typing import Any

NUMBERS = (
    *(0, -0.0, 1, -1, 2**31, -(2**63), 2**64, 10**400, 0.5, -0.5, 1e-5, 1e-9, 1e-38, 1e-320, 1e9, 1e38, 1e308),
    *(math.inf, -math.inf, math.nan),
)
TEXTS = ("", " ", "x", "../x", "/etc/passwd", "a\0b", "a\nb", "é", "\ud800", "9" * 5000, "x" * 70_000, "=1+1", "NaN")
KEYS = ("", "a", "../x", "x" * 300, "__class__", "é", "a.b", "Seed", "view", "camera")
LINES = ("[", "]", "{", "= ", '"', "'''", "[[a]]", "a = " + "[" * 3000, "b" + ".b" * 3000 + " = 1", "c = " + "9" * 5000)


def odd(chance: random.Random, depth: int = 0) -> Any:
    """A value that nobody expects."""
    kind = chance.randrange(7 if depth < 3 else 4)
    if kind < 2:
        return chance.choice(NUMBERS)
    if kind == 2:
        return chance.choice(TEXTS)
    if kind == 3:
        return chance.choice((True, False, None))
    if kind == 4:
        return [odd(chance, depth + 1) for _ in range(chance.randrange(4))]
    if kind == 5:
        return {chance.choice(KEYS): odd(chance, depth + 1) for _ in range(chance.randrange(4))}
    value: Any = 0
    for _ in range(chance.choice((3, 100, 5000))):
        value = [value]
    return value


def damaged_tree(tree: Any, chance: random.Random) -> Any:
    """A copy of a tree of tables and lists, of which some places hold something else, twice, or nothing."""
    tree = json.loads(json.dumps(tree))
    for _ in range(chance.choice((1, 1, 1, 2, 5))):
        places: list[tuple[Any, Any]] = []

        def walk(node: Any, found: list[tuple[Any, Any]] = places) -> None:
            for key in node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ():
                if len(found) < 5000:
                    found.append((node, key))
                    if not _deep(node[key]):
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


def _deep(value: Any) -> bool:
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


def damaged_text(data: bytes, chance: random.Random) -> bytes:
    """A copy of a text with lines lost, repeated, exchanged, or odd ones between; sometimes damaged as bytes."""
    if chance.random() < 0.4:
        return damaged_bytes(data, chance)
    lines = data.split(b"\n")
    for _ in range(chance.choice((1, 1, 3))):
        at = chance.randrange(len(lines)) if lines else 0
        way = chance.randrange(4)
        if way == 0 and lines:
            del lines[at]
        elif way == 1 and lines:
            lines.insert(at, lines[chance.randrange(len(lines))])
        elif way == 2:
            lines.insert(at, chance.choice(LINES).encode())
        elif lines:
            words = lines[at].split(b"\t" if b"\t" in lines[at] else b" ")
            words[chance.randrange(len(words))] = str(odd(chance, 9)).encode("utf-8", "surrogatepass")
            lines[at] = (b"\t" if b"\t" in lines[at] else b" ").join(words)
    return b"\n".join(lines)
