"""Damages to the data set of a session: to one table, journal or sidecar alone, or to all of them together."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from recorded import edit

from focalgradient.dataset import export
from focalgradient.dataset.journal import whole_lines
from focalgradient.errors import InputError


def table(root: Path, label: str = "01", task: str = "depthrating") -> Path:
    return root / f"sub-{label}" / "beh" / f"sub-{label}_task-{task}_beh.tsv"


def sidecar(root: Path, task: str = "depthrating") -> Path:
    return table(root, task=task).with_suffix(".json")


def journal(root: Path, label: str = "01", task: str = "depthrating") -> Path:
    return root / "sourcedata" / f"sub-{label}" / "beh" / f"sub-{label}_task-{task}_beh.jsonl"


def cell(row: int, column: str, text: str, task: str = "depthrating") -> Callable[[Path], None]:
    """Change one cell of a table, and nothing else."""
    return lambda root: edit(table(root, task=task), row, column, text)


def lines(change: Callable[[list[bytes]], object], task: str = "depthrating") -> Callable[[Path], None]:
    """Change lines of a journal, and nothing else."""

    def damage(root: Path) -> None:
        path = journal(root, task=task)
        found = path.read_bytes().splitlines(keepends=True)
        change(found)
        path.write_bytes(b"".join(found))

    return damage


def text(old: bytes, new: bytes, line: int = 5, task: str = "depthrating") -> Callable[[Path], None]:
    """Replace a text in one line of a journal."""

    def change(found: list[bytes]) -> None:
        assert old in found[line]
        found[line] = found[line].replace(old, new, 1)

    return lines(change, task)


def retold(change: Callable[[dict], object], task: str = "depthrating") -> Callable[[Path], None]:
    """Change what a sidecar holds in any way, and nothing else."""

    def damage(root: Path) -> None:
        found = json.loads(sidecar(root, task).read_text())
        change(found)
        sidecar(root, task).write_text(json.dumps(found))

    return damage


def told(key: str, value: object, task: str = "depthrating") -> Callable[[Path], None]:
    """Change one key of a sidecar, and nothing else."""

    def change(found: dict) -> None:
        assert key in found
        found[key] = value

    return retold(change, task)


def forged(change: Callable[[list[dict]], object], task: str = "depthrating") -> Callable[[Path], None]:
    """Change what a journal holds, with a chain, a table and a sidecar that fit the change."""

    def damage(root: Path) -> None:
        path = journal(root, task=task)
        events = [json.loads(line) for line in path.read_bytes().splitlines()]
        for event in events:
            del event["chain"]
        change(events)
        path.write_bytes(whole_lines(events))
        table(root, task=task).unlink()
        sidecar(root, task).unlink()
        with suppress(InputError):  # of a journal that cannot be read, there is no table
            export(path)

    return damage


def of(events: list[dict], number: int) -> dict:
    return next(event for event in events if event.get("phase") == "main" and event["trial"] == number)


def each(name: str, value: Callable[[dict], object]) -> Callable[[list[dict]], None]:
    def change(events: list[dict]) -> None:
        for event in events:
            if event["event"] == "trial":
                event[name] = value(event)

    return change


def noted(at: int, kind: str, **content: object) -> Callable[[list[dict]], None]:
    """Insert a note before a line, counted from 0."""
    return lambda events: events.insert(at, {"event": "note", "kind": kind, **content})


def put(number: int, **changes: object) -> Callable[[list[dict]], None]:
    return lambda events: of(events, number).update(changes)


def sitting_of(begun: dict, time: str) -> dict:
    """What a sitting records at its beginning, as in the first event."""
    return {key: begun[key] for key in ("apparatus", "versions")} | {"time": time}


def head(**changes: object) -> Callable[[list[dict]], None]:
    return lambda events: events[0].update(changes)


def people(old: str, new: str) -> Callable[[Path], None]:
    def damage(root: Path) -> None:
        path = root / "participants.tsv"
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new, 1))

    return damage


def renamed(root: Path) -> None:
    """The third rater becomes 1: the same number as 01."""
    for path in sorted(root.rglob("sub-03*"), key=lambda one: -len(one.parts)):
        path.rename(path.with_name(path.name.replace("sub-03", "sub-1")))


def drop_row(root: Path) -> None:
    found = table(root).read_text().splitlines(keepends=True)
    table(root).write_text("".join(found[:4] + found[5:]))


def swap_rows(root: Path) -> None:
    found = table(root).read_text().splitlines(keepends=True)
    table(root).write_text("".join([*found[:4], found[5], found[4], *found[6:]]))


def manifest(root: Path) -> Path:
    (path,) = (root / "stimuli").iterdir()
    return path
