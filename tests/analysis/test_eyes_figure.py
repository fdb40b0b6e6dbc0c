"""The figure of different people's eyes: who sees what at which distance."""

import eyes
import numpy as np
import pytest

BY_NAME = {subject.name: subject for subject in eyes.SUBJECTS}


def strehl(name: str, vergence: float) -> float:
    return float(eyes.quality(BY_NAME[name], np.array([vergence]))[0][0])


def test_a_myope_sees_near_and_a_presbyope_far_and_a_bifocal_lens_gives_both() -> None:
    myope, old, bifocal = "myope, −2 D, uncorrected", "presbyope, 60 years", "60 years, bifocal +2.5 D"
    assert strehl(myope, 0.0) < 0.05 < 0.5 < strehl(myope, 2.5)
    assert strehl(old, 2.5) < 0.05 < 0.5 < strehl(old, 0.0)
    assert strehl(old, 0.0) > strehl(bifocal, 0.0) > 0.3
    assert strehl(bifocal, 2.5) > 0.1
    assert strehl(bifocal, 1.5) < 0.1


def test_spectacles_give_a_myope_the_quality_of_an_emmetrope() -> None:
    assert strehl("myope, in spectacles", 1.0) == pytest.approx(strehl("emmetrope, 25 years", 1.0), abs=1e-6)


def test_point_spreads_hold_all_light_and_each_eye_has_a_row() -> None:
    spread = eyes.point_spread(BY_NAME["astigmat, −1.50 × 30"], 1.0)
    assert spread.sum() == pytest.approx(1.0)
    names = ("one, 30 years", "another")
    curves = {name: np.array([0.5, 0.2]) for name in names}
    figure = eyes.draw(np.array([0.0, 1.0]), curves, curves, {name: [spread] * len(eyes.SHOWN) for name in names})
    assert len(figure.axes) == len(names) * (len(eyes.SHOWN) + 1)
    assert [ax.get_title("left") for ax in figure.axes[:3]] == ["far", "100 cm", "40 cm"]
