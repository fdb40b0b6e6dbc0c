"""A view refuses what it cannot stand for."""

from typing import Any

import numpy as np
import pytest

from focalgradient import FocalGradientWarning, InputError, Lens, View

LENS = Lens(focal_length=0.025, f_number=4, focus_distance=1.0)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_shape_is_height_then_width(kind: type) -> None:
    image = np.ones((48, 64), kind)
    view = View(image, LENS, 3e-4)
    assert view.shape == (48, 64)
    assert view.image is image  # neither copied nor converted


def spoiled(*values: float) -> np.ndarray:
    image = np.ones((4, 5))
    image.flat[: len(values)] = values
    return image


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"image": np.ones((4, 5), np.uint8)}, "image is of type uint8, but .*floating-point linear radiance: decode"),
        ({"image": [[1.0, 2.0]]}, "image is of type list"),
        ({"image": np.ones(4)}, r"image has shape \(4,\)"),
        ({"image": spoiled(np.nan, np.inf, -np.inf)}, "image contains 3 NaN or infinite pixels, .*repair or crop"),
        ({"pixel_angle": -3e-4}, r"pixel_angle is -0\.0003"),
        ({"pixel_angle": "3e-4"}, "pixel_angle is '3e-4', but must be"),
        ({"mask": np.ones((4, 5))}, r"mask is a float64 array of shape \(4, 5\), but must be an array of booleans"),
        ({"mask": np.ones((5, 4), np.bool_)}, r"of shape \(5, 4\), but must be .* the image's shape \(4, 5\)"),
        ({"mask": np.zeros((4, 5), np.bool_)}, "mask is False everywhere"),
        ({"optics": "50 mm"}, "optics is .*, but must be a Lens, an Eye or whatever else has an aperture"),
        ({"optics": Lens}, "optics is .*, but must be a Lens, an Eye or whatever else has an aperture"),
    ],
)
def test_what_is_no_view_is_refused(change: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        View(**({"image": np.ones((4, 5)), "optics": LENS, "pixel_angle": 3e-4} | change))


def test_a_mask_says_which_pixels_can_be_used() -> None:
    mask = np.ones((4, 5), np.bool_)
    mask[1, 2] = False
    assert View(np.ones((4, 5)), LENS, 3e-4, mask=mask).mask is mask
    assert View(np.ones((4, 5)), LENS, 3e-4).mask is None


def test_a_pixel_pitch_for_a_pixel_angle_is_warned_of() -> None:
    with pytest.warns(FocalGradientWarning, match=r"pixel_angle is 8e-06 rad, which is 0\.21 um on the sensor, .* pit"):
        View(np.ones((4, 5)), LENS, 8e-6)
    View(np.ones((4, 5)), Lens(0.6, 8, 100.0), 8e-6)  # a long lens has such pixels
