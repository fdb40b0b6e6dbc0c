"""One owner of a file: a lock that ends with the program that holds it, however that ends."""

from __future__ import annotations

import errno
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from focalgradient.errors import InputError

__all__ = ["locked", "try_lock", "unlock"]

PLACE = 2**31 - 2
"""Windows keeps others from reading the bytes that are locked: this one is the last that its C library can lock, and
no file of a data set is so long."""

PATIENCE = 30.0
"""Seconds that a lock held for the writing of one line is waited for."""


def try_lock(file: int, path: Path) -> bool:
    """Lock a file that is open for writing, until it is closed or the process ends; False where another holds the lock.

    It is `flock` on POSIX (over NFS too, where the kernel makes it a lock of the server) and `LockFile` on Windows:
    the system releases both when the process ends, also by a kill.

    Raises
    ------
    InputError
        If the file system has no locks.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile() as one, open(one.name, "ab") as other:
    ...     print(try_lock(one.fileno(), Path(one.name)), try_lock(other.fileno(), Path(one.name)))
    True False
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(file, PLACE, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EAGAIN, errno.EDEADLK):
            return False
        raise InputError(
            f"{path} cannot be locked ({error.strerror}): put the data set on a disk of this computer, or on a share "
            "with locks."
        ) from error
    return True


def unlock(file: int) -> None:
    """Release the lock at once, where the system would do so a little after the file is closed."""
    if sys.platform == "win32":
        import msvcrt

        os.lseek(file, PLACE, os.SEEK_SET)
        msvcrt.locking(file, msvcrt.LK_UNLCK, 1)


@contextmanager
def locked(path: Path) -> Iterator[int]:
    """Open a file to add to it, wait for its lock, and hold it: for what takes milliseconds.

    Raises
    ------
    InputError
        If another program holds the lock for half a minute.
    """
    file = os.open(path, os.O_RDWR | os.O_APPEND | getattr(os, "O_BINARY", 0))
    try:
        end = time.monotonic() + PATIENCE
        while not try_lock(file, path):
            if time.monotonic() > end:
                raise InputError(f"{path} is locked by another program: close it, and try again.")
            time.sleep(0.005)
        try:
            yield file
        finally:
            unlock(file)
    finally:
        os.close(file)
