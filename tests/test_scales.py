"""Scales and factors of a design, from the trial list to the report; and participants who do not look."""

from __future__ import annotations

import math
import re
import zlib
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from damaging import forged, put

from focalgradient.dataset import Apparatus, Rated, Session, read_dataset, validate, withdraw
from focalgradient.design import DepthRatingDesign, DepthTrial, check_design
from focalgradient.errors import InputError
from focalgradient.experiments.depth_rating import DepthRating
from focalgradient.power import study_of
from focalgradient.report import analyse_ratings, make_report
from focalgradient.statistics import Effect
from focalgradient.tasks import register

pytestmark = pytest.mark.usefixtures("unrendered")

APPARATUS = Apparatus("seconds of the test")
SMALL = {"scenes": ["s1", "s2"], "repetitions": 2, "practice_trials": 3, "standard_every": 0}


def design_of(**settings) -> DepthRatingDesign:
    made = check_design("a test", {"task": "depthrating", **SMALL, **settings})
    assert isinstance(made, DepthRatingDesign)
    return made


def honest(design: DepthRatingDesign, trial: DepthTrial, chance: np.random.Generator) -> float:
    """Somebody to whom blur adds depth, by .04 of the logarithm a millimetre, if the nearest object is in focus."""
    deep = {"example-flat": -1.2, "example-deep": 1.2}.get(trial.scene, 0.04 * trial.aperture_mm)
    deep *= trial.fixation == "nearest" or trial.scene.startswith("example-")
    deep += 0.1 * (trial.factors.get("light") == "bright") + 0.1 * chance.standard_normal()
    least, most = design.response_scale.bounds
    if design.scale == "ratio":
        return float(np.clip(math.exp(deep), least, most))
    if design.scale == "choice":
        return float(chance.random() < 1 / (1 + math.exp(-8 * deep)))
    return float(np.clip(round((least + most) / 2 + 3 * deep + 0.3 * chance.standard_normal()), least, most))


def record(root: Path, design: DepthRatingDesign, people: int, answer=honest, label: str = "", **how) -> Path:
    for number in range(1, people + 1):
        name = label or f"{number:02}"
        chance = np.random.default_rng(zlib.crc32(f"{name} {design.scale}".encode()))
        with Session.begin(root, design, name, apparatus=APPARATUS) as session:
            for at, trial in enumerate(session.remaining()):
                rating = answer(design, trial, chance)
                start = None if design.scale == "choice" else float(chance.uniform(*design.response_scale.bounds))
                told = {"response_time": 1.0 + chance.random(), "start": start, **how}
                session.record(trial, Rated(onset=20.0 * at, rating=rating, **told))
    return root


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("scale", ["ratio", "steps", "bipolar", "choice"])
def test_the_report_takes_the_analysis_that_the_scale_asks_for(scale, tmp_path):
    design = design_of(scale=scale, reference="same-scene" if scale in ("bipolar", "choice") else "standard")
    root = record(tmp_path / "data", design, 8)
    assert validate(root).problems == ()
    ratings = analyse_ratings(root)
    assert ratings.quality.subjects_after == 8
    if scale in ("bipolar", "choice"):
        near, far = ratings.compared.slopes
    else:
        found = ratings.result.fixations if scale == "ratio" else None
        near, far = (each.rise for each in found) if found else ratings.result.ordinal.slopes
    assert near.low > 0
    assert near.significant
    if isinstance(far, Effect):
        assert far.estimate < near.estimate / 2


def test_answers_that_are_off_the_scale_are_refused_and_found(tmp_path):
    design = design_of(scale="bipolar")
    with pytest.raises(InputError, match=r"rating is 4, but the scale of the design goes from -3 to 3"):
        record(tmp_path / "other", design, 1, lambda *given: 4.0)
    root = record(tmp_path / "data", design, 2)
    forged(put(3, rating=2.5))(root)
    assert any("rating is 2.5, but the scale of the design has whole steps" in one for one in validate(root).problems)


LAZY = {
    "holds one key to the end": (lambda design, trial, chance: design.response_scale.bounds[1], {}),
    "one answer for all": (lambda design, trial, chance: 1.0, {}),
    "answers without looking": (
        lambda design, trial, chance: math.exp(chance.uniform(-1.3, 1.3)),
        {"response_time": 0.2},
    ),
}


@pytest.mark.parametrize("way", LAZY)
def test_who_does_not_look_is_left_out(way, tmp_path):
    answer, how = LAZY[way]
    root = record(tmp_path / "data", design_of(), 3)
    record(root, design_of(), 1, answer, "lazy", **how)
    found = analyse_ratings(root).quality
    assert {one.participant_id for one in found.exclusions if one.whole_subject} == {"sub-lazy"}
    rules = [one.rule for one in found.exclusions if one.whole_subject]
    assert any(word in rule for rule in rules for word in ("one and the same", "too fast"))


def test_whoever_presses_one_key_and_confirms_is_left_out(tmp_path):
    """On a scale where the first key puts the marker; of a choice, always the left key."""
    design, chance = design_of(), np.random.default_rng(5)
    root = record(tmp_path / "data", design, 3)
    with Session.begin(root, design, "lazy", apparatus=APPARATUS) as session:
        for at, trial in enumerate(session.remaining()):
            place = round(math.exp(chance.uniform(-1.38, 1.38)), 4)
            session.record(trial, Rated(onset=20.0 * at, rating=place, response_time=1.0, start=place))
    choice = design_of(scale="choice", reference="same-scene")
    other = record(tmp_path / "other", choice, 3)
    record(other, choice, 1, lambda design, trial, chance: float(trial.interval == 1), "lazy")
    for data, reason in (
        (root, "left more than 50% of the answers where the marker first stood"),
        (other, "one and the same"),
    ):
        found = [one for one in analyse_ratings(data).quality.exclusions if one.whole_subject]
        assert {one.participant_id for one in found} == {"sub-lazy"}
        assert any(reason in one.rule for one in found)


@pytest.mark.slow
def test_own_factors_go_from_the_design_to_the_report(tmp_path):
    factors = {
        "light": {"levels": ["dim", "bright"]},
        "group": {"levels": ["young", "old"], "vary": "between", "pictures": False},
    }
    design = design_of(factors=factors, repetitions=1)
    levels = [
        (trial.factors["light"], trial.factors["group"]) for trial in design.trials("03") if trial.phase == "main"
    ]
    assert {group for _, group in levels} == {"old"}
    assert abs(sum(light == "dim" for light, _ in levels) - len(levels) / 2) <= 1
    root = record(tmp_path / "data", design, 8)
    assert validate(root).problems == ()
    table = read_dataset(root).depth_rating
    assert set(table["light"]) == {"dim", "bright"}
    assert table.groupby("participant_id")["group"].nunique().max() == 1
    factors = analyse_ratings(root).also
    (light,), (group,) = (factors.to(f"answer by {name}").values() for name in ("light", "group"))
    assert light.low < 0.1 < light.high
    assert light.significant
    assert not group.significant
    assert b"answer by light,bright less dim" in make_report(root).files["results.csv"]
    # A level that the design does not give this trial is found.
    path = next(root.glob("sub-01/**/*.tsv"))
    path.write_text(path.read_text().replace("\tdim\t", "\tbright\t", 1))
    assert any("where light is 'bright', but 'dim' in the journal" in problem for problem in validate(root).problems)


def test_answers_that_a_participant_wants_removed_are_a_problem_until_they_are(tmp_path):
    design = design_of()
    root = record(tmp_path / "data", design, 2)
    with Session.begin(root, design, "03", apparatus=APPARATUS) as session:
        session.note("keep", kept=False)
    assert any("asked for removal of the answers" in problem for problem in validate(root).problems)
    withdraw(root, "sub-03")
    assert validate(root).problems == ()


class OtherRatings(DepthRatingDesign):
    task: Literal["otherratings"] = "otherratings"


@register
class OtherRating(DepthRating):
    """Depth ratings of a laboratory."""

    name = "otherratings"
    title = "Depth as another laboratory asks for it"
    command = settings_file = ""
    design = OtherRatings


def test_a_task_derived_from_ratings_has_their_report_and_power(tmp_path):
    design = OtherRatings(**design_of(scenes=("a", "b"), repetitions=1).model_dump() | {"task": "otherratings"})
    report = make_report(record(tmp_path / "data", design, 3))
    assert b"depth effect,nearest,primary" in report.files["results.csv"]
    assert not [name for name in report.files if "depth_rating" in name or name == "headline.R"]
    study = study_of(OtherRating(), design, {"effect": 9.0, "between": 0.1})
    assert study.experiment(6, 1)["near_rise"] == 1


@pytest.mark.usefixtures("unrendered")
def test_a_derived_task_has_files_of_its_own_beside_those_of_ratings(tmp_path):
    ratings = design_of(scenes=("a", "b"), repetitions=1)
    root = record(tmp_path / "data", ratings, 3)
    record(root, OtherRatings(**ratings.model_dump() | {"task": "otherratings"}), 4)
    files = make_report(root).files
    usual = [name for name in files if "depth_rating" in name]
    assert {name.replace("depth_rating", "otherratings") for name in usual} <= {*files}
    people = [len({*re.findall(rb"sub-\d+", files[f"{name}_trials.csv"])}) for name in ("depth_rating", "otherratings")]
    assert people == [3, 4]
    assert b'read.csv("depth_rating_trials.csv"' in files["headline.R"]
    assert b'read.csv("otherratings_trials.csv"' in files["otherratings_headline.R"]
    header, *effects = files["otherratings_results.csv"].splitlines()
    assert files["results.csv"].splitlines()[0] == header
    assert files["results.csv"].splitlines()[-len(effects) :] == effects
    page = files["report.md"].decode()
    assert "(depth_rating.png)" in page
    assert "(otherratings.png)" in page
    assert "## Depth as another laboratory asks for it" in page
