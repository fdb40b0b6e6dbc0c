"""Sessions that are killed at random moments, again and again, and resumed: `python tests/killing.py` kills 200 times.

A child process runs a session with trials of a few milliseconds and says each answer after it was recorded. Whenever
it is killed, all that it said must be in the journal, and at most one more.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from focalgradient.dataset import (
    Apparatus,
    Rated,
    Response,
    Session,
    bids_problems,
    read_dataset,
    read_journal,
    validate,
)
from focalgradient.design import DepthRatingDesign, Pinhole, Plan, Trial
from focalgradient.errors import InputError
from focalgradient.tasks import Task, register


@dataclass(frozen=True, slots=True, kw_only=True)
class GuessTrial(Trial):
    dots: int


@dataclass(frozen=True, slots=True, kw_only=True)
class GuessAnswer(Response):
    rating: float = field(metadata={"about": "Number that was guessed.", "least": 0, "most": 9})


class GuessDesign(Plan):
    task: str = "guesses"
    repetitions: int = 3

    def trials(self, participant, session=None):
        return self.ordered(participant, session, [GuessTrial(dots=dots) for dots in range(1, 7)])


@register
class Guesses(Task):
    """Guess a number: a task of a laboratory's own."""

    name = "guesses"
    title = "Guesses"
    design, trial, answer = GuessDesign, GuessTrial, GuessAnswer


DESIGNS: dict[str, Any] = {"short": Pinhole(), "long": DepthRatingDesign(), "own": GuessDesign()}


def answer_of(design: Any, **given: float) -> Any:
    """An answer to a trial; that of the own task has a further value noted beside it."""
    return GuessAnswer(**given, noted=given["rating"]) if isinstance(design, GuessDesign) else Rated(**given)  # type: ignore[call-arg]


def run(root: Path, length: str, participant: str) -> None:
    """Begin or resume, and answer to the end."""
    design, apparatus = DESIGNS[length], Apparatus("seconds from the start of the sitting")
    print("ready", flush=True)
    try:
        session = Session.resume(root, design.task, participant, apparatus=apparatus)
    except InputError as error:
        if "is finished" in str(error):
            return
        session = Session.begin(root, design, participant, apparatus=apparatus)
    with session:
        for number, trial in enumerate(session.remaining()):
            time.sleep(0.001)
            rating = random.uniform(0.5, 2)
            session.record(trial, answer_of(design, onset=20.0 * number, rating=rating, response_time=0.5))
            # In one write, even where standard output is not buffered: a kill leaves no part of a line.
            print(f"{trial.phase} {trial.trial} {rating}\n", end="", flush=True)


def life(root: Path, length: str, participant: str, delay: float, way: signal.Signals) -> tuple[bool, list[list[str]]]:
    """Let a child run for `delay` seconds, then kill it: whether it was, and what it had said."""
    command = [sys.executable, __file__, "run", str(root), length, participant]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    with child:
        assert child.stdout is not None
        assert child.stderr is not None
        assert child.stdout.readline() == "ready\n", child.stderr.read()
        time.sleep(delay)
        child.send_signal(way)
        said, wrong = child.stdout.read(), child.stderr.read()
    assert child.returncode in (0, -way), wrong
    return child.returncode != 0, [line.split() for line in said.splitlines()]


def kill_often(root: Path, length: str, participant: str, chance: random.Random, longest: float) -> Counter[str]:
    """Kill and resume one session until it is complete; count how it went."""
    files = None
    known: list[list[str]] = []
    count: Counter[str] = Counter()
    while True:
        way = chance.choice([signal.SIGKILL, signal.SIGTERM])
        killed, said = life(root, length, participant, chance.uniform(0, longest), way)
        known += said
        count[way.name] += killed
        path = next(root.glob(f"sourcedata/sub-{participant}/**/*.jsonl"), None)
        events = [] if path is None else read_journal(path).of("trial")
        kept = [[event["phase"], str(event["trial"]), str(event["rating"])] for event in events]
        assert kept[: len(known)] == known, "a finished trial was lost"
        assert len(kept) - len(known) <= 1
        count["recorded, not yet said"] += len(kept) - len(known)
        known = kept
        if not killed:
            break
    assert path is not None
    log = read_journal(path)
    count["lines cut short"] = len(log.broken)
    files = read_dataset(root).sidecars
    assert any(one.participant == participant for one in files)
    assert len(known) == len(DESIGNS[length].trials(participant))
    return count


def main(kills: int = 200, seed: int = 1) -> None:
    chance = random.Random(seed)
    total: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder, "data")
        start = time.perf_counter()
        while total["SIGKILL"] + total["SIGTERM"] < kills:
            total["sessions"] += 1
            total += kill_often(root, "long", f"{total['sessions']:02}", chance, 0.15)
        found = validate(root)
        assert not found.problems, found.problems
        by_standard = bids_problems(root)
        assert not by_standard, by_standard
        hidden = [path for path in root.rglob(".*") if path.is_file()]
        print(f"seed {seed}, {time.perf_counter() - start:.0f} s: {dict(total)}, {found.trials} trials, none lost")
        print(
            f"valid: own checks yes, BIDS {'not checked' if by_standard is None else 'yes'}; {len(hidden)} hidden files"
        )


if __name__ == "__main__":
    if sys.argv[1:2] == ["run"]:
        run(Path(sys.argv[2]), sys.argv[3], sys.argv[4])
        os._exit(0)  # nothing is left to do that a kill could disturb
    main(*map(int, sys.argv[1:]))
