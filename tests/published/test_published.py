"""Records of published experiments: what each must state, the rule that scores predictions, and what is asked."""

import csv
import dataclasses
import io
import json
import math
import re
import tomllib
from functools import partial
from pathlib import Path

import pytest

from focalgradient import InputError
from focalgradient.dataset import validate
from focalgradient.design import check_design
from focalgradient.design.words import load_words
from focalgradient.observers import OBSERVERS, Observer, blur_threshold
from focalgradient.observers import simulate as observe
from focalgradient.published import EXPERIMENTS, Finding, Prediction
from focalgradient.published.asked import ASKED
from focalgradient.published.following import against_white, gain_of_mean, phase_of_mean, responses
from focalgradient.published.task import PublishedDesign
from focalgradient.published.thresholds import blur_over_disparity, blur_weight_change, detection, discrimination
from focalgradient.stimuli import PAPERS
from focalgradient.tasks import task_named

ROOT = Path(__file__).parents[2]
BIBLIOGRAPHY = (ROOT / "docs" / "references.bib").read_text(encoding="utf-8")
FINDING = Finding(quantity="a", units="1", printed="1 to 2", low=1, high=2, source="abstract", remark="an example")


@pytest.mark.parametrize("key", EXPERIMENTS)
def test_each_experiment_stands_in_the_bibliography_and_its_conditions_can_be_drawn(key: str) -> None:
    experiment = EXPERIMENTS[key]
    assert experiment.key == key
    assert f"{{{key.partition('-')[0]}," in BIBLIOGRAPHY
    assert key not in PAPERS or experiment.conditions == tuple(PAPERS[key].conditions)
    assert all(one.ask is not None or one.remark.endswith(".") for one in experiment.findings)


def test_a_printed_range_agrees_with_the_range_of_agreement() -> None:
    for experiment in EXPERIMENTS.values():
        for one in experiment.findings:
            mean = re.fullmatch(r"([\d.]+) \+- ([\d.]+) \(SEM\)", one.printed)
            ends = re.fullmatch(r"([\d.]+) to ([\d.]+)", one.printed)
            if mean:
                value, error = map(float, mean.groups())
                assert (one.low, one.high) == pytest.approx((value - 2 * error, value + 2 * error))
            elif ends:
                assert (one.low, one.high) == tuple(map(float, ends.groups()))


@pytest.mark.parametrize(
    ("value", "error", "score"),
    [
        (1.5, 0.0, "agrees"),
        (1.5, 0.2, "agrees"),
        (1.5, 0.26, "undecided"),
        (0.9, 0.06, "undecided"),
        (0.9, 0.05, "differs"),
        (2.5, 0.2, "differs"),
        (1.0, 0.0, "differs"),
        (2.1, 0.0, "differs"),
        (0.5, 0.0, "differs"),
    ],
)
def test_the_rule(value: float, error: float, score: str) -> None:
    assert FINDING.score(Prediction(value, error)) == score


def test_a_direction_needs_the_prediction_clear_of_no_effect() -> None:
    falls = dataclasses.replace(FINDING, low=-math.inf, high=1.0)
    scores = [falls.score(Prediction(value, error)) for value, error in ((0.9, 0.04), (0.9, 0.06), (1.0, 0.0))]
    assert scores == ["agrees", "undecided", "differs"]
    assert falls.score(None) == "cannot be asked"


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"design": "A design"}, "full stop"),
        ({"doi": "doi:10.1"}, "must begin with 10"),
        ({"conditions": ()}, "needs conditions"),
        ({"findings": (FINDING, FINDING)}, "different names"),
        ({"key": ""}, "key is empty"),
    ],
)
def test_an_experiment_that_does_not_state_all_is_refused(changed: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        dataclasses.replace(EXPERIMENTS["jacobs1989"], **changed)  # type: ignore[arg-type]


def test_defocus_becomes_blur_through_the_observers_pupil() -> None:
    """The threshold in arcmin, turned into dioptres twice over: a pupil twice as wide needs half the defocus."""
    narrow, wide = Observer(pupil=0.003), Observer(pupil=0.006)
    assert detection(narrow).value == pytest.approx(2 * detection(wide).value)
    by_hand = math.radians(blur_threshold(0.0, narrow) / 60) / 0.55 / 0.0015
    assert detection(narrow).value == pytest.approx(by_hand)
    assert discrimination(narrow, 1000.0).value == pytest.approx(narrow.weber * 1000, rel=1e-3)


def test_blur_beside_disparity_by_hand() -> None:
    observer = Observer(stereo=1.0)
    by_disparity = math.radians(1 / 60) / 0.063
    assert blur_over_disparity(observer, 1.0).value == pytest.approx(discrimination(observer, 1.0).value / by_disparity)
    assert blur_weight_change(observer).value < 0
    assert blur_over_disparity(observer, 0.0).value > blur_over_disparity(Observer(stereo=2.0), 0.0).value


@pytest.mark.slow
def test_white_against_itself_is_one() -> None:
    assert against_white(OBSERVERS["default"], gain_of_mean, "white", pairs=2) == Prediction(1.0)


def test_pairs_of_trials_are_kept_and_read_again(tmp_path: Path) -> None:
    """A file that stands in the folder is read, so that a run goes on; the jackknife leaves out one pair."""
    for light, values in (("white", (1.0, 3.0)), ("neutralised", (0.5j, 0.5j))):
        for seed, value in enumerate(values):
            about = {"real": complex(value).real, "imaginary": complex(value).imag}
            (tmp_path / f"{light}-4mm-6s-{seed}.json").write_text(json.dumps(about), encoding="utf-8")
    assert responses(0.004, "white", 2, 6.0, tmp_path).tolist() == [1, 3]
    gain = against_white(OBSERVERS["default"], gain_of_mean, "neutralised", 2, tmp_path)
    left_out = (0.5 / 3, 0.5 / 1)
    assert gain.value == pytest.approx(0.25)
    assert gain.standard_error == pytest.approx(abs(left_out[0] - left_out[1]) / 2)
    phase = against_white(OBSERVERS["default"], phase_of_mean, "neutralised", 2, tmp_path)
    assert (phase.value, phase.standard_error) == (pytest.approx(90), pytest.approx(0))


@pytest.mark.parametrize("key", EXPERIMENTS)
def test_each_experiment_has_a_design_or_names_what_it_needs(key: str) -> None:
    experiment = EXPERIMENTS[key]
    if experiment.needs:
        with pytest.raises(InputError, match=experiment.needs.split()[-1]):
            experiment.design_text()
        return
    design = check_design(key, tomllib.loads(experiment.design_text()))
    assert design.trials("01")
    if isinstance(design, PublishedDesign):
        assert design.experiment == key
        assert {trial.condition_name for trial in design.trials("01") if trial.phase == "main"} == {
            *design.asked.conditions
        }


@pytest.mark.parametrize("key", ASKED)
def test_an_answer_means_what_its_column_says(key: str) -> None:
    """The right side, interval or quadrant is 1, all others 0; a distance stays as it is."""
    asked = ASKED[key]
    task = task_named("published")
    text = partial(task.text, load_words("en"))
    given = asked.control(text).reached()
    for condition in asked.conditions:
        for place in asked.places:
            values = [asked.value(condition, place, one) for one in given]
            assert values == given if asked.is_ratio else sorted(values) == [0.0] * (len(given) - 1) + [1.0]


@pytest.mark.slow
def test_simulated_answers_are_recorded_as_those_of_people(tmp_path: Path) -> None:
    design = check_design("own", tomllib.loads(EXPERIMENTS["mather1996"].design_text() + "repetitions = 1\n"))
    assert observe(design, tmp_path / "data", observers=1, seed=3) == 1
    found = validate(tmp_path / "data")
    assert (found.sessions, found.problems) == (1, ())
    (table,) = (tmp_path / "data").rglob("sub-01_task-published_*.tsv")
    rows = list(csv.DictReader(io.StringIO(table.read_text(encoding="utf-8")), delimiter="\t"))
    assert {row["condition_name"] for row in rows} == set(EXPERIMENTS["mather1996"].conditions)
    assert {float(row["answer"]) for row in rows} <= {0.0, 1.0}
