"""Latency of answers and memory of the server with many simultaneous participants.

`python benchmarks/web_answers.py [--people 200] [--every 8] [--sessions 1]`: each person answers at regular intervals
(seconds), as in depth rating, until all trials are done. An answer is acknowledged when it is stored on disk. For
comparison, a separate program writes and flushes (fsync) the same number of bytes to the same disk at the same rate.

With `--sessions`, each person is followed by another when done; with `--every 0`, answers follow as fast as they are
acknowledged. Thus an hour can be measured in less time: 50 people who answer every 8 s give 22,500 answers in an hour,
as does `--people 50 --sessions 32 --every 0`. The memory of the server is printed by tenths of all answers.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import httpx2
import numpy as np

DESIGN = """
task = "necker"
repetitions = 2
trial_s = 2.0
practice_s = 2.0
practice_trials = 2
catch_trials = 0
strengths_mm = [4.0]
break_every = 0
"""
ANSWERS = 14
"""Number of answers in a session of this design, including practice."""

SCREEN = {"screen_px": [1920, 1080], "pixel_ratio": 1.0, "refresh_hz": 60.0, "browser": "benchmark", "now_ms": 0.0}
FRAMES = [round(16.67 * n, 2) for n in range(120)]


async def person(client: httpx2.AsyncClient, every: float, waits: list[float]) -> None:
    """Run one participant, from the link to the end."""
    token = (await client.post("/api/join", json={"platform": {}})).json()["token"]
    who = {"token": token, "tab": "tab"}
    trials = (await client.post("/api/begin", json={**who, **SCREEN})).json()["trials"]
    practised: list[dict[str, Any]] = []
    passed: dict[str, Any] = {}
    await asyncio.sleep(2.0)  # duration of the first trial: earlier answers are refused
    for index, trial in enumerate(trials):
        answer: dict[str, Any] = {
            "onset": 10.0 * index,
            "presses": [[0.5, "f", True], [1.5, "f", False]],
            "trial_duration": 2.0,
            "frames": {"shown": [{"event": "cube", "stamps": FRAMES}]},
        }
        key = {"phase": trial["phase"], "trial": trial["trial"]}
        if trial["phase"] == "main" and not passed:
            judged = await client.post("/api/judge", json={**who, "round": 20, "answers": practised})
            passed = {"practice_token": judged.json()["practice_token"]}
        given = (await client.post("/api/next", json={**who, **key, **passed})).json()
        await client.post("/api/expose", json={**who, **key, "round": 1, "exposure": f"e{index}"})
        if trial["phase"] == "practice":
            practised.append({**key, "answer": answer})
        key |= {"attempt": f"a{index}", "trial_token": given["trial_tokens"][0]}
        start = time.perf_counter()
        reply = await client.post("/api/answer", json={**who, **key, "answer": answer})
        waits.append(time.perf_counter() - start)
        assert reply.json()["done"] == index + 1, reply.text
        await asyncio.sleep(every)
    assert (await client.post("/api/finish", json=who)).status_code == 200


async def place(client: httpx2.AsyncClient, number: int, options: argparse.Namespace, waits: list[float]) -> None:
    """Run a number of people, one after another."""
    await asyncio.sleep(options.every * number / options.people)
    for _ in range(options.sessions):
        await person(client, options.every, waits)


async def everybody(address: str, server: int, options: argparse.Namespace) -> tuple[list[float], list[float]]:
    """Run all at once; return the latency of each answer in seconds, and the memory of the server by tenths."""
    waits: list[float] = []
    memory: list[float] = []

    async def watch() -> None:
        while True:
            tenths = len(waits) * 10 // (options.people * options.sessions * ANSWERS)
            memory.extend([memory_mb(server)] * (tenths - len(memory)))
            await asyncio.sleep(0.1)

    # the server closes idle connections after 5 s; the client closes its own earlier, so that none is used while
    # closing
    limits = httpx2.Limits(max_connections=None, keepalive_expiry=2.0)
    async with httpx2.AsyncClient(base_url=address, timeout=120, limits=limits) as client:
        watching = asyncio.create_task(watch())
        await asyncio.gather(*(place(client, number, options, waits) for number in range(options.people)))
        watching.cancel()
    return waits, memory


def plain_writes(folder: Path, count: int, rate: float) -> list[float]:
    """Return the durations of the same number of writes of 2 KB, each flushed to disk, for comparison."""
    waits = []
    with (folder / "plain").open("ab") as file:
        for _ in range(count):
            start = time.perf_counter()
            file.write(b"x" * 2048)
            file.flush()
            os.fsync(file.fileno())
            waits.append(time.perf_counter() - start)
            time.sleep(max(0.0, 1 / rate - waits[-1]))
    return waits


def memory_mb(process: int) -> float:
    """Return the private memory of a process in MB."""
    reply = Path(f"/proc/{process}/status").read_text()
    found = re.search(r"VmRSS:\s+(\d+)", reply)
    assert found
    return int(found[1]) / 1024


def processor_s(process: int) -> float:
    """Return the processor time of a process, which is hardly affected by other load."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Run, and print one line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=200)
    parser.add_argument("--every", type=float, default=8.0)
    parser.add_argument("--sessions", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "design.toml").write_text(DESIGN)
        program = [str(Path(sys.executable).with_name("focalgradient")), "serve", "design.toml", "--data", "data"]
        rate = ["--join-rate", "1000000"]  # all join at once, from one address
        server = subprocess.Popen([*program, *rate, "--port", "0"], cwd=folder, stdout=subprocess.PIPE, text=True)
        assert server.stdout is not None
        address = ""
        for line in server.stdout:
            if found := re.search(r"Open link: (\S+)/", line):
                address = found[1]
            if line.startswith("Ctrl-C"):
                break
        before, used = memory_mb(server.pid), processor_s(server.pid)
        waits, memory = asyncio.run(everybody(address, server.pid, options))
        after, used = memory_mb(server.pid), processor_s(server.pid) - used
        server.terminate()
        server.communicate()
        journals = list((folder / "data").rglob("*.jsonl"))
        kept = sum(path.read_text().count('"event": "trial"') for path in journals)
        assert kept == len(waits), (kept, len(waits))
        peer = plain_writes(folder, 200, options.people / options.every if options.every else 100)
    ms = [1e3 * float(value) for value in np.percentile(waits, [50, 99, 100])]
    least = 1e3 * float(np.percentile(peer, 99))
    print(
        f"{options.people} people, an answer every {options.every:g} s: {len(waits)} answers, all kept; "
        f"acknowledged in {ms[0]:.0f} ms (median), {ms[1]:.0f} ms (99th percentile), {ms[2]:.0f} ms (most); a plain "
        f"flushed write {least:.0f} ms (99th percentile), ratio {ms[1] / least:.1f}; of a processor the server used "
        f"{1e3 * used / len(waits):.1f} ms an answer; its memory "
        f"{before:.0f} to {after:.0f} MB, by tenths of the answers {' '.join(f'{each:.1f}' for each in memory)}"
    )


if __name__ == "__main__":
    main()
