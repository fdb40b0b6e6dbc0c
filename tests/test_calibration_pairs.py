"""Calibration by equalising pairs: a sheet of any texture at some distances predicts another distance."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from focalgradient import InputError, Lens
from focalgradient.calibration import Priors, Reading, calibrate_pairs, disc_radius, likeliest_shape, pair_blur
from focalgradient.psf import Blend, Disc, Gaussian

sys.path.insert(0, str(Path(__file__).parent / "depth"))
from blurred import PIXEL, wall

MARKS = (16.0, 5.6)
SCALE = 1.06  # the marks are off by this
FOCUS = 0.8  # m, not told
PITCH = 8e-6


def sheet(distance: float, *, psf: str = "disc", seed: int = 1):
    return wall([Lens(0.025, SCALE * mark, FOCUS) for mark in MARKS], distance, seed=seed, psf=psf, noise=0.005)


def reading(distance: float, psf: str = "disc") -> Reading:
    blur = pair_blur(sheet(distance, psf=psf, seed=int(100 * distance)), MARKS, psf)
    unit = 0.5 * PIXEL * Lens(0.025, 5.6, FOCUS).sensor_distance
    return Reading(distance, min(MARKS), None, blur.radius * unit, blur.radius_sd * unit)


def test_the_blur_of_a_whole_sheet():
    blur = pair_blur(sheet(1.2, psf="gaussian"), MARKS, "gaussian")
    true = float(Lens(0.025, SCALE * 5.6, FOCUS).blur_radius(1.2)) / PIXEL
    assert blur.radius == pytest.approx(true, abs=max(0.01, 4 * blur.radius_sd))
    assert blur.radius_sd < 0.02


def test_distances_predict_another_to_a_fiftieth_of_a_dioptre():
    priors = Priors(offset_sd=0.001, distance_sd=0.001)
    camera = calibrate_pairs([reading(d) for d in (1.0, 1.6)], MARKS, 0.025, PITCH, priors)
    held = camera.predict(reading(2.4))
    assert held.vergence == pytest.approx(1 / 2.4, abs=0.02)
    assert abs(held.vergence - 1 / 2.4) < 3 * held.vergence_sd
    # f-numbers and focus come out as they are, and the narrow mark shares the wide one's scale.
    assert camera.f_numbers[5.6] == pytest.approx(SCALE * 5.6, rel=0.02)
    assert camera.f_numbers[16.0] / camera.f_numbers[5.6] == pytest.approx(16 / 5.6)
    assert 1 / camera.focus[None] == pytest.approx(FOCUS, abs=0.03)
    assert camera.covariance.shape == (6, 6)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("psf", "found"), [("disc", {Disc()}), ("gaussian", {Gaussian(), Blend(0.45)})])
def test_the_shape_is_found(psf, found):
    assert likeliest_shape([(sheet(1.3, psf=psf), MARKS)]) in found


def test_pairs_that_show_nothing_are_refused():
    with pytest.raises(InputError, match="half a stop"):
        pair_blur(sheet(1.3), (5.6, 5.6))
    with pytest.raises(InputError, match="no difference of blur"):
        pair_blur(sheet(FOCUS), MARKS)


SQUARES = Path(__file__).parents[1].parent / "shared" / "data" / "printed_squares"


@pytest.mark.slow
@pytest.mark.skipif(not SQUARES.exists(), reason="the photographs are not beside the repository (shared/data)")
def test_printed_squares_predict_exposures_that_were_left_out(tmp_path):
    from command_line import succeed

    text = "[camera]\nfocal_length_mm = 18.0\npixel_pitch_um = 4.7\nencoding = 'srgb'\n"
    for cm in (50, 150):
        for number in (10, 16):
            for exposure in (1, 2):
                text += f"[[view]]\nimage = '{SQUARES / f'{cm}cm-f{number}-{exposure}.jpg'}'\n"
                text += f"distance_m = {cm / 100}\nf_number = {number}\n"
    (tmp_path / "targets.toml").write_text(text)
    done = succeed("calibrate", tmp_path / "targets.toml", "--out", tmp_path / "c.toml", "--method", "equalise")
    line = next(line for line in done.output.splitlines() if line.endswith("D") and "without it:" in line)
    assert float(line.split()[-2]) <= 0.06
    assert "Shape of the blur" in done.output


def test_one_sheet_that_confirms_the_focus_mark_predicts_another_distance() -> None:
    """Its common error at another distance: the stated sd was 0.13 D, the errors are 0.05 D."""
    rng = np.random.default_rng(1)
    sizes, sds = [], []
    for _ in range(30):
        offset, scale = 0.06 * rng.standard_normal(), np.exp(0.05 * rng.standard_normal())
        focus = (1 + 0.07 * rng.standard_normal()) / (1.0 + offset)
        width = 0.5 * disc_radius(0.05, 4 * scale, focus, 1 / (0.6 + offset))
        readings = [Reading(0.6, 4.0, 1.0, float(width), 0.005 * float(width))]
        camera = calibrate_pairs(readings, (4.0, 20.0), 0.05, 5e-6)
        other = 1 / (0.9 + offset)
        seen = disc_radius(0.05, 4 * scale, focus, other)
        stop, mark = camera.f_numbers[4.0], camera.focus[1.0]
        vergence = mark - np.sign(focus - other) * seen / float(disc_radius(0.05, stop, mark, mark - 1))
        settings = [(4.0, 1.0), (20.0, 1.0)]
        sds.append(float(camera.systematic_sd(settings, vergence, "disc", of="distance")) * vergence**2)
        sizes.append(abs(1 / vergence - camera.offset - 0.9) * vergence**2)
    assert np.median(sds) < 0.1
    assert np.mean(np.array(sizes) < 2 * np.array(sds)) > 0.9
