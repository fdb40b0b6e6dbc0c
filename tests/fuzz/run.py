"""Try damaged input at every door: `python tests/fuzz/run.py 100000 [--seed 0] [--door NAME] [--workers N]`.

The door `commands` tries the command line, `commands:report table.csv` its lines that begin so. Prints each case that
fails, with what to give to try it alone (--door, --seed, and 1 as the number), then counts.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
import traceback
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import commands
from doors import DOORS, case, silent

HANG_S, MEMORY = 60, 4 * 1024**3  # of processor time; of memory
LIBRARIES = 2 * 1024**3  # of addresses, that libraries take when they are loaded and started


def attempt(job: tuple[str, int]) -> tuple[str, int, str, float]:
    """Door, seed, what went wrong in a word and where (empty: nothing), and processor seconds."""
    door, seed = job
    start = time.process_time()  # other work on this machine does not count
    wrong = ""
    try:
        with silent():
            if door.startswith("commands"):
                line, wrong = commands.case(seed, door.partition(":")[2] or None)
                wrong = wrong and f"{wrong}: {line!r}"
            else:
                case(door, seed)
    except BaseException as error:
        last = [frame for frame in traceback.extract_tb(error.__traceback__) if "focalgradient" in frame.filename]
        at = f"{Path(last[-1].filename).name}:{last[-1].lineno}" if last else "test"
        wrong = f"{type(error).__name__} at {at}: {str(error)[:200]}"
    return door, seed, wrong, time.process_time() - start


def limit() -> None:
    """End what hangs, and take memory away beyond the limit."""
    for name in ("SIGALRM", "SIGPROF"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _hangs)
    try:
        import resource
    except ImportError:
        return
    with suppress(OSError):  # where there is no /proc, nothing is limited
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (taken + MEMORY + LIBRARIES,) * 2)


class Hangs(BaseException):
    """More time than a case may take."""


def _hangs(*_: object) -> None:
    raise Hangs(f"more than {HANG_S} s")


def timed(job: tuple[str, int]) -> tuple[str, int, str, float]:
    """`attempt`, ended after some seconds of processor time, or ten times as long where it only waits."""
    if not hasattr(signal, "setitimer"):
        return attempt(job)
    signal.setitimer(signal.ITIMER_PROF, HANG_S)
    signal.setitimer(signal.ITIMER_REAL, 10 * HANG_S)
    try:
        return attempt(job)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--door", help=f"one of {', '.join(DOORS)}, commands, or commands:LINE")
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    os.environ.pop("DISPLAY", None)
    doors = [given.door] if given.door else [*DOORS, "commands"]
    jobs = [(doors[n % len(doors)], given.seed + n // len(doors)) for n in range(given.cases)]
    failures: Counter[str] = Counter()
    slowest, done = ("", 0, 0.0), 0
    with ProcessPoolExecutor(given.workers, get_context("spawn"), initializer=limit) as pool:
        for door, seed, wrong, seconds in pool.map(timed, jobs, chunksize=20):
            if seconds > slowest[2]:
                slowest = (door, seed, seconds)
            done += 1
            if done % 1000 == 0:
                print(f"{done} of {len(jobs)}", flush=True)
            if wrong:
                failures[f"{door}: {wrong[:90]}"] += 1
                print(f"--door {door} --seed {seed}: {wrong}", flush=True)
    print(f"{len(jobs)} cases, {failures.total()} failed; slowest: {slowest[0]} {slowest[1]}, {slowest[2]:.1f} s")
    for what, count in failures.most_common():
        print(f"{count:6} {what}")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main())
