"""Exclusive file locks that end with the process that holds them."""

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
"""Position in bytes of the locked byte on Windows, where locked bytes cannot be read: the last that its C library can
lock, beyond the end of any file of a data set.
"""

PATIENCE = 30.0
"""Time limit in s for a lock that another program holds while it writes a line."""


def try_lock(file: int, path: Path) -> bool:
    """Lock a file opened for writing until it is closed or the process ends; return False if it is already locked.

    This is `flock` on POSIX (over NFS too, where the kernel turns it into a lock on the server) and `LockFile` on
    Windows; the system releases both when the process ends, also after a crash.

    Raises
    ------
    InputError
        If the file system does not support locks.

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
            "that supports locks."
        ) from error
    return True


def unlock(file: int) -> None:
    """Release the lock immediately, because the system may release it only some time after the file is closed."""
    if sys.platform == "win32":
        import msvcrt

        os.lseek(file, PLACE, os.SEEK_SET)
        msvcrt.locking(file, msvcrt.LK_UNLCK, 1)


@contextmanager
def locked(path: Path) -> Iterator[int]:
    """Open a file for appending and hold its lock, for operations of a few milliseconds.

    Raises
    ------
    InputError
        If another program holds the lock for 30 s.
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
