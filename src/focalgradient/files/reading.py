"""Validated reading of external files: regular files up to a stated size; every fault raises one `InputError`."""

from __future__ import annotations

import io
import json
import math
import os
import re
import stat
import tomllib
import zipfile
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO, NoReturn

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.files.names import printable

__all__ = [
    "LARGEST",
    "LARGEST_LIST",
    "check_width",
    "decoded",
    "is_text",
    "opened",
    "parse_json",
    "read_array",
    "read_arrays",
    "read_bytes",
    "read_json",
    "read_text",
    "read_toml",
    "read_tsv",
]

MB = 1024**2

LARGEST = 2048 * MB
"""Maximum size in bytes of a file read at once, unless its reader sets another limit."""

LARGEST_TEXT = 256 * MB
"""Maximum size of a text file in bytes: the tables of thousands of sessions occupy some 10 MB."""

LARGEST_LIST = 16 * MB
"""Maximum size in bytes of a small table or text, such as a photometer's readings: 200,000 lines of three numbers
occupy some 6 MB.
"""

MOST_COLUMNS = 4096
"""Maximum number of columns of a table: one column per condition of 24 scenes x 8 apertures x 2 fixations x 10
repetitions makes 3,840.
"""

LARGEST_TOML = 1 * MB
"""Maximum size of a settings file in bytes: the settings of hundreds of views occupy some 10 KB."""

PICTURES = (b"\x89PNG", b"\xff\xd8\xff", b"II*\0", b"MM\0*", b"v/1\x01", b"GIF8", b"RIFF")
"""First bytes of PNG, JPEG, TIFF (and camera raw), EXR, GIF and WebP files."""

DEEPEST = 32
"""Maximum number of parts of a dotted TOML key, and of nesting levels: parsing time grows with the square of the
former; real files have fewer than ten.
"""

LARGEST_WHOLE = 2**63 - 1
"""Largest integer magnitude accepted in JSON and TOML: signed 64 bits, as TOML requires and other readers assume."""

_DOTTED = re.compile(rf"(?<![\w-])(?:(?:[\w-]++|\"[^\"\n]*+\"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{DEEPEST}}}")

_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
_LONG = re.compile(r"\w{16}")  # 64 bits take 19 decimal or 16 hexadecimal digits


@contextmanager
def opened(path: str | os.PathLike[str], what: str = "a file", largest: int = LARGEST) -> Iterator[BinaryIO]:
    """Open a regular file for reading; FIFOs and devices are rejected without blocking.

    Parameters
    ----------
    path
        Path of the file.
    what
        Expected kind of file, with its article: ends the message "give the path of ...".
    largest
        Maximum size in bytes.

    Raises
    ------
    InputError
        If it cannot be opened or read, is not a regular file, or is larger.
    """
    name = printable(path)
    try:
        number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except ValueError as error:  # NUL in the name
        raise InputError(f"{name!r} is not a valid file name: give the path of {what}.") from error
    except OSError as error:
        folder = os.path.isdir(path)  # Windows reports "access denied" for folders
        why = "is a folder" if folder else f"cannot be read ({error.strerror or error})"
        raise InputError(f"{name} {why}: give the path of {what}.") from error
    status = os.fstat(number)
    if not stat.S_ISREG(status.st_mode):
        os.close(number)
        kind = "a folder" if stat.S_ISDIR(status.st_mode) else "not a regular file"
        raise InputError(f"{name} is {kind}: give the path of {what}.")
    with os.fdopen(number, "rb") as file:
        size = status.st_size
        if size > largest:
            raise InputError(
                f"{name} has {size / MB:,.0f} MB, but {what} may have at most {largest / MB:,.0f} MB: give another."
            )
        try:
            yield file
        except OSError as error:
            if error.filename is not None or error.errno is None:  # an error of another file, or of a decoder
                raise
            raise InputError(f"{name} cannot be read ({error.strerror or error}): give {what} that can.") from error


def read_bytes(path: str | os.PathLike[str], what: str = "a file", largest: int = LARGEST) -> bytes:
    """Read a whole regular file.

    Raises
    ------
    InputError
        As for `opened`, and if memory is insufficient.
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
    """Read UTF-8 text, with or without a byte order mark; line ends are kept.

    Raises
    ------
    InputError
        As for `read_bytes`, and if the content is not UTF-8.
    """
    return decoded(read_bytes(path, what, largest), printable(path), what)


def decoded(data: bytes, name: str, what: str) -> str:
    """Decode UTF-8 text, with or without a byte order mark; `name` and `what` are for the message.

    Raises
    ------
    InputError
        If it is not UTF-8.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if data.startswith(PICTURES):
            raise InputError(f"{name} is a picture: give {what} instead.") from error
        raise InputError(
            f"{name} is not text in UTF-8 (byte {error.start + 1}): give {what}, saved as UTF-8."
        ) from error


def read_tsv(path: str | os.PathLike[str], what: str = "a table") -> str:
    """Read a table of a data set, with tabs between its cells, as text.

    Raises
    ------
    InputError
        As `read_text` does, and if it has more than `MOST_COLUMNS` columns: what reading takes grows with their square.
    """
    text = read_text(path, what)
    check_width(text.splitlines(), "\t", printable(path))
    return text


def check_width(lines: Iterable[str], delimiter: str, name: str) -> None:
    """Raise `InputError` if a line of a table has more than `MOST_COLUMNS` cells.

    >>> check_width([",".join("0" * 5000)], ",", "a.csv")
    Traceback (most recent call last):
    focalgradient.errors.InputError: a.csv has 5,000 columns, but a table may have 4,096 at most: leave out the others.
    """
    widest = max((line.count(delimiter) for line in lines), default=0) + 1
    if widest > MOST_COLUMNS:
        raise InputError(
            f"{name} has {widest:,} columns, but a table may have {MOST_COLUMNS:,} at most: leave out the others."
        )


_COMMA = re.compile(r"=\s*[-+]?\d+,\d")
"""Pattern of a number with a decimal comma."""


def read_toml(path: str | os.PathLike[str], what: str = "a settings file") -> dict[str, Any]:
    """Read a TOML file without validating its keys.

    Raises
    ------
    InputError
        As for `read_text`, and if the content is not TOML, or is nested more than `DEEPEST` levels.
    """
    text, name = read_text(path, what, LARGEST_TOML), printable(path)
    if _DOTTED.search(text):
        raise InputError(f"{name} has a key of more than {DEEPEST} dotted parts: give {what}.")
    try:
        content = tomllib.loads(text, parse_float=_number)
        _check_tree(text, content)
        return content
    except (RecursionError, MemoryError) as error:
        raise InputError(f"{name} is nested too deeply: give {what}.") from error
    except ValueError as error:  # TOMLDecodeError, or an integer of thousands of digits
        hint = "; write \\ as / in paths" if "\\" in text else ""
        if (line := re.search(r"line (\d+)", str(error))) and _COMMA.search(text.splitlines()[int(line[1]) - 1]):
            hint = "; write decimal points, not commas"
        if not name.lower().endswith(".toml"):
            hint = f": give {what} (TOML)"
        raise InputError(f"{name} is not valid TOML: {printable(str(error)).rstrip('.')}{hint}.") from error


def read_json(path: str | os.PathLike[str], what: str = "a JSON file", largest: int = LARGEST_TEXT) -> Any:
    """Read a file of strict JSON: no NaN or infinity, no integer beyond 64 bits, no duplicate key in an object.

    Raises
    ------
    InputError
        As for `read_text`, and if the content is not such JSON, or is nested more than `DEEPEST` levels.
    """
    return parse_json(read_text(path, what, largest), printable(path), what)


def parse_json(text: str | bytes, name: str, what: str = "a JSON file") -> Any:
    """Parse strict JSON text; `name` and `what` appear in messages.

    Raises
    ------
    InputError
        If it is not strict JSON, or is nested more than `DEEPEST` levels.
    """
    try:
        if isinstance(text, bytes):
            text = text.decode(json.detect_encoding(text))
        content = json.loads(text, parse_constant=_no_constant, parse_float=_number, object_pairs_hook=_each_once)
        _check_tree(text, content)
        if not is_text(text, content):
            raise ValueError("it contains half a surrogate pair, such as \\ud800 alone")
        return content
    except (RecursionError, MemoryError) as error:
        raise InputError(f"{name} is nested too deeply: give {what}.") from error
    except ValueError as error:
        raise InputError(f"{name} is not valid JSON ({printable(str(error)).rstrip('.')}): give {what}.") from error


def is_text(source: str, content: Any) -> bool:
    r"""Return whether content parsed from JSON can be encoded as UTF-8, i.e. contains no lone surrogate.

    >>> is_text('"\\ud800"', "\ud800"), is_text('"\\ud83d\\ude00"', "\U0001f600")
    (False, True)
    """
    if _SURROGATE.search(source) is None:
        return True
    try:
        json.dumps(content, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        return False
    return True


def _no_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is not JSON")


def _number(word: str) -> float:
    """Parse a decimal number; reject literals such as 1e400 that overflow to infinity."""
    value = float(word)
    if math.isinf(value) and "inf" not in word:
        raise ValueError(f"the number {_cut(word)} is too large")
    return value


def _check_tree(text: str, content: Any) -> None:
    """Raise ValueError for integers beyond 64 bits, and RecursionError for more than `DEEPEST` levels."""
    if text.count("[") + text.count("{") <= DEEPEST and _LONG.search(text) is None:
        return
    level = [content]
    for _ in range(DEEPEST + 1):
        inner: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                inner += value.values()
            elif isinstance(value, list):
                inner += value
            elif isinstance(value, int) and not -LARGEST_WHOLE <= value <= LARGEST_WHOLE:
                raise ValueError(f"the number {_cut(str(value))} has more than 64 bits")
        level = inner
    if level:
        raise RecursionError


def _cut(word: str) -> str:
    return word if len(word) <= 24 else f"{word[:20]}..."


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object's content; reject duplicate keys, which programs resolve differently."""
    content = dict(pairs)
    if len(content) < len(pairs):
        key, _ = Counter(key for key, _ in pairs).most_common(1)[0]
        raise ValueError(f"the key {key[:40]!r} occurs twice")
    return content


def read_array(
    path: str | os.PathLike[str], what: str = "a .npy file of plain numbers", largest: int = LARGEST
) -> NDArray[Any]:
    """Read a ``.npy`` file of plain numbers without unpickling, allocating only the memory that its data need.

    Raises
    ------
    InputError
        As for `read_bytes`, and if it is not such a file.
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
    plain = not dtype.hasobject and dtype.subdtype is None and dtype.itemsize > 0
    plain = plain and all(type(n) is int and n >= 0 for n in shape)
    if not plain or len(shape) > 32 or math.prod(shape) * dtype.itemsize != len(content):
        raise InputError(wrong)
    array = np.frombuffer(content, dtype).copy()  # writable, like the result of numpy.load
    return array.reshape(shape[::-1]).transpose() if in_columns else array.reshape(shape)


def read_arrays(
    path: str | os.PathLike[str], names: Iterable[str], what: str = "a .npz archive", largest: int = LARGEST
) -> dict[str, NDArray[Any]]:
    """Read those arrays of `names` that a ``.npz`` archive contains, as plain numbers or texts.

    `largest` limits the size in bytes of the archive, and of these arrays together once unpacked.

    Raises
    ------
    InputError
        As for `opened`, and if it is not such an archive.
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
                arrays = {key: archive.read(member) for key, member in members.items()}
        except InputError:
            raise
        except MemoryError as error:
            raise InputError(f"{name} is too large for the memory: give {what} that is smaller.") from error
        except Exception as error:  # damaged archives fail in many ways
            raise InputError(f"{name} is not {what}, or is damaged: give one that is whole.") from error
    return {key: _parsed_array(data, name, what) for key, data in arrays.items()}
