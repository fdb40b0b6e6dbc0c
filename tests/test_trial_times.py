"""When mark, mask and question of a trial appeared: columns made of what laboratory and browser noted."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from focalgradient.dataset import Apparatus, Rated, Session, read_dataset, validate
from focalgradient.design import Pinhole
from focalgradient.errors import InputError

BEGAN = datetime(2026, 3, 1, 9, 30, tzinfo=UTC)

HAPPENED = {"mark": 12.0, "picture": 15.0, "mask": 15.5, "question": 16.25}
LABORATORY = (
    "events",
    {"events": [["mark", 2.0, 0.0], *([name, at, 0.0] for name, at in HAPPENED.items()), ["question", 19.0, 0.0]]},
)
BROWSER = (
    "frames",
    {"shown": [{"event": name, "stamps": [7e3 + 1e3 * at, 7.5e3 + 1e3 * at]} for name, at in HAPPENED.items()]},
)


def session(root: Path, note: tuple[str, dict[str, Any]] | None) -> None:
    """One person's, of whose first trial something is noted."""
    design = Pinhole()
    with Session.begin(root, design, "01", apparatus=Apparatus("seconds from the start"), time=BEGAN) as made:
        for number, trial in enumerate(made.remaining(), 1):
            if note is not None and trial.phase == "main" and not any(one["phase"] == "main" for one in made.recorded):
                made.note(note[0], phase=trial.phase, trial=trial.trial, **note[1])
            made.record(trial, Rated(onset=15.0 * number, rating=1.2, response_time=2.0))


@pytest.mark.parametrize("note", [LABORATORY, BROWSER], ids=["laboratory", "browser"])
def test_times_of_a_trial_stand_in_its_row(tmp_path: Path, note: tuple[str, dict[str, Any]]) -> None:
    session(tmp_path, note)
    assert validate(tmp_path).problems == ()
    table = read_dataset(tmp_path).tables["pinhole"]
    first = table.iloc[0]
    assert first["onset"] == 15.0  # the mark is the last before the picture, the question the first after it
    assert list(first[["mark_onset", "mask_onset", "question_onset"]]) == pytest.approx([12.0, 15.5, 16.25])
    assert table["question_onset"].iloc[1:].isna().all()
    assert set(table["sitting_began"]) == {"2026-03-01T09:30:00+00:00"}


def test_without_a_note_there_is_no_column(tmp_path: Path) -> None:
    session(tmp_path, None)
    assert validate(tmp_path).problems == ()
    columns = read_dataset(tmp_path).tables["pinhole"].columns
    assert "sitting_began" in columns
    assert not {"mark_onset", "mask_onset", "question_onset"} & set(columns)


def test_a_note_that_cannot_be_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"line 2: shown has .*'soon'"):
        session(tmp_path, ("frames", {"shown": [{"event": "picture", "stamps": ["soon"]}]}))
