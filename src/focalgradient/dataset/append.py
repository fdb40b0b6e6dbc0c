"""Append whole lines to a file: a journal, a server's links, the table of participants.

Either the lines are on disk when the call returns, or the file is unchanged: a full disk accepts part of a write (a
short count) before it rejects the rest.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from focalgradient.errors import InputError
from focalgradient.files import flush

__all__ = ["UNDONE", "append", "writing"]

SAFE = "trials recorded so far are safe, and the session can be resumed."
"""What holds after a failed write of a session."""

UNDONE = "the removal is not complete: withdraw the participant again to complete it."
"""What holds after a failed write of a removal."""


def append(file: int, path: Path, lines: bytes, *, durable: bool = True) -> None:
    r"""Append lines to a file opened for reading and appending, after a newline if a crash truncated its last line.

    Parameters
    ----------
    file
        File descriptor; no other process may append meanwhile.
    path
        Path of the file, for the message.
    lines
        One or more lines, each with its line end.
    durable
        Whether to wait until the lines are on disk.

    Raises
    ------
    InputError
        If they cannot be written, for example because the disk is full; partly written lines are removed.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "lines")
    ...     _ = path.write_text("one\ncut sh")
    ...     with path.open("a+b") as stream:
    ...         append(stream.fileno(), path, b"two\n")
    ...     path.read_text()
    'one\ncut sh\ntwo\n'
    """
    with writing(path):
        before = os.lseek(file, 0, os.SEEK_END)
    try:
        with writing(path):
            if before:
                os.lseek(file, before - 1, os.SEEK_SET)
                lines = (b"" if os.read(file, 1) == b"\n" else b"\n") + lines
            rest = memoryview(lines)
            while rest:
                written = os.write(file, rest)
                if not written:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                rest = rest[written:]
            if durable:
                flush(file)
    except BaseException:
        with suppress(OSError):  # a truncated line that cannot be removed is ended by the next call
            os.ftruncate(file, before)
        raise


@contextmanager
def writing(path: Path, then: str = SAFE) -> Iterator[None]:
    """Turn an `OSError` of a failed write, such as that of a full disk, into an `InputError` that ends with `then`."""
    try:
        yield
    except FileExistsError:
        raise
    except OSError as error:
        raise InputError(
            f"{error.filename or path} cannot be written ({error.strerror or error}): make room on the disk or choose "
            f"a folder that you may write in; {then}"
        ) from error
