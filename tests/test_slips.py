"""Slips, each refused in one sentence: wrong units, one thing in place of a list, NaN, no optics, no scene."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from focalgradient import DepthMap, Eye, InputError, Lens, View, cast, render_bands, render_series
from focalgradient.errors import check_list
from focalgradient.eye import (
    Cones,
    Light,
    Oscillation,
    accommodation_views,
    band_views,
    chromatic_difference,
    eye_views,
)
from focalgradient.plotting import depth_figure
from focalgradient.psf import transfer
from focalgradient.render import noisy, render
from focalgradient.scenes import plane, slant

LENS, EYE, WALL, FRAME = Lens(0.025, 4, 1.0), Eye(0.004, 1.0), plane(1.0), ((8, 8), 3e-4)
VIEW = View(np.ones((8, 8)), LENS, 3e-4)
FLAT = np.ones((8, 8), np.float32)
MAP = DepthMap(FLAT, FLAT, FLAT > 0, FLAT > 0)


SLIPS: dict[str, tuple[Callable[[], object], str]] = {
    # units
    "wavelength in metres": (lambda: Eye(0.004, 1.0, 5.5e-7), "wavelength_nm is 5.5e-07, .* give it in nanometres"),
    "light in metres": (lambda: Light(np.array([5e-7]), np.ones(1)), "wavelength_nm is .* give it in nanometres"),
    "chromatic difference": (lambda: chromatic_difference(5.5e-7), "give it in nanometres"),
    "pupil in millimetres": (lambda: Eye(4, 1.0), "pupil_diameter is 4, .* 0.009 .9 mm.: give it in metres"),
    "lens in millimetres": (lambda: Lens(50, 2, 1000), "focal_length is 50 m, .* 0.05 for 50 mm"),
    "pixel in um": (lambda: cast(WALL, LENS, (8, 8), 8.0), "pixel_angle is 8 rad"),
    # one thing, or an array, in place of a list
    "one lens": (lambda: render_series(WALL, LENS, *FRAME), "optics is a Lens, but must be a list of lenses"),  # type: ignore[arg-type]
    "one lens for three": (lambda: render_bands(WALL, LENS, *FRAME), "optics is a Lens, but must be a list"),  # type: ignore[arg-type]
    "one view": (lambda: depth_figure(VIEW, MAP), "views is a View, but must be a list of views"),  # type: ignore[arg-type]
    "an array": (lambda: depth_figure(FLAT, MAP), r"views is an array of shape \(8, 8\), but must be a list"),
    "one kind of cones": (lambda: eye_views(0.5, Cones.of(EYE, "S"), *FRAME), "cones is a Cones, but must be"),  # type: ignore[arg-type]
    "eyes for cones": (lambda: eye_views(0.5, [EYE], *FRAME), "cones holds an Eye, but must hold Cones"),  # type: ignore[list-item]
    "one moment": (
        lambda: accommodation_views(0.5, EYE, 0.1, Oscillation(), *FRAME),  # type: ignore[arg-type]
        "times is 0.1, but must be a list of seconds",
    ),
    # no optics, no scene, no frame
    "a lens for an eye": (lambda: band_views(0.5, LENS, *FRAME), "eye is a Lens, but must be an Eye"),  # type: ignore[arg-type]
    "no optics": (lambda: cast(WALL, "50 mm", *FRAME), "optics is '50 mm', but must be a Lens, an Eye"),
    "no scene": (lambda: render(2.0, LENS, *FRAME), "scene is 2.0, but must be a Scene"),
    "one side": (lambda: cast(WALL, LENS, 8, 3e-4), "shape is 8, but must be a positive height and width"),
    # not a number
    "noise": (lambda: noisy(VIEW, sd=math.nan, seed=0), "sd is nan"),
    "distance": (lambda: plane(math.nan), "distance is nan"),
    "field": (lambda: slant(1.0, 2.0, field=math.nan), "field is nan"),
    "frequency": (lambda: transfer(math.nan, 1.0, "disc"), "frequency contains NaN"),
    "radius": (lambda: transfer(0.1, [1.0, math.nan], "disc"), "radius contains negative or NaN values"),
    "negative radius": (lambda: transfer(0.1, -1.0, "gaussian"), "radius contains negative or NaN values"),
    "k": (
        lambda: transfer(0.1, 1.0, "gaussian", k=math.nan),
        "k is nan, but must be a positive number, sigma / disc radius",
    ),
    "frequency of cones": (lambda: Cones.of(EYE, "S").transfer(math.nan, 1.0), "frequency contains NaN"),
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
