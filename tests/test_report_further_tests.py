"""Tests beside those of the main effects: confidence, factors, and laboratory against browser, with their R scripts."""

import io
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from r_process import needs_r
from recorded import APPARATUS, record_necker
from test_report_scripts import Printed, printed, run
from test_scales import design_of, honest

from focalgradient.dataset import Rated, Session
from focalgradient.report import make_report

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("scale", ["ratio", "visual-analogue"])
def test_confidence_that_rises_with_the_aperture_is_found(tmp_path: Path, scale: str) -> None:
    chance = np.random.default_rng(1)
    factors = {"light": {"levels": ["dim", "bright"]}, "group": {"levels": ["1", "2"], "vary": "between"}}
    for who in range(1, 5):
        design = design_of(scale=scale, confidence=True, factors=factors)
        with Session.begin(tmp_path / "data", design, f"{who:02}", apparatus=APPARATUS) as session:
            for at, trial in enumerate(session.remaining()):
                confidence = 0.3 + 0.04 * trial.aperture_mm + chance.uniform(0, 0.05)
                rating = honest(session.design, trial, chance)
                session.record(trial, Rated(onset=20.0 * at, rating=rating, response_time=1.2, confidence=confidence))
    files = make_report(tmp_path / "data").files
    results = pd.read_csv(io.BytesIO(files["results.csv"]))
    slopes = results[results["name"] == "slope of confidence on aperture"]
    assert slopes["level"].tolist() == ["nearest", "farthest"]
    assert slopes["estimate"].to_numpy() == pytest.approx(0.04, abs=0.004)
    assert slopes["p_corrected"].isna().all()
    said = files["report.md"].decode()
    assert "Confidence was asked after each answer." in said
    assert said.count("slope of confidence on the aperture: 0.04") == 2


@needs_r
def test_r_finds_confidence_factors_and_places(tmp_path: Path) -> None:
    """Four people rated in two lights, with a factor between them; two of them in a browser."""
    test_confidence_that_rises_with_the_aperture_is_found(tmp_path, "bipolar")
    for sidecar in sorted((tmp_path / "data").glob("sub-*/**/*_beh.json"))[2:]:
        content = json.loads(sidecar.read_text("utf-8"))
        content["Sittings"][0]["Versions"] = {"browser": "1"}
        sidecar.write_text(json.dumps(content), "utf-8")
    files = make_report(tmp_path / "data").files
    found = printed(run(tmp_path, {**files}, "further_tests.R"))
    assert {name.rpartition(" ")[2] for name, _ in found} == {"aperture", "light", "group", "place"}
    _in_results(found, files)


@needs_r
def test_r_finds_the_places_of_people_who_watched_the_cube(tmp_path: Path) -> None:
    """Two of five in a browser."""
    root = record_necker(tmp_path / "data", 5)
    for number, sidecar in enumerate(sorted(root.glob("sub-*/**/*_beh.json"))):
        content = json.loads(sidecar.read_text("utf-8"))
        places = {"Simulated": False, "Sittings": [{"Versions": {"browser": "1"} if number < 2 else {}}]}
        sidecar.write_text(json.dumps(content | places), "utf-8")
    files = make_report(root).files
    found = printed(run(tmp_path, {**files}, "necker_places.R"))
    named = ("answer by place", "change with blur by place")
    assert {*found} == {(name, "browser less laboratory") for name in named}
    _in_results(found, files)


def _in_results(found: Printed, files: Mapping[str, bytes]) -> None:
    """Compare what a script prints with the rows of results.csv."""
    rows = pd.read_csv(io.BytesIO(files["results.csv"]), keep_default_na=False).set_index(["name", "level"])
    for key, values in found.items():
        row = rows.loc[key]
        assert (values is None) == bool(row["reason"])
        for name, value in (values or {}).items():
            assert value == pytest.approx(float(row[name]), rel=1e-5), (key, name)
