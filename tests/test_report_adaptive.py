"""Reports, preregistrations and power of a task whose level a procedure sets: thresholds, not proportions correct."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pytest

from focalgradient.cli.power import _notes
from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Trial, answers_of, weighted_staircase
from focalgradient.errors import InputError
from focalgradient.observers import simulate
from focalgradient.power import Observers, Study
from focalgradient.power.own_tasks import _people
from focalgradient.report import Report, Stated, make_report
from focalgradient.report.conditions import task_plan
from focalgradient.report.parts import Asked
from focalgradient.report.preregister import preregister_conditions
from focalgradient.scales import Steps, Ways
from focalgradient.statistics import Rules
from focalgradient.tasks import Task, check_task, register, task_named
from focalgradient.tasks.adaptive import guessed

pytestmark = pytest.mark.usefixtures("unrendered")

STAIRCASE = weighted_staircase(0.75, 30.0, 1.0, 60.0)
TRUE = {0.05: 10.0, 0.5: 5.0}  # level (%) of 75 % correct at each contrast: their ratio is 2


@dataclass(frozen=True, slots=True, kw_only=True)
class FinerTrial(Trial):
    contrast: float = field(metadata={"about": "Contrast.", "least": 0, "most": 1})
    interval: Literal[1, 2] = field(metadata={"about": "Interval of the finer grating."})
    level: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FinerAnswer(Response):
    level: float = field(metadata={"about": "Difference.", "units": "%", "above": 0})
    correct: bool = field(metadata={"about": "Whether the finer grating was chosen."})


class FinerDesign(Counterbalanced):
    task: str = "finer"
    repetitions: int = 15

    def trials(self, participant, session=None):
        shown = [FinerTrial(contrast=one, interval=half) for one in TRUE for half in (1, 2)]
        return self.ordered(participant, session, shown)


@register
class Finer(Task):
    """Choose the interval with the finer grating."""

    name = "finer"
    title = "Finer of two gratings"
    design, trial, answer = FinerDesign, FinerTrial, FinerAnswer
    ratios = frozenset({"level"})

    def adapted(self, design, trial, recorded):
        return replace(trial, level=STAIRCASE.level(answers_of(recorded, contrast=trial.contrast)))

    def shown(self, design, trial, pixels_per_degree):
        return [(np.full((8, 8), 127, np.uint8), 0.25)] * 2

    def control(self, words, trial):
        return Ways("Which was finer?", ("the first", "the second"))

    def answered(self, design, trial, value, **times):
        return FinerAnswer(level=trial.level, correct=int(value) == trial.interval, **times)

    def simulated(self, design, trial, observer, chance):
        detected = 1 - 0.5 ** ((trial.level / TRUE[trial.contrast]) ** 2)
        right = bool(chance.random() < 0.5 + 0.49 * detected)
        return FinerAnswer(onset=0.0, response_time=0.8, level=trial.level, correct=right)


class Seen(Finer):
    """Say whether the grating was seen."""

    name = "finerseen"

    def answered(self, design, trial, value, **times):
        return FinerAnswer(level=trial.level, correct=int(value) == 1, **times)


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedTrial(Trial):
    contrast: float
    interval: Literal[1, 2]
    finer_by: float = field(metadata={"units": "%"})


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedAnswer(Response):
    chosen: int
    sure: int
    correct: bool


class ListedDesign(Counterbalanced):
    task: str = "finerlisted"
    repetitions: int = 3

    def trials(self, participant, session=None):
        shown = [(contrast, half, by) for contrast in TRUE for half in (1, 2) for by in (2.0, 5.0, 12.5)]
        names = "contrast", "interval", "finer_by"
        listed = [ListedTrial(**dict(zip(names, one, strict=True))) for one in shown]
        return self.ordered(participant, session, listed)


@register
class Listed(Finer):
    """The same with constant stimuli, whose level is a field of the trial alone; 1 and 4 are sure answers."""

    name = "finerlisted"
    design, trial, answer = ListedDesign, ListedTrial, ListedAnswer
    adapted = Task.adapted

    def control(self, words, trial):
        return Steps("Which was finer?", "", 1, 4, ("the first", "the second"))

    def answered(self, design, trial, value, **times):
        chosen = 1 + (value > 2)
        return ListedAnswer(chosen=chosen, sure=int(value in (1, 4)), correct=chosen == trial.interval, **times)

    def simulated(self, design, trial, observer, chance):
        return self.answered(design, trial, int(chance.integers(1, 5)), onset=0.0, response_time=0.8)


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantAnswer(ListedAnswer):
    finer_by: float = field(metadata={"units": "%"})


class Constant(Listed):
    """The same with the level in the answer, too."""

    answer = ConstantAnswer

    def adapted(self, design, trial, recorded):
        return trial

    def answered(self, design, trial, value, **times):
        return super().answered(design, trial, value, finer_by=trial.finer_by, **times)


def test_the_choice_that_is_correct_or_not_is_no_measure(tmp_path: Path) -> None:
    """Its mean is a preference for one interval; `correct` is primary, and the report says how to have thresholds."""
    simulate(ListedDesign(), tmp_path / "data", observers=2, seed=1)
    made = make_report(tmp_path / "data")
    tests = ["{}, contrast 0.5 less 0.05", "slope of {} on finer_by"]
    main = [test.format(answer) for answer in ("correct", "sure") for test in tests]
    crossed = [tests[1].format(f"({first})") for first in main[::2]]
    assert outcomes(made).index.get_level_values("name").tolist() == [*main, *crossed]
    assert "No threshold was fitted: for thresholds of finer_by, make" in made.files["report.md"].decode()


def test_levels_of_constant_stimuli_are_named_and_counted() -> None:
    task, design = Constant(), ListedDesign()
    asked = task.analysis(design)
    assert asked.estimates == "thresholds"
    assert "adaptive" not in asked.method
    assert task_plan(task, design, asked).shown.startswith(
        "Combinations of conditions (contrast: 0.05, 0.5; interval: 1, 2; finer_by: 2, 5, 12.5 %) were shown 3 times "
    )
    assert "adaptive" in Finer().analysis(FinerDesign()).method


def test_a_level_of_another_name_is_refused_before_the_first_trial(monkeypatch):
    def adapted(self, design, trial, recorded):
        return replace(trial, level=STAIRCASE.level(answers_of(recorded, level="period")))

    monkeypatch.setattr(Finer, "adapted", adapted)
    sentence = r"no field 'period' in trial and answer: give the field's name, answers_of\(recorded, level=\"NAME\"\)"
    with pytest.raises(InputError, match=sentence):
        check_task(FinerDesign())


@pytest.fixture
def without_psignifit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("focalgradient.statistics.adaptive.find_spec", lambda name: None)


def report(folder: Path, observers: int) -> Report:
    simulate(FinerDesign(), folder, observers=observers, seed=1)
    return make_report(folder)


def outcomes(made: Report) -> pd.DataFrame:
    table = pd.read_csv(pd.io.common.BytesIO(made.files["results.csv"]))
    return table[table["role"] == "main"].set_index(["name", "level"])


def check_sections(made: Report) -> None:
    found = outcomes(made)
    assert [*found.index] == [
        ("geometric mean threshold", "contrast 0.05"),
        ("geometric mean threshold", "contrast 0.5"),
        ("log ratio of thresholds", "contrast 0.05 over contrast 0.5"),
    ]
    means = pd.read_csv(pd.io.common.BytesIO(made.files["finer_means.csv"]))
    assert {"level", "interval"}.isdisjoint(means)
    assert means[["contrast", "answer"]].to_numpy().tolist() == [[one, "correct"] for one in TRUE]
    ratio = found.loc["log ratio of thresholds"].iloc[0]
    assert ratio["low"] < math.log(2) < ratio["high"]
    assert ratio["low"] > 0
    page = made.files["report.md"].decode()
    first = page.index("Geometric mean threshold in contrast 0.05")
    assert first < page.index("Threshold of contrast 0.05 over that of contrast 0.5")
    assert "shown to change correct" not in page
    assert {"finer_thresholds.csv", "finer_thresholds.R", "finer_trials.csv"} <= {*made.files}
    assert b'"finer_thresholds.csv"' in made.files["finer_thresholds.R"]
    assert b"catch" not in made.files["finer_thresholds.csv"]  # the design has no such trials


@pytest.mark.slow
def test_the_primary_outcome_is_the_threshold_in_each_condition(tmp_path: Path) -> None:
    pytest.importorskip("psignifit")
    made = report(tmp_path / "data", 6)
    check_sections(made)
    found = outcomes(made).loc["geometric mean threshold"]
    for contrast, true in TRUE.items():
        estimate = found.loc[f"contrast {contrast:g}"]["estimate"]
        assert estimate == pytest.approx(true, rel=0.25)  # two standard errors of 6 people, 30 trials each
    assert made.notices == ()


@pytest.mark.usefixtures("without_psignifit")
def test_without_psignifit_the_late_levels_are_named_and_compared(tmp_path: Path) -> None:
    made = report(tmp_path / "data", 6)
    check_sections(made)
    page = made.files["report.md"].decode()
    assert page.count("psignifit (extra thresholds) is not installed: each threshold is the geometric mean") == 2
    assert "fitted by psignifit" not in page


def test_the_control_gives_the_guess_rate_and_the_field_of_the_right_answer() -> None:
    design = FinerDesign()
    assert guessed(Finer(), design, "correct") == (0.5, {"interval": 2})
    assert guessed(Seen(), design, "correct") == (0.0, {})


@pytest.mark.usefixtures("without_psignifit")
def test_the_preregistration_states_the_thresholds_that_the_report_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("focalgradient.report.preregister.TASK_EXPERIMENTS", 5)
    monkeypatch.setattr("focalgradient.report.preregister.TASK_SUBJECTS", (6,))
    _people.cache_clear()
    text = preregister_conditions(task_named("finer"), FinerDesign(), Asked(Stated(Rules())))
    assert text.plan.questions.hypotheses == [
        "H1 (primary). The thresholds of contrast 0.05 and of contrast 0.5 differ."
    ]
    assert text.plan.questions.outcome.startswith("The primary outcome is the geometric mean over participants of the")
    assert [*text.tests.values()] == ["log ratio of thresholds, contrast 0.05 over contrast 0.5"]
    assert {*text.powers[6]} == {"test_1"}
    assert text.powers[6]["test_1"] > 0


@pytest.mark.usefixtures("without_psignifit")
def test_power_finds_a_twofold_ratio_of_thresholds() -> None:
    _people.cache_clear()
    study = Study(Observers(task_named("finer")), FinerDesign(), seed=1)
    assert [*study.tests.values()] == ["log ratio of thresholds, contrast 0.05 over contrast 0.5"]
    found = [study.experiment(4, number) for number in range(20)]
    assert sum(one["test_1"] for one in found) >= 10
    assert all(one["width"] > 0 for one in found)


class Paced(Finer):
    """The same, answered at each person's own pace."""

    def simulated(self, design, trial, observer, chance):
        return replace(super().simulated(design, trial, observer, chance), response_time=0.8 * observer.scale)


def test_people_who_do_not_differ_are_noted() -> None:
    finer, paced = (_notes([], Study(Observers(task), FinerDesign(), seed=1)) for task in (Finer(), Paced()))
    assert "the simulated people do not differ" in finer[-1]
    assert not any("do not differ" in note for note in paced)


@pytest.mark.parametrize(
    ("level", "reason"),
    [(lambda trial: -1.0, "needs levels above 0"), (lambda trial: 2.0, "All levels are 2")],
)
def test_levels_without_a_threshold_have_a_reason(level: Callable[[int], float], reason: str) -> None:
    analysis = Finer().analysis(FinerDesign())
    table = pd.DataFrame({"participant_id": "sub-01", "level": [*map(level, range(60))], "correct": [True, False] * 30})
    found = analysis.asked(table.assign(contrast=[0.05, 0.5] * 30)).to("geometric mean threshold")
    assert [outcome.reason for outcome in found.values()] == ["No participant has a threshold."] * 2
    sessions = analysis.asked(table.assign(contrast=[0.05, 0.5] * 30)).to("threshold")
    assert all(reason in outcome.reason for outcome in sessions.values())
