"""SIGTERM handled as Ctrl-C, so that a stopped program says what it has saved."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

__all__ = ["Terminated", "exit_code", "terminable"]

RESEND_S = 0.05
"""Delay in s after which a signal that was lost in a destructor is sent again."""


class Terminated(KeyboardInterrupt):
    """SIGTERM: handled as Ctrl-C, with a different exit code."""


def exit_code(stop: BaseException) -> int:
    """Return the exit code after Ctrl-C or SIGTERM: 128 plus the signal's number, as in shells.

    >>> exit_code(KeyboardInterrupt()), exit_code(Terminated())
    (130, 143)
    """
    return 128 + (signal.SIGTERM if isinstance(stop, Terminated) else signal.SIGINT)


@contextmanager
def terminable() -> Iterator[None]:
    """Handle SIGTERM as Ctrl-C within the context."""

    def stop(*_: object) -> NoReturn:
        raise Terminated

    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def again(ignored: Any) -> None:
        if issubclass(ignored.exc_type, KeyboardInterrupt):  # raised in a destructor, where Python ignores it
            number = signal.SIGTERM if issubclass(ignored.exc_type, Terminated) else signal.SIGINT
            threading.Timer(RESEND_S, _signal_main_thread, (number,)).start()
        else:
            otherwise(ignored)

    before = signal.signal(signal.SIGTERM, stop)
    otherwise, sys.unraisablehook = sys.unraisablehook, again
    try:
        yield
    finally:
        sys.unraisablehook = otherwise
        signal.signal(signal.SIGTERM, before)


def _signal_main_thread(number: signal.Signals) -> None:
    if sys.platform == "win32":
        signal.raise_signal(number)
    else:
        signal.pthread_kill(threading.main_thread().ident or 0, number)
