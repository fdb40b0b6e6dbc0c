"""The adaptive experiment without a window: its list, the procedure, records, damages, recovery and the report."""

from __future__ import annotations

import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import succeed
from damaging import forged

from focalgradient.dataset import Apparatus, Chosen, Session, read_dataset, validate
from focalgradient.design import BlurThresholdDesign, Procedure
from focalgradient.errors import InputError
from focalgradient.observers import OBSERVERS, choose
from focalgradient.report.analysed import read_task
from focalgradient.report.parts import Asked, Part
from focalgradient.report.rules import Stated
from focalgradient.report.thresholds import threshold_part, thresholds_of_dataset
from focalgradient.statistics import Interval, NotComputed, Rules, ThresholdFit, blur_thresholds, fit_threshold
from focalgradient.tasks import task_named

pytestmark = pytest.mark.usefixtures("unrendered")

SHORT = BlurThresholdDesign(scenes=["spheres-01"], repetitions=3, catch_trials=2, practice_trials=2, level_steps=9)


def test_both_intervals_come_equally_often_and_no_one_too_often_in_a_row():
    trials = [trial for trial in BlurThresholdDesign().trials("07") if trial.phase == "main"]
    counted = [trial.interval for trial in trials if not trial.catch]
    assert (counted.count(1), counted.count(2), len(trials) - len(counted)) == (30, 30, 6)
    assert all(len(set(counted[at : at + 4])) == 2 for at in range(len(counted) - 3))


def test_scenes_do_not_tell_the_interval_in_practice_and_catch_trials():
    design = BlurThresholdDesign(catch_trials=8, practice_trials=4)
    trials = design.trials("01")
    shown = [(trial.scene, trial.interval) for trial in trials if trial.catch or trial.phase == "practice"]
    assert {*((shown.count(one), one) for one in shown)} == {(3, (scene, n)) for scene in design.scenes for n in (1, 2)}


def test_the_procedure_depends_on_nothing_but_its_answers():
    design = BlurThresholdDesign()
    one, other = Procedure(design), Procedure(design)
    given: list[tuple[float, bool]] = []
    for number in range(12):
        given.append((one.level(), number % 3 != 0))
        one.learn(given)
    other.learn(given)  # all at once
    assert other.level() == one.level()
    assert all(design.is_level(level) for level, _ in given)
    with pytest.raises(InputError, match=r"level is 0\.123, but must be one of the design's"):
        other.learn([*given, (0.123, True)])


def test_recorded_answers_are_of_the_design_and_do_not_contradict_themselves(tmp_path):
    with Session.begin(tmp_path / "data", SHORT, "01", apparatus=Apparatus("seconds")) as session:
        trial = session.remaining()[0]
        fine = Chosen(onset=1.0, level=2.0, answer=trial.interval, correct=True, response_time=1.0, stimulus="a.png")
        with pytest.raises(InputError, match=r"level is 0\.5, but must be one of the design's levels"):
            session.record(trial, replace(fine, level=0.5))
        with pytest.raises(InputError, match="correct is False, which contradicts the answer"):
            session.record(trial, replace(fine, correct=False))
        with pytest.raises(InputError, match="answer is 3, but must be 1 or 2"):
            replace(fine, answer=3)
        session.record(trial, fine)
        assert [one["level"] for one in session.recorded] == [2.0]


def simulated_in(folder: Path, data: Path) -> None:
    """Simulate four observers of short sessions."""
    design = folder / "mine.toml"
    design.write_text('task = "blurthreshold"\nscenes = ["a"]\nrepetitions = 12\n')
    succeed("simulate", "blur-threshold", "--observers", 4, "--seed", 3, "--design", design, "--out", data)


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four observers of short sessions."""
    folder = tmp_path_factory.mktemp("thresholds")
    simulated_in(folder, folder / "data")
    return folder / "data"


def test_simulated_sessions_are_valid_and_go_on_where_they_were_cut_off(simulated, tmp_path):
    assert validate(simulated).problems == ()
    table = read_dataset(simulated).blur_threshold
    assert len(table) == 4 * (24 + 6)
    # Cut the second's journal after its twelfth line, and simulate again: the same answers.
    copy = tmp_path / "data"
    shutil.copytree(simulated, copy)
    journal = next(copy.rglob("sub-02*.jsonl"))
    whole = journal.read_bytes()
    journal.write_bytes(b"\n".join(whole.split(b"\n")[:12]) + b"\n")
    next(copy.glob("sub-02/beh/*.tsv")).unlink()
    simulated_in(tmp_path, copy)
    whole, again = (
        one.drop(columns="sitting").reset_index(drop=True) for one in (table, read_dataset(copy).blur_threshold)
    )
    assert again.equals(whole)


def _flipped(column: str):
    return lambda event: {column: not event[column] if column == "correct" else 3 - event[column]}


DAMAGES = {
    "another level": (lambda event: {"level": 0.123}, "level is 0.123, but must be one of the design's levels"),
    "an easy catch trial": (lambda event: {"level": 0.02}, "level is 0.02, but catch trials have the greatest"),
    "a right answer": (_flipped("correct"), "correct is .*, which contradicts the answer"),
    "a third answer": (lambda event: {"answer": 3}, "answer is 3, but must be 1 or 2"),
    "no time": (lambda event: {"response_time": 0.0}, "response_time is 0 s"),
    "the other interval": (_flipped("interval"), "interval is [12], but [12] by the design"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damages_to_a_session_are_named(damage, simulated, tmp_path):
    change, sentence = DAMAGES[damage]
    root = tmp_path / "data"
    shutil.copytree(simulated, root)

    def spoil(events):
        catch = damage == "an easy catch trial"
        event = next(one for one in events if one.get("phase") == "main" and one.get("catch") is catch)
        event |= change(event)

    forged(spoil, "blurthreshold")(root)
    (problem,) = validate(root).problems
    assert re.search(sentence, problem)


def test_the_fit_finds_a_threshold_from_many_trials_by_a_formula_of_its_own():
    """Constant stimuli, 400 at each of eight levels; the share expected at each, so that no chance is left."""
    threshold, slope = 0.25, 3.0
    levels = 0.25 * np.array([0.4, 0.55, 0.7, 0.85, 1.0, 1.2, 1.6, 3.0])
    share = 0.5 + 0.49 * (1 - np.exp(-math.log(2) * (levels / threshold) ** slope))
    right = np.concatenate([np.arange(400) < round(400 * one) for one in share])
    fit = fit_threshold(np.repeat(levels, 400), right, least=0.02, most=2.0)
    assert fit.threshold == pytest.approx(threshold, rel=0.02)
    assert fit.slope == pytest.approx(slope, rel=0.1)
    assert fit.low < threshold < fit.high < 1.15 * fit.low
    assert fit.correct(threshold) == pytest.approx(0.75, abs=0.02)


def test_priors_of_lapses_and_slope_are_the_users_and_move_the_fit():
    """At 60 trials that hardly determine them a prior of more lapses gives a lower threshold."""
    levels = np.repeat([0.12, 0.18, 0.25, 0.35], 15)
    right = np.concatenate([np.arange(15) < count for count in (8, 10, 12, 14)])
    none, many = (fit_threshold(levels, right, least=0.02, most=2.0, lapse=mean) for mean in (0.0, 0.05))
    assert none.lapse == 0
    assert many.lapse > 0.01
    assert many.threshold < none.threshold
    steep = fit_threshold(levels, right, least=0.02, most=2.0, slope=8.0)
    assert steep.slope > none.slope
    for wrong in ({"lapse": -0.1}, {"lapse": 0.3}, {"slope": 0.5}, {"slope": math.nan}):
        with pytest.raises(InputError, match=f"{next(iter(wrong))} is"):
            fit_threshold(levels, right, least=0.02, most=2.0, **wrong)


def errors(seeds: range, slope: float = 3.5) -> tuple[list[float], int]:
    """Logarithms of the fitted over the true threshold, and how many intervals hold the true one."""
    design = BlurThresholdDesign(catch_trials=0, practice_trials=0)
    found, covered = [], 0
    for seed in seeds:
        true = 0.08 * 1.25 ** (seed % 9)
        answers = choose(design, OBSERVERS["default"], "01", seed, true, slope)
        fit = fit_threshold([one.level for one in answers], [one.correct for one in answers], least=0.02, most=2.0)
        found.append(math.log(fit.threshold / true))
        covered += fit.low <= true <= fit.high
    return found, covered


@pytest.mark.slow
def test_known_thresholds_are_recovered_without_bias_and_covered():
    """Forty sessions of 60 trials; their spread is 13 % each (`benchmarks/blur_thresholds.py`)."""
    found, covered = errors(range(100, 140))
    assert abs(np.mean(found)) < 0.07
    assert 0.08 < np.std(found) < 0.22
    assert covered >= 36


@pytest.mark.slow
def test_who_guesses_is_named_and_too_few_trials_have_no_threshold(tmp_path):
    succeed(
        "simulate", "blur-threshold", "--observers", 2, "--seed", 5, "--observer", "guessing", "--out", tmp_path / "d"
    )
    table = read_dataset(tmp_path / "d").blur_threshold
    result = blur_thresholds(table, least=0.02, most=2.0)
    assert [one.kept for one in result.subjects] == [False, False]
    assert isinstance(result.mean_attending, NotComputed)
    assert isinstance(result.mean, Interval)  # nobody is left out: a high threshold has the same effect
    few = blur_thresholds(table[table["trial"] < 15], least=0.02, most=2.0).subjects[0].fit
    assert "needs 20 trials" in few.reason
    assert all(isinstance(one.fit, ThresholdFit) for one in result.subjects)


def test_a_report_without_any_threshold_mentions_no_mean(simulated):
    data = read_dataset(simulated)
    few = data.blur_threshold.query("trial < 15")
    part = threshold_part(few, {"": blur_thresholds(few, least=0.02, most=2.0)}, "D", data=data)
    assert not any("mean" in sentence for sentence in [*part.said, *part.answers.sentences("main")])


def part_of(root: Path) -> Part:
    task = task_named("blur-threshold")
    return thresholds_of_dataset(task, read_task(root, task), Asked(Stated(Rules())))


def test_true_thresholds_are_listed_and_a_mean_is_without_those_who_missed_catch_trials(simulated):
    data = read_dataset(simulated)
    true = {f"sub-{files.participant}": sidecar["Participant"]["threshold"] for files, sidecar in data.sidecars.items()}
    [sheet] = [sheet for sheet in part_of(simulated).sheets if sheet.file.endswith("thresholds.csv")]
    assert dict(zip(sheet.digits["participant"], sheet.digits["known"], strict=True)) == pytest.approx(true)
    table = data.blur_threshold
    missed = table["catch"] & (table["participant_id"] == "sub-02")
    result = blur_thresholds(table.assign(correct=table["correct"] & ~missed), least=0.02, most=2.0)
    said = threshold_part(table, {"": result}, "D", data=data).said
    assert any("Without the 1 who missed catch trials" in sentence for sentence in said)


def test_one_person_is_analysed_and_sessions_of_other_levels_are_refused(simulated, tmp_path):
    root = Path(shutil.copytree(simulated, tmp_path / "data"))
    shutil.rmtree(root / "sourcedata")
    for label in ("02", "03", "04"):
        shutil.move(root / f"sub-{label}", tmp_path)
    assert [*part_of(root).answers.to("threshold")] == ["sub-01"]
    shutil.move(tmp_path / "sub-02", root)
    (sidecar,) = root.glob("sub-02/**/*_beh.json")
    settings = json.loads(sidecar.read_text())
    settings["Design"]["most_level"] = 1.5
    sidecar.write_text(json.dumps(settings))
    with pytest.raises(InputError, match="data has sessions that differ in most_level: keep designs in"):
        part_of(root)
