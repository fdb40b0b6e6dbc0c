"""`focalgradient report`: the files that it writes, what it says, and its exit codes."""

import os
from functools import partial

import command_line
import pytest
from recorded import record_ratings

pytestmark = pytest.mark.usefixtures("unrendered")


run = partial(command_line.run, "report")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return record_ratings(tmp_path_factory.mktemp("data") / "data", 3)


def test_the_report_is_written(data, tmp_path):
    result = run(data, "--out", tmp_path / "new" / "report", "--bound", "1.3")
    assert result.exit_code == 0, result.output
    names = set(os.listdir(tmp_path / "new" / "report"))
    assert {"report.html", "report.md", "depth_rating.png", "depth_rating.pdf", "results.csv"} <= names
    assert not any(name.startswith("necker") for name in names)
    assert "factor of 1.3" in (tmp_path / "new" / "report" / "report.md").read_text(encoding="utf-8")
    assert result.stdout.splitlines()[-1].startswith("Done: open ")


def test_a_table_of_ones_own(tmp_path):
    file = tmp_path / "ratings.csv"
    rows = [f"{who};{stop};{focus};1,{who}" for who in (1, 2, 3) for stop in ("0", "5,6") for focus in ("vorn", "far")]
    file.write_text("\n".join(["subject;fstop;focus;resp", *rows]))
    columns = "participant=subject,aperture=fstop,fixation=focus,rating=resp"
    result = run(file, "--columns", columns, "--conditions", "vorn=nearest", "--out", tmp_path / "report")
    assert result.exit_code == 0, result.output
    assert {"headline.R", "depth_rating_trials.csv"} <= set(os.listdir(tmp_path / "report"))
    result = run(file, "--columns", "rating", "--out", tmp_path / "other")
    assert result.exit_code == 2
    assert "must be pairs such as participant=subject" in result.stderr


def test_an_effect_that_the_table_cannot_show_is_named(tmp_path):
    """Each picture shows one pupil, and is called a scene: no scene was rated at two pupils."""
    people = [(f"P{n}", "phone" if n < 3 else "laptop") for n in range(6)]
    rows = [
        f"{who},p{pupil}.png,{pupil},{device},{n + int(pupil)}"
        for n, (who, device) in enumerate(people)
        for pupil in "246"
    ]
    (tmp_path / "own.csv").write_text("\n".join(["participant,scene,pupil,device,rating", *rows]))
    result = run(tmp_path / "own.csv", "--by", "pupil", "--by", "device", "--out", tmp_path / "report")
    assert result.exit_code == 0, result.output
    said = "Note: Not tested: slope of log rating on pupil. Nobody rated a scene at two levels of pupil."
    assert said in result.stderr


def test_rules_and_a_preregistration(tmp_path):
    (tmp_path / "design.toml").write_text('task = "depthrating"\n')
    result = run(tmp_path / "design.toml", "--preregister", "--out", tmp_path / "plan")
    assert result.exit_code == 0, result.output
    assert set(os.listdir(tmp_path / "plan")) == {"preregistration.html", "preregistration.md", "rules.toml"}
    (tmp_path / "rules.toml").write_text("lapse = 3\n")
    result = run(tmp_path, "--rules", tmp_path / "rules.toml", "--out", tmp_path / "report")
    assert result.exit_code == 2
    assert "lapse is not a known rule" in result.stderr
