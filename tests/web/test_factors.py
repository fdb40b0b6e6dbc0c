"""Factors of a design in the browser: each level's own picture, blocks, and the data set and report that come of it."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from participant import DEPTH, Hurried, Participant, client_of
from PIL import Image

from focalgradient import InputError
from focalgradient.dataset import validate
from focalgradient.design import load_design
from focalgradient.report import make_report
from focalgradient.stimuli import import_pictures
from focalgradient.web import Lists, People, Study

FACTOR = '\n[factors.weather]\nlevels = ["sun", "rain"]\n'
CHANGED = {
    'scenes = ["spheres-01", "spheres-02"]': 'scenes = ["höhle", "yard"]\nstandard_scene = "street"',
    "longest_run = 4": "longest_run = 8",
    "catch_trials = 3": 'catch_trials = 3\nfixations = ["middle"]\nreference = "same-scene"',
}


def written(folder: Path, *, factor: str = FACTOR) -> tuple[Path, Path]:
    """A design, and its set of imported pictures of which no depth is known; each picture has its own grey."""
    folder.mkdir(exist_ok=True)
    text = DEPTH
    for old, new in CHANGED.items():
        assert old in text
        text = text.replace(old, new)
    (folder / "design.toml").write_text(text + factor, encoding="utf-8")
    rows = []
    for number, (scene, aperture, weather) in enumerate(
        (scene, aperture, weather)
        for scene in ("höhle", "yard", "street")
        for aperture in ("pinhole", "f/5.6")
        for weather in ("sun", "rain")
    ):
        name = f"{number}.png"
        Image.fromarray(np.full((48, 64, 3), 60 + 10 * number, np.uint8)).save(folder / name)
        place = ("", "", "") if aperture == "pinhole" else ("middle", 32, 24)
        rows.append((name, scene, aperture, *place, weather))
    with (folder / "pictures.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([("file", "scene", "aperture", "fixation", "x_px", "y_px", "weather"), *rows])
    import_pictures(folder, folder / "pictures.csv", folder / "set")
    return folder / "design.toml", folder / "set"


def made(folder: Path, factor: str = FACTOR) -> Study:
    design, stimuli = written(folder, factor=factor)
    study = Study(load_design(design), folder / "data", People(folder / "links.jsonl"), stimuli=stimuli)
    study.clock = Hurried()
    return study


def rating(trial: Any) -> float:
    """That of somebody who attends: right at catch trials, and else a little different from trial to trial."""
    if trial.catch:
        return 0.4 if trial.scene == "example-flat" else 2.5 if trial.scene == "example-deep" else 1.0
    return 1.2 + 0.05 * (trial.trial % 5)


@pytest.mark.slow
def test_each_level_shows_its_own_picture_and_the_report_compares_levels(tmp_path: Path) -> None:
    study = made(tmp_path)
    table = csv.DictReader((tmp_path / "pictures.csv").read_text(encoding="utf-8").splitlines())
    source = {(row["scene"], row["aperture"], row["weather"]): row["file"] for row in table}
    with client_of(study) as client:
        for participant in ("001", "002", "003"):
            someone = Participant(client)
            assert someone.begin().status_code == 200
            planned = study.design.trials(participant)
            for number, trial in enumerate(planned):
                shown = someone.entry(number)
                if "example" not in trial.scene:
                    wanted = tmp_path / source[trial.scene, trial.aperture, trial.factors["weather"]]
                    content = someone.picture(shown["intervals"][-1]["url"])
                    with Image.open(wanted) as image, Image.open(io.BytesIO(content)) as given:
                        assert np.array_equal(np.array(image), np.array(given))
                told = someone.message(shown, number)["answer"] | {"rating": rating(trial)}
                assert someone.answer(number, answer=told).status_code == 200
            assert someone.ask("finish").status_code == 200
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    report = make_report(tmp_path / "data")
    assert "weather" in report.files["results.csv"].decode()


@pytest.mark.parametrize(
    ("factor", "wanted"),
    [
        (FACTOR.replace("weather", "season"), "factors names 'season', but the pictures in .* have no such column"),
        (FACTOR.replace("rain", "snow"), "has no picture of 'höhle'"),
    ],
)
def test_a_set_without_the_levels_is_refused_before_anybody_takes_part(
    tmp_path: Path, factor: str, wanted: str
) -> None:
    design, stimuli = written(tmp_path, factor=factor)
    with pytest.raises(InputError, match=wanted):
        Lists(load_design(design), stimuli)
