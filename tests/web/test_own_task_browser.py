"""The task of docs/extending.md in Chromium, against the command's own server: from its link to a valid data set."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from chromium import Server, chromium, take_part
from extended import ROOT, build, command

ALSO = """[also.interest]
question = "How interesting was it?"
most = 4
steps = true
"""

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")


@pytest.mark.slow
def test_the_task_of_the_document_is_served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed = build("A task", "edge_blur.py", tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(installed), str(ROOT / "src")]))
    (tmp_path / "design.toml").write_text('task = "edgeblur"\nrepetitions = 1\npractice_trials = 1\n\n' + ALSO)
    server = Server(tmp_path, 0)
    server.start("--invite", 1)
    errors: list[str] = []
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1024, "height": 768})
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(server.address)
        seen = take_part(page, name="own")
    assert server.end() == 0
    assert errors == []
    told = "".join(seen)
    assert "Say how blurred each edge looks." in told
    assert "How blurred did it look?" in told
    done = command(installed, "validate", tmp_path / "data")
    assert done.returncode == 0, done.stdout
    heads, *lines = next(tmp_path.glob("data/sub-*/**/*_beh.tsv")).read_text().splitlines()
    columns = dict(zip(heads.split("\t"), zip(*(line.split("\t") for line in lines), strict=True), strict=True))
    assert sorted(map(float, columns["sigma_arcmin"])) == [1, 4, 16]
    assert len({*columns["shown_sha256"]}) == 3
    blur, starts = (list(map(float, columns[name])) for name in ("blur", "start"))
    assert all(0 <= one <= 10 for one in blur)
    assert all(0 < one - start < 0.02 for one, start in zip(blur, starts, strict=True))  # moved by one key
    assert list(map(float, columns["interest"])) == [3, 3, 3]
    assert {*map(float, columns["interest_start"])} <= {0, 1, 2, 3, 4}
    assert len({*blur}) == 3  # the first key puts the marker at a random place
