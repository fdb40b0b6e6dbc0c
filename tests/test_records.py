"""Records print in a few words, and summarise themselves in a few lines."""

from pathlib import Path

import numpy as np
import pytest

from focalgradient import Eye, Lens, View, cast
from focalgradient.calibration import Calibration
from focalgradient.eye import GaussianFit, Light
from focalgradient.photographs import Photograph
from focalgradient.render import Rendered, render
from focalgradient.scenes import plane, spheres

LENS = Lens(0.025, 4, 1.0)
CALIBRATION = Calibration(
    *(0.05, 4e-6, 0.48, 2e-12, 0.03),
    f_numbers={4.0: 4.1, 8.0: 8.2},
    focus={None: 1.02},
    model_error=0.05,
    covariance=np.diag([0.01, 0.25, 1e-4, 4e-4, 4e-4, 1e-4]),
    informed=np.ones(6),
)


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (View(np.ones((48, 64)), LENS, 3e-4), "View(48 x 64 pixels of 0.0003 rad, 6.25 mm aperture, focus at 1 D)"),
        (View(np.ones((2, 2)), Eye(0.004, 2.0), 3e-4, mask=np.eye(2) > 0), "2 D, 50.0% masked)"),
        (Light(np.arange(400.0, 701.0), np.ones(301)), "Light(301 wavelengths, 400 to 700 nm, focused as 5"),
        (
            Photograph(Path("x/a.png"), np.ones((9, 8), np.float32), "srgb", "uint8", 0.25),
            "Photograph(a.png: 9 x 8 pixels, uint8, srgb, 25.0% saturated)",
        ),
        (CALIBRATION, "Calibration(50 mm, k = 0.48, 2 apertures, 1 foci)"),
    ],
    ids=lambda record: type(record).__name__,
)
def test_a_record_prints_short(record: object, words: str) -> None:
    assert words in repr(record)
    assert len(repr(record)) < 120


def test_a_rendered_view_tells_its_distances_and_noise() -> None:
    rendered = render(plane(2.0), LENS, (48, 64), 3e-4, engine="cast", samples=8)
    assert repr(rendered).endswith("focus at 1 D), 2 to 2 m)")
    view, distance, light = rendered.summary().splitlines()
    assert view == repr(rendered.view)
    assert "median 2 m (blur disc 5.21 pixels in radius)" in distance  # 3.125 mm x 0.5 D / 0.0003
    assert light.endswith(f"noise {rendered.noise / rendered.view.image.mean():.2%} of it")


def test_empty_pixels_are_counted() -> None:
    rendered = cast(spheres(), LENS, (8, 8), 3e-4, samples=1)
    empty = Rendered(rendered.view, np.full((8, 8), np.inf))
    assert "inf to inf m" in repr(empty)
    assert "nothing in 100.0% of the pixels" in empty.summary()


def test_a_calibration_tells_each_parameter_with_its_uncertainty() -> None:
    lines = CALIBRATION.summary().splitlines()
    assert lines[1] == "k (sigma / disc radius): 0.48 +- 0.048"
    assert lines[2] == "residual blur variance: 2 +- 0.5 um^2"
    assert lines[4:7] == [
        "f/4: effective f-number 4.1 +- 0.082",
        "f/8: effective f-number 8.2 +- 0.16",
        "focus: 1.02 +- 0.01 D",
    ]


def test_a_gaussian_fit_tells_where_contrast_reverses() -> None:
    fit = GaussianFit(1e-3, 2e-3, 0.42, -0.1, 400.0, float(np.degrees(5)))
    assert fit.summary() == (
        "Gaussian with a standard deviation of 3.44 arcmin (k = 0.5), which leaves 42% of the point spread; "
        "contrast reverses from 5 cycles per degree on"
    )
