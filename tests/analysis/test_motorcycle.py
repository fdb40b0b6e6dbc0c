"""The real photograph: how it is seen through an aperture, and how depth read from it is scored."""

import motorcycle
import numpy as np
import pytest

from focalgradient import DepthMap, Lens
from focalgradient.psf import disc_transfer

LENS = Lens(focal_length=0.090, f_number=2, focus_distance=1.8)
PER_DIOPTRE = LENS.aperture_diameter / 2 / motorcycle.PIXEL_ANGLE


def test_a_flat_scene_is_blurred_by_the_disc_of_its_depth():
    """Against the transfer of a disc, frequency by frequency: the renderer works on pixels."""
    sharp = 1 + 0.2 * np.random.default_rng(1).standard_normal((96, 128))
    radius = 3.7
    vergence = LENS.focus_vergence - np.full(sharp.shape, radius / PER_DIOPTRE)
    vergence[0, 0] -= 1e-9  # a depth of one layer has no range
    image = motorcycle.seen_through(sharp, vergence, LENS).image
    wide = np.pad(sharp, 48, mode="symmetric")
    frequency = np.hypot(np.fft.fftfreq(wide.shape[0])[:, None], np.fft.rfftfreq(wide.shape[1]))
    own = np.exp(-2 * (np.pi * motorcycle.OWN_BLUR * frequency) ** 2)
    spectrum = np.fft.rfft2(wide) * disc_transfer(frequency, radius) * own
    expected = np.fft.irfft2(spectrum, wide.shape)[48:-48, 48:-48]
    assert np.sqrt(np.mean((image - expected) ** 2)) < 0.015 * expected.std()


def test_discs_hold_all_the_light_and_have_their_second_moment():
    table = motorcycle.discs(6.0)
    offset = np.arange(table.shape[1])
    twice = np.where(offset > 0, 2.0, 1.0)
    for radius in (1.0, 2.5, 6.0):
        disc = table[round(radius / motorcycle.RADIUS_STEP)] * twice * twice[:, None]
        assert disc.sum() == pytest.approx(1, abs=2e-3)
        assert (disc * offset**2).sum() == pytest.approx(radius**2 / 4 + motorcycle.OWN_BLUR**2, rel=0.01)


def test_the_near_covers_the_far_and_not_the_other_way_round():
    sharp = np.ones((40, 120))
    sharp[:, 60:] = 0.0  # a dark wall far behind a bright one in focus
    vergence = np.full(sharp.shape, LENS.focus_vergence)
    vergence[:, 60:] -= 6 / PER_DIOPTRE
    image = motorcycle.seen_through(sharp, vergence, LENS).image[20]
    assert image[:58] == pytest.approx(1, abs=0.01)  # the far disc does not spill over the near wall
    assert image[62:] == pytest.approx(0, abs=0.01)  # and the near one, in focus, ends at its outline
    # The other way round, the near wall out of focus covers the far one by half at its own outline.
    vergence = np.full(sharp.shape, LENS.focus_vergence)
    vergence[:, :60] += 6 / PER_DIOPTRE
    image = motorcycle.seen_through(sharp, vergence, LENS).image[20]
    assert image[59:61].mean() == pytest.approx(0.5, abs=0.02)
    assert np.all(np.diff(image[50:70]) < 1e-3)
    assert 0.05 < image[63] < 0.35
    assert image[68:] == pytest.approx(0, abs=0.01)


def test_score_of_errors_known_beforehand():
    vergence = np.full((10, 10), 0.4)
    read = vergence + 0.002
    read[0] = 0.5
    valid = np.ones(vergence.shape, bool)
    valid[-1] = False
    depth = DepthMap(read, np.full(vergence.shape, 0.0015), valid, valid)
    scored = motorcycle.score(depth, vergence, np.full(vergence.shape, 0.001), vergence > 0)
    assert scored["valid_percent"] == pytest.approx(90)
    assert scored["median_size_of_error_D"] == pytest.approx(0.002)
    assert scored["bias_percent"] == pytest.approx(-0.5, rel=0.01)
    assert scored["within_2_vergence_sd_percent"] == pytest.approx(100 * 8 / 9)
    assert scored["median_multiple_of_the_bound"] == pytest.approx(2 / 0.674)


def test_true_depth_is_of_the_photograph():
    pytest.importorskip("skimage")
    luminance, distance, known = motorcycle.photograph()
    assert luminance.shape == distance.shape == known.shape == (500, 741)
    assert luminance.min() >= 0
    assert luminance.max() <= 1
    assert 0.92 < known.mean() < 0.93
    assert 2.1 < distance.min() < distance.max() < 5.1  # what is unknown is filled with what is near it
    # What is hidden lies behind: beside an outline it is given the farther of the two sides.
    inside = ~known[:, 1:-1] & known[:, :-2] & known[:, 2:]
    farther = np.maximum(distance[:, :-2], distance[:, 2:])
    assert np.array_equal(distance[:, 1:-1][inside], farther[inside])
