"""Writing of files, whole or not at all.

In a hidden folder beside the place, under a name that cannot be foretold, flushed to the disk, then moved. Whatever
cuts that off, what stands under its own name is whole; the hidden folder is swept by the next run.
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

__all__ = ["existing", "flush", "move", "refuse_special", "replace_set", "replacing", "staged", "sweep", "write_whole"]

STALE_S = 86400.0
"""Age (s) beyond which a hidden folder is taken for a dead run's, also where its process cannot be looked up."""

PATIENCE_S = 2.0
"""How long a move is tried again where another program holds its place open, as Windows forbids."""

_HIDDEN = re.compile(r"\.focalgradient-([0-9a-f]{8})-(\d+)-[0-9a-f]{16}")


def flush(number: int) -> None:
    """Bring what was written to a file's number to the disk itself; on macOS past the disk's own memory."""
    if sys.platform == "darwin":
        import fcntl

        with suppress(OSError):  # not every file system knows it
            fcntl.fcntl(number, fcntl.F_FULLFSYNC)
            return
    os.fsync(number)


def _flush_file(path: Path) -> None:
    number = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
    try:
        flush(number)
    finally:
        os.close(number)


def _flush_folder(path: Path) -> None:
    if os.name != "posix":  # elsewhere folders cannot be opened, and need not be
        return
    with suppress(OSError):  # some network file systems refuse
        number = os.open(path, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def _host() -> str:
    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]


def sweep(folder: str | os.PathLike[str]) -> None:
    """Remove from a folder what dead runs left half done in it; what cannot be removed stays."""
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
    """Give a hidden folder of this run in `base`, which is there; it is gone at the end, with what is left in it."""
    base = Path(base)
    sweep(base)
    folder = base / f".focalgradient-{_host()}-{os.getpid()}-{secrets.token_hex(8)}"
    try:
        try:
            folder.mkdir(mode=0o700)
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    finally:  # again: a signal may have cut the first off
        shutil.rmtree(folder, ignore_errors=True)


def move(source: Path, place: Path) -> None:
    """Move a file to its place, in one step.

    Raises
    ------
    OSError
        If it cannot be moved; on Windows also if another program goes on holding its place open.
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
    """Write one file, so that it is never there in part; what stood there is replaced.

    Parameters
    ----------
    path
        Its place, in a folder that is there.
    content
        What to write; or what writes it to the path that it is given, whose name is that of `path`.
    mode
        Its permissions, of which the process's mask is taken away.
    remedy
        Ends the message where it cannot be written.

    Raises
    ------
    InputError
        If it cannot be written: then `path` is as it was before.
    """
    path = Path(path)
    refuse_special([path])
    try:
        with staged(path.parent) as folder:
            _make(folder / path.name, content, mode)
            move(folder / path.name, path)
        _flush_folder(path.parent)
    except OSError as error:
        raise InputError(f"{printable(path)} cannot be written ({error.strerror or error}): {remedy}.") from error


def _make(path: Path, content: bytes | Callable[[Path], object], mode: int = 0o666) -> None:
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
    """Write a set of results into a folder, in place of an older one, as `replacing` does.

    Parameters
    ----------
    out
        The folder: made where it is not there.
    contents
        What to write, by plain name, or what writes it to the path that it is given.
    summary
        The one of them that is moved last.
    by
        The command that writes them, of which each bears the `mark`: "focalgradient depth"; none if empty.
    """
    places = {plain_name(name): Path(out, name) for name in contents}
    with replacing(list(places.values()), Path(out, summary), by) as hidden:
        for name, content in contents.items():
            _make(hidden[places[name]], content)


@contextmanager
def replacing(places: Sequence[Path], summary: Path, by: str = "") -> Iterator[dict[Path, Path]]:
    """Replace a set of files, in one folder or several, by what is written to the hidden paths that are given.

    All are made out of sight first. Then the old `summary` goes, the others are moved to their places, and the new
    summary last: where there is a summary, there is the whole set that it belongs to.

    Parameters
    ----------
    places
        Of the files; their folders are made where they are not there.
    summary
        The one of them that is moved last.
    by
        The command that writes them, of which each bears the `mark`: "focalgradient depth"; none if empty.

    Yields
    ------
    dict
        For each place where to write, under the same name.

    Raises
    ------
    InputError
        If they cannot be made or moved; the message says what is there then.
    KeyboardInterrupt
        As it comes; with such a message where some had been moved.
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
            left = "all was written"
        for folder in hidden:
            _flush_folder(folder)
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
    """Give the folder, or the nearest above it that is there."""
    return next(one for one in (folder.absolute(), *folder.absolute().parents) if os.path.lexists(one))
