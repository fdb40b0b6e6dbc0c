"""The table of estimators: its bound, its scores, and that the default keeps to the limit."""

from dataclasses import replace

import estimators
import numpy as np
import pytest

from focalgradient.depth.limits import comparison_bound, natural_power, window_area
from focalgradient.depth.settings import METHODS

DEFAULT = estimators.ESTIMATORS[0]


@pytest.mark.slow
@pytest.mark.parametrize("psf", ["gaussian", "disc"])
def test_the_default_is_within_a_quarter_of_the_limit_at_every_blur(psf: str) -> None:
    natural = replace(DEFAULT, textures=("natural (1/f)",))
    rows = estimators.measure(estimators=[natural], noises=(0.01,), psf=psf)
    assert [row["sigma_px"] for row in rows] == list(estimators.BLURS)
    for row in rows:
        assert row["multiple_of_bound"] <= 1.25, row
        assert abs(row["bias_percent"]) <= 0.5, row
        assert row["coverage_percent"] >= 90, row
        assert row["valid_percent"] >= 95, row


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    "method",
    [
        pytest.param(one, marks=pytest.mark.slow if one == "edges" else ())
        for one in METHODS
        if not METHODS[one].of_halves
    ],
)
def test_every_method_is_compared_and_covers_the_distance_of_a_wall(method: str) -> None:
    """What a new method must pass, but one of dual pixels.

    Edges are a twentieth of the frame or more, and of a wall only they are valid.
    """
    (estimator,) = [one for one in estimators.ESTIMATORS if one.method == method]
    one = replace(estimator, textures=estimator.textures[:1])
    (row,) = estimators.measure(estimators=[one], blurs=(2.0,), noises=(0.01,))
    assert abs(row["bias_percent"]) < 3, row
    assert row["coverage_percent"] >= 85, row
    assert row["valid_percent"] > 5, row


def test_the_bound_of_natural_texture_is_the_bound_of_its_power() -> None:
    everywhere = estimators.bound(DEFAULT, "natural (1/f)", 2.0, 0.01, 0, "gaussian")
    side = estimators.SIDE + 2 * estimators.AROUND
    alike = comparison_bound(
        DEFAULT.lenses(),
        estimators.vergence(2.0),
        estimators.PIXEL,
        power=natural_power(estimators.CONTRAST, side),
        noise=0.01,
        area=window_area(estimators.WINDOW),
        psf="gaussian",
    )
    assert np.sqrt(1 / np.mean(everywhere**-2.0)) == pytest.approx(float(alike), rel=0.15)


def test_without_a_difference_of_blur_nothing_is_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both views through the wide aperture, while the estimator is told of two: the error is no small one."""
    views_of = estimators.views_of

    def blind(texture, lenses, level, noise, seed, psf="gaussian"):
        alike = views_of(texture, [lenses[-1]] * len(lenses), level, noise, seed, psf)
        return [replace(view, optics=lens) for view, lens in zip(alike, lenses, strict=True)]

    monkeypatch.setattr(estimators, "views_of", blind)
    (row,) = estimators.measure(
        estimators=[replace(DEFAULT, textures=("natural (1/f)",))], blurs=(3.0,), noises=(0.01,)
    )
    assert np.isnan(row["rms_percent"]) or row["rms_percent"] > 20
