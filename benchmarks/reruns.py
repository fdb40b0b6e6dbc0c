"""Table of faults, each measured anew: result before the fix, and present result."""

from __future__ import annotations

import argparse
import contextlib
import io
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["Lines", "run_command"]


def run_command(*words: object) -> tuple[int, str, str]:
    """Run `focalgradient` in this process; return its exit code, and what it printed on either stream."""
    from focalgradient.cli import main

    code, streams = 0, [io.TextIOWrapper(io.BytesIO(), "utf-8") for _ in range(2)]
    with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
        try:
            main([str(word) for word in words])
        except SystemExit as stop:
            code = int(stop.code or 0)
    for stream in streams:
        stream.seek(0)
    return code, streams[0].read(), streams[1].read()


@dataclass(frozen=True)
class _Line:
    number: str
    what: str
    before: str
    measure: Callable[[], str]


class Lines:
    """Lines of one table, registered by decorator, measured and printed by `main`."""

    def __init__(self, title: str):
        self.title = title
        self._lines: list[_Line] = []

    def line(self, number: str, what: str, before: str) -> Callable[[Callable[[], str]], Callable[[], str]]:
        """Register a function that measures a line and returns its result in a few words.

        `before` is the result before the fault was fixed.
        """

        def register(measure: Callable[[], str]) -> Callable[[], str]:
            self._lines.append(_Line(number, what, before, measure))
            return measure

        return register

    def main(self) -> None:
        """Measure and print the lines named on the command line, or all."""
        parser = argparse.ArgumentParser(description=self.title)
        parser.add_argument("numbers", nargs="*", help="lines to measure: 1.4, or 1 for all of 1 (default: all)")
        wanted = parser.parse_args().numbers
        print(f"# {self.title}\n\n| line | case | before | now | s |\n|---|---|---|---|---|")
        for line in sorted(self._lines, key=lambda one: [int(part) for part in one.number.split(".")]):
            if wanted and not any(line.number == one or line.number.startswith(f"{one}.") for one in wanted):
                continue
            start = time.perf_counter()
            try:
                now = line.measure()
            except Exception as error:  # a failing line is a result; the others are still measured
                traceback.print_exc()
                now = f"FAILED: {type(error).__name__}"
            seconds = time.perf_counter() - start
            print(f"| {line.number} | {line.what} | {line.before} | {now} | {seconds:.0f} |", flush=True)
