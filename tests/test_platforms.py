"""What is written for Windows and macOS: hosted tests run it there; here, with the rules of those systems in place."""

import errno
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest

from focalgradient.dataset import Apparatus, Rated, Session, read_dataset, repair, validate, withdraw
from focalgradient.design import Pinhole
from focalgradient.errors import InputError
from focalgradient.files import writing

posix = pytest.mark.skipif(os.name != "posix", reason="puts the rules of other systems in place of those of POSIX")
DESIGN = Pinhole(scenes=["a"], repetitions=1)
APPARATUS = Apparatus("seconds from the start of the sitting")


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rules of Windows: its locks, and no file is moved, removed or replaced while this process has it open."""
    import fcntl

    locks = ModuleType("msvcrt")

    def locking(file: int, mode: int, count: int) -> None:
        assert (os.lseek(file, 0, os.SEEK_CUR), count) == (2**31 - 2, 1)
        fcntl.flock(file, fcntl.LOCK_UN if mode else fcntl.LOCK_EX | fcntl.LOCK_NB)

    locks.locking, locks.LK_NBLCK, locks.LK_UNLCK = locking, 0, 1  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "msvcrt", locks)
    monkeypatch.setattr(sys, "platform", "win32")

    def refuse_open(path: object) -> None:
        held = {os.readlink(f"/proc/self/fd/{number}") for number in os.listdir("/proc/self/fd") if _is_open(number)}
        if os.path.abspath(os.fspath(path)) in held:  # type: ignore[call-overload]
            raise PermissionError(errno.EACCES, "used by a process", str(path))

    def guarded(real, *places):
        def act(*paths, **more):
            for place in places:
                refuse_open(paths[place])
            if real is RENAME and os.path.lexists(paths[1]):
                raise FileExistsError(errno.EEXIST, "is there already", str(paths[1]))
            return real(*paths, **more)

        return act

    for name, places in {"replace": (0, 1), "rename": (0, 1), "unlink": (0,), "remove": (0,)}.items():
        monkeypatch.setattr(os, name, guarded(getattr(os, name), *places))


RENAME = os.rename


def _is_open(number: str) -> bool:
    return os.path.lexists(f"/proc/self/fd/{number}")


def record(root: Path, label: str, trials: int | None = None) -> None:
    with Session.begin(root, DESIGN, label, apparatus=APPARATUS, about={"age": 30}) as session:
        for number, trial in enumerate(session.remaining()[:trials]):
            session.record(trial, Rated(onset=30.0 * number, rating=1.2, response_time=2.0))


@posix
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="looks open files up in /proc")
@pytest.mark.usefixtures("windows")
def test_on_windows_sessions_are_recorded_resumed_repaired_and_withdrawn(tmp_path: Path) -> None:
    root = tmp_path / "data"
    record(root, "01")
    with pytest.raises(InputError, match="which is never overwritten"):
        record(root, "01")
    with Session.begin(root, DESIGN, "02", apparatus=APPARATUS) as session:
        with pytest.raises(InputError, match="is being recorded by another program"):
            Session.resume(root, "pinhole", "02", apparatus=APPARATUS)
        session.record(session.remaining()[0], Rated(onset=0.0, rating=1.0, response_time=2.0))
    with Session.resume(root, "pinhole", "02", apparatus=APPARATUS) as session:
        for number, trial in enumerate(session.remaining()):
            session.record(trial, Rated(onset=30.0 * number, rating=1.2, response_time=2.0))
    assert validate(root).problems == ()

    journal = next(root.rglob("sub-02*.jsonl"))
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join([*lines, lines[-1]]))
    assert [one.problem for one in repair(root)] == [""]
    assert validate(root).problems == ()
    withdraw(root, "02")
    assert read_dataset(root).participants["participant_id"].tolist() == ["sub-01"]
    assert not list(root.rglob("*02*"))
    assert not [path for path in root.rglob(".*") if path.is_file()]


@posix
def test_on_windows_a_place_that_is_held_open_is_tried_again_and_then_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, place, tries, real = tmp_path / "new", tmp_path / "old", [], os.replace
    monkeypatch.setattr(writing, "PATIENCE_S", 0.2)

    def held(times: int) -> None:
        def replace(one: object, other: object) -> None:
            tries.append(one)
            if len(tries) <= times:
                raise PermissionError(errno.EACCES, "Access is denied", str(other))
            real(one, other)  # type: ignore[arg-type]

        tries.clear()
        source.write_text("new")
        place.write_text("old")
        monkeypatch.setattr(os, "replace", replace)
        with monkeypatch.context() as there:
            there.setattr(os, "name", "nt")
            writing.move(source, place)

    held(2)
    assert (place.read_text(), len(tries)) == ("new", 3)
    with pytest.raises(PermissionError, match="another program holds it open: close it there"):
        held(10**6)
    assert place.read_text() == "old"


@posix
def test_on_macos_what_is_written_passes_the_memory_of_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    import fcntl

    calls: list[object] = []
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(fcntl, "F_FULLFSYNC", 51, raising=False)
    monkeypatch.setattr(fcntl, "fcntl", lambda *given: calls.append(given))
    monkeypatch.setattr(os, "fsync", lambda number: calls.append(number))
    writing.flush(7)
    assert calls == [(7, 51)]

    def unknown(*_: object) -> None:
        raise OSError(errno.ENOTSUP, "not supported")

    monkeypatch.setattr(fcntl, "fcntl", unknown)
    writing.flush(8)
    assert calls == [(7, 51), 8]
