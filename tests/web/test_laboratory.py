"""One data set of laboratory and browser: a factor of the report, screens with their uncertainty, Fig. 3 in arcmin."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from participant import DEPTH, NECKER, Participant, client_of, study

from focalgradient.dataset import Apparatus, Press, Rated, Session, Watched, validate
from focalgradient.report import make_report

SCREEN = Apparatus("seconds", screen_px=(1920, 1080), screen_m=(0.53, 0.3), viewing_distance_m=0.57)


def presses(keys: dict[str, str], draws: np.random.Generator) -> list[list[Any]]:
    """One reading, then the other, for all of two seconds."""
    change = draws.uniform(0.6, 1.4)
    one, other = draws.permutation(list(keys.values())).tolist()
    return [[0.0, one, True], [change, one, False], [change, other, True]]


@pytest.mark.slow
@pytest.mark.parametrize("task", [pytest.param("depthrating", marks=pytest.mark.slow), "necker"])
def test_places_are_a_factor_and_screens_have_errors(tmp_path: Path, task: str) -> None:
    made = study(tmp_path, DEPTH.replace("catch_trials = 3", "catch_trials = 0") if task == "depthrating" else NECKER)
    draws = np.random.default_rng(4)
    with client_of(made) as client:
        for _ in range(3):
            someone = Participant(client)
            someone.begin(gamma_matches=[[0.5, 186], [0.25, 136], [0.5, 190], [0.25, 132]])
            for number in range(len(someone.trials)):
                given = someone.message(someone.trials[number], number)
                if task == "necker":
                    given["answer"]["presses"] = presses(made.design.keys_of("001"), draws)
                assert someone.ask("answer", **given).status_code == 200
            someone.ask("finish")
    stimuli = tmp_path / "set" if task == "depthrating" else None
    for label in ("101", "102", "103"):  # as the laboratory's program records them
        with Session.begin(tmp_path / "data", made.design, label, apparatus=SCREEN, stimuli=stimuli) as session:
            for number, trial in enumerate(session.remaining()):
                if task == "necker":
                    pressed = [Press(*one) for one in presses(made.design.keys_of(label), draws)]
                    session.record(trial, Watched(onset=9.0 * number, presses=pressed, trial_duration=2.0))
                else:
                    png = (
                        None
                        if trial.scene.startswith("example")
                        else made.lists.pictures.picture(trial.scene, trial.aperture, trial.fixation).png
                    )
                    rating = 2.0 * draws.uniform(0.8, 1.2)
                    session.record(trial, Rated(onset=9.0 * number, rating=rating, response_time=1.0, stimulus=png))
    assert validate(tmp_path / "data", stimuli).problems == ()
    files = make_report(tmp_path / "data").files
    name = {"depthrating": "depth_rating", "necker": "necker"}[task]
    assert "answer by place,browser less laboratory" in files["results.csv"].decode()
    screens = pd.read_csv(pd.io.common.BytesIO(files[f"{name}_screens.csv"]))
    browser = screens[screens["place"] == "browser"]
    assert (browser["distance_sd_cm"] / browser["distance_cm"]).between(0.07, 0.09).all()
    # Of the angle of a pixel the card is no part: blind spot and picture are counted in the same pixels.
    assert (browser["pixel_arcmin_sd"] / browser["pixel_arcmin"]).between(0.07, 0.085).all()
    assert browser["gamma"].to_numpy() == pytest.approx(2.22, abs=0.01)
    assert browser["gamma_sd"].to_numpy() == pytest.approx(0.08, abs=0.01)
    assert "gamma by matching greys" in files["report.md"].decode()
    laboratory = screens[screens["place"] == "laboratory"]
    assert laboratory["pixel_arcmin"].to_numpy() == pytest.approx(60 * np.degrees(np.arctan(0.53 / 1920 / 0.57)))
    assert (laboratory["pixel_arcmin_sd"] == 0).all()
    assert re.search(r"\d ± \d", files["report.md"].decode())
    assert ("depth_rating_blur.png" in files) == (task == "depthrating")
