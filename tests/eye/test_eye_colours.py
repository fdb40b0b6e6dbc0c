"""From colours to cones, against what colours must do whoever works them out."""

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.eye import band_image, band_light, cone_fundamentals, cone_images


def test_white_is_one_for_every_cone_class() -> None:
    assert cone_images(np.full((2, 3, 3), 0.4)) == pytest.approx(0.4)
    assert cone_images(np.full((1, 1, 9), 2.0), wavelength_nm=np.linspace(400, 720, 9)) == pytest.approx(2)


def test_light_adds() -> None:
    first, second = np.random.default_rng(0).random((2, 4, 5, 3))
    assert cone_images(first + 2 * second) == pytest.approx(cone_images(first) + 2 * cone_images(second))


def test_one_wavelength_is_caught_by_its_sensitivity() -> None:
    nm = np.arange(390.0, 781.0, 5.0)
    line = np.zeros((1, 1, nm.size))
    line[0, 0, list(nm).index(550.0)] = 1
    whole = cone_fundamentals(nm).sum(axis=0)
    assert cone_images(line, wavelength_nm=nm)[0, 0] == pytest.approx(cone_fundamentals(550.0) / whole, rel=1e-6)


def test_displays_differ_and_red_is_for_l_cones() -> None:
    red = np.array([[[1.0, 0.0, 0.0]]])
    seen = [cone_images(red, primaries=name)[0, 0] for name in ("Typical CRT Brainard 1997", "Apple Studio Display")]
    assert not np.allclose(*seen, atol=1e-3)
    for one in seen:
        assert one[0] > one[1] > one[2]


def test_l_and_m_together_lie_between_them() -> None:
    cones = cone_images([[[0.9, 0.3, 0.1]]])
    assert cones[0, 0, 1] < band_image(cones, "L+M")[0, 0] < cones[0, 0, 0]
    # As in the band's own light, L cones count for more than half.
    assert band_light("L+M", "D65").effective_wavelength_nm > 540


def test_natural_colours_keep_textures_much_alike() -> None:
    """Grey textures are seen alike by all; independent ones of three primaries are not."""
    random = np.random.default_rng(1)
    grey, own = random.standard_normal((64, 64, 1)), random.standard_normal((64, 64, 3))
    alike = []
    for colour in (0.0, 0.3, 1.0):
        cones = cone_images(1 + 0.1 * (grey + colour * own))
        alike.append(np.corrcoef(band_image(cones, "L+M").ravel(), band_image(cones, "S").ravel())[0, 1])
    assert alike[0] == pytest.approx(1)
    assert alike[0] > alike[1] > alike[2]


@pytest.mark.parametrize(
    ("image", "asked", "said"),
    [
        (np.ones((4, 4)), {}, "H x W x 3"),
        (np.ones((4, 4, 3)), {"primaries": "mine"}, "primaries is 'mine'"),
        (np.ones((4, 4, 2)), {"wavelength_nm": [500, 400]}, "increase"),
        (np.ones((4, 4, 2)), {"wavelength_nm": [300, 400]}, "380"),
    ],
)
def test_bad_input_is_refused(image, asked, said) -> None:
    with pytest.raises(InputError, match=said):
        cone_images(image, **asked)


def test_an_unknown_band_is_refused() -> None:
    with pytest.raises(InputError, match="band is 'X'"):
        band_image(np.ones((2, 2, 3)), "X")


def test_cones_that_catch_nothing_of_a_light_see_nothing() -> None:
    seen = cone_images(np.ones((1, 1, 3)), wavelength_nm=[660.0, 680.0, 700.0])
    assert seen[0, 0].tolist() == pytest.approx([1, 1, 0])
