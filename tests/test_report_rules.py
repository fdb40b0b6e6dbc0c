"""Rules stated in advance, data of one's own, and what a report hands on: exclusions by file, trials, scripts, text."""

import csv
import io
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command_line import run, sentence
from recorded import record_ratings
from scipy import stats

from focalgradient import InputError
from focalgradient.design import NeckerDesign
from focalgradient.power import CubeModel, Study, quick_cube_power
from focalgradient.report import Stated, load_rules, make_report
from focalgradient.report.document import Heading, Notice, Paragraph, Table, as_html, as_markdown
from focalgradient.report.export import safe_csv
from focalgradient.report.preregister import preregistration
from focalgradient.report.rules import as_toml
from focalgradient.statistics import Rules, quality

pytestmark = pytest.mark.usefixtures("unrendered")


def test_rules_survive_their_file(tmp_path: Path) -> None:
    rules = Rules(response_time=None, dropped_frames=3, lapses=None, catch_factor=1.5)
    file = tmp_path / "rules.toml"
    file.write_text(as_toml(rules, 1.3))
    stated = load_rules(file)
    assert (stated.rules, stated.bound, stated.file) == (rules, 1.3, "rules.toml")
    assert len(stated.sha256) == 64
    assert Rules(dropped_frames=0).dropped_frames == 0


def test_the_report_goes_by_the_stated_rules_and_names_their_hash(tmp_path: Path) -> None:
    root = record_ratings(tmp_path / "data", 3)
    (tmp_path / "rules.toml").write_text("response_time = [1.6, 60]\nbound = 1.4\n")
    stated = load_rules(tmp_path / "rules.toml")
    made = make_report(root, stated=stated)
    text = made.files["report.html"].decode()
    assert stated.sha256 in text
    assert "in less than 1.6 s" in text
    assert "against a factor of 1.4" in text
    assert "leave out all 3 subjects" in text or "0 trials" in text
    assert b"response_time = [1.6, 60.0]" in made.files["rules.toml"]


def careful(seed: int, people: int, scene_sd: float) -> pd.DataFrame:
    """Careful people, and scenes that differ much in depth and in what blur adds."""
    rng = np.random.default_rng(seed)
    scenes = rng.normal(0, scene_sd, (12, 2))
    rows = [
        (f"{who:02}", f"s{scene}", f"f/{number}" if mm else "pinhole", mm, fixation, level + extra * mm / 9 + noise)
        for who in range(people)
        for scene, (level, extra) in enumerate(scenes)
        for number, mm in ((0, 0.0), (22, 2.3), (11, 4.5), (5.6, 8.9))
        for fixation in ("nearest", "farthest")
        for noise in rng.normal(0, 0.2, 2)
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "scene", "aperture", "aperture_mm", "fixation", "rating"])
    return table.assign(rating=np.exp(table["rating"]), trial=range(len(table)), catch=False)


@pytest.mark.parametrize(("people", "most"), [(1, 0.15), (4, 0.02), (12, 0.02)])
def test_careful_people_do_not_lapse_where_scenes_differ(people: int, most: float) -> None:
    """One person's scenes cannot be told from what blur adds to them; there the rule's own limit, .2, is kept."""
    for seed in range(4):
        _, found = quality(careful(seed, people, 0.8))
        assert max(each.lapses for each in found.subjects) < most


def test_those_who_lapse_are_found_where_scenes_differ() -> None:
    table = careful(1, 6, 0.8)
    rng = np.random.default_rng(1)
    guessed = (table["participant_id"] == "03") & (rng.random(len(table)) < 0.7)
    table.loc[guessed, "rating"] = np.exp(rng.uniform(-2.5, 2.5, guessed.sum()))
    _, found = quality(table, Rules(repeat_factor=None))
    assert {each.participant_id for each in found.exclusions} == {"03"}


def test_a_table_of_ones_own_reports_on_the_cube_has_a_report(tmp_path: Path) -> None:
    """Shares of .2 without a gradient, .2 + own shift with one: the t-test of log odds, half a report (10 s) added."""
    shifts = [0.05, 0.1, 0.2, 0.15, 0.1]
    log_odds = [np.log((40 * share + 10) / (40 * (1 - share) + 10)) for share in (0.2, *(0.2 + np.array(shifts)))]
    changes = np.array(log_odds[1:]) - log_odds[0]
    rows = [
        f"{who},{trial},{blur},{seen},{lasts}"
        for who, shift in enumerate(shifts)
        for trial, (blur, share) in enumerate([("none", 0.2), ("nonrigid", 0.2 + shift)])
        for seen, lasts in (("rigid", 40 * (1 - share)), ("nonrigid", 40 * share))
    ]
    file = tmp_path / "cube.csv"
    file.write_text("\n".join(["who,trial,blur,seen,seconds", *rows]))
    names = {"participant": "who", "gradient": "blur", "percept": "seen", "duration": "seconds"}
    made = make_report(file, columns=names)
    wide = pd.read_csv(io.BytesIO(made.files["necker_wide.csv"]))
    assert (wide["nonrigid 1"] - wide["none 0"]).to_numpy() == pytest.approx(changes)
    found = stats.ttest_1samp(changes, 0)
    text = made.files["report.md"].decode()
    assert f"t(4)\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}{found.statistic:.2f}" in text
    assert "No strength column" in text
    assert b"wilcox.test" not in made.files["necker_headline.R"]
    assert len(pd.read_csv(io.BytesIO(made.files["necker_reports.csv"]))) == 20
    with pytest.raises(
        InputError, match=r"scale is for depth ratings by aperture and fixation, but cube\.csv contains reports on"
    ):
        make_report(file, columns=names, scale="ordinal")
    columns = ",".join(f"{ours}={theirs}" for ours, theirs in names.items())
    refused = run("report", file, "--out", tmp_path / "out", "--bound", "1.2", "--columns", columns)
    assert "--bound is for depth ratings" in sentence(refused)


def test_cells_are_no_formulas() -> None:
    names = ["=1+1", "+a", "-b", "@c", "plain"]
    text = safe_csv(pd.DataFrame({"name": names, "value": [-1.0] * 5})).decode()
    rows = list(csv.reader(io.StringIO(text)))[1:]
    assert [row[0] for row in rows] == ["'=1+1", "'+a", "'-b", "'@c", "plain"]
    assert [row[1] for row in rows] == ["-1.0"] * 5


def test_nothing_in_a_data_set_becomes_markup() -> None:
    bad = "<script>alert(1)</script> [x](javascript:1) `a` | *b* &lt;i&gt;\n# head"
    blocks = [Heading(bad), Paragraph(bad), Notice(bad), Table(bad, [bad], [[bad]], [bad])]
    for text in (as_markdown(bad, blocks), as_html(bad, blocks)):
        assert "<script" not in text
        assert "<i>" not in text
    markdown = as_markdown(bad, blocks)
    assert not re.search(r"(?<!\\)\]\(javascript", markdown)
    assert "\n# head" not in markdown


@pytest.mark.slow
def test_power_of_the_cube_from_a_pool_is_that_of_whole_experiments() -> None:
    """40 experiments through the whole chain know a power near one half to .08, one standard error."""
    study = Study(CubeModel(effect=2.0), NeckerDesign(strengths_mm=(4.0,), repetitions=1))
    whole = [study.experiment(8, number) for number in range(40)]
    quick = quick_cube_power(study, [8], people=300)[8]
    for test in study.tests:
        assert quick[test] == pytest.approx(np.mean([each[test] for each in whole]), abs=0.25)


def test_a_bound_of_0_is_refused_and_not_taken_for_none_given(tmp_path):
    file = tmp_path / "own.csv"
    file.write_text("subject,fstop,focus,resp\nA,5.6,near,1.4\nA,0,near,1\nB,5.6,near,1.5\nB,0,near,1.1\n")
    (tmp_path / "design.toml").write_text('task = "depthrating"\n')
    with pytest.raises(InputError, match=r"is 0\.0, but must be a ratio above 1"):
        make_report(file, bound=0.0)
    with pytest.raises(InputError, match=r"bound is 0\.0, but must be a ratio above 1"):
        preregistration(tmp_path / "design.toml", bound=0.0, stated=Stated(Rules()))


SKEWED = (0.5, 0.45, 0.55, 0.5, 0.48, 0.52, 0.47, -0.3)
"""Log rises of eight people, one of them far from the others: Student's t and the bootstrap-t disagree about them."""


@pytest.mark.parametrize("skewed", [True, False])
def test_the_report_says_where_the_sensitivity_analysis_disagrees(tmp_path: Path, skewed: bool) -> None:
    rng = np.random.default_rng(5)
    rises = SKEWED if skewed else [abs(rise) for rise in SKEWED]
    rows = [
        (f"{who:02}", scene, aperture, focus, np.exp(rise * blurred * (focus == "nearest") + rng.normal(0, 0.05)))
        for who, rise in enumerate(rises)
        for scene in "abcdef"
        for aperture, blurred in (("pinhole", 0), ("f/5.6", 1))
        for focus in ("nearest", "farthest")
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "scene", "aperture", "fixation", "rating"])
    table.to_csv(tmp_path / "own.csv", index=False)
    files = make_report(tmp_path / "own.csv", focal_length_mm=50).files
    near = pd.read_csv(io.BytesIO(files["results.csv"])).iloc[0]
    text = files["report.md"].decode().replace("\u202f", " ").replace("\u00a0", " ")
    finding = next(line for line in text.splitlines() if line.startswith("Primary outcome"))
    assert near["p"] < 0.05  # the primary test decides either way
    assert "nearest object in focus, ratings rose" in finding
    above, folded = text.split("<summary>Checks and further tables</summary>")
    said = next(line for line in text.splitlines() if line.startswith("Sensitivity: bootstrap-t over subjects, for"))
    assert ("It disagrees, and the test above decides" in said) == skewed
    assert ("it agrees." in said) == (not skewed)
    assert said in (above if skewed else folded)
    assert text.count("Sensitivity: bootstrap-t") == 1
    assert "deciding_test" not in files["rules.toml"].decode()
