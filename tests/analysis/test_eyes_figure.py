"""The figure of different people's eyes: who sees what at which distance."""

import eyes
import numpy as np
import pytest

BY_NAME = {subject.name: subject for subject in eyes.SUBJECTS}


def strehl(name: str, vergence: float) -> float:
    return float(eyes.quality(BY_NAME[name], np.array([vergence]))[0][0])


@pytest.mark.slow
def test_a_myope_sees_near_and_a_presbyope_far_and_a_bifocal_lens_gives_both() -> None:
    myope, old, bifocal = "myope, −2 D, uncorrected", "presbyope, 60 years", "60 years, bifocal +2.5 D"
    assert strehl(myope, 0.0) < 0.05 < 0.5 < strehl(myope, 2.5)
    assert strehl(old, 2.5) < 0.05 < 0.5 < strehl(old, 0.0)
    assert strehl(old, 0.0) > strehl(bifocal, 0.0) > 0.3
    assert strehl(bifocal, 2.5) > 0.1
    assert strehl(bifocal, 1.5) < 0.1
