"""Every command that writes, given files of others under the names of its results: it leaves them as they are."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner
from long_commands import COMMANDS, prepare

from focalgradient.cli import main

QUICK = ("depth", "frames", "calibrate", "calibrate --sheet", "stream", "blur", "power necker", "stimuli set")
"""Commands that take some seconds at most with what `prepare` makes."""

SLOW = ("eye", "eye --accommodate", "power depth-rating", "stimuli necker", "stimuli depth-rating", "stimuli import")
SLOW += ("demo", "report", "simulate necker", "serve --export")

FOREIGN = b'{"mine": "notes of somebody else"}\n'


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("given")
    prepare(folder)
    return folder


@pytest.fixture
def here(given: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(given, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FOCALGRADIENT_CACHE", str(tmp_path / "cache"))
    return tmp_path


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def check(name: str) -> None:
    """Run a command twice, then once for a file of each kind that it wrote, with another in its place."""
    command = COMMANDS[name]
    out = Path(command.where)
    out.parent.mkdir(exist_ok=True)
    first = CliRunner().invoke(main, list(command.words), catch_exceptions=False)
    assert first.exit_code in (0, 1), first.output
    written = files(out)
    assert written
    again = CliRunner().invoke(main, list(command.words), catch_exceptions=False)
    if not command.once:
        assert again.exit_code in (0, 1), again.output  # its own files it replaces, or goes on with
        assert set(files(out)) == set(written)
    for place in {Path(place).suffix: place for place in reversed(written)}.values():
        shutil.rmtree(out)
        (out / place).parent.mkdir(parents=True)
        (out / place).write_bytes(FOREIGN)
        refused = CliRunner().invoke(main, list(command.words), catch_exceptions=False)
        assert refused.exit_code == 2, f"{place}: {refused.output}"
        assert (out / place).read_bytes() == FOREIGN, place
        assert sum(line.startswith("Error") for line in refused.stderr.splitlines()) == 1, refused.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_files_of_others_are_kept(here: Path, name: str) -> None:
    check(name)


def test_force_replaces_files_of_others_but_no_input(here: Path) -> None:
    words = ["blur", "a.png", "far.npy", "--out", "out", "--f-number", "4", "--focal-length", "25"]
    words += ["--focus", "0.8", "--field", "6"]
    Path("out").mkdir()
    Path("out/summary.json").write_bytes(FOREIGN)
    done = CliRunner().invoke(main, [*words, "--force"])
    assert done.exit_code == 0, done.output
    assert Path("out/summary.json").read_bytes() != FOREIGN
    shutil.copy("far.npy", "out/distance.npy")
    words[2] = "out/distance.npy"
    refused = CliRunner().invoke(main, [*words, "--force"])
    assert refused.exit_code == 2
    assert "but it is read" in refused.stderr


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
@pytest.mark.parametrize("name", ["calibrate", "depth"])
def test_a_device_or_pipe_is_never_replaced(name: str, here: Path) -> None:
    """As /dev/null was by root: results are moved into their place."""
    command = COMMANDS[name]
    assert command.summary
    place = Path(command.where, command.summary)
    place.parent.mkdir(parents=True, exist_ok=True)
    os.mkfifo(place)
    for words in (command.words, [*command.words, "--force"]):
        refused = CliRunner().invoke(main, list(words), catch_exceptions=False)
        assert refused.exit_code == 2
        assert f"{place.name} is a device or a pipe" in refused.stderr
    assert place.is_fifo()
