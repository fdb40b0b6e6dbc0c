"""Tasks as classes: the registry, and the task of the document, made from nothing in a package of its own."""

from __future__ import annotations

import io
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from statsmodels.stats.multitest import multipletests

from focalgradient.dataset import Apparatus, Session
from focalgradient.design import Plan, Trial
from focalgradient.errors import InputError
from focalgradient.power import Observers
from focalgradient.report import Stated, make_report
from focalgradient.report.parts import Asked
from focalgradient.report.preregister import preregister_conditions
from focalgradient.statistics import Rules
from focalgradient.statistics.means import paired_effect
from focalgradient.statistics.questions import Analysis, Question
from focalgradient.tasks import Response, Task, is_task, register, task_named
from focalgradient.tasks.steps import intervals_of

pytestmark = pytest.mark.usefixtures("unrendered")


def test_noise_differs_between_phases_trials_and_participants_and_can_be_drawn_again() -> None:
    task = task_named(str(Path(__file__).parents[1] / "experiments" / "depth_order.py"))
    design = task.design()
    first = next(trial for trial in design.trials("01") if trial.phase == "main")

    def drawn(participant: str, **other: object) -> bytes:
        trial = replace(first, **other)
        seed = design.noise_seed(participant, trial)
        return intervals_of(task, design, trial, 10.0, seed=seed)[0][0].tobytes()

    once = drawn("01")
    assert drawn("01") == once
    assert len({once, drawn("02"), drawn("01", phase="practice"), drawn("01", trial=first.trial + 1)}) == 4


def test_a_field_that_is_the_right_answer_is_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """The interval or side of a stimulus was a hypothesis of its own, without power, in the correction by Holm."""
    task = task_named(str(Path(__file__).parents[1] / "experiments" / "depth_order.py"))
    design = task.design()
    assert {*task.factors(design)} == {"near", "far", "depth_of_field"}  # near is the side that is right
    asked = [question.name for question in task.analysis(design).every]
    assert asked == [
        "slope of correct on far",
        "correct, depth_of_field without less with",
        "(slope of correct on far), depth_of_field without less with",
    ]
    monkeypatch.setattr(type(task), "factors", lambda self, design: ["far"])
    with pytest.raises(InputError, match=r"factors of depthorder gives \['far'\], but must give the levels of each"):
        task.analysis(design)


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
    look: Literal["round", "square"] | None = None


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


def recorded(root: Path, design: DotDesign | None = None, **other: object) -> None:
    with Session.begin(root, design or DotDesign(), "01", apparatus=Apparatus("seconds of the test")) as session:
        for number, trial in enumerate(session.remaining()):
            given = {"guess": trial.dots, "sure": True, "said": "yes", **other}
            session.record(trial, DotAnswer(onset=5.0 * number, response_time=1.0, **given))


def test_an_own_task_is_reported_with_paired_tests_and_means_by_condition(tmp_path: Path) -> None:
    """Five people count one too many each, and 3 too many on the right."""
    for who in range(1, 6):
        chance = np.random.default_rng(who)
        with Session.begin(tmp_path / "data", DotDesign(), f"{who:02}", apparatus=Apparatus("seconds")) as session:
            for number, trial in enumerate(session.remaining()):
                guess = int(trial.dots + who + 3 * (trial.side == "right") + chance.integers(0, 3))
                look = (None, "round", "square")[(number + who) % 3]
                answer = DotAnswer(onset=5.0 * number, response_time=1 + who / 9, guess=guess, sure=False, look=look)
                session.record(trial, answer)
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
    assert set(means["answer"]) == {"guess", "sure", "response_time", "look: round", "look: square"}
    looks = trials[trials["look"].notna()].assign(square=lambda rows: rows["look"] == "square")
    shares = looks.query("side == 'right' and dots == 3").groupby("participant_id")["square"].mean()
    found = means.query("side == 'right' and dots == 3 and answer == 'look: square'").iloc[0]
    assert (found["subjects"], found["mean"]) == (len(shares), pytest.approx(shares.mean()))
    assert "The answer look is a word and is not tested" in files["report.md"].decode()


def test_a_question_that_a_task_adds_is_reported_preregistered_and_given_its_power(tmp_path: Path, monkeypatch) -> None:
    """Guesses of three people grow by 2 from trial to trial, those of two people by 1."""

    def growth(table: pd.DataFrame) -> dict[str, object]:
        slopes = [np.polyfit(rows["trial"], rows["guess"], 1)[0] for _, rows in table.groupby("participant_id")]
        return {"": paired_effect(slopes, "slope on the trial, t over subjects")}

    asked = Question(
        "growth",
        growth,
        "main",
        "guess per trial",
        sentence=lambda level, answers: f"Guesses grow by {answers.to('growth')[level].estimate:.2f} in each trial.",
        hypothesis=("Guesses grow over trials.",),
        method="Slopes on the number of the trial were tested.",
    )
    task = task_named("dots")
    monkeypatch.setattr(
        Dots, "analysis", lambda self, *given: replace(Task.analysis(self, *given), also=[Analysis([asked])])
    )
    for who in range(1, 6):
        with Session.begin(tmp_path / "data", DotDesign(), f"{who:02}", apparatus=Apparatus("seconds")) as session:
            for number, trial in enumerate(session.remaining()):
                answer = DotAnswer(onset=5.0 * number, response_time=1.0, guess=(1 + who % 2) * trial.trial, sure=False)
                session.record(trial, answer)
    files = make_report(tmp_path / "data").files
    results = pd.read_csv(io.BytesIO(files["results.csv"])).set_index("name")
    assert results.loc["growth", "estimate"] == pytest.approx(1.6)
    assert len(results) == 7
    assert "Guesses grow by 1.60 in each trial." in files["report.md"].decode()
    plan = preregister_conditions(task, DotDesign(practice_trials=0), Asked(Stated(Rules()))).plan
    assert plan.questions.hypotheses[-1] == "H7. Guesses grow over trials."
    assert plan.analysis[-1] == asked.method
    assert list(Observers(task).claims(DotDesign(), 1.2).values())[-1].question == "growth"


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
