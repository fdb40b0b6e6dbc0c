"""A kill, a full disk and a fault of some long commands; `python tests/killing_commands.py 30` does many of all."""

import random
import sys
from pathlib import Path

import pytest

if sys.platform != "linux":
    pytest.skip("looks processes up in /proc, and limits files as POSIX does", allow_module_level=True)

from killing_commands import FAULTS, LIMITS, SIGNALS, prepare, torment


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("killed") / "base"
    folder.mkdir()
    prepare(folder)
    return folder


SUITE = ("stream", "calibrate", "blur", "stimuli necker", "power necker", "frames", "repair", "collect")
"""A command for each way of writing: two folders, one file, a set, one resumed, rows, by workers, data sets."""


@pytest.mark.slow  # five runs of a command each
@pytest.mark.parametrize("name", SUITE)
def test_outputs_are_absent_or_whole_and_the_command_finishes(name: str, base: Path) -> None:
    # One kill, one full disk and one fault each; over the commands all of them.
    number = SUITE.index(name)
    signals, limits, faults = ([kinds[number % len(kinds)]] for kinds in (SIGNALS, LIMITS, FAULTS))
    counts = torment(name, 1, random.Random(f"suite {name}"), base, signals, limits, faults)
    assert sum(counts.values()) == 3
