"""An eye answers what a lens answers, and the depth core takes its views as any others."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient import Lens, View, recover_depth
from focalgradient.eye import Eye, Oscillation
from focalgradient.render import cast, noisy
from focalgradient.scenes import plane

PIXEL = np.radians(1 / 60)
MIDDLE = (slice(28, -28),) * 2  # light from beyond the frame reaches the rest


@given(st.floats(1e-3, 9e-3), st.floats(0.2, 6), st.lists(st.floats(0.1, 1e3), min_size=1, max_size=5))
def test_in_yellow_light_it_is_a_lens_of_its_pupil(pupil: float, accommodation: float, distance: list[float]) -> None:
    eye, lens = Eye(pupil, accommodation), Lens(0.017, 0.017 / pupil, 1 / accommodation)
    assert eye.aperture_diameter == pytest.approx(lens.aperture_diameter)
    assert eye.focus_vergence == pytest.approx(lens.focus_vergence)
    assert eye.defocus(distance) == pytest.approx(lens.defocus(distance))
    assert eye.blur_radius(distance) == pytest.approx(lens.blur_radius(distance))


def test_moments_follow_the_course() -> None:
    eye, course, times = Eye(0.004, 1.0, 450), Oscillation(0.3, 2.0), [0.0, 0.1, 0.35]
    eyes = eye.through(times, course)
    assert [one.accommodation - 1 for one in eyes] == pytest.approx(list(0.3 * np.sin(4 * np.pi * np.array(times))))
    assert eyes == [eye.at(time, course) for time in times]
    assert {(one.pupil_diameter, one.wavelength_nm) for one in eyes} == {(0.004, 450)}


def walls(eyes: list[Eye], distance: float, seed: int) -> list[View]:
    """What each eye sees of one textured wall, ray cast, with 1 % noise of its own."""
    views = [cast(plane(distance, seed=seed), eye, (144, 144), PIXEL, samples=64, seed=seed).view for eye in eyes]
    return [noisy(view, 0.01 * float(view.image.mean()), 10 * seed + n) for n, view in enumerate(views)]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("vergence", [0.9, 1.8, 2.7])
def test_depth_from_two_colours(vergence: float) -> None:
    """Views in blue and orange light, 1.1 D apart: the side of focus is told, on either side of both."""
    eye = Eye(0.004, accommodation=1.5)
    depth = recover_depth(walls([eye.in_light(450), eye.in_light(610)], 1 / vergence, seed=3))
    assert depth.side_known.all()
    found, valid = depth.vergence[MIDDLE], depth.valid[MIDDLE]
    assert valid.mean() > 0.9
    error = found[valid] - vergence
    assert np.median(np.abs(error)) < 0.03
    assert np.mean(np.abs(error) < 0.15) > 0.97


def test_depth_when_one_colour_is_focused_beyond_infinity() -> None:
    """Relaxed, the eye is too weak for red light: its plane of focus has a negative vergence."""
    eye = Eye(0.004, accommodation=0.0)
    red = eye.in_light(680)
    assert red.focus_vergence < 0
    depth = recover_depth(walls([eye.in_light(470), red], 2.0, seed=5))
    assert np.median(np.abs(depth.vergence[depth.valid] - 0.5)) < 0.05
