"""Files from outside read with care; files of ours whole or not at all."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from focalgradient import files
from focalgradient.errors import InputError
from focalgradient.files import (
    plain_name,
    read_array,
    read_arrays,
    read_bytes,
    read_json,
    read_text,
    read_toml,
    refuse_overwriting,
    replace_set,
    sweep,
    write_whole,
    writing,
)

posix = pytest.mark.skipif(os.name != "posix", reason="links, devices and pipes are those of POSIX")


def refused(read: Callable[..., Any], *arguments: Any, **more: Any) -> str:
    with pytest.raises(InputError) as caught:
        read(*arguments, **more)
    return str(caught.value)


@posix
def test_only_regular_files_are_read_and_nobody_waits(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    start = time.monotonic()
    assert "is not a regular file" in refused(read_bytes, tmp_path / "pipe")
    assert "is not a regular file" in refused(read_bytes, "/dev/zero")
    assert "is a folder" in refused(read_bytes, tmp_path)
    assert "No such file" in refused(read_bytes, tmp_path / "none")
    assert "is not a valid file name" in refused(read_bytes, "a\0b")
    assert time.monotonic() - start < 20


def test_a_file_beyond_the_limit_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "large"
    with path.open("wb") as file:
        file.truncate(3 * 1024**3)  # sparse
    assert "has 3,072 MB, but a picture may have at most 1 MB" in refused(
        read_bytes, path, "a picture", largest=1024**2
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a." * 20_000 + "b = 1", "dotted parts"),
        ("[" + '"a" . ' * 20_000 + "b]", "dotted parts"),
        ("a = " + "[" * 20_000, "nested too deeply"),
        ("a = " + "[" * 90 + "]" * 90, "nested too deeply"),
        ("a = " + "1" * 5_000, "not valid TOML"),
        ("a = 18446744073709551616", "more than 64 bits"),
        ("a = -1e400", "is too large"),
        ("a = [1,\n2", "not valid TOML"),
        ("a" * 900_000, "not valid TOML"),
        ("\0", "not valid TOML"),
    ],
)
def test_toml_beyond_reason_is_refused_in_a_sentence_and_at_once(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "views.toml"
    path.write_text(text)
    start = time.process_time()  # other work on this machine does not count
    assert expected in refused(read_toml, path)
    assert time.process_time() - start < 2


@pytest.mark.parametrize(
    "text",
    [
        *("[" * 100_000, '{"a": ' * 100_000, "[" * 90 + "]" * 90, "1" * 5_000, "18446744073709551616", "1e400", "NaN"),
        *("[1, Infinity]", "{", ""),
    ],
)
def test_json_beyond_reason_is_refused_in_a_sentence(tmp_path: Path, text: str) -> None:
    path = tmp_path / "manifest.json"
    path.write_text(text)
    assert "manifest.json is n" in refused(read_json, path)


@pytest.mark.parametrize("text", ['"\\ud800"', '{"a": ["x", {"b\\uDFFF": 1}]}', '"\\udc00\\ud800"'])
def test_json_with_half_a_character_is_refused(tmp_path: Path, text: str) -> None:
    """What is read can be written: UTF-8 has no half of a surrogate pair."""
    path = tmp_path / "manifest.json"
    path.write_text(text)
    assert "half a surrogate pair" in refused(read_json, path)
    path.write_text('["\\ud83d\\ude00", "\\u00e9"]')
    assert read_json(path) == ["\U0001f600", "é"]


def test_text_that_is_not_utf8_is_refused_and_a_byte_order_mark_is_not(tmp_path: Path) -> None:
    (tmp_path / "bom").write_bytes(b"\xef\xbb\xbfa\r\n")
    (tmp_path / "latin").write_bytes("é".encode("latin-1"))
    assert read_text(tmp_path / "bom") == "a\r\n"
    assert "not text in UTF-8 (byte 1)" in refused(read_text, tmp_path / "latin")


def test_arrays_are_read_as_numpy_wrote_them(tmp_path: Path) -> None:
    one = np.arange(12, dtype=np.float32).reshape(3, 4)
    np.save(tmp_path / "rows.npy", one)
    np.save(tmp_path / "columns.npy", np.asfortranarray(one))
    np.savez_compressed(tmp_path / "all.npz", one=one, text=np.array("é"), none=np.zeros((0, 2)))
    assert (read_array(tmp_path / "rows.npy") == one).all()
    assert (read_array(tmp_path / "columns.npy") == one).all()
    found = read_arrays(tmp_path / "all.npz", ("one", "text", "none", "absent"))
    assert sorted(found) == ["none", "one", "text"]
    assert (found["one"] == one).all()
    assert str(found["text"]) == "é"


def header(text: str) -> bytes:
    padded = text.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(padded).to_bytes(2, "little") + padded


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"PK\x03\x04",
        header("{'descr': '<f4', 'fortran_order': False, 'shape': (-1, -4)}") + b"\0" * 16,
        header("{'descr': '<f4', 'fortran_order': False, 'shape': (1,)}") + b"\0" * 3,
        header("{'descr': '<f4', 'fortran_order': False, 'shape': (" + "1," * 60 + ")}") + b"\0" * 4,
        header("{'descr': '|V0', 'fortran_order': False, 'shape': (9,)}"),
    ],
)
def test_torn_arrays_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "view.npy"
    path.write_bytes(content)
    assert "is not a .npy file of plain numbers, or is damaged" in refused(read_array, path)
    assert "is not a .npz archive, or is damaged" in refused(read_arrays, path, ("a",))


def test_an_archive_that_unpacks_beyond_the_limit_is_refused(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "bomb.npz", a=np.zeros(10_000_000))
    assert "unpacks to more" in refused(read_arrays, tmp_path / "bomb.npz", ("a",), largest=1024**2)


@pytest.mark.parametrize(
    "name", ["", ".", "..", "../x", "/etc/x", "a/b", "a\\b", "C:x", "nul", "NUL.csv", "a\0b", "a\n", "a ", "x" * 300]
)
def test_only_plain_names_are_names(name: str) -> None:
    assert "plain file name" in refused(plain_name, name)


@posix
def test_inputs_are_not_outputs_also_through_links(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("a")
    (tmp_path / "folder").mkdir()
    (tmp_path / "symbolic.png").symlink_to("a.png")
    (tmp_path / "hard.png").hardlink_to(tmp_path / "a.png")
    (tmp_path / "elsewhere").symlink_to(tmp_path)
    for output in ("a.png", "folder/../a.png", "symbolic.png", "hard.png", "elsewhere/a.png"):
        said = refused(refuse_overwriting, [tmp_path / "a.png"], [tmp_path / output])
        assert "would be overwritten" in said
    refuse_overwriting([tmp_path / "a.png"], [tmp_path / "b.png", tmp_path / "none" / "a.png"])


def test_one_file_is_whole_or_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "camera.toml"
    write_whole(path, b"old")

    def fail(place: Path) -> None:
        place.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    assert "No space left" in refused(write_whole, path, fail)
    assert path.read_bytes() == b"old"
    write_whole(path, lambda place: place.write_bytes(b"new"), mode=0o600)
    assert path.read_bytes() == b"new"
    if os.name == "posix":
        assert path.stat().st_mode & 0o777 == 0o600
    assert [entry.name for entry in tmp_path.iterdir()] == ["camera.toml"]


@pytest.mark.parametrize("at", range(4))
def test_a_set_is_replaced_as_a_whole_or_has_no_summary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: int
) -> None:
    out = tmp_path / "results"
    names = ("summary.json", "depth.npz", "depth.png")
    replace_set(out, dict.fromkeys(names, b"old"), "summary.json")
    moved: list[Path] = []
    really = files.move

    def move(source: Path, place: Path) -> None:
        if len(moved) == at:
            raise OSError(28, "No space left on device", str(place))
        moved.append(place)
        really(source, place)

    monkeypatch.setattr(writing, "move", move)
    if at == len(names):
        replace_set(out, dict.fromkeys(names, b"new"), "summary.json")
        assert {(out / name).read_bytes() for name in names} == {b"new"}
        assert moved[-1].name == "summary.json"
    else:
        said = refused(replace_set, out, dict.fromkeys(names, b"new"), "summary.json")
        assert "without summary.json" in said
        assert not (out / "summary.json").exists()
    assert {entry.name for entry in out.iterdir()} <= set(names)


def test_what_cannot_be_made_leaves_the_old_set(tmp_path: Path) -> None:
    replace_set(tmp_path, {"a.txt": b"old", "summary.json": b"old"}, "summary.json")

    def stop(place: Path) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="none of these results was written"):
        replace_set(tmp_path, {"a.txt": b"new", "summary.json": stop}, "summary.json")
    assert (tmp_path / "a.txt").read_bytes() == (tmp_path / "summary.json").read_bytes() == b"old"
    assert "plain file name" in refused(replace_set, tmp_path, {"../x": b"", "summary.json": b""}, "summary.json")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a.txt", "summary.json"]


@posix
def test_what_a_dead_run_left_is_swept_by_the_next(tmp_path: Path) -> None:
    program = (
        "import os, sys, signal\nfrom focalgradient.files import staged\n"
        "with staged(sys.argv[1]) as folder:\n    (folder / 'part').write_text('x')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path)])
    assert done.returncode == -signal.SIGKILL
    assert len(list(tmp_path.iterdir())) == 1
    (tmp_path / ".focalgradient-mine").mkdir()
    with files.staged(tmp_path) as living:
        sweep(tmp_path)
        assert sorted(tmp_path.iterdir()) == sorted([tmp_path / ".focalgradient-mine", living])


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # open files that Python closes
def test_an_interruption_at_any_line_leaves_nothing_hidden(tmp_path: Path) -> None:
    """As by Ctrl-C: before each line in turn of the writing of a file."""

    def run(until: int) -> int:
        count = 0

        def trace(frame: Any, event: str, _: object) -> Any:
            nonlocal count
            if Path(frame.f_code.co_filename).name not in ("writing.py", "contextlib.py"):
                return None
            if event == "line":
                count += 1
                if count == until:
                    raise KeyboardInterrupt
            return trace

        before = sys.gettrace()
        sys.settrace(trace)
        try:
            write_whole(tmp_path / "out.txt", b"whole")
        except KeyboardInterrupt:
            pass
        finally:
            sys.settrace(before)
        return count

    lines = run(-1)
    assert lines > 30
    for number in range(1, lines + 1):
        (tmp_path / "out.txt").unlink(missing_ok=True)
        run(number)
        left = [path.name for path in tmp_path.iterdir()]
        assert left in ([], ["out.txt"]), f"{left} after an interruption before line {number} of {lines}"
        assert not left or (tmp_path / "out.txt").read_bytes() == b"whole"
