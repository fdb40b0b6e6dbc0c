"""Every command that writes killed at random moments, and given full disks: `python tests/killing_commands.py [TIMES]`.

Each command is killed TIMES times (30) by each of three signals, and stopped by each of several limits on the size of
a file, as by a full disk, and by a fault at each of the first moves of a finished file to its place. After each, what
stands under its own name is whole, a summary stands only beside all that it belongs to, a signal that can be caught
leaves no litter and says in one line what is so, no process is left, and the same command finishes, with what an
undisturbed run writes, and leaves no litter either. `--only NAME` tries one command, `--seconds S` ends each command's
trials after that time. Runs are forks of a process that has imported what they need (`warm.py`).
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).parent))

from long_commands import COMMANDS, Long, prepare
from warm import Run, Warm

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -signal.SIGKILL}
LIMITS = (0, 100, 3000, 20_000)
"""Bytes that a file may have, in place of a full disk."""

FAULTS = (1, 2, 3)
"""Which move of a finished file to its place fails."""

FAULT = """
import errno, itertools, os
calls = itertools.count(1)
def failing(real):
    def move(source, place, **more):
        if next(calls) == {number}:
            raise OSError(errno.EIO, "a fault", str(place))
        real(source, place, **more)
    return move
os.replace, os.rename = failing(os.replace), failing(os.rename)
"""


def readable(path: Path) -> None:
    """Fail where a file is not whole."""
    kind = path.suffix
    if kind == ".json":
        json.loads(path.read_bytes())
    elif kind == ".toml":
        tomllib.loads(path.read_text())
    elif kind in (".npz", ".npy"):
        found = np.load(path)
        for name in getattr(found, "files", ()):
            found[name]
    elif kind == ".png":
        with Image.open(path) as image:
            image.load()
    elif kind == ".pdf":
        assert path.read_bytes().rstrip().endswith(b"%%EOF"), path
    elif kind in (".csv", ".tsv", ".html", ".md"):
        assert path.read_bytes().endswith(b"\n") or path.read_text().rstrip().endswith("</html>"), path
    elif kind in (".avi", ".mp4"):
        assert cv2.VideoCapture(str(path)).read()[0], path


def files(out: Path) -> set[str]:
    return {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()} if out.exists() else set()


def litter(folder: Path) -> set[str]:
    return {str(path) for path in folder.rglob(".*")}


class Results:
    """What an undisturbed run writes: two of them show which keys of JSON hold times and differ from run to run."""

    def __init__(self, one: Path, other: Path) -> None:
        self.names = files(one)
        assert files(other) == self.names, files(other) ^ self.names
        self.timed: set[str] = set()
        for name in sorted(self.names):
            if _bytes(one / name) != _bytes(other / name):
                for left, right in zip(_trees(one / name), _trees(other / name), strict=True):
                    self.timed |= set(_differing(left, right))
        self._contents = {name: self._content(one / name) for name in self.names}

    def _content(self, path: Path) -> Any:
        if path.suffix not in (".json", ".jsonl"):
            return _bytes(path)
        return [json.dumps(_without(tree, self.timed)) for tree in _trees(path)]

    def check(self, out: Path) -> None:
        """Fail where a folder holds something else; journals of a session that was resumed may say so."""
        assert files(out) == self.names, files(out) ^ self.names
        for name, content in self._contents.items():
            found = self._content(out / name)
            if name.endswith(".jsonl"):
                found = [line for line in found if '"event": "resumed"' not in line]
            assert found == content, f"{name} differs from an undisturbed run's"


def _bytes(path: Path) -> bytes:
    """What a file holds; of a Matroska video its frames, as each file has a number of its own."""
    if path.suffix != ".mkv":
        return path.read_bytes()
    video, frames = cv2.VideoCapture(str(path)), []
    while (read := video.read())[0]:
        frames.append(read[1].tobytes())
    assert frames, path
    return b"".join(frames)


def _trees(path: Path) -> list[Any]:
    """What a file of JSON holds, or each line of one of lines, in an order that does not depend on when it came."""
    if path.suffix == ".jsonl":
        return [json.loads(line) for line in sorted(path.read_text().splitlines())]
    assert path.suffix == ".json", f"{path} differs between two undisturbed runs"
    return [json.loads(path.read_bytes())]


def _differing(left: Any, right: Any, key: str = "") -> Iterator[str]:
    """Keys whose values differ."""
    if isinstance(left, dict) and isinstance(right, dict) and left.keys() == right.keys():
        for name in left:
            yield from _differing(left[name], right[name], name)
    elif isinstance(left, list) and isinstance(right, list) and len(left) == len(right):
        for one, other in zip(left, right, strict=True):
            yield from _differing(one, other, key)
    elif left != right:
        yield key


def _without(tree: Any, keys: set[str]) -> Any:
    if isinstance(tree, dict):
        return {name: _without(value, keys) for name, value in tree.items() if name not in keys}
    return [_without(one, keys) for one in tree] if isinstance(tree, list) else tree


class Command:
    """A long command in a folder of its own."""

    def __init__(self, name: str, base: Path, warm: Warm) -> None:
        self.long: Long = COMMANDS[name]
        self._base, self._warm = base, warm
        self.folder = Path(shutil.copytree(base, base.parent / re.sub(r"\W+", "-", name)))
        self.out = self.folder / self.long.where
        self._finish()
        kept = shutil.copytree(self.out, self.folder.with_name(f"{self.folder.name}-kept"))
        self.renew()
        run = self.begin()
        start = time.perf_counter()
        code, words, self.busy = run.wait()
        self.lasts = time.perf_counter() - start
        assert code == 0, (code, words[-1500:])
        self.results = Results(kept, self.out)
        self.renew()

    def renew(self) -> None:
        """Be as before the first run."""
        shutil.rmtree(self.out, ignore_errors=True)
        if self.long.given:
            shutil.copytree(self._base / self.long.given, self.out)

    def begin(self, limit: int | None = None, before: str = "") -> Run:
        return self._warm.begin(self.folder, self.long.words, limit, before)

    def _finish(self) -> None:
        code, words, _ = self.begin().wait()
        assert code == 0, (code, words[-1500:])
        assert not litter(self.folder), litter(self.folder)

    def finish(self) -> None:
        """Run to the end, and look at what is there."""
        if not (self.long.once and self._whole()):
            self._finish()
        self.results.check(self.out)

    def _whole(self) -> bool:
        try:
            self.results.check(self.out)
        except AssertionError:
            return False
        return True

    def check(self) -> None:
        """Outputs are absent or whole."""
        found = {name for name in files(self.out) if "/." not in f"/{name}"}
        for name in found:
            readable(self.out / name)
        if self.long.summary is not None:
            assert found <= self.results.names, found - self.results.names
            whole = self.long.summary not in found or found == self.results.names
            assert whole, f"{self.long.summary} without {self.results.names - found}"


def children(process: int) -> set[int]:
    """Processes that descend from one."""
    found = {process}
    for _ in range(4):
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = stat.read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[1]) in found and fields[0] != "Z":
                found.add(int(stat.parent.name))
    return found - {process}


def busy(process: int) -> float:
    """Processor seconds of a process so far; infinite where it has ended."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return float("inf")
    ended = fields[0] == "Z"
    return float("inf") if ended else (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def gone(processes: set[int]) -> bool:
    until = time.monotonic() + 60
    while any(Path(f"/proc/{process}/cmdline").exists() for process in processes):
        if time.monotonic() > until:
            return False
        time.sleep(0.1)
    return True


def kill(command: Command, way: signal.Signals, share: float) -> str:
    """Run, and kill after a share of the processor time that a run takes."""
    before = litter(command.folder)  # of a run that was killed, where this one is killed before it sweeps
    run = command.begin()
    until = time.monotonic() + 2 * share * command.lasts
    while time.monotonic() < until and busy(run.process) < share * command.busy:
        time.sleep(0.01)
    workers = children(run.process)
    run.kill(way)
    code, words, _ = run.wait()
    assert gone(workers), f"processes are left: {workers}"
    if code == 0:
        return "finished"
    early = code == -way  # before the program had begun
    assert code == CODES[way] or early, (code, words[-1500:])
    if way != signal.SIGKILL and not early:
        assert "Traceback" not in words, words[-1500:]
        assert ("nothing was said", *words.strip().splitlines())[-1].startswith("Interrupted"), words[-500:]
        left = litter(command.folder) - before
        assert not left, (way.name, left, words[-500:])
    return "killed before it began" if early and way != signal.SIGKILL else f"killed by {way.name}"


def hinder(command: Command, limit: int | None, fault: int | None) -> str:
    """Run where no file may have more than so many bytes, or where a move of a finished file fails."""
    code, words, _ = command.begin(limit, "" if fault is None else FAULT.format(number=fault)).wait()
    assert code in (0, 1, 2), (code, words[-1500:])
    assert "Traceback" not in words, words[-1500:]
    assert not litter(command.folder), litter(command.folder)
    if code == 0:
        return "finished"
    return "refused on a full disk" if fault is None else "refused at a fault"


def torment(
    name: str,
    times: int,
    chance: random.Random,
    base: Path,
    signals: Sequence[signal.Signals] = SIGNALS,
    limits: Sequence[int] = LIMITS,
    faults: Sequence[int] = FAULTS,
    seconds: float = float("inf"),
) -> Counter[str]:
    """Try one command in a copy of the folder `base`: each of the signals so many times, the others once each."""
    counts: Counter[str] = Counter()
    until = time.monotonic() + seconds
    with Warm() as warm:
        command = Command(name, base, warm)
        trials: list[Callable[[], str]] = [
            *(partial(kill, command, way, chance.uniform(0, 1.1)) for way in signals for _ in range(times)),
            *(partial(hinder, command, limit, None) for limit in limits),
            *(partial(hinder, command, None, fault) for fault in faults),
        ]
        chance.shuffle(trials)
        for trial in trials:
            if time.monotonic() > until:
                break
            went = trial()
            counts[went] += 1
            command.check()
            if went == "finished":
                command.results.check(command.out)
            elif command.long.given or chance.random() < 0.2:
                command.finish()
            if command.long.given or command.long.once or chance.random() < 0.5:
                command.renew()  # the others replace an older set, or go on
        if not command.long.given or files(command.out) != command.results.names:
            command.finish()
        shutil.rmtree(command.folder)
    timed = f"; times: {', '.join(sorted(command.results.timed))}" if command.results.timed else ""
    print(f"{name}: {dict(sorted(counts.items()))}; {command.busy:.1f} s of processor each{timed}", flush=True)
    return counts


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("times", type=int, nargs="?", default=30)
    parser.add_argument("--only", choices=list(COMMANDS), action="append")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    given = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory() as home:
        base = Path(home, "base")
        base.mkdir()
        prepare(base)
        for name in given.only or COMMANDS:
            try:
                torment(name, given.times, random.Random(f"{given.seed} {name}"), base, seconds=given.seconds)
            except AssertionError as error:
                failed += 1
                print(f"{name}: FAILED: {error}", flush=True)
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
