"""Files from outside read with care, and files of ours written whole or not at all.

Reading: regular files only, of a stated size at most; whatever is wrong with one is an `InputError` of one sentence.
Writing: in a hidden folder beside the place, under a name that cannot be foretold, flushed to the disk, then moved.
Whatever cuts that off, what stands under its own name is whole; the hidden folder is swept by the next run.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import platform
import re
import secrets
import shutil
import stat
import sys
import time
import tomllib
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError

__all__ = [
    "LARGEST",
    "existing",
    "flush",
    "inner_name",
    "move",
    "opened",
    "parse_json",
    "plain_name",
    "printable",
    "read_array",
    "read_arrays",
    "read_bytes",
    "read_json",
    "read_text",
    "read_toml",
    "refuse_overwriting",
    "replace_set",
    "replacing",
    "staged",
    "sweep",
    "write_whole",
]

MB = 1024**2

LARGEST = 2048 * MB
"""Bytes of a file that is read at once, unless its reader states another limit."""

LARGEST_TEXT = 256 * MB
"""Bytes of a text: a data set of thousands of sessions has tables of some 10 MB."""

LARGEST_TOML = 1 * MB
"""Bytes of a settings file: those of hundreds of views have some 10 KB."""

DEEPEST = 32
"""Parts of a dotted TOML key: what reading takes grows with their square."""

_DOTTED = re.compile(rf"(?<![\w-])(?:(?:[\w-]++|\"[^\"\n]*+\"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{DEEPEST}}}")

STALE_S = 86400.0
"""Age (s) beyond which a hidden folder is taken for a dead run's, also where its process cannot be looked up."""

PATIENCE_S = 2.0
"""How long a move is tried again where another program holds its place open, as Windows forbids."""

_HIDDEN = re.compile(r"\.focalgradient-([0-9a-f]{8})-(\d+)-[0-9a-f]{16}")

_RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
"""Names that Windows keeps for devices, whatever their ending."""


# Reading.


def printable(name: str | os.PathLike[str]) -> str:
    r"""A file's name as text can hold it: what is not UTF-8 in it becomes U+FFFD, and control characters spaces.

    >>> printable("a\udcff.png")
    'a�.png'
    """
    text = os.fspath(name).encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    return "".join(letter if letter.isprintable() else " " for letter in text)


@contextmanager
def opened(path: str | os.PathLike[str], what: str = "a file", largest: int = LARGEST) -> Iterator[BinaryIO]:
    """Open a regular file for reading; neither a FIFO nor a device is waited for.

    Parameters
    ----------
    path
        Where it is.
    what
        What it should be, with its article: ends the message "give the path of ...".
    largest
        Bytes that it may have.

    Raises
    ------
    InputError
        If it cannot be opened or read, is no regular file or is larger.
    """
    name = printable(path)
    try:
        number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except ValueError as error:  # NUL in the name
        raise InputError(f"{name!r} is no name of a file: give the path of {what}.") from error
    except OSError as error:
        folder = os.path.isdir(path)  # Windows says of these that access is denied
        why = "is a folder" if folder else f"cannot be read ({error.strerror or error})"
        raise InputError(f"{name} {why}: give the path of {what}.") from error
    with os.fdopen(number, "rb", closefd=True) if _regular(number) else _refused(number, name, what) as file:
        size = os.fstat(number).st_size
        if size > largest:
            raise InputError(
                f"{name} has {size / MB:,.0f} MB, but {what} may have at most {largest / MB:,.0f} MB: give another."
            )
        try:
            yield file
        except OSError as error:
            if error.filename is not None or error.errno is None:  # of another file, or a decoder's
                raise
            raise InputError(f"{name} cannot be read ({error.strerror or error}): give {what} that can.") from error


def _regular(number: int) -> bool:
    return stat.S_ISREG(os.fstat(number).st_mode)


def _refused(number: int, name: str, what: str) -> NoReturn:
    folder = stat.S_ISDIR(os.fstat(number).st_mode)
    os.close(number)
    raise InputError(f"{name} is {'a folder' if folder else 'no regular file'}: give the path of {what}.")


def read_bytes(path: str | os.PathLike[str], what: str = "a file", largest: int = LARGEST) -> bytes:
    """Read all of a regular file.

    Raises
    ------
    InputError
        As `opened` does, and if there is too little memory.
    """
    with opened(path, what, largest) as file:
        try:
            data = file.read(largest + 1)
        except MemoryError as error:
            raise InputError(f"{printable(path)} is too large for the memory: give {what} that is smaller.") from error
    if len(data) > largest:
        raise InputError(f"{printable(path)} has more than {largest / MB:,.0f} MB: give {what} that is smaller.")
    return data


def read_text(path: str | os.PathLike[str], what: str = "a text file", largest: int = LARGEST_TEXT) -> str:
    """Read a text in UTF-8, with or without a byte order mark; line ends as they stand.

    Raises
    ------
    InputError
        As `read_bytes` does, and if it is not UTF-8.
    """
    try:
        return read_bytes(path, what, largest).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{printable(path)} is not text in UTF-8 (byte {error.start + 1}): save it as UTF-8."
        ) from error


def read_toml(path: str | os.PathLike[str], what: str = "a settings file") -> dict[str, Any]:
    """Read a TOML file as it stands.

    Raises
    ------
    InputError
        As `read_text` does, and if it is not TOML, or nested beyond reason.
    """
    text, name = read_text(path, what, LARGEST_TOML), printable(path)
    if _DOTTED.search(text):
        raise InputError(f"{name} has a key of more than {DEEPEST} dotted parts: give {what}.")
    try:
        return tomllib.loads(text)
    except (RecursionError, MemoryError) as error:
        raise InputError(f"{name} is nested too deeply: give {what}.") from error
    except ValueError as error:  # TOMLDecodeError, and integers of thousands of digits
        hint = "; write \\ as / in paths" if "\\" in text else ""
        raise InputError(f"{name} is not valid TOML: {printable(str(error)).rstrip('.')}{hint}.") from error


def read_json(path: str | os.PathLike[str], what: str = "a JSON file", largest: int = LARGEST_TEXT) -> Any:
    """Read a file of strict JSON: NaN and infinities are none.

    Raises
    ------
    InputError
        As `read_text` does, and if it is not JSON, or nested beyond reason.
    """
    return parse_json(read_text(path, what, largest), printable(path), what)


def parse_json(text: str | bytes, name: str, what: str = "a JSON file") -> Any:
    """What a strict JSON text holds; `name` and `what` are for messages.

    Raises
    ------
    InputError
        If it is not JSON, or nested beyond reason.
    """
    try:
        return json.loads(text, parse_constant=_no_constant)
    except (RecursionError, MemoryError) as error:
        raise InputError(f"{name} is nested too deeply: give {what}.") from error
    except ValueError as error:
        raise InputError(f"{name} is not valid JSON ({printable(str(error)).rstrip('.')}): give {what}.") from error


def _no_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is no JSON")


def read_array(
    path: str | os.PathLike[str], what: str = "a .npy file of plain numbers", largest: int = LARGEST
) -> NDArray[Any]:
    """Read a ``.npy`` file of plain numbers: nothing in it is run, and memory is taken for what is there only.

    Raises
    ------
    InputError
        As `read_bytes` does, and if it is no such file.
    """
    return _parsed_array(read_bytes(path, what, largest), printable(path), what)


def _parsed_array(data: bytes, name: str, what: str) -> NDArray[Any]:
    wrong = f"{name} is not {what}, or is damaged: give one that is whole."
    head = io.BytesIO(data)
    try:
        major, _ = np.lib.format.read_magic(head)  # type: ignore[no-untyped-call]
        read = np.lib.format.read_array_header_1_0 if major == 1 else np.lib.format.read_array_header_2_0
        shape, in_columns, dtype = read(head)  # type: ignore[no-untyped-call]
    except Exception as error:  # a header is a Python literal: it fails in many ways
        raise InputError(wrong) from error
    content = memoryview(data)[head.tell() :]
    plain = not dtype.hasobject and dtype.itemsize > 0 and all(type(n) is int and n >= 0 for n in shape)
    if not plain or len(shape) > 32 or math.prod(shape) * dtype.itemsize != len(content):
        raise InputError(wrong)
    array = np.frombuffer(content, dtype).copy()  # to be written to, as what numpy.load gives
    return array.reshape(shape[::-1]).transpose() if in_columns else array.reshape(shape)


def read_arrays(
    path: str | os.PathLike[str], names: Iterable[str], what: str = "a .npz archive", largest: int = LARGEST
) -> dict[str, NDArray[Any]]:
    """Read arrays of plain numbers or texts out of a ``.npz`` archive: those of `names` that are there.

    `largest` holds for the archive, and for all these together once unpacked.

    Raises
    ------
    InputError
        As `opened` does, and if it is no such archive.
    """
    name = printable(path)
    with opened(path, what, largest) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                held = set(archive.namelist())
                members = {key: archive.getinfo(f"{key}.npy") for key in names if f"{key}.npy" in held}
                if sum(member.file_size for member in members.values()) > largest:
                    raise InputError(
                        f"{name} unpacks to more than {largest / MB:,.0f} MB: give {what} that is smaller."
                    )
                found = {key: archive.read(member) for key, member in members.items()}
        except InputError:
            raise
        except MemoryError as error:
            raise InputError(f"{name} is too large for the memory: give {what} that is smaller.") from error
        except Exception as error:  # damaged archives fail in many ways
            raise InputError(f"{name} is not {what}, or is damaged: give one that is whole.") from error
    return {key: _parsed_array(data, name, what) for key, data in found.items()}


# Names.


def plain_name(name: str, where: str = "a file's name") -> str:
    """Give `name` back if it is a plain file name on every platform: no folder, nothing above, no device.

    Raises
    ------
    InputError
        If it is not; `where` says where it stands.

    Examples
    --------
    >>> plain_name("confidence_design.csv")
    'confidence_design.csv'
    """
    bad = (
        not isinstance(name, str)
        or name in ("", ".", "..")
        or not name.isprintable()
        or any(letter in '/\\:*?"<>|' for letter in name)
        or name != name.rstrip(" .")
        or name.partition(".")[0].lower() in _RESERVED
        or len(name.encode("utf-8", "surrogatepass")) > 255
    )
    if bad:
        raise InputError(f"{where} is {printable(str(name))[:80]!r}, but must be a plain file name without a folder.")
    return name


def inner_name(name: str, where: str = "a file's name") -> str:
    """Give `name` back if it is the path of a file within a folder, its parts plain names with / between.

    Raises
    ------
    InputError
        If it is not; `where` says where it stands.

    Examples
    --------
    >>> inner_name("none/0001.png")
    'none/0001.png'
    """
    for part in name.split("/") if isinstance(name, str) else [name]:
        plain_name(part, where)
    return name


def refuse_overwriting(inputs: Iterable[str | os.PathLike[str]], outputs: Iterable[str | os.PathLike[str]]) -> None:
    """Refuse outputs that are inputs, by the file itself: also through links and other spellings.

    Raises
    ------
    InputError
        If an output is an input.
    """
    read = {identity: Path(path) for path in inputs for identity in _identities(path)}
    for path in outputs:
        for identity in _identities(path):
            if identity in read:
                raise InputError(
                    f"{printable(path)} would be overwritten, but it is read ({printable(read[identity])}): "
                    "choose another --out."
                )


def _identities(path: str | os.PathLike[str]) -> Iterator[object]:
    """The file that a path leads to: its number on the disk where it exists, and where it would be."""
    with suppress(OSError, ValueError, RuntimeError):  # RuntimeError: links in a circle
        yield os.path.normcase(Path(path).resolve())
    with suppress(OSError, ValueError):
        found = os.stat(path)
        yield found.st_dev, found.st_ino


# Writing.


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
    folder.mkdir(mode=0o700)
    try:
        yield folder
    finally:
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
    out: str | os.PathLike[str], contents: Mapping[str, bytes | Callable[[Path], object]], summary: str
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
    """
    places = {plain_name(name): Path(out, name) for name in contents}
    with replacing(list(places.values()), Path(out, summary)) as hidden:
        for name, content in contents.items():
            _make(hidden[places[name]], content)


@contextmanager
def replacing(places: Sequence[Path], summary: Path) -> Iterator[dict[Path, Path]]:
    """Replace a set of files, in one folder or several, by what is written to the hidden paths that are given.

    All are made out of sight first. Then the old `summary` goes, the others are moved to their places, and the new
    summary last: where there is a summary, there is the whole set that it belongs to.

    Parameters
    ----------
    places
        Of the files; their folders are made where they are not there.
    summary
        The one of them that is moved last.

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
    left = "nothing was written"
    try:
        with ExitStack() as folders:
            bases = {place.parent: existing(place.parent) for place in places}
            hidden = {folder: folders.enter_context(staged(base)) for folder, base in bases.items()}
            made = {place: hidden[place.parent] / place.name for place in places}
            yield made
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
            f"({error.strerror or error}): {left}; make room on the disk or choose another --out, and run this again."
        ) from error
    except KeyboardInterrupt as stop:
        raise type(stop)(f"{left}.") from None


def existing(folder: Path) -> Path:
    """Give the folder, or the nearest above it that is there."""
    return next(one for one in (folder.absolute(), *folder.absolute().parents) if os.path.lexists(one))
