"""Dual pixels: the halves' law, depth with its side from one shot, and calibration from a sheet."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy import special

from focalgradient import InputError, Lens, View, recover_depth
from focalgradient.calibration import calibrate_dual_pixel
from focalgradient.optics import DualPixel, check_optics
from focalgradient.optics.dual_pixel import half_transfer
from focalgradient.photographs import read_views

LENS = Lens(0.05, 4.0, 0.95, focus_tolerance=0.02, aperture_tolerance=0.03, field_tolerance=0)
PITCH = 46.9e-6
ANGLE = PITCH / LENS.sensor_distance
SHAPE = (192, 256)


def halves(
    vergence: float, asymmetry: float = 0.35, seed: int = 0, noise: float = 0.003, field: tuple = (0.0,) * 5
) -> list[np.ndarray]:
    """Left and right picture of a textured sheet, their brightness uneven as vignetting makes it."""
    rng = np.random.default_rng(seed)
    down, across = np.fft.fftfreq(SHAPE[0])[:, None], np.fft.rfftfreq(SHAPE[1])
    texture = np.fft.rfft2(rng.standard_normal(SHAPE)) / np.maximum(np.hypot(down, across), 1 / 64)
    pictures = []
    ramp = np.linspace(-0.05, 0.05, SHAPE[1])
    for sign in (1, -1):
        optics = DualPixel(LENS, sign * asymmetry)
        image = np.fft.irfft2(texture * optics.optical_transfer(down / ANGLE, across / ANGLE, vergence), SHAPE)
        image = 0.5 + 0.1 * image / image.std()
        pictures.append(image * (1 + sign * ramp) + noise * rng.standard_normal(SHAPE))
    return pictures


def views(pictures: list[np.ndarray], optics: tuple[DualPixel, DualPixel]) -> list[View]:
    return [View(image, one, ANGLE) for image, one in zip(pictures, optics, strict=True)]


def test_transfer_is_that_of_a_weighted_disc() -> None:
    """Against the sum over the disc's points itself, and near points go to the right in the left view."""
    optics, vergence = DualPixel(LENS, 0.4), 1.6
    radius = (vergence - LENS.focus_vergence) * LENS.aperture_diameter / 2
    x, y = np.meshgrid(*2 * [np.linspace(-radius, radius, 801)])
    inside = np.hypot(x, y) <= radius
    weight = inside * (1 + 0.4 * x / radius)
    for fx, fy in ((60.0, 0.0), (40.0, 90.0), (0.0, 80.0)):
        direct = (weight * np.exp(-2j * np.pi * (fx * x + fy * y))).sum() / inside.sum()
        assert complex(optics.optical_transfer(fy, fx, vergence)) == pytest.approx(direct, abs=0.004)
    assert (weight * x).sum() > 0  # the centroid lies to the right
    check_optics(optics, vergences=[0.5, 1.6], frequency=0.5 / ANGLE)


def test_halves_are_alike_in_focus_and_displaced_by_little_blur_as_bessel_functions_state() -> None:
    y, x = np.meshgrid(np.linspace(-400, 400, 5), np.linspace(-400, 400, 5), indexing="ij")
    for radius in (0.0, 1e-12):
        even, odd = half_transfer(y, x, radius)
        np.testing.assert_allclose(even, 1, atol=1e-9)
        np.testing.assert_allclose(odd, 0, atol=1e-9)
    for z in (1e-4, 5e-3, 0.02, 0.5):  # on either side of the change from a series to the functions
        odd = half_transfer(np.array([0.0]), np.array([1.0]), z / (2 * np.pi))[1]
        assert odd == pytest.approx(2 * special.jv(2, z) / z, rel=1e-5)
    assert DualPixel(LENS, 0.3).uniform
    assert not DualPixel(LENS, 0.3, field=(0.0, 0.0, 0.0, 0.1, 0.0)).uniform


@pytest.mark.parametrize("vergence", [0.3, 0.9, 1.2, 1.7])
def test_depth_and_its_side_come_from_one_shot(vergence: float) -> None:
    depth = recover_depth(views(halves(vergence), DualPixel.pair(LENS, 0.35)))
    assert depth.details["method"] == "dual-pixels"
    assert depth.valid.mean() > 0.95
    error = (depth.vergence - vergence)[depth.valid]
    assert abs(np.median(error)) < 0.02
    assert (np.abs(error) < 2 * depth.vergence_sd[depth.valid]).mean() > 0.9
    # Focus, and aperture times asymmetry, are shared by all pixels.
    expected = np.hypot(0.02 * LENS.focus_vergence, 0.03 * (vergence - LENS.focus_vergence))
    assert np.median(depth.common_sd[depth.valid]) == pytest.approx(expected, rel=0.1)


def test_what_is_masked_does_not_influence_depth_beside_it() -> None:
    """A lamp 20 times as bright as the sheet, in both halves, is masked: depth elsewhere is that of the sheet."""
    mask = np.ones(SHAPE, bool)
    mask[60:120, 100:160] = False
    pictures = [np.where(mask, picture, 10.0) for picture in halves(0.9)]
    masked = [replace(view, mask=mask) for view in views(pictures, DualPixel.pair(LENS, 0.35))]
    depth = recover_depth(masked)
    assert depth.valid[mask].mean() > 0.8
    assert not depth.valid[~mask].any()
    assert abs(np.median((depth.vergence - 0.9)[depth.valid])) < 0.02


def test_a_sheet_calibrates_asymmetry() -> None:
    sheet = views(halves(1.6, asymmetry=0.27), DualPixel.pair(LENS))
    found = calibrate_dual_pixel(sheet, 1 / 1.6)
    assert found.left.asymmetry == pytest.approx(0.27, abs=0.01)
    assert found.right.asymmetry == -found.left.asymmetry
    assert np.abs(found.left.over(SHAPE) - 1).max() < 0.06
    depth = recover_depth(views(halves(0.6, asymmetry=0.27, seed=5), (found.left, found.right)))
    assert np.median(depth.vergence[depth.valid]) == pytest.approx(0.6, abs=0.02)


def test_asymmetry_that_varies_over_the_field_is_used() -> None:
    """Two sheets at one distance, whose halves differ more in the middle than at the sides: one even depth."""
    left, right = halves(1.6, asymmetry=0.36)
    less = halves(1.6, asymmetry=0.24)
    x = np.abs(np.linspace(-1, 1, SHAPE[1]))
    pictures = [np.where(x < 0.5, more, few) for more, few in zip((left, right), less, strict=True)]
    flat = recover_depth(views(pictures, DualPixel.pair(LENS, 0.36)))
    varied = recover_depth(views(pictures, DualPixel.pair(LENS, 0.36, (0.0, 0.0, -0.45, 0.0, 0.0))))
    middle, side = np.s_[40:-40, 112:144], np.s_[40:-40, 8:24]
    spread = [abs(np.median(one.vergence[middle]) - np.median(one.vergence[side])) for one in (flat, varied)]
    assert spread[0] > 0.08
    assert spread[1] < 0.5 * spread[0]


def test_exchanged_halves_and_sheets_in_focus_are_refused() -> None:
    left, right = DualPixel.pair(LENS)
    with pytest.raises(InputError, match="exchanged"):
        calibrate_dual_pixel(views(halves(1.6)[::-1], (left, right)), 1 / 1.6)
    with pytest.raises(InputError, match="farther from the plane of focus"):
        calibrate_dual_pixel(views(halves(1.06), (left, right)), 0.94)
    with pytest.raises(InputError, match="a left and a right view"):
        calibrate_dual_pixel(views(halves(1.6), (left, left)), 1 / 1.6)
    for wrong, words in (({"asymmetry": 2.0}, "from -1 to 1"), ({"field": (1.0,)}, "five finite numbers")):
        with pytest.raises(InputError, match=words):
            DualPixel(LENS, **wrong)


def test_settings_files_name_halves(tmp_path: Path) -> None:
    for name, image in zip("lr", halves(1.6), strict=True):
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.clip(image * 65535, 0, 65535).astype(np.uint16))
    text = '[camera]\nfocal_length_mm = 50\npixel_pitch_um = 46.9\nencoding = "linear"\n'
    text += "dual_pixel_asymmetry = 0.35\n"
    for name, half in (("l", "left"), ("r", "right")):
        text += f'[[view]]\nimage = "{name}.png"\nhalf = "{half}"\nf_number = 4\nfocus_distance_m = 0.95\n'
    (tmp_path / "views.toml").write_text(text)
    seen = read_views(tmp_path / "views.toml")
    assert [view.optics.asymmetry for view in seen] == [0.35, -0.35]
    depth = recover_depth(seen)
    assert np.median(depth.vergence[depth.valid]) == pytest.approx(1.6, abs=0.02)
