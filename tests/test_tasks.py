"""Tasks as classes: the registry, and the task of the document, made from nothing in a package of its own."""

from __future__ import annotations

import io
import json
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pytest
from extended import build, command
from scipy import stats
from statsmodels.stats.multitest import multipletests

from focalgradient.dataset import Apparatus, Session, validate
from focalgradient.design import Plan, Trial, check_design, design_text
from focalgradient.errors import InputError
from focalgradient.lab import EXPERIMENTS
from focalgradient.report import make_report
from focalgradient.tasks import Column, Response, Task, is_task, register, task_named, task_names
from focalgradient.tasks.registry import FILES
from focalgradient.tasks.steps import intervals_of

pytestmark = pytest.mark.usefixtures("unrendered")

OURS = {"depth-rating": "depthrating", "necker": "necker", "pinhole": "pinhole", "blur-threshold": "blurthreshold"}


def test_ours_are_registered_and_found_by_both_names() -> None:
    assert task_names()[:4] == tuple(OURS.values())
    for called, name in OURS.items():
        task = task_named(called)
        assert task is task_named(name)
        assert (task.name, task.called) == (name, called)
        assert task.design().task == EXPERIMENTS[called].task == name
        assert check_design("printed", tomllib.loads(design_text(called))) == task.design()
        assert all(isinstance(column, Column) for column in task.columns())
    assert [*EXPERIMENTS][:4] == [*OURS]


def test_noise_differs_between_phases_trials_and_participants_and_can_be_drawn_again() -> None:
    task = task_named(str(Path(__file__).parents[1] / "experiments" / "depth_order.py"))
    design = task.design()
    first = next(trial for trial in design.trials("01") if trial.phase == "main")
    same = [replace(first, phase=phase, trial=number) for phase in ("practice", "main") for number in (1, 2)]
    drawn = {
        (participant, trial.phase, trial.trial): [
            intervals_of(task, design, trial, 10.0, seed=design.noise_seed(participant, trial))[0][0].tobytes()
            for _ in range(2)
        ]
        for participant in ("01", "02")
        for trial in same
    }
    assert all(again == once for once, again in drawn.values())
    assert len({once for once, _ in drawn.values()}) == len(drawn)


@pytest.mark.parametrize("name", ["", "other", "depth_rating", 3, None])
def test_an_unknown_task_is_refused_with_those_that_exist(name) -> None:
    assert not is_task(name)
    with pytest.raises(InputError, match=r"must be one of depth-rating, necker, pinhole, blur-threshold"):
        task_named(name)


@dataclass(frozen=True, slots=True, kw_only=True)
class DotTrial(Trial):
    side: Literal["left", "right"]
    dots: int = field(metadata={"about": "Number of dots.", "least": 1})


@dataclass(frozen=True, slots=True, kw_only=True)
class DotAnswer(Response):
    guess: int = field(metadata={"about": "Number that was guessed.", "least": 0, "most": 99})
    sure: bool
    said: str | None = None


class DotDesign(Plan):
    task: str = "dots"
    repetitions: int = 3
    practice_trials: int = 2

    def trials(self, participant, session=None):
        return self.ordered(
            participant, session, [DotTrial(side=side, dots=dots) for side in ("left", "right") for dots in (3, 7)]
        )


@register
class Dots(Task):
    """Guess how many dots there are."""

    name = "dots"
    title = "Number of dots"
    design, trial, answer = DotDesign, DotTrial, DotAnswer

    def check_answer(self, design, trial, answer):
        if answer.sure and answer.guess != trial.dots:
            raise InputError(f"guess is {answer.guess}, but whoever is sure is right: mend it.")


def test_columns_follow_from_the_records_of_trial_and_answer() -> None:
    columns = {column.name: column for column in task_named("dots").columns()}
    assert [*columns] == [
        *("trial", "side", "dots", "repetition", "catch", "onset", "guess", "sure", "said", "response_time"),
        *("dropped_frames", "sitting"),
    ]
    assert columns["side"].described()["Levels"] == {"left": "left", "right": "right"}
    assert columns["guess"].described() == {
        "Description": "Number that was guessed.",
        "Format": "integer",
        "Minimum": 0,
        "Maximum": 99,
    }
    assert columns["sure"].form == "bool"
    assert columns["said"].optional


def test_a_list_has_each_condition_as_often_as_the_design_says() -> None:
    trials = DotDesign().trials("01")
    main = [trial for trial in trials if trial.phase == "main"]
    assert len(trials) - len(main) == 2
    assert pd.Series([trial.condition for trial in main]).value_counts().tolist() == [3] * 4
    assert [trial.condition for trial in DotDesign().trials("02") if trial.phase == "main"] == [
        trial.condition for trial in main[::-1]
    ]


def recorded(root: Path, design: DotDesign | None = None, **other: object) -> None:
    with Session.begin(root, design or DotDesign(), "01", apparatus=Apparatus("seconds of the test")) as session:
        for number, trial in enumerate(session.remaining()):
            given = {"guess": trial.dots, "sure": True, "said": "yes", **other}
            session.record(trial, DotAnswer(onset=5.0 * number, response_time=1.0, **given))


def test_a_session_of_an_own_task_is_recorded_and_checked(tmp_path: Path) -> None:
    recorded(tmp_path / "data")
    assert validate(tmp_path / "data").problems == ()
    table = next(tmp_path.rglob("*_beh.tsv"))
    text = table.read_text()
    assert text.splitlines()[1].split("\t")[-3:-1] == ["0", "1"]  # before the date
    table.write_text(text.replace("\tyes\t", "\tno\t", 1))
    assert any("it differs from its journal" in problem for problem in validate(tmp_path / "data").problems)


def test_an_own_task_is_reported_with_paired_tests_and_means_by_condition(tmp_path: Path) -> None:
    """Five people count one too many each, and 3 too many on the right."""
    for who in range(1, 6):
        chance = np.random.default_rng(who)
        with Session.begin(tmp_path / "data", DotDesign(), f"{who:02}", apparatus=Apparatus("seconds")) as session:
            for number, trial in enumerate(session.remaining()):
                guess = int(trial.dots + who + 3 * (trial.side == "right") + chance.integers(0, 3))
                session.record(trial, DotAnswer(onset=5.0 * number, response_time=1.0, guess=guess, sure=False))
    files = make_report(tmp_path / "data").files
    assert {"dots.png", "dots.pdf", "dots_dots.png", "dots_dots.pdf"} <= set(files)
    assert "dots_side.png" not in files
    tests, means = (pd.read_csv(io.BytesIO(files[name])) for name in ("results.csv", "dots_means.csv"))
    trials = pd.read_csv(io.BytesIO(files["dots_trials.csv"]))
    assert len(trials) == 5 * 12
    assert list(tests["name"][:2]) == ["guess, side right less left", "guess, dots 7 less 3"]
    levels = (("side", "right", "left"), ("dots", 7, 3))
    for row, (name, high, low) in zip(tests[:2].to_dict("records"), levels, strict=True):
        each = trials.groupby([name, "participant_id"])["guess"].mean()
        expected = stats.ttest_rel(each[high], each[low])
        assert row["estimate"] == pytest.approx((each[high] - each[low]).mean())
        assert (row["statistic"], row["df"], row["p"]) == pytest.approx((expected.statistic, 4, expected.pvalue))
        ends = expected.confidence_interval()
        assert (row["low"], row["high"]) == pytest.approx((ends.low, ends.high))
    assert list(tests["p_corrected"][:2]) == pytest.approx(list(multipletests(tests["p"][:2], method="holm")[1]))
    first = means.query("side == 'right' and dots == 3 and answer == 'guess'").iloc[0]
    own = trials.query("side == 'right' and dots == 3").groupby("participant_id")["guess"].mean()
    ends = stats.ttest_1samp(own, 0.0).confidence_interval()
    assert (first["mean"], first["low"], first["high"]) == pytest.approx((own.mean(), ends.low, ends.high))
    assert set(means["answer"]) == {"guess", "sure", "response_time"}


class Confounded(DotDesign):
    def trials(self, participant, session=None):
        shown = [DotTrial(side=side, dots=dots) for side, dots in (("left", 3), ("right", 7))]
        return self.ordered(participant, session, shown)


@pytest.mark.parametrize(("design", "confounded"), [(DotDesign, False), (Confounded, True)])
def test_factors_that_always_change_together_are_named(design, confounded: bool, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(type(task_named("dots")), "design", design)
    recorded(tmp_path / "data", design(seed=7 + confounded))  # lists of trials are kept by the settings of a design
    text = make_report(tmp_path / "data").files["report.md"].decode()
    assert ("side and dots always change together: their effects cannot be separated" in text) == confounded


@pytest.mark.parametrize(
    ("name", "given", "sentence"),
    [
        (
            "findings",
            lambda self, table: [table["none"]],
            r"the task 'dots' fails: findings raises KeyError\('none'\) \(",
        ),
        ("findings", lambda self, table: "A sentence.", "findings is 'A sentence.', but must be a list of texts"),
        ("tested", lambda self, design, table: 1 / 0, "the task 'dots' fails: tested raises ZeroDivisionError"),
    ],
)
def test_a_report_names_the_method_of_a_task_that_fails(
    name, given, sentence: str, tmp_path: Path, monkeypatch
) -> None:
    recorded(tmp_path / "data")
    monkeypatch.setattr(type(task_named("dots")), name, given)
    with pytest.raises(InputError, match=sentence):
        make_report(tmp_path / "data")


@pytest.mark.parametrize(
    ("other", "sentence"),
    [
        ({"guess": 100}, "guess is 100, but must be a whole number from 0 to 99"),
        ({"guess": 4}, "whoever is sure is right"),
        ({"guess": "4"}, "guess is '4', but must be"),
        ({"sure": 1}, "sure is 1, but must be"),
    ],
)
def test_an_answer_that_cannot_be_is_refused_before_it_is_written(other, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=sentence):
        recorded(tmp_path / "data", **other)


def test_what_is_no_task_or_takes_a_name_is_refused() -> None:
    with pytest.raises(InputError, match="derived from Task"):
        register(int)  # type: ignore[type-var]
    with pytest.raises(InputError, match="lacks answer, design"):
        register(type("Empty", (Task,), {"name": "empty"}))
    with pytest.raises(InputError, match="must be letters and digits"):
        register(type("Own", (Dots,), {"name": "own-task"}))
    for taken in ("dots", "necker"):
        with pytest.raises(InputError, match=f"'{taken}' already"):
            register(type("Own", (Dots,), {"name": taken}))


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build("A task", "edge_blur.py", tmp_path_factory.mktemp("package"))


@pytest.mark.slow
def test_the_commands_know_the_task_of_the_document(installed: Path, tmp_path: Path) -> None:
    data, report = tmp_path / "data", tmp_path / "report"
    done = command(installed, "simulate", "edgeblur", "--observers", 5, "--seed", 1, "--out", data)
    assert done.returncode == 0, done.stderr
    done = command(installed, "validate", data, "--json")
    assert done.returncode == 0, done.stdout
    assert json.loads(done.stdout)["trials"] == 5 * 15
    sidecar = json.loads(next(data.glob("sub-01/**/*_beh.json")).read_text())
    assert sidecar["TaskDescription"] == "Blur of an edge, as it looks"
    assert sidecar["sigma_arcmin"]["Units"] == "arcmin"
    assert (sidecar["blur"]["Minimum"], sidecar["blur"]["Maximum"]) == (0, 10)
    done = command(installed, "report", data, "--out", report)
    assert done.returncode == 0, done.stderr
    means = pd.read_csv(report / "edgeblur_means.csv")
    blur = means[means["answer"] == "blur"].set_index("sigma_arcmin")["mean"]
    assert abs(blur[4] - 4) < 0.3  # as the simulated observers answer: twice the logarithm to base 2
    assert abs(blur[16] - 8) < 0.3
    assert len(pd.read_csv(report / "edgeblur_trials.csv")) == 75
    text = (report / "report.md").read_text(encoding="utf-8")
    assert "simulated observers with 75 trials" in text
    assert "slope of blur on sigma" in text
    assert (report / "edgeblur.png").read_bytes().startswith(b"\x89PNG")
    tests = pd.read_csv(report / "results.csv")
    slope = float(np.polyfit([1, 4, 16], [0, 4, 8], 1)[0])  # of the observers' rule
    assert tests["estimate"][0] == pytest.approx(slope, abs=0.05)
    design = tmp_path / "design.toml"
    design.write_text(command(installed, "run", "edgeblur", "--print-design").stdout)
    done = command(installed, "report", "--preregister", design, "--out", tmp_path / "plan")
    assert done.returncode == 0, done.stderr
    plan = (tmp_path / "plan" / "preregistration.md").read_text(encoding="utf-8")
    assert "H1 (primary). The slope of blur on sigma" in plan
    assert plan.split("Methods")[-1]
    done = command(installed, "power", "edgeblur", "--subjects", 3, "--experiments", 2, "--out", tmp_path / "power")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Simulated observers of the task: proportion of experiments that find\n")
    assert "slope of blur on sigma_arcmin: 100.0%" in done.stdout


def test_where_the_package_is_not_installed_the_task_is_refused_by_name(tmp_path: Path) -> None:
    done = command(tmp_path, "simulate", "edgeblur", "--observers", 1, "--seed", 1, "--out", tmp_path / "data")
    assert done.returncode == 2
    assert "EXPERIMENT is 'edgeblur', but must be one of depth-rating, necker, blur-threshold" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_task_in_a_file_runs_by_its_file(installed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (installed / "edge_blur.py").read_text()
    file = tmp_path / "mine.py"
    file.write_text(
        text.replace("import Task", "import Task, register").replace("class EdgeBlur", "@register\nclass EdgeBlur")
    )
    data = tmp_path / "data"
    done = command(tmp_path, "simulate", file, "--observers", 2, "--seed", 1, "--out", data, "--workers", 2)
    assert done.returncode == 0, done.stderr
    for words in (("validate", data), ("report", data, "--out", tmp_path / "report")):
        done = command(tmp_path, *words)
        assert done.returncode in (1, 2)
        assert "is of a task 'edgeblur' that is unknown here: install its package" in done.stdout + done.stderr
    monkeypatch.setenv(FILES, str(file))
    done = command(tmp_path, "validate", data)
    assert done.returncode == 0, done.stdout
    done = command(tmp_path, "run", file, "--print-design")
    assert done.stdout.startswith('# Blur of an edge, as it looks\ntask = "edgeblur"\n')


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "registers 0 tasks, but must register one"),
        ("x = 1 / 0", "cannot be run (ZeroDivisionError"),
        (None, "does not exist: give the Python file"),
    ],
)
def test_a_file_without_a_task_is_refused_in_a_sentence(text, sentence: str, tmp_path: Path) -> None:
    file = tmp_path / f"wrong_{len(sentence)}.py"
    if text is not None:
        file.write_text(text)
    done = command(tmp_path, "run", file, "--pilot")
    assert done.returncode == 2
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
