"""Tests of Ctrl-C in the background of a shell, which starts its jobs ignoring the interrupt signal."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interruptible() -> Iterator[None]:
    """Take the interrupt signal here, and in the processes started here; also a decorator of tests."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
