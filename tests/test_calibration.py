"""What a calibration recovers: from widths by the lens equation, and from rays."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import ndimage
from targets import FOCAL_LENGTH, PITCH, target

from focalgradient import FocalGradientWarning, InputError, Lens, View
from focalgradient.calibration import EDGE_K, Calibration, Priors, Reading, calibrate, cross_validate, read_target

F = 0.018


def width(distance: float, f_number: float, focus: float, *, k: float = EDGE_K, own: float = 0.0) -> float:
    """Width on the sensor by similar triangles behind the lens: 1/u + 1/v = 1/F for target and focus."""
    image, sensor = 1 / (1 / F - 1 / distance), 1 / (1 / F - 1 / focus)
    radius = F / f_number / 2 * abs(sensor - image) / image
    return math.sqrt((k * radius) ** 2 + own)


def sheet(
    distances: tuple[float, ...],
    *,
    offset: float = 0.0,
    stops: dict[float, float],
    focus: float,
    mark: float | None = None,
) -> list[Reading]:
    """Faultless readings of targets at `distances` as measured; `stops` maps marked to true f-numbers."""
    return [
        Reading(d, marked, mark, width(d + offset, true, focus), 1e-9)
        for d in distances
        for marked, true in stops.items()
    ]


TIGHT = Priors(model_error=1e-3, distance_sd=1e-4)
LOOSE = replace(TIGHT, k_sd=0.5, f_number_sd=0.3, offset_sd=0.2)


def test_four_distances_tell_everything_but_the_product_of_k_and_aperture() -> None:
    readings = sheet((0.45, 0.7, 1.2, 3.0), offset=0.06, stops={10.0: 10.6, 16.0: 16.9}, focus=0.33)
    camera = calibrate(readings, F, 4.7e-6, LOOSE)
    assert camera.offset == pytest.approx(0.06, abs=0.003)
    assert 1 / camera.focus[None] == pytest.approx(0.33, rel=0.005)
    assert camera.f_numbers[16.0] / camera.f_numbers[10.0] == pytest.approx(16.9 / 10.6, rel=0.003)
    assert camera.k / camera.f_numbers[10.0] == pytest.approx(EDGE_K / 10.6, rel=0.01)
    assert camera.informed[2] > 0.95  # the offset
    ratio = np.array([1.0, 0, 0, -1, 0, 0])
    assert camera.sd[0] > 0.15  # ln k by itself, against ln (k / N):
    assert math.sqrt(ratio @ camera.covariance @ ratio) < 0.01


def test_two_distances_leave_the_offset_to_its_prior() -> None:
    loose = replace(LOOSE, k_sd=0.2, f_number_sd=0.2)
    two = calibrate(sheet((0.5, 1.5), offset=0.06, stops={10.0: 10.0}, focus=0.33, mark=0.3), F, 4.7e-6, loose)
    four = calibrate(sheet((0.45, 0.7, 1.2, 3.0), offset=0.06, stops={10.0: 10.0}, focus=0.33), F, 4.7e-6, loose)
    assert two.sd[2] > 0.05 > 2 * four.sd[2]
    # A product of k and aperture that is surely known makes up for the third distance.
    sure = replace(TIGHT, k_sd=0.002, f_number_sd=0.002, own_sd=0.05)
    known = calibrate(sheet((0.5, 1.5), offset=0.06, stops={10.0: 10.0}, focus=0.33, mark=0.3), F, 4.7e-6, sure)
    assert known.offset == pytest.approx(0.06, abs=4 * known.sd[2])
    assert known.sd[2] < 0.01


@pytest.mark.slow
def test_stated_uncertainties_cover_the_truth() -> None:
    """Cameras drawn from the priors, seen with the errors that are expected of views."""
    rng = np.random.default_rng(5)
    priors = Priors(focus_sd=0.1)
    pitch, distances, marks = 4.7e-6, (0.5, 0.8, 1.5), (5.6, 11.0)
    scores, predicted = [], []
    for _ in range(36):
        k, offset = EDGE_K * math.exp(0.05 * rng.standard_normal()), 0.1 * float(np.clip(rng.standard_normal(), -2, 2))
        own = float(np.clip(rng.standard_normal(), -2, 2)) * pitch**2
        true = {mark: mark * math.exp(0.07 * rng.standard_normal()) for mark in marks}
        focus = 1 / ((1 + 0.1 * rng.standard_normal()) / (0.3 + offset))  # marked 0.3 m from the user's plane
        slips = dict.fromkeys((*distances, 1.0), 0.0) | {d: 0.005 * rng.standard_normal() for d in distances}

        def seen(distance: float, mark: float) -> Reading:
            exact = width(distance + slips[distance] + offset, true[mark], focus, k=k, own=own)  # noqa: B023
            return Reading(distance, mark, 0.3, exact * (1 + 0.015 * rng.standard_normal()), 1e-3 * exact)

        if focus > 0.9 * (0.5 + offset) or width(0.49 + offset, true[11.0], focus, k=k) < 2 * pitch:
            continue  # too sharp to be read
        camera = calibrate([seen(d, mark) for d in distances for mark in marks], F, pitch, priors)
        truth = [math.log(k), own * 1e12, offset, *(math.log(n) for n in true.values()), 1 / focus]
        scores.append((camera.parameters - truth) / camera.sd)
        between = camera.predict(seen(1.0, 11.0))
        predicted.append((between.distance - 1.0) / between.distance_sd)
    score = np.array(scores)
    assert len(score) > 15
    assert np.mean(np.abs(score) < 2) > 0.9
    assert np.all(np.sqrt(np.mean(score**2, axis=0)) < 1.4)
    assert np.all(np.sqrt(np.mean(score**2, axis=0)) > 0.4)  # nor are they idle
    assert np.mean(np.abs(predicted) < 2) > 0.85


def test_the_side_of_focus_is_told_by_how_blur_changes_with_distance_or_by_a_mark() -> None:
    nearer = calibrate(sheet((0.5, 0.8, 1.2), stops={4.0: 4.0}, focus=2.5), F, 4.7e-6)
    beyond = calibrate(sheet((0.5, 0.8, 1.2), stops={8.0: 8.0}, focus=0.3), F, 4.7e-6)
    between = calibrate(sheet((0.5, 0.8, 1.2, 2.0), stops={4.0: 4.0}, focus=1.0), F, 4.7e-6)
    for camera, focus in ((nearer, 2.5), (beyond, 0.3), (between, 1.0)):
        assert abs(camera.focus[None] - 1 / focus) < 3 * camera.sd[-1]
    once = sheet((1.0,), stops={4.0: 4.0}, focus=1.25)
    with pytest.raises(InputError, match=r"beyond the plane of focus as well as .* give focus_distance_m"):
        calibrate(once, F, 4.7e-6)
    marked = [replace(reading, focus_distance=1.25) for reading in once]
    assert 1 / calibrate(marked, F, 4.7e-6, replace(TIGHT, focus_sd=0.05)).focus[1.25] == pytest.approx(1.25, rel=0.1)


def test_several_focuses_are_found_apart() -> None:
    readings = [
        reading
        for focus, mark in ((0.4, 0.42), (2.0, 1.8))
        for reading in sheet((0.6, 0.9, 1.4), offset=0.03, stops={5.6: 5.9}, focus=focus, mark=mark)
    ]
    camera = calibrate(readings, F, 4.7e-6, TIGHT)
    assert 1 / camera.focus[0.42] == pytest.approx(0.4, rel=0.02)
    assert 1 / camera.focus[1.8] == pytest.approx(2.0, rel=0.05)
    assert camera.lens(5.6, 1.8).focus_distance == pytest.approx(1 / camera.focus[1.8])
    with pytest.raises(InputError, match=r"focus is given as 1 m, but the camera was calibrated at 0\.42 m, 1\.8 m"):
        camera.lens(5.6, 1.0)
    with pytest.raises(InputError, match="no focus distance is given"):
        camera.lens(5.6)
    with pytest.raises(InputError, match=r"f/8 was not calibrated, only f/5\.6"):
        camera.lens(8, 1.8)
    for pinhole in (math.inf, 0.0, math.nan):
        with pytest.raises(InputError, match="was not calibrated, only"):
            camera.lens(pinhole, 1.8)


def test_of_marks_close_together_the_nearest_is_meant() -> None:
    camera = replace(sure_camera(), focus={1.0: 1.1, 1.02: 0.9})
    for stated, mark in ((1.0, 1.0), (1.015, 1.02), (1.02, 1.02)):
        assert camera.lens(10.0, stated).focus_distance == pytest.approx(1 / camera.focus[mark])


def test_one_shaken_exposure_of_three_does_no_harm() -> None:
    readings = sheet((0.5, 0.8, 1.5), stops={10.0: 10.0}, focus=0.3)
    three = [reading for reading in readings for _ in range(3)]
    shaken = [replace(three[0], width=1.4 * three[0].width), *three[1:]]
    assert calibrate(shaken, F, 4.7e-6).focus == pytest.approx(calibrate(three, F, 4.7e-6).focus, rel=1e-3)


def test_own_blur_of_either_sign_is_told_from_defocus() -> None:
    for own in (-1.5, 1.0):
        readings = [
            Reading(d, n, None, width(d, n, 0.3, own=own * 4.7e-6**2), 1e-9)
            for d in (0.5, 0.8, 1.5)
            for n in (10.0, 16.0)
        ]
        camera = calibrate(readings, F, 4.7e-6, replace(TIGHT, own_sd=3.0))
        assert camera.own / 4.7e-6**2 == pytest.approx(own, abs=0.1)
        lens = camera.lens(10.0)
        assert lens.residual_blur_variance == pytest.approx(own * (4.7e-6 / lens.sensor_distance) ** 2, rel=0.1)


@cache
def sure_camera() -> Calibration:
    """A camera known well enough for errors to be small, and for the law to hold exactly."""
    priors = Priors(
        model_error=1e-6, model_weight=1e6, distance_sd=1e-3, k_sd=0.01, f_number_sd=0.01, own_sd=0.1, offset_sd=0.05
    )
    return calibrate(sheet((0.5, 1.5), stops={10.0: 10.0, 16.0: 16.0}, focus=0.3, mark=0.3), F, 4.7e-6, priors)


@pytest.mark.parametrize("marks", [(10.0,), (10.0, 16.0)])
@pytest.mark.parametrize("of", ["vergence", "distance"])
def test_systematic_sd_against_many_cameras_drawn_from_the_covariance(marks, of) -> None:
    """Read one scene with each of them; where two views are compared, from the difference of their variances."""
    camera = sure_camera()
    true = 0.9  # D
    draws = np.random.default_rng(2).multivariate_normal(camera.parameters, camera.covariance, 4000)

    def slope(draw: np.ndarray, stop: int) -> np.ndarray:
        return (1e6 * np.exp(draw[..., 0] - draw[..., 3 + stop]) * F / 2 / (1 / F - draw[..., 5])) ** 2

    here = camera.parameters
    if len(marks) == 1:
        seen = slope(here, 0) * (here[5] - true) ** 2 + here[1]
        square = (seen - draws[:, 1]) / slope(draws, 0)
    else:
        seen = (slope(here, 0) - slope(here, 1)) * (here[5] - true) ** 2
        square = seen / (slope(draws, 0) - slope(draws, 1))
    read = draws[:, 5] - np.sqrt(square)
    if of == "distance":
        read = 1 / read - draws[:, 2]
    stated = camera.systematic_sd([(mark, 0.3) for mark in marks], np.full((2, 2), true), "gaussian", of=of)
    assert stated.shape == (2, 2)
    assert stated[0, 0] == pytest.approx(float(read.std()), rel=0.1)


def test_predictions_leave_out_what_they_predict() -> None:
    readings = sheet((0.5, 0.8, 1.5), stops={10.0: 10.0}, focus=0.3, mark=0.3)
    wrong = [replace(readings[0], width=1.1 * readings[0].width), *readings[1:]]
    # Nothing of the wrong reading may get into its own prediction but its width.
    camera = calibrate(wrong[1:], F, 4.7e-6)
    for leave in ("distance", "view"):
        prediction = cross_validate(wrong, F, 4.7e-6, leave=leave)[0]
        assert prediction is not None
        assert prediction.vergence == pytest.approx(camera.predict(wrong[0]).vergence, abs=1e-6)
    assert cross_validate(readings[:1], F, 4.7e-6) == [None]


def test_a_target_before_the_ray_caster_calibrates_the_camera() -> None:
    """The marks say f/5.6 and f/11 and distances from 4 cm before the optical centre; the truth is another."""
    true, focus, offset = {5.6: 6.1, 11.0: 10.7}, 0.4, 0.04
    readings = []
    for seed, distance in enumerate((0.5, 0.75, 1.3)):
        for mark, f_number in true.items():
            view = target(Lens(FOCAL_LENGTH, f_number, focus), distance + offset, seed=seed)
            sigma, sigma_sd = read_target(view)
            readings.append(Reading(distance, mark, None, sigma * PITCH, sigma_sd * PITCH))
    camera = calibrate(readings, FOCAL_LENGTH, PITCH, replace(Priors(), own_sd=0.2))
    truth = [math.log(EDGE_K), 0.0, offset, *np.log(list(true.values())), 1 / focus]
    assert np.all(np.abs(camera.parameters - truth) < 2.5 * camera.sd)
    assert camera.f_numbers[11.0] / camera.f_numbers[5.6] == pytest.approx(10.7 / 6.1, rel=0.02)  # marked 1.96
    sigma, sigma_sd = read_target(target(Lens(FOCAL_LENGTH, 10.7, focus), 1.0 + offset, seed=9))
    predicted = camera.predict(Reading(1.0, 11.0, None, sigma * PITCH, sigma_sd * PITCH))
    assert predicted.distance == pytest.approx(1.0, abs=min(2.5 * predicted.distance_sd, 0.1))


def test_what_shows_no_linear_edges_is_named() -> None:
    """So that k takes it up."""
    changes = []
    for f_number in (5.6, 8.0):
        view = target(Lens(FOCAL_LENGTH, f_number, 0.4), 0.7)
        light = np.clip(view.image, 0, None) / 0.7
        toned = replace(view, image=(0.7 * 3.5 * light / (1 + 2.5 * light)).astype(np.float32))
        with pytest.warns(FocalGradientWarning, match=r"only \d+% of a target's edges look like blurred steps"):
            changes.append(read_target(toned)[0] / read_target(view)[0])
    assert changes[0] == pytest.approx(changes[1], rel=0.03)
    assert changes[0] < 0.95
    texture = ndimage.gaussian_filter(np.random.default_rng(3).standard_normal((160, 200)), 2.0)
    view = View(0.5 + 0.1 * texture / texture.std(), Lens(FOCAL_LENGTH, 8.0, 0.4), 3e-4)
    with pytest.warns(FocalGradientWarning, match=r"a target of texture \(method='equalise'\)"):
        read_target(view)


def test_the_calibrations_error_does_not_vanish_in_exact_focus() -> None:
    camera = sure_camera()
    settings, focus = [(10.0, 0.3), (16.0, 0.3)], camera.focus[0.3]
    at, beside = camera.systematic_sd(settings, [focus, focus + 0.01], "disc")
    assert at == pytest.approx(beside, rel=0.1)
