"""Records of published experiments: what each must state, the rule that scores predictions, and what is asked."""

import csv
import dataclasses
import io
import math
import re
from pathlib import Path

import pytest

from focalgradient import InputError
from focalgradient.observers import OBSERVERS, Observer, blur_threshold
from focalgradient.published import EXPERIMENTS, Finding, Prediction, Row, csv_of, markdown, simulate
from focalgradient.published.ask import blurred_nearer, detection, discrimination, gain_ratio
from focalgradient.stimuli import PAPERS

ROOT = Path(__file__).parents[2]
BIBLIOGRAPHY = (ROOT / "docs" / "references.bib").read_text(encoding="utf-8")
THRESHOLDS = ("watson2011", "wang2005", "jacobs1989", "maiello2017")
FINDING = Finding(quantity="a", units="1", printed="1 to 2", low=1, high=2, source="memory", remark="an example")


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
        (1.5, 0.26, "differs"),
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
    assert scores == ["agrees", "differs", "differs"]
    assert falls.score(None) == "cannot be asked"


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"low": 2.0}, "range 2 to 2"),
        ({"low": -math.inf, "high": math.inf}, "range -inf to inf"),
        ({"low": math.nan}, "range nan to 2"),
        ({"quantity": " "}, "quantity is empty"),
        ({"printed": ""}, "printed is empty"),
        ({"source": "hearsay"}, "source is 'hearsay'"),
        ({"remark": ""}, "no way to ask"),
        ({"ask": 3}, "cannot be called"),
    ],
)
def test_a_finding_that_does_not_state_all_is_refused(changed: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        dataclasses.replace(FINDING, **changed)  # type: ignore[arg-type]


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


def test_who_is_asked_is_checked() -> None:
    with pytest.raises(InputError, match="observer is of the class str"):
        simulate(EXPERIMENTS["jacobs1989"], "default")  # type: ignore[arg-type]


def test_defocus_becomes_blur_through_the_observers_pupil() -> None:
    """The threshold in arcmin, turned into dioptres twice over: a pupil twice as wide needs half the defocus."""
    narrow, wide = Observer(pupil=0.003), Observer(pupil=0.006)
    assert detection(narrow).value == pytest.approx(2 * detection(wide).value)
    by_hand = math.radians(blur_threshold(0.0, narrow) / 60) / 0.55 / 0.0015
    assert detection(narrow).value == pytest.approx(by_hand)
    assert discrimination(narrow, 1000.0).value == pytest.approx(narrow.weber * 1000, rel=1e-3)


def test_what_cannot_be_asked_has_no_prediction() -> None:
    predicted = simulate(EXPERIMENTS["held2012"], OBSERVERS["default"])
    assert set(predicted.values()) == {None}


def test_the_table_states_that_predictions_are_simulated() -> None:
    experiment = EXPERIMENTS["jacobs1989"]
    predicted = simulate(experiment, OBSERVERS["default"])
    rows = [Row(experiment, one, predicted[one.quantity]) for one in experiment.findings]
    read = list(csv.DictReader(io.StringIO(csv_of(rows))))
    assert [row["score"] for row in read] == [row.score for row in rows]
    assert float(read[0]["predicted (simulated)"]) == pytest.approx(detection(OBSERVERS["default"]).value, rel=1e-3)
    assert "| simulated |" in markdown(rows).splitlines()[0]


@pytest.mark.slow
def test_a_sharp_border_puts_the_sharp_side_in_front_unless_blur_means_nothing() -> None:
    shares = {name: blurred_nearer(OBSERVERS[name], "mather1996", "sharp").value for name in ("default", "opposite")}
    assert shares["default"] < min(0.2, shares["opposite"])
    assert blurred_nearer(OBSERVERS["blur-blind"], "mather1996", "sharp").value == pytest.approx(0.5, abs=0.01)


@pytest.mark.slow
def test_white_against_itself_is_one() -> None:
    assert gain_ratio(OBSERVERS["default"], "white") == Prediction(1.0)


def documented() -> list[list[str]]:
    """Cells of the table of the documents, without its head."""
    lines = (ROOT / "docs" / "published.md").read_text(encoding="utf-8").splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| ")][1:]


def test_the_documents_print_the_records() -> None:
    rows = [Row(experiment, one, None) for experiment in EXPERIMENTS.values() for one in experiment.findings]
    printed = [[cell.strip() for cell in line.strip("|").split("|")] for line in markdown(rows).splitlines()[2:]]
    assert [cells[:5] for cells in documented()] == [cells[:5] for cells in printed]
    asked = [cells[6] != "cannot be asked" for cells in documented()]
    assert asked == [row.finding.ask is not None for row in rows]


@pytest.mark.parametrize("key", THRESHOLDS)
def test_the_documents_print_the_thresholds_that_are_simulated(key: str) -> None:
    experiment = EXPERIMENTS[key]
    predicted = simulate(experiment, OBSERVERS["default"])
    rows = [Row(experiment, one, predicted[one.quantity]) for one in experiment.findings]
    printed = [cells[5:] for cells in documented() if cells[0] == experiment.citation]
    assert printed == [[row.stated, row.score] for row in rows]


@pytest.mark.slow
@pytest.mark.parametrize("key", ["mather1996", "mather2002", "marshall1996"])
def test_the_documents_print_the_scores_of_order_at_a_border(key: str) -> None:
    experiment = EXPERIMENTS[key]
    predicted = simulate(experiment, OBSERVERS["default"])
    scores = [one.score(predicted[one.quantity]) for one in experiment.findings]
    assert [cells[6] for cells in documented() if cells[0] == experiment.citation] == scores
