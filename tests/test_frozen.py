"""Sessions of each task recorded on 28 November 2026 (`frozen/record.py`) validate, resume and are reported."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "frozen"))
from record import DESIGNS, SCREEN, answer

from focalgradient.dataset import Session, read_dataset, validate
from focalgradient.report import make_report
from focalgradient.statistics import NotComputed

SESSIONS = Path(__file__).parent / "frozen" / "sessions.zip"


@pytest.mark.usefixtures("unrendered")
@pytest.mark.parametrize("task", DESIGNS)
def test_frozen_sessions_validate_resume_and_are_reported(
    task: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # takes 15 s, as the recorded percepts have no chance in them, and reads no session
    monkeypatch.setattr("focalgradient.statistics.cube.fit_dominance", lambda data: NotComputed("not fitted"))
    with zipfile.ZipFile(SESSIONS) as archive:
        archive.extractall(tmp_path)
    root = tmp_path / task
    assert len(read_dataset(root).tables[task]) > 0
    found = validate(root)
    assert len(found.problems) == 1
    assert "of the design are missing" in found.problems[0]  # of the session that was cut off
    with Session.resume(root, task, "04", apparatus=SCREEN) as session:
        keys = session.design.keys_of("04") if task == "necker" else None
        for trial in session.remaining():
            session.record(trial, answer(session.design, trial, 4, keys))
    assert validate(root).problems == ()
    report = make_report(root)
    assert report.problems == ()
    assert b"<html" in report.files["report.html"]
