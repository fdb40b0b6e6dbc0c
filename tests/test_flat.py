"""Vignetting, divided out by a flat field or by what the views of one scene differ by."""

import cv2
import numpy as np
import pytest
from scipy import ndimage

from focalgradient import InputError, Lens, View
from focalgradient.photographs import load_settings, read_photograph, read_views
from focalgradient.photographs.vignetting import even_out

ROWS, COLUMNS = np.mgrid[-1:1:120j, -1.4:1.4:168j]
FALL_OFF = (1 + 0.25 * (ROWS**2 + COLUMNS**2)) ** -2  # the law of cosines, to the fourth power: 42 % in the corners
RNG = np.random.default_rng(1)
SCENE = RNG.uniform(0.2, 0.9, FALL_OFF.shape)


def save(path, values):
    path.write_bytes(cv2.imencode(".png", np.rint(65535 * np.clip(values, 0, 1)).astype(np.uint16))[1].tobytes())
    return path


def test_the_fall_off_is_divided_out_and_the_flats_noise_stays_out(tmp_path):
    dim = save(tmp_path / "a.png", SCENE * FALL_OFF)
    noise = 0.02 * RNG.standard_normal(FALL_OFF.shape)
    flat = save(tmp_path / "flat.png", 0.8 * FALL_OFF * (1 + noise))
    evened = read_photograph(dim, flat=flat).luminance
    ratio = evened / SCENE
    assert FALL_OFF.max() / FALL_OFF.min() > 2.3
    np.testing.assert_allclose(ratio / ratio.mean(), 1, atol=0.015)
    assert ratio.mean() == pytest.approx(FALL_OFF.mean(), rel=0.02)  # the mean brightness is kept, about


def test_what_is_saturated_stays_at_one_ceiling(tmp_path):
    values = SCENE * FALL_OFF
    values[:6, :20] = values[60:66, 80:100] = 1.0
    flat = save(tmp_path / "flat.png", 0.8 * FALL_OFF)
    with pytest.warns(match="saturated"):
        evened = read_photograph(save(tmp_path / "a.png", values), flat=flat).luminance
    assert np.array_equal(evened == evened.max(), values == 1.0)


def test_a_settings_file_names_a_flat_for_each_view(tmp_path):
    save(tmp_path / "a.png", SCENE * FALL_OFF)
    save(tmp_path / "b.png", SCENE)
    save(tmp_path / "flat.png", 0.8 * FALL_OFF)
    shot = 'f_number = {n}\nfocus_distance_m = 0.8\nimage = "{name}.png"\n'
    (tmp_path / "v.toml").write_text(
        "[camera]\nfocal_length_mm = 25\npixel_pitch_um = 8\n"
        f'[[view]]\nflat = "flat.png"\n{shot.format(n=4, name="a")}[[view]]\n{shot.format(n=8, name="b")}'
    )
    one, other = read_views(tmp_path / "v.toml")
    ratio = one.image / other.image
    assert ratio.std() / ratio.mean() < 0.01
    assert load_settings(tmp_path / "v.toml").shots[1].flat is None


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (
            np.full((10, 12), 0.5) + 1e-3 * RNG.random((10, 12)),
            r"flat\.png is 12 x 10 pixels but .*a\.png is 168 x 120",
        ),
        (np.where(ROWS > 0.9, 1.0, 0.5), r"flat\.png is saturated \(5"),
        (np.exp(-8 * ROWS**2), r"flat\.png is dark in places \(-?\d"),
    ],
    ids=["size", "saturated", "dark"],
)
@pytest.mark.filterwarnings("ignore:.*saturated:UserWarning")
def test_flats_that_do_not_serve_are_refused(tmp_path, values, said):
    with pytest.raises(InputError, match=said):
        read_photograph(save(tmp_path / "a.png", SCENE), flat=save(tmp_path / "flat.png", values))


# --- Without a flat field: what the views of one scene differ by -------------------------------------------------


def views(gain):
    """A textured scene through f/16 and, dimmed by `gain` and blurred, through f/4."""
    texture = ndimage.gaussian_filter(np.random.default_rng(2).standard_normal((150, 200)), 1.5)
    scene = 0.4 + 0.1 * texture / texture.std()
    seen = (scene, gain * ndimage.gaussian_filter(scene, 2.0))
    lenses = (Lens(0.025, 16, 0.8), Lens(0.025, 4, 0.8))
    return [View(image, lens, 3e-4) for image, lens in zip(seen, lenses, strict=True)]


DOWN, RIGHT = np.mgrid[-1:1:150j, -4 / 3 : 4 / 3 : 200j]


@pytest.mark.parametrize("power", [1.0, 4.0])
def test_what_the_wide_view_lacks_in_its_corners_is_evened_out(power):
    gain = 1.7 * (1 + 0.1 * (DOWN**2 + RIGHT**2)) ** -power
    first, second = views(gain)
    plain = views(1.0)[1].image
    one, two = even_out([first, second])
    assert one is first
    ratio = two.image / plain
    assert ratio.std() / ratio.mean() < 0.01
    assert np.std(gain) / np.mean(gain) > 0.05
    # The order of the views does not matter: the smaller aperture is the truth.
    np.testing.assert_allclose(even_out([second, first])[0].image, two.image)


@pytest.mark.parametrize("magnified", [0.98, 1.02])
def test_light_that_falls_off_in_the_scene_is_not_evened_out_between_two_foci(magnified):
    # The scene is brightest below its middle; with the other focus its pixels are 2 % smaller or larger.
    pair = [
        View(0.1 + np.exp(-((size * DOWN - 0.2) ** 2) - (size * RIGHT) ** 2), Lens(0.025, 5.6, focus), 3e-4 * size)
        for focus, size in ((0.8, 1.0), (2.0, magnified))
    ]
    ratio = even_out(pair)[1].image / pair[1].image
    assert np.ptp(ratio) < 0.003


def test_evening_leaves_out_what_the_mask_does_and_keeps_the_mask():
    gain = (1 + 0.2 * (DOWN**2 + RIGHT**2)) ** -2.0
    first, second = views(gain)
    image, mask = second.image.copy(), np.ones(gain.shape, np.bool_)
    mask[20:60, 30:90] = False
    image[~mask] = 9.0
    evened = even_out([first, View(image, second.optics, second.pixel_angle, mask=mask)])[1]
    assert evened.mask is mask
    ratio = (evened.image / views(1.0)[1].image)[mask]
    assert ratio.std() / ratio.mean() < 0.01
