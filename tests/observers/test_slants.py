"""Slant by blur and by two eyes, and disparity beside blur in the order of depth."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers import OBSERVERS, DepthOrder, Slant
from focalgradient.observers.disparities import disparity_at_places
from focalgradient.stimuli import slanted_plane, texture_border

DISPLAY = Display()
PPD = DISPLAY.pixels_per_degree
DEFAULT = OBSERVERS["default"]


@cache
def plane(slant, distance=0.3):
    size = {"width_deg": 9, "height_deg": 9, "pixels_per_degree": PPD}
    return slanted_plane(slant_deg=slant, distance_m=distance, **size)


def eyes(drawn, distance, interocular=0.063):
    """Views of the left and the right eye: each pixel moved by half the disparity of its vergence."""
    angle = np.degrees(interocular / 2 * (1 / drawn.depth_m - 1 / distance)) * PPD
    down, right = np.indices(drawn.shape)
    return [map_coordinates(drawn.picture, [down, right - side * angle], order=1, mode="reflect") for side in (1, -1)]


@pytest.mark.slow
def test_the_gradient_of_blur_gives_slant_and_not_its_direction():
    seen = [DEFAULT.look(plane(slant).picture, DISPLAY, Slant(distance_m=0.3)) for slant in (0, 70, 80)]
    assert seen[0].median_deg < 25
    assert seen[0].median_deg + 15 < seen[1].median_deg < seen[2].median_deg
    for one, true in zip(seen[1:], (70, 80), strict=True):
        assert abs(one.median_deg - true) < 2 * one.sd_deg
        assert one.along == pytest.approx(0.5, abs=0.05)
    blind = OBSERVERS["blur-blind"].look(plane(80).picture, DISPLAY, Slant(distance_m=0.3))
    flat = OBSERVERS["blur-blind"].look(plane(0).picture, DISPLAY, Slant(distance_m=0.3))
    assert blind.median_deg == pytest.approx(flat.median_deg, abs=1e-6)


def test_two_eyes_give_slant_its_amount_and_direction():
    drawn = plane(40, 0.57)
    left, right = eyes(drawn, 0.57)
    for question, along in ((Slant(distance_m=0.57, right=right), 1), (Slant(270, 0.57, right=right), 0)):
        seen = DEFAULT.look(left, DISPLAY, question)
        assert seen.median_deg == pytest.approx(40, abs=5)
        assert seen.along == pytest.approx(along, abs=0.02)
    flat = DEFAULT.look(drawn.picture, DISPLAY, Slant(distance_m=0.57, right=drawn.picture))
    assert flat.median_deg < 5


def test_fixated_at_one_end_what_is_blurred_is_farther_by_the_prior():
    drawn = plane(70)
    question = Slant(distance_m=0.3, fixation=(drawn.shape[1] / 2, drawn.shape[0] - 10))
    assert DEFAULT.look(drawn.picture, DISPLAY, question).along > 0.7
    assert OBSERVERS["opposite"].look(drawn.picture, DISPLAY, question).along < 0.3


def test_answers_of_slant_are_drawn_as_stated():
    seen = replace(DEFAULT.look(plane(80).picture, DISPLAY, Slant(distance_m=0.3)), along=0.75)
    drawn = np.array([seen.simulate(random) for random in [np.random.default_rng(1)] for _ in range(400)])
    assert np.mean(drawn > 0) == pytest.approx(0.75, abs=0.07)
    assert np.abs(drawn).max() <= 90


@pytest.mark.parametrize("pixels", [-4.0, 0.0, 2.5])
def test_disparity_is_found_to_a_part_of_a_pixel(pixels):
    random = np.random.default_rng(2).uniform(0.2, 0.8, (96, 160))
    down, right = np.indices(random.shape)
    other = map_coordinates(random, [down, right + pixels], order=3, mode="reflect")
    found = disparity_at_places(random, other, DISPLAY) / DISPLAY.arcmin(1.0)
    assert np.nanmedian(found) == pytest.approx(pixels, abs=0.15)


def test_disparity_decides_the_order_against_blur():
    size = {"width_deg": 6, "height_deg": 6, "pixels_per_degree": PPD}
    drawn = texture_border(right_blur_arcmin=4, border="straight", **size)
    first, second = drawn.masks["left"], drawn.masks["right"]
    down, right = np.indices(drawn.shape)

    def near(name, pixels):
        other = map_coordinates(drawn.picture, [down, right + pixels * first], order=3, mode="reflect")
        question = DepthOrder(first, second, right=other)
        return OBSERVERS[name].look(drawn.picture, DISPLAY, question).probability["first"]

    for name in ("default", "blur-blind"):
        assert near(name, 1.5) > 0.95  # crossed: the sharp side is nearer
        assert near(name, -1.5) < 0.1
    assert near("blur-blind", 0.0) == pytest.approx(0.5, abs=0.05)
    assert near("default", 0.0) > 0.9  # by blur


@pytest.mark.parametrize(
    ("question", "words"),
    [
        (Slant(distance_m=0.0), "distance_m"),
        (Slant(fixation=(64, 3)), "fixation"),
        (Slant(right=np.ones((64, 65))), "right has shape"),
    ],
)
def test_what_cannot_be_looked_at_is_refused(question, words):
    with pytest.raises(InputError, match=words):
        DEFAULT.look(np.random.default_rng(1).uniform(size=(64, 64)), DISPLAY, question)
