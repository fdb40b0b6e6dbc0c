"""Cameras from scenes of known depth: what is put in comes out, and depth cameras' errors do not matter."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import run, sentence

from focalgradient import DepthMap, InputError, Lens, View
from focalgradient.calibration import KnownScene, Priors, fit_scenes, score_scene
from focalgradient.psf import Disc

SHAPE, MARKED = (160, 240), 1.7
TRUE_FOCUS, TRUE_SCALE, OFFSET = 1 / 1.57, 1.06, -0.03
PITCH = 36e-6


def lenses() -> list[Lens]:
    return [Lens(0.035, number, MARKED) for number in (8.0, 2.8)]


def scene(seed: int, holes: bool = True, repeat: float = 0.01) -> KnownScene:
    """A room of slanted patches, as the marks on the lens read it, and a depth camera's map with its errors."""
    rng = np.random.default_rng(seed)
    distance = np.empty(SHAPE)
    for i in range(4):
        for j in range(6):
            part = np.s_[40 * i : 40 * i + 40, 40 * j : 40 * j + 40]
            distance[part] = rng.uniform(1.9, 6) + np.linspace(0, rng.uniform(-0.3, 0.3), 40)
    noise = 0.01 * rng.standard_normal((20, 30)).repeat(8, 0).repeat(8, 1)
    focus = TRUE_FOCUS + repeat * rng.standard_normal()
    pair = lenses()
    marked = pair[0].focus_vergence
    read = marked + TRUE_SCALE * (1 / (distance + OFFSET) - focus) + noise
    measured = np.round(distance * (1 + 0.01 * rng.standard_normal(SHAPE)), 3)
    if holes:
        measured[rng.random(SHAPE) < 0.001] = np.nan
        # A depth camera that fills holes from beside them, and blur that takes a neighbour's depth.
        measured[:40, :40] = 2.0
        read[-30:, -60:] = marked - 0.1
    everywhere = np.ones(SHAPE, bool)
    depth = DepthMap(read, np.full(SHAPE, 0.01), everywhere, everywhere, {"method": "equalise", "psf": "disc"})
    views = [View(np.ones(SHAPE), lens, PITCH / lens.sensor_distance) for lens in pair]
    return KnownScene(depth, views, measured, 0.001)


def fit(scenes: list[KnownScene]):
    return fit_scenes(scenes, 0.035, PITCH, [8.0, 2.8], MARKED, Priors(focus_sd=0.1, offset_sd=0.05), Disc())


def test_focus_and_scale_come_out_within_their_uncertainty() -> None:
    found = fit([scene(seed) for seed in range(12)])
    camera = found.calibration
    # Along the direction that scenes between 2 and 6 m leave open, focus, scale and offset go together.
    stated = dict(zip(("k", "own", "offset", "stop", "stop2", "focus"), camera.sd, strict=True))
    assert abs(camera.focus[MARKED] - TRUE_FOCUS) < 2 * stated["focus"]
    assert abs(np.log(camera.f_numbers[2.8] * TRUE_SCALE / 2.8)) < 2 * stated["stop"]
    assert abs(camera.offset - OFFSET) < 2 * stated["offset"]
    assert stated["focus"] < 0.05
    assert found.repeat == pytest.approx(0.01, abs=0.006)
    # What counts: the vergence of a distance that was measured.
    for at in (2.0, 3.0, 5.0):
        ideal = camera.focus[MARKED] + (1 / (at + OFFSET) - TRUE_FOCUS) * TRUE_SCALE * camera.f_numbers[2.8] / 2.8
        assert ideal == pytest.approx(1 / (at + camera.offset), abs=3 * 0.01 / np.sqrt(12))  # by the foci that differ


def test_scenes_left_out_are_predicted() -> None:
    found = fit([scene(seed) for seed in range(8)])
    scores = [score_scene(scene(100 + seed, holes=False), found, [(8.0, MARKED), (2.8, MARKED)]) for seed in range(12)]
    assert all(score is not None for score in scores)
    assert abs(np.mean([score.bias for score in scores])) < 0.01
    assert np.mean([score.within_2_sd for score in scores]) > 0.87  # .93 in the mean of 72 such scenes
    assert np.median([score.median_error for score in scores]) < 0.04


def test_what_lies_nearer_than_focus_is_used_by_the_side_that_is_known() -> None:
    """Views of one focus, searched beyond it, show near things mirrored."""
    scenes = [scene(seed, holes=False) for seed in range(6)]
    for one in scenes:
        one.distance[:80, :80] = 1.2
        near = TRUE_SCALE * (1 / (1.2 + OFFSET) - TRUE_FOCUS)
        one.depth.vergence[:80, :80] = 1 / MARKED - near
    camera = fit(scenes).calibration
    assert camera.focus[MARKED] == pytest.approx(TRUE_FOCUS, abs=0.02)


def test_scenes_without_measured_depth_are_refused() -> None:
    empty = scene(1)
    empty.distance[:] = np.nan
    with pytest.raises(InputError, match="no scene has 30 places"):
        fit([empty])


def test_a_settings_file_with_depth_is_read_as_scenes(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "depth_mm.png"), np.full((40, 50), 2000, np.uint16))
    text = "[camera]\nfocal_length_mm = 35\npixel_pitch_um = 36\n"
    text += '[[view]]\nimage = "a.png"\ndepth = "depth_mm.png"\nf_number = 8\nfocus_distance_m = 1.7\n'
    text += '[[view]]\nimage = "b.png"\ndepth = "depth_mm.png"\nf_number = 8\nfocus_distance_m = 1.7\n'
    (tmp_path / "scenes.toml").write_text(text)
    assert "one f-number only" in sentence(run("calibrate", tmp_path / "scenes.toml", "--out", tmp_path / "c.toml"))
