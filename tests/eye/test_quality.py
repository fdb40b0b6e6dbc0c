"""Image quality through focus: closed forms of clear pupils and of multifocal lenses, and what astigmatism does."""

import numpy as np
import pytest

from focalgradient.eye import Cones, Eye, ZonedLens, blur_transfer, image_quality, optical_transfer, point_spread


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


def test_modulation_of_an_astigmatic_eye_is_the_mean_over_all_directions():
    """Contrast reverses in some directions before others, so that the mean has corners: few directions shift them."""
    cones = one_light(Eye(0.004, refraction="-2.50 -1.25 x 30", age=34))
    levels, turn = np.linspace(1.5, 5, 36), np.pi * np.arange(180) / 180
    at = np.degrees([8.0, 16.0])
    seen = cones.through_focus(at * np.sin(turn)[:, None], at * np.cos(turn)[:, None], levels)
    found = image_quality(cones, levels, (8.0, 16.0))
    assert found.mtf == pytest.approx(np.abs(seen).mean(axis=1), abs=3e-3)


def quality(lens, levels, pupil=0.004):
    return image_quality(Cones(Eye(pupil, 0.0, lens=lens), "luminance", (580.0,)), levels).visual_strehl


def test_centre_near_has_two_foci_with_a_large_pupil_and_one_with_a_small_one():
    """2 D within 2.4 mm: through 4 mm near and far, through 2 mm near alone."""
    lens = ZonedLens((0.0024, 0.009), (2.0, 0.0))
    levels = np.linspace(-1, 3, 81)
    both = quality(lens, levels)
    peaks = levels[1:-1][(both[1:-1] > both[:-2]) & (both[1:-1] > both[2:]) & (both[1:-1] > 0.08)]
    assert np.abs(peaks[:, None] - [0.0, 2.0]).min(axis=0) == pytest.approx(0, abs=0.3)
    assert levels[quality(lens, levels, 0.002).argmax()] == pytest.approx(2.0, abs=0.1)
    assert both.max() < 0.8


def strehl_ratio(pupil, lens, defocus, nm=580.0):
    """Return |mean amplitude over the pupil|^2, a closed form: within a zone the phase is linear in r^2."""
    edges = np.array([0.0, *(d / 2 for d in lens.diameters if d < pupil), pupil / 2]) ** 2
    total, path = 0.0, 0.0  # the path in metres at the zone's inner edge
    for low, high, power in zip(edges[:-1], edges[1:], lens.additions, strict=False):
        ahead = path + (power + defocus) * (high - low) / 2
        inner, outer = (np.exp(2j * np.pi * one / (1e-9 * nm)) for one in (path, ahead))
        rate = np.pi * (power + defocus) / (1e-9 * nm)
        total += (outer - inner) / (1j * rate) if rate else inner * (high - low)
        path = ahead
    return abs(total / edges[-1]) ** 2


@pytest.mark.parametrize(
    ("pupil", "lens"),
    [
        (0.004, ZonedLens((0.002, 0.008), (2.0, 0.0))),
        (0.005, ZonedLens((0.0015, 0.009), (2.0, 0.0))),
        (0.008, ZonedLens((0.002, 0.009), (3.0, 0.0))),
        (0.004, ZonedLens(tuple(5e-4 * n for n in range(1, 9)), (2.0, 0.0) * 4)),
    ],
)
def test_strehl_ratio_of_zones_has_a_closed_form(pupil, lens):
    """Over the plane the OTF sums to the light at the centre of the point spread, in focus pi / 4 at a cut-off of 1."""
    eye, levels = Eye(pupil, 0.0, lens=lens), np.array([-1.0, 0.0, 1.0, 2.0])
    nodes, weights = np.polynomial.legendre.leggauss(128)
    share = (nodes + 1) / 2
    frequency = share * pupil / 580e-9
    through = Cones(eye, "luminance", (580.0,)).through_focus(0.0, frequency, levels)
    peak = np.pi / 4 * (pupil / 580e-9) ** 2
    truth = [strehl_ratio(pupil, lens, -level) for level in levels]
    assert 4 * through.real @ (weights * share) == pytest.approx(truth, abs=4e-4)
    single = blur_transfer(0.0, frequency, eye, 0.0).real
    assert 4 * single @ (weights * share) == pytest.approx(truth[1], abs=4e-4)
    assert point_spread([0.0], [0.0], eye, 0.0).item() / peak == pytest.approx(truth[1], abs=2e-3)
