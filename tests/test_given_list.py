"""Lists of trials as tables: written, read again, run in the place of a design's own."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import pytest
from command_line import run, succeed

from focalgradient.dataset import read_dataset, validate
from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, NeckerDesign, Pinhole, check_design
from focalgradient.design.given_list import read_trials, trial_row
from focalgradient.errors import InputError
from focalgradient.observers import simulate

sys.path.insert(0, str(Path(__file__).parent / "fuzz"))
sys.path.insert(0, str(Path(__file__).parent / "experiments"))

from headless import make_set
from mutations import workbook

FACTORS = {"light": {"levels": ["dim", "bright"], "pictures": False}}
DESIGNS = [
    DepthRatingDesign(factors=FACTORS, break_every=20),
    DepthRatingDesign(scale="choice"),
    NeckerDesign(),
    Pinhole(),
    BlurThresholdDesign(),
]


def written(folder: Path, design, participant: str = "01") -> Path:
    path = folder / f"{participant}.csv"
    rows = [trial_row(trial) for trial in design.trials(participant)]
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, [*rows[0]])
        writer.writeheader()
        writer.writerows(rows)
    return path


@pytest.mark.parametrize("design", DESIGNS)
def test_a_list_read_again_is_the_same(design, tmp_path: Path) -> None:
    path = written(tmp_path, design, "03")
    given = design.with_trials("list", read_trials(path))
    assert given.trials("01") == given.trials("02") == design.trials("03")
    again = check_design("recorded", given.of("01").model_dump(mode="json"))
    assert again.trials("07", "2") == design.trials("03")
    assert len(given.pilot().trials("pilot")) <= 8


def test_a_spreadsheet_in_german_is_read_as_the_same_list(tmp_path: Path) -> None:
    design = NeckerDesign()
    path = written(tmp_path, design)
    text = path.read_text().replace("false", "FALSCH").replace("true", "WAHR").replace(",", ";").replace(".", ",")
    (tmp_path / "german.csv").write_text(text, encoding="utf-8-sig", newline="\r\n")
    assert design.with_trials("list", read_trials(tmp_path / "german.csv")).trials("01") == design.trials("01")
    rows = [{**row, "strength": "1,234"} for row in read_trials(path)]
    with pytest.raises(InputError, match="strength is '1,234', but must be a valid number"):
        design.with_trials("list", rows)


def test_a_workbook_is_read_as_the_same_list(tmp_path: Path) -> None:
    rows = [line.split(",") for line in written(tmp_path, Pinhole()).read_text().splitlines()]
    (tmp_path / "list.xlsx").write_bytes(workbook(rows))
    assert read_trials(tmp_path / "list.xlsx") == read_trials(tmp_path / "01.csv")


def test_the_command_writes_what_simulated_observers_are_shown(tmp_path: Path) -> None:
    (tmp_path / "all.csv").write_text(succeed("trials", "blur-threshold", "--participant", "02").output)
    rows = read_trials(tmp_path / "all.csv")
    assert [row["interval"] for row in rows] == [str(one.interval) for one in BlurThresholdDesign().trials("02")]
    kept = [row for row in rows if row["phase"] == "main" and row["catch"] == "false"][:12]
    own = [{"participant": label, **row} for label, part in (("01", kept[:8]), ("sub-2", kept[8:])) for row in part]
    design = BlurThresholdDesign().with_trials("own", own)
    simulate(design, tmp_path / "data", observers=2, seed=1)
    assert validate(tmp_path / "data").problems == ()
    table = read_dataset(tmp_path / "data").blur_threshold
    assert table.groupby("participant_id").size().to_dict() == {"sub-01": 8, "sub-02": 4}
    assert table["interval"].tolist() == [int(row["interval"]) for row in kept]
    with pytest.raises(InputError, match="no rows for participant 03"):
        design.trials("03")


def test_drawings_and_practice_are_written_as_files(tmp_path: Path) -> None:
    make_set(tmp_path / "set", ["spheres-00", "spheres-01"])
    (tmp_path / "own.toml").write_text(
        'task = "depthrating"\nscenes = ["spheres-01"]\nrepetitions = 1\npractice_trials = 4\ncatch_trials = 0\n'
    )
    given = ("trials", tmp_path / "own.toml", "--participant", "01", "--stimuli", tmp_path / "set")
    succeed(*given, "--files", tmp_path / "files")
    practice, main = (read_trials(tmp_path / "files" / f"{name}.csv") for name in ("practice", "conditions"))
    assert {row["phase"] for row in practice} == {"practice"}
    drawn = [row["picture"] for row in practice if row["scene"].startswith("example")]
    assert drawn
    assert all((tmp_path / "files" / name).read_bytes().startswith(b"\x89PNG") for name in drawn)
    assert all((tmp_path / "set" / row["picture"]).is_file() for row in main)
    again = run(*given, "--files", tmp_path / "files")
    assert again.exit_code == 2
    assert "contains files already" in again.output


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda rows: [{**row, "colour": "red"} for row in rows], "colour is not a field of a trial"),
        (lambda rows: [{**row, "catch": "perhaps"} for row in rows], "row 2: catch is 'perhaps', but must be a valid"),
        (lambda rows: [{**row, "scene": "moon"} for row in rows], "scene is 'moon', but the design has room"),
        (lambda rows: [*rows, {**rows[0], "phase": "practice"}], "practice trials first, then main trials"),
        (lambda rows: [{**row, "participant": "0/1"} for row in rows], "participant label is '0/1'"),
    ],
)
def test_a_list_that_cannot_be_shown_is_refused(change, sentence: str) -> None:
    rows = [{name: str(value) for name, value in trial_row(trial).items()} for trial in Pinhole().trials("01")]
    with pytest.raises(InputError, match=sentence):
        Pinhole().with_trials("list", change(rows))
