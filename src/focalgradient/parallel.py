"""Parallel execution on threads or processes of this machine, or on the workers of a Dask cluster.

Each job's result depends only on its arguments, so results do not depend on how the work is distributed. Worker
processes never outlive the process that started them.
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
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from functools import cache
from itertools import pairwise
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Any, TypeVar

from focalgradient.errors import InputError

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

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

CONNECT_TIMEOUT_S = 15
"""Timeout in seconds for connecting to a scheduler."""

MIN_PARALLEL_S = 10.0
"""Minimum work in seconds for which worker processes are started: starting one takes some 3 s of processor time."""

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Environment variables that limit the threads of a process: OpenMP, OpenBLAS, MKL, Numba."""

ORPHAN_EXIT_CODE = 1
"""Exit code of a worker process whose parent has ended."""

MOST_THREADS = 8
"""Maximum number of threads of compiled loops over rows (a design choice)."""

Result = TypeVar("Result")


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _row_threads() -> int:  # asked once: the system takes as long to answer as a small loop
    return min(MOST_THREADS, cores())


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_row_threads(), thread_name_prefix="rows")


def share_rows(rows: int, work: Callable[[int, int], object], *, each: int = 1) -> None:
    """Call ``work(first, last)`` on bands of rows that cover ``range(rows)``, in threads side by side.

    `each` is the number of bands per thread: use more than one where rows differ in cost. `work` must release the GIL,
    as loops compiled with ``nogil`` do, and must not call `share_rows` itself.

    >>> squares = [0] * 5
    >>> share_rows(5, lambda first, last: squares.__setitem__(slice(first, last), [n * n for n in range(first, last)]))
    >>> squares
    [0, 1, 4, 9, 16]
    """
    bands = max(1, min(rows, each * _row_threads()))
    edges = [rows * number // bands for number in range(bands + 1)]
    others = [_pool().submit(work, first, last) for first, last in pairwise(edges[1:])]
    work(edges[0], edges[1])
    for other in others:
        other.result()


@cache
def _libraries() -> ThreadpoolController:  # finding them takes as long as filtering a small image
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


class _OneThread:
    """Context manager that limits BLAS to one thread while any thread is inside, since the callers use all cores.

    The last thread to leave restores the previous limit.
    """

    def __init__(self) -> None:
        self._lock, self._inside, self._limit = threading.Lock(), 0, ExitStack()

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                self._limit.enter_context(_libraries().limit(limits=1, user_api="blas"))
            self._inside += 1

    def __exit__(self, *error: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._limit.close()


linear_algebra_on_one_thread = _OneThread()


def workers_for(seconds: float) -> int:
    """Return the number of processes worth using for work of `seconds` on one core; 1 is this process.

    >>> workers_for(1.0)
    1
    """
    return cores() if seconds > MIN_PARALLEL_S else 1


def shared(workers: int = 1, address: str | None = None) -> AbstractContextManager[Executor | None]:
    """Provide an executor: `workers` processes of this machine, or a scheduler at `address`; None for this process.

    Raises
    ------
    InputError
        As for `scheduler`.
    """
    return processes(workers) if address is None else scheduler(address)


@contextmanager
def processes(workers: int) -> Iterator[Executor | None]:
    """Provide an executor with `workers` processes on this machine; None for 1, which is this process.

    The processes are killed at once if the block ends early.

    Raises
    ------
    InputError
        If a process died, for example for lack of memory.
    """
    if workers == 1:
        yield None
        return
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=_initialise_worker)
    try:
        with _worker_failures(), _threads(max(1, cores() // workers)):
            yield pool
    except BaseException:
        for process in set(multiprocessing.active_children()) - before:
            process.kill()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _threads(most: int) -> Iterator[None]:
    """Set the number of threads for processes started inside the block, except where the environment sets it."""
    unset = [name for name in THREAD_VARIABLES if name not in os.environ]
    os.environ.update(dict.fromkeys(unset, str(most)))
    try:
        yield
    finally:
        for name in unset:
            os.environ.pop(name, None)


def _initialise_worker() -> None:
    """Ignore Ctrl-C, which the parent process handles, and exit when the parent has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(ORPHAN_EXIT_CODE)

    threading.Thread(target=watch, name="watch of the parent", daemon=True).start()


@contextmanager
def scheduler(address: str) -> Iterator[Executor]:
    """Provide an executor that uses the workers of a Dask scheduler.

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
        client = Client(address, timeout=CONNECT_TIMEOUT_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InputError(
            f"the scheduler {address} cannot be reached ({error}): give the address that dask scheduler prints, like "
            "'tcp://10.0.0.1:8786'."
        ) from error
    with client, _worker_failures():
        yield client.get_executor()  # type: ignore[no-untyped-call]


def in_order(executor: Executor | None, function: Callable[[Any], Result], jobs: Sequence[Any]) -> Iterator[Result]:
    """Yield the results of `function` for each job in order; an executor starts all jobs at once."""
    return map(function, jobs) if executor is None else _results(_submitted(executor, function, jobs))


def _results(futures: list[Future[Result]]) -> Iterator[Result]:
    for number, future in enumerate(futures):
        yield future.result()
        futures[number] = Future()  # release the result


def completed(
    executor: Executor | None, function: Callable[[Any], Result], jobs: Sequence[Any]
) -> Iterator[tuple[int, Result]]:
    """Yield each job's index and the result of `function`, in the order of completion."""
    if executor is None:
        yield from enumerate(map(function, jobs))
        return
    numbers = {future: number for number, future in enumerate(_submitted(executor, function, jobs))}
    for future in as_completed(list(numbers)):
        yield numbers.pop(future), future.result()


def _submitted(executor: Executor, function: Callable[[Any], Result], jobs: Sequence[Any]) -> list[Future[Result]]:
    # Workers started now inherit that Ctrl-C is ignored; where that is not inherited, `_initialise_worker` ignores it.
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
def _worker_failures() -> Iterator[None]:
    """Raise `InputError` if a worker process died."""
    try:
        yield
    except (BrokenProcessPool, CancelledError) as error:
        raise InputError(_WORKER_DIED) from error
    except Exception as error:
        if type(error).__name__ == "KilledWorker":  # raised by Dask after several attempts
            raise InputError(_WORKER_DIED) from error
        raise


_WORKER_DIED = (
    "a worker died before it finished, for example for lack of memory: use fewer workers, or more memory; results "
    "that were finished before remain where the command stores them."
)
