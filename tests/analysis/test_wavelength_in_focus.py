"""The wavelength in focus of a mixture, by each rule."""

import numpy as np
import pytest
import wavelength_in_focus as mixed


def test_luminance_and_colour_go_from_the_red_to_the_blue_light():
    red, blue = (mixed.Mixture(share) for share in (0.0, 1.0))
    for rule in (mixed.by_luminance, mixed.by_colour):
        assert mixed.wavelength(rule(red)) > 595  # the display's red is about 610 nm
        assert mixed.wavelength(rule(blue)) < 490
    # L and M cones see the mixture's red still where the opponent channel, with S cones, sees its blue.
    both = mixed.Mixture(0.3)
    assert mixed.by_luminance(both) - mixed.by_colour(both) > 0.8


def test_accommodation_settles_where_what_it_misses_falls_through_nothing():
    focus = np.array([-1.0, -0.5, 0.0, 0.5])
    assert mixed._root(focus, np.array([0.5, 0.25, -0.25, -0.5])) == pytest.approx(-0.25)
    assert np.isnan(mixed._root(focus, np.array([-0.5, -0.25, 0.25, 0.5])))
    assert mixed._draw({name: [580.0] * len(mixed.SHARES) for name in mixed.RULES}).axes


@pytest.mark.slow
def test_depth_taken_for_white_leaves_about_580_nm_in_focus_in_any_mixture():
    for share in (0.15, 0.7):
        assert abs(mixed.by_depth(mixed.Mixture(share), seeds=2)) < 0.15
