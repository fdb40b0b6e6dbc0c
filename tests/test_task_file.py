"""Tasks of one's own by --task-file, their units in figures, and guess rates of tables of one's own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from focalgradient.design import DepthRatingDesign
from focalgradient.errors import InputError
from focalgradient.lab.options import SessionOptions
from focalgradient.lab.preparation import _unshortened
from focalgradient.options import parsed
from focalgradient.statistics import fit_threshold, read_thresholds
from focalgradient.tasks.registry import FILES

pytestmark = pytest.mark.usefixtures("unrendered")

EXPERIMENTS = Path(__file__).parents[1] / "experiments"


def command(*words: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process that knows no task of one's own."""
    program = "from focalgradient.cli import main; main()"
    given = [sys.executable, "-c", program, *map(str, words)]
    return subprocess.run(given, cwd=folder, capture_output=True, text=True)


@pytest.mark.slow
def test_a_report_knows_the_task_by_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FILES, raising=False)
    file = EXPERIMENTS / "slant_from_blur.py"
    done = command("simulate", file, "--observers", 3, "--seed", 1, "--out", "data", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    for words in (("validate", "data"), ("report", "data", "--out", "report")):
        unknown = command(*words, folder=tmp_path)
        assert unknown.returncode in (1, 2)
        assert (unknown.stdout + unknown.stderr).count("of a task 'slantfromblur' that is unknown here") == 1
        assert "has no session" not in unknown.stdout
        assert f"focalgradient {words[0]} data --task-file my_task.py" in unknown.stdout + unknown.stderr
    known = command("report", "data", "--out", "report", "--task-file", file, folder=tmp_path)
    assert known.returncode == 0, known.stderr
    assert "Slant from blur" in (tmp_path / "report" / "report.md").read_text()
    monkeypatch.setenv(FILES, str(file))
    assert command("validate", "data", folder=tmp_path).returncode == 0
    design = command("run", file, "--print-design", folder=tmp_path)
    assert 'task = "slantfromblur"\n' in design.stdout
    missing = command("report", "data", "--out", "report", "--task-file", "none.py", folder=tmp_path)
    assert (missing.returncode, missing.stderr.count("\n")) == (2, 1)


def of_alternatives(guess: float, repeats: int = 40) -> pd.DataFrame:
    """Answers of four people of one known threshold, 0.2, and slope 3, without lapses."""
    chance = np.random.default_rng(3)
    level = np.repeat([0.05, 0.1, 0.15, 0.2, 0.3, 0.5], repeats)
    right = [chance.random(len(level)) < guess + (1 - guess) * (1 - 0.5 ** ((level / 0.2) ** 3)) for _ in range(4)]
    return pd.DataFrame(
        {"subject": np.repeat(list("abcd"), len(level)), "level": [*level] * 4, "correct": np.ravel(right)}
    )


def written(folder: Path, table: pd.DataFrame) -> Path:
    table.assign(correct=table["correct"].astype(int)).to_csv(folder / "own.csv", index=False)
    return folder / "own.csv"


@pytest.mark.parametrize("guess", [0.0, 0.25, 1 / 3, 0.5])
def test_the_threshold_is_found_at_its_guess_rate(guess: float) -> None:
    pytest.importorskip("psignifit")
    table = of_alternatives(guess, repeats=120)
    fit = fit_threshold(table["level"], table["correct"], least=0.05, most=0.5, guess=guess)
    assert fit.low < 0.2 < fit.high
    assert fit.threshold == pytest.approx(0.2, rel=0.06)


def test_a_guess_rate_that_the_answers_contradict_is_asked_for(tmp_path: Path) -> None:
    own = written(tmp_path, of_alternatives(0.25))
    with pytest.raises(InputError, match=r"guess rate is not known.*alternatives"):
        read_thresholds(own)
    assert read_thresholds(own, guess=0.25).guess == 0.25
    assert read_thresholds(written(tmp_path, of_alternatives(0.25).assign(alternatives=4))).guess == 0.25
    with pytest.raises(InputError, match=r"0\.5.*alternatives give 0\.25"):
        read_thresholds(own, guess=0.5)
    with pytest.raises(InputError, match="alternatives"):
        read_thresholds(written(tmp_path, of_alternatives(0.5).assign(alternatives=[2, 4] * 480)))
    with pytest.raises(InputError, match="guess is 1"):
        read_thresholds(written(tmp_path, of_alternatives(0.5)), guess=1.0)
    found = read_thresholds(written(tmp_path, of_alternatives(0.5)))
    assert found.guess == 0.5
    assert any("one half" in note for note in found.notes)


def test_a_long_test_run_and_the_default_design_are_stated(capsys: pytest.CaptureFixture[str]) -> None:
    design = DepthRatingDesign()
    for short, stated in ((design, True), (design.pilot(), False)):
        said = [*_unshortened(SessionOptions(pilot=True), short, design)]
        assert [one.partition(":")[0] for one in said] == ["the test run has all 204 trials of the design"] * stated
    assert not [*_unshortened(SessionOptions(), design, design)]
    with pytest.raises(SystemExit):
        parsed(SessionOptions, ["--help"], program="run mine", about="")
    text = capsys.readouterr().out
    assert "those that --print-design writes" in " ".join(text.split())
    assert "of the paper" not in text
