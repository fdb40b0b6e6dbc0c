"""Work shared among processes and clusters: the same results, and nobody left behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from interrupts import interruptible
from threadpoolctl import threadpool_info, threadpool_limits

from focalgradient.parallel import completed, in_order, linear_algebra_on_one_thread, scheduler, shared

PROGRAM = """
import sys, time
from focalgradient.parallel import completed, processes
sys.path.insert(0, {here!r})
from test_parallel import slowly
with processes(2) as pool:
    for done in completed(pool, slowly, [(sys.argv[1], n) for n in range(2)]):
        pass
"""


def slowly(job: tuple[str, int]) -> None:
    folder, number = job
    Path(folder, f"{number}.pid").write_text(str(os.getpid()))
    time.sleep(60)


def square(number: int) -> int:
    time.sleep(0.02)
    return number**2


def running(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.skipif(sys.platform != "linux", reason="looks processes up in /proc")
@pytest.mark.parametrize("way", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
@interruptible()
def test_no_worker_outlives_what_gave_it_work(tmp_path: Path, way: signal.Signals) -> None:
    program = PROGRAM.format(here=str(Path(__file__).parent))
    run = subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], stderr=subprocess.DEVNULL)
    until = time.monotonic() + 60
    while len(found := [path.read_text() for path in tmp_path.glob("*.pid")]) < 2 or not all(found):
        assert time.monotonic() < until
        time.sleep(0.05)
    workers = [int(text) for text in found]
    assert all(map(running, workers))
    run.send_signal(way)
    run.wait(timeout=60)
    until = time.monotonic() + 60
    while any(map(running, workers)):
        assert time.monotonic() < until, "a worker is left"
        time.sleep(0.05)


def test_results_are_the_same_however_they_are_shared() -> None:
    expected = [n**2 for n in range(12)]
    for workers in (1, 2):
        with shared(workers) as executor:
            assert list(in_order(executor, square, range(12))) == expected
            assert sorted(completed(executor, square, range(12))) == list(enumerate(expected))


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kills as POSIX does")
@pytest.mark.filterwarnings("ignore:::distributed")
def test_a_cluster_of_two_of_which_one_is_killed_gives_the_same() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", silence_logs=50
    ) as cluster:
        victim = next(iter(cluster.workers.values())).pid
        with scheduler(cluster.scheduler_address) as executor:
            found = {}
            for number, result in completed(executor, square, range(60)):
                if len(found) == 5:
                    os.kill(victim, signal.SIGKILL)
                found[number] = result
    assert found == {n: n**2 for n in range(60)}


def test_linear_algebra_has_its_threads_again_when_the_last_leaves() -> None:
    def threads() -> set[int]:
        return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}

    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with linear_algebra_on_one_thread:
            with linear_algebra_on_one_thread:
                assert threads() == {1}
            assert threads() == {1}
        assert threads() == before
