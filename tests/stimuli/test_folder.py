"""Files that are whole or not there: whatever cuts the work off, the same call goes on from what was finished."""

import errno
import json
import os
from pathlib import Path

import pytest

from focalgradient import InputError
from focalgradient.stimuli.folder import Folder

ASKED = {"set": "test", "seed": 1, "parameters": {"size": [4, 4], "engine": "cast"}}
VERSIONS = {"python": "3.11"}


def begun(path: Path) -> Folder:
    folder = Folder(path, ASKED, VERSIONS)
    folder.content["white"] = 0.5
    folder.put({"a/one.txt": b"one", "two.txt": b"two"})
    return folder


def test_begun_then_finished_then_verified(tmp_path: Path) -> None:
    begun(tmp_path)
    again = Folder(tmp_path, ASKED, VERSIONS)
    assert again.has("a/one.txt", "two.txt")
    assert not again.has("two.txt", "three.txt")
    assert (again.content, again.complete) == ({"white": 0.5}, False)
    again.put({"three.txt": b"three"})
    again.finish()
    assert sorted(os.listdir(tmp_path)) == ["a", "manifest.json", "three.txt", "two.txt"]
    finished = Folder(tmp_path, ASKED, {"python": "3.12"})  # other versions may look at it
    assert finished.complete
    assert json.loads((tmp_path / "manifest.json").read_text())["versions"] == VERSIONS


def test_files_that_changed_are_made_again(tmp_path: Path) -> None:
    begun(tmp_path).finish()
    (tmp_path / "two.txt").write_bytes(b"tw")
    (tmp_path / "a" / "one.txt").unlink()
    damaged = Folder(tmp_path, ASKED, VERSIONS)
    assert not damaged.complete
    assert sorted(damaged.damaged) == ["a/one.txt", "two.txt"]
    assert not damaged.has("two.txt")
    damaged.put({"a/one.txt": b"one", "two.txt": b"two"})
    damaged.finish()
    assert Folder(tmp_path, ASKED, VERSIONS).complete


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES])
def test_a_full_disk_leaves_what_was_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    folder = begun(tmp_path)

    def full(_: int) -> None:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(
            InputError, match=rf"four.bin cannot be written \({os.strerror(number)}\).*2 files finished"
        ):
            folder.put({"four.bin": bytes(1000)})
    assert not list(tmp_path.rglob("*four*"))
    assert not list(tmp_path.rglob(".*"))
    again = Folder(tmp_path, ASKED, VERSIONS)
    assert again.has("a/one.txt", "two.txt")


def test_a_kill_while_writing_leaves_no_half_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = begun(tmp_path)

    def killed(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", killed)
    with pytest.raises(KeyboardInterrupt):
        folder.put({"two.txt": b"other"})
    assert (tmp_path / "two.txt").read_bytes() == b"two"
