"""Append whole lines to a file: a journal, the links of a server, the table of participants.

A line is on the disk before the call returns, or the file is as it was before: a full disk accepts a part of what is
written (a short count) before it refuses the rest.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from focalgradient.errors import InputError
from focalgradient.files import flush

__all__ = ["append", "writing"]


def append(file: int, path: Path, lines: bytes, *, durable: bool = True) -> None:
    r"""Append lines to a file that is open for reading and appending, on a new line after one that a kill cut short.

    Parameters
    ----------
    file
        Its number; nobody else appends to it meanwhile.
    path
        Its name, for the message.
    lines
        One line or several, each with its end.
    durable
        Whether to wait until they are on the disk.

    Raises
    ------
    InputError
        If they cannot be written, as on a full disk; what was written of them is removed.

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
        with suppress(OSError):  # what cannot be removed is a line cut short, which the next call leaves alone
            os.ftruncate(file, before)
        raise


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Say in one sentence, as an InputError, that a file cannot be written, as on a full disk."""
    try:
        yield
    except FileExistsError:
        raise
    except OSError as error:
        raise InputError(
            f"{error.filename or path} cannot be written ({error.strerror or error}): make room on the disk or choose "
            "a folder that you may write in; what was recorded before is safe, and can be resumed."
        ) from error
