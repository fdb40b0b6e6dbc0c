"""`focalgradient power`: rates that are right where they are known, runs that go on where they were cut off."""

import json
import math
import re

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result
from scipy import stats

from focalgradient import InputError, power
from focalgradient.cli.power import power as command
from focalgradient.cli.program import Program
from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, NeckerDesign
from focalgradient.power import (
    CubeModel,
    LatentModel,
    Model,
    Study,
    ThresholdModel,
    run,
    run_here,
    simulated_ratings,
    simulated_reports,
    study_of,
)
from focalgradient.power.thresholds import _quantiles
from focalgradient.statistics import SubjectThreshold, ThresholdFit
from focalgradient.tasks import task_named

SMALL = DepthRatingDesign(scenes=["spheres-01"], catch_trials=2, practice_trials=0)


def call(*args: object) -> Result:
    return CliRunner().invoke(Program("focalgradient", commands=[command]), ["power", "depth-rating", *map(str, args)])


@pytest.fixture
def small(tmp_path) -> list[object]:
    design = tmp_path / "design.toml"
    design.write_text('task = "depthrating"\nscenes = ["spheres-01"]\ncatch_trials = 2\npractice_trials = 0\n')
    return ["--design", design, "--workers", 1]


def test_what_is_put_in_comes_out():
    """Slope, noise and spread over subjects, of 150 subjects."""
    model = Model(effect=1.5, far_effect=0.9, between=0.2, scenes=0.1, noise=0.25, lapses=0.0)
    table = simulated_ratings(
        DepthRatingDesign(scenes=["a", "b"], practice_trials=0), 150, model, np.random.default_rng(1)
    )
    answers = np.log(table["rating"]).where(~table["catch"])
    assert np.exp(np.log(table["rating"])[table["catch"]].mean()) == pytest.approx(1, abs=0.04)
    cell = answers.groupby([table["participant_id"], table["fixation"], table["aperture"]]).mean().unstack()
    rise = (cell["f/5.6"] - cell["pinhole"]).unstack()
    assert np.exp(rise["nearest"].mean()) == pytest.approx(1.5, rel=0.07)
    assert np.exp(rise["farthest"].mean()) == pytest.approx(0.9, rel=0.07)
    assert rise["nearest"].std() == pytest.approx(math.hypot(0.2, 0.25 * math.sqrt(2 / 4)), rel=0.2)
    same = answers.groupby([table[name] for name in ("participant_id", "fixation", "aperture", "scene")])
    assert math.sqrt(same.var().mean()) == pytest.approx(0.25, rel=0.05)


def test_lapses_and_the_ends_of_the_scale():
    table = simulated_ratings(SMALL, 50, Model(lapses=0.99, noise=0.0, between=0.0), np.random.default_rng(1))
    assert stats.kstest(np.log(table["rating"]) / math.log(4), "uniform", args=(-1, 2)).pvalue > 1e-3
    table = simulated_ratings(SMALL, 5, Model(effect=9.0, noise=0.1), np.random.default_rng(1))
    assert table["rating"].max() == pytest.approx(4.0)


def test_cut_off_and_gone_on_with(tmp_path, monkeypatch):
    """Ctrl-C in the midst, and a line cut short: the same as a run in one go, and nothing is done twice."""
    study, calls, experiment = Study(Model(), SMALL), [], Study.experiment

    def counted(*args):
        calls.append(args[1:])
        if len(calls) == 4:
            raise KeyboardInterrupt
        return experiment(*args)

    monkeypatch.setattr(Study, "experiment", counted)
    file = tmp_path / "file.jsonl"
    with pytest.raises(KeyboardInterrupt):
        run(study, [3], 5, file)
    with file.open("a") as lines:
        lines.write('{"subjects": 3, "numb')
    again = run(study, [3], 5, file)
    assert len(calls) == 4 + 2
    monkeypatch.undo()
    pd.testing.assert_frame_equal(again, run(study, [3], 5, tmp_path / "whole.jsonl"))
    assert file.read_text() == (tmp_path / "whole.jsonl").read_text()
    assert json.loads(file.read_text().splitlines()[0])["simulated"] is True
    with pytest.raises(InputError, match="experiments with another effect, design, bound, seed or version"):
        run(Study(Model(effect=1.4), SMALL), [3], 1, file)


def test_the_command_writes_table_and_figure(tmp_path, small):
    out = tmp_path / "power"
    result = call("--subjects", "4,3", "--experiments", 2, "--out", out, *small)
    assert result.exit_code == 0, result.output
    assert {file.name for file in out.iterdir()} == {"experiments.jsonl", "power.csv", "power.png", "power.pdf"}
    table = pd.read_csv(out / "power.csv")
    assert list(table["subjects"]) == [3, 4]
    assert table["simulated"].all()
    assert "Simulated subjects" in result.stdout
    assert re.search(r"\d% \[\d+\.\d%, \d+\.\d%\] \(N = 4\); by interpolation N [=<>]+ \d+ for \.80", result.stdout)
    assert "±" not in result.stdout


def test_a_test_without_effect_in_the_simulated_people_is_named():
    """3 of 100 experiments are what no effect gives; 30 of 100 are not, and 3 of 3 neither."""
    study = Study(Model(), SMALL)
    shares = {"near_rise": 0.03, "far_equivalent": 0.3, "interaction": 0.03}
    found = [power.Power(10, 100, shares, {}, 0, 0, 1, 1, 0)]
    assert power.running.without_effect(found, study) == [study.tests["near_rise"], study.tests["interaction"]]
    found.append(power.Power(20, 3, {**shares, "near_rise": 1.0}, {}, 0, 0, 1, 1, 0))
    assert power.running.without_effect(found, study) == [study.tests["interaction"]]


def test_shares_of_time_are_those_of_the_model():
    """Without differences between subjects: the odds of the time are the model's, to what 60 subjects tell."""
    model = CubeModel(effect=3.0, between=0.0, between_levels=0.0, between_dominances=0.0, dominance=0.5, lapses=0.0)
    table = simulated_reports(NeckerDesign(catch_trials=0), 20, model, np.random.default_rng(2))
    times = table.groupby(["gradient", "strength", "percept"])["duration"].sum()
    for gradient, strength, odds in (("none", 0.0, 0.25), ("nonrigid", 4.0, 0.75), ("rigid", 4.0, 0.25 / 3)):
        found = times[gradient, strength, "nonrigid"] / times[gradient, strength, "rigid"]
        assert found == pytest.approx(odds, rel=0.05)
    assert set(table.groupby("trial")["duration"].sum().round(6)) == {20 * 40.0}


def test_an_effect_on_the_cube_is_found_and_none_is_not():
    design = NeckerDesign()
    strong = Study(CubeModel(effect=4.0), design).experiment(12, 1)
    assert strong["nonrigid_longer"] == strong["nonrigid_shorter"] == 1.0
    assert 0 < strong["width"] < 1  # of a log odds ratio of 1.39
    nothing = [Study(CubeModel(effect=1.0, between=0.0), design).experiment(6, n) for n in range(5)]
    assert sum(one["nonrigid_longer"] + one["nonrigid_shorter"] for one in nothing) <= 1


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("scale", ["bipolar", "choice", "visual-analogue", "steps"])
def test_every_scale_has_power_by_the_test_of_its_report(tmp_path, scale):
    """A strong effect is found and none is not, by whole experiments on the design's own scale."""
    design = DepthRatingDesign(scale=scale, scenes=["a", "b"], repetitions=4, catch_trials=0, practice_trials=0)
    model = LatentModel(effect=12.0, between=0.3, between_scenes=0.0)
    task = task_named("depthrating")
    study = study_of(task, design, {"effect": 12.0, "between": 0.3, "between_scenes": 0.0})
    assert study == Study(model, design)
    (found,) = power.power(run_here(study, [14], 2), logs=study.model.logs)
    assert found.found["near_rise"] == 1.0
    assert found.joint == min(found.found.values()) == 1.0
    (nothing,) = power.power(run_here(study_of(task, design, {"effect": 1.0}), [8], 3), logs=study.model.logs)
    assert nothing.found["near_rise"] < 1
    assert math.isfinite(found.width)


def test_precision_of_thresholds_is_that_of_the_t_interval(monkeypatch):
    """A pool of normal log thresholds of SD .4: half the interval is t times .4 over the root of N."""
    fits = [ThresholdFit(at, 0.1, 0.9, 3.5, 0.0, (0.2,), (8,), (10,)) for at in np.exp(0.4 * _quantiles(400))]
    pool = tuple(SubjectThreshold(str(number), "", 0, 0, True, fit) for number, fit in enumerate(fits))
    monkeypatch.setattr("focalgradient.power.thresholds._people", lambda *_: pool)
    study = Study(ThresholdModel(), BlurThresholdDesign(), bound=1.2)
    (found,) = power.power(run_here(study, [30], 300), logs=True)
    half = stats.t.ppf(0.975, 29) * 0.4 / math.sqrt(30)
    assert math.log(found.width) == pytest.approx(2 * half, rel=0.03)
    # the sample variance is chi square: how often half the interval is below log 1.2
    exact = stats.chi2.cdf(29 * (math.log(1.2) * math.sqrt(30) / stats.t.ppf(0.975, 29) / 0.4) ** 2, 29)
    assert found.found["precise"] == pytest.approx(exact, abs=0.1)
