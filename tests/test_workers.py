"""Every long command gives the same on one process, on two, and on a cluster of two workers of which one is killed."""

import json
import os
import shutil
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import succeed
from long_commands import COMMANDS as LONG
from long_commands import prepare

from focalgradient.observers import pictures

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="kills as POSIX does"),
    pytest.mark.filterwarnings("ignore:::distributed"),
    pytest.mark.usefixtures("in_time"),
]

RATING = (
    'task = "depthrating"\nscenes = ["spheres-00"]\napertures = ["pinhole", "f/4"]\nrepetitions = 1\n'
    "catch_trials = 1\npractice_trials = 0\n"
)
"""A design of which the set of "stimuli depth-rating" has the pictures."""

PHOTOGRAPH = ("--picture", "a.png", "--depth", "far.npy", "--field", "10", "--apertures", "4,2")
COMMANDS = {
    "stimuli of photographs": ("stimuli", "depth-rating", *PHOTOGRAPH, "--pixel-pitch", "500"),
    "power": ("power", "depth-rating", "--subjects", "3,4", "--experiments", "6", "--design", "rating.toml"),
    "frames": ("depth", *(f"f{number}.toml" for number in range(4)), "--psf", "gaussian"),
    **{
        name: tuple(LONG[name].args[: LONG[name].args.index("--workers")])
        for name in ("stimuli depth-rating", "stimuli necker", "simulate depth-rating", "simulate necker", "eye")
    },
    "report": ("report", "data"),
}


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the commands are given, in one folder."""
    folder = tmp_path_factory.mktemp("given")
    prepare(folder)
    (folder / "rating.toml").write_text(RATING)
    for number in (2, 3):
        shutil.copy(folder / "f0.toml", folder / f"f{number}.toml")
    return folder


def contents(folder: Path) -> dict[str, Any]:
    """What the files of a folder hold; without what tells how long it took, when it was made and in which order."""
    found: dict[str, Any] = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if not path.is_file():
            continue
        if path.suffix == ".json":
            value = json.loads(path.read_bytes())
            if isinstance(value, dict):
                value = {key: entry for key, entry in value.items() if key not in ("seconds", "Journal")}
            found[name] = value
        elif path.name.endswith("_beh.jsonl"):
            events = [json.loads(line) for line in path.read_bytes().splitlines()]
            found[name] = [{key: event[key] for key in event if key not in ("time", "chain")} for event in events]
        elif path.name == "experiments.jsonl":
            found[name] = sorted(path.read_text().splitlines())
        elif path.suffix == ".npz":
            with np.load(path) as arrays:
                found[name] = {key: arrays[key].tobytes() for key in arrays.files}
        else:
            found[name] = path.read_bytes()
    return found


def made(name: str, out: Path, *how: str) -> dict[str, Any]:
    succeed(*COMMANDS[name], *how, "--out", out)
    return contents(out)


@contextmanager
def one_worker_killed(cluster: Any) -> Iterator[list[int]]:
    """Kill a worker of the cluster as soon as it has work to do; gives how many pieces of work it had then."""
    had: list[int] = []
    stop = threading.Event()

    def watch() -> None:
        while not stop.is_set() and not had:
            for state in list(cluster.scheduler.workers.values()):
                work = len(state.processing)
                if work and (worker := cluster.workers.get(state.name)) is not None:
                    os.kill(worker.pid, signal.SIGKILL)
                    had.append(work)
                    break
            time.sleep(0.001)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield had
    finally:
        stop.set()
        thread.join()


LIMIT_S = 500
"""Seconds that a command and the cluster may take."""


@pytest.fixture
def in_time() -> Iterator[None]:
    """End, in place of a hang, with an error that shows where."""

    def late(*_: object) -> None:
        raise TimeoutError(f"more than {LIMIT_S} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S, 30)  # again, where the end hangs, too
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.fixture
def cluster() -> Iterator[Any]:
    """A cluster for each test: where little processor time is to be had, a killed worker is not always started anew."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as local:
        yield local


@pytest.mark.slow  # each starts processes, which import the package: some seconds of processor time a command
@pytest.mark.parametrize("name", list(COMMANDS))
def test_one_process_two_and_a_cluster_of_which_one_is_killed(
    name: str, given: Path, cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(given)
    monkeypatch.setenv(pictures.CACHE, str(given / "cache"))
    if name == "simulate depth-rating":  # looks at small pictures of one scene, made here
        made("stimuli depth-rating", given / "set", "--workers", "1")
        monkeypatch.setitem(COMMANDS, name, (*COMMANDS[name], "--stimuli", str(given / "set")))
    monkeypatch.setattr("focalgradient.dataset.checks.BATCH", 1)
    for size, small in (("SHAPE", (64, 96)), ("FRAMES", 4)):
        monkeypatch.setattr(import_module("focalgradient.cli.eye"), size, small)
    one = made(name, tmp_path / "one", "--workers", "1")
    assert one
    two = made(name, tmp_path / "two", "--workers", "2")
    assert two == one
    cluster.wait_for_workers(2, timeout=60)
    with one_worker_killed(cluster) as had:
        three = made(name, tmp_path / "three", "--scheduler", cluster.scheduler_address)
    assert had, "no worker had work to be killed at"
    assert three == one
