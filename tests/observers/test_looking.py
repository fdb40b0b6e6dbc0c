"""Looking without a layout: depth by blur alone, unbiased by texture, order at borders, thresholds with their dip."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers import (
    OBSERVERS,
    BlurDiscrimination,
    Choice,
    DepthOrder,
    FigureGround,
    blur_threshold,
    look,
)
from focalgradient.observers.borders import border_blur
from focalgradient.observers.front_end import own_blur, seen_by
from focalgradient.stimuli import blurred_edge, texture_border

FINE = Display(distance=Display().distance * 60 / Display().pixels_per_degree)
"""A display of about 60 pixels per degree."""


@cache
def halves(slope, observer, left=1.0, right=4.0):
    drawn = texture_border(
        left_blur_arcmin=left,
        right_blur_arcmin=right,
        border="straight",
        slope=slope,
        pixels_per_degree=FINE.pixels_per_degree,
        width_deg=5,
        height_deg=5,
        seed=2,
    )
    return look(drawn.picture, FINE, (60.0, 150.0), OBSERVERS[observer])


def test_two_halves_of_unequal_blur_have_depth_on_a_flat_display():
    seen = halves(1.0, "default")
    assert np.nanmedian(seen.depth[:, -3:]) - np.nanmedian(seen.depth[:, :3]) > 0.5
    assert np.nanmedian(halves(1.0, "opposite").depth[:, -3:]) < -0.5
    assert np.nanmax(np.abs(halves(1.0, "blur-blind").depth)) == 0


@pytest.mark.parametrize(("slope", "most"), [(0.75, 1.2), (1.0, 1.2), (1.25, 1.2), (1.5, 1.7)])
def test_a_sharp_texture_is_not_read_as_blurred_for_its_slope(slope, most):
    """Its blur is that of the sampling, half a pixel, whatever the slope; 1/f^1.5 reads half as much again."""
    seen = halves(slope, "default", 0.0, 1.0)
    assert 0.9 < np.nanmedian(seen.blur[:, :3]) / 0.5 < most
    assert 0.9 < np.nanmedian(seen.blur[:, -3:]) / np.hypot(1, 0.5) < most
    assert seen.texture_slope == pytest.approx(slope, abs=0.11)


@cache
def border(left, right, edge, seed=1):
    return texture_border(
        left_blur_arcmin=left,
        right_blur_arcmin=right,
        border_blur_arcmin=edge,
        pixels_per_degree=FINE.pixels_per_degree,
        width_deg=5,
        height_deg=5,
        seed=seed,
    )


def first_is_near(drawn, observer="default"):
    order = DepthOrder(drawn.masks["left"], drawn.masks["right"])
    return OBSERVERS[observer].look(drawn.picture, FINE, order).probability["first"]


def test_blur_of_a_border_is_read_whatever_the_blur_of_its_sides():
    for sides, edge in (((4, 4), 2.0), ((0, 4), 4.0), ((0, 4), 0.0), ((2, 2), 0.0)):
        drawn = border(*sides, edge)
        (seen,), _ = seen_by([drawn.picture], FINE, OBSERVERS["default"].pupil)
        own = own_blur(FINE.pixels_per_degree, OBSERVERS["default"].pupil)
        log, sd = border_blur(seen, drawn.masks["left"], drawn.masks["right"], own)
        assert abs(log - np.log(np.hypot(edge, 0.5))) < 2.5 * sd
        assert sd < 0.45


def test_the_border_belongs_to_the_side_of_its_blur():
    """Marshall et al. 1996: a sharp border puts the sharp side in front, a blurred one the blurred side."""
    sharp, blurred = first_is_near(border(0, 4, 0.0)), first_is_near(border(0, 4, 4.0))
    assert sharp > 0.9
    assert blurred < 0.5
    assert first_is_near(border(4, 0, 4.0)) > 0.5  # the same, with the sides exchanged


@pytest.mark.slow
def test_without_the_mechanism_the_order_is_open_and_with_the_other_prior_another():
    for edge in (0.0, 4.0):
        drawn = border(0, 4, edge)
        assert first_is_near(drawn, "blur-blind") == pytest.approx(0.5, abs=0.01)
        assert first_is_near(drawn, "opposite") < first_is_near(drawn) - 0.1


def test_regions_that_do_not_meet_are_ordered_by_blur_alone():
    drawn = border(0, 4, 4.0)
    columns = np.arange(drawn.shape[1])[None] + np.zeros(drawn.shape)
    apart = drawn.masks["left"] & (columns < 110), drawn.masks["right"] & (columns > 190)
    observer = replace(OBSERVERS["default"], lapses=0.0)
    near = observer.look(drawn.picture, FINE, DepthOrder(*apart)).probability["first"]
    assert near == pytest.approx((1 + 0.9 * 0.8) / 2, abs=0.03)  # surely more blurred, and farther by the prior
    with pytest.raises(InputError, match="do not meet"):
        observer.look(drawn.picture, FINE, FigureGround(*apart))


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("pedestal", [0.25, 1.0, 4.0])
def test_pictures_at_the_threshold_of_the_rule_are_told_apart_in_three_of_four(pedestal):
    """Seen as pixels, of an edge: the dipper comes of the pictures and is not put in."""
    step = blur_threshold(pedestal, OBSERVERS["default"])

    def more(increment):
        first, second = (
            blurred_edge(
                pedestal_arcmin=pedestal, increment_arcmin=i, pixels_per_degree=FINE.pixels_per_degree, side="nearer"
            ).picture
            for i in (increment, 0.0)
        )
        return OBSERVERS["default"].look(first, FINE, BlurDiscrimination(second)).probability["first"]

    assert more(0.0) == pytest.approx(0.5)
    assert 0.64 < more(step) < 0.89
    assert more(3 * step) > more(step) + 0.08


def test_answers_are_drawn_with_their_probabilities_and_a_guesser_guesses():
    random = np.random.default_rng(1)
    drawn = [Choice({"first": 0.8, "second": 0.2}).simulate(random) for _ in range(2000)]
    assert drawn.count("first") / 2000 == pytest.approx(0.8, abs=0.04)
    assert first_is_near(border(0, 4, 0.0), "guessing") == 0.5


@pytest.mark.parametrize(
    ("light", "question", "words"),
    [
        (np.ones((32, 32)), BlurDiscrimination(np.ones((32, 32))), "64 pixels or more"),
        (np.ones((64, 64)), DepthOrder(np.ones((8, 8), bool), np.ones((8, 8), bool)), "picture's shape"),
        (np.ones((64, 64)), BlurDiscrimination(np.ones((64, 64))), "cannot be estimated"),
    ],
)
def test_what_cannot_be_looked_at_is_refused(light, question, words):
    with pytest.raises(InputError, match=words):
        OBSERVERS["default"].look(light, FINE, question)


def test_the_threshold_dips_near_the_intrinsic_blur_and_follows_weber_far_above_it():
    observer = OBSERVERS["default"]
    pedestals = np.linspace(0, 3, 301)
    thresholds = [blur_threshold(blur, observer) for blur in pedestals]
    assert 0.3 < pedestals[int(np.argmin(thresholds))] < 0.5
    assert blur_threshold(1000.0, observer) == pytest.approx(0.4 * 1000, rel=1e-3)
