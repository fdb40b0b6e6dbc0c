"""Drawn stimuli as a set: read, checked and shown as the others are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.dataset import check_stimuli
from focalgradient.display import Display
from focalgradient.stimuli import (
    Stimulus,
    corrugated_plane,
    fixated_cube,
    make_from_stimuli,
    slanted_plane,
    texture_border,
)

DISPLAY = Display()
SIZE = {"width_deg": 4, "height_deg": 3, "pixels_per_degree": DISPLAY.pixels_per_degree, "pupil_mm": 5}


@pytest.fixture(scope="module")
def stimuli() -> dict[str, Stimulus]:
    return {
        "plane": slanted_plane(**SIZE),
        "waves": corrugated_plane(**SIZE),
        "border": texture_border(**SIZE, right_blur_arcmin=3.0, border_blur_arcmin=0.0),
    }


def test_a_set_of_drawn_stimuli_is_read_as_others_are(stimuli: dict[str, Stimulus], tmp_path: Path) -> None:
    made = make_from_stimuli(tmp_path / "set", stimuli, display=DISPLAY)
    check_stimuli(made.folder)
    assert made.scenes == tuple(stimuli)
    for name, one in stimuli.items():
        sharp, blurred = (made.picture(name, aperture, "focus") for aperture in ("pinhole", "f/10"))
        np.testing.assert_allclose(made.linear(sharp)[..., 0], one.sharp, atol=1e-6)
        np.testing.assert_allclose(made.linear(blurred)[..., 2], one.picture, atol=1e-6)
        np.testing.assert_array_equal(made.pixels(blurred)[..., 1], DISPLAY.encode(one.picture))
        np.testing.assert_allclose(made.depth(name), one.depth_m, rtol=1e-6)
        target = made.scene(name).target("focus")
        x, y = (int(place) for place in target.position_px)
        assert one.blur_arcmin[y, x] == pytest.approx(one.blur_arcmin.min(), abs=0.05)
        assert target.distance_m == pytest.approx(one.depth_m[y, x])
        assert blurred.aperture_mm == 5
        assert blurred.blur_arcmin[1] == pytest.approx(4 * one.blur_arcmin.max())
    controls = made.manifest["controls"]
    assert controls["sharpest"]["met"]
    assert controls["sharpest"]["worst"] == max(one.controlled["sharpest"] for one in stimuli.values())
    assert controls["mean_luminance_percent"]["worst"] < 1
    files = {path: path.stat().st_mtime_ns for path in made.folder.rglob("*")}
    again = make_from_stimuli(tmp_path / "set", stimuli, display=DISPLAY)
    assert {path: path.stat().st_mtime_ns for path in again.folder.rglob("*")} == files
    other = {**stimuli, "plane": slanted_plane(**SIZE, seed=2)}
    with pytest.raises(InputError, match="contains another set"):
        make_from_stimuli(tmp_path / "set", other, display=DISPLAY)


def test_what_makes_no_set_is_refused(stimuli: dict[str, Stimulus], tmp_path: Path) -> None:
    cube = fixated_cube(edge_deg=4, width_deg=8, height_deg=8, pixels_per_degree=DISPLAY.pixels_per_degree)
    for given, display, said in (
        ({**stimuli, "cube": cube}, DISPLAY, "cube has 288 x 288 pixels and a pupil of 12.0 mm, but the first has 144"),
        (stimuli, Display(distance=1.0), "plane is drawn for 35.95 pixels per degree, but the display has 63.08"),
        (stimuli, Display((120, 100)), "but the display 120 x 100"),
    ):
        with pytest.raises(InputError, match=said) as raised:
            make_from_stimuli(tmp_path / "set", given, display=display)  # type: ignore[arg-type]
        assert "\n" not in str(raised.value)
        assert not (tmp_path / "set").exists()
