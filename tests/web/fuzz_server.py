"""Requests of an attacker, from a seed: `python tests/web/fuzz_server.py [COUNT] [SEED]`.

Right messages are changed at random and sent in any order, between the answers of somebody who takes part. Each gets an
answer below 500 within a minute; nothing outside the study's folder is written, memory does not grow, the other's
session stays whole, and at the end the data set is valid.
"""

from __future__ import annotations

import json
import random
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from participant import Participant, client_of, study
from starlette.testclient import TestClient

from focalgradient.dataset import read_journal, validate

PATHS = ("join", "state", "begin", "answer", "here", "leave", "finish", "../study.py", "")
ODD: tuple[Any, ...] = (
    *(None, True, -1, 0, 1e308, float("nan"), 2**70, "", "x" * 70, "<script>", "../..", "\0", "\ud800", [], {}, [[]]),
    *({"a": {"b": []}}, "main", "practice", 1, 3.5),
)


def changed(value: Any, chance: random.Random) -> Any:
    """A message with something in it exchanged, left out or added."""
    if isinstance(value, dict) and value and chance.random() < 0.9:
        name = chance.choice(list(value))
        way = chance.random()
        if way < 0.15:
            return {key: one for key, one in value.items() if key != name}
        if way < 0.25:
            return {**value, chance.choice(["extra", "__proto__", "token", "answer"]): chance.choice(ODD)}
        return {**value, name: changed(value[name], chance)}
    if isinstance(value, list) and value and chance.random() < 0.8:
        place = chance.randrange(len(value))
        return [*value[:place], changed(value[place], chance), *value[place + 1 :]]
    return chance.choice(ODD)


def body_of(message: Any, chance: random.Random) -> bytes:
    """Its bytes, now and then damaged."""
    content = json.dumps(message).encode()
    way = chance.random()
    if way < 0.05:
        return content[: chance.randrange(len(content) + 1)]
    if way < 0.1:
        place = chance.randrange(len(content))
        return content[:place] + bytes([chance.randrange(256)]) + content[place + 1 :]
    return content


def attack(client: TestClient, victim: Participant, chance: random.Random) -> int:
    """Send one request; gives the status."""
    number = chance.randrange(len(victim.trials))
    token = chance.choice([victim.token, victim.token[:-1], "unknown"])
    screen = {"screen_px": [1920, 1080], "pixel_ratio": 1.0, "refresh_hz": 60.0, "browser": "", "now_ms": 0.0}
    message = {
        "token": token,
        "tab": chance.choice(["tab-1", "tab-2"]),
        **chance.choice([{}, screen, victim.message(victim.trials[number], number), {"platform": {"id": "abc"}}]),
    }
    for _ in range(chance.randrange(3)):
        message = changed(message, chance)
    start = time.monotonic()
    path = chance.choice(PATHS)
    answer = client.post(f"/api/{path}", content=body_of(message, chance))
    assert answer.status_code < 500, (path, message)
    assert time.monotonic() - start < 60
    return answer.status_code


def run(count: int, seed: int, folder: Path) -> Counter[int]:
    """Send so many; gives how many answers of each status there were."""
    chance, statuses = random.Random(seed), Counter[int]()
    before = sorted(folder.parent.iterdir())
    with client_of(study(folder)) as client:
        victim = Participant(client)
        victim.begin()
        total, answered = len(victim.trials), 0
        for number in range(count):
            statuses[attack(client, victim, chance)] += 1
            if answered < total - 1 and number * total > answered * count:
                victim.ask("begin") if chance.random() < 0.1 else None
                while (given := victim.answer(answered)).status_code == 409 and "done" not in given.json():
                    victim.tab = "tab-2" if victim.tab == "tab-1" else "tab-1"  # the attacker has the same link
                answered = given.json().get("done", answered)
        for tab in ("tab-1", "tab-2", "main", "practice"):  # any of which the attacker may have made its holder
            victim.tab = tab
            victim.ask("leave")
        if victim.begin().status_code == 200:
            for number in range(len(victim.trials)):
                assert victim.answer(number).status_code == 200
    found = validate(folder / "data").problems
    assert found == (), found
    for journal in (folder / "data").rglob("*.jsonl"):
        keys = [(event["phase"], event["trial"]) for event in read_journal(journal).of("trial")]
        assert len(keys) == len(set(keys))
    assert sorted(folder.parent.iterdir()) == before
    return statuses


def main() -> None:
    """Run, and say what came back and how much memory was used."""
    count, seed = (int(text) for text in (sys.argv[1:] + ["10000", "1"][len(sys.argv) - 1 :])[:2])
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "study").mkdir()
        statuses = run(min(500, count), seed + 1, Path(folder) / "study")
        early = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        (Path(folder) / "more" / "study").mkdir(parents=True)
        statuses = run(count, seed, Path(folder) / "more" / "study")
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - early) / 1024
    print(f"{count} requests, seed {seed}: {dict(sorted(statuses.items()))}; memory grew by {grown:.1f} MB")


if __name__ == "__main__":
    main()
