"""Pooling of data sets: those with common scenes are not independent, which the pictures' hashes, or names, tell."""

import hashlib
import json

import numpy as np
import pandas as pd
import pytest
from recorded import APPARATUS, RATING, Rated

from focalgradient.dataset import Session
from focalgradient.report import Report, analyse_ratings, analyse_table
from focalgradient.report.meta import combined_report
from focalgradient.report.scene_effects import SCENE_EFFECTS, scene_effects
from focalgradient.statistics import meta_analysis
from focalgradient.statistics.crossed import crossed_effect, moments
from focalgradient.statistics.meta_analysis import random_effects

FILE = f"depth_rating{SCENE_EFFECTS}"
WHAT = "depth effect at the largest aperture (ratio to the pinhole), nearest in focus"


def test_data_sets_with_common_scenes_hold_their_level(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight sets of ten people with the same twelve scenes (SD .2), no effect: as independent sets .25 are rejected."""
    monkeypatch.setattr(meta_analysis, "_prediction", lambda y, se: (0.0, 0.0))  # slow, and not looked at
    rng, independent, crossed = np.random.default_rng(57), [], []
    for _ in range(400):
        y = 0.2 * rng.standard_normal(12) + 0.25 * rng.standard_normal((8, 10, 1))
        y = y + 0.3 * rng.standard_normal((8, 10, 12))
        each, own = moments(y), y.mean(axis=2)
        independent.append(random_effects(each.mean, each.standard_error).p)
        here = own.std(axis=1, ddof=1) / np.sqrt(10)
        crossed.append(random_effects(own.mean(axis=1), here, y.mean(axis=1)).p)
    assert (np.array(independent) < 0.05).mean() > 0.12
    assert 0.02 < (np.array(crossed) < 0.05).mean() < 0.08


def test_three_data_sets_with_scenes_of_their_own_hold_their_level(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where Hartung and Knapp's factor was not let below 1, .000 were rejected."""
    monkeypatch.setattr(meta_analysis, "_prediction", lambda y, se: (0.0, 0.0))
    rng, p = np.random.default_rng(58), []
    for _ in range(400):
        y = 0.2 * rng.standard_normal((3, 1, 12)) + 0.25 * rng.standard_normal((3, 10, 1))
        each = moments(y + 0.3 * rng.standard_normal((3, 10, 12)))
        p.append(random_effects(each.mean, each.standard_error).p)
    assert 0.02 < (np.array(p) < 0.05).mean() < 0.08


def test_a_data_set_given_twice_has_the_error_of_its_weight() -> None:
    found = random_effects([0.3, 0.3], [0.1, 0.1])
    assert found.standard_error == pytest.approx(0.1 / np.sqrt(2))


def made(effects: np.ndarray, scenes: list[str], hashes: list[str] | None = None, *, logs: bool = True) -> Report:
    """Return a report with the files that pooling reads."""
    row = {"what": WHAT, "scene": "", "pictures_sha256": "", "effect": effects.mean(), "standard_error": 0.05}
    rows = [
        {"what": WHAT, "scene": scene, "pictures_sha256": one, "effect": effect}
        for scene, effect, one in zip(scenes, effects, hashes or [""] * len(scenes), strict=True)
    ]
    value = {"value": np.exp(effects.mean()) if logs else effects.mean(), "value_low": 0.5, "value_high": 2.0}
    result = {"experiment": "depth_rating", "what": WHAT, "exclusions": "with exclusions", "subjects": 10, **value}
    result |= {"estimate": effects.mean(), "standard_error": 0.1}
    by_scene = json.dumps({"effects": [row, *rows]}).encode()
    files = {"results.json": json.dumps({"simulated": False}).encode(), FILE: by_scene}
    return Report(files, (), (result,))


NAMES = [f"s{number}" for number in range(6)]
EFFECTS = np.random.default_rng(3).normal(0.3, 0.2, 6) + np.random.default_rng(4).normal(0, 0.1, (3, 6))


def pooled(reports: list[Report]) -> tuple[dict[str, float], str]:
    report = combined_report({f"set {number}": one for number, one in enumerate(reports)})
    (result,) = report.results
    return dict(result), report.files["report.md"].decode().replace("\N{NO-BREAK SPACE}", " ")


def test_common_names_are_common_scenes_without_hashes() -> None:
    result, text = pooled([made(one, NAMES) for one in EFFECTS])
    wanted = crossed_effect(EFFECTS)
    assert (result["estimate"], result["p"], result["df"]) == pytest.approx((wanted.estimate, wanted.p, wanted.df))
    assert result["tau"] == pytest.approx(random_effects(EFFECTS.mean(axis=1), [0.05] * 3).tau)
    assert "Over 3 data sets that share scenes, and over 6 scenes, it is" in text


def test_values_that_no_exponential_reaches_are_no_logarithms() -> None:
    result, _ = pooled([made(1000 + one, NAMES, logs=False) for one in EFFECTS])
    assert result["value"] == pytest.approx(1000 + EFFECTS.mean())


def test_hashes_tell_common_scenes_whatever_their_names() -> None:
    """A set with further pictures of a scene has the same scene; other pictures of the same name are others."""
    again = [f"other {name}" for name in NAMES]
    same = [[f"{name}a {name}b" for name in NAMES], [f"{name}b {name}c" for name in NAMES]]
    crossed, _ = pooled([made(EFFECTS[0], NAMES, same[0]), made(EFFECTS[1], again, same[1])])
    assert crossed["p"] == pytest.approx(crossed_effect(EFFECTS[:2]).p)
    others = [[f"{number}{name}" for name in NAMES] for number in range(3)]
    alone, text = pooled([made(one, NAMES, own) for one, own in zip(EFFECTS, others, strict=True)])
    assert alone["p"] == pytest.approx(random_effects(EFFECTS.mean(axis=1), [0.1] * 3).p)
    assert "Over 3 data sets it is" in text


@pytest.mark.parametrize("steps", [False, True])
def test_few_scenes_and_steps_are_pooled_for_these_scenes(steps: bool) -> None:
    effects = EFFECTS if steps else EFFECTS[:, :4]
    reports = [made(one, NAMES[: len(one)]) for one in effects]
    if steps:  # the model of steps has no effects by scene
        for report in reports:
            rows = json.loads(report.files[FILE])["effects"]
            rows = [row | ({"effect": None} if row["scene"] else {}) for row in rows]
            report.files[FILE] = json.dumps({"effects": rows}).encode()
    result, text = pooled(reports)
    assert result["p"] == pytest.approx(random_effects(effects.mean(axis=1), [0.05] * 3).p)
    assert "Over 3 data sets that share scenes, and for these scenes only, it is" in text


@pytest.mark.parametrize("scale", ["ratio", "bipolar"])
def test_effects_by_scene_are_means_over_subjects(scale: str) -> None:
    rng = np.random.default_rng(1)
    rows = [
        (
            f"{who:02}",
            f"s{scene}",
            f"f/{mm:g}" if mm else "pinhole",
            mm,
            focus,
            np.exp(rng.normal(0.02 * mm * scene, 0.1)),
        )
        for who in range(5)
        for scene in range(6)
        for focus in ("nearest", "farthest")
        for mm in (0.0, 5.0, 10.0)
    ]
    names = ["participant_id", "scene", "aperture", "aperture_mm", "fixation", "rating"]
    table = pd.DataFrame(rows, columns=names).assign(trial=range(len(rows)), catch=False, kind="human")
    if scale == "bipolar":
        table["rating"] = np.round(4 * np.log(table["rating"]))
    part = analyse_table(table, scale=scale)
    found = scene_effects(part)
    assert len(found) == 3 * (1 + 6)
    for what, own in found.groupby("what"):
        together, by_scene = own[own["scene"] == ""], own[own["scene"] != ""]
        assert by_scene["effect"].mean() == pytest.approx(together["effect"].item()), what
    near = part.main.slopes[0] if scale == "bipolar" else part.main.fixations[0].rise
    assert near.estimate == pytest.approx(found["effect"].iloc[0])


def test_pictures_of_a_data_set_are_told_by_its_manifest(tmp_path) -> None:
    stimuli = tmp_path / "stimuli"
    stimuli.mkdir()
    files, pictures = {}, []
    for scene in RATING.scenes:
        for aperture in RATING.apertures:
            for fixation in RATING.fixations:
                name = f"{scene}-{aperture.replace('/', '')}-{fixation}.png"
                (stimuli / name).write_bytes(name.encode())
                files[name] = hashlib.sha256(name.encode()).hexdigest()
                pictures.append({"scene": scene, "aperture": aperture, "fixation": fixation, "png": name})
    (stimuli / "manifest.json").write_text(json.dumps({"files": files, "pictures": pictures}))
    rng = np.random.default_rng(2)
    for who in ("01", "02", "03"):
        with Session.begin(
            tmp_path / "data", RATING, who, apparatus=APPARATUS, stimuli=stimuli, kind="human"
        ) as session:
            for trial in session.remaining():
                rating = float(np.exp(rng.normal(0, 0.1)))
                session.record(trial, Rated(onset=5.0 * trial.trial, rating=rating, response_time=1.5))
    found = scene_effects(analyse_ratings(tmp_path / "data"))
    own = found[found["scene"] == RATING.scenes[0]].iloc[0]
    mine = sorted(files[one["png"]] for one in pictures if one["scene"] == RATING.scenes[0])
    assert own["pictures_sha256"].split() == mine
