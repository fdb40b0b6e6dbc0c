"""An eye that focuses by its own estimate: the linear plant, and other optics than it takes for granted."""

from dataclasses import replace

import numpy as np
import pytest

from focalgradient.eye import Accommodation, Course, Oscillation, Stimulus, Target, TargetMotion, accommodate

STEADY = Accommodation(fluctuation=None)


def step(to: float, at: float = 0.5):
    return lambda t: to if t >= at else 2.0


def moved(stimulus: Stimulus, to: float, cue="bands", seconds=2.5, seed=1) -> float:
    """How far focus has gone towards `to`, from 2 D."""
    course = accommodate(step(to, 0.05), seconds, Accommodation(cue=cue, fluctuation=None), stimulus, seed=seed)
    return float(course.accommodation[-5:].mean() - course.accommodation[0]) * np.sign(to - 2)


def test_a_step_is_the_plants_where_the_estimate_is_good():
    """With little noise the estimate is the target, and the course the plant's own step response."""
    eye = Accommodation(fluctuation=None, noise=0.03)
    course = accommodate(step(3.0), 3.0, eye, seed=2)
    assert course.estimate[8:] == pytest.approx(3.0, abs=0.1)
    expected = eye.plant.step_response(course.times - 0.5, 2.0, 3.0)
    assert course.accommodation == pytest.approx(expected, abs=0.06)
    assert course.lag(0.5) == pytest.approx(3.0 - eye.plant.steady(3.0), abs=0.06)


def test_nothing_moves_before_the_latency_has_passed():
    """Of a step between the eye's first moment and its second."""
    course = accommodate(step(4.0, 0.05), 0.6, STEADY, seed=2)
    early = course.times <= STEADY.plant.latency
    assert early.sum() > 2
    assert course.accommodation[early] == pytest.approx(course.accommodation[0], abs=0.02)


def test_a_sine_is_followed_with_the_plants_gain_and_phase():
    course = accommodate(lambda t: 2 + 0.5 * np.sin(0.8 * np.pi * t), 6.0, replace(STEADY, noise=0.05, horizon=0.0))
    found = course.response(0.4, skip=1.0)
    expected = complex(STEADY.plant.sine_response(0.4))
    # The estimate lags too, by part of a fixation: 0.1 to 0.2 s.
    assert 0.65 * abs(expected) < abs(found) < 1.1 * abs(expected)
    assert -0.55 < np.angle(found) - np.angle(expected) < 0


def test_response_of_a_course_by_its_definition():
    t = np.arange(0, 10, 0.1)
    zero = np.zeros_like(t)
    course = Course(t, np.sin(0.4 * np.pi * t), 1 + 0.7 * np.sin(0.4 * np.pi * t - 0.5), zero, zero)
    assert abs(course.response(0.2)) == pytest.approx(0.7)
    assert np.angle(course.response(0.2)) == pytest.approx(-0.5)


def test_one_waveband_finds_the_side_by_the_fluctuations_of_focus():
    eye = Accommodation(cue="moments", noise=0.1, fluctuation=Oscillation())
    for to in (1.0, 3.0):
        course = accommodate(step(to), 4.0, eye, seed=1)
        assert course.accommodation[-10:].mean() == pytest.approx(eye.plant.steady(to), abs=0.2)


def test_an_empty_field_lets_focus_return_to_rest():
    eye = Accommodation(fluctuation=None, rate=4.0)
    course = accommodate(lambda t: 4.0, 15.0, eye, Stimulus(target=Target(contrast=0.0)), seed=1)
    assert course.accommodation[0] > 3.0
    assert course.accommodation[-16:].mean() == pytest.approx(eye.plant.rest, abs=0.7)


@pytest.mark.slow
def test_reversed_chromatic_aberration_drives_focus_the_wrong_way():
    """By bands alone; the same with real aberration drives it the right way, to either side."""
    for to in (1.3, 2.7):
        assert moved(Stimulus(), to) > 0.4
    assert moved(Stimulus(chromatic_scale=-1.0), 1.3) + moved(Stimulus(chromatic_scale=-1.0), 2.7) < 0.6


@pytest.mark.slow
def test_rendered_blur_drives_focus_only_with_chromatic_aberration():
    """The sum over both sides, so that a bias to one side is no response."""
    defocus, chromatic = (
        sum(moved(Stimulus(rendering=kind), to, seconds=1.5) for to in (1.3, 2.7)) for kind in ("defocus", "chromatic")
    )
    assert chromatic > 0.5
    assert defocus < 0.5 * chromatic


def test_a_target_at_the_end_of_the_range_is_estimated_without_bias():
    course = accommodate(lambda t: 8.0, 3.0, STEADY, seed=0)
    off = course.estimate - course.target
    assert abs(off.mean()) < 0.02
    assert np.mean(np.abs(off) < 2 * course.estimate_sd) > 0.8


class Pinhole:
    """Optics that blur nothing."""

    aperture_diameter, focus_vergence, light = 0.0, 0.0, "L+M"

    def transfer(self, frequency, vergence):
        return np.ones(np.shape(frequency))


@pytest.mark.parametrize("finest_cpd", [np.inf, 10.0])
def test_a_target_s_contrast_is_what_pixels_and_cut_off_leave_of_its_spectrum(finest_cpd):
    """Power falls as 1 / f^2 up to half a cycle per pixel of a minute of arc, times the pixel's sinc squared."""
    y, x = np.meshgrid(np.fft.fftfreq(64), np.fft.fftfreq(64), indexing="ij")
    f = np.hypot(y, x)
    power = np.where((f > 0) & (f < 0.5), 1 / np.maximum(f, 1 / 64) ** 2, 0)
    left = power * (np.sinc(y) * np.sinc(x)) ** 2 * (60 * f <= finest_cpd)
    target, random = Target(contrast=0.3, finest_cpd=finest_cpd), np.random.default_rng(1)
    images = [target.views([Pinhole()], 1.0, noise=0.0, random=random, texture=n)[0].image for n in range(30)]
    assert np.mean([image.var() for image in images]) == pytest.approx(0.09 * left.sum() / power.sum(), rel=0.03)
    assert np.mean(images) == pytest.approx(1.0)


def test_an_empty_field_is_filmed_at_half_of_white():
    """A gamma of 2.2: 255 x 0.5^(1 / 2.2) = 186."""
    (frame,) = Target(contrast=0.0).film([1.0], [1.5], 0.004)
    assert (frame == 186).all()


def test_a_course_is_read_in_the_units_of_its_headings(tmp_path):
    """From 1 to 3 D in 2 s; and by distances, of which 1 m and 0.5 m are 1 and 2 D."""
    path = tmp_path / "course"  # a file that exists needs no ending
    for heading, unit in (("s", 1), ("msec", 1e-3), ("min", 60.0)):
        path.write_text(f"time ({heading}),dioptres\n0,1\n{2 / unit:.6g},3\n")
        assert TargetMotion.parse(str(path)).at(1.0) == pytest.approx(2.0, abs=1e-5)
    for length, metres in (("m", 1.0), ("cm", 0.01), ("mm", 0.001)):
        path.write_text(f"time,distance ({length})\n0,{1 / metres:g}\n2,{0.5 / metres:g}\n")
        assert [TargetMotion.read(path).at(at) for at in (0.0, 2.0)] == pytest.approx([1.0, 2.0])
