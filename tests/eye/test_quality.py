"""Image quality through focus: closed forms of a clear pupil, and what astigmatism does."""

import numpy as np
import pytest

from focalgradient.eye import Cones, Eye, image_quality, optical_transfer


def one_light(eye: Eye) -> Cones:
    return Cones(eye, "luminance", (580.0,))


def test_a_clear_pupil_in_focus_is_diffraction_limited_and_symmetric_about_it():
    levels = np.linspace(0, 2, 21)
    found = image_quality(one_light(Eye(0.003, 1.0)), levels, (5.0, 20.0))
    ideal = optical_transfer([5.0, 20.0], pupil_diameter=0.003, wavelength_nm=580, defocus=0.0)
    assert found.mtf[10] == pytest.approx(ideal, abs=1e-3)
    assert found.visual_strehl[10] == pytest.approx(1.0, abs=1e-3)
    assert found.visual_strehl == pytest.approx(found.visual_strehl[::-1], abs=1e-3)


def test_depth_of_focus_shrinks_with_the_pupil_as_its_inverse():
    """Of the same share of the maximum, by geometric scaling of the defocused transfer at low frequencies."""
    levels = np.linspace(-2, 2, 161)
    depth = [image_quality(one_light(Eye(1e-3 * mm, 0.0)), levels).depth_of_focus(0.5) for mm in (3.0, 6.0)]
    assert depth[0] / depth[1] == pytest.approx(2.0, rel=0.15)


def test_a_depth_of_focus_beyond_the_vergences_is_cut_off():
    """At half a dioptre, the path at the rim of 1 mm is a tenth of a wave, and at the rim of 6 mm four waves."""
    levels = np.linspace(-0.5, 0.5, 21)
    small, large = (image_quality(one_light(Eye(1e-3 * mm, 0.0)), levels) for mm in (1.0, 6.0))
    assert small.is_cut_off()
    assert small.depth_of_focus() == pytest.approx(1.0)
    assert not large.is_cut_off()
    assert large.is_cut_off(0.001)


def test_colour_lowers_quality_and_deepens_focus():
    levels = np.linspace(-2, 2, 81)
    eye = Eye(0.005, 0.0)
    white, yellow = image_quality(Cones.of(eye, "luminance"), levels), image_quality(one_light(eye), levels)
    assert white.visual_strehl.max() < 0.75 * yellow.visual_strehl.max()
    assert white.depth_of_focus() > yellow.depth_of_focus()


def test_an_astigmatic_eye_is_best_between_its_foci_and_alike_to_either_side():
    """Prescribed -1.00 and -2.00 D at 12 mm are 0.988 and 1.953 D at the cornea."""
    ends = 1 / 1.012, 2 / 1.024
    eye = Eye(0.004, refraction="-1.00 -1.00 x 90", age=30)
    levels = np.mean(ends) + np.linspace(-1.5, 1.5, 61)
    found = image_quality(one_light(eye), levels)
    assert ends[0] < found.best < ends[1]
    assert found.visual_strehl == pytest.approx(found.visual_strehl[::-1], abs=1e-3)
    assert found.visual_strehl.max() < 0.3
