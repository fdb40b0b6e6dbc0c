"""Atomic writing of files.

Content is written to an unpredictably named hidden folder beside the destination, flushed to disk, then moved. After
an interruption every file under its final name is complete; the next run removes the hidden folder.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import secrets
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from focalgradient.errors import InputError
from focalgradient.files.marks import mark
from focalgradient.files.names import plain_name, printable

__all__ = [
    "existing",
    "flush",
    "flush_folder",
    "make_file",
    "move",
    "refuse_special",
    "replace_set",
    "replacing",
    "staged",
    "sweep",
    "write_whole",
]

STALE_S = 86400.0
"""Age in seconds beyond which a hidden folder is removed as stale, even if its process cannot be checked."""

PATIENCE_S = 2.0
"""Time in seconds for which a move is retried while another program keeps the destination open (on Windows)."""

_HIDDEN = re.compile(r"\.focalgradient-([0-9a-f]{8})-(\d+)-[0-9a-f]{16}")


def flush(number: int) -> None:
    """Flush a file descriptor to disk (fsync), on macOS past the drive's own cache (F_FULLFSYNC)."""
    if sys.platform == "darwin":
        import fcntl

        with suppress(OSError):  # not supported by every file system
            fcntl.fcntl(number, fcntl.F_FULLFSYNC)
            return
    os.fsync(number)


def _flush_file(path: Path) -> None:
    number = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
    try:
        flush(number)
    finally:
        os.close(number)


def flush_folder(path: Path) -> None:
    """Flush a folder's entries to disk."""
    if os.name != "posix":  # on Windows folders cannot be opened, and need no flush
        return
    with suppress(OSError):  # unsupported by some network file systems
        number = os.open(path, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def _host() -> str:
    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def sweep(folder: str | os.PathLike[str]) -> None:
    """Remove hidden folders that interrupted runs left behind; skip those that cannot be removed."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            match = _HIDDEN.fullmatch(entry.name)
            if match and entry.is_dir(follow_symlinks=False) and _dead(match, entry):
                shutil.rmtree(entry.path, ignore_errors=True)


def _dead(match: re.Match[str], entry: os.DirEntry[str]) -> bool:
    host, process = match[1], int(match[2])
    if time.time() - entry.stat(follow_symlinks=False).st_mtime > STALE_S:
        return True
    if host != _host() or os.name != "posix" or process == os.getpid():
        return False
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return True
    except PermissionError:
        pass
    return False


@contextmanager
def staged(base: str | os.PathLike[str]) -> Iterator[Path]:
    """Create a hidden folder in the existing folder `base`, and remove it with its content on exit."""
    base = Path(base)
    sweep(base)
    folder = base / f".focalgradient-{_host()}-{os.getpid()}-{secrets.token_hex(8)}"
    try:
        try:
            folder.mkdir(mode=0o700)
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    finally:  # repeated: a signal may have interrupted the first removal
        shutil.rmtree(folder, ignore_errors=True)


def move(source: Path, place: Path) -> None:
    """Move a file to its destination in one atomic step.

    Raises
    ------
    OSError
        If it cannot be moved; on Windows also if another program keeps the destination open.
    """
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            source.replace(place)
        except PermissionError as error:
            if os.name != "nt" or place.is_dir():
                raise
            if time.monotonic() > until:
                held = "another program holds it open: close it there"
                raise PermissionError(error.errno, held, str(place)) from error
            time.sleep(0.05)
        else:
            return


def write_whole(
    path: str | os.PathLike[str],
    content: bytes | Callable[[Path], object],
    *,
    mode: int = 0o666,
    remedy: str = "make room on the disk or choose a folder that you may write in",
) -> None:
    """Write one file atomically, replacing an existing one.

    Parameters
    ----------
    path
        Destination, in an existing folder.
    content
        Content in bytes; or a function that writes it to a temporary path, which has the same file name.
    mode
        File permissions, reduced by the process's umask.
    remedy
        End of the message of a failed write.

    Raises
    ------
    InputError
        If it cannot be written: `path` is then unchanged.
    """
    path = Path(path)
    refuse_special([path])
    try:
        with staged(path.parent) as folder:
            make_file(folder / path.name, content, mode)
            move(folder / path.name, path)
        flush_folder(path.parent)
    except OSError as error:
        raise InputError(f"{printable(path)} cannot be written ({error.strerror or error}): {remedy}.") from error


def make_file(path: Path, content: bytes | Callable[[Path], object], mode: int = 0o666) -> None:
    """Write a file that does not exist yet, and flush it to disk."""
    number = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode)
    with os.fdopen(number, "wb") as file:
        if isinstance(content, bytes):
            file.write(content)
    if not isinstance(content, bytes):
        content(path)
    _flush_file(path)


def replace_set(
    out: str | os.PathLike[str], contents: Mapping[str, bytes | Callable[[Path], object]], summary: str, by: str = ""
) -> None:
    """Write a set of results into a folder, replacing an older set as `replacing` does.

    Parameters
    ----------
    out
        The folder, created if necessary.
    contents
        Content by plain file name: bytes, or a function that writes to a given path.
    summary
        The file of the set that is moved last.
    by
        Command named in the `mark` of each file, such as "focalgradient depth"; empty: no marks.
    """
    places = {plain_name(name): Path(out, name) for name in contents}
    with replacing(list(places.values()), Path(out, summary), by) as hidden:
        for name, content in contents.items():
            make_file(hidden[places[name]], content)


@contextmanager
def replacing(places: Sequence[Path], summary: Path, by: str = "") -> Iterator[dict[Path, Path]]:
    """Replace a set of files, in one or several folders, by files written to the hidden paths yielded.

    All files are first written to hidden folders. Then the old `summary` is removed, the other files are moved to their
    destinations, and the new summary last: an existing summary implies a complete set.

    Parameters
    ----------
    places
        Destinations of the files; their folders are created if necessary.
    summary
        The file of the set that is moved last.
    by
        Command named in the `mark` of each file, such as "focalgradient depth"; empty: no marks.

    Yields
    ------
    dict
        Hidden path to write to, by destination; the file name is the same.

    Raises
    ------
    InputError
        If they cannot be written or moved; the message states what then exists.
    KeyboardInterrupt
        If interrupted, with such a message.
    """
    refuse_special(places)
    left = "none of these results was written"
    try:
        with ExitStack() as folders:
            bases = {place.parent: existing(place.parent) for place in places}
            hidden = {folder: folders.enter_context(staged(base)) for folder, base in bases.items()}
            made = {place: hidden[place.parent] / place.name for place in places}
            yield made
            if by:
                mark(made.values(), by)
            for path in made.values():
                _flush_file(path)
            for folder in hidden:
                folder.mkdir(parents=True, exist_ok=True)
            left = f"{printable(summary.parent)} holds results of two runs mixed, without {printable(summary.name)}"
            summary.unlink(missing_ok=True)
            for place in (*(place for place in places if place != summary), summary):
                move(made[place], place)
            left = "all files were written"
        for folder in hidden:
            flush_folder(folder)
    except OSError as error:
        named = error.filename is not None and _HIDDEN.search(str(error.filename)) is None
        raise InputError(
            f"{printable(error.filename if named else summary.parent)} cannot be written "
            f"({error.strerror or error}): {left}; make room on the disk or choose another place, and run this again."
        ) from error
    except KeyboardInterrupt as stop:
        raise type(stop)(f"{left}.") from None


def refuse_special(places: Iterable[Path]) -> None:
    """Raise `InputError` for a place that is a folder, a device (/dev/null) or a pipe: a move would replace it."""
    for place in places:
        if place.exists() and not place.is_file():
            what = "a folder" if place.is_dir() else "a device or a pipe"
            raise InputError(
                f"{printable(place)} is {what}, where a file is to be written: choose another place to write to."
            )


def existing(folder: Path) -> Path:
    """Return `folder`, or its nearest existing ancestor."""
    return next(place for place in (folder.absolute(), *folder.absolute().parents) if os.path.lexists(place))
