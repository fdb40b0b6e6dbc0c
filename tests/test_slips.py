"""Slips, each refused in one sentence: wrong units, one thing in place of a list, NaN, no optics, no scene."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from focalgradient import DepthMap, Eye, InputError, Lens, cast, render_bands
from focalgradient.errors import check_list
from focalgradient.eye import band_views, chromatic_difference, eye_views
from focalgradient.plotting import depth_figure
from focalgradient.psf import transfer
from focalgradient.scenes import plane

LENS, EYE, WALL, FRAME = Lens(0.025, 4, 1.0), Eye(0.004, 1.0), plane(1.0), ((8, 8), 3e-4)
FLAT = np.ones((8, 8), np.float32)
MAP = DepthMap(FLAT, FLAT, FLAT > 0, FLAT > 0)


SLIPS: dict[str, tuple[Callable[[], object], str]] = {
    "wavelength in metres": (lambda: Eye(0.004, 1.0, 5.5e-7), "wavelength_nm is 5.5e-07, .* give it in nanometres"),
    "chromatic difference": (lambda: chromatic_difference(5.5e-7), "give it in nanometres"),
    "pixel in um": (lambda: cast(WALL, LENS, (8, 8), 8.0), "pixel_angle is 8 rad"),
    "one lens for three": (lambda: render_bands(WALL, LENS, *FRAME), "optics is a Lens, but must be a list"),
    "an array": (lambda: depth_figure(FLAT, MAP), r"views is an array of shape \(8, 8\), but must be a list"),
    "eyes for cones": (lambda: eye_views(0.5, [EYE], *FRAME), "cones holds an Eye, but must hold Cones"),
    "no optics": (lambda: cast(WALL, "50 mm", *FRAME), "optics is '50 mm', but must be a Lens, an Eye"),
    "one side": (lambda: cast(WALL, LENS, 8, 3e-4), "shape is 8, but must be a positive height and width"),
    "distance": (lambda: plane(math.nan), "distance is nan"),
    "frequency": (lambda: transfer(math.nan, 1.0, "disc"), "frequency contains NaN"),
    "k": (lambda: transfer(0.1, 1.0, "gaussian", k=math.nan), "k is nan, but must be a positive number, sigma / disc"),
    "wall": (lambda: band_views(math.nan, EYE, *FRAME), "scene is nan"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_refused_in_one_sentence(slip: str) -> None:
    call, said = SLIPS[slip]
    with pytest.raises(InputError, match=said) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert str(caught.value).endswith(".")
    assert " --" not in str(caught.value)  # options are the command line's


def test_sequences_of_any_kind_are_lists() -> None:
    assert check_list("views", (1, 2), "views") == [1, 2]
    assert check_list("views", (n for n in (1, 2)), "views") == [1, 2]
    for bad in ("ab", {"a": 1}, None):
        with pytest.raises(InputError, match=r"views is .*, but must be a list of views"):
            check_list("views", bad, "views")
