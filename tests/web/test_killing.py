"""A few of the kills of `killing_browsers.py`, which makes two hundred."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest
from killing_browsers import one_session

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")


@pytest.mark.slow
@pytest.mark.parametrize("task", ["depthrating", "necker"])
def test_killed_page_network_and_server_lose_no_acknowledged_answer(tmp_path: Path, task: str) -> None:
    count = one_session(tmp_path, task, random.Random(7), 4)
    assert count["answers"] > 4
