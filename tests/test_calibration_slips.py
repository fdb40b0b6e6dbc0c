"""Slips in what is stated of a target are named, and right statements are not called wrong."""

import math
from dataclasses import replace

import numpy as np
import pytest

from focalgradient import Lens
from focalgradient.calibration import EDGE_K, Prediction, Reading, likeliest_slips, prediction_errors

FOCAL, PITCH = 0.025, 8e-6


def camera(seed, distances=(0.5, 0.7, 1.1, 2.0), stops=(8.0, 16.0), mark=None):
    """Readings of a camera with marks off by some per cent, an offset, and a model error of 1 %."""
    random = np.random.default_rng(seed)
    offset, focus = random.normal(0, 0.04), 0.35 * math.exp(random.normal(0, 0.05))
    k = EDGE_K * math.exp(random.normal(0, 0.03))
    readings = []
    for stop in stops:
        lens = Lens(FOCAL, stop * math.exp(random.normal(0, 0.04)), focus)
        for distance in distances:
            radius = k * float(lens.blur_radius(distance + offset)) * lens.sensor_distance
            width = math.hypot(radius, 0.6 * PITCH) * math.exp(random.normal(0, 0.01))
            readings.append(Reading(distance, stop, mark, width, 0.02 * PITCH))
    return readings


def exchanged(readings, name, one, other):
    turned = {one: other, other: one}
    return [replace(r, **{name: turned.get(getattr(r, name), getattr(r, name))}) for r in readings]


def scaled(readings, name, factor):
    return [replace(r, **{name: factor * getattr(r, name)}) for r in readings]


@pytest.mark.parametrize("seed", range(6))
def test_right_statements_pass(seed):
    assert likeliest_slips(camera(seed, mark=0.33 if seed % 2 else None), FOCAL, PITCH) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("slip", "named"),
    [
        (lambda r: scaled(r, "distance", 100), "distances in centimetres"),
        (lambda r: exchanged(r, "distance", 0.7, 1.1), "the distances 0.7 m and 1.1 m exchanged"),
        (lambda r: exchanged(r, "f_number", 8.0, 16.0), "the f-numbers f/8 and f/16 exchanged"),
        (lambda r: scaled(r, "width", 0.5), "a pixel pitch of 8 um"),
        (lambda r: exchanged(r[:4], "distance", 0.5, 2.0) + r[4:], "0.5 m and 2 m exchanged at f/8"),
        (lambda r: [replace(r[0], f_number=16.0), *r[1:4], replace(r[4], f_number=8.0), *r[5:]], "exchanged at 0.5 m"),
    ],
)
def test_a_slip_is_named(slip, named):
    readings = slip(camera(1))
    pitch = PITCH / 2 if named.startswith("a pixel") else PITCH
    assert named in likeliest_slips(readings, FOCAL, pitch)[0].text


@pytest.mark.slow
def test_one_distance_measured_wrongly_is_named():
    """A tape that was read at 0.53 m instead of 0.7 m looks like an exchange or another pixel pitch."""
    readings = [replace(r, distance=0.525) if r.distance == 0.7 else r for r in camera(1)]
    slips = likeliest_slips(readings, FOCAL, PITCH)
    assert slips[0].text.startswith("another distance than 0.525 m")


@pytest.mark.slow
def test_focus_marks_in_centimetres():
    slips = likeliest_slips(scaled(camera(2, mark=0.33), "focus_distance", 100), FOCAL, PITCH)
    assert any("focus marks in centimetres" in slip.text for slip in slips)


def test_a_prediction_is_compared_with_the_mean_of_the_others():
    readings = camera(0, distances=(0.5, 1.0), stops=(8.0,))
    right = [Prediction(2.0, 0.1, 0.5, 0.02), Prediction(1.2, 0.1, 0.83, 0.02)]
    predicted, stated, by_mean = prediction_errors(readings, right, 0.0)
    assert (predicted, stated, by_mean) == pytest.approx((0.2 / math.sqrt(2), 0.1, 1.0))
    assert all(math.isnan(value) for value in prediction_errors(readings, [None, None], 0.0))
