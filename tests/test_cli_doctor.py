"""`focalgradient doctor`: its table, its exit codes, and what it says where nothing can be looked at."""

import sys
from functools import partial
from pathlib import Path

import command_line
import pytest

from focalgradient.lab import computer as module

SAID = '[{"name": "refresh rate", "measured": "60.00 Hz", "well": true, "remedy": "none", "limit": "a tenth"}]'


run = partial(command_line.run, "doctor")


def answered(folder: Path, monkeypatch: pytest.MonkeyPatch, said: str, wrong: str = "") -> Path:
    """Let the screen be looked at by something that says this; where it leaves what it was asked."""
    program, asked = folder / "look.py", folder / "asked.txt"
    told = f"open({str(asked)!r}, 'w').write(' '.join(sys.argv[1:]))"
    program.write_text(f"import sys\n{told}\nprint({said!r})\nprint({wrong!r}, file=sys.stderr)\n")
    monkeypatch.setattr(module, "SCREEN", [sys.executable, str(program)])
    return asked


def test_all_well_is_exit_code_0(tmp_path, monkeypatch):
    asked = answered(tmp_path, monkeypatch, f"noise of a library\n{SAID}\n")
    monkeypatch.setattr(module, "SLOW", 10.0)
    result = run("--data", tmp_path / "new" / "data", "--monitor", "lab", "--screen", 1, "--windowed")
    assert result.exit_code == 0, result.output
    rows = [line.split(" | ")[1] for line in result.stdout.splitlines()[2:]]
    assert rows == ["refresh rate", "safe writing", "disk space", "versions"]
    assert "WRONG" not in result.stdout
    assert not (tmp_path / "new").exists()
    assert asked.read_text() == "--screen 1 --monitor lab --windowed --seconds 10.0"


JACK = "PsychoPy's keyboard needs libjack: apt-get install libjack-jackd2-0.\n"
KEYBOARD = "| WRONG | keyboard | PsychoPy's keyboard needs libjack |  | apt-get install libjack-jackd2-0 |"


@pytest.mark.parametrize(("said", "wrong"), [("", JACK), ("", ""), ("[1]", ""), ('[{"check": 1}]', ""), ("{", "")])
def test_experiments_that_break_off_are_told(tmp_path, monkeypatch, said, wrong):
    answered(tmp_path, monkeypatch, said, wrong)
    result = run("--data", tmp_path)
    assert result.exit_code == 1
    assert (KEYBOARD if wrong else "| WRONG | screen | it ended with 0 |  |") in result.stdout


def test_without_psychopy(tmp_path, monkeypatch):
    answered(tmp_path, monkeypatch, SAID)
    monkeypatch.setattr(module, "version", _without_psychopy)
    result = run("--data", tmp_path)
    assert result.exit_code == 1
    assert "psychopy missing" in result.stdout
    assert "pip install 'focalgradient[lab]', on Python 3.11 or 3.12 |" in result.stdout


def _without_psychopy(name: str) -> str:
    if name.startswith("psycho"):
        raise module.PackageNotFoundError(name)
    return "1.0"


def test_a_disk_that_is_nearly_full_or_slow(tmp_path, monkeypatch):
    answered(tmp_path, monkeypatch, SAID)
    monkeypatch.setattr(module, "ROOM", 1 << 62)
    monkeypatch.setattr(module, "SLOW", 0.0)
    result = run("--data", tmp_path)
    assert result.exit_code == 1
    assert "make room, or give --data another disk" in result.stdout
    assert "give --data a folder on a local disk" in result.stdout
