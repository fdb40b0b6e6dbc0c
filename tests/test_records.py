"""Records print in a few words, and summarise themselves in a few lines."""

import numpy as np

from focalgradient import Lens
from focalgradient.calibration import Calibration
from focalgradient.eye import GaussianFit
from focalgradient.render import render
from focalgradient.scenes import plane

LENS = Lens(0.025, 4, 1.0)
CALIBRATION = Calibration(
    *(0.05, 4e-6, 0.48, 2e-12, 0.03),
    f_numbers={4.0: 4.1, 8.0: 8.2},
    focus={None: 1.02},
    model_error=0.05,
    covariance=np.diag([0.01, 0.25, 1e-4, 4e-4, 4e-4, 1e-4]),
    informed=np.ones(6),
)


def test_a_rendered_view_tells_its_distances_and_noise() -> None:
    rendered = render(plane(2.0), LENS, (48, 64), 3e-4, engine="cast", samples=8)
    assert repr(rendered).endswith("focus at 1 D), 2 to 2 m)")
    view, distance, light = rendered.summary().splitlines()
    assert view == repr(rendered.view)
    assert "median 2 m (blur disc 5.21 pixels in radius)" in distance  # 3.125 mm x 0.5 D / 0.0003
    assert light.endswith(f"noise {rendered.noise / rendered.view.image.mean():.2%} of it")


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
