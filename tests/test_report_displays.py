"""The table of screens in a report: angles of pixels, distances and gamma, with their errors."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from focalgradient.dataset import DataSet, Files
from focalgradient.report.displays import blur_seen, screens, screens_sheet


def test_screens_have_their_angles_with_errors_of_the_card_and_the_blind_spot() -> None:
    """A pixel of 0.25 mm at 0.5 m; the card's error of 1 % cancels from the distance's of 4 %."""
    apparatus = {"screen_px": [1920, 1080], "screen_m": [0.48, 0.27], "viewing_distance_m": 0.5}
    errors = {"screen_sd_m": [0.0048, 0.0027], "viewing_distance_sd_m": 0.02, "gamma_seen": [2.1, 0.1]}
    sittings = {
        "01": {"Sittings": [{"Versions": {"psychopy": "1"}, "Apparatus": apparatus | {"gamma": 2.2}}]},
        "02": {"Sittings": [{"Versions": {"browser": "1"}, "Apparatus": apparatus | errors}]},
        "03": {"Sittings": [{"Versions": {"browser": "1"}, "Apparatus": apparatus}], "Simulated": True},
        "04": {"Sittings": [{"Versions": {}, "Apparatus": {}}]},
    }
    sidecars = {Files(Path(), "depthrating", participant): each for participant, each in sittings.items()}
    seen = screens(DataSet(Path(), pd.DataFrame(), {}, sidecars, ()))
    (made,) = screens_sheet(seen, "own")
    found = made.digits.set_index("participant_id")
    assert list(found["place"]) == ["laboratory", "browser", "laboratory"]
    arcmin = 60 * np.degrees(np.arctan(0.00025 / 0.5))
    relative = np.sqrt(0.04**2 - 0.01**2)
    expected = {
        "distance_cm": (50.0, 50.0),
        "distance_sd_cm": (0.0, 2.0),
        "pixels_per_degree": (60 / arcmin,) * 2,
        "pixels_per_degree_sd": (0.0, 60 / arcmin * relative),
        "pixel_arcmin": (arcmin,) * 2,
        "pixel_arcmin_sd": (0.0, arcmin * relative),
        "gamma": (2.2, 2.1),
        "gamma_sd": (0.0, 0.1),
    }
    for name, values in expected.items():
        assert tuple(found.loc[["sub-01", "sub-02"], name]) == pytest.approx(values), name
    shown = {row[0]: row[3:] for row in made.table.rows}
    assert shown["sub-01"] == ["50.0", "34.9", "1.72", "2.20"]
    assert shown["sub-02"] == ["50.0 ± 2.0", "34.9 ± 1.4", "1.72 ± 0.067", "2.10 ± 0.10"]
    assert shown["sub-04"] == ["–"] * 4
    assert found.loc["sub-04", ["distance_cm", "pixel_arcmin", "gamma"]].isna().all()
    assert screens_sheet(seen[2:], "own") == []


def test_blur_is_that_of_the_pictures_largest_by_the_angles_of_the_screens(tmp_path: Path) -> None:
    """Pictures of two scenes whose largest blur is 2 and 4 px; screens of pixels of 1 and 2 arcmin, without errors."""
    sidecars = {}
    for who, arcmin in (("01", 1), ("02", 2)):
        apparatus = {"screen_px": [1000, 1], "screen_m": [1000 * np.tan(np.radians(arcmin / 60)), 1]}
        sitting = {"Versions": {}, "Apparatus": apparatus | {"viewing_distance_m": 1.0}}
        sidecars[Files(tmp_path, "depthrating", who)] = {"Sittings": [sitting], "StimuliSHA256": "0" * 64}
    data = DataSet(tmp_path, pd.DataFrame(), {}, sidecars, ())
    seen, people = screens(data), ["sub-01", "sub-02"]
    assert blur_seen(data, seen, people) == {}  # the manifest is not there
    manifest = next(iter(sidecars)).manifest("0" * 64)
    manifest.parent.mkdir()
    pictures = [{"aperture": "f/4", "blur_px": [1.0, 2.0]}, {"aperture": "f/4", "blur_px": [4.0, 3.0]}]
    manifest.write_text(json.dumps({"pictures": pictures}))
    assert blur_seen(data, seen, people)["f/4"] == pytest.approx((3 * 1.5, 3 * 0.5))
    assert blur_seen(data, seen, ["sub-02"])["f/4"] == pytest.approx((3 * 2, 0), abs=1e-9)
