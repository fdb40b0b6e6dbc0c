"""What is noted beside answers: columns of every task, described, read back and checked."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from focalgradient.dataset import Apparatus, Noted, Rated, Session, read_dataset, validate
from focalgradient.design import BlurThresholdDesign, NeckerDesign, Pinhole, check_design
from focalgradient.errors import InputError

APPARATUS = Apparatus("seconds of the test")
PINHOLE = Pinhole(scenes=["a"], repetitions=1)


def rated(number: int, **extra: object) -> Rated:
    return Rated(onset=30.0 * number, rating=1.2, response_time=2.0, **extra)


def record(root: Path, *extras: dict[str, object]) -> Session:
    with Session.begin(root, PINHOLE, "01", apparatus=APPARATUS) as session:
        for number, extra in enumerate(extras):
            session.record(session.remaining()[0], rated(number, **extra))
    return session


@pytest.mark.parametrize(
    ("value", "form", "told", "read"),
    [
        (np.float32(2.5), "number", "2.5", 2.5),
        (7, "integer", "7", 7),
        (True, None, "true", True),
        ("two\tlines\nof text", None, "two lines of text", "two lines of text"),
        ("=1+1", None, "'=1+1", "=1+1"),
        (None, None, "n/a", None),
        (math.nan, None, "n/a", None),
    ],
)
def test_a_value_passes_through_table_and_sidecar(value, form, told: str, read, tmp_path: Path) -> None:
    extra = {"own": Noted(value, unit="arcmin", description="What was set.")}
    session = record(tmp_path / "data", *[extra] * len(PINHOLE.trials("01")))
    lines = session.files.table.read_text().splitlines()
    assert [line.split("\t")[-1] for line in lines] == ["own", *[told] * (len(lines) - 1)]
    entry = json.loads(session.files.sidecar.read_text())["own"]
    assert (entry["Description"], entry["Units"], entry.get("Format")) == ("What was set.", "arcmin", form)
    assert validate(tmp_path / "data").problems == ()
    found = read_dataset(tmp_path / "data").pinhole["own"].iloc[0]
    assert found == read if read is not None else found != found


def test_what_is_noted_later_adds_a_column_also_after_a_session_was_cut_off(tmp_path: Path) -> None:
    record(tmp_path / "data", {}, {"first": 1})
    with Session.resume(tmp_path / "data", "pinhole", "01", apparatus=APPARATUS) as session:
        for number, trial in enumerate(session.remaining()):
            session.record(trial, rated(number, second=0.5))
    table = read_dataset(tmp_path / "data").pinhole
    assert table["first"].tolist()[1] == 1
    assert table["first"].isna().sum() == len(table) - 1
    assert table["second"].tolist()[2:] == [0.5] * (len(table) - 2)
    assert validate(tmp_path / "data").problems == ()
    path = session.files.sidecar
    path.write_text(path.read_text().replace("Noted by the laboratory", "Noted by another"))
    assert any("first" in problem for problem in validate(tmp_path / "data").problems)


@pytest.mark.parametrize(
    ("before", "extra", "sentence"),
    [
        ({}, {"interest": [1, 2]}, "must be a finite number, a text"),
        ({}, {"interest": math.inf}, "must be a finite number"),
        ({}, {"a b": 1}, "'a b' cannot be the name of a column"),
        ({}, {"trial": 1}, "'trial' is a reserved name in data sets"),
        ({}, {"Design": 1}, "'Design' is a reserved name in data sets"),
        ({"own": 1}, {"own": "one"}, "own was noted as a number and as a text"),
        ({"own": Noted(1, "s")}, {"own": Noted(1, "ms")}, "own was noted in 's' and in 'ms'"),
    ],
)
def test_what_cannot_be_a_column_is_refused_before_it_is_written(before, extra, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=sentence):
        record(tmp_path / "data", before, extra)
    assert len(record(tmp_path / "other", before).recorded) == 1


@pytest.mark.parametrize("design", [PINHOLE, NeckerDesign(), BlurThresholdDesign()])
def test_every_design_can_ask_further_questions(design) -> None:
    asked = {"also": {"interest": {"question": "How interesting?", "unit": "points"}}}
    stated = design.model_dump(mode="json") | asked
    made = check_design("mine", stated)
    assert made.also["interest"].control().ends == ("", "")
    assert made.model_dump(mode="json")["also"]["interest"]["question"] == "How interesting?"
    assert "also" not in design.model_dump(mode="json")  # stays as it was recorded before
    with pytest.raises(InputError, match="most is -1, but must be above least"):
        check_design("mine", {**stated, "also": {"interest": {"question": "?", "most": -1.0}}})
