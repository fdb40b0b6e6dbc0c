"""Two programs that begin, or resume, one session at one moment: `python tests/racing.py` lets 300 pairs of each race.

Both are processes of their own, that wait at a barrier and then try at once; who succeeds holds the session until the
other has tried. Exactly one of each pair succeeds, the other gets one sentence, and nothing but that session is there.
"""

from __future__ import annotations

import multiprocessing
import random
import sys
import tempfile
import time
import traceback
from collections import Counter
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import Any

from killing import DESIGNS, answer_of

from focalgradient.dataset import Apparatus, Session, read_dataset, read_journal, validate
from focalgradient.design import Pinhole, Plan
from focalgradient.errors import InputError

DESIGN = Pinhole(scenes=["a"], repetitions=1)
OWN: Plan = DESIGNS["own"]
APPARATUS = Apparatus("seconds from the start of the sitting")
WAYS = ("begin", "resume")
TRIAL_S = DESIGN.look_s + 5.0
REFUSED = ("already contains a session of", "is being recorded by another program", "which is never overwritten")


def take(design: Plan, way: str, root: Path, participant: str, about: dict[str, Any]) -> Session:
    if way == "begin":
        return Session.begin(root, design, participant, apparatus=APPARATUS, about=about)
    return Session.resume(root, design.task, participant, apparatus=APPARATUS)


def racer(number: int, design: Plan, barrier: Barrier, rounds: list[tuple[str, Path, str]], pipe: Connection) -> None:
    """Try each round, and tell how it went."""
    chance = random.Random(number)
    for way, root, participant in rounds:
        session, said = None, ""
        barrier.wait()
        time.sleep(chance.uniform(0, 0.002))  # so that not only one order of steps is tried
        try:
            session = take(design, way, root, participant, {"age": 20 + number})
            for count, trial in enumerate(session.remaining()[: 1 + number]):
                onset = TRIAL_S * count
                session.record(trial, answer_of(design, onset=onset, rating=1.0 + number % 3, response_time=1.5))
        except InputError as error:
            said = str(error)
        except BaseException:
            said = traceback.format_exc()
        barrier.wait()  # until the other has tried
        if session is not None:
            session._journal.close()
        pipe.send((session is not None, said))
        barrier.wait()


def race(folder: Path, pairs: int, fresh: bool, design: Plan = DESIGN) -> Counter[str]:
    """Let pairs begin and, once the first has let go, resume; `fresh` gives each pair a data set of its own."""
    context = multiprocessing.get_context("spawn")
    rounds = [
        (way, folder / (f"data-{pair}" if fresh else "data"), f"{pair + 1:03}") for pair in range(pairs) for way in WAYS
    ]
    barrier, pipes = context.Barrier(2), [context.Pipe(duplex=False) for _ in range(2)]
    racers = [
        context.Process(target=racer, args=(number, design, barrier, rounds, pipe), daemon=True)
        for number, (_, pipe) in enumerate(pipes)
    ]
    for one in racers:
        one.start()
    count: Counter[str] = Counter()
    for way, root, participant in rounds:
        both = []
        for told, _ in pipes:
            assert told.poll(120), "a racer hangs"
            both.append(told.recv())
        won = [number for number, (success, _) in enumerate(both) if success]
        assert len(won) == 1, (way, participant, both)
        (said,) = (sentence for success, sentence in both if not success)
        assert any(words in said for words in REFUSED), said
        count[f"{way}: racer {won[0]} succeeded"] += 1
        if way == "begin":
            count["wins"] = won[0]
        else:
            _is_theirs(root, participant, [count["wins"], won[0]])
    for one in racers:
        one.join()
        assert one.exitcode == 0
    assert not [path for path in folder.rglob(".*") if path.is_file()], "something hidden was left"
    del count["wins"]
    return count


def _is_theirs(root: Path, participant: str, winners: list[int]) -> None:
    """Whether the journal holds what the two winners recorded, in one piece, and the participant stands there once."""
    (path,) = root.glob(f"sourcedata/sub-{participant}/**/*.jsonl")
    log = read_journal(path)
    assert (log.broken, log.changed) == ((), ())
    assert len(log.of("resumed")) == 1
    expected = [1.0 + number for number in winners for _ in range(1 + number)]
    assert [event["rating"] for event in log.of("trial")] == expected
    rows = (root / "participants.tsv").read_text().splitlines()
    assert [row.split("\t")[2] for row in rows if row.startswith(f"sub-{participant}\t")] == [str(20 + winners[0])]


def main(pairs: int = 300) -> None:
    start = time.perf_counter()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        for fresh, design in ((False, DESIGN), (True, OWN)):
            count = race(Path(folder, f"fresh-{fresh}"), pairs // 2, fresh, design)
            print(f"{design.task}, {'new data sets' if fresh else 'one data set'}: {dict(sorted(count.items()))}")
        root = Path(folder, "fresh-False", "data")
        for number in range(pairs // 2):
            with Session.resume(root, "pinhole", f"{number + 1:03}", apparatus=APPARATUS) as session:
                for at, trial in enumerate(session.remaining()):
                    session.record(trial, answer_of(DESIGN, onset=TRIAL_S * at, rating=1.0, response_time=1.5))
        assert len(read_dataset(root).sidecars) == pairs // 2
        assert not validate(root).problems
    print(f"{pairs} pairs each way, {time.perf_counter() - start:.0f} s: one of each succeeded, nothing was lost")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
