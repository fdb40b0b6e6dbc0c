"""A few kills, full disks and faults of each long command; `python tests/killing_commands.py 30` does many."""

import random
import sys
from pathlib import Path

import pytest

if sys.platform != "linux":
    pytest.skip("looks processes up in /proc, and limits files as POSIX does", allow_module_level=True)

from killing_commands import COMMANDS, prepare, torment


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("killed") / "base"
    folder.mkdir()
    prepare(folder)
    return folder


@pytest.mark.slow  # some ten runs of a command each
@pytest.mark.parametrize("name", list(COMMANDS))
def test_outputs_are_absent_or_whole_and_the_command_finishes(name: str, base: Path) -> None:
    counts = torment(name, 1, random.Random(f"suite {name}"), base)
    assert sum(counts.values()) >= 10
