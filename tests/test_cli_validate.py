"""`focalgradient validate`: what it prints, and its exit codes."""

from functools import partial
from pathlib import Path

import command_line
import pytest

from focalgradient.dataset import Apparatus, Rated, Session, validator
from focalgradient.design import Pinhole

DESIGN = Pinhole(scenes=["a"], repetitions=1)


run = partial(command_line.run, "validate")


@pytest.fixture
def data(tmp_path: Path) -> Path:
    with Session.begin(tmp_path / "data", DESIGN, "01", apparatus=Apparatus("seconds")) as session:
        for number, trial in enumerate(session.remaining()):
            session.record(trial, Rated(onset=20.0 * number, rating=1.0, response_time=1.0))
    return tmp_path / "data"


def test_a_valid_data_set_is_called_so(data):
    result = run(data)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[:2] == ["Sessions: 1", "Trials: 6"]
    assert result.stdout.splitlines()[-1] == "Valid."


def test_problems_are_listed_with_exit_code_1(data):
    table = data / "sub-01" / "beh" / "sub-01_task-pinhole_beh.tsv"
    table.write_text(table.read_text().replace("\t1.0\t1.0\t", "\t1.5\t1.0\t", 1))
    result = run(data)
    assert result.exit_code == 1
    assert "Problem: " in result.stdout
    assert "it differs from its journal" in result.stdout
    assert result.stdout.splitlines()[-1] == "Problems: 1"


def test_without_the_validator_of_the_standard_that_is_said(data, monkeypatch):
    monkeypatch.setattr(validator.shutil, "which", lambda *args, **more: None)
    result = run(data)
    assert result.exit_code == 0
    assert "Note: BIDS was not checked: bids-validator-deno is not installed" in result.stdout


def test_what_is_no_data_set_is_refused_in_one_sentence(tmp_path, data):
    (tmp_path / "notes.txt").touch()
    result = run(tmp_path)
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: ")
    assert "is not a data set, as it has no dataset_description.json: give the folder" in result.stderr
    assert result.stderr.count("\n") == 1
    assert "notes.txt is a file, not the folder of a data set: give the folder" in run(tmp_path / "notes.txt").stderr
    part = next(data.glob("sub-*"))
    assert f"{part} is a part of the data set {data}: give that folder" in run(part).stderr


def test_a_damaged_journal_is_named_and_the_others_are_exported(data):
    with Session.begin(data, DESIGN, "02", apparatus=Apparatus("seconds")) as session:
        for number, trial in enumerate(session.remaining()):
            session.record(trial, Rated(onset=20.0 * number, rating=1.0, response_time=1.0))
    session.files.table.unlink()
    journal = data / "sourcedata" / "sub-01" / "beh" / "sub-01_task-pinhole_beh.jsonl"
    journal.write_text(journal.read_text().replace('"onset"', '"offset"', 1))
    result = run(data, "--export")
    assert result.exit_code == 1
    assert result.stdout.count("line 2: onset is missing, but must be a number of 0 or more") == 1
    assert session.files.table.exists()
