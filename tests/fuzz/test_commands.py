"""A few wrong values for every command: `run.py` beside this tries as many as one likes."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))

from commands import LINES, base, case

QUICK = ("blur", "collect", "repair", "run", "serve", "stream", "validate", "withdraw")
"""Commands whose cases take a tenth of a second."""

CASES = dict.fromkeys(QUICK, 8) | dict.fromkeys(("calibrate", "depth", "stream", "validate"), 4)
CASES |= dict.fromkeys(("eye", "power", "report", "simulate"), 3)
"""Number of cases in the suite."""


@pytest.mark.parametrize("command", CASES)
@pytest.mark.filterwarnings("ignore")
def test_wrong_values_are_refused_in_a_sentence(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    for seed in range(CASES[command]):
        line, wrong = case(seed, command)
        assert not wrong, f"python tests/fuzz/run.py 1 --door commands:{command} --seed {seed}: {line}: {wrong}"


def test_every_command_is_tried() -> None:
    from commands import leaves

    words = {tuple(line.split()[: len(command)]) for command in leaves() for line in LINES}
    assert set(leaves()) <= words
    assert all((base() / line.split()[1]).exists() for line in LINES if line.startswith(("validate ", "report ")[:1]))
