"""The report of a data set: its numbers are those of the analysis, it holds all it needs, and says what it lacks."""

import hashlib
import html
import io
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text
from recorded import rating_file, record_necker, record_ratings
from test_scales import design_of, record

from focalgradient.dataset import Noted
from focalgradient.plotting.residuals import residual_figure
from focalgradient.plotting.subjects import depth_rating_figure, necker_figure
from focalgradient.power import Model
from focalgradient.report import analyse_necker, analyse_ratings, analyse_table, make_report
from focalgradient.report.document import Paragraph
from focalgradient.report.export import trial_files
from focalgradient.report.parts import Output
from focalgradient.report.ratings import gaze_blocks
from focalgradient.report.tables import EFFECTS
from focalgradient.statistics import DepthRatingResult, NotComputed, depth_rating
from focalgradient.statistics.questions import COLUMNS
from focalgradient.statistics.residuals import rating_residuals


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp("data") / "data"
    return record_necker(record_ratings(root, 6), 6)


@pytest.fixture(scope="module")
def made(data):
    with pytest.MonkeyPatch.context() as unrendered:
        unrendered.setattr("focalgradient.report.parts.as_files", lambda figure: {"png": b"\x89PNG", "pdf": b"%PDF"})
        return make_report(data, bound=1.25)


@pytest.fixture(scope="module")
def ratings(data):
    return analyse_ratings(data, bound=1.25)


@pytest.fixture(scope="module")
def cube(data):
    with pytest.MonkeyPatch.context() as unfitted:
        unfitted.setattr(
            "focalgradient.statistics.cube.fit_dominance", lambda data: NotComputed("not fitted")
        )  # slow, and not looked at
        return analyse_necker(data)


def table(made, name: str) -> pd.DataFrame:
    return pd.read_csv(io.BytesIO(made.files[name]))


def page(made) -> str:
    """The page without the marks of its symbols."""
    html = made.files["report.html"].decode().replace("\N{NO-BREAK SPACE}", " ")
    return re.sub("</?(?:i|sub)>", "", html)


def test_every_table_is_there_with_the_numbers_of_the_analysis(ratings, cube, made):
    assert not any("observers" in name for name in made.files)  # on demand
    result = ratings.result
    results = table(made, "results.csv").drop_duplicates(["name", "level"]).set_index(["name", "level"])
    near, far = (each.rise for each in result.fixations)
    assert near.p_holm is None
    assert pd.isna(results.loc[("depth effect", "nearest"), "p_corrected"])
    assert results.loc[("depth effect", "farthest"), "p_corrected"] == far.p_holm > far.p
    assert results.loc[("depth effect", "nearest"), "effect_low"] == near.dz_interval.low
    for mean in result.means:
        assert results.loc[("mean rating", f"{mean.fixation}, {mean.aperture}"), "estimate"] == mean.rating.estimate
    assert "bound 0.223144, 90 %" in results.loc[("equivalence to zero", "nearest"), "method"]
    assert len(table(made, "depth_rating_subjects.csv")) == 6 * 8
    odds = table(made, "results.csv").query("name == 'log odds of the nonrigid reading'")
    assert odds["p"].tolist() == [effect.odds_of_time.p for effect in cube.result.effects]
    assert len(table(made, "necker_durations.csv")) == 6
    assert len(table(made, "necker_durations_of_people.csv")) == 2
    assert f"t(5) = {near.statistic:.2f}" in page(made)


def test_the_page_is_whole_and_needs_nothing_else(made, data):
    text = made.files["report.html"].decode()
    assert hashlib.sha256(rating_file(data, "03").read_bytes()).hexdigest() in text
    assert str(data) not in text
    sources, open_tags = [], []

    class Reader(HTMLParser):
        def handle_starttag(self, tag, attributes):
            sources.extend(value for name, value in attributes if name in ("src", "href", "srcset"))
            if tag not in ("meta", "img"):
                open_tags.append(tag)

        def handle_endtag(self, tag):
            assert open_tags.pop() == tag

    Reader().feed(text)
    assert not open_tags
    pictures = [source for source in sources if not source.startswith("#")]
    assert len(pictures) == 4
    assert all(source.startswith("data:image/png;base64,") for source in pictures)
    assert not re.search(r"https?://|url\(|@import|<script|<link", text)


def test_simulated_observers_are_said_to_be_in_page_and_pictures(made, cube):
    assert "Simulated observers, not people" in page(made)
    assert cube.simulated
    for simulated in (True, False):
        texts = {text.get_text() for text in necker_figure(cube.result, simulated=simulated).findobj(Text)}
        assert ("simulated observers" in texts) == simulated


@pytest.mark.usefixtures("unrendered")
def test_people_are_not_called_simulated(tmp_path):
    text = page(make_report(record_ratings(tmp_path / "data", 2, kind="human")))
    assert "imulated" not in text.split("<h2>Provenance")[0]


def test_every_subject_and_the_mean_are_drawn(ratings):
    result = ratings.result
    (ax,) = depth_rating_figure(result, simulated=True).axes
    heights = [tuple(line.get_ydata()) for line in ax.lines]
    for fixation in ("nearest", "farthest"):
        for who in result.participants:
            own = [m.ratio for m in result.subject_means if (m.participant_id, m.fixation) == (who, fixation)]
            assert tuple(own) in heights
        mean = [m.ratio.estimate for m in result.means if m.fixation == fixation]
        assert tuple(mean) in heights
    assert ax.get_yscale() == "log"  # of ratios


def rated(near: float, far: float) -> DepthRatingResult:
    """Twelve people whose log rating grows to `near` or `far` with the aperture, alike to a few per cent."""
    rng = np.random.default_rng(4)
    rows = [
        (f"sub-{who:02}", fixation, f"f/{16 / mm:g}" if mm else "pinhole", mm, scene, own * mm / 8)
        for who in range(12)
        for fixation, rise in (("nearest", near), ("farthest", far))
        for own in [rise + 0.02 * rng.standard_normal()]
        for mm in (0.0, 2.0, 4.0, 8.0)
        for scene in ("a", "b")
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "fixation", "aperture", "aperture_mm", "scene", "rating"])
    table["rating"] = np.exp(table["rating"] + 0.02 * rng.standard_normal(len(table)))
    return depth_rating(table.assign(trial=range(len(table)), catch=False), equivalence_bound=1.2)


LESS = "ratings rose, by less than what would matter: the depth effect is equivalent to zero within a factor"


@pytest.mark.parametrize(
    ("near", "far", "at", "said"),
    [
        (0.7, 0.0, 0, "ratings rose from the pinhole"),
        (-0.7, 0.0, 0, "ratings fell from the pinhole"),
        (0.0, 0.0, 0, "ratings were not shown to change from the pinhole"),
        (0.7, 0.0, 1, "the depth effect is equivalent to zero within a factor of 1.20"),
        (0.7, 0.08, 1, LESS),
        (0.7, 0.7, 1, "ratings rose from the pinhole"),
    ],
)
def test_a_finding_says_direction_and_equivalence(near: float, far: float, at: int, said: str) -> None:
    sentences = rated(near, far).answers.sentences(*EFFECTS)
    assert said in sentences[at]
    assert ("equivalent" in sentences[at]) == ("equivalent" in said)
    assert ("were not shown to differ" in sentences[2]) == (near == far)


def visible(page: str) -> str:
    """Return the words of a page that no folded section hides."""
    body = page[page.index("<body>") :]
    while (less := re.sub(r"<details>(?:(?!<details>).)*?</details>", "", body, flags=re.DOTALL)) != body:
        body = less
    return html.unescape(re.sub(r"<[^>]*>", "", body))


@pytest.mark.usefixtures("unrendered")
def test_a_report_on_twelve_people_answers_first_and_is_short_above_the_folds(tmp_path: Path) -> None:
    report = make_report(record_ratings(tmp_path / "data", 12, Model(effect=1.6)))
    shown = visible(report.files["report.html"].decode())
    assert 300 < len(shown.split()) <= 1200
    answers = shown[shown.index("Primary outcome.") : shown.index("12 subjects with")].strip().split("\n")
    assert [len(re.findall(r"\bp\s[=<]", answer)) for answer in answers] == [1, 1, 1]
    assert "Main results with and without exclusions" not in report.files["report.html"].decode()
    found = pd.read_csv(io.BytesIO(report.files["results.csv"]))
    sensitivity = found[found["name"] == "depth effect, bootstrap-t"]
    assert sensitivity["method"].tolist() == ["bootstrap-t over subjects"]
    assert (sensitivity["low"] < sensitivity["estimate"]).all()
    assert (sensitivity["p"] < 0.05).all()


def test_findings_without_trials_that_left_are_beside_how_many_there_were(ratings) -> None:
    table = ratings.table.reset_index(drop=True).assign(gaze_left=False, gaze_away=0.5)
    shown = table.index[~table["catch"]]
    table.loc[shown[:3], ["gaze_left", "gaze_away"]] = [[True, 4.0], [True, 6.0], [True, np.nan]]
    table.loc[table.index[table["catch"]][0], "gaze_left"] = True  # of a catch trial: not counted
    output = Output()
    blocks = list(gaze_blocks(analyse_table(table, bound=1.25, data=ratings.data), output))
    sentences = [block.text for block in blocks if isinstance(block, Paragraph)]
    assert sentences[0].startswith(f"In 3 of {len(shown):,} trials a fixation of the eyes was more than ")
    without = ratings.table[~table["gaze_left"].to_numpy()]
    findings = analyse_table(without, bound=1.25, data=ratings.data).result.answers.sentences(*EFFECTS)
    assert sentences[1:] == [f"Without those trials: {findings[0]}", *findings[1:]]
    each = len(shown) // 6
    rows = output.sheets[0].digits.to_numpy().tolist()
    assert rows[:2] == [["sub-01", each, 3, 1, 0.5], ["sub-02", each, 0, 0, 0.5]]


@pytest.mark.usefixtures("unrendered")
def test_a_cube_without_gradients_is_described(tmp_path: Path) -> None:
    lines = [
        f"{who},1,{onset},{lasts},{percept},20,none"
        for who, rigid in (("A", 9), ("B", 10))
        for onset, lasts, percept in ((0, rigid, "rigid"), (rigid, 20 - rigid, "nonrigid"))
    ]
    head = "subject,trial,onset,duration,percept,trial_duration,gradient"
    (tmp_path / "own.csv").write_text("\n".join([head, *lines]) + "\n")
    made = make_report(tmp_path / "own.csv")
    assert "No trial had a gradient of blur: nothing was compared." in made.files["report.md"].decode()
    assert "with its lines sharp. The data are a table" in made.files["report.md"].decode()
    shares = table(made, "results.csv").query("name == 'share of the time'").set_index("level")
    assert shares.loc["none gradient, 0 mm, rigid", "estimate"] == pytest.approx(9.5 / 20)


def wide_table(trials: pd.DataFrame) -> pd.DataFrame:
    files = trial_files(trials, trials, depth_rating(trials, equivalence_bound=1.2))
    return pd.read_csv(io.BytesIO(files["depth_rating_wide.csv"]))


def test_the_wide_table_has_log_ratios_of_the_ends_by_subject_and_scene() -> None:
    """By hand: a middle aperture counts for nothing, repetitions are averaged on their logarithm."""
    rows = [
        ("01", "a", "nearest", 0.0, 1.0),
        ("01", "a", "nearest", 4.0, 9.0),
        ("01", "a", "nearest", 8.0, 2.0),
        ("01", "a", "nearest", 8.0, 8.0),
        ("01", "a", "farthest", 0.0, 2.0),
        ("01", "a", "farthest", 4.0, 5.0),
        ("01", "a", "farthest", 8.0, 1.0),
    ]
    names = ["participant_id", "scene", "fixation", "aperture_mm", "rating"]
    table = pd.DataFrame(rows, columns=names).assign(catch=False, trial=range(1, len(rows) + 1))
    table["aperture"] = table["aperture_mm"].map({0.0: "pinhole", 4.0: "f/4", 8.0: "f/2"})
    wide = wide_table(table)
    assert wide.loc[0, ["nearest", "farthest", "difference"]].tolist() == pytest.approx(np.log([4.0, 0.5, 8.0]))
    # without a pinhole nothing is compared with it
    without = wide_table(table.query("fixation == 'nearest' or aperture_mm > 0"))
    assert list(without) == ["participant_id", "scene", "nearest"]


def test_a_report_has_all_numbers_as_one_table_and_truth_as_r_reads_it(made):
    results = pd.read_csv(io.BytesIO(made.files["results.csv"]))
    assert list(results) == list(COLUMNS)
    trials = made.files["depth_rating_trials.csv"].decode().splitlines()
    at = trials[0].split(",").index("catch")
    assert {row.split(",")[at] for row in trials[1:]} == {"TRUE", "FALSE"}
    types = re.findall(r'"(\w+)"', made.files["read_depth_rating_trials.R"].decode().split("colClasses")[1])
    assert types[at] == "logical"
    assert len(types) == len(trials[0].split(","))


def test_normal_quantiles_and_residuals_are_drawn(ratings):
    part = ratings
    found = rating_residuals(part.main.answers, part.kept)
    for one, fixation in zip(found, part.result.fixations, strict=True):
        assert one.subjects.mean() == pytest.approx(fixation.rise.estimate)
        assert one.residual.mean() == pytest.approx(0, abs=1e-9)
        assert one.what.startswith("log ratio")
    quantiles = residual_figure(found, simulated=True).axes[0]
    np.testing.assert_array_equal(quantiles.lines[-1].get_ydata(), np.sort(found[0].subjects))


@pytest.mark.usefixtures("unrendered")
def test_exported_trials_have_every_column_of_the_data_set_with_its_description(tmp_path: Path) -> None:
    light = {"light": {"levels": ["dim", "bright"]}}
    root = record(
        tmp_path / "data",
        design_of(factors=light, confidence=True),
        3,
        confidence=0.5,
        extra={"effort": Noted(2.0, unit="points", description="How hard it was.")},
    )
    files = make_report(root).files
    table = pd.read_csv(io.BytesIO(files["depth_rating_trials.csv"]), dtype={"participant_id": str})
    assert {"light", "confidence", "effort", "start", "standard_before", "included"} <= set(table)
    assert set(table["light"]) == {"dim", "bright"}
    about = pd.read_csv(io.BytesIO(files["depth_rating_trials_dictionary.csv"])).set_index("column")["meaning"]
    assert list(about.index) == list(table)
    assert about["effort"] == "How hard it was (points)."
