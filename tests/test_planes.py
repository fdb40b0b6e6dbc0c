"""Which plane distances count from: converted by geometry, named everywhere, calibrated from two distances."""

import math

import pytest
from two_views import TOML

from focalgradient import Lens
from focalgradient.calibration import Priors, Reading, calibrate
from focalgradient.photographs import load_settings, load_targets
from focalgradient.photographs.planes import Body

PUPIL, FRONT = 0.07, 0.095  # m before the sensor


def test_a_point_has_one_distance_from_each_plane():
    body = Body(0.05, False, PUPIL, FRONT)
    for plane, measured in {"entrance_pupil": 0.8, "sensor": 0.87, "lens_front": 0.775}.items():
        assert measured + body.offset(plane, 0.8) == pytest.approx(0.8)
        assert body.optical(measured, plane) == pytest.approx(0.8)


def test_a_thin_lens_stands_for_a_pupil_that_is_not_stated():
    # Object to sensor of a thin lens is u + v0, by the lens's own law.
    lens = Lens(0.05, 4, 0.9)
    assert Body(0.05).optical(0.9 + lens.sensor_distance, "sensor") == pytest.approx(0.9)
    assert Body(0.05).offset("sensor", 0.9) == pytest.approx(-lens.sensor_distance)
    # Image-side telecentric: the pupil lies a focal length before the lens.
    assert Body(0.05, True).optical(0.9 + lens.sensor_distance, "sensor") == pytest.approx(0.85)
    assert Body(0.05, True).offset("sensor", 0.85) == pytest.approx(-0.05 - lens.sensor_distance)
    assert Body(0.05).optical(math.inf, "sensor") == math.inf


def test_the_scale_of_a_lens_counts_from_the_sensor(folder):
    lens = Lens(0.025, 16, 0.85)
    mark = 0.85 + lens.sensor_distance
    text = TOML.replace("[camera]\n", '[camera]\nfocus_from = "sensor"\n').replace("0.85", f"{mark:.6f}")
    (folder / "views.toml").write_text(text)
    assert load_settings("views.toml").lenses()[0].focus_distance == pytest.approx(0.85, abs=1e-5)


def test_two_distances_calibrate_where_the_pupil_lies():
    """With the focus scale and the f-number known, what is measured from the sensor tells the pupil's place."""
    lens = Lens(0.05, 4.0, 0.9)

    def reading(distance: float) -> Reading:
        return Reading(
            distance, 4.0, 0.95, 0.5 * float(lens.blur_radius(distance - PUPIL)) * lens.sensor_distance, 2e-8
        )

    priors = Priors(
        k=0.5, k_sd=0.02, f_number_sd=0.02, own_sd=0.01, focus_sd=0.005, focus_offset=-0.05, offset_sd=0.05,
        distance_sd=1e-3, model_error=0.002,
    )  # fmt: skip
    camera = calibrate([reading(d) for d in (0.45, 2.0)], 0.05, 5e-6, priors)
    assert camera.offset == pytest.approx(-PUPIL, abs=0.005)
    assert camera.sd[2] < 0.01
    one = calibrate([reading(0.45)], 0.05, 5e-6, priors)
    assert one.sd[2] > 1.5 * camera.sd[2]


def test_priors_follow_the_planes_that_are_named(tmp_path):
    text = (
        '[camera]\nfocal_length_mm = 50\npixel_pitch_um = 5\ndistances_from = "sensor"\nfocus_from = "sensor"\n'
        "{}[[view]]\nimage = 'a.png'\ndistance_m = 0.6\nf_number = 4\nfocus_distance_m = 1.0\n"
    )
    (tmp_path / "t.toml").write_text(text.format(""))
    priors = load_targets(tmp_path / "t.toml").priors
    assert priors.offset == pytest.approx(-Lens(0.05, 4, 1.0).sensor_distance)
    assert priors.focus_offset is None  # marks and distances count from the same plane
    (tmp_path / "t.toml").write_text(
        text.format("sensor_to_pupil_mm = 70\n").replace('from = "sensor"\nf', 'from = "entrance_pupil"\nf', 1)
    )
    priors = load_targets(tmp_path / "t.toml").priors
    assert (priors.offset, priors.focus_offset) == (0.0, pytest.approx(-0.07))


def test_telecentric_blur_is_counted_in_focal_lengths():
    lens = Lens(0.025, 8.0, 0.6)
    seen = [Reading(d, 8.0, 0.6, 0.5 * float(lens.blur_radius(d)) * 0.025, 1e-8) for d in (0.7, 0.9, 1.3, 2.0)]
    tight = {"k": 0.5, "offset_sd": 1e-3, "k_sd": 1e-3, "distance_sd": 1e-3, "own_sd": 1e-3}
    camera = calibrate(seen, 0.025, 5e-6, Priors(**tight, telecentric=True))
    assert camera.telecentric
    assert camera.f_numbers[8.0] == pytest.approx(8.0, rel=3e-3)
    held = Reading(1.0, 8.0, 0.6, 0.5 * float(lens.blur_radius(1.0)) * 0.025, 1e-8)
    assert camera.predict(held).distance == pytest.approx(1.0, abs=3e-3)
    thin = calibrate(seen, 0.025, 5e-6, Priors(**tight))
    assert thin.f_numbers[8.0] / camera.f_numbers[8.0] == pytest.approx(lens.sensor_distance / 0.025, rel=3e-3)
