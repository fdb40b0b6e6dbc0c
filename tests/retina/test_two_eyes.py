"""Two eyes of a person: geometry by trigonometry, mirror images by the point spread, views by their shift."""

import numpy as np
import pytest

from focalgradient import stereo
from focalgradient.eye import Eye, point_spread, typical_aberrations
from focalgradient.retina import TwoEyes


def test_convergence_and_disparity_are_angles_of_the_triangle():
    pair = TwoEyes.of(Eye(0.004, 2.0), interocular=0.06)
    to = lambda metres: 2 * np.degrees(np.arctan2(0.03, metres))  # noqa: E731
    assert np.degrees(pair.convergence([1.0, 2.5])) == pytest.approx([to(1.0), to(0.4)])
    assert np.degrees(pair.disparity(4.0, 2.0)) == pytest.approx(to(0.25) - to(0.5))
    assert pair.disparity(1.0, 2.0) < 0  # farther than fixated: uncrossed


def test_the_left_eyes_point_spread_is_the_mirror_image_of_the_rights():
    right = Eye(
        0.005, 0.0, aberrations=((2, -2, 0.2), (2, 2, 0.1), (3, 1, 0.1), (3, -3, 0.1), (3, 3, -0.1), (4, 0, 0.1))
    )
    left = TwoEyes.of(right).left
    angles = np.radians(np.arange(-16, 16.1, 0.5) / 60)
    seen = [point_spread(angles, angles, one, 1.0) for one in (left, right)]
    assert seen[0] == pytest.approx(seen[1][:, ::-1], rel=1e-6, abs=1e-6 * seen[1].max())
    assert np.abs(seen[0] - seen[1]).max() > 0.1 * seen[0].max()
    assert left.mirrored() == right


def test_both_eyes_accommodate_alike_and_a_difference_in_refraction_stays():
    lenses = TwoEyes.of_person("-3.00", "-1.00", looking_at=2.5, correction="contact-lens")
    assert lenses.left.focus_vergence == pytest.approx(2.5, abs=1e-6)
    assert lenses.right.focus_vergence == pytest.approx(2.5, abs=1e-6)
    bare = TwoEyes.of_person("-3.00", "-1.00", looking_at=2.5)
    assert bare.left.focus_vergence == pytest.approx(1 / (1 / 3 + 0.012), abs=1e-6)  # relaxed: its far point
    assert bare.left.focus_vergence - bare.right.focus_vergence > 1.8
    moved = bare.accommodated(0.5)
    assert moved.right.focus_vergence == pytest.approx(bare.right.focus_vergence + 0.5)
    old = TwoEyes.of_person("plano", "plano", looking_at=2.5, age=60)
    assert old.right.focus_vergence < 0.2


def test_views_of_one_scene_are_shifted_by_the_disparity_and_blurred_by_each_eye():
    """A wall one dioptre nearer than fixated, seen by an eye that is focused on it and one that is not."""
    angle, pair = np.radians(4 / 60), TwoEyes(Eye(0.004, 3.0), Eye(0.004, 2.0))
    wall = np.random.default_rng(0).uniform(0.2, 0.8, (16, 300))
    far = np.full(wall.shape, 1 / 3)
    seen = stereo(wall, far, (pair.left, pair.right), pixel_angle=angle, interocular=pair.interocular, vergence=2.0)
    left, right = seen.left.light, seen.right.light
    patch = left[:, 130:170] - left[:, 130:170].mean()
    match = [np.sum(patch * (right[:, at : at + 40] - right[:, at : at + 40].mean())) for at in range(260)]
    assert 130 - int(np.argmax(match)) == pytest.approx(pair.interocular * 1.0 / angle, abs=1)  # of tangents
    assert left[:, 60:240].std() > 2 * right[:, 60:240].std()


def test_typical_aberrations_have_the_published_size_and_scale_with_the_pupil():
    whole = {(n, m): um for n, m, um in typical_aberrations(0.006)}
    assert whole == {(3, -3): 0.11, (3, -1): 0.14, (4, 0): 0.13}
    assert 0.2 < np.sqrt(sum(um**2 for um in whole.values())) < 0.33  # of all higher orders on average
    half = {(n, m): um for n, m, um in typical_aberrations(0.003)}
    assert half[4, 0] == pytest.approx(0.13 / 16)
    assert half[3, -3] == pytest.approx(0.11 / 8)
