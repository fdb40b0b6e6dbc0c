"""Work shared among threads or processes of this machine, or among the workers of a Dask cluster.

What is shared depends on its arguments alone, so that the results are the same however it is shared. No process
outlives the one that gave it work, whatever ends that.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    as_completed,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, nullcontext
from functools import cache
from itertools import pairwise
from multiprocessing.connection import wait
from typing import Any, TypeVar

from focalgradient.errors import InputError

__all__ = [
    "MOST_THREADS",
    "completed",
    "cores",
    "in_order",
    "linear_algebra_on_one_thread",
    "processes",
    "scheduler",
    "share_rows",
    "shared",
    "workers_for",
]

WAIT = 15
"""Seconds that a scheduler is waited for."""

WORTH_S = 10.0
"""Seconds of work that are worth workers on this machine: each takes some 3 s of processor time to begin."""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Environment variables that say how many threads a process may use, by what reads them: OpenMP, BLAS, Numba."""

ORPHAN = 1
"""Exit code of a process that ends because the one that gave it work is gone."""

MOST_THREADS = 8
"""Threads of compiled loops over rows, at most: our choice."""

Result = TypeVar("Result")


def cores() -> int:
    """Processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(min(MOST_THREADS, cores()), thread_name_prefix="rows")


def share_rows(rows: int, work: Callable[[int, int], object], *, each: int = 1) -> None:
    """Call ``work(first, last)`` on bands of rows that cover ``range(rows)``, in threads side by side.

    There are `each` bands a thread: more than one where some rows take longer. `work` must let other threads run, as
    loops compiled with ``nogil`` do, and must not share rows itself.

    >>> squares = [0] * 5
    >>> share_rows(5, lambda first, last: squares.__setitem__(slice(first, last), [n * n for n in range(first, last)]))
    >>> squares
    [0, 1, 4, 9, 16]
    """
    bands = each * min(MOST_THREADS, cores())
    edges = [rows * number // bands for number in range(bands + 1)]
    others = [_pool().submit(work, first, last) for first, last in pairwise(edges[1:])]
    work(edges[0], edges[1])
    for other in others:
        other.result()


class _OneThread:
    """Linear algebra on one thread while any thread is inside: ours are one a core, and more only wait for each other.

    What it had before is given back by the last that leaves.
    """

    def __init__(self) -> None:
        self._lock, self._inside, self._limit = threading.Lock(), 0, ExitStack()

    def __enter__(self) -> None:
        from threadpoolctl import threadpool_limits

        with self._lock:
            if self._inside == 0:
                self._limit.enter_context(threadpool_limits(limits=1, user_api="blas"))
            self._inside += 1

    def __exit__(self, *error: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._limit.close()


linear_algebra_on_one_thread = _OneThread()


def workers_for(seconds: float) -> int:
    """Processes that work of so many seconds on one core is shared among: one, this process, where it is short.

    >>> workers_for(1.0)
    1
    """
    return cores() if seconds > WORTH_S else 1


@contextmanager
def shared(workers: int = 1, address: str | None = None) -> Iterator[Executor | None]:
    """Give what shares work: so many processes of this machine, or the scheduler at an address; None for this process.

    Raises
    ------
    InputError
        As `scheduler` does.
    """
    with processes(workers) if address is None else scheduler(address) as executor:
        yield executor


@contextmanager
def processes(workers: int) -> Iterator[Executor | None]:
    """Give an executor of so many processes on this machine; None for one, which is this process.

    Whatever ends the block early ends the processes at once.

    Raises
    ------
    InputError
        If a process died, as where memory runs out.
    """
    if workers == 1:
        yield None
        return
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_begin)
    try:
        with _deaths(), _threads(max(1, cores() // workers)):
            yield pool
    except BaseException:
        for process in set(multiprocessing.active_children()) - before:
            process.kill()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _threads(most: int) -> Iterator[None]:
    """Let processes that start now use so many threads each, unless the environment says how many."""
    unset = [name for name in THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(unset, str(most)))
    try:
        yield
    finally:
        for name in unset:
            os.environ.pop(name, None)


def _begin() -> None:
    """Leave Ctrl-C to the process that gives out the work, and end when that is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(ORPHAN)

    threading.Thread(target=watch, name="watch of the parent", daemon=True).start()


@contextmanager
def scheduler(address: str) -> Iterator[Executor]:
    """Give an executor of the workers of a Dask scheduler.

    Raises
    ------
    InputError
        If Dask is not installed, or the scheduler cannot be reached.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError(
            "a Dask scheduler needs Dask, which is not installed: install focalgradient[cluster], or name none."
        ) from error
    try:
        client = Client(address, timeout=WAIT)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InputError(
            f"the scheduler {address} cannot be reached ({error}): give the address that dask scheduler prints, like "
            "'tcp://10.0.0.1:8786'."
        ) from error
    with client, _deaths():
        yield client.get_executor()  # type: ignore[no-untyped-call]


def in_order(executor: Executor | None, function: Callable[[Any], Result], jobs: Sequence[Any]) -> Iterator[Result]:
    """`function` of each job, in the jobs' order; an executor begins them at once."""
    return map(function, jobs) if executor is None else _results(_submitted(executor, function, jobs))


def _results(futures: list[Future[Result]]) -> Iterator[Result]:
    for number, future in enumerate(futures):
        yield future.result()
        futures[number] = Future()  # what was taken need not be kept


def completed(
    executor: Executor | None, function: Callable[[Any], Result], jobs: Sequence[Any]
) -> Iterator[tuple[int, Result]]:
    """Number of each job and `function` of it, as they are done."""
    if executor is None:
        yield from enumerate(map(function, jobs))
        return
    numbers = {future: number for number, future in enumerate(_submitted(executor, function, jobs))}
    for future in as_completed(list(numbers)):
        yield numbers.pop(future), future.result()


def _submitted(executor: Executor, function: Callable[[Any], Result], jobs: Sequence[Any]) -> list[Future[Result]]:
    # Who starts now ignores Ctrl-C from its first moment; where that is not inherited, from its first work.
    main = threading.current_thread() is threading.main_thread()
    with _ignored(signal.SIGINT) if main else nullcontext():
        return [executor.submit(function, job) for job in jobs]


@contextmanager
def _ignored(number: signal.Signals) -> Iterator[None]:
    before = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(number, before)


@contextmanager
def _deaths() -> Iterator[None]:
    """Say in a sentence that a worker died."""
    try:
        yield
    except (BrokenProcessPool, CancelledError) as error:
        raise InputError(_DIED) from error
    except Exception as error:
        if type(error).__name__ == "KilledWorker":  # Dask's, after it tried several times
            raise InputError(_DIED) from error
        raise


_DIED = (
    "a worker died before it had done its work, as where memory runs out: take fewer workers, or more memory; what "
    "was finished before stays where the command keeps it."
)
