"""Some damaged inputs for every door: `run.py` beside this tries as many as one likes."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from doors import DOORS, case

CASES = 20


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.filterwarnings("ignore")
def test_damaged_input_is_refused_in_a_sentence(door: str) -> None:
    for seed in range(CASES):
        try:
            case(door, seed)
        except Exception as error:
            raise AssertionError(f"python tests/fuzz/run.py 1 --door {door} --seed {seed}") from error
