"""Blur measured at sharp edges: bias, error against the bound, stated error, and what is rejected."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr
from stepped import bar, image_of, step

from focalgradient.depth.edges.measure import average_segments, measure_edges
from focalgradient.depth.limits import edge_bound

ANGLES = (0.0, 0.4, np.pi / 4, 1.25, np.pi / 2, 2.2, 3.9, 5.5)
LONG = (64, 320)


def measured(sigma, *, contrast=0.5, noise=0.01, angles=ANGLES, shape=LONG, fit="likelihood", **settings):
    """Good points' sigma and its stated sd, over one image an angle; and the share of points that is good."""
    found, sd, good = [], [], []
    for seed, angle in enumerate(angles):
        lying = abs(np.cos(angle)) > np.sqrt(0.5)  # the frame's long side goes along the edge
        image = image_of(step(sigma, contrast), angle, shape[::-1] if lying else shape, noise=noise, seed=seed)
        edges = measure_edges(image, noise=noise, fit=fit, **settings)
        # Within half a band of the frame fewer pixels count.
        middle = [(side - 1) / 2 for side in image.shape]
        inside = np.abs(edges.row - middle[0]) < image.shape[0] / 2 - 10
        inside &= np.abs(edges.column - middle[1]) < image.shape[1] / 2 - 10
        good.append(edges.valid[inside])
        found.append(edges.radius[inside & edges.valid])
        sd.append(edges.radius_sd[inside & edges.valid])
    return np.concatenate(found), np.concatenate(sd), np.concatenate(good).mean()


def bound(sigma):
    """Least standard deviation of sigma, in pixels, from the 16 rows that a point of an edge is measured on."""
    return sigma * float(edge_bound(sigma, noise=0.01, contrast=0.5, length=16))


@pytest.mark.slow
@pytest.mark.parametrize("sigma", [1.0, 2.0, 4.0])
def test_likelihood_is_near_the_bound_at_any_orientation(sigma):
    found, sd, good = measured(sigma)
    assert abs(found.mean() / sigma - 1) < 0.01
    assert np.sqrt(np.mean((found - sigma) ** 2)) < 1.25 * bound(sigma)
    assert 0.9 < np.mean(np.abs(found - sigma) < 2 * sd) < 0.99
    assert good > 0.999


@pytest.mark.slow
@pytest.mark.parametrize("sigma", [1.0, 2.0, 4.0])
def test_the_papers_regression_is_led_by_the_points_that_know_least(sigma):
    plain, _, _ = measured(sigma, angles=ANGLES[::2], fit="paper")
    error = np.sqrt(np.mean((plain - sigma) ** 2))
    assert error > {1.0: 1.1, 2.0: 1.5, 4.0: 3.0}[sigma] * bound(sigma)


def test_the_regression_states_how_noise_scatters_it():
    found, sd, _ = measured(2.0, noise=0.003, angles=(0.0,) * 8, fit="paper")
    assert found.std() == pytest.approx(np.median(sd), rel=0.25)


def test_regression_without_noise_tells_the_widths_it_removes():
    # Operator, pixel, smoothing and bins would make 1 px into 1.2 or more.
    for angle in (0.0, 0.4, np.pi / 4):
        edges = measure_edges(image_of(step(1.0), angle, (64, 64), noise=1e-4), fit="paper")
        assert np.median(edges.radius[edges.valid]) == pytest.approx(1.0, rel=5e-3)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(
    sigma=st.floats(0.8, 5.0),
    angle=st.floats(0.0, 2 * np.pi),
    contrast=st.floats(0.1, 0.9),
    at=st.floats(-0.5, 0.5),
    seed=st.integers(0, 1000),
)
def test_any_step_comes_back(sigma, angle, contrast, at, seed):
    noise = 0.02 * contrast
    edges = measure_edges(image_of(step(sigma, contrast, at), angle, (80, 80), noise=noise, seed=seed))
    assert edges.valid.mean() > 0.85  # not where a contour leaves the frame
    good = edges.valid
    assert np.median(edges.radius[good]) == pytest.approx(sigma, rel=0.05)
    assert np.median(edges.high[good] - edges.low[good]) == pytest.approx(contrast, rel=0.02)
    assert np.abs(np.exp(1j * edges.angle[good]) - np.exp(1j * angle)).max() < 0.3
    along = (edges.column - 39.5) * np.cos(angle) + (edges.row - 39.5) * np.sin(angle)
    assert np.median(along[good]) == pytest.approx(at, abs=0.3)


def test_polarity_exposure_and_transposition_change_nothing():
    image = image_of(step(2.0), 0.4, (64, 64)).astype(float)
    edges = measure_edges(image)
    brighter = measure_edges(3.0 * image + 7.0)
    assert brighter.radius == pytest.approx(edges.radius, rel=2e-3)
    inverted, turned = measure_edges(1 - image), measure_edges(image.T.copy())
    for other in (inverted, turned):
        assert np.median(other.radius) == pytest.approx(np.median(edges.radius), rel=5e-3)
    assert np.cos(np.median(inverted.angle) - np.median(edges.angle)) == pytest.approx(-1, abs=1e-3)
    assert np.median(turned.angle) == pytest.approx(np.pi / 2 - 0.4, abs=0.05)


@pytest.mark.slow
def test_the_radius_of_a_disc_is_found_with_the_model_of_discs():
    # The edge spread of a uniform disc, integrated from its chords here: no closed form.
    chord = np.linspace(-1, 1, 20001)
    spread = np.cumsum(np.sqrt(1 - chord**2))
    for radius in (1.5, 3.0, 6.0):
        image = image_of(
            lambda x, r=radius: 0.25 + 0.5 * np.interp(x / r, chord, spread / spread[-1]), 0.6, (96, 96), noise=0.005
        )
        edges = measure_edges(image, psf="disc")
        assert edges.valid.all()
        assert np.median(edges.radius) == pytest.approx(radius, rel=0.015)
    # The Gaussian has the disc's second moment at about half the radius; the paper's line knows that one only.
    assert np.median(measure_edges(image, k=0.5).radius) == pytest.approx(6.0, rel=0.15)
    assert np.nanmedian(measure_edges(image, psf="disc", fit="paper").radius) == pytest.approx(6.0, rel=0.15)


def test_false_alarms_are_as_many_as_stated():
    # So faint that what is granted to lenses is little beside the noise.
    for p in (0.05, 0.2):
        for settings_ in ({}, {"noise": 0.02}):
            rejected = [
                ~measure_edges(
                    image_of(step(2.0, 0.12), angle, (200, 64), noise=0.02, seed=seed), false_alarm=p, **settings_
                ).valid
                for seed, angle in enumerate([0.0, 0.2, -0.3] * 4)
            ]
            assert 0.4 * p < np.concatenate(rejected).mean() < 1.2 * p


@pytest.mark.parametrize(
    "profile",
    [
        pytest.param(bar(2.0, 2.0), id="line"),
        pytest.param(bar(2.0, 6.0), id="bar"),
        pytest.param(bar(2.0, 9.0), id="edges close together"),
        pytest.param(lambda x: 0.5 + 0.25 * np.clip(x / 30, -1, 1), id="ramp between levels"),
        pytest.param(lambda x: 0.5 + 0.005 * x, id="ramp without end"),
        pytest.param(lambda x: 0.5 + 0.2 * np.sin(x / 4), id="waves"),
        pytest.param(lambda x: 0.5 + 0.3 * np.exp(-np.abs(x) / 6), id="ridge"),
    ],
)
def test_what_is_no_lone_sharp_edge_is_rejected(profile):
    for seed, angle in enumerate((0.0, 0.5, 2.0)):
        edges = measure_edges(image_of(profile, angle, (96, 96), seed=seed))
        assert edges.valid.sum() < 0.05 * max(len(edges.valid), 20)


def test_a_neighbour_that_is_let_pass_does_no_harm():
    for distance in (10.0, 12.0, 16.0, 24.0):
        image = image_of(lambda x, d=distance: bar(2.0, d)(x), 0.3, (96, 128), noise=0.01)
        edges = measure_edges(image)
        if edges.valid.any():
            assert np.median(edges.radius[edges.valid]) == pytest.approx(2.0, rel=0.04)
    assert edges.valid.all()


def test_curved_edges_and_corners():
    row, column = np.mgrid[:120, :120]
    for radius in (15, 40):  # of a bright disc, its edge 2 px of blur
        edges = measure_edges(
            0.2
            + 0.6 * ndtr((radius - np.hypot(column - 60.2, row - 59.7)) / np.hypot(2.0, np.sqrt(1 / 12)))
            + 0.01 * np.random.default_rng(0).standard_normal((120, 120))
        )
        assert edges.segment.max() == 0  # one contour, all around
        assert np.median(edges.radius[edges.valid]) == pytest.approx(2.0, rel=0.03)
    square = [ndtr((30 - np.abs(v - 59.5)) / np.hypot(2.0, np.sqrt(1 / 12))) for v in (row, column)]
    edges = measure_edges(
        0.2 + 0.6 * square[0] * square[1] + 0.01 * np.random.default_rng(0).standard_normal(row.shape)
    )
    sides = np.unique(edges.segment)
    assert len(sides) == 4  # cut at the corners
    for side in sides:
        direction = np.exp(1j * edges.angle[(edges.segment == side) & edges.valid])
        assert np.abs(direction / direction.mean() - 1).max() < 0.1
    assert np.median(edges.radius[edges.valid]) == pytest.approx(2.0, rel=0.02)


def test_a_segment_that_recedes_is_fitted_by_a_line():
    # Blur grows from 2 to 4 px along 200 px.
    row, column = np.mgrid[:200, :80]
    sigma = 2 + row / 100
    image = 0.25 + 0.5 * ndtr((column - 39.7) / np.hypot(sigma, np.sqrt(1 / 12)))
    edges = measure_edges(image + 0.01 * np.random.default_rng(1).standard_normal(image.shape))
    whole = average_segments(edges, 16)
    true = 2 + whole.row / 100
    assert np.abs(whole.radius / true - 1).max() < 0.04
    assert np.mean(np.abs(whole.radius - true) < 2 * whole.radius_sd) > 0.8
    assert whole.radius_sd.max() < 0.7 * np.median(edges.radius_sd)
