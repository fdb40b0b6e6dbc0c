"""Experiments in real windows, killed again and again: `python tests/experiments/killing_windows.py` kills 200 times.

A second number is the seed; a word, `blur-threshold` or `gaze`, kills the adaptive experiment, or depth rating while
the gaze (the pointer) is recorded.

Somebody takes part, with real keys; the program is killed (SIGKILL, SIGTERM) while it starts, shows, asks or writes,
and resumed, until 200 kills are done and the last session is complete. What it said to have recorded must be there, in
its order and unchanged, with at most one trial more; in the end all must be a whole, valid data set.

The libraries are loaded once, and every life of the program is a fork: it starts in a second, not in four.
"""

from __future__ import annotations

import os
import random
import select
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from headless import PAGES, Headless, design, headless, make_set

from focalgradient.dataset import Files, bids_problems, export, read_dataset, read_journal, validate
from focalgradient.design import load_design
from focalgradient.lab import EXPERIMENTS, run

BRIEF = {"practice_trials": 1, "break_every": 5, "mark_s": 0.05, "picture_s": 0.05, "least_break_s": 0.05}
PAUSES = {"blank_s": 0.05, "pause_s": 0.05}
RATING = {"repetitions": 3, "longest_run": 6, "standard_s": 0.05, "catch_pictures": ["standard"], **BRIEF}
THRESHOLD = {"scenes": ["spheres-01"], "repetitions": 10, "catch_trials": 2, **BRIEF, **PAUSES}
DESIGNS = {
    "depth-rating": ("depth-rating", design("depthrating", **RATING, blank_s=0.0, pause_s=0.0)),
    "blur-threshold": ("blur-threshold", design("blurthreshold", **THRESHOLD)),
    "gaze": ("depth-rating", design("depthrating", **RATING, blank_s=0.0, pause_s=0.0, gaze="mouse")),
}
KEYS = {"question": ("Right", "Return"), **dict.fromkeys(PAGES - {"thanks"}, ("space",))}
LONGEST = 60.0  # seconds of a life, if it is not killed


def start(screen: Headless, folder: Path, experiment: str, participant: str, resume: bool) -> tuple[int, int]:
    """Fork a life of the program: its process, and where it says its events."""
    options = ["--participant", participant, "--data", str(folder / "data"), "--stimuli", str(folder / "set")]
    options += ["--design", str(folder / "design.toml"), "--uncalibrated", "--windowed"]
    options += ["--markers", str(screen.folder / "markers.py"), *(["--resume"] if resume else [])]
    read, write = os.pipe()
    child = os.fork()
    if child:
        os.close(write)
        return child, read
    os.close(read)
    os.dup2(write, 1)
    os.dup2(os.open(screen.folder / "errors.txt", os.O_WRONLY | os.O_CREAT | os.O_APPEND), 2)
    os.environ.update(screen.environment)
    os._exit(run(EXPERIMENTS[experiment], options))


def life(
    screen: Headless,
    folder: Path,
    experiment: str,
    participant: str,
    resume: bool,
    chance: random.Random,
    way: signal.Signals,
) -> tuple[bool, int, str]:
    """Take part until the program is killed or at its end: whether it was killed, trials recorded, the last event."""
    child, pipe = start(screen, folder, experiment, participant, resume)
    early = chance.random() < 0.25
    deadline = time.monotonic() + (chance.uniform(0, 3.0) if early else LONGEST)
    recorded, last = 0, "starting"
    text = b""
    while True:
        ready, _, _ = select.select([pipe], [], [], max(deadline - time.monotonic(), 0))
        if not ready:
            os.kill(child, way)
            break
        more = os.read(pipe, 65536)
        if not more:
            break
        text += more
        *lines, text = text.split(b"\n")
        for name in (line.split()[2].decode() for line in lines if line.startswith(b"event ")):
            last = name
            recorded += name == "recorded"
            if name == "sitting" and not early:
                deadline = time.monotonic() + chance.uniform(0, 4.0)
            if name in KEYS:
                choice = name == "question" and experiment == "blur-threshold"
                screen.keys(*((chance.choice(("Left", "Right")),) if choice else KEYS[name]))
            elif name == "thanks":
                screen.keys("space")
                deadline = time.monotonic() + LONGEST
    _, status = os.waitpid(child, 0)
    while more := os.read(pipe, 65536):
        recorded += more.count(b" recorded ")
    os.close(pipe)
    killed = os.WIFSIGNALED(status)
    assert killed or os.WEXITSTATUS(status) == 0, (screen.folder / "errors.txt").read_text()
    return killed, recorded, last


def main(kills: int = 200, seed: int = 1, which: str = "depth-rating") -> None:
    experiment, text = DESIGNS[which]
    chance = random.Random(seed)
    total: Counter[str] = Counter()
    moments: Counter[str] = Counter()
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as name, headless(Path(name, "x")) as screen:
        folder = Path(name)
        make_set(folder / "set", ["spheres-00", "spheres-01"], (64, 48))
        (folder / "design.toml").write_text(text)
        trials = len(load_design(folder / "design.toml").trials("01"))
        while total["SIGKILL"] + total["SIGTERM"] < kills:
            total["sessions"] += 1
            participant = f"{total['sessions']:02}"
            journal = Files(folder / "data", experiment.replace("-", ""), participant).journal
            known: list[dict] = []
            while True:
                way = chance.choice([signal.SIGKILL, signal.SIGTERM])
                killed, recorded, last = life(screen, folder, experiment, participant, journal.exists(), chance, way)
                log = read_journal(journal) if journal.exists() else None
                kept = [] if log is None else log.of("trial")
                assert kept[: len(known)] == known, "a finished trial was lost, or changed"
                assert 0 <= len(kept) - len(known) - recorded <= 1, "what was said to be recorded is not there"
                known = kept
                if killed:
                    total[way.name] += 1
                    moments[last] += 1
                    print(f"\r{total['SIGKILL'] + total['SIGTERM']} kills", end="", file=sys.stderr, flush=True)
                if not killed:
                    break
                if len(known) == trials:
                    total["killed after the last trial"] += 1
                    export(journal)  # as 'focalgradient validate --export' does
                    break
            assert len(known) == trials
            total["lines cut short"] += 0 if log is None else len(log.broken)
        found = validate(folder / "data", folder / "set")
        assert not found.problems, found.problems
        assert bids_problems(folder / "data") == []
        (table,) = [table for table in read_dataset(folder / "data").tables.values() if len(table)]
        assert len(table) == total["sessions"] * (trials - 1)  # but practice
    seconds = time.monotonic() - begun
    print(f"\nseed {seed}, {seconds:.0f} s: {dict(total)}, {found.trials} trials, none lost; valid, by BIDS too")
    print(f"killed after: {dict(moments.most_common())}")


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if not word.isdigit()]
    main(*map(int, filter(str.isdigit, sys.argv[1:])), **({"which": words[0]} if words else {}))
