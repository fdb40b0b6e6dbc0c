"""The conditions made from a photograph with its depth, and the controls that measure them by another way."""

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from focalgradient import InputError, Lens
from focalgradient.dataset import check_stimuli
from focalgradient.display import Display
from focalgradient.optics import Aperture
from focalgradient.render import blur_picture
from focalgradient.stimuli import StimulusSet, make_from_photographs
from focalgradient.stimuli.controls import against_discs

ANGLE = 2e-3
TEXTURE = gaussian_filter(np.random.default_rng(2).standard_normal((96, 128, 3)), (1, 1, 0))
LIGHT = np.clip(0.4 + 0.5 * TEXTURE, 0.01, 1).astype(np.float32)
SLANT = np.broadcast_to(1 / np.linspace(1.6, 0.5, 128), (96, 128))  # metres, from the left to the right


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> StimulusSet:
    return make_from_photographs(
        tmp_path_factory.mktemp("set"),
        {"wall": (LIGHT, SLANT)},
        pixel_angle=ANGLE,
        apertures=(4, 8),
        display=Display(pixel_pitch=1e-3),
    )


def test_each_condition_is_the_photograph_through_that_lens(made: StimulusSet) -> None:
    check_stimuli(made.folder)
    assert [(one.aperture, one.fixation) for one in made.pictures] == [
        (aperture, end) for end in ("nearest", "farthest") for aperture in ("pinhole", "f/8", "f/4")
    ]
    np.testing.assert_array_equal(made.linear(made.picture("wall", "pinhole", "nearest")), LIGHT)
    np.testing.assert_allclose(made.depth("wall"), SLANT, rtol=1e-6)
    near, far = made.scene("wall").nearest, made.scene("wall").farthest
    assert near.distance_m == pytest.approx(1 / 1.6, rel=0.03)
    assert far.distance_m == pytest.approx(2, rel=0.06)
    one = made.picture("wall", "f/4", "farthest")
    lens = Lens(0.05, 4.0, far.distance_m)
    np.testing.assert_allclose(made.linear(one), blur_picture(LIGHT, SLANT, lens, pixel_angle=ANGLE), atol=1e-5)
    assert one.blur_px[1] == pytest.approx(2 * lens.blur_radius(1 / 1.6) / ANGLE, rel=1e-6)


def test_a_blur_too_wide_is_refused_with_its_radius(tmp_path: Path) -> None:
    radius = Lens(0.05, 1.0, float(SLANT.max())).blur_radius(float(SLANT.min())) / 1e-4
    with pytest.raises(InputError, match=r"the blur is \d+ pixels in radius") as refused:
        make_from_photographs(tmp_path / "set", {"wall": (LIGHT, SLANT)}, pixel_angle=1e-4, apertures=[1.0])
    assert int(str(refused.value).split()[3]) == pytest.approx(radius, rel=0.05)


def test_errors_of_a_depth_map_are_refused_with_the_way_out(tmp_path: Path) -> None:
    """Light and dark patches, and depth with other patches: refused, unless 1 / distance is smoothed."""
    random = np.random.default_rng(1)
    patches, others = (gaussian_filter(random.standard_normal((96, 128)), sd) for sd in (6, 5))
    light = np.where(patches > 0, 0.95, 0.02)[..., None].repeat(3, axis=2).astype(np.float32)
    vergence = np.where(others > 0.05, 2.0, 0.5)
    how = {"pixel_angle": ANGLE, "apertures": [2.8], "display": Display(pixel_pitch=1e-3)}
    with pytest.raises(InputError, match=r"if they do, smooth 1 / distance .* by a Gaussian of 4 pixels"):
        make_from_photographs(tmp_path / "rough", {"wall": (light, 1 / vergence)}, **how)
    smooth = {"wall": (light, 1 / gaussian_filter(vergence, 4))}
    assert make_from_photographs(tmp_path / "smooth", smooth, **how).manifest["controls"]["sharpest"]["met"]


def test_controls_are_measured_and_met(made: StimulusSet) -> None:
    controls = made.manifest["controls"]
    assert set(controls) == {"scenes", "mean_luminance_percent", "shift_px", "spectrum_percent", "sharpest"}
    assert controls["sharpest"]["met"]
    assert controls["shift_px"]["met"]
    assert controls["spectrum_percent"]["met"]
    for one in controls["scenes"]["wall"]["pictures"].values():
        np.testing.assert_allclose(one.get("spectrum", [1])[1:], 1, atol=0.02)  # coarser octaves


def test_controls_find_what_is_wrong() -> None:
    lens, grey = Aperture(0.0125, 1 / 2.0), LIGHT.mean(axis=2)
    right = blur_picture(grey, SLANT, lens, pixel_angle=ANGLE)
    found = against_discs(right, grey, SLANT, lens, ANGLE)
    np.testing.assert_allclose(found["shift_px"], 0, atol=0.02)
    np.testing.assert_allclose(found["spectrum"], 1, atol=0.1)  # the finest octave; see above
    np.testing.assert_allclose(found["spectrum"][1:], 1, atol=0.02)
    moved = against_discs((right + np.roll(right, 1, axis=1)) / 2, grey, SLANT, lens, ANGLE)
    assert moved["shift_px"][0] == pytest.approx(0.5, abs=0.15)  # half a pixel to the right
    sharper = against_discs(
        blur_picture(grey, SLANT, Aperture(0.00625, 0.5), pixel_angle=ANGLE), grey, SLANT, lens, ANGLE
    )
    assert max(sharper["spectrum"]) > 1.1
    steps = np.where(np.arange(128) % 4 < 2, 1.0, 2.0) * np.ones((96, 1))
    assert against_discs(right, grey, steps, lens, ANGLE) == {}  # outlines everywhere


@pytest.mark.parametrize("side", [20, 26, 30, 38])
def test_pictures_that_the_blur_nearly_fills_are_not_measured(side: int) -> None:
    """A disc of 10 pixels' radius leaves 12 pixels to either side of a place out: less than an octave is left."""
    grey, wall = LIGHT[:side, :side, 0], np.full((side, side), 2.0)
    assert against_discs(grey, grey, wall, Aperture(0.04, 1.5), ANGLE) == {}


@pytest.mark.parametrize(
    ("photographs", "said"),
    [
        ({"a": (LIGHT[:, 1:], SLANT[:, 1:])}, "127 x 96 pixels, but both must be even"),
        ({"a": (LIGHT, 0 * SLANT)}, "values that are not positive"),
        ({"yard": (LIGHT, np.where(SLANT > 1, 1e60, SLANT))}, r"yard contains a distance of 1e\+60 m, but .* 32-bit"),
    ],
)
def test_wrong_photographs_are_refused(tmp_path: Path, photographs: dict, said: str) -> None:
    with pytest.raises(InputError, match=said) as raised:
        make_from_photographs(tmp_path / "set", photographs, pixel_angle=ANGLE)
    assert "\n" not in str(raised.value)
    assert not (tmp_path / "set").exists()
